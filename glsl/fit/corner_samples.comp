// Purpose: the samples at the vertices.
// Invocation: one vertex.
// Reads: positions, frames, projected and site_triangle (walks of the positions), triangle_normals.
// Writes: corner_samples, 0 where there is none.
// Filled by fit/vertices and project/walk; consumed by fit/own.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/octahedral.glsl"
#include "fit/sample.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
layout(set = 0, binding = 0) readonly buffer Positions { vec4 positions[]; };
layout(set = 0, binding = 1) readonly buffer Frames { vec4 frames[]; };
layout(set = 0, binding = 2) readonly buffer Projected { vec4 projected[]; };
layout(set = 0, binding = 3) readonly buffer SiteTriangle { uint site_triangle[]; };
layout(set = 0, binding = 4) readonly buffer TriangleNormals { uint triangle_normals[]; };
layout(set = 0, binding = 5) writeonly buffer CornerSamples { vec4 corner_samples[]; };

// Weight over the area of the faces around: three corners of each, a twentieth each.
const float CORNER_SHARE = 3.0 / 20.0;

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec4 frame = frames[v];
    vec3 facing = unpack_normal(triangle_normals[site_triangle[v]]);
    vec3 offset = projected[v].xyz - positions[v].xyz;
    bool faces = dot(facing, frame.xyz) > 0.0;
    corner_samples[v] = faces ? sample_of(offset, facing, frame.w, CORNER_SHARE * frame.w) : vec4(0.0);
}
