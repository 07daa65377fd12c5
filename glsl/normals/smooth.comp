// Purpose: the normal of each site's tangent plane: the mean of the surface's normals at the site and around it.
// Invocation: one site.
// Reads: surface_normals, neighbours.
// Writes: normals.
// Filled by step/settle and neighbours/lists; consumed by face/planar.
// A surface that is finer than the sites has normals of its own finer detail, folds included, where a tangent plane
// would tilt at random. The mean over a ring of sites is that of the surface as the sites see it; at a crease it
// halves the angle, at a tip it is the axis.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/octahedral.glsl"

layout(constant_id = 1) const uint RING = 6;

layout(push_constant) uniform Push { uint site_count; };
layout(set = 0, binding = 0) readonly buffer SurfaceNormals { uint surface_normals[]; };
layout(set = 0, binding = 1) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 2) writeonly buffer Normals { uint normals[]; };

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec3 own = unpack_normal(surface_normals[site]);
    vec3 around[RING];
    float agreeing = 0.0, found = 0.0;
    [[unroll]] for (uint s = 0u; s < RING; ++s) {
        uint j = neighbours[s * site_count + site];
        around[s] = j == NONE ? vec3(0.0) : unpack_normal(surface_normals[j == NONE ? site : j]);
        agreeing += dot(own, around[s]) > 0.0 ? 1.0 : 0.0;
        found += j == NONE ? 0.0 : 1.0;
    }
    // One against all others stands on a triangle that is folded back.
    vec3 side = found >= 4.0 && agreeing < 2.0 ? -own : own;
    vec3 sum = side;
    [[unroll]] for (uint s = 0u; s < RING; ++s) sum += dot(side, around[s]) > 0.0 ? around[s] : vec3(0.0);
    // All that was added is on one side, so the sum cannot vanish.
    normals[site] = pack_normal(normalize(sum));
}
