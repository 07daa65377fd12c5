// Triangles that a move would fold or flatten; as folds_or_flattens of src/polish/relax.rs.
#ifndef POLISH_SHAPE_GLSL
#define POLISH_SHAPE_GLSL

// Least cosine between a triangle's normal and those of its vertices.
const float MIN_AGREEMENT = 0.5;
// Squared ratio of doubled area to squared longest edge below which a triangle may not shrink: heights of a
// fifth.
const float FLAT_SQ = 0.04;

float agreement(vec3 n, vec3 up) { return dot(n, up) / max(length(n) * length(up), 1e-30); }

float flatness(vec3 n, vec3 a, vec3 b, vec3 c) {
    vec3 u = b - a, v = c - b, w = a - c;
    float longest = max(dot(u, u), max(dot(v, v), dot(w, w)));
    return dot(n, n) / max(longest * longest, 1e-37);
}

// Whether a triangle turns away from `up`, the direction of its vertices' normals, or becomes flat by a move.
// A triangle that was so before may stay so.
bool folds_or_flattens(vec3 a, vec3 b, vec3 c, vec3 new_a, vec3 new_b, vec3 new_c, vec3 up) {
    vec3 before = cross(b - a, c - a), after = cross(new_b - new_a, new_c - new_a);
    float facing = agreement(after, up), shape = flatness(after, new_a, new_b, new_c);
    return (facing < MIN_AGREEMENT && facing <= agreement(before, up)) ||
           (shape < FLAT_SQ && shape <= flatness(before, a, b, c));
}

#endif
