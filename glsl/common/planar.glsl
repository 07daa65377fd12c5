// The restricted tangent face by intervals. In the tangent plane the bisector with a neighbour is a line n·x = c, and
// the face lies on its near side. Every other line leaves an interval of it; an edge of the face is a line whose
// interval is not empty. No polygon is kept in order, so where loops are unrolled nothing is indexed at run time, and
// all arrays are registers.
// The including file has set K, the number of lines, LOOP, the attribute of the loops over them, and CURVES (see
// common/pins.glsl), and declared the buffers sites, normals (packed) and neighbours.
#ifndef COMMON_PLANAR_GLSL
#define COMMON_PLANAR_GLSL
#include "common/octahedral.glsl"
#include "common/pins.glsl"
#include "common/tangent.glsl"

const float NO_LINE = 1e30;

vec2 line_normal[K]; // unit, away from the site
float line_offset[K]; // distance of the line, not negative; NO_LINE if it cuts nothing
float line_low[K], line_high[K]; // what is left of the line, along the normal turned left

// The line of the neighbour at `offset` from the site in the frame u, v. A neighbour on the same spot parts along u,
// by index: both sites compute the same line.
void set_line(uint s, vec3 offset, vec3 u, vec3 v, bool counts, bool smaller_index) {
    vec2 a = vec2(dot(offset, u), dot(offset, v));
    float length_sq = dot(a, a), far_sq = dot(offset, offset);
    bool same_spot = far_sq == 0.0;
    bool cuts = counts && (length_sq > 1e-12 * far_sq || same_spot);
    float inverse = inversesqrt(max(length_sq, 1e-36));
    line_normal[s] = same_spot ? vec2(smaller_index ? 1.0 : -1.0, 0.0) : a * inverse;
    line_offset[s] = cuts ? 0.5 * far_sq * inverse : NO_LINE;
}

// Two lines leave each other a half each.
void cut_pair(uint j, uint k) {
    vec2 a = line_normal[j], b = line_normal[k];
    float along = dot(a, b);
    float across = a.x * b.y - a.y * b.x;
    // Parallel lines: the quotient is huge, of the sign that keeps the nearer line.
    bool parallel = abs(across) < 1e-12;
    bool left = parallel || across > 0.0;
    float inverse = 1.0 / (parallel ? 1e-12 : across);
    float on_j = (line_offset[k] - line_offset[j] * along) * inverse;
    float on_k = (line_offset[k] * along - line_offset[j]) * inverse;
    line_high[j] = left ? min(line_high[j], on_j) : line_high[j];
    line_low[j] = left ? line_low[j] : max(line_low[j], on_j);
    line_low[k] = left ? max(line_low[k], on_k) : line_low[k];
    line_high[k] = left ? line_high[k] : min(line_high[k], on_k);
}

// Cuts all lines by a disc of radius `bound` around the site and by each other.
void cut_lines(float bound) {
    LOOP for (uint s = 0u; s < K; ++s) {
        float half_chord = sqrt(max(bound * bound - line_offset[s] * line_offset[s], 0.0));
        bool meets = line_offset[s] < bound;
        line_low[s] = meets ? -half_chord : 1.0;
        line_high[s] = meets ? half_chord : -1.0;
    }
    // Both loops have fixed bounds, or compilers would unroll neither.
    LOOP for (uint j = 0u; j < K; ++j) {
        LOOP for (uint k = 0u; k < K; ++k) {
            if (k > j) cut_pair(j, k);
        }
    }
}

// The lines of the K nearest listed neighbours that count: not those whose normal turns away by more than some 100
// degrees, which are on another sheet, nor those of another patch.
void load_lines(uint site, uint site_count, vec4 own, vec3 n, vec3 u, vec3 v) {
    LOOP for (uint s = 0u; s < K; ++s) {
        uint j = neighbours[s * site_count + site];
        uint known = j == NONE ? site : j;
        vec4 other = sites[known];
        bool same_sheet = dot(n, unpack_normal(normals[known])) > -0.2 || counts_anywhere(other.w);
        bool counts = j != NONE && same_sheet && same_patch(own.w, other.w);
        set_line(s, other.xyz - own.xyz, u, v, counts, j < site);
    }
}

bool is_edge(uint s) { return line_high[s] > line_low[s]; }

vec2 turned(vec2 n) { return vec2(-n.y, n.x); }

// Start and end of an edge, counter-clockwise.
vec2 edge_start(uint s) { return line_offset[s] * line_normal[s] + line_low[s] * turned(line_normal[s]); }
vec2 edge_end(uint s) { return line_offset[s] * line_normal[s] + line_high[s] * turned(line_normal[s]); }

// Twice the area, the area's centroid, and the squared distance of the farthest corner.
void measure_face(out float twice_area, out vec2 balance, out float radius_sq) {
    twice_area = 0.0;
    radius_sq = 0.0;
    vec2 moment = vec2(0.0);
    LOOP for (uint s = 0u; s < K; ++s) {
        float twice = is_edge(s) ? line_offset[s] * (line_high[s] - line_low[s]) : 0.0;
        vec2 ends = 2.0 * line_offset[s] * line_normal[s] + (line_low[s] + line_high[s]) * turned(line_normal[s]);
        float farthest = max(abs(line_low[s]), abs(line_high[s]));
        twice_area += twice;
        moment += twice > 0.0 ? twice * ends : vec2(0.0);
        radius_sq = max(radius_sq, is_edge(s) ? line_offset[s] * line_offset[s] + farthest * farthest : 0.0);
    }
    balance = twice_area > 0.0 ? moment / (3.0 * twice_area) : vec2(0.0);
}

#endif
