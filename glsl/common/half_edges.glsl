// Half-edges of a mesh on the device: 3 * t + k runs from corner k of triangle t to the next corner, and has
// the number of the corner that it leaves.
#ifndef COMMON_HALF_EDGES_GLSL
#define COMMON_HALF_EDGES_GLSL

// In the states of vertices: those that do not move. The other bits are the number of edges.
const uint FIXED = 0x80000000u;

uint next_half_edge(uint h) { return h % 3u == 2u ? h - 2u : h + 1u; }

uint previous_half_edge(uint h) { return h % 3u == 0u ? h + 2u : h - 1u; }

#endif
