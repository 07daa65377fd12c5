// Purpose: the next direction of the solver.
// Invocation: one vertex.
// Reads: preconditioned, scalars.
// Writes: direction.
// Filled by fit/descend and fit/scalars; consumed by fit/apply.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_VEC4(0, Preconditioned, preconditioned);
layout(set = 0, binding = 1) readonly buffer Scalars { float scalars[]; };
layout(set = 0, binding = 2) buffer Direction { vec4 direction[]; };

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    direction[v] = AT(preconditioned, v) + scalars[2] * direction[v];
}
