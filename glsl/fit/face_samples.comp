// Purpose: the samples at the centres of triangles and the middles of edges.
// Invocation: one of these.
// Reads: positions, corners, twins, edges, projected and under (walks of the points), triangle_normals.
// Writes: samples, 0 where there is none.
// Filled by fit/points and project/walk; consumed by fit/own, fit/own_edges and fit/blocks.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/half_edges.glsl"
#include "common/octahedral.glsl"
#include "fit/sample.glsl"

layout(push_constant) uniform Push {
    uint first;
    uint sample_count;
    uint of_edges;
};
READ_VEC4(0, Positions, positions);
layout(set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 2) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 3) readonly buffer Edges { uint edges[]; };
READ_VEC4(4, Projected, projected);
layout(set = 0, binding = 5) readonly buffer Under { uint under[]; };
layout(set = 0, binding = 6) readonly buffer TriangleNormals { uint triangle_normals[]; };
layout(set = 0, binding = 7) writeonly buffer Samples { vec4 samples[]; };

// Weights over the area of the face, or of both faces at an edge: a quadrature that is exact for polynomials
// of degree three.
const float FACE_SHARE = 9.0 / 20.0;
const float EDGE_SHARE = 2.0 / 15.0;

void main() {
    uint i = thread_index();
    if (i >= sample_count) return;
    uint h = of_edges == 1u ? edges[first + i] : 3u * (first + i);
    uint next = next_half_edge(h);
    vec3 a = AT(positions, corners[h]).xyz, b = AT(positions, corners[next]).xyz;
    vec3 c = AT(positions, corners[next_half_edge(next)]).xyz;
    vec3 normal = cross(b - a, c - a);
    float size_sq = 0.5 * length(normal), area = size_sq;
    uint twin = of_edges == 1u ? twins[h] : NONE;
    if (twin != NONE) {
        vec3 d = AT(positions, corners[previous_half_edge(twin)]).xyz;
        vec3 other = cross(a - b, d - b);
        normal += other;
        area += 0.5 * length(other);
    }
    vec3 at = of_edges == 1u ? 0.5 * (a + b) : (a + b + c) / 3.0;
    vec3 facing = unpack_normal(triangle_normals[under[i]]);
    float weight = (of_edges == 1u ? EDGE_SHARE : FACE_SHARE) * area;
    bool faces = dot(facing, normal) > 0.0;
    samples[i] = faces ? sample_of(AT(projected, i).xyz - at, facing, size_sq, weight) : vec4(0.0);
}
