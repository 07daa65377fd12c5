// Purpose: projects a site onto the plane that best fits the nearest points of the input, the surface of a
// point cloud (Chen et al. 2018).
// Invocation: one site.
// Reads: targets, neighbours (points, nearest first), vertices (the points), vertex_normals (theirs, w = 0).
// Writes: projected (xyz on the plane, w = distance of the projection), normals (unit, w = 0), flags
// (overwritten).
// Filled by centroid/*, neighbours/knn and the upload of the surface; consumed by step/step and, in the next
// iteration, by face/cell. The vertices' normals orient the plane, as those of an oriented point cloud do.
// Vertices that face away from the nearest one are on another sheet and do not count: the plane would lie
// between the two. Where no plane fits, the nearest vertex's normal is taken. Beside a ridge, a plane goes on
// where there is no surface: a site stays within `reach` of a vertex.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/flags.glsl"
#include "common/plane_fit.glsl"

// Cosine of 37 degrees: the largest angle between a fitted normal and that of the nearest vertex.
const float MIN_AGREEMENT = 0.8;

layout(push_constant) uniform Push {
    uint site_count;
    uint k;      // vertices in the fit
    float reach; // no point of the surface is farther than this from a vertex
};
READ_VEC4(0, Targets, targets);
layout(set = 0, binding = 1) readonly buffer Neighbours { uint neighbours[]; };
READ_VEC4(2, Vertices, vertices);
READ_VEC4(3, VertexNormals, vertex_normals);
layout(set = 0, binding = 4) writeonly buffer Projected { vec4 projected[]; };
layout(set = 0, binding = 5) writeonly buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 6) writeonly buffer Flags { uint flags[]; };

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec3 at = AT(targets, site).xyz;
    uint nearest = neighbours[site];
    vec3 origin = AT(vertices, nearest).xyz;
    vec3 surface = AT(vertex_normals, nearest).xyz;
    vec3 mean = vec3(0.0);
    float reach_sq = 0.0;
    uint listed = 0u, count = 0u;
    for (; listed < k; ++listed) {
        uint j = neighbours[listed * site_count + site];
        if (j == NONE) break;
        if (dot(AT(vertex_normals, j).xyz, surface) <= 0.0) continue;
        vec3 d = AT(vertices, j).xyz - origin;
        mean += d;
        reach_sq = max(reach_sq, dot(d, d));
        ++count;
    }
    mean /= float(count);
    // The covariance in units of the farthest vertex stays near 1 whatever the density.
    float scale = reach_sq > 0.0 ? inversesqrt(reach_sq) : 0.0;
    Covariance c = Covariance(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (uint s = 0u; s < listed; ++s) {
        uint j = neighbours[s * site_count + site];
        if (dot(AT(vertex_normals, j).xyz, surface) <= 0.0) continue;
        add_point(c, (AT(vertices, j).xyz - origin - mean) * scale);
    }
    bool planar;
    vec3 n = least_axis(c, planar);
    // Vertices around a crease fit a plane unrelated to either side.
    bool usable = planar && abs(dot(n, surface)) >= MIN_AGREEMENT * length(n);
    if (!usable) n = surface;
    n = normalize(n);
    n = dot(n, surface) < 0.0 ? -n : n;
    float height = dot(at - origin - (usable ? mean : vec3(0.0)), n);
    vec3 foot = at - height * n;
    // The vertex's own foot, since it need not lie on the plane.
    vec3 from = origin + (usable ? dot(mean, n) : 0.0) * n;
    float beyond = distance(foot, from);
    if (beyond > reach) foot = mix(from, foot, reach / beyond);
    projected[site] = vec4(foot, distance(at, foot));
    normals[site] = vec4(n, 0.0);
    flags[site] = usable ? 0u : FLAG_NORMAL;
}
