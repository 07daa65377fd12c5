// Purpose: the lowest nodes of the tree of boxes (project/hierarchy.glsl), whose boxes are those of
// triangles.
// Invocation: one node.
// Reads: corners, wedges.
// Writes: nodes, the lowest.
// Filled by the upload of the surface; consumed by project/join and project/closest.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "project/hierarchy.glsl"

layout(push_constant) uniform Push {
    uint triangle_count;
    uint levels;
};
layout(set = 0, binding = 0) readonly buffer Corners { uint corners[]; };
READ_UVEC4(1, Wedges, wedges);
layout(set = 0, binding = 2) writeonly buffer Nodes { uvec4 nodes[]; };

void main() {
    uint i = thread_index();
    if (i >= (triangle_count + WIDTH - 1u) / WIDTH) return;
    uvec3 low[WIDTH], high[WIDTH];
    uint count = min(WIDTH, triangle_count - WIDTH * i);
    for (uint box = 0u; box < count; ++box) {
        uint t = WIDTH * i + box;
        vec3 a = uintBitsToFloat(AT(wedges, corners[3u * t]).xyz);
        vec3 b = uintBitsToFloat(AT(wedges, corners[3u * t + 1u]).xyz);
        vec3 c = uintBitsToFloat(AT(wedges, corners[3u * t + 2u]).xyz);
        low[box] = grid_below(min(a, min(b, c)));
        high[box] = grid_above(max(a, max(b, c)));
    }
    Node node = pack_node(low, high, count);
    uint place = node_place(0u, i, levels);
    nodes[2u * place] = node.head;
    nodes[2u * place + 1u] = node.tail;
}
