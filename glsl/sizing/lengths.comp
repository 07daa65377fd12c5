// Purpose: the target edge length at each site, relative to the spacing.
// Invocation: one site.
// Reads: sites, site_triangle, slopes (length = xyz · p + w in each triangle).
// Writes: lengths.
// Filled by step/settle, project/walk and the upload of the sizes; consumed by sizing/drift and
// step/keep_off. Only where sizes vary.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint site_count;
    uint triangle_count;
    float least; // all lengths are between these
    float largest;
};
READ_VEC4(0, Sites, sites);
layout(set = 0, binding = 1) readonly buffer SiteTriangle { uint site_triangle[]; };
READ_VEC4(2, Slopes, slopes);
layout(set = 0, binding = 3) writeonly buffer Lengths { float lengths[]; };

#include "common/sites.glsl"

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec4 slope = AT(slopes, min(site_triangle[site], triangle_count - 1u));
    // In a sliver the slope is steep, so rounding can exceed the limits.
    lengths[site] = clamp(dot(slope.xyz, site_at(site).xyz) + slope.w, least, largest);
}
