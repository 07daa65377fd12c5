// Purpose: how many workgroups exact/walked needs, without the host.
// Invocation: one in all.
// Reads: counters[0], the number of undecided triangles.
// Writes: groups, for an indirect dispatch.
// Filled by exact/listed; consumed by the indirect dispatch of exact/walked.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 1
#include "common/threads.glsl"

layout(push_constant) uniform Push {
    uint group_size; // invocations of a workgroup of exact/walked
    uint most_x;     // workgroups before they are folded into y
};
layout(set = 0, binding = 0) readonly buffer Counters { uint counters[]; };
layout(set = 0, binding = 1) writeonly buffer Groups { uvec4 groups[]; };

void main() {
    if (thread_index() != 0u) return;
    uint needed = (counters[0] + group_size - 1u) / group_size;
    uint x = min(needed, most_x);
    groups[0] = uvec4(x, x > 0u ? (needed + x - 1u) / x : 0u, 1u, 0u);
}
