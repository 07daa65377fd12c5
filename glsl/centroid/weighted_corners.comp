// Purpose: the mean of a face's corners, where corners that are close together count less than in Eq. 7 of
// the paper.
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

// A corner counts in full if both its neighbours are farther than this share of the face's radius.
const float APART = 0.3;

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
    float radius = 0.0;
    for (uint m = 0u; m < count; ++m) radius = max(radius, length(AT2(corners, m * site_count + site)));
    // Nearly co-circular sites split one corner in two, and counted twice it pulls the mean to its side. Two
    // on one spot count as one here, and no jump is between that and two that are apart. This comes closest
    // to the paper's figures, see docs/presets.md.
    vec2 sum = vec2(0.0);
    float whole = 0.0;
    vec2 last = count > 0u ? AT2(corners, (count - 1u) * site_count + site) : vec2(0.0);
    for (uint m = 0u; m < count; ++m) {
        vec2 corner = AT2(corners, m * site_count + site);
        float weight = min(distance(corner, last), APART * radius);
        sum += weight * (last + corner);
        whole += 2.0 * weight;
        last = corner;
    }
    vec2 mean = whole > 0.0 ? sum / whole : vec2(0.0);
    vec3 u, v;
    tangent_frame(AT(normals, site).xyz, u, v);
    targets[site] = vec4(AT(sites, site).xyz + mean.x * u + mean.y * v, 0.0);
}
