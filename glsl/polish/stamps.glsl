// What the stamps of moves say.
#ifndef POLISH_STAMPS_GLSL
#define POLISH_STAMPS_GLSL

// The move stands. Other stamps are the number of the pass that undid it.
const uint STANDS = 0xffffffffu;

#endif
