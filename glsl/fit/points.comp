// Purpose: the points of the faces that are samples, and where to look for the surface under them.
// Invocation: one sample: the centre of a triangle, or the middle of an edge.
// Reads: positions, corners, states, edges (a half-edge of each), site_triangle (under the vertices).
// Writes: points; under, a triangle of the surface near them; sides, the unit normals of their triangles.
// Filled by the host and by walks of the vertices; consumed by project/walk and project/closest.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/half_edges.glsl"

layout(push_constant) uniform Push {
    uint first; // the first sample of this dispatch
    uint sample_count;
    uint of_edges; // 1 for edges, 0 for triangles
};
READ_VEC4(0, Positions, positions);
layout(set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 2) readonly buffer States { uint states[]; };
layout(set = 0, binding = 3) readonly buffer Edges { uint edges[]; };
layout(set = 0, binding = 4) readonly buffer SiteTriangle { uint site_triangle[]; };
layout(set = 0, binding = 5) writeonly buffer Points { vec4 points[]; };
layout(set = 0, binding = 6) writeonly buffer Under { uint under[]; };
layout(set = 0, binding = 7) writeonly buffer Sides { vec4 sides[]; };

void main() {
    uint i = thread_index();
    if (i >= sample_count) return;
    // A half-edge of the edge or triangle.
    uint h = of_edges == 1u ? edges[first + i] : 3u * (first + i);
    uint next = next_half_edge(h);
    uvec3 v = uvec3(corners[h], corners[next], corners[next_half_edge(next)]);
    vec3 a = AT(positions, v.x).xyz, b = AT(positions, v.y).xyz, c = AT(positions, v.z).xyz;
    vec3 normal = cross(b - a, c - a);
    sides[i] = vec4(normal / max(length(normal), 1e-30), 0.0);
    points[i] = vec4(of_edges == 1u ? 0.5 * (a + b) : (a + b + c) / 3.0, 0.0);
    // From a vertex that moves: others may be on curves, and walks do not cross these. Where none does, the
    // sample moves nothing.
    bool fixed_x = (states[v.x] & FIXED) != 0u, fixed_y = (states[v.y] & FIXED) != 0u;
    under[i] = site_triangle[!fixed_x ? v.x : !fixed_y || of_edges == 1u ? v.y : v.z];
}
