// Purpose: looks again at the triangles around vertices whose moves were undone.
// Invocation: one such vertex.
// Reads: counters (which of them), undone, firsts, twins, corners, positions, moved.
// Writes: stamps, the pass at vertices whose moves are undone now; undone and counters[0], these vertices.
// Filled by polish/folded and polish/advance; consumed by polish/accept.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/half_edges.glsl"

layout(push_constant) uniform Push { uint pass; };
layout(set = 0, binding = 0) readonly buffer Firsts { uint firsts[]; };
layout(set = 0, binding = 1) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 2) readonly buffer Corners { uint corners[]; };
READ_VEC4(3, Positions, positions);
READ_UVEC4(4, Moved, moved);
layout(set = 0, binding = 5) buffer Stamps { uint stamps[]; };
layout(set = 0, binding = 6) buffer Undone { uint undone[]; };
layout(set = 0, binding = 7) buffer Counters { uint counters[]; };
#include "polish/moved.glsl"
#include "polish/undo.glsl"

// More triangles than any vertex has, so that the loop ends in any case.
const uint MAX_RING = 65535u;

void main() {
    uint i = counters[1] + thread_index();
    if (i >= counters[2]) return;
    uint first = firsts[undone[i]], h = first;
    uint left = first == NONE ? 0u : MAX_RING;
    while (left > 0u) {
        uint t = h / 3u;
        if (is_spoiled(t, pass)) undo_corners(t, pass);
        h = twins[previous_half_edge(h)];
        left = h == NONE || h == first ? 0u : left - 1u;
    }
}
