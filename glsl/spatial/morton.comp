// Purpose: Morton codes, so that sorting by them puts neighbours in space next to each other in memory.
// Invocation: one point.
// Reads: points, in the unit-diagonal frame.
// Writes: keys[point], 10 bits an axis over the cube of edge 1.02 around the origin (points outside
// are clamped to it), and values[point] = point.
// Filled by seeding or the step; consumed by spatial/radix_count and radix_scatter.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push { uint point_count; };
READ_VEC4(0, Points, points);
layout(set = 0, binding = 1) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 2) writeonly buffer Values { uint values[]; };

// Puts two zero bits after each of the low 10 bits.
uvec3 spread(uvec3 x) {
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

void main() {
    uint point = thread_index();
    if (point >= point_count) return;
    vec3 cell = clamp((AT(points, point).xyz + 0.51) * (1024.0 / 1.02), vec3(0.0), vec3(1023.0));
    uvec3 bits = spread(uvec3(cell));
    keys[point] = bits.x | bits.y << 1 | bits.z << 2;
    values[point] = point;
}
