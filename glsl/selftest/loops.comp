// Purpose: loops that lanes leave one by one, and arrays of an invocation whose places are not known before.
// Invocation: one element of the inputs.
// Reads: words.
// Writes: rounds[element] = length of a sequence; sorted[element] = the word with its digits in base 16 in
// ascending order.
// Filled by and checked in src/gpu/selftest on the host.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint count;
    uint most_rounds;
    uint digit_count; // DIGITS; a constant would let compilers unroll the loops
};
READ_UVEC4(0, Words, words);
layout(set = 0, binding = 1) writeonly buffer Rounds { uint rounds[]; };
layout(set = 0, binding = 2) writeonly buffer Sorted { uint sorted[]; };

const uint DIGITS = 8u;

void main() {
    uint i = thread_index();
    if (i >= count) return;
    uint word = AT(words, i).z;
    // Collatz's sequence, as far as 1.
    uint value = word & 63u, length = 0u;
    for (uint k = 0u; k < most_rounds; ++k) {
        if (value <= 1u) break;
        value = (value & 1u) != 0u ? 3u * value + 1u : value >> 1;
        ++length;
    }
    rounds[i] = length;
    // By insertion.
    uint digits[DIGITS];
    for (uint d = 0u; d < digit_count; ++d) {
        uint digit = (word >> (4u * d)) & 15u, place = d;
        while (place > 0u && digits[place - 1u] > digit) {
            digits[place] = digits[place - 1u];
            --place;
        }
        digits[place] = digit;
    }
    uint all = 0u;
    for (uint d = 0u; d < digit_count; ++d) all = (all << 4) | digits[digit_count - 1u - d];
    sorted[i] = all;
}
