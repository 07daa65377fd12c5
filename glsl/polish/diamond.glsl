// The two triangles at an edge, and what its flip gains; as src/polish/flip.rs, for edges between vertices
// that move freely. Include after declaring corners and twins.
#ifndef POLISH_DIAMOND_GLSL
#define POLISH_DIAMOND_GLSL
#include "common/half_edges.glsl"

// Least gain of a flip. Above what rounding makes of positions at a million vertices, so that it cannot flip
// an edge back and forth.
const float MIN_GAIN = 1e-3;

// The vertices a, b, c, d of triangles abc and bad at half-edge h from a to b with a twin.
uvec4 diamond(uint h) {
    uint twin = twins[h];
    return uvec4(corners[h], corners[twin], corners[previous_half_edge(h)],
                 corners[previous_half_edge(twin)]);
}

float cotangent(vec3 at, vec3 p, vec3 q) {
    vec3 u = p - at, v = q - at;
    return dot(u, v) / max(length(cross(u, v)), 1e-30);
}

// What the flip gains: the negated cotangents of the angles opposite the edge, and half of what the squared
// differences of the valences to six lose, with this weight.
float flip_gain(vec3 a, vec3 b, vec3 c, vec3 d, uvec4 valences, float valence_weight) {
    vec4 v = vec4(valences);
    return valence_weight * (v.x + v.y - v.z - v.w - 2.0) - cotangent(c, a, b) - cotangent(d, b, a);
}

#endif
