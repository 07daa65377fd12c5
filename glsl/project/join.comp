// Purpose: one level of the tree of boxes (project/hierarchy.glsl) from the level below it.
// Invocation: one node of the level.
// Reads: nodes, those of the level below.
// Writes: nodes, those of the level.
// Filled by project/leaves and the run of this kernel for the level below; consumed by project/closest.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "project/hierarchy.glsl"

layout(push_constant) uniform Push {
    uint level;  // the lowest is 0
    uint levels; // of the tree
    uint below;  // nodes of the level below
};
layout(set = 0, binding = 0) buffer Nodes { uvec4 nodes[]; };

void main() {
    uint i = thread_index();
    if (i >= (below + WIDTH - 1u) / WIDTH) return;
    uint place = node_place(level, i, levels);
    uint stride = tree_nodes(level - 1u);
    uvec3 low[WIDTH], high[WIDTH];
    uint count = min(WIDTH, below - WIDTH * i);
    for (uint box = 0u; box < count; ++box) {
        uint child = place + 1u + box * stride;
        Node node = Node(nodes[2u * child], nodes[2u * child + 1u]);
        uvec3 top = uvec3(0u);
        for (uint b = 0u; b < WIDTH; ++b) top = max(top, node_high(node, b));
        low[box] = node_corner(node);
        high[box] = low[box] + (top << node_shift(node));
    }
    Node node = pack_node(low, high, count);
    nodes[2u * place] = node.head;
    nodes[2u * place + 1u] = node.tail;
}
