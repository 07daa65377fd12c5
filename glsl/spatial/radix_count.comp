// Purpose: first half of a pass of the stable radix sort: how often each of the 16 digits occurs in every
// strip.
// Invocation: one strip of STRIP consecutive keys.
// Reads: keys.
// Writes: counts[digit * strips + strip]: scanned in this order they are the places where the strips' digits
// go.
// Filled by spatial/morton or the pass before; consumed by spatial/scan_sum, scan_apply, radix_scatter.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "spatial/strip.glsl"

layout(push_constant) uniform Push {
    uint key_count;
    uint shift; // lowest bit of the digit
};
layout(set = 0, binding = 0) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 1) writeonly buffer Counts { uint counts[]; };

void main() {
    uint strips = strip_count(key_count);
    uint strip = thread_index();
    if (strip >= strips) return;
    // Registers: every index is known once the loops are unrolled.
    uint found[DIGITS];
    [[unroll]] for (uint d = 0u; d < DIGITS; ++d) found[d] = 0u;
    for (uint i = strip * STRIP; i < min(strip * STRIP + STRIP, key_count); ++i) {
        uint digit = keys[i] >> shift & (DIGITS - 1u);
        [[unroll]] for (uint d = 0u; d < DIGITS; ++d) found[d] += digit == d ? 1u : 0u;
    }
    [[unroll]] for (uint d = 0u; d < DIGITS; ++d) counts[d * strips + strip] = found[d];
}
