// Purpose: the restricted tangent face of a site by clipping its 3-D Voronoi cell (Algorithm 2 of the paper).
// Invocation: one site; its convex cell lives in shared memory with at most MAX_PLANES planes (the paper's
// #P) and MAX_TRIANGLES dual triangles (#T), workgroup 16.
// Reads: sites, normals, neighbours, bounds (of the sites' tiles).
// Writes: corner_count, corners[slot * site_count + site] in the tangent frame, fan[slot * site_count +
// site], flags.
// Filled by neighbours/* and normals/plane_fit; consumed by centroid/* and the connection. Corner m lies
// between edges m and m + 1; fan[m] is the site behind edge m, NONE for the box; the order is
// counter-clockwise seen from the tip of the normal. A site without a face (see flags) has corner_count 0.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 16
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/flags.glsl"
#include "common/tangent.glsl"
#include "common/tiles.glsl"

layout(constant_id = 1) const uint MAX_TRIANGLES = 96;
layout(constant_id = 2) const uint MAX_PLANES = 64;
layout(constant_id = 3) const uint MAX_CORNERS = 24;
layout(constant_id = 4) const uint K = 32;
// One for the list, one for all sites within reach, the rest for thinner slabs.
layout(constant_id = 5) const uint MAX_ATTEMPTS = 5;
// Whether bisectors are those of a power diagram. Then sites have the edge length wanted there as w, relative
// to the spacing, and a site of length h weighs weight_share * h * h.
layout(constant_id = 6) const uint WEIGHTED = 0;

layout(push_constant) uniform Push {
    uint site_count;
    float spacing;        // the unit of the cell, so that its numbers are near 1
    float virtual_offset; // distance of the two virtual points in spacings (the paper's d)
    float box_half;       // half the edge of the cube that a cell starts from, in spacings
    float weight_share;   // with WEIGHTED: the weight of a site over its squared edge length
    float steepness;      // with WEIGHTED: the most that edge lengths change per unit of distance
};
READ_VEC4(0, Sites, sites);
READ_VEC4(1, Normals, normals);
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
READ_VEC4(3, Bounds, bounds);
layout(set = 0, binding = 4) writeonly buffer CornerCount { uint corner_count[]; };
layout(set = 0, binding = 5) writeonly buffer Corners { vec2 corners[]; };
layout(set = 0, binding = 6) writeonly buffer Fan { uint fan[]; };
layout(set = 0, binding = 7) buffer Flags { uint flags[]; };

// A plane is kept as the mirror image v of the site behind it (x dot v = |v|^2 / 2) and the index of that
// site.
shared uvec4 planes[MAX_PLANES * WORKGROUP];
// A dual triangle is a vertex of the cell: its three planes, a byte each, counter-clockwise seen from
// outside.
shared uint triangles[MAX_TRIANGLES * WORKGROUP];
// The boundary of what a cut removes: the plane after each plane, a byte each.
shared uint links[((MAX_PLANES + 3u) / 4u) * WORKGROUP];

// A vertex beyond a bisector by less than this share of its distance is on it: rounding must not decide.
// Twice the same plane (coincident sites) or many through one vertex (co-circular ones) then cut at most
// once.
const float ON_PLANE = 2e-6;
const uint UNLINKED = 0xffu;
// Weights move a bisector by at most this share of the half distance between its sites.
const float LARGEST_SHIFT = 0.9;

uint lane;
uint triangle_count;
uint plane_count;
uint trouble;
uint notes;
// The unit of the cell, so that its numbers are near 1: the spacing, or the edge length wanted at the site.
float unit;

vec3 plane_vector(uint p) { return uintBitsToFloat(planes[p * WORKGROUP + lane].xyz); }

uvec3 triangle_planes(uint t) {
    uint packed = triangles[t * WORKGROUP + lane];
    return uvec3(packed & 0xffu, (packed >> 8) & 0xffu, packed >> 16);
}

