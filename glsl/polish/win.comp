// Purpose: finds the edges that have all four vertices around them to themselves.
// Invocation: one candidate.
// Reads: counters (which candidates), corners, twins, claims.
// Writes: candidates, with the bit WON for these edges.
// Filled by polish/claim; consumed by polish/flip. No two of them have a triangle in common, nor a vertex.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/hash.glsl"
#include "polish/won.glsl"

layout(push_constant) uniform Push {
    uint salt; // as that of polish/claim
};
layout(set = 0, binding = 0) readonly buffer Counters { uint counters[]; };
layout(set = 0, binding = 1) buffer Candidates { uint candidates[]; };
layout(set = 0, binding = 2) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 3) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 4) readonly buffer Claims { uint claims[]; };
#include "polish/diamond.glsl"

void main() {
    uint i = counters[1] + thread_index();
    if (i >= counters[2]) return;
    uint h = candidates[i];
    if (h == NONE) return;
    uvec4 v = diamond(h);
    uvec4 at = uvec4(claims[v.x], claims[v.y], claims[v.z], claims[v.w]);
    // An edge that may not be flipped has not claimed anything, and no other one has its priority. 0 is what
    // nobody claims.
    uint priority = hashed(h + salt);
    if (priority != 0u && all(equal(at, uvec4(priority)))) candidates[i] = h | WON;
}
