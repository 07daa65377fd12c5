// Purpose: areas and normals of the triangles.
// Invocation: one triangle.
// Reads: positions, corners.
// Writes: areas; triangle_normals, unit, in octahedral form.
// Filled by the upload of the mesh and polish/*; consumed by project/walk and fit/*.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/octahedral.glsl"

layout(push_constant) uniform Push { uint triangle_count; };
READ_VEC4(0, Positions, positions);
layout(set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 2) writeonly buffer Areas { float areas[]; };
layout(set = 0, binding = 3) writeonly buffer TriangleNormals { uint triangle_normals[]; };

void main() {
    uint t = thread_index();
    if (t >= triangle_count) return;
    vec3 a = AT(positions, corners[3u * t]).xyz;
    vec3 n = cross(AT(positions, corners[3u * t + 1u]).xyz - a, AT(positions, corners[3u * t + 2u]).xyz - a);
    float doubled = length(n);
    areas[t] = 0.5 * doubled;
    // Only a triangle without area has no normal; any direction will do.
    triangle_normals[t] = pack_normal(doubled > 0.0 ? n / doubled : vec3(0.0, 0.0, 1.0));
}
