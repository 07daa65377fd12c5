// Purpose: lists the edges whose flip gains something by angles and valences.
// Invocation: one triangle.
// Reads: positions, corners, twins, states.
// Writes: candidates, one half-edge of each such edge in any order; counters[0], how many.
// Filled by the upload of the mesh and polish/*; consumed by polish/claim. What else a flip must fulfil is
// looked at there, since few edges get so far.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint triangle_count;
    float valence_weight;
};
READ_VEC4(0, Positions, positions);
layout(set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 2) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 3) readonly buffer States { uint states[]; };
layout(set = 0, binding = 4) writeonly buffer Candidates { uint candidates[]; };
layout(set = 0, binding = 5) buffer Counters { uint counters[]; };
#include "polish/diamond.glsl"

void main() {
    uint t = thread_index();
    if (t >= triangle_count) return;
    uvec3 at = uvec3(corners[3u * t], corners[3u * t + 1u], corners[3u * t + 2u]);
    vec3 a = AT(positions, at.x).xyz, b = AT(positions, at.y).xyz, c = AT(positions, at.z).xyz;
    uvec3 own = uvec3(states[at.x], states[at.y], states[at.z]);
    uint k = 0u;
    do {
        uint h = 3u * t + k, twin = twins[h];
        // Each edge once, by the first of its half-edges.
        if (twin != NONE && h < twin) {
            uint beyond = corners[previous_half_edge(twin)];
            uvec4 of = uvec4(own, states[beyond]);
            float gain = flip_gain(a, b, c, AT(positions, beyond).xyz, of, valence_weight);
            if (((of.x | of.y | of.z | of.w) & FIXED) == 0u && gain > MIN_GAIN)
                candidates[atomicAdd(counters[0], 1u)] = h;
        }
        vec3 first = a;
        a = b, b = c, c = first;
        own = own.yzx;
    } while (++k < 3u);
}
