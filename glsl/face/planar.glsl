// The restricted tangent face by intervals, from K lines at once: each line is cut by all others, and an edge
// of the face is a line whose interval is not empty. No polygon is kept in order, so once the loops are
// unrolled nothing is indexed at run time, and all arrays are registers. The including file has set K, the
// number of lines, and declared the buffers sites, normals (packed) and neighbours, and what
// common/blocks.glsl needs.
#ifndef COMMON_PLANAR_GLSL
#define COMMON_PLANAR_GLSL
#include "common/blocks.glsl"
#include "common/pins.glsl"
#include "common/planar_lines.glsl"
#include "common/sites.glsl"

vec3 lines[K]; // normal and offset
vec2 line_left[K]; // what is left of the line

// Each line cuts the other: cut_by for both at once.
void cut_pair(uint j, uint k) {
    vec3 a = lines[j], b = lines[k];
    vec2 left_a = line_left[j], left_b = line_left[k];
    float along = dot(a.xy, b.xy);
    precise float across = a.x * b.y - a.y * b.x;
    bool parallel = abs(across) < PARALLEL;
    bool left = across > -PARALLEL;
    along = mix(along, sign(along), parallel);
    float inverse = 1.0 / mix(across, PARALLEL, parallel);
    float on_a = (b.z - a.z * along) * inverse;
    float on_b = (b.z * along - a.z) * inverse;
    line_left[j] = vec2(mix(max(left_a.x, on_a), left_a.x, left), mix(left_a.y, min(left_a.y, on_a), left));
    line_left[k] = vec2(mix(left_b.x, max(left_b.x, on_b), left), mix(min(left_b.y, on_b), left_b.y, left));
}

// Cuts all lines by a disc of radius `bound` around the site and by each other.
void cut_lines(float bound) {
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        line_left[s] = chord(lines[s].z, bound);
    }
    // Every pair: line j and all after it, then the line that has as few after it as j has before it. Both
    // loops have fixed bounds, or compilers would unroll neither, and no round does nothing.
    [[unroll]] for (uint j = 0u; j < K / 2u; ++j) {
        [[unroll]] for (uint s = 0u; s < K - 1u + K % 2u; ++s) {
            bool of_j = s < K - 1u - j;
            cut_pair(mix(K - 1u - K % 2u - j, j, of_j), mix(s + 1u - K % 2u, j + 1u + s, of_j));
        }
    }
}

// The lines of the K nearest listed neighbours that count: not those of another sheet or patch.
void load_lines(uint site, vec4 own, vec3 n, vec3 u, vec3 v) {
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        uint j = neighbours[block_place(s, site)];
        uint known = j == NONE ? site : j;
        vec4 other = site_at(known);
        bool same_sheet = dot(n, unpack_normal(normals[known])) > TURNED_AWAY || counts_anywhere(other.w);
        bool counts = j != NONE && same_sheet && same_patch(own.w, other.w);
        Line line = bisector(other.xyz - own.xyz, u, v, counts, j < site);
        lines[s] = vec3(line.normal, line.offset);
    }
}

// Twice the area, the area's centroid, and the squared distance of the farthest corner, 0 if there is no
// edge.
void measure_face(out float twice_area, out vec2 balance, out float radius_sq) {
    vec3 sum = vec3(0.0);
    radius_sq = 0.0;
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        Line line = Line(lines[s].xy, lines[s].z);
        sum += below(line, line_left[s]);
        radius_sq = max(radius_sq, end_sq(line, line_left[s]));
    }
    twice_area = sum.x;
    balance = centroid_of(sum);
}

#endif
