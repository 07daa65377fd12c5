// Purpose: the mean of a face's corners (Eq. 7 of the paper), each counted once.
// Invocation: one site.
// Reads: sites, normals, corner_count, corners.
// Writes: targets (xyz, w = 0); the site itself where it has no face.
// Filled by face/cell; consumed by the projection.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/tangent.glsl"

layout(push_constant) uniform Push { uint site_count; };
READ_VEC4(0, Sites, sites);
READ_VEC4(1, Normals, normals);
layout(set = 0, binding = 2) readonly buffer CornerCount { uint corner_count[]; };
READ_VEC2(3, Corners, corners);
layout(set = 0, binding = 4) writeonly buffer Targets { vec4 targets[]; };

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    uint count = corner_count[site];
    vec2 sum = vec2(0.0);
    for (uint m = 0u; m < count; ++m) sum += AT2(corners, m * site_count + site);
    vec2 mean = sum / float(max(count, 1u));
    vec3 u, v;
    tangent_frame(AT(normals, site).xyz, u, v);
    targets[site] = vec4(AT(sites, site).xyz + mean.x * u + mean.y * v, 0.0);
}
