// The triangles of the surface for searches: the buffers of src/stages/records.rs. Include after declaring
// corners, wedges and triangle_normals.
#ifndef COMMON_RECORDS_GLSL
#define COMMON_RECORDS_GLSL
#include "common/octahedral.glsl"

// In place of a wedge's normal where those of its triangles cancel.
const uint NO_NORMAL = 0x80008000u;

// Cosine of the largest angle, 84 degrees, between the normals of a triangle and of its corners. Where the
// mesh folds back at a vertex, the triangle's own normal stands in: then all three are on the triangle's
// side, and no mean of them vanishes.
const float MIN_CORNER_COSINE = 0.1;

// The indices of the triangle's wedges.
uvec3 triangle_wedges(uint t) { return uvec3(corners[3u * t], corners[3u * t + 1u], corners[3u * t + 2u]); }

vec3 wedge_position(uint wedge) { return uintBitsToFloat(AT(wedges, wedge).xyz); }

// The unit normal of the surface at a corner of a triangle with the unit normal `own`.
vec3 corner_normal(uint wedge, vec3 own) {
    uint packed = AT(wedges, wedge).w;
    vec3 n = unpack_normal(packed);
    return packed != NO_NORMAL && dot(n, own) > MIN_CORNER_COSINE ? n : own;
}

// The unit normal of the surface at a point of triangle t given by its weights.
vec3 surface_normal(uint t, vec3 weights) {
    vec3 own = unpack_normal(triangle_normals[t]);
    uvec3 at = triangle_wedges(t);
    return normalize(weights.x * corner_normal(at.x, own) + weights.y * corner_normal(at.y, own) +
                     weights.z * corner_normal(at.z, own));
}

#endif
