// Normals of the mesh's vertices, packed, and none.
#ifndef POLISH_NORMALS_GLSL
#define POLISH_NORMALS_GLSL
#include "common/octahedral.glsl"

// In place of a normal where there is none: pack_normal gives it to no vector.
const uint NO_NORMAL = 0x80008000u;

vec3 normal_or_zero(uint packed) { return packed == NO_NORMAL ? vec3(0.0) : unpack_normal(packed); }

#endif
