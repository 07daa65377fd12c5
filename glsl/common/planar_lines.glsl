// Lines in the tangent plane of a site, from which faces are built by intervals: the bisector with a
// neighbour is the line n·x = c, the face lies on the site's side of it, and the other lines cut it to an
// interval.
#ifndef COMMON_PLANAR_LINES_GLSL
#define COMMON_PLANAR_LINES_GLSL
#include "common/octahedral.glsl"
#include "common/tangent.glsl"

const float NO_LINE = 1e30;
// A face whose squared radius is beyond this share of the squared bound reaches the bound: it is open.
const float OPEN = 0.9999;
// Neighbours with a smaller cosine of normals, beyond some 100 degrees, are on another sheet and do not
// count.
const float TURNED_AWAY = -0.2;

struct Line {
    vec2 normal; // unit, away from the site
    float offset; // distance of the line, not negative; NO_LINE if it cuts nothing
};

// The line of the neighbour at `offset` from the site in the frame u, v. A neighbour at the same point is
// separated along u by index; both sites compute the same line.
Line bisector(vec3 offset, vec3 u, vec3 v, bool counts, bool smaller_index) {
    vec2 a = vec2(dot(offset, u), dot(offset, v));
    float length_sq = dot(a, a), far_sq = dot(offset, offset);
    bool same_point = far_sq == 0.0;
    bool cuts = counts && (length_sq > 1e-12 * far_sq || same_point);
    float inverse = inversesqrt(max(length_sq, 1e-36));
    vec2 normal = same_point ? vec2(smaller_index ? 1.0 : -1.0, 0.0) : a * inverse;
    return Line(normal, cuts ? 0.5 * far_sq * inverse : NO_LINE);
}

// The part of a line within a disc of radius `bound` around the site, along the normal turned left: x to y,
// empty if y < x.
vec2 chord(float offset, float bound) {
    float half_chord = sqrt(max(bound * bound - offset * offset, 0.0));
    return offset < bound ? vec2(-half_chord, half_chord) : vec2(1.0, -1.0);
}

// Parallel lines cross far away, of the sign that keeps the nearer line: this quotient is huge.
const float PARALLEL = 1e-12;

// The interval of line a cut by line b. Of two equal lines, the first keeps the lower half and the other the
// upper one.
vec2 cut_by(vec2 interval, Line a, Line b, bool first) {
    float along = dot(a.normal, b.normal);
    precise float across = a.normal.x * b.normal.y - a.normal.y * b.normal.x;
    bool parallel = abs(across) < PARALLEL;
    along = parallel ? sign(along) : along;
    float inverse = 1.0 / (parallel ? (first ? PARALLEL : -PARALLEL) : across);
    float at = (b.offset - a.offset * along) * inverse;
    bool left = inverse > 0.0;
    return vec2(left ? interval.x : max(interval.x, at), left ? min(interval.y, at) : interval.y);
}

vec2 turned(vec2 n) { return vec2(-n.y, n.x); }

// Twice the area and three times the moment of the triangle of the site and an interval; 0 if it is empty.
vec3 below(Line line, vec2 interval) {
    float twice = interval.y > interval.x ? line.offset * (interval.y - interval.x) : 0.0;
    vec2 ends = 2.0 * line.offset * line.normal + (interval.x + interval.y) * turned(line.normal);
    return twice > 0.0 ? vec3(twice, twice * ends) : vec3(0.0);
}

// The squared distance of the farther end of an interval; 0 if it is empty.
float end_sq(Line line, vec2 interval) {
    float farthest = max(abs(interval.x), abs(interval.y));
    return interval.y > interval.x ? line.offset * line.offset + farthest * farthest : 0.0;
}

// The centroid for the sum of `below`.
vec2 centroid_of(vec3 sum) { return sum.x > 0.0 ? sum.yz / (3.0 * sum.x) : vec2(0.0); }

#endif
