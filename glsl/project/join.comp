// Purpose: one level of the tree of boxes (common/hierarchy.glsl) from the level below it.
// Invocation: one node of the level.
// Reads: nodes, those of the level below.
// Writes: nodes, those of the level.
// Filled by project/leaves and the run of this kernel for the level below; consumed by project/closest.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/hierarchy.glsl"

layout(push_constant) uniform Push {
    uint level;
    uint levels;
    uint below;      // nodes of the level below
    uint node_count; // nodes of the tree
};
layout(set = 0, binding = 0) buffer Nodes { uvec4 nodes[]; };

void main() {
    uint i = thread_index();
    if (i >= (below + WIDTH - 1u) / WIDTH) return;
    uint place = node_place(level, i, levels);
    uint step = subtree_nodes(level - 1u);
    uvec3 low = uvec3(0xffffu), high = uvec3(0u);
    for (uint child = 0u; child < WIDTH && WIDTH * i + child < below; ++child) {
        uvec3 box = nodes[place + 1u + child * step].xyz;
        low = min(low, box & 0xffffu);
        high = max(high, box >> 16);
    }
    nodes[place] = uvec4(low | (high << 16), min(place + 1u + WIDTH * step, node_count));
}
