// Purpose: gives each site the edge length wanted there, relative to the spacing, as its fourth component.
// Invocation: one site.
// Reads: site_triangle, slopes (length = xyz · p + w in each triangle), sites.
// Writes: sites.
// Filled by step/step, project/* and the upload of the sizes; consumed by face/cell. Only where sizes vary
// and all sites exist from the start.
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
layout(set = 0, binding = 0) readonly buffer SiteTriangle { uint site_triangle[]; };
READ_VEC4(1, Slopes, slopes);
layout(set = 0, binding = 2) buffer Sites { vec4 sites[]; };

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec4 slope = AT(slopes, min(site_triangle[site], triangle_count - 1u));
    vec3 at = sites[site].xyz;
    // In a sliver the slope is steep, so rounding can exceed the limits.
    sites[site] = vec4(at, clamp(dot(slope.xyz, at) + slope.w, least, largest));
}
