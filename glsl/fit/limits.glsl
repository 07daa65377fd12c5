// Moves of the fit that would spoil a triangle; as src/polish/fit/mod.rs. Include after declaring positions,
// corners, moves, marks, held and counters.
#ifndef FIT_LIMITS_GLSL
#define FIT_LIMITS_GLSL
#include "fit/angles.glsl"
#include "polish/shape.glsl"

// Angles below the bound may lose so much in a round, and those above a right angle gain; in radians.
const float LOSS = 0.0087266463;
const float RIGHT_ANGLE = 1.5707963;

// Whether the moves fold or flatten triangle t, or make its angles worse than they may get: below `least` and
// above a right angle they lose and gain little, and never pass the worst of the mesh.
bool is_spoiled(uint t, float least) {
    uvec3 v = uvec3(corners[3u * t], corners[3u * t + 1u], corners[3u * t + 2u]);
    vec4 to_a = AT(moves, v.x), to_b = AT(moves, v.y), to_c = AT(moves, v.z);
    vec3 a = AT(positions, v.x).xyz, b = AT(positions, v.y).xyz, c = AT(positions, v.z).xyz;
    vec3 new_a = a + to_a.w * to_a.xyz, new_b = b + to_b.w * to_b.xyz, new_c = c + to_c.w * to_c.xyz;
    if (new_a == a && new_b == b && new_c == c) return false;
    vec2 was = extreme_angles(a, b, c), now = extreme_angles(new_a, new_b, new_c);
    float smallest = uintBitsToFloat(counters[SMALLEST]);
    float largest = max(uintBitsToFloat(counters[LARGEST]), RIGHT_ANGLE);
    bool flatter = now.x < max(smallest, least) && now.x < min(max(smallest, was.x - LOSS), was.x);
    bool wider = now.y > RIGHT_ANGLE && now.y > max(min(largest, was.y + LOSS), was.y);
    return flatter || wider || folds_or_flattens(a, b, c, new_a, new_b, new_c, cross(b - a, c - a));
}

// Lists the corners of a spoiled triangle that move, each once a pass. The list's order differs from run to
// run, its content does not.
void hold_corners(uint t, uint pass) {
    uint k = 0u;
    do {
        uint v = corners[3u * t + k];
        if (AT(moves, v).w > 0.0 && atomicMax(marks[v], pass) < pass) held[atomicAdd(counters[0], 1u)] = v;
    } while (++k < 3u);
}

#endif
