// Positions of sites, with their marks (common/pins.glsl) in the fourth component. Where that would not fit
// into one buffer, and there are no marks, sites are PACKED: three numbers each, one after another. The
// including file has declared vec4 sites[] by common/vectors.glsl, or defines WRITES_SITES. Constant 10 is
// taken here.
#ifndef COMMON_SITES_GLSL
#define COMMON_SITES_GLSL
#include "common/vectors.glsl"

// 1 where sites are packed.
layout(constant_id = 10) const uint PACKED = 0;

// One number of packed positions, to write.
#define PACKED_AT(positions, k) positions[(k) >> 2][(k) & 3u]
// The same to read.
#define READ_PACKED(positions, k) AT(positions, (k) >> 2)[(k) & 3u]

// Both loads, of which the compiler keeps the one that the constant selects. A branch instead, inlined into
// unrolled loops, takes some compilers minutes, even though it is on a constant.
#define SITE_AT(positions, i) \
    mix(vec4(READ_PACKED(positions, 3u * (i)), READ_PACKED(positions, 3u * (i) + 1u), \
             READ_PACKED(positions, 3u * (i) + 2u), 0.0), \
        AT(positions, mix(i, 0u, PACKED != 0u)), bvec4(PACKED == 0u))

#ifndef WRITES_SITES
vec4 site_at(uint i) { return SITE_AT(sites, i); }
#endif

#endif
