// Purpose: the normal of each site's tangent plane: the mean of the surface's normals at the site and around
// it.
// Invocation: one site of a block.
// Reads: surface_normals, neighbours, sites (their marks alone, and only on surfaces with curves).
// Writes: normals.
// Filled by step/settle and neighbours/lists; consumed by face/planar. Where the surface has detail finer
// than the sites, folds included, single normals would tilt tangent planes at random. The mean over a ring of
// sites is that of the surface as the sites see it; at a crease it halves the angle, at a tip it is the axis.
// On a surface with curves, where creases are fixed, only interior sites of the same patch count, and a curve
// site keeps its own normal.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/octahedral.glsl"

layout(constant_id = 1) const uint RING = 6;
// 1 where sites bear the marks of common/pins.glsl.
layout(constant_id = 2) const uint CURVES = 0;

layout(push_constant) uniform Push {
    uint first; // of the block's sites
    uint block_sites;
};
layout(set = 0, binding = 0) readonly buffer SurfaceNormals { uint surface_normals[]; };
layout(set = 0, binding = 1) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 2) writeonly buffer Normals { uint normals[]; };
READ_VEC4(3, Sites, sites);

#include "common/blocks.glsl"
#include "common/pins.glsl"

// Whether the normal of site j counts for the site with this mark.
bool counts_for(uint j, float own) {
    if (j == NONE) return false;
    if (CURVES == 0u) return true;
    float mark = AT(sites, j).w;
    return mark == own && !is_pinned(mark);
}

void main() {
    uint site = block_site(thread_index());
    if (!in_block(site)) return;
    vec3 own = unpack_normal(surface_normals[site]);
    float mark = CURVES != 0u ? AT(sites, site).w : 0.0;
    vec3 around[RING];
    float agreeing = 0.0, found = 0.0;
    [[unroll]] for (uint s = 0u; s < RING; ++s) {
        uint j = neighbours[block_place(s, site)];
        bool counts = counts_for(j, mark);
        around[s] = counts ? unpack_normal(surface_normals[counts ? j : site]) : vec3(0.0);
        agreeing += dot(own, around[s]) > 0.0 ? 1.0 : 0.0;
        found += counts ? 1.0 : 0.0;
    }
    // A site against all its neighbours is on a triangle that is folded back.
    vec3 side = found >= 4.0 && agreeing < 2.0 ? -own : own;
    vec3 sum = side;
    [[unroll]] for (uint s = 0u; s < RING; ++s) sum += dot(side, around[s]) > 0.0 ? around[s] : vec3(0.0);
    // All that was added is on one side, so the sum cannot vanish.
    normals[site] = pack_normal(normalize(sum));
}
