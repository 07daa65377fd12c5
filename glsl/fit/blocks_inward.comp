// Purpose: adds the samples at the surface's vertices to the blocks beside the diagonal.
// Invocation: one edge.
// Reads: edges, twins, ranges, order (samples by triangle), inward_samples, inward_weights.
// Writes: block_heads, block_tails.
// Filled by fit/blocks, fit/segments and spatial/radix_scatter; consumed by fit/apply.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "fit/symmetric.glsl"

layout(push_constant) uniform Push { uint edge_count; };
layout(set = 0, binding = 0) readonly buffer Edges { uint edges[]; };
layout(set = 0, binding = 1) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 2) readonly buffer Ranges { uint ranges[]; };
layout(set = 0, binding = 3) readonly buffer Order { uint order[]; };
READ_VEC4(4, InwardSamples, inward_samples);
READ_VEC2(5, InwardWeights, inward_weights);
layout(set = 0, binding = 6) buffer BlockHeads { vec4 block_heads[]; };
layout(set = 0, binding = 7) buffer BlockTails { vec2 block_tails[]; };

void main() {
    uint e = thread_index();
    if (e >= edge_count) return;
    vec4 head = block_heads[e];
    Symmetric m = Symmetric(head.xyz, vec3(head.w, block_tails[e]));
    uint h = edges[e];
    for (uint sides = 2u; sides > 0u && h != NONE; --sides) {
        uint t = h / 3u, corner = h - 3u * t;
        uint end = ranges[2u * t + 1u];
        for (uint i = ranges[2u * t]; i < end; ++i) {
            uint at = order[i];
            vec2 w = AT2(inward_weights, at);
            float first = 1.0 - w.x - w.y;
            float both = corner == 0u ? first * w.x : corner == 1u ? w.x * w.y : w.y * first;
            add_outer(m, AT(inward_samples, at).xyz, both);
        }
        h = twins[h];
    }
    block_heads[e] = vec4(m.on, m.off.x);
    block_tails[e] = m.off.yz;
}
