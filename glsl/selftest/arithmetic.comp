// Purpose: floating-point and integer arithmetic of the other kernels, one operation for each result.
// Invocation: one result of one element; PADDED elements for each operation, of which `count` are there.
// Reads: numbers (x and y positive), words.
// Writes: reals[operation * PADDED + element], integers likewise.
// Filled by and checked in src/gpu/selftest on the host. An invocation writes one result of all that it
// could, because a CPU's driver takes longest to compile writes.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

// A constant of the pipeline.
layout(constant_id = 1) const uint SHIFT = 0;

layout(push_constant) uniform Push {
    uint count;
    float factor;
};
READ_VEC4(0, Numbers, numbers);
READ_UVEC4(1, Words, words);
layout(set = 0, binding = 2) writeonly buffer Reals { float reals[]; };
layout(set = 0, binding = 3) writeonly buffer Integers { uint integers[]; };

const uint PADDED = 256u;

void main() {
    uint i = thread_index(), element = i % PADDED, operation = i / PADDED;
    if (element >= count || operation >= 16u) return;
    vec4 number = AT(numbers, element);
    float x = number.x, y = number.y, z = number.z, w = number.w;
    vec3 a = number.xyz, b = number.wxy;
    float real = x + y;
    if (operation == 1u) real = x - z;
    if (operation == 2u) real = y * z * factor;
    if (operation == 3u) real = z / x;
    if (operation == 4u) real = sqrt(x);
    if (operation == 5u) real = inversesqrt(y);
    if (operation == 6u) real = min(x, z) + 2.0 * max(y, w);
    if (operation == 7u) real = floor(z) + 10.0 * ceil(w);
    if (operation == 8u) real = abs(z) + 3.0 * sign(w);
    if (operation == 9u) real = dot(a, b);
    if (operation == 10u) real = length(cross(a, b));
    if (operation == 11u) real = normalize(a).z;
    if (operation == 12u) real = mix(x, y, 0.25) + clamp(w, -1.0, 1.0);
    if (operation == 13u) real = float(int(z * 8.0)) + float(uint(x * 8.0));
    if (operation == 14u) real = uintBitsToFloat(floatBitsToUint(w) ^ 0x80000000u);
    if (operation == 15u) real = unpackSnorm2x16(packSnorm2x16(0.25 * vec2(z, w))).y;
    reals[i] = real;

    uint p = AT(words, element).x, q = AT(words, element).y, small = (q >> 16) | 1u, integer = p + q;
    if (operation == 1u) integer = p - q;
    if (operation == 2u) integer = p * q;
    if (operation == 3u) integer = p / small;
    if (operation == 4u) integer = p % small;
    if (operation == 5u) integer = (p >> 7) ^ (q << 3);
    if (operation == 6u) integer = uint(int(p) >> SHIFT);
    if (operation == 7u) integer = (p & q) | ~p;
    if (operation == 8u) integer = uint(10000 * bitCount(p) + 100 * findLSB(q) + findMSB(p));
    if (operation == 9u) integer = min(p, q) ^ (max(p, q) << 1);
    if (operation >= 10u) {
        integer = (x < y ? 1u : 0u) | (z < w ? 2u : 0u) | (p < q ? 4u : 0u) | (int(p) < int(q) ? 8u : 0u) |
                  (z >= 0.0 && w >= 0.0 ? 16u : 0u);
    }
    integers[i] = integer;
}
