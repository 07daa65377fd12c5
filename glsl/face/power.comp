// Purpose: the restricted power face of a site: what the power cells of all sites and shadow sites leave of
// its tangent plane (Eq. 5 of the paper, after Xu et al. 2019).
// Invocation: one site; its polygon lives in shared memory with at most MAX_CORNERS corners, workgroup 16.
// Reads: sites, normals, neighbours, bounds (of the sites' tiles).
// Writes: corner_count, corners[slot * site_count + site] in the tangent frame, fan[slot * site_count +
// site], flags.
// Filled by neighbours/* and normals/plane_fit; consumed by centroid/* and the connection. Order and meaning
// of the slots are those of face/cell. Every site s has a shadow site s + d n of weight d squared, so that
// the two have equal power distance on the tangent plane of s. A neighbour's shadow may take the whole face;
// corner_count is 0 then.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 16
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/flags.glsl"
#include "common/tangent.glsl"
#include "common/tiles.glsl"

layout(constant_id = 1) const uint MAX_CORNERS = 24;
layout(constant_id = 2) const uint K = 32;

layout(push_constant) uniform Push {
    uint site_count;
    float spacing;  // the unit of the polygon, so that its numbers are near 1
    float offset;   // distance of a shadow site from its site in spacings, 0 or more
    float box_half; // half the side of the square that a face starts from, in spacings
};
READ_VEC4(0, Sites, sites);
READ_VEC4(1, Normals, normals);
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
READ_VEC4(3, Bounds, bounds);
layout(set = 0, binding = 4) writeonly buffer CornerCount { uint corner_count[]; };
layout(set = 0, binding = 5) writeonly buffer Corners { vec2 corners[]; };
layout(set = 0, binding = 6) writeonly buffer Fan { uint fan[]; };
layout(set = 0, binding = 7) buffer Flags { uint flags[]; };

// Two polygons, one to read and one to write: a corner and the site behind the edge that ends in it.
shared vec2 polygon[2u * MAX_CORNERS * WORKGROUP];
shared uint behind[2u * MAX_CORNERS * WORKGROUP];

// A corner beyond a line by less than this share of the line's distance is on it.
const float ON_LINE = 2e-6;

uint lane;
uint half_now; // which of the two polygons stands
uint count;
uint notes;
vec3 at, u, v;

uint slot(uint which, uint m) { return (which * MAX_CORNERS + m) * WORKGROUP + lane; }

void push_corner(inout uint made, vec2 corner, uint site) {
    if (made < MAX_CORNERS) {
        polygon[slot(1u - half_now, made)] = corner;
        behind[slot(1u - half_now, made)] = site;
    }
    ++made;
}

// Keeps the part where dot(d, p) <= limit; the new edge has `site` behind it.
void clip(vec2 d, float limit, uint site) {
    float slack = ON_LINE * (abs(limit) + length(d));
    float beyond = -1.0;
    for (uint m = 0u; m < count; ++m) {
        beyond = max(beyond, dot(d, polygon[slot(half_now, m)]) - limit - slack);
    }
    // A loop of no rounds where nothing is cut: some devices walk through a branch that no lane takes.
    uint rounds = beyond > 0.0 ? count : 0u;
    uint made = 0u;
    vec2 a = rounds > 0u ? polygon[slot(half_now, count - 1u)] : vec2(0.0);
    float side_a = dot(d, a) - limit;
    for (uint m = 0u; m < rounds; ++m) {
        vec2 b = polygon[slot(half_now, m)];
        uint label = behind[slot(half_now, m)];
        float side_b = dot(d, b) - limit;
        bool in_a = side_a <= slack, in_b = side_b <= slack;
        // Both may be beyond the line, one of them by less than counts.
        vec2 crossing = a + (b - a) * clamp(side_a / (side_a - side_b), 0.0, 1.0);
        if (in_a != in_b) push_corner(made, crossing, in_a ? label : site);
        if (in_b) push_corner(made, b, label);
        a = b;
        side_a = side_b;
    }
    if (made > MAX_CORNERS) notes |= FLAG_CORNERS;
    if (rounds > 0u && made <= MAX_CORNERS) {
        half_now = 1u - half_now;
        count = made < 3u ? 0u : made;
    }
}

