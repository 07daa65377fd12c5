// Purpose: shortens moves that are too long for the faces around.
// Invocation: one vertex.
// Reads: frames (w = a third of the area around).
// Writes: moves, w = 1, the share of the move that is made; marks, all 0.
// Filled by fit/descend; consumed by fit/spoiled.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_VEC4(0, Frames, frames);
layout(set = 0, binding = 1) buffer Moves { vec4 moves[]; };
layout(set = 0, binding = 2) writeonly buffer Marks { uint marks[]; };

// Largest move over the size of the faces around.
const float MAX_MOVE = 0.5;

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec3 move = moves[v].xyz;
    float most = MAX_MOVE * sqrt(AT(frames, v).w), len = length(move);
    moves[v] = vec4(len > most ? move * (most / len) : move, 1.0);
    marks[v] = 0u;
}
