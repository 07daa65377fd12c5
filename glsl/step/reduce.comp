// Purpose: the step of one iteration over all sites: the value that decides on convergence.
// Invocation: one strand of the partial sums; one workgroup in all, so that the order of the sum is fixed.
// Reads: partials.
// Writes: history[iteration] = (root mean square step, largest step).
// Filled by step/step; consumed by the host, every few iterations.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint partial_count;
    uint site_count;
    uint iteration;
};
READ_VEC2(0, Partials, partials);
layout(set = 0, binding = 1) writeonly buffer History { vec2 history[]; };

shared vec2 sums[WORKGROUP];

void main() {
    uint lane = gl_LocalInvocationID.x;
    vec2 mine = vec2(0.0);
    for (uint i = lane; i < partial_count; i += WORKGROUP) {
        mine = vec2(mine.x + AT2(partials, i).x, max(mine.y, AT2(partials, i).y));
    }
    sums[lane] = mine;
    barrier();
    if (lane != 0u) return;
    vec2 all = sums[0];
    for (uint i = 1u; i < WORKGROUP; ++i) all = vec2(all.x + sums[i].x, max(all.y, sums[i].y));
    history[iteration] = vec2(sqrt(all.x / float(site_count)), all.y);
}
