// Purpose: the lowest level of the tree of boxes (common/hierarchy.glsl).
// Invocation: one leaf.
// Reads: records.
// Writes: nodes, the leaves.
// Filled by the upload of the surface; consumed by project/join and project/closest.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/hierarchy.glsl"

layout(push_constant) uniform Push {
    uint triangle_count;
    uint levels;
};
layout(set = 0, binding = 0) readonly buffer Records { uvec4 records[]; };
layout(set = 0, binding = 1) writeonly buffer Nodes { uvec4 nodes[]; };

void main() {
    uint leaf = thread_index();
    if (leaf >= (triangle_count + LEAF - 1u) / LEAF) return;
    uint end = 3u * min((leaf + 1u) * LEAF, triangle_count);
    vec3 low = vec3(1.0), high = vec3(-1.0);
    for (uint r = 3u * leaf * LEAF; r < end; ++r) {
        vec3 corner = uintBitsToFloat(records[r].xyz);
        low = min(low, corner);
        high = max(high, corner);
    }
    nodes[node_place(0u, leaf, levels)] = uvec4(pack_box(low, high), LEAF_BIT | leaf);
}
