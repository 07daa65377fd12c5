// Purpose: the mesh's smallest and largest angle.
// Invocation: one triangle.
// Reads: positions, corners.
// Writes: counters[SMALLEST] and counters[LARGEST], the bits of both in radians; before, they are those of a
// large number and of 0. Bits of numbers that are not negative compare as these do, so the result does not
// depend on the order.
// Filled by polish/* and the host; consumed by fit/spoiled and fit/hold.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "fit/angles.glsl"

layout(push_constant) uniform Push { uint triangle_count; };
READ_VEC4(0, Positions, positions);
layout(set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 2) buffer Counters { uint counters[]; };

shared uint group_smallest, group_largest;

void main() {
    uint t = thread_index();
    bool is_first = gl_LocalInvocationID.x == 0u;
    if (is_first) {
        group_smallest = 0xffffffffu;
        group_largest = 0u;
    }
    barrier();
    if (t < triangle_count) {
        vec3 a = AT(positions, corners[3u * t]).xyz, b = AT(positions, corners[3u * t + 1u]).xyz;
        uvec2 angles = floatBitsToUint(extreme_angles(a, b, AT(positions, corners[3u * t + 2u]).xyz));
        atomicMin(group_smallest, angles.x);
        atomicMax(group_largest, angles.y);
    }
    barrier();
    if (is_first) {
        atomicMin(counters[SMALLEST], group_smallest);
        atomicMax(counters[LARGEST], group_largest);
    }
}
