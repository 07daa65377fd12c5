// Purpose: corrects targets that were computed for equal edge lengths for edge lengths that vary.
// Invocation: one site of a block.
// Reads: sites (with the marks of common/pins.glsl on surfaces with curves), normals (packed), neighbours,
//   lengths, centroids.
// Writes: targets (xyz, w = squared distance to the shifted centroid in target lengths there).
// Filled by face/planar and sizing/lengths; consumed by step/keep_off, project/walk and the next iteration.
// Only where sizes vary. In a cell where the target length h changes, the centroid for the density 1 / h^4
// that makes edges as long as h is off the area's by the cell's second moment times the gradient of that
// density's logarithm: for a hexagon of area A by 5 / (36 sqrt(3)) A * (-4) grad(ln h). The gradient is that
// of the lengths of the nearest sites, in the tangent plane.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/octahedral.glsl"
#include "common/tangent.glsl"

// Nearest sites that count.
layout(constant_id = 1) const uint RING = 6;
// 1 where sites bear the marks of common/pins.glsl.
layout(constant_id = 2) const uint CURVES = 0;
#include "common/pins.glsl"

layout(push_constant) uniform Push {
    uint first; // of the block's sites
    uint block_sites;
    float largest_move; // longest step, relative to the target length there, in the unit of the sites
};
READ_VEC4(0, Sites, sites);
layout(set = 0, binding = 1) readonly buffer Normals { uint normals[]; };
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 3) readonly buffer Lengths { float lengths[]; };
layout(set = 0, binding = 4) buffer Targets { vec4 targets[]; };
READ_VEC4(5, Centroids, centroids);

#include "common/blocks.glsl"
#include "common/sites.glsl"

// The second moment of a hexagonal cell over the square of the distance to its neighbours, times the four of
// the density.
const float SHARE = 4.0 * 5.0 / 72.0;
// Longest drift, as a share of the distance to the neighbours.
const float MOST = 0.25;

void main() {
    uint site = block_site(thread_index());
    if (!in_block(site)) return;
    vec4 own = site_at(site);
    vec3 at = own.xyz, n = unpack_normal(normals[site]);
    float length_here = lengths[site], mark = CURVES != 0u ? own.w : 0.0;
    vec3 u, v;
    tangent_frame(n, u, v);
    // Least squares: the slope that fits the logarithms best.
    vec3 moments = vec3(0.0);
    vec2 sum = vec2(0.0);
    float distances_sq = 0.0, count = 0.0;
    [[unroll]] for (uint s = 0u; s < RING; ++s) {
        uint j = neighbours[block_place(s, site)];
        uint known = j == NONE ? site : j;
        vec4 other = site_at(known);
        bool counts = j != NONE && same_patch(mark, other.w) &&
                      (counts_anywhere(other.w) || dot(n, unpack_normal(normals[known])) > 0.0);
        vec3 d = other.xyz - at;
        vec2 flat_d = vec2(dot(d, u), dot(d, v));
        float weight = counts ? 1.0 / max(dot(d, d), 1e-20) : 0.0;
        moments += weight * vec3(flat_d.x * flat_d.x, flat_d.x * flat_d.y, flat_d.y * flat_d.y);
        sum += weight * log(lengths[known] / length_here) * flat_d;
        distances_sq += counts ? dot(d, d) : 0.0;
        count += counts ? 1.0 : 0.0;
    }
    float determinant = moments.x * moments.z - moments.y * moments.y;
    vec2 gradient =
        vec2(moments.z * sum.x - moments.y * sum.y, moments.x * sum.y - moments.y * sum.x) / determinant;
    bool known = determinant > 0.02 * count * count;
    float near_sq = distances_sq / max(count, 1.0);
    vec2 flat_drift = known ? -SHARE * near_sq * gradient : vec2(0.0);
    float longest = MOST * sqrt(near_sq);
    flat_drift *= min(1.0, longest * inversesqrt(max(dot(flat_drift, flat_drift), 1e-30)));
    vec3 drift = flat_drift.x * u + flat_drift.y * v;
    if (is_pinned(own.w)) return;
    vec3 step = AT(centroids, block_place(0u, site)).xyz + drift - at;
    // Momentum is that of the area's centroid; the drift hardly changes from one iteration to the next.
    vec3 move = targets[block_place(0u, site)].xyz - at + drift;
    float most = largest_move * length_here;
    move *= min(1.0, most * inversesqrt(max(dot(move, move), 1e-30)));
    targets[block_place(0u, site)] = vec4(at + move, dot(step, step) / (length_here * length_here));
}
