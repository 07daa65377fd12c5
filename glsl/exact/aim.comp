// Purpose: where sites go from the centroids of their cells, with momentum.
// Invocation: one site.
// Reads: sites, cells.
// Writes: targets (w = 0), centroids (w = 1 once there is one).
// Filled by exact/sums; consumed by step/step and the next iteration.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint site_count;
    float momentum; // share of the last motion that is added, 0 to 1
    float largest_move; // longest step
};
READ_VEC4(0, Sites, sites);
READ_VEC4(1, Cells, cells);
layout(set = 0, binding = 2) writeonly buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 3) buffer Centroids { vec4 centroids[]; };

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec3 at = AT(sites, site).xyz;
    vec4 cell = AT(cells, site), last = centroids[site];
    // A site without a cell, on the spot of another or far from the surface, stays.
    vec3 step = cell.w > 0.0 ? cell.xyz / cell.w : vec3(0.0);
    vec3 motion = (at + step - last.xyz) * last.w;
    // Against its motion a site starts anew.
    vec3 move = dot(step, motion) > 0.0 ? step + momentum * motion : step;
    move *= min(1.0, largest_move * inversesqrt(max(dot(move, move), 1e-30)));
    targets[site] = vec4(at + move, 0.0);
    centroids[site] = vec4(at + step, 1.0);
}
