// Purpose: exact/listed for the triangles that it leaves undecided, by a walk over the boxes of all sites.
// Invocation: one entry of the list of undecided triangles; dispatched for as many as there are.
// Reads: corners, sites, boxes, away, status (of neighbours/decide), candidates (the site that is near),
// counters.
// Writes: candidates, counts and counters as exact/listed does.
// Filled by exact/listed, exact/enough and neighbours/lists; consumed by exact/pairs and exact/pieces.
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
    uint triangle_count;
    uint site_count;
};
READ_VEC4(0, Corners, corners);
READ_VEC4(1, Sites, sites);
READ_VEC4(2, Boxes, boxes);
READ_VEC2(3, Away, away);
layout(set = 0, binding = 4) readonly buffer Status { uint status[]; };
layout(set = 0, binding = 5) buffer Candidates { uint candidates[]; };
layout(set = 0, binding = 6) writeonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 7) buffer Counters { uint counters[]; };

#include "common/box_walk.glsl"
#include "exact/exact_triangle.glsl"
#include "common/list_bounds.glsl"

const uint ROUNDS = 2u;

uint put_count;

// Puts a site that may have a part into the next slot.
void offer(uint j) {
    vec3 at = AT(sites, j).xyz;
    float far = distance(at, middle);
    bool takes = far <= reach_of_parts();
    bool nearer = far < nearest_far || (far == nearest_far && j < nearest);
    nearest = takes && nearer ? j : nearest;
    nearest_far = takes ? min(far, nearest_far) : nearest_far;
    vec3 sq = corner_distances_sq(at);
    cover(sq);
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        bool here = takes && s == put_count;
        slot_site[s] = here ? j : slot_site[s];
        slot_far[s] = here ? far : slot_far[s];
        slot_sq[s] = here ? sq : slot_sq[s];
    }
    put_count += takes ? 1u : 0u;
}

void gather(uint from, float radius) {
    BoxWalk walk = start_walk(AT(sites, from).xyz, radius);
    bool more;
    do {
        more = next_leaves(walk);
        while (walk.mask != 0u) {
            uint first = take_leaf(walk), c = 0u;
            do {
                // The first one is in its slot already.
                uint j = first + c;
                if (j < site_count && j != from) offer(j);
            } while (++c < 8u);
        }
    } while (more);
}

void main() {
    uint entry = thread_index();
    if (entry >= counters[0]) return;
    uint t = candidates[undecided_place(entry)];
    start_triangle(t);
    nearest = candidates[candidate_place(t)];
    // What has all corners within a short way is often met late, when sites that have no part fill the slots
    // already. A second round knows it from the start.
    put_count = SLOTS + 1u;
    for (uint round = 0u; round < ROUNDS && put_count > SLOTS; ++round) {
        uint from = nearest;
        float known_sq = covering_sq;
        start_triangle(t);
        cover(vec3(known_sq));
        put(0u, from, AT(sites, from).xyz);
        put_count = 1u;
        ListBounds bounds = list_bounds(AT2(away, from), uintBitsToFloat(status[1]));
        gather(from, search_radius(bounds, LENIENT * (nearest_far + reach_of_parts())));
    }
    write_parts(t, put_count > SLOTS);
}
