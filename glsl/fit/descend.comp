// Purpose: a step of the solver along the direction; the residual in the preconditioner's norm.
// Invocation: one vertex.
// Reads: own, direction, product, scalars.
// Writes: moves, residual, preconditioned (the residual, by the inverse of the blocks on the diagonal);
// partials, a sum for each workgroup.
// Filled by fit/apply and fit/scalars; consumed by fit/scalars and fit/turn.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "fit/partials.glsl"
#include "fit/symmetric.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_VEC4(0, Own, own);
READ_VEC4(1, Direction, direction);
READ_VEC4(2, Product, product);
layout(set = 0, binding = 3) readonly buffer Scalars { float scalars[]; };
layout(set = 0, binding = 4) buffer Moves { vec4 moves[]; };
layout(set = 0, binding = 5) buffer Residual { vec4 residual[]; };
layout(set = 0, binding = 6) writeonly buffer Preconditioned { vec4 preconditioned[]; };
layout(set = 0, binding = 7) writeonly buffer Partials { float partials[]; };

void main() {
    uint v = thread_index();
    float part = 0.0;
    if (v < vertex_count) {
        vec4 head = AT(own, 2u * v), tail = AT(own, 2u * v + 1u);
        float len = scalars[1];
        moves[v] += len * AT(direction, v);
        vec3 r = residual[v].xyz - len * AT(product, v).xyz;
        residual[v] = vec4(r, 0.0);
        vec3 z = solve(Symmetric(head.xyz, vec3(head.w, tail.xy)), r);
        preconditioned[v] = vec4(z, 0.0);
        part = dot(r, z);
    }
    float sum = workgroup_sum(part);
    if (gl_LocalInvocationID.x == 0u) partials[group_index()] = sum;
}