// By the bisectors with site j and its shadow.
void clip_by_site(uint site, uint j) {
    vec3 e = (AT(sites, j).xyz - at) / spacing;
    if (dot(e, e) < 1e-12) {
        // Both sites have the same direction u and are separated along it.
        e = (j > site ? 1e-3 : -1e-3) * u;
        notes |= FLAG_COINCIDENT;
    }
    clip(vec2(dot(e, u), dot(e, v)), 0.5 * dot(e, e), j);
    // |p|^2 <= |p - e - d n|^2 - d^2.
    vec3 n = offset * AT(normals, j).xyz;
    vec3 s = e + n;
    clip(vec2(dot(s, u), dot(s, v)), 0.5 * dot(e, e) + dot(e, n), j);
}

float radius_sq() {
    float found = 0.0;
    for (uint m = 0u; m < count; ++m) {
        vec2 p = polygon[slot(half_now, m)];
        found = max(found, dot(p, p));
    }
    return found;
}

float distance_sq(vec3 p, vec3 q) {
    vec3 d = p - q;
    return dot(d, d);
}

// Clips by every site within reach, in spacings; those of the list once more, which changes nothing. Loops,
// not branches, lead past what is too far.
void clip_by_all(uint site, float reach) {
    uint tiles = tile_count(site_count);
    float reach_sq = reach * reach;
    for (uint t = 0u; t < tiles && count > 0u; ++t) {
        while (t < tiles && box_distance_sq(at, at, AT(bounds, 2u * t).xyz, AT(bounds, 2u * t + 1u).xyz) >
                                reach_sq * spacing * spacing) ++t;
        uint end = min((t + 1u) * TILE, site_count);
        uint j = t * TILE;
        while (j < end) {
            while (j < end && distance_sq(AT(sites, j).xyz, at) > reach_sq * spacing * spacing) ++j;
            if (j < end && j != site) clip_by_site(site, j);
            ++j;
        }
    }
}

void main() {
    uint site = thread_index();
    lane = gl_LocalInvocationID.x;
    if (site >= site_count) return;
    at = AT(sites, site).xyz;
    tangent_frame(AT(normals, site).xyz, u, v);
    notes = 0u;
    half_now = 0u;
    count = 4u;
    for (uint m = 0u; m < 4u; ++m) {
        polygon[slot(0u, m)] = box_half * vec2(m == 0u || m == 3u ? -1.0 : 1.0, m < 2u ? -1.0 : 1.0);
        behind[slot(0u, m)] = NONE;
    }
    uint farthest = NONE;
    for (uint s = 0u; s < K; ++s) {
        farthest = neighbours[s * site_count + site];
        if (farthest == NONE) break;
        clip_by_site(site, farthest);
    }
    // Radius of security: a shadow takes p, which is at most r from its own site, only if |p - e|^2 - 2 d |p
    // - e| < r^2.
    float r_sq = radius_sq();
    float reach = sqrt(r_sq) + offset + sqrt(r_sq + offset * offset);
    bool secure = farthest == NONE || count == 0u || distance(AT(sites, farthest).xyz, at) >= reach * spacing;
    if (!secure) {
        notes |= FLAG_SECURITY;
        clip_by_all(site, 1.0001 * reach);
    }
    if (count == 0u) notes |= FLAG_HIDDEN;
    for (uint m = 0u; m < count; ++m) {
        uint label = behind[slot(half_now, m)];
        if (label == NONE) notes |= FLAG_UNBOUNDED;
        corners[m * site_count + site] = spacing * polygon[slot(half_now, m)];
        fan[m * site_count + site] = label;
    }
    corner_count[site] = (notes & FLAG_CORNERS) != 0u ? 0u : count;
    flags[site] |= notes;
}
