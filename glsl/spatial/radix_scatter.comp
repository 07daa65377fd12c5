// Purpose: second half of a pass of the stable radix sort: moves every pair to its place by one digit.
// Invocation: one strip of STRIP consecutive pairs, moved in order; that is what makes the sort stable.
// Reads: keys, values, places[digit * strips + strip]: where the strip's first pair with this digit goes.
// Writes: sorted_keys, sorted_values.
// Filled by spatial/scan_apply; consumed by the next pass.
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
layout(set = 0, binding = 1) readonly buffer Values { uint values[]; };
layout(set = 0, binding = 2) readonly buffer Places { uint places[]; };
layout(set = 0, binding = 3) writeonly buffer SortedKeys { uint sorted_keys[]; };
layout(set = 0, binding = 4) writeonly buffer SortedValues { uint sorted_values[]; };

void main() {
    uint strips = strip_count(key_count);
    uint strip = thread_index();
    if (strip >= strips) return;
    uint next[DIGITS];
    [[unroll]] for (uint d = 0u; d < DIGITS; ++d) next[d] = places[d * strips + strip];
    for (uint i = strip * STRIP; i < min(strip * STRIP + STRIP, key_count); ++i) {
        uint key = keys[i];
        uint digit = key >> shift & (DIGITS - 1u);
        uint place = 0u;
        [[unroll]] for (uint d = 0u; d < DIGITS; ++d) {
            place |= digit == d ? next[d] : 0u;
            next[d] += digit == d ? 1u : 0u;
        }
        sorted_keys[place] = key;
        sorted_values[place] = values[i];
    }
}
