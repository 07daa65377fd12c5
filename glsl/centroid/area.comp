// Purpose: the centroid of a face's area (Eq. 3 of the paper with constant density).
// Invocation: one site.
// Reads: sites, normals, corner_count, corners.
// Writes: targets (xyz, w = 0); the site itself where it has no face or a face without area.
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
    // The site is the origin and lies inside the face, so the fan of triangles around it has no negative
    // part.
    float area = 0.0;
    vec2 moment = vec2(0.0);
    vec2 a = count > 0u ? AT2(corners, (count - 1u) * site_count + site) : vec2(0.0);
    for (uint m = 0u; m < count; ++m) {
        vec2 b = AT2(corners, m * site_count + site);
        float twice = a.x * b.y - a.y * b.x;
        area += twice;
        moment += twice * (a + b);
        a = b;
    }
    vec2 balance = area > 0.0 ? moment / (3.0 * area) : vec2(0.0);
    vec3 u, v;
    tangent_frame(AT(normals, site).xyz, u, v);
    targets[site] = vec4(AT(sites, site).xyz + balance.x * u + balance.y * v, 0.0);
}
