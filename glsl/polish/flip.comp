// Purpose: flips the edges that won.
// Invocation: one candidate.
// Reads: counters (which candidates), candidates.
// Writes: corners, twins, firsts and states around these edges; candidates, NONE in place of them;
// counters[3], how many were flipped so far.
// Filled by polish/win; consumed by the next pass and polish/relax. As HalfEdgeMesh::flip on the host.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "polish/won.glsl"

layout(set = 0, binding = 0) buffer Counters { uint counters[]; };
layout(set = 0, binding = 1) buffer Candidates { uint candidates[]; };
layout(set = 0, binding = 2) buffer Corners { uint corners[]; };
layout(set = 0, binding = 3) buffer Twins { uint twins[]; };
layout(set = 0, binding = 4) buffer Firsts { uint firsts[]; };
layout(set = 0, binding = 5) buffer States { uint states[]; };
#include "polish/diamond.glsl"

void set_twin(uint h, uint outer) {
    twins[h] = outer;
    if (outer != NONE) twins[outer] = h;
}

// The fan of a vertex begins with the same half-edge under its new number, or, where that was the edge
// itself, with another one.
void renumber(uint v, uint old, uint changed, uint gone) {
    uint first = firsts[v];
    if (first == old || first == gone) firsts[v] = changed;
}

void main() {
    uint i = counters[1] + thread_index();
    if (i >= counters[2]) return;
    uint candidate = candidates[i];
    if (candidate == NONE || (candidate & WON) == 0u) return;
    candidates[i] = NONE;
    uint h = candidate & ~WON, g = twins[h];
    uvec4 v = diamond(h);
    uint h_next = next_half_edge(h), h_previous = previous_half_edge(h);
    uint g_next = next_half_edge(g), g_previous = previous_half_edge(g);
    uint bc = twins[h_next], ca = twins[h_previous], ad = twins[g_next], db = twins[g_previous];
    // Triangle d c a in place of a b c, and c d b in place of b a d.
    corners[h] = v.w, corners[h_next] = v.z, corners[h_previous] = v.x;
    corners[g] = v.z, corners[g_next] = v.w, corners[g_previous] = v.y;
    set_twin(h_next, ca);
    set_twin(h_previous, ad);
    set_twin(g_next, db);
    set_twin(g_previous, bc);
    renumber(v.x, g_next, h_previous, h);
    renumber(v.y, h_next, g_previous, g);
    renumber(v.z, h_previous, h_next, h_previous);
    renumber(v.w, g_previous, g_next, g_previous);
    states[v.x] -= 1u;
    states[v.y] -= 1u;
    states[v.z] += 1u;
    states[v.w] += 1u;
    atomicAdd(counters[3], 1u);
}
