// Strips of consecutive pairs that one invocation of the radix sort moves; src/stages/sort.rs has the same
// numbers.
#ifndef SPATIAL_STRIP_GLSL
#define SPATIAL_STRIP_GLSL

const uint STRIP = 32u;
const uint DIGITS = 16u;

uint strip_count(uint keys) { return (keys + STRIP - 1u) / STRIP; }

#endif
