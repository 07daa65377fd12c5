// Purpose: the face of each site by intervals, its area centroid, and the target that momentum makes of it.
// Invocation: one site of a block.
// Reads: sites, normals (packed), neighbours, away, status (of neighbours/decide).
// Writes: targets (xyz, w = squared distance to the centroid), centroids (w = 1); insecure: counts and lists
//   the sites whose lines do not reach the radius of security, as face/planar_targets.glsl says.
// Filled by neighbours/lists, step/settle and normals/smooth; consumed by project/walk and the next
// iteration. away has, for each site, how near the sites after the first K (x) and outside the list (y) would
// be had they not moved. The nearest K are enough nearly everywhere; face/planar_rest does the rest.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(constant_id = 1) const uint K = 16;

layout(push_constant) uniform Push {
    uint first; // of the block's sites
    uint block_sites;
    uint iteration;
    uint iterations; // counters of a kind
    float momentum; // share of the last motion that is added, 0 to 1
    float largest_move; // longest step
    float widest; // no face reaches farther from its site
};
READ_VEC4(0, Sites, sites);
layout(set = 0, binding = 1) readonly buffer Normals { uint normals[]; };
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
READ_VEC2(3, Away, away);
layout(set = 0, binding = 4) readonly buffer Status { uint status[]; };
layout(set = 0, binding = 5) writeonly buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 6) buffer Centroids { vec4 centroids[]; };
layout(set = 0, binding = 7) buffer Insecure { uint insecure[]; };

#include "common/blocks.glsl"
#include "common/list_bounds.glsl"
#include "face/planar.glsl"
#include "face/planar_targets.glsl"

void main() {
    uint site = block_site(thread_index());
    if (!in_block(site)) return;
    vec4 own = site_at(site);
    vec3 at = own.xyz;
    vec3 n = unpack_normal(normals[site]);
    vec3 u, v;
    tangent_frame(n, u, v);
    load_lines(site, own, n, u, v);
    float secure = list_bounds(AT2(away, site), uintBitsToFloat(status[1])).after_near;
    float bound = min(max(secure, 0.0), widest);
    cut_lines(bound);
    float twice_area, radius_sq;
    vec2 balance;
    measure_face(twice_area, balance, radius_sq);
    // A site that stays needs no face.
    if (is_pinned(own.w)) {
        aim(site, at, at, 0.0);
    } else if (radius_sq > 0.0 && 4.0 * radius_sq <= secure * secure && radius_sq < OPEN * bound * bound) {
        aim(site, at, at + balance.x * u + balance.y * v, radius_sq);
    } else {
        uint place = atomicAdd(insecure[count_near(iteration)], 1u);
        insecure[entry_near(place)] = site;
    }
}
