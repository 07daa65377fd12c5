// The restricted tangent face from all sites near enough to cut it, found by a walk over the boxes.
// The including file has what face/planar_growing.glsl and common/box_walk.glsl need, and site_count.
#ifndef COMMON_PLANAR_WALK_GLSL
#define COMMON_PLANAR_WALK_GLSL
#include "face/planar_growing.glsl"
#include "common/box_walk.glsl"

// Cuts the face by all sites whose boxes are within `radius`; an edge that does not find a slot makes the
// face full.
void offer_near(float radius) {
    BoxWalk walk = start_walk(site_place, radius);
    bool more;
    do {
        more = next_leaves(walk);
        while (walk.mask != 0u) {
            uint first = take_leaf(walk), c = 0u, hits = 0u;
            do {
                uint j = first + c;
                bool counts = j < site_count && j != site_index;
                hits |= counts && is_near(j) ? 1u << c : 0u;
            } while (++c < 8u);
            // Few are near, and cutting takes longest.
            do {
                cut_face(first + uint(findLSB(hits)), hits != 0u);
                hits &= hits - 1u;
            } while (hits != 0u);
        }
    } while (more);
}

// What all sites near enough leave of the line of site j.
vec2 left_by_all(uint j, Line line, vec2 left, float radius) {
    BoxWalk walk = start_walk(site_place, radius);
    bool more;
    do {
        more = next_leaves(walk);
        while (walk.mask != 0u && left.y > left.x) {
            uint first = take_leaf(walk), c = 0u;
            do {
                bool counts = first + c < site_count && first + c != site_index && first + c != j;
                uint k = counts ? first + c : site_index;
                vec2 cut = cut_by(left, line, line_of(k), j < k);
                left = counts && same_sheet(k) ? cut : left;
            } while (++c < 8u);
        }
    } while (more && left.y > left.x);
    return left;
}

// The sums of `below` over a face with any number of edges, without slots: each line of which the slots leave
// something is cut by all others. Sets the radius.
vec3 sum_near(float radius) {
    vec3 sum = vec3(0.0);
    float radius_sq = 0.0;
    BoxWalk walk = start_walk(site_place, radius);
    bool more;
    do {
        more = next_leaves(walk);
        while (walk.mask != 0u) {
            uint first = take_leaf(walk), c = 0u, hits = 0u;
            do {
                uint j = first + c;
                bool counts = j < site_count && j != site_index;
                hits |= counts && is_near(j) && same_sheet(j) ? 1u << c : 0u;
            } while (++c < 8u);
            do {
                uint j = hits == 0u ? site_index : first + uint(findLSB(hits));
                Line line = line_of(j);
                vec2 left = hits == 0u ? vec2(1.0, -1.0) : left_by_slots(j, line);
                if (left.y > left.x) left = left_by_all(j, line, left, radius);
                sum += below(line, left);
                radius_sq = max(radius_sq, end_sq(line, left));
                hits &= hits - 1u;
            } while (hits != 0u);
        }
    } while (more);
    grown_radius_sq = radius_sq > 0.0 ? radius_sq : grown_bound * grown_bound;
    return sum;
}

#endif
