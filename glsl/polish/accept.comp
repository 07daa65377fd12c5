// Purpose: moves the vertices whose moves stand; none if undoing did not come to an end.
// Invocation: one vertex.
// Reads: moved, stamps, counters.
// Writes: positions; counters[3], how many moves were undone so far.
// Filled by polish/land, polish/folded and polish/spread; consumed by the next round and fit/*.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "polish/stamps.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_UVEC4(0, Moved, moved);
layout(set = 0, binding = 1) readonly buffer Stamps { uint stamps[]; };
layout(set = 0, binding = 2) buffer Positions { vec4 positions[]; };
layout(set = 0, binding = 3) buffer Counters { uint counters[]; };

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec4 here = positions[v];
    vec3 to = uintBitsToFloat(AT(moved, v).xyz);
    bool ended = counters[0] == counters[2];
    if (to == here.xyz) return;
    if (ended && stamps[v] == STANDS)
        positions[v] = vec4(to, here.w);
    else
        atomicAdd(counters[3], 1u);
}
