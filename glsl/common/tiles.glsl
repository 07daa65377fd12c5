// Points in tiles of consecutive indices with bounding boxes. Where the order follows space the boxes are
// small, and a search skips nearly all of them; the result is that of looking at every point.
#ifndef COMMON_TILES_GLSL
#define COMMON_TILES_GLSL

const uint TILE = 64u;

uint tile_count(uint points) { return (points + TILE - 1u) / TILE; }

// Squared distance of two boxes, 0 if they meet. A little less than the true one, so that rounding never
// hides a point.
float box_distance_sq(vec3 low, vec3 high, vec3 other_low, vec3 other_high) {
    vec3 gap = max(max(low - other_high, other_low - high), vec3(0.0));
    return 0.9999 * dot(gap, gap);
}

#endif
