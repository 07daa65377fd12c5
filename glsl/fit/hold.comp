// Purpose: finds the triangles that the moves spoil around vertices whose moves were shortened.
// Invocation: one such vertex.
// Reads: counters (which of them), firsts, twins, corners, positions, moves.
// Writes: marks, the pass at the corners of such triangles that move; held and counters[0], these vertices.
// Filled by fit/shorten; consumed by the next fit/shorten and by fit/accept.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/half_edges.glsl"

layout(push_constant) uniform Push {
    uint pass;
    float least; // angles below this may lose little; radians
};
layout(set = 0, binding = 0) readonly buffer Firsts { uint firsts[]; };
layout(set = 0, binding = 1) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 2) readonly buffer Corners { uint corners[]; };
READ_VEC4(3, Positions, positions);
READ_VEC4(4, Moves, moves);
layout(set = 0, binding = 5) buffer Marks { uint marks[]; };
layout(set = 0, binding = 6) buffer Held { uint held[]; };
layout(set = 0, binding = 7) buffer Counters { uint counters[]; };
#include "fit/limits.glsl"

void main() {
    uint i = counters[1] + thread_index();
    if (i >= counters[2]) return;
    uint first = firsts[held[i]];
    for (uint h = first; h != NONE;) {
        uint t = h / 3u;
        if (is_spoiled(t, least)) hold_corners(t, pass);
        h = twins[previous_half_edge(h)];
        h = h == first ? NONE : h;
    }
}
