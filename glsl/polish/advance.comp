// Purpose: makes what was appended to a list the part that the next dispatches work on.
// Invocation: one in all.
// Reads: counters[0], the length of the list.
// Writes: counters[1] and counters[2], where the part begins and ends; groups[0], the workgroups for it.
// Filled by polish/wanted, polish/folded and polish/spread; consumed by indirect dispatches.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 1
#include "common/threads.glsl"

layout(push_constant) uniform Push {
    uint workgroup;   // of the dispatches
    uint most_groups; // along x
};
layout(set = 0, binding = 0) buffer Counters { uint counters[]; };
layout(set = 0, binding = 1) writeonly buffer Groups { uvec4 groups[]; };

void main() {
    if (thread_index() != 0u) return;
    uint begin = counters[2], end = counters[0];
    counters[1] = begin;
    counters[2] = end;
    uint needed = (end - begin + workgroup - 1u) / workgroup;
    uint x = clamp(needed, 1u, most_groups);
    groups[0] = uvec4(x, (needed + x - 1u) / x, 1u, 0u);
}
