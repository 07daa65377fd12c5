// Purpose: finds the triangles that the moves spoil.
// Invocation: one triangle.
// Reads: corners, positions, moves, counters[SMALLEST] and counters[LARGEST].
// Writes: marks, 1 at the corners of such triangles that move; held, these vertices; counters[0], how many.
// Filled by fit/clamp and fit/extremes; consumed by fit/shorten and fit/hold.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint triangle_count;
    float least; // angles below this may lose little; radians
};
layout(set = 0, binding = 0) readonly buffer Corners { uint corners[]; };
READ_VEC4(1, Positions, positions);
READ_VEC4(2, Moves, moves);
layout(set = 0, binding = 3) buffer Marks { uint marks[]; };
layout(set = 0, binding = 4) writeonly buffer Held { uint held[]; };
layout(set = 0, binding = 5) buffer Counters { uint counters[]; };
#include "fit/limits.glsl"

void main() {
    uint t = thread_index();
    if (t >= triangle_count) return;
    if (is_spoiled(t, least)) hold_corners(t, 1u);
}
