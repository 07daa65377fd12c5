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

Line lines[K];
float line_low[K], line_high[K]; // what is left of the line

// Each line cuts the other: cut_by for both at once.
void cut_pair(uint j, uint k) {
    vec2 a = lines[j].normal, b = lines[k].normal;
    float along = dot(a, b);
    precise float across = a.x * b.y - a.y * b.x;
    bool parallel = abs(across) < PARALLEL;
    bool left = parallel || across > 0.0;
    along = parallel ? sign(along) : along;
    float inverse = 1.0 / (parallel ? PARALLEL : across);
    float on_j = (lines[k].offset - lines[j].offset * along) * inverse;
    float on_k = (lines[k].offset * along - lines[j].offset) * inverse;
    line_high[j] = left ? min(line_high[j], on_j) : line_high[j];
    line_low[j] = left ? line_low[j] : max(line_low[j], on_j);
    line_low[k] = left ? max(line_low[k], on_k) : line_low[k];
    line_high[k] = left ? line_high[k] : min(line_high[k], on_k);
}

// Cuts all lines by a disc of radius `bound` around the site and by each other.
void cut_lines(float bound) {
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        vec2 left = chord(lines[s].offset, bound);
        line_low[s] = left.x;
        line_high[s] = left.y;
    }
    // Both loops have fixed bounds, or compilers would unroll neither.
    [[unroll]] for (uint j = 0u; j < K; ++j) {
        [[unroll]] for (uint k = 0u; k < K; ++k) {
            if (k > j) cut_pair(j, k);
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
        lines[s] = bisector(other.xyz - own.xyz, u, v, counts, j < site);
    }
}

// Twice the area, the area's centroid, and the squared distance of the farthest corner, 0 if there is no
// edge.
void measure_face(out float twice_area, out vec2 balance, out float radius_sq) {
    vec3 sum = vec3(0.0);
    radius_sq = 0.0;
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        vec2 interval = vec2(line_low[s], line_high[s]);
        sum += below(lines[s], interval);
        radius_sq = max(radius_sq, end_sq(lines[s], interval));
    }
    twice_area = sum.x;
    balance = centroid_of(sum);
}

#endif
