// Purpose: moves the vertices; none if holding them back did not come to an end.
// Invocation: one vertex.
// Reads: moves (w = the share that is made), counters.
// Writes: positions; counters[3], how many moves were shortened so far.
// Filled by fit/clamp, fit/shorten and fit/hold; consumed by the next round.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_VEC4(0, Moves, moves);
layout(set = 0, binding = 1) buffer Positions { vec4 positions[]; };
layout(set = 0, binding = 2) buffer Counters { uint counters[]; };

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec4 move = AT(moves, v);
    bool ended = counters[0] == counters[2];
    if (ended) positions[v].xyz += move.w * move.xyz;
    if (!ended || move.w < 1.0) atomicAdd(counters[3], 1u);
}
