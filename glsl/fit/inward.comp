// Purpose: the samples at the surface's vertices: their closest points on the mesh.
// Invocation: one vertex of the surface.
// Reads: surface_points (w = area around the vertex), surface_sides (normals there in octahedral form),
// projected and under (walks of these over the mesh), positions, corners.
// Writes: inward_samples, 0 where there is none; inward_weights, barycentric, of corners 1 and 2.
// Filled by the host and project/walk; consumed by fit/keys, fit/own_inward and fit/blocks_inward.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/octahedral.glsl"
#include "fit/sample.glsl"

layout(push_constant) uniform Push { uint point_count; };
READ_VEC4(0, SurfacePoints, surface_points);
layout(set = 0, binding = 1) readonly buffer SurfaceSides { uint surface_sides[]; };
READ_VEC4(2, Projected, projected);
layout(set = 0, binding = 3) readonly buffer Under { uint under[]; };
READ_VEC4(4, Positions, positions);
layout(set = 0, binding = 5) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 6) writeonly buffer InwardSamples { vec4 inward_samples[]; };
layout(set = 0, binding = 7) writeonly buffer InwardWeights { vec2 inward_weights[]; };

// Weight over the area around a vertex of the surface.
const float INWARD_SHARE = 0.4;

void main() {
    uint i = thread_index();
    if (i >= point_count) return;
    vec4 at = AT(surface_points, i);
    uint t = under[i];
    vec3 a = AT(positions, corners[3u * t]).xyz, b = AT(positions, corners[3u * t + 1u]).xyz;
    vec3 c = AT(positions, corners[3u * t + 2u]).xyz;
    vec3 on = AT(projected, i).xyz, n = cross(b - a, c - a);
    float doubled = length(n);
    vec2 weights = vec2(dot(cross(on - a, c - a), n), dot(cross(b - a, on - a), n)) /
                   max(doubled * doubled, 1e-37);
    weights = clamp(weights, 0.0, 1.0);
    inward_weights[i] = weights / max(weights.x + weights.y, 1.0);
    bool faces = dot(n, unpack_normal(surface_sides[i])) > 0.0;
    vec3 facing = n / max(doubled, 1e-37);
    inward_samples[i] =
        faces ? sample_of(at.xyz - on, facing, 0.5 * doubled, INWARD_SHARE * at.w) : vec4(0.0);
}
