// Purpose: undoes the moves of triangles that fold or become flat.
// Invocation: one triangle.
// Reads: corners, positions, moved.
// Writes: stamps, 0 at vertices of such triangles; undone, these vertices; counters[0], how many.
// Filled by polish/land; consumed by polish/spread and polish/accept.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push { uint triangle_count; };
layout(set = 0, binding = 0) readonly buffer Corners { uint corners[]; };
READ_VEC4(1, Positions, positions);
READ_UVEC4(2, Moved, moved);
layout(set = 0, binding = 3) buffer Stamps { uint stamps[]; };
layout(set = 0, binding = 4) writeonly buffer Undone { uint undone[]; };
layout(set = 0, binding = 5) buffer Counters { uint counters[]; };
#include "polish/moved.glsl"
#include "polish/undo.glsl"

void main() {
    uint t = thread_index();
    if (t >= triangle_count) return;
    if (is_spoiled(t, 0u)) undo_corners(t, 0u);
}