void set_triangle(uint t, uint a, uint b, uint c) {
    triangles[t * WORKGROUP + lane] = a | (b << 8) | (c << 16);
}

uint link(uint p) { return (links[(p >> 2) * WORKGROUP + lane] >> (8u * (p & 3u))) & 0xffu; }

void set_link(uint p, uint to) {
    uint word = (p >> 2) * WORKGROUP + lane;
    uint shift = 8u * (p & 3u);
    links[word] = (links[word] & ~(0xffu << shift)) | (to << shift);
}

// The vertex of dual triangle t in homogeneous coordinates with w >= 0.
vec4 vertex(uint t) {
    uvec3 p = triangle_planes(t);
    vec3 a = plane_vector(p.x), b = plane_vector(p.y), c = plane_vector(p.z);
    vec3 bc = cross(b, c);
    float w = dot(a, bc);
    vec3 x = 0.5 * (dot(a, a) * bc + dot(b, b) * cross(c, a) + dot(c, c) * cross(a, b));
    return w < 0.0 ? vec4(-x, -w) : vec4(x, w);
}

// Whether the removed triangles [from, triangle_count) contain the directed edge a -> b.
bool removed_has_edge(uint from, uint a, uint b) {
    for (uint t = from; t < triangle_count; ++t) {
        uvec3 p = triangle_planes(t);
        if ((p.x == a && p.y == b) || (p.y == a && p.z == b) || (p.z == a && p.x == b)) return true;
    }
    return false;
}

// Moves the vertices beyond the plane (dot(v, x) > limit) to the end and links their boundary. Returns the
// number of boundary edges, 0 if nothing is beyond; `from` is the first removed triangle, `entry` a plane on
// the boundary.
uint cut(vec3 v, float limit, out uint from, out uint entry) {
    from = triangle_count;
    entry = 0u;
    for (uint t = 0u; t < from;) {
        vec4 x = vertex(t);
        if (dot(v, x.xyz) > limit * (1.0 + ON_PLANE) * x.w) {
            --from;
            uint swap = triangles[t * WORKGROUP + lane];
            triangles[t * WORKGROUP + lane] = triangles[from * WORKGROUP + lane];
            triangles[from * WORKGROUP + lane] = swap;
        } else {
            ++t;
        }
    }
    if (from == triangle_count) return 0u;
    for (uint w = 0u; w < (MAX_PLANES + 3u) / 4u; ++w) links[w * WORKGROUP + lane] = 0xffffffffu;
    uint edges = 0u;
    for (uint t = from; t < triangle_count; ++t) {
        uvec3 p = triangle_planes(t);
        for (uint e = 0u; e < 3u; ++e) {
            if (!removed_has_edge(from, p.y, p.x)) {
                if (link(p.x) != UNLINKED) trouble |= FLAG_OPEN;
                set_link(p.x, p.y);
                entry = p.x;
                ++edges;
            }
            p = p.yzx;
        }
    }
    // One closed loop through all boundary edges, or the cut region is no disc.
    uint at = entry, length = 0u;
    while (length < edges && at != UNLINKED) {
        at = link(at);
        ++length;
        if (at == entry) break;
    }
    if (length != edges || at != entry) trouble |= FLAG_OPEN;
    return edges;
}

// Clips the cell by the bisector with the mirror image v.
void clip(vec3 v, uint site) {
    uint from, entry;
    uint edges = cut(v, 0.5 * dot(v, v), from, entry);
    if (edges == 0u) return;
    if (plane_count >= MAX_PLANES) trouble |= FLAG_PLANES;
    if (from + edges > MAX_TRIANGLES) trouble |= FLAG_TRIANGLES;
    if (from == 0u) trouble |= FLAG_OPEN;
    if (trouble != 0u) return;
    planes[plane_count * WORKGROUP + lane] = uvec4(floatBitsToUint(v), site);
    uint at = entry;
    for (uint e = 0u; e < edges; ++e) {
        uint to = link(at);
        set_triangle(from + e, at, to, plane_count);
        at = to;
    }
    triangle_count = from + edges;
    ++plane_count;
}

