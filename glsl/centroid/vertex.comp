// Purpose: the mean of a face's corners (Eq. 7 of the paper), corners that nearly coincide counted once.
// Invocation: one site.
// Reads: sites, normals, corner_count, corners.
// Writes: targets (xyz, w = 0); the site itself where it has no face.
// Filled by face/cell; consumed by the projection.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/tangent.glsl"

// Corners closer than this share of the face's radius are one.
const float COINCIDENT = 0.2;

layout(push_constant) uniform Push { uint site_count; };
layout(set = 0, binding = 0) readonly buffer Sites { vec4 sites[]; };
layout(set = 0, binding = 1) readonly buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 2) readonly buffer CornerCount { uint corner_count[]; };
layout(set = 0, binding = 3) readonly buffer Corners { vec2 corners[]; };
layout(set = 0, binding = 4) writeonly buffer Targets { vec4 targets[]; };

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    uint count = corner_count[site];
    float radius = 0.0;
    for (uint m = 0u; m < count; ++m) radius = max(radius, length(corners[m * site_count + site]));
    // Nearly co-circular sites split one corner in two, and counted twice it pulls the mean to its side. Counted once
    // comes closest to the paper's figures, see docs/method.md.
    vec2 sum = vec2(0.0);
    uint counted = 0u;
    vec2 last = count > 0u ? corners[(count - 1u) * site_count + site] : vec2(0.0);
    for (uint m = 0u; m < count; ++m) {
        vec2 corner = corners[m * site_count + site];
        if (distance(corner, last) > COINCIDENT * radius) {
            sum += corner;
            ++counted;
        }
        last = corner;
    }
    vec2 mean = counted > 0u ? sum / float(counted) : vec2(0.0);
    vec3 u, v;
    tangent_frame(normals[site].xyz, u, v);
    targets[site] = vec4(sites[site].xyz + mean.x * u + mean.y * v, 0.0);
}
