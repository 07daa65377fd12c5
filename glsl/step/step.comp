// Purpose: moves every site to its projected target and sums the squared steps (lines 6 to 8 of Algorithm 1).
// Invocation: one site; each workgroup makes one partial sum, in a fixed order.
// Reads: projected.
// Writes: sites, partials[workgroup] = (sum of the squared steps, largest step).
// Filled by project/*; consumed by the next iteration and step/reduce.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push { uint site_count; };
READ_VEC4(0, Projected, projected);
layout(set = 0, binding = 1) buffer Sites { vec4 sites[]; };
layout(set = 0, binding = 2) writeonly buffer Partials { vec2 partials[]; };

shared vec2 sums[WORKGROUP];

void main() {
    uint site = thread_index();
    uint lane = gl_LocalInvocationID.x;
    vec2 mine = vec2(0.0);
    if (site < site_count) {
        vec3 to = AT(projected, site).xyz;
        vec3 d = to - sites[site].xyz;
        sites[site] = vec4(to, 0.0);
        mine = vec2(dot(d, d), length(d));
    }
    sums[lane] = mine;
    barrier();
    if (lane != 0u || group_index() * WORKGROUP >= site_count) return;
    vec2 all = sums[0];
    for (uint i = 1u; i < WORKGROUP; ++i) all = vec2(all.x + sums[i].x, max(all.y, sums[i].y));
    partials[group_index()] = all;
}
