// Purpose: the product of the fit's matrix with the direction, and parts of its product with the direction.
// Invocation: one vertex.
// Reads: starts and links (neighbour and edge, for each edge at a vertex), own, block_heads, block_tails,
// direction.
// Writes: product; partials, a sum for each workgroup.
// Filled by fit/own_inward, fit/blocks_inward and fit/turn; consumed by fit/scalars and fit/descend.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "fit/partials.glsl"
#include "fit/symmetric.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
layout(set = 0, binding = 0) readonly buffer Starts { uint starts[]; };
READ_UVEC2(1, Links, links);
READ_VEC4(2, Own, own);
READ_VEC4(3, BlockHeads, block_heads);
READ_VEC2(4, BlockTails, block_tails);
READ_VEC4(5, Direction, direction);
layout(set = 0, binding = 6) writeonly buffer Product { vec4 product[]; };
layout(set = 0, binding = 7) writeonly buffer Partials { float partials[]; };

void main() {
    uint v = thread_index();
    float part = 0.0;
    if (v < vertex_count) {
        vec4 head = AT(own, 2u * v), tail = AT(own, 2u * v + 1u);
        vec3 x = AT(direction, v).xyz;
        vec3 y = times(Symmetric(head.xyz, vec3(head.w, tail.xy)), x);
        // A vertex that does not move has no equation.
        uint begin = starts[v], end = head.x == 0.0 ? begin : starts[v + 1u];
        for (uint i = begin; i < end; ++i) {
            uvec2 link = AT2(links, i);
            vec4 block = AT(block_heads, link.y);
            vec2 rest = AT2(block_tails, link.y);
            y += times(Symmetric(block.xyz, vec3(block.w, rest)), AT(direction, link.x).xyz);
        }
        product[v] = vec4(y, 0.0);
        part = dot(x, y);
    }
    float sum = workgroup_sum(part);
    if (gl_LocalInvocationID.x == 0u) partials[group_index()] = sum;
}
