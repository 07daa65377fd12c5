// Purpose: face/planar for the sites that it leaves undecided, by their whole lists: faces, centroids,
// targets.
// Invocation: every n-th entry, n being the number of threads, of the list of undecided sites of a block.
// Reads: sites, normals (packed), neighbours, away, status (of neighbours/decide), insecure.
// Writes: targets (xyz, w = squared distance to the centroid), centroids (w = 1, 0 if the face is open);
//   insecure: counts open faces, and counts and lists the sites whose lists do not reach the radius of
//   security either, unless they reach too far, each with the radius in which the boxes have all sites that
//   may cut its face.
// Filled by face/planar, neighbours/lists, step/settle and normals/smooth; consumed by face/planar_exact,
// project/walk and the next iteration.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 8
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(constant_id = 1) const uint K = 24;

layout(push_constant) uniform Push {
    uint first; // of the block's sites
    uint block_sites;
    uint iteration;
    uint iterations; // counters of a kind
    float momentum; // share of the last motion that is added, 0 to 1
    float largest_move; // longest step
    float widest; // no face reaches farther from its site
    uint threads; // of all workgroups
    // Faces that the list does not decide are taken as they are if they reach this many times as far.
    float exact_within;
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
#include "face/planar_growing.glsl"
#include "face/planar_targets.glsl"

void main() {
    uint count = insecure[count_near(iteration)];
    // Those of the last workgroup beyond that have nothing to do.
    if (thread_index() >= threads) return;
    for (uint entry = thread_index(); entry < count; entry += threads) {
        uint site = insecure[entry_near(entry)];
        start_face(site, widest);
        uint s = 0u;
        do {
            uint j = neighbours[block_place(s, site)];
            cut_face(j, j != NONE);
        } while (++s < K);
        ListBounds bounds = list_bounds(AT2(away, site), uintBitsToFloat(status[1]));
        float secure = max(bounds.after_all, 0.0), within = exact_within * max(bounds.reach, 1e-6 * widest);
        bool decided = !grown_full && 4.0 * grown_radius_sq <= secure * secure;
        if (decided || grown_radius_sq >= within * within) {
            vec2 balance = centroid_of(sum_slots());
            aim(site, site_place, site_place + balance.x * site_u + balance.y * site_v, grown_radius_sq);
            if (is_open()) atomicAdd(insecure[count_open(iteration)], 1u);
        } else {
            uint place = atomicAdd(insecure[count_listed(iteration)], 1u);
            insecure[entry_listed(place)] = site;
            float radius = sqrt(grown_radius_sq);
            insecure[entry_listed(place) + 1u] = floatBitsToUint(radius);
            insecure[entry_listed(place) + 2u] = floatBitsToUint(search_radius(bounds, 2.0 * radius));
        }
    }
}
