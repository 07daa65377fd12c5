// Purpose: each edge that may and should be flipped claims the four vertices around it.
// Invocation: one candidate.
// Reads: counters (which candidates), candidates, positions, corners, twins, firsts, states.
// Writes: claims, the largest priority of the edges that claim each vertex.
// Filled by polish/wanted; consumed by polish/win. Priorities are hashes, so that about the same share of
// edges wins everywhere, in whatever order they are numbered.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/hash.glsl"

layout(push_constant) uniform Push {
    float valence_weight;
    uint salt; // another one for each pass
};
layout(set = 0, binding = 0) readonly buffer Counters { uint counters[]; };
layout(set = 0, binding = 1) readonly buffer Candidates { uint candidates[]; };
READ_VEC4(2, Positions, positions);
layout(set = 0, binding = 3) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 4) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 5) readonly buffer Firsts { uint firsts[]; };
layout(set = 0, binding = 6) readonly buffer States { uint states[]; };
layout(set = 0, binding = 7) buffer Claims { uint claims[]; };
#include "polish/diamond.glsl"

// Least valence of a vertex that may lose an edge.
const uint MIN_VALENCE = 4u;
// Least cosine between the normal of a new triangle and that of the old pair.
const float MIN_AGREEMENT = 0.5;
// Least cosine between the two new triangles, unless the old ones turned more sharply.
const float MIN_DIHEDRAL = 0.8;
// Cosine of the largest angle that a flip may create: about 127 degrees.
const float MIN_COSINE = -0.6;

bool is_too_wide(vec3 at, vec3 p, vec3 q) {
    vec3 u = p - at, v = q - at;
    return dot(u, v) < MIN_COSINE * length(u) * length(v);
}

// Whether the triangles after the flip face the same way as those before, do not form a sharper edge, and are
// not too flat.
bool keeps_shape(vec3 a, vec3 b, vec3 c, vec3 d) {
    vec3 old = cross(b - a, c - a), other = cross(a - b, d - b);
    vec3 one = cross(c - d, a - d), two = cross(d - c, b - c);
    vec3 both = old + other;
    float one_len = length(one), two_len = length(two), both_len = length(both);
    if (min(one_len, two_len) <= 0.0) return false;
    float turn = dot(one, two) / (one_len * two_len);
    float before = dot(old, other) / max(length(old) * length(other), 1e-30);
    bool agrees = dot(one, both) > MIN_AGREEMENT * one_len * both_len &&
                  dot(two, both) > MIN_AGREEMENT * two_len * both_len;
    bool wide = is_too_wide(a, d, c) || is_too_wide(b, c, d) || is_too_wide(d, a, c) ||
                is_too_wide(c, b, d) || is_too_wide(c, d, a) || is_too_wide(d, c, b);
    return agrees && turn >= min(MIN_DIHEDRAL, before) && !wide;
}

// Whether an edge joins vertex v, whose triangles form a closed fan, with another one.
bool is_joined(uint v, uint other) {
    uint h = firsts[v];
    bool found = false;
    for (uint left = states[v]; left > 0u && !found; --left) {
        found = corners[next_half_edge(h)] == other;
        h = twins[previous_half_edge(h)];
    }
    return found;
}

void main() {
    uint i = counters[1] + thread_index();
    if (i >= counters[2]) return;
    uint h = candidates[i];
    if (h == NONE) return;
    uvec4 v = diamond(h);
    vec3 a = AT(positions, v.x).xyz, b = AT(positions, v.y).xyz;
    vec3 c = AT(positions, v.z).xyz, d = AT(positions, v.w).xyz;
    uvec4 of = uvec4(states[v.x], states[v.y], states[v.z], states[v.w]);
    // Candidates are listed once, but flips of others change their triangles.
    bool pays = ((of.x | of.y | of.z | of.w) & FIXED) == 0u && min(of.x, of.y) >= MIN_VALENCE &&
                v.z != v.w && flip_gain(a, b, c, d, of, valence_weight) > MIN_GAIN &&
                keeps_shape(a, b, c, d);
    if (!pays || is_joined(v.z, v.w)) return;
    uint priority = hashed(h + salt);
    atomicMax(claims[v.x], priority);
    atomicMax(claims[v.y], priority);
    atomicMax(claims[v.z], priority);
    atomicMax(claims[v.w], priority);
}
