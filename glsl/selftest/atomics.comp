// Purpose: atomic operations on buffers and on shared memory.
// Invocation: one element of the inputs.
// Reads: words.
// Writes: counters = (number of elements, least and largest word, bits); places, a permutation of the
// elements; groups[4 * workgroup ...] = the same of a workgroup.
// Filled by and checked in src/gpu/selftest on the host.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push { uint count; };
READ_UVEC4(0, Words, words);
layout(set = 0, binding = 1) buffer Counters { uint counters[]; };
layout(set = 0, binding = 2) writeonly buffer Places { uint places[]; };
layout(set = 0, binding = 3) writeonly buffer Groups { uint groups[]; };

// As in the counters.
shared uint group[4];

void main() {
    uint i = thread_index(), lane = gl_LocalInvocationID.x;
    if (lane < 4u) group[lane] = lane == 1u ? 0xffffffffu : 0u;
    barrier();
    if (i < count) {
        uint word = AT(words, i).x, bit = 1u << (2u * (word & 15u));
        uint place = atomicAdd(counters[0], 1u);
        if (place < count) places[place] = i;
        atomicMin(counters[1], word);
        atomicMax(counters[2], word);
        atomicOr(counters[3], bit);
        atomicAdd(group[0], 1u);
        atomicMin(group[1], word);
        atomicMax(group[2], word);
        atomicOr(group[3], bit);
    }
    barrier();
    if (lane < 4u) groups[4u * group_index() + lane] = group[lane];
}
