// Purpose: the paper's projection onto the triangles around the k nearest input vertices (Algorithm 3).
// Invocation: one site.
// Reads: targets, neighbours (input vertices), vertices, triangles, star_start, star.
// Writes: projected (xyz on the surface, w = distance of the projection), site_triangle.
// Filled by centroid/*, neighbours/knn and the upload of the surface; consumed by step/step and
// normals/plane_fit. The triangles around vertex p are star[star_start[p]] to star[star_start[p + 1] - 1].
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint site_count;
    uint k;
};
READ_VEC4(0, Targets, targets);
layout(set = 0, binding = 1) readonly buffer Neighbours { uint neighbours[]; };
READ_VEC4(2, Vertices, vertices);
READ_UVEC4(3, Triangles, triangles);
layout(set = 0, binding = 4) readonly buffer StarStart { uint star_start[]; };
layout(set = 0, binding = 5) readonly buffer Star { uint star[]; };
layout(set = 0, binding = 6) writeonly buffer Projected { vec4 projected[]; };
layout(set = 0, binding = 7) writeonly buffer SiteTriangle { uint site_triangle[]; };

float distance_sq(vec3 a, vec3 b) { return dot(a - b, a - b); }

// Keeps in `best` the foot of `at` on the edge a b if it lies on the edge and is nearer.
void try_edge(vec3 at, vec3 a, vec3 b, inout vec3 best, inout float best_sq) {
    vec3 e = b - a;
    float length_sq = dot(e, e);
    float t = dot(at - a, e);
    if (t < 0.0 || t > length_sq || length_sq == 0.0) return;
    vec3 foot = a + e * (t / length_sq);
    float d_sq = distance_sq(at, foot);
    if (d_sq < best_sq) {
        best_sq = d_sq;
        best = foot;
    }
}

// The projection of `at` onto one triangle: case a inside, case b on an edge, and the corner case, where the
// paper takes the nearest vertex p through which the triangle was found.
vec3 project(vec3 at, vec3 a, vec3 b, vec3 c, vec3 p) {
    vec3 ab = b - a, ac = c - a, n = cross(ab, ac);
    float n_sq = dot(n, n);
    vec3 w = at - a;
    float beta = dot(cross(w, ac), n), gamma = dot(cross(ab, w), n);
    if (n_sq > 0.0 && beta >= 0.0 && gamma >= 0.0 && beta + gamma <= n_sq) {
        return a + (beta * ab + gamma * ac) / n_sq;
    }
    vec3 best = p;
    float best_sq = 3.402823466e38;
    try_edge(at, a, b, best, best_sq);
    try_edge(at, b, c, best, best_sq);
    try_edge(at, c, a, best, best_sq);
    return best;
}

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec3 at = AT(targets, site).xyz;
    vec3 best = at;
    float best_sq = 3.402823466e38;
    uint best_triangle = NONE;
    for (uint s = 0u; s < k; ++s) {
        uint p = neighbours[s * site_count + site];
        if (p == NONE) break;
        vec3 corner = AT(vertices, p).xyz;
        uint end = star_start[p + 1u];
        for (uint e = star_start[p]; e < end; ++e) {
            uint t = star[e];
            uvec4 v = AT(triangles, t);
            vec3 x = project(at, AT(vertices, v.x).xyz, AT(vertices, v.y).xyz, AT(vertices, v.z).xyz, corner);
            float d_sq = distance_sq(at, x);
            if (d_sq < best_sq || (d_sq == best_sq && t < best_triangle)) {
                best_sq = d_sq;
                best = x;
                best_triangle = t;
            }
        }
    }
    projected[site] = vec4(best, sqrt(best_sq));
    site_triangle[site] = best_triangle;
}
