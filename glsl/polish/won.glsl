// Marks among the candidates for flips.
#ifndef POLISH_WON_GLSL
#define POLISH_WON_GLSL

// In a candidate: it is flipped in this pass.
const uint WON = 0x80000000u;

#endif
