// A unit normal in one float: 11 bits for each axis of the octahedral map. Whole numbers below 2^24 survive every load
// and store, where arbitrary bits of a float need not. Half a tenth of a degree off at most.
#ifndef COMMON_SITE_NORMAL_GLSL
#define COMMON_SITE_NORMAL_GLSL

float pack_normal(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    p = n.z < 0.0 ? folded : p;
    vec2 q = clamp(round(p * 1023.0) + 1023.0, 0.0, 2046.0);
    return q.x + 2048.0 * q.y;
}

// Not of unit length.
vec3 unpack_normal(float packed) {
    float y = floor(packed / 2048.0);
    vec2 p = vec2(packed - 2048.0 * y, y) / 1023.0 - 1.0;
    float z = 1.0 - abs(p.x) - abs(p.y);
    float t = max(-z, 0.0);
    return vec3(p.x + (p.x < 0.0 ? t : -t), p.y + (p.y < 0.0 ? t : -t), z);
}

#endif
