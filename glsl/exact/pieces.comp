// Purpose: the part of a triangle that is nearer to one site than to all others: its area, its first moment
//   and its squared distance to the site.
// Invocation: one pair of a triangle and a site.
// Reads: corners, sites, candidates, starts, pair_triangle.
// Writes: moments[pair] = (integral of y - site over the part, area); energies[pair] = integral of |y -
// site|².
// Filled by exact/pairs; consumed by exact/sums. In the plane of the triangle, with its middle as the origin,
// the part is what its sides and the bisectors with the other candidates bound. Each line is cut by all
// others to an interval, as in face/planar.glsl. Both sites of a bisector compute the same line but for its
// sign, so nothing is lost or counted twice.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/planar_lines.glsl"

// As in exact/exact_triangle.glsl.
layout(constant_id = 1) const uint PIECES = 12;

layout(push_constant) uniform Push { uint pair_count; };
READ_VEC4(0, Corners, corners);
READ_VEC4(1, Sites, sites);
layout(set = 0, binding = 2) readonly buffer Candidates { uint candidates[]; };
layout(set = 0, binding = 3) readonly buffer Starts { uint starts[]; };
layout(set = 0, binding = 4) readonly buffer PairTriangle { uint pair_triangle[]; };
layout(set = 0, binding = 5) writeonly buffer Moments { vec4 moments[]; };
layout(set = 0, binding = 6) writeonly buffer Energies { float energies[]; };

const uint LINES = PIECES + 2u;

Line lines[LINES]; // the sides first
vec2 left[LINES]; // what the others leave of each

// The line on which points are as far from the site at `b` as from the one at `a`, both relative to the
// middle. Where the sites are one, the first has everything.
Line between(vec3 a, vec3 b, vec3 u, vec3 v, bool first) {
    vec3 e = b - a;
    float offset = 0.5 * dot(e, a + b);
    vec2 normal = vec2(dot(e, u), dot(e, v));
    float length_sq = dot(normal, normal);
    bool crosses = length_sq > 1e-12 * dot(e, e);
    float inverse = inversesqrt(max(length_sq, 1e-36));
    bool keeps = offset > 0.0 || (offset == 0.0 && first);
    return Line(crosses ? normal * inverse : vec2(1.0, 0.0),
                crosses ? offset * inverse : keeps ? NO_LINE : -NO_LINE);
}

// The side from p to q; the triangle is on its left.
Line side(vec2 p, vec2 q) {
    vec2 along = (q - p) * inversesqrt(max(dot(q - p, q - p), 1e-36));
    vec2 normal = vec2(along.y, -along.x);
    return Line(normal, 0.5 * dot(normal, p + q));
}

// Puts in a line, cut by those before it, and cuts those.
void add_line(uint place, Line line, float bound) {
    vec2 rest = vec2(-bound, bound);
    [[unroll]] for (uint s = 0u; s < LINES; ++s) {
        rest = s < place ? cut_by(rest, line, lines[s], false) : rest;
        left[s] = s < place ? cut_by(left[s], lines[s], line, true) : left[s];
    }
    [[unroll]] for (uint s = 0u; s < LINES; ++s) {
        lines[s].normal = s == place ? line.normal : lines[s].normal;
        lines[s].offset = s == place ? line.offset : lines[s].offset;
        left[s] = s == place ? rest : left[s];
    }
}

// Twice the area, six times the first moment and twelve times the second one about the origin.
vec4 sum_lines() {
    vec4 sum = vec4(0.0);
    [[unroll]] for (uint s = 0u; s < LINES; ++s) {
        float o = lines[s].offset, x = left[s].x, y = left[s].y;
        bool is_edge = y > x;
        float twice = is_edge ? o * (y - x) : 0.0;
        vec2 ends = 2.0 * o * lines[s].normal + (x + y) * turned(lines[s].normal);
        sum += is_edge ? twice * vec4(1.0, ends, 3.0 * o * o + x * x + x * y + y * y) : vec4(0.0);
    }
    return sum;
}

void main() {
    uint pair = thread_index();
    if (pair >= pair_count) return;
    uint t = pair_triangle[pair];
    vec3 a = AT(corners, 3u * t).xyz, b = AT(corners, 3u * t + 1u).xyz, c = AT(corners, 3u * t + 2u).xyz;
    vec3 middle = (a + b + c) / 3.0;
    a -= middle;
    b -= middle;
    c -= middle;
    float bound = 2.0 * sqrt(max(max(dot(a, a), dot(b, b)), dot(c, c)));
    // The corners are stored with the longest side first: the height over it is as exact as can be.
    vec3 u = normalize(b - a);
    vec3 v = c - a;
    v -= dot(v, u) * u;
    v *= inversesqrt(max(dot(v, v), 1e-36));
    vec2 pa = vec2(dot(a, u), dot(a, v)), pb = vec2(dot(b, u), dot(b, v)), pc = vec2(dot(c, u), dot(c, v));
    [[unroll]] for (uint s = 0u; s < LINES; ++s) {
        lines[s] = Line(vec2(1.0, 0.0), NO_LINE);
        left[s] = vec2(1.0, -1.0);
    }
    add_line(0u, side(pa, pb), bound);
    add_line(1u, side(pb, pc), bound);
    add_line(2u, side(pc, pa), bound);
    uint start = starts[t], count = starts[t + 1u] - start, own = pair - start;
    uint first = t * (PIECES + 1u) + 1u;
    uint site = candidates[first + own];
    vec3 at = AT(sites, site).xyz - middle;
    for (uint s = 1u; s < count; ++s) {
        uint other = s <= own ? s - 1u : s;
        uint j = candidates[first + other];
        add_line(s + 2u, between(at, AT(sites, j).xyz - middle, u, v, site < j), bound);
    }
    vec4 sum = sum_lines();
    float area = 0.5 * sum.x;
    vec3 moment = (sum.y * u + sum.z * v) / 6.0;
    moments[pair] = vec4(moment - area * at, area);
    energies[pair] = sum.w / 12.0 - 2.0 * dot(at, moment) + area * dot(at, at);
}
