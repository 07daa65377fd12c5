// A tree of boxes over the triangles by rank: four boxes per node, each around one triangle or around another
// node. Its shape follows from the number of triangles alone. Nodes lie in depth-first order: behind a node
// come its children, each with all that is below it.
#ifndef COMMON_HIERARCHY_GLSL
#define COMMON_HIERARCHY_GLSL

const uint WIDTH = 4u;

// Boxes are in steps of a grid of 16 bits an axis over the unit-diagonal frame, which lies within half a
// unit.
const float GRID_STEP = 17.0 / 1048576.0;
const float GRID_ORIGIN = -17.0 / 32.0;

vec3 to_grid(vec3 x) { return (x - GRID_ORIGIN) / GRID_STEP; }

// Bounds with a margin for the rounding of both ends of a distance.
uvec3 grid_below(vec3 x) { return uvec3(clamp(floor(to_grid(x) - 0.05), 0.0, 65535.0)); }
uvec3 grid_above(vec3 x) { return uvec3(clamp(ceil(to_grid(x) + 0.05), 0.0, 65535.0)); }

// Nodes in a full tree below and with a node `level` levels above the lowest ones.
uint tree_nodes(uint level) {
    uint nodes = 1u;
    for (uint l = 0u; l < level; ++l) nodes = 1u + WIDTH * nodes;
    return nodes;
}

// The place of node i of a level in a tree of `levels` levels.
uint node_place(uint level, uint i, uint levels) {
    uint place = 0u, nodes = tree_nodes(level);
    for (uint l = level; l + 1u < levels; ++l) {
        place += 1u + i % WIDTH * nodes;
        i /= WIDTH;
        nodes = 1u + WIDTH * nodes;
    }
    return place;
}

// nodes[2 * place] = the lower corner of all four boxes: x and y in one word; z, then for each axis a shift
// of 4 bits, then a bit for each box that exists; the lower and the upper x of the four boxes above the
// corner, a byte each, to be shifted left. nodes[2 * place + 1] = the same of y, then of z.
struct Node {
    uvec4 head;
    uvec4 tail;
};

uvec3 node_corner(Node node) {
    return uvec3(node.head.x & 0xffffu, node.head.x >> 16, node.head.y & 0xffffu);
}
uvec3 node_shift(Node node) { return (uvec3(node.head.y) >> uvec3(16u, 20u, 24u)) & 15u; }
uint node_boxes(Node node) { return node.head.y >> 28; }

uvec3 node_low(Node node, uint box) {
    return (uvec3(node.head.z, node.tail.x, node.tail.z) >> 8u * box) & 255u;
}
uvec3 node_high(Node node, uint box) {
    return (uvec3(node.head.w, node.tail.y, node.tail.w) >> 8u * box) & 255u;
}

// Shifts that make `extent` fit a byte, rounded up.
uvec3 byte_shift(uvec3 extent) {
    uvec3 shift = uvec3(max(findMSB(extent) - 7, ivec3(0)));
    uvec3 top = (extent + (uvec3(1u) << shift) - 1u) >> shift;
    return shift + uvec3(greaterThan(top, uvec3(255u)));
}

Node pack_node(uvec3 low[WIDTH], uvec3 high[WIDTH], uint count) {
    uvec3 corner = low[0], top = high[0];
    for (uint box = 1u; box < count; ++box) {
        corner = min(corner, low[box]);
        top = max(top, high[box]);
    }
    uvec3 shift = byte_shift(top - corner);
    uvec3 lows = uvec3(0u), highs = uvec3(0u);
    for (uint box = 0u; box < count; ++box) {
        lows |= ((low[box] - corner) >> shift) << 8u * box;
        highs |= ((high[box] - corner + (uvec3(1u) << shift) - 1u) >> shift) << 8u * box;
    }
    uint last = corner.z | shift.x << 16 | shift.y << 20 | shift.z << 24 | ((1u << count) - 1u) << 28;
    return Node(uvec4(corner.x | corner.y << 16, last, lows.x, highs.x),
                uvec4(lows.y, highs.y, lows.z, highs.z));
}

#endif