// A cube around the site; a sound face lies well inside it.
void start_cell() {
    for (uint axis = 0u; axis < 3u; ++axis) {
        vec3 high = vec3(0.0);
        high[axis] = 2.0 * box_half;
        planes[(2u * axis) * WORKGROUP + lane] = uvec4(floatBitsToUint(-high), NONE);
        planes[(2u * axis + 1u) * WORKGROUP + lane] = uvec4(floatBitsToUint(high), NONE);
    }
    plane_count = 6u;
    for (uint corner = 0u; corner < 8u; ++corner) {
        uint x = corner & 1u, y = 2u + ((corner >> 1) & 1u), z = 4u + (corner >> 2);
        // An odd number of low sides mirrors the corner.
        bool mirrored = (bitCount(corner) & 1) == 0;
        set_triangle(corner, x, mirrored ? z : y, mirrored ? y : z);
    }
    triangle_count = 8u;
}

void clip_by_site(vec3 at, vec3 u, uint site, uint j) {
    vec4 other = AT(sites, j);
    vec3 v = (other.xyz - at) / unit;
    if (dot(v, v) < 1e-12) {
        // Both sites have the same direction u and are separated along it.
        v = (j > site ? 1e-3 : -1e-3) * u;
        notes |= FLAG_COINCIDENT;
    } else if (WEIGHTED != 0u) {
        // Both sites move their bisector by as much, and neither loses its own place.
        float ratio = other.w * spacing / unit;
        float shift = weight_share * (1.0 - ratio * ratio) / dot(v, v);
        v *= 1.0 + clamp(shift, -LARGEST_SHIFT, LARGEST_SHIFT);
    }
    clip(v, j);
}

bool listed(uint site, uint j) {
    for (uint s = 0u; s < K; ++s) {
        if (neighbours[s * site_count + site] == j) return true;
    }
    return false;
}

// Clips by every site within reach (squared, in spacings) that is not in the site's list. Loops, not
// branches, lead past what is too far: some devices walk through a branch that no lane takes, and a clip is
// long.
void clip_by_all(vec3 at, vec3 u, uint site, float reach_sq) {
    uint tiles = tile_count(site_count);
    uint t = 0u;
    while (trouble == 0u) {
        while (t < tiles && box_distance_sq(at, at, AT(bounds, 2u * t).xyz, AT(bounds, 2u * t + 1u).xyz) >
                                reach_sq * unit * unit) ++t;
        if (t >= tiles) break;
        uvec2 hits = uvec2(0u);
        for (uint l = 0u; l < TILE; ++l) {
            uint j = t * TILE + l;
            vec3 d = (AT(sites, min(j, site_count - 1u)).xyz - at) / unit;
            if (j < site_count && j != site && dot(d, d) <= reach_sq) hits[l >> 5] |= 1u << (l & 31u);
        }
        while ((hits.x | hits.y) != 0u && trouble == 0u) {
            uint word = hits.x != 0u ? 0u : 1u;
            uint j = t * TILE + 32u * word + findLSB(hits[word]);
            hits[word] &= hits[word] - 1u;
            if (!listed(site, j)) clip_by_site(at, u, site, j);
        }
        ++t;
    }
}

// The squared distance from which on no site cuts a face of this squared radius: twice the radius, but
// weights move a bisector the more, the longer the edges are on its other side.
float security_sq(float radius_sq) {
    if (WEIGHTED == 0u) return 4.0 * radius_sq;
    float near = sqrt(radius_sq) + weight_share * steepness;
    float far = 1.0 - weight_share * steepness * steepness;
    return 4.0 * near * near / (far * far);
}

