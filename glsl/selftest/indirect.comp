// Purpose: dispatches whose size the device decides on in the same submission.
// Invocation: one mark; or one element of groups.
// Reads: counters of selftest/atomics.
// Writes: marks[invocation], the invocation and the number of the dispatch; if that is 0, groups = none, and
// rows of workgroups where all elements were counted.
// Filled by selftest/atomics; groups are consumed by later dispatches of this kernel, marks are checked in
// src/gpu/selftest on the host.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"

layout(push_constant) uniform Push {
    uint number; // of the dispatch
    uint mark_count;
    uint element_count;
    uint columns;
    uint rows;
};
layout(set = 0, binding = 0) readonly buffer Counters { uint counters[]; };
layout(set = 0, binding = 1) writeonly buffer Groups { uvec4 groups[]; };
layout(set = 0, binding = 2) writeonly buffer Marks { uint marks[]; };

void main() {
    uint i = thread_index();
    if (number > 0u) {
        if (i < mark_count) marks[i] = 16u * i + number;
    } else if (i < 2u) {
        uvec2 size = counters[0] == element_count ? uvec2(columns, rows) : uvec2(1u);
        groups[i] = i == 0u ? uvec4(0u) : uvec4(size, 1u, 0u);
    }
}
