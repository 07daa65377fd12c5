// Purpose: brings an array of vectors into a new order.
// Invocation: one element.
// Reads: order[new place] = old place, source.
// Writes: target.
// Filled by spatial/radix_scatter; consumed by every kernel that works on sites in spatial order.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push { uint element_count; };
layout(set = 0, binding = 0) readonly buffer Order { uint order[]; };
READ_VEC4(1, Source, source);
layout(set = 0, binding = 2) writeonly buffer Target { vec4 target[]; };

void main() {
    uint i = thread_index();
    if (i < element_count) target[i] = AT(source, order[i]);
}
