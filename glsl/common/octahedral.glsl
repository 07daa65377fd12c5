// A unit vector in two signed shorts (Cigolle et al. 2014); error at most 5e-5.
#ifndef COMMON_OCTAHEDRAL_GLSL
#define COMMON_OCTAHEDRAL_GLSL

uint pack_normal(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    return packSnorm2x16(n.z < 0.0 ? folded : p);
}

// The unit vector for a point of the square.
vec3 unfold(vec2 f) {
    vec3 n = vec3(f, 1.0 - abs(f.x) - abs(f.y));
    float fold = max(-n.z, 0.0);
    n.x += n.x >= 0.0 ? -fold : fold;
    n.y += n.y >= 0.0 ? -fold : fold;
    return normalize(n);
}

vec3 unpack_normal(uint packed) { return unfold(unpackSnorm2x16(packed)); }

#endif
