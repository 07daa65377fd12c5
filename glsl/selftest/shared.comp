// Purpose: all of the shared memory that a kernel may use, and the barriers of a workgroup.
// Invocation: one word of the result.
// Reads: nothing.
// Writes: digests[invocation] of what all invocations of the workgroup have stored for one another.
// Filled by and checked in src/gpu/selftest on the host.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 128
#include "common/threads.glsl"

layout(push_constant) uniform Push {
    uint count;
    uint seed;
    uint each; // STORED / WORKGROUP; a constant would let compilers unroll the loops
};
layout(set = 0, binding = 0) writeonly buffer Digests { uint digests[]; };

// 16 KiB, which each device has.
const uint STORED = 4096u;
shared uint stored[STORED];

void main() {
    uint lane = gl_LocalInvocationID.x, digest = thread_index() ^ seed;
    for (uint k = 0u; k < each; ++k) stored[k * WORKGROUP + lane] = digest * (2u * k + 3u);
    barrier();
    // Words that other invocations have stored.
    for (uint k = 0u; k < each; ++k) digest = 31u * digest + stored[lane * each + k];
    if (thread_index() < count) digests[thread_index()] = digest;
}
