// Purpose: prepares sorting the samples at the surface's vertices by the triangle of the mesh under them.
// Invocation: one vertex of the surface.
// Reads: under, inward_samples.
// Writes: keys, the triangle, or triangle_count where there is no sample; values, the vertex.
// Filled by fit/inward; consumed by spatial/radix_count and radix_scatter.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint point_count;
    uint triangle_count;
};
layout(set = 0, binding = 0) readonly buffer Under { uint under[]; };
READ_VEC4(1, InwardSamples, inward_samples);
layout(set = 0, binding = 2) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 3) writeonly buffer Values { uint values[]; };

void main() {
    uint i = thread_index();
    if (i >= point_count) return;
    keys[i] = AT(inward_samples, i).xyz == vec3(0.0) ? triangle_count : under[i];
    values[i] = i;
}
