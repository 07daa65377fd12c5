// Purpose: shortens the moves of vertices at spoiled triangles.
// Invocation: one listed vertex.
// Reads: counters (which of them), held.
// Writes: moves, the share of them that is made.
// Filled by fit/spoiled and fit/hold; consumed by fit/hold and fit/accept.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"

layout(push_constant) uniform Push {
    float share; // of the former share
};
layout(set = 0, binding = 0) readonly buffer Counters { uint counters[]; };
layout(set = 0, binding = 1) readonly buffer Held { uint held[]; };
layout(set = 0, binding = 2) buffer Moves { vec4 moves[]; };

void main() {
    uint i = counters[1] + thread_index();
    if (i >= counters[2]) return;
    moves[held[i]].w *= share;
}
