// Purpose: face/planar for the sites whose lists do not decide their faces, by all sites that may cut them:
// faces, centroids, targets.
// Invocation: every n-th entry, n being the number of threads, of the list of such sites of
// a block.
// Reads: sites, normals (packed), boxes, insecure.
// Writes: targets (xyz, w = squared distance to the centroid), centroids (w = 1, 0 if the face is open);
//   insecure: counts open faces.
// Filled by face/planar_rest, neighbours/box_levels, step/settle and normals/smooth; consumed by project/walk
// and the next iteration.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 8
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uvec4 starts_low;  // first box of levels 0 to 3
    uvec4 starts_high; // of levels 4 to 7
    uint levels;
    uint site_count; // of all blocks
    uint first; // of the block's sites
    uint block_sites;
    uint iteration;
    uint iterations; // counters of a kind
    float momentum; // share of the last motion that is added, 0 to 1
    float largest_move; // longest step
    float widest; // no face reaches farther from its site
    uint threads; // of all workgroups
};
READ_VEC4(0, Sites, sites);
layout(set = 0, binding = 1) readonly buffer Normals { uint normals[]; };
READ_VEC4(2, Boxes, boxes);
layout(set = 0, binding = 3) writeonly buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 4) buffer Centroids { vec4 centroids[]; };
layout(set = 0, binding = 5) buffer Insecure { uint insecure[]; };

#include "face/planar_walk.glsl"
#include "face/planar_targets.glsl"

void main() {
    uint count = insecure[count_listed(iteration)];
    // Those of the last workgroup beyond that have nothing to do.
    if (thread_index() >= threads) return;
    for (uint entry = thread_index(); entry < count; entry += threads) {
        uint site = insecure[entry_listed(entry)];
        float reaches = uintBitsToFloat(insecure[entry_listed(entry) + 1u]);
        float radius = uintBitsToFloat(insecure[entry_listed(entry) + 2u]);
        start_face(site, widest);
        grown_radius_sq = reaches * reaches;
        vec2 balance = centroid_of(sum_near(radius));
        aim(site, site_place, site_place + balance.x * site_u + balance.y * site_v, grown_radius_sq);
        if (is_open()) atomicAdd(insecure[count_open(iteration)], 1u);
    }
}
