// The triangles of the surface for searches: `records` and `corner_normals` of src/stages/records.rs, by rank, which is
// the place of a triangle in spatial order. Include after declaring both buffers.
#ifndef COMMON_RECORDS_GLSL
#define COMMON_RECORDS_GLSL

// records[3 * rank + k]: corner k, and in w the half-edge on the other side of the side from corner k to the next:
// 3 * rank + side, NONE where no triangle continues the surface.

// A unit vector from its octahedral form, two signed shorts (Cigolle et al. 2014).
vec3 unpack_normal(uint packed) {
    vec2 f = unpackSnorm2x16(packed);
    vec3 n = vec3(f, 1.0 - abs(f.x) - abs(f.y));
    float fold = max(-n.z, 0.0);
    n.x += n.x >= 0.0 ? -fold : fold;
    n.y += n.y >= 0.0 ? -fold : fold;
    return normalize(n);
}

// The unit normal of the surface at a point given by its weights. The corners' normals are all on the triangle's
// side, so no mean of them vanishes.
vec3 surface_normal(uint rank, vec3 weights) {
    uvec4 packed = corner_normals[rank];
    return normalize(weights.x * unpack_normal(packed.x) + weights.y * unpack_normal(packed.y) +
                     weights.z * unpack_normal(packed.z));
}

#endif
