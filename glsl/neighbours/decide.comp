// Purpose: decides whether the lists are rebuilt, without the host.
// Invocation: one in all.
// Reads: status[0]; full, the workgroups of each of these dispatches.
// Writes: groups, the same or zero; status[1], the largest moved / reach since the last rebuild (0 if the
// lists are rebuilt now); status[2], how often they were rebuilt; status[0] = 0 for the next time.
// Filled by neighbours/moved; consumed by the indirect dispatches of neighbours/box_levels and lists, and by
// the faces.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 1
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint dispatch_count;
    float max_rho; // lists are rebuilt beyond this; always if negative
};
READ_UVEC4(0, Full, full);
layout(set = 0, binding = 1) writeonly buffer Groups { uvec4 groups[]; };
layout(set = 0, binding = 2) buffer Status { uint status[]; };

void main() {
    if (thread_index() != 0u) return;
    uint rho = status[0];
    bool anew = uintBitsToFloat(rho) > max_rho;
    for (uint i = 0u; i < dispatch_count; ++i) groups[i] = anew ? AT(full, i) : uvec4(0u);
    status[0] = 0u;
    status[1] = anew ? 0u : rho;
    status[2] += anew ? 1u : 0u;
}
