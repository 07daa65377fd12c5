// The point of a triangle that is closest to a given one, for triangles of any shape.
#ifndef COMMON_CLOSEST_GLSL
#define COMMON_CLOSEST_GLSL

// Where on its triangle a closest point lies: 0 to 2 on the side from that corner to the next, 3 to 5 on
// corner 0 to 2, or INSIDE.
const uint ON_CORNER = 3u;
const uint INSIDE = 6u;

// Squared distances that differ by less than this share are equal: two triangles see their common side with
// different rounding.
const float NEARER = 1.0 - 1e-6;

struct Closest {
    vec3 offset;  // from the given point to the closest one
    float sq;     // its squared length
    vec3 weights; // of the corners, at least 0, sum 1
    uint place;
};

// Keeps in `best` the closest point of the side k from a to b, both relative to the given point, if it is
// nearer.
void try_side(vec3 a, vec3 b, vec3 e, uint k, inout Closest best) {
    float t = clamp(-dot(a, e) / max(dot(e, e), 1e-37), 0.0, 1.0);
    // A corner is the same point, to the last bit, in all of its triangles.
    vec3 q = t == 1.0 ? b : a + t * e;
    float sq = dot(q, q);
    if (sq < best.sq) {
        uint next = k == 2u ? 0u : k + 1u;
        vec3 w = k == 0u ? vec3(1.0 - t, t, 0.0) : k == 1u ? vec3(0.0, 1.0 - t, t) : vec3(t, 0.0, 1.0 - t);
        best = Closest(q, sq, w, t == 0.0 ? ON_CORNER + k : t == 1.0 ? ON_CORNER + next : k);
    }
}

// The nearest of the foot of the perpendicular and the closest points of the three sides. Each lies on the
// triangle, so what rounding does to the foot on a sliver costs no more than the height of the sliver.
Closest closest_on_triangle(vec3 at, vec3 a, vec3 b, vec3 c) {
    vec3 ab = b - a, ac = c - a, n = cross(ab, ac);
    vec3 pa = a - at, pb = b - at, pc = c - at;
    float n_sq = dot(n, n);
    float beta = dot(cross(ac, pa), n), gamma = dot(cross(pa, ab), n);
    bool inside = n_sq > 0.0 && beta >= 0.0 && gamma >= 0.0 && beta + gamma <= n_sq;
    vec2 w = vec2(beta, gamma) / max(n_sq, 1e-37);
    vec3 q = pa + w.x * ab + w.y * ac;
    Closest best = Closest(q, inside ? dot(q, q) : 3.402823466e38, vec3(1.0 - w.x - w.y, w), INSIDE);
    try_side(pa, pb, ab, 0u, best);
    try_side(pb, pc, c - b, 1u, best);
    try_side(pc, pa, -ac, 2u, best);
    return best;
}

#endif
