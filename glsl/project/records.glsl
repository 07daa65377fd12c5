// The triangles of the surface for searches: `records` and `corner_normals` of src/stages/records.rs, by
// rank, which is the place of a triangle in spatial order. Include after declaring both buffers.
#ifndef COMMON_RECORDS_GLSL
#define COMMON_RECORDS_GLSL
#include "common/octahedral.glsl"

// records[3 * rank + k]: corner k, and in w the half-edge on the other side of the side from corner k to the
// next: 3 * rank + side, NONE where no triangle continues the surface.

// The unit normal of the surface at a point given by its weights. The corners' normals are all on the
// triangle's side, so no mean of them vanishes.
vec3 surface_normal(uint rank, vec3 weights) {
    uvec4 packed = corner_normals[rank];
    return normalize(weights.x * unpack_normal(packed.x) + weights.y * unpack_normal(packed.y) +
                     weights.z * unpack_normal(packed.z));
}

#endif
