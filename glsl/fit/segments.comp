// Purpose: where the samples of each triangle are among the sorted ones.
// Invocation: one sorted sample.
// Reads: keys.
// Writes: ranges[2 * t] and ranges[2 * t + 1], where those of triangle t begin and end; 0 before.
// Filled by spatial/radix_scatter; consumed by fit/own_inward and fit/blocks_inward.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"

layout(push_constant) uniform Push {
    uint point_count;
    uint triangle_count;
};
layout(set = 0, binding = 0) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 1) writeonly buffer Ranges { uint ranges[]; };

void main() {
    uint i = thread_index();
    if (i >= point_count) return;
    uint t = keys[i];
    if (t >= triangle_count) return;
    if (i == 0u || keys[i - 1u] != t) ranges[2u * t] = i;
    if (i + 1u == point_count || keys[i + 1u] != t) ranges[2u * t + 1u] = i + 1u;
}
