// A tree of boxes over the triangles in spatial order: each leaf holds LEAF of them, each inner node the boxes of
// WIDTH nodes below it. Its shape follows from the number of triangles alone. Nodes lie in depth-first order, so that
// a search needs no stack: it goes on to the next node, or past all nodes below this one.
#ifndef COMMON_HIERARCHY_GLSL
#define COMMON_HIERARCHY_GLSL

layout(constant_id = 1) const uint WIDTH = 4;
layout(constant_id = 2) const uint LEAF = 2;

// A node is its box, each axis as lower and upper bound of 16 bits, and in w for an inner node the place past all
// nodes below it, for a leaf its number and this bit.
const uint LEAF_BIT = 0x80000000u;

// Steps of the bounds: the unit-diagonal frame lies within half a unit. All products and differences are exact.
const float BOX_STEP = 17.0 / 1048576.0;
const float BOX_ORIGIN = -17.0 / 32.0;

// Nodes of a full subtree whose root is `level` levels above the leaves.
uint subtree_nodes(uint level) {
    uint nodes = 1u;
    for (uint l = 0u; l < level; ++l) nodes = 1u + WIDTH * nodes;
    return nodes;
}

// The place of node i of a level in a tree of `levels` levels.
uint node_place(uint level, uint i, uint levels) {
    uint place = 0u, nodes = subtree_nodes(level);
    for (uint l = level; l + 1u < levels; ++l) {
        place += 1u + i % WIDTH * nodes;
        i /= WIDTH;
        nodes = 1u + WIDTH * nodes;
    }
    return place;
}

// The smallest box of the steps around low and high, with room for the rounding of this computation.
uvec3 pack_box(vec3 low, vec3 high) {
    vec3 l = floor((low - BOX_ORIGIN) / BOX_STEP - 0.02), h = ceil((high - BOX_ORIGIN) / BOX_STEP + 0.02);
    return uvec3(clamp(l, 0.0, 65535.0)) | (uvec3(clamp(h, 0.0, 65535.0)) << 16);
}

vec3 box_low(uvec3 box) { return vec3(box & 0xffffu) * BOX_STEP + BOX_ORIGIN; }
vec3 box_high(uvec3 box) { return vec3(box >> 16) * BOX_STEP + BOX_ORIGIN; }

// Squared distance of a point and a box, a little less than the true one, so that rounding never hides a triangle.
float box_gap_sq(uvec3 box, vec3 at) {
    vec3 gap = max(max(box_low(box) - at, at - box_high(box)), vec3(0.0));
    return 0.9999 * dot(gap, gap);
}

#endif
