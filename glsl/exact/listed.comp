// Purpose: which sites may have a part of each triangle in the restricted Voronoi diagram, from the neighbour
//   list of a site that was near the last time.
// Invocation: one triangle.
// Reads: corners, sites, neighbours, away, status (of neighbours/decide), candidates (the site that was
// near).
// Writes: candidates[triangle * (PIECES + 1)] = the nearest site known, then as many sites as
//   counts[triangle] says, and in the end 0; counters, and candidates behind those: the triangles that the
//   list does not decide, and those with too many sites.
// Filled by neighbours/lists, exact/walked and, the first time, the host; consumed by exact/walked,
// exact/pairs and exact/pieces.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

// Slots of a list; fewer than SLOTS.
layout(constant_id = 3) const uint K = 20;

layout(push_constant) uniform Push {
    uint triangle_count;
    uint site_count;
};
READ_VEC4(0, Corners, corners);
READ_VEC4(1, Sites, sites);
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
READ_VEC2(3, Away, away);
layout(set = 0, binding = 4) readonly buffer Status { uint status[]; };
layout(set = 0, binding = 5) buffer Candidates { uint candidates[]; };
layout(set = 0, binding = 6) writeonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 7) buffer Counters { uint counters[]; };

#include "exact/exact_triangle.glsl"
#include "common/list_bounds.glsl"

void main() {
    uint t = thread_index();
    if (t >= triangle_count) return;
    // The scan of the counts ends with their sum.
    if (t == 0u) counts[triangle_count] = 0u;
    start_triangle(t);
    uint known = candidates[candidate_place(t)];
    vec3 from = AT(sites, known).xyz;
    put(0u, known, from);
    float off = slot_far[0];
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        uint j = neighbours[s * site_count + known];
        // Itself once more is the same as none, see drop_others.
        vec3 at = AT(sites, j == NONE ? known : j).xyz;
        put(s + 1u, j == NONE ? known : j, at);
        slot_site[s + 1u] = j;
    }
    ListBounds bounds = list_bounds(AT2(away, known), uintBitsToFloat(status[1]));
    bool decided = LENIENT * (off + reach_of_parts()) < bounds.after_all;
    if (decided) {
        write_parts(t, false);
    } else {
        counts[t] = 0u;
        candidates[candidate_place(t)] = nearest;
        candidates[undecided_place(atomicAdd(counters[0], 1u))] = t;
    }
}
