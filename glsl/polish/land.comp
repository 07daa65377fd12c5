// Purpose: where each vertex would be after its move; where no surface was found that faces as the mesh does,
// it stays.
// Invocation: one vertex.
// Reads: positions, states, normals (of the mesh), projected and surface_normals (of the walk).
// Writes: moved (position, normal of the mesh in octahedral form), stamps, all STANDS.
// Filled by polish/relax and project/walk; consumed by polish/folded.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/half_edges.glsl"
#include "polish/normals.glsl"
#include "polish/stamps.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_VEC4(0, Positions, positions);
layout(set = 0, binding = 1) readonly buffer States { uint states[]; };
layout(set = 0, binding = 2) readonly buffer Normals { uint normals[]; };
READ_VEC4(3, Projected, projected);
READ_VEC4(4, SurfaceNormals, surface_normals);
layout(set = 0, binding = 5) writeonly buffer Moved { uvec4 moved[]; };
layout(set = 0, binding = 6) writeonly buffer Stamps { uint stamps[]; };

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    uint packed = normals[v];
    bool moves = (states[v] & FIXED) == 0u && dot(normal_or_zero(packed), AT(surface_normals, v).xyz) > 0.0;
    vec3 to = moves ? AT(projected, v).xyz : AT(positions, v).xyz;
    moved[v] = uvec4(floatBitsToUint(to), packed);
    stamps[v] = STANDS;
}
