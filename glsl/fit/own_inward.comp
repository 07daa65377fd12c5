// Purpose: adds the samples at the surface's vertices to the diagonal and the right-hand side.
// Invocation: one vertex.
// Reads: firsts, twins, ranges, order (samples by triangle), inward_samples, inward_weights.
// Writes: own, right.
// Filled by fit/own_edges, fit/segments and spatial/radix_scatter; consumed by the solver.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/half_edges.glsl"
#include "fit/symmetric.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
layout(set = 0, binding = 0) readonly buffer Firsts { uint firsts[]; };
layout(set = 0, binding = 1) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 2) readonly buffer Ranges { uint ranges[]; };
layout(set = 0, binding = 3) readonly buffer Order { uint order[]; };
READ_VEC4(4, InwardSamples, inward_samples);
READ_VEC2(5, InwardWeights, inward_weights);
layout(set = 0, binding = 6) buffer Own { vec4 own[]; };
layout(set = 0, binding = 7) buffer Right { vec4 right[]; };

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec4 head = own[2u * v], tail = own[2u * v + 1u];
    uint first = firsts[v];
    if (head.x == 0.0) return;
    Symmetric m = Symmetric(head.xyz, vec3(head.w, tail.xy));
    vec3 r = right[v].xyz;
    for (uint h = first; h != NONE;) {
        uint t = h / 3u, corner = h - 3u * t;
        uint end = ranges[2u * t + 1u];
        for (uint i = ranges[2u * t]; i < end; ++i) {
            uint at = order[i];
            vec4 inward = AT(inward_samples, at);
            vec2 w = AT2(inward_weights, at);
            float weight = corner == 0u ? 1.0 - w.x - w.y : corner == 1u ? w.x : w.y;
            add_outer(m, inward.xyz, weight * weight);
            r += weight * inward.w * inward.xyz;
        }
        h = twins[previous_half_edge(h)];
        h = h == first ? NONE : h;
    }
    own[2u * v] = vec4(m.on, m.off.x);
    own[2u * v + 1u] = vec4(m.off.yz, 0.0, 0.0);
    right[v] = vec4(r, 0.0);
}
