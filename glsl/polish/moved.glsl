// Moves that may be undone because a triangle folds or becomes flat; as src/polish/relax.rs. Include after
// declaring positions, corners, moved and stamps.
#ifndef POLISH_MOVED_GLSL
#define POLISH_MOVED_GLSL
#include "polish/normals.glsl"
#include "polish/shape.glsl"
#include "polish/stamps.glsl"

// Whether triangle t turns away from its vertices' normals or becomes flat by the moves, less those that were
// undone before this pass. A triangle that was so before may stay so. Stamps of this pass may come in
// meanwhile, and are the same as none.
bool is_spoiled(uint t, uint pass) {
    uvec3 v = uvec3(corners[3u * t], corners[3u * t + 1u], corners[3u * t + 2u]);
    uvec4 to_a = AT(moved, v.x), to_b = AT(moved, v.y), to_c = AT(moved, v.z);
    vec3 a = AT(positions, v.x).xyz, b = AT(positions, v.y).xyz, c = AT(positions, v.z).xyz;
    vec3 new_a = stamps[v.x] < pass ? a : uintBitsToFloat(to_a.xyz);
    vec3 new_b = stamps[v.y] < pass ? b : uintBitsToFloat(to_b.xyz);
    vec3 new_c = stamps[v.z] < pass ? c : uintBitsToFloat(to_c.xyz);
    vec3 up = normal_or_zero(to_a.w) + normal_or_zero(to_b.w) + normal_or_zero(to_c.w);
    bool still = new_a == a && new_b == b && new_c == c;
    return !still && folds_or_flattens(a, b, c, new_a, new_b, new_c, up);
}

#endif
