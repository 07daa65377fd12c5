// Purpose: normal of the plane that best fits a site and its nearest sites (PCA, Sect. 4.2 of the paper).
// Invocation: one site.
// Reads: sites, neighbours, site_triangle, triangle_normals.
// Writes: normals (unit, w = 0), flags (overwritten).
// Filled by neighbours/knn and the projection; consumed by face/cell. As in PCL the site counts as the first
// of its k nearest. The sign is the surface's, so that faces are counter-clockwise seen from outside.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/flags.glsl"
#include "common/plane_fit.glsl"

// Cosine of 37 degrees: the largest angle between a fitted plane and the surface.
const float MIN_AGREEMENT = 0.8;

layout(push_constant) uniform Push {
    uint site_count;
    uint k; // sites in the fit, the site itself included
};
READ_VEC4(0, Sites, sites);
layout(set = 0, binding = 1) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 2) readonly buffer SiteTriangle { uint site_triangle[]; };
READ_VEC4(3, TriangleNormals, triangle_normals);
layout(set = 0, binding = 4) writeonly buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 5) writeonly buffer Flags { uint flags[]; };

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec3 at = AT(sites, site).xyz;
    vec3 mean = vec3(0.0);
    float reach_sq = 0.0;
    uint count = 1u;
    for (uint s = 0u; s + 1u < k; ++s) {
        uint j = neighbours[s * site_count + site];
        if (j == NONE) break;
        vec3 d = AT(sites, j).xyz - at;
        mean += d;
        reach_sq = max(reach_sq, dot(d, d));
        ++count;
    }
    mean /= float(count);
    // The covariance in units of the farthest neighbour stays near 1 whatever the density.
    float scale = reach_sq > 0.0 ? inversesqrt(reach_sq) : 0.0;
    Covariance c = Covariance(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    add_point(c, mean * scale);
    for (uint s = 0u; s + 1u < count; ++s) {
        add_point(c, (AT(sites, neighbours[s * site_count + site]).xyz - at - mean) * scale);
    }
    bool planar;
    vec3 n = least_axis(c, planar);
    vec3 surface = AT(triangle_normals, site_triangle[site]).xyz;
    // Sites on a line, or all at one point, fit many planes. Sites of two sheets, as at the tip of an ear,
    // fit one unrelated to the surface, and a face in it would reach far away.
    bool usable = planar && abs(dot(n, surface)) >= MIN_AGREEMENT * length(n);
    if (!usable) n = surface;
    n = normalize(n);
    normals[site] = vec4(dot(n, surface) < 0.0 ? -n : n, 0.0);
    flags[site] = usable ? 0u : FLAG_NORMAL;
}