// Cuts by the tangent plane and writes the loop of that cut, which is the face. Returns its radius squared in
// spacings, or -1 without a face.
float write_face(uint site, vec3 u, vec3 v, vec3 n) {
    uint from, entry;
    uint edges = cut(n, 0.0, from, entry);
    if (edges < 3u || from == 0u) trouble |= FLAG_OPEN;
    if (edges > MAX_CORNERS) trouble |= FLAG_CORNERS;
    if (trouble != 0u) return -1.0;
    float radius_sq = 0.0;
    bool parallel = false;
    uint at = entry;
    for (uint e = 0u; e < edges; ++e) {
        uint to = link(at);
        vec3 a3 = plane_vector(at), b3 = plane_vector(to);
        vec2 a = vec2(dot(a3, u), dot(a3, v)), b = vec2(dot(b3, u), dot(b3, v));
        float det = a.x * b.y - a.y * b.x;
        parallel = parallel || abs(det) < 1e-30;
        vec2 x = 0.5 * (dot(a3, a3) * vec2(b.y, -b.x) + dot(b3, b3) * vec2(-a.y, a.x)) / det;
        radius_sq = max(radius_sq, dot(x, x));
        uint behind = planes[at * WORKGROUP + lane].w;
        if (behind == NONE) notes |= FLAG_UNBOUNDED;
        corners[e * site_count + site] = x * unit;
        fan[e * site_count + site] = behind;
        at = to;
    }
    // Parallel planes, which a cell should never bring together, give no corner.
    if (parallel || radius_sq > 1e30) {
        trouble |= FLAG_OPEN;
        return -1.0;
    }
    corner_count[site] = edges;
    return radius_sq;
}

void main() {
    uint site = thread_index();
    lane = gl_LocalInvocationID.x;
    if (site >= site_count) return;
    vec4 own = AT(sites, site);
    vec3 at = own.xyz;
    unit = WEIGHTED != 0u ? spacing * own.w : spacing;
    vec3 n = AT(normals, site).xyz, u, v;
    tangent_frame(n, u, v);
    float reach_sq = -1.0;
    float offset = virtual_offset;
    uint found = 0u; // flags of the face that stands so far
    bool secure = false;
    corner_count[site] = 0u;
    for (uint attempt = 0u; attempt < MAX_ATTEMPTS; ++attempt) {
        trouble = 0u;
        notes = reach_sq > 0.0 ? FLAG_SECURITY : 0u;
        start_cell();
        clip(offset * n, NONE);
        clip(-offset * n, NONE);
        uint farthest = NONE;
        for (uint s = 0u; s < K && trouble == 0u; ++s) {
            farthest = neighbours[s * site_count + site];
            if (farthest == NONE) break;
            clip_by_site(at, u, site, farthest);
        }
        if (reach_sq > 0.0) clip_by_all(at, u, site, reach_sq);
        float radius_sq = trouble == 0u ? write_face(site, u, v, n) : -1.0;
        if (trouble == FLAG_OPEN) {
            // Many planes through one point, as at the centre of a ball: a thinner slab leaves the point out.
            offset *= 0.125;
            continue;
        }
        if (trouble != 0u) break;
        found = notes;
        // Radius of security: a site farther than twice the face's radius cannot cut it.
        secure = farthest == NONE || reach_sq > 0.0;
        if (!secure) {
            vec3 d = (AT(sites, farthest).xyz - at) / unit;
            secure = dot(d, d) >= security_sq(radius_sq);
        }
        if (secure) break;
        reach_sq = WEIGHTED != 0u ? 1.0001 * security_sq(radius_sq) : 4.0001 * radius_sq;
    }
    // A list's face stands where completing it failed, or no attempt was left for that.
    if (!secure && reach_sq > 0.0) found |= FLAG_SECURITY | FLAG_INCOMPLETE;
    else if (trouble != 0u) found |= trouble;
    flags[site] |= found;
}
