// Positions of sites, with their marks (common/pins.glsl) in the fourth component. Where that would not fit
// into one buffer, and there are no marks, sites are PACKED: three numbers each, one after another. The
// including file has declared vec4 sites[]. Constant 10 is taken here.
#ifndef COMMON_SITES_GLSL
#define COMMON_SITES_GLSL

// 1 where sites are packed.
layout(constant_id = 10) const uint PACKED = 0;

// One component of packed positions.
#define PACKED_AT(positions, i) positions[(i) >> 2][(i) & 3u]

// A branch on a constant: only one side is compiled.
vec4 site_at(uint i) {
    if (PACKED == 0u) return sites[i];
    uint k = 3u * i;
    return vec4(PACKED_AT(sites, k), PACKED_AT(sites, k + 1u), PACKED_AT(sites, k + 2u), 0.0);
}

#endif
