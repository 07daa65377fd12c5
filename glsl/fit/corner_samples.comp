// Purpose: the samples at the vertices.
// Invocation: one vertex.
// Reads: positions, frames, projected and site_triangle (walks of the positions), triangle_normals.
// Writes: corner_samples, 0 where there is none.
// Filled by fit/vertices and project/walk; consumed by fit/own.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/octahedral.glsl"
#include "fit/sample.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_VEC4(0, Positions, positions);
READ_VEC4(1, Frames, frames);
READ_VEC4(2, Projected, projected);
layout(set = 0, binding = 3) readonly buffer SiteTriangle { uint site_triangle[]; };
layout(set = 0, binding = 4) readonly buffer TriangleNormals { uint triangle_normals[]; };
layout(set = 0, binding = 5) writeonly buffer CornerSamples { vec4 corner_samples[]; };

// Weight over the area of the faces around: three corners of each, a twentieth each.
const float CORNER_SHARE = 3.0 / 20.0;

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec4 frame = AT(frames, v);
    vec3 facing = unpack_normal(triangle_normals[site_triangle[v]]);
    vec3 offset = AT(projected, v).xyz - AT(positions, v).xyz;
    bool faces = dot(facing, frame.xyz) > 0.0;
    corner_samples[v] = faces ? sample_of(offset, facing, frame.w, CORNER_SHARE * frame.w) : vec4(0.0);
}
