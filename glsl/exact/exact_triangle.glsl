// One triangle of the surface and the sites that may have a part of it. The distance to a site is largest at
// a corner, so no point of the triangle is farther from its nearest site than some one site is from all
// corners; a site that is farther than that has no part. Neither has one that another is nearer than at all
// three corners. The including file has declared the buffers corners, sites, candidates, counts and counters
// and the push constants triangle_count and site_count. Constants 1 and 2 are taken here.
#ifndef COMMON_EXACT_TRIANGLE_GLSL
#define COMMON_EXACT_TRIANGLE_GLSL

// Candidates for one triangle, at least one more than the listed sites.
layout(constant_id = 1) const uint SLOTS = 24;
// Sites of one triangle. Those with more are left to the host.
layout(constant_id = 2) const uint PIECES = 12;

// A factor that is larger than the rounding of distances.
const float LENIENT = 1.00001;

vec3 corner_a, corner_b, corner_c, middle;
float around; // distance of the farthest corner from the middle

uint slot_site[SLOTS]; // NONE if empty
float slot_far[SLOTS]; // distance from the middle
vec3 slot_sq[SLOTS]; // squared distances from the corners
uint nearest;
float nearest_far; // its distance from the middle
float covering_sq; // least squared radius within which some one site has all corners

void start_triangle(uint t) {
    corner_a = AT(corners, 3u * t).xyz;
    corner_b = AT(corners, 3u * t + 1u).xyz;
    corner_c = AT(corners, 3u * t + 2u).xyz;
    middle = (corner_a + corner_b + corner_c) / 3.0;
    around = max(max(distance(corner_a, middle), distance(corner_b, middle)), distance(corner_c, middle));
    nearest = NONE;
    nearest_far = 3.402823466e38;
    covering_sq = 1e18;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) slot_site[s] = NONE;
}

vec3 corner_distances_sq(vec3 at) {
    vec3 a = corner_a - at, b = corner_b - at, c = corner_c - at;
    return vec3(dot(a, a), dot(b, b), dot(c, c));
}

// A site with a part is no farther from the middle than this.
float reach_of_parts() { return LENIENT * (sqrt(covering_sq) + around); }

// Lowers covering_sq for a site at these squared distances from the corners.
void cover(vec3 sq) { covering_sq = min(covering_sq, max(max(sq.x, sq.y), sq.z)); }

// Puts a site into a slot.
void put(uint s, uint j, vec3 at) {
    float far = distance(at, middle);
    bool nearer = far < nearest_far || (far == nearest_far && j < nearest);
    nearest = nearer ? j : nearest;
    nearest_far = min(far, nearest_far);
    slot_site[s] = j;
    slot_far[s] = far;
    slot_sq[s] = corner_distances_sq(at);
    cover(slot_sq[s]);
}

// Empties the slots of sites that have no part.
void drop_others() {
    float reach = reach_of_parts();
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) slot_site[s] = slot_far[s] <= reach ? slot_site[s] : NONE;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        [[unroll]] for (uint o = 0u; o < SLOTS; ++o) {
            // If the nearer site is dropped too, the one that caused that is nearer still.
            bool nearer = o != s && slot_site[o] != NONE && all(lessThan(slot_sq[o], slot_sq[s]));
            slot_site[s] = nearer ? NONE : slot_site[s];
        }
    }
}

// candidates: for each triangle a site that is near, to begin with the next time, then PIECES sites. Behind
// that the triangles that the lists do not decide, then those with more than PIECES sites, in no order.
// counters: how many there are of each.
uint candidate_place(uint t) { return t * (PIECES + 1u); }
uint undecided_place(uint i) { return triangle_count * (PIECES + 1u) + i; }
uint crowded_place(uint i) { return triangle_count * (PIECES + 2u) + i; }

// Writes the slots' sites; `full` if there were not enough slots.
void write_parts(uint t, bool full) {
    drop_others();
    uint count = 0u;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        bool writes = slot_site[s] != NONE && count < PIECES;
        if (writes) candidates[candidate_place(t) + 1u + count] = slot_site[s];
        count += slot_site[s] != NONE ? 1u : 0u;
    }
    bool crowded = full || count > PIECES;
    candidates[candidate_place(t)] = nearest;
    counts[t] = crowded ? 0u : count;
    if (crowded) candidates[crowded_place(atomicAdd(counters[1], 1u))] = t;
}

#endif
