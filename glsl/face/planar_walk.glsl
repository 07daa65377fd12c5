// The restricted tangent face from all sites near enough to cut it, found by walks over the boxes.
// The including file has what face/planar_growing.glsl and common/box_walk.glsl need, and site_count.
#ifndef COMMON_PLANAR_WALK_GLSL
#define COMMON_PLANAR_WALK_GLSL
#include "face/planar_growing.glsl"
#include "common/box_walk.glsl"

// What a walk does with the sites that it finds.
const uint FILL = 0u; // cuts the face by them; the slots keep those that are edges so far
const uint COLLECT = 1u; // puts them into the slots, until these are taken
const uint CUT = 2u; // cuts the lines in the slots by them

// The sums of `below` over the face that all sites whose boxes are within `radius` leave; sets its radius.
// One walk is enough unless the slots have no room for all edges. Then all lines near enough are cut by all
// others, as many at a time as there are slots. It is one loop for all walks, because compilers copy a
// function into every place that calls it. Lanes leave the loops at different times: a round more changes
// nothing for those that are done.
vec3 sum_near(float radius) {
    vec3 sum = vec3(0.0);
    float farthest_sq = 0.0, slots_sq = 0.0;
    uint task = FILL;
    int after = -1; // only sites after this one
    bool walks = true;
    while (walks) {
        BoxWalk walk = start_walk(site_place, radius);
        bool more = true;
        while (more) {
            more = next_leaves(walk);
            while (walk.mask != 0u) {
                uint first = take_leaf(walk), c = 0u, hits = 0u;
                [[unroll]] do {
                    uint j = first + c;
                    bool counts = j < site_count && j != site_index && int(j) > after;
                    hits |= counts && is_near(j) ? 1u << c : 0u;
                } while (++c < 8u);
                hits = task == COLLECT && slot_site[SLOTS - 1u] != NONE ? 0u : hits;
                // Few are near, and cutting takes longest.
                while (hits != 0u) {
                    bool counts = hits != 0u;
                    uint j = counts ? first + uint(findLSB(hits)) : site_index;
                    hits &= hits - 1u;
                    counts = counts && same_sheet(j);
                    Line line = line_of(j);
                    vec2 left = chord(line.offset, grown_bound);
                    if (task == FILL) {
                        left = left_by_slots(j, line);
                        counts = counts && left.y > left.x && !has_slot(j);
                    }
                    bool enters = counts && task != CUT && left.y > left.x;
                    slots_sq = take_line(j, line, left, counts && task != COLLECT, enters);
                    if (task == FILL) shrink_radius(slots_sq);
                }
            }
        }
        if (walks && (task == CUT || !grown_full)) {
            sum += sum_slots();
            farthest_sq = max(farthest_sq, slots_sq);
        }
        walks = walks && grown_full && (task != COLLECT || slot_site[0] != NONE);
        after = task == CUT ? last_slot_site() : -1;
        if (grown_full && task != COLLECT) empty_slots();
        task = task == COLLECT ? CUT : COLLECT;
    }
    float bound_sq = grown_bound * grown_bound;
    if (grown_full) grown_radius_sq = farthest_sq > 0.0 ? farthest_sq : bound_sq;
    return sum;
}

#endif
