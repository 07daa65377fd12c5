// Purpose: adds up the parts of a product of two vectors, and what the solver's step follows from it.
// Invocation: one workgroup in all.
// Reads: partials.
// Writes: scalars: the squared residual (in the preconditioner's norm), the length of the step, the share of
// the last direction in the next one.
// Filled by fit/apply and fit/descend; consumed by fit/descend and fit/turn.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "fit/partials.glsl"

layout(push_constant) uniform Push {
    uint part_count;
    uint what; // FIRST, LENGTH or SHARE
};
layout(set = 0, binding = 0) readonly buffer Partials { float partials[]; };
layout(set = 0, binding = 1) buffer Scalars { float scalars[]; };

// The partials are those of the first residual, of the direction with its product, of a new residual.
const uint FIRST = 0u;
const uint LENGTH = 1u;

void main() {
    uint lane = gl_LocalInvocationID.x;
    float sum = 0.0;
    for (uint i = lane; i < part_count; i += WORKGROUP) sum += partials[i];
    sum = workgroup_sum(sum);
    if (lane != 0u) return;
    float residual = scalars[0];
    if (what == LENGTH) {
        // Once there is nothing left to gain, nothing moves any more.
        scalars[1] = sum > 0.0 && residual > 0.0 ? residual / sum : 0.0;
    } else {
        scalars[0] = sum;
        scalars[2] = what == FIRST || residual <= 0.0 ? 0.0 : sum / residual;
    }
}
