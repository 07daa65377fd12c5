// A walk over the tree of project/hierarchy.glsl, from the root to the nodes that the caller wants.
#ifndef PROJECT_TREE_WALK_GLSL
#define PROJECT_TREE_WALK_GLSL
#include "project/hierarchy.glsl"

// A node: its place, its number in its level, its level, the nodes below and with it in a full tree; and the
// children still to visit of the nodes above, four bits each, those of the parent in the lowest bits.
struct TreeWalk {
    uint place;
    uint number;
    uint level;
    uint stride;
    uint pending;
    uint pending_above;
};

TreeWalk at_root(uint levels) { return TreeWalk(0u, 0u, levels - 1u, tree_nodes(levels - 1u), 0u, 0u); }

// Goes on to the first of the children in `found`, a bit for each, or else of those still to visit; false if
// there is none. The children of a lowest node are triangles, to which no walk goes.
bool next_node(inout TreeWalk walk, uint found, uint levels) {
    found = walk.level == 0u ? 0u : found;
    // Up to the first node with a child left.
    while (found == 0u && walk.level + 1u < levels) {
        walk.stride = 1u + WIDTH * walk.stride;
        walk.place -= 1u + walk.number % WIDTH * (walk.stride / WIDTH);
        walk.number /= WIDTH;
        ++walk.level;
        found = walk.pending & 15u;
        walk.pending = walk.pending >> 4 | walk.pending_above << 28;
        walk.pending_above >>= 4;
    }
    // And down to the first child left.
    walk.pending_above = walk.pending_above << 4 | walk.pending >> 28;
    walk.pending = walk.pending << 4 | (found & (found - 1u));
    uint child = uint(max(findLSB(found), 0));
    walk.stride /= WIDTH;
    walk.place += 1u + child * walk.stride;
    walk.number = walk.number * WIDTH + child;
    --walk.level;
    return found != 0u;
}

#endif
