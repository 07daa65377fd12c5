// Purpose: ballots and broadcasts within subgroups, also after lanes have left a loop one by one.
// Invocation: one lane; workgroups are whole, and the subgroups may have any size.
// Reads: words.
// Writes: lanes[invocation] = the invocation of lane 0, the own lane, the lanes of the subgroup and the
// invocation of the lane pick % lanes, a byte each; ballots[invocation] = the word lane % 4 of the lanes with
// odd words; later[invocation] = the same of the lanes with odd sums; rounds[invocation] = the largest number
// of terms in the subgroup.
// Filled by and checked in src/gpu/selftest on the host.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#define DEFAULT_WORKGROUP 128
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint count;
    uint pick;
};
READ_UVEC4(0, Words, words);
layout(set = 0, binding = 1) writeonly buffer Lanes { uint lanes[]; };
layout(set = 0, binding = 2) writeonly buffer Ballots { uint ballots[]; };
layout(set = 0, binding = 3) writeonly buffer Later { uint later[]; };
layout(set = 0, binding = 4) writeonly buffer Rounds { uint rounds[]; };

void main() {
    uint i = thread_index();
    uint word = i < count ? AT(words, i).w : 0u;
    uint present = subgroupBallotBitCount(subgroupBallot(true));
    uint first = subgroupBroadcast(i, 0u), picked = subgroupBroadcast(i, pick % present);
    uvec4 ballot = subgroupBallot((word & 1u) != 0u);
    uint terms = (word >> 4) & 7u, sum = word;
    for (uint k = 0u; k < terms; ++k) sum = 5u * sum + (sum >> (k + 9u));
    subgroupBarrier();
    uvec4 after = subgroupBallot((sum & 1u) != 0u);
    uint most = 0u;
    while (most < 8u && any(notEqual(subgroupBallot(most < terms), uvec4(0u)))) ++most;
    if (i >= count) return;
    lanes[i] = first | (gl_SubgroupInvocationID << 8) | (present << 16) | (picked << 24);
    ballots[i] = ballot[gl_SubgroupInvocationID % 4u];
    later[i] = after[gl_SubgroupInvocationID % 4u];
    rounds[i] = most;
}
