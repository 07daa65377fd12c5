// Purpose: puts the sites where the projection says, with their normals, and sums the squared steps.
// Invocation: one site of a block, whose part of them all buffers of sites are; each workgroup makes one
// partial sum, in a fixed order.
// Reads: projected, normals, targets (w = squared distance to the centroid).
// Writes: sites (w stays), surface_normals (packed), partials[first_partial + workgroup] = (sum of the
// squared steps, largest step).
// Filled by face/planar and project/walk; consumed by the next iteration and step/reduce.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/octahedral.glsl"

// 1 where sites bear the marks of common/pins.glsl: those on curves keep their places and normals.
layout(constant_id = 1) const uint CURVES = 0;

layout(push_constant) uniform Push {
    uint site_count;
    uint first_partial; // of these sites
};
READ_VEC4(0, Projected, projected);
READ_VEC4(1, Normals, normals);
READ_VEC4(2, Targets, targets);
layout(set = 0, binding = 3) buffer Sites { vec4 sites[]; };
layout(set = 0, binding = 4) writeonly buffer SurfaceNormals { uint surface_normals[]; };
layout(set = 0, binding = 5) writeonly buffer Partials { vec2 partials[]; };

#define WRITES_SITES
#include "common/pins.glsl"
#include "common/sites.glsl"

shared vec2 sums[WORKGROUP];

void main() {
    uint site = thread_index();
    uint lane = gl_LocalInvocationID.x;
    vec2 mine = vec2(0.0);
    if (site < site_count) {
        float mark = CURVES != 0u ? sites[site].w : 0.0;
        if (!is_pinned(mark)) {
            vec3 to = AT(projected, site).xyz;
            if (PACKED == 0u) sites[site] = vec4(to, mark);
            for (uint c = 0u; c < 3u * PACKED; ++c) PACKED_AT(sites, 3u * site + c) = to[c];
            surface_normals[site] = pack_normal(AT(normals, site).xyz);
        }
        float step_sq = AT(targets, site).w;
        mine = vec2(step_sq, sqrt(step_sq));
    }
    sums[lane] = mine;
    barrier();
    if (lane != 0u || group_index() * WORKGROUP >= site_count) return;
    vec2 all = sums[0];
    for (uint i = 1u; i < WORKGROUP; ++i) all = vec2(all.x + sums[i].x, max(all.y, sums[i].y));
    partials[first_partial + group_index()] = all;
}
