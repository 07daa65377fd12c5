// A walk over the implicit hierarchy of boxes of neighbours/box_levels that finds the leaves, of eight sites
// each, that a ball touches. The sites may have moved since the boxes were made; the caller enlarges the ball
// by that much. The including file has declared the buffer boxes and, as push constants, starts_low,
// starts_high and levels.
#ifndef COMMON_BOX_WALK_GLSL
#define COMMON_BOX_WALK_GLSL

struct BoxWalk {
    vec3 at;
    float radius_sq;
    // Boxes still to enter: those of the current level (bits of `mask`, counted from `base`), and eight bits
    // for each level above.
    uint level, base, mask;
    uvec2 above;
};

BoxWalk start_walk(vec3 at, float radius) { return BoxWalk(at, radius * radius, levels, 0u, 1u, uvec2(0u)); }

uint level_start(uint level) {
    uvec4 starts = level < 4u ? starts_low : starts_high;
    uint i = level & 3u;
    return i < 2u ? (i == 0u ? starts.x : starts.y) : (i == 2u ? starts.z : starts.w);
}

// A bit for each of the eight boxes from `base` on that the ball touches.
uint touched_boxes(BoxWalk walk) {
    uint mask = 0u, start = level_start(walk.level) + walk.base;
    uint child = 0u;
    do {
        vec3 low = AT(boxes, 2u * (start + child)).xyz, high = AT(boxes, 2u * (start + child) + 1u).xyz;
        vec3 off = max(max(low - walk.at, walk.at - high), vec3(0.0));
        mask |= dot(off, off) <= walk.radius_sq ? 1u << child : 0u;
    } while (++child < 8u);
    return mask;
}

// Advances to the next eight leaves of which the ball touches some; false if there are none. The loop tests
// its condition at the end, since some devices run the body of a while loop once more than needed. That is
// sound only because a round more changes nothing for a lane that is done (docs/experiments.md).
bool next_leaves(inout BoxWalk walk) {
    bool on;
    do {
        while (walk.mask == 0u && walk.level < levels) {
            ++walk.level;
            walk.mask = walk.above.x & 0xffu;
            walk.above = uvec2(walk.above.x >> 8 | walk.above.y << 24, walk.above.y >> 8);
            walk.base = walk.base >> 3 & ~7u;
        }
        if (walk.mask != 0u && walk.level > 0u) {
            uint child = uint(findLSB(walk.mask));
            walk.mask &= walk.mask - 1u;
            walk.above = uvec2(walk.above.x << 8 | walk.mask, walk.above.y << 8 | walk.above.x >> 24);
            walk.base = 8u * (walk.base + child);
            --walk.level;
            walk.mask = touched_boxes(walk);
        }
        on = walk.mask == 0u ? walk.level < levels : walk.level > 0u;
    } while (on);
    return walk.mask != 0u;
}

// Removes one of the leaves that next_leaves found, and returns its first site.
uint take_leaf(inout BoxWalk walk) {
    uint leaf = walk.base + uint(findLSB(walk.mask));
    walk.mask &= walk.mask - 1u;
    return 8u * leaf;
}

#endif
