// Purpose: the K nearest other sites of every site, nearest first, ties by index, and the distance of the
// first one not listed.
// Invocation: one site of a block, in workgroups of one subgroup, because it runs subgroupBarrier() as often
// as its sites need. The sites of a subgroup follow each other in Morton order and walk the boxes together.
// Reads: sites, boxes; neighbours and list_sites of the last time.
// Writes: neighbours, as common/blocks.glsl says, NONE where there are fewer than K other sites; reach[site],
// the distances of the (NEAR + 1)-th and the (K + 1)-th nearest, ENDLESS where there is none; list_sites,
// where the sites are now, as common/sites.glsl has them, with the (K + 1)-th in w; away = reach.
// Filled by neighbours/box_levels; consumed by the faces and neighbours/moved.
//
// A box is entered if it meets the ball of any site of the subgroup that its list fills so far: first come
// the leaves (eight sites each) around the subgroup's own in the order of the sites, which make the balls
// small, then the others from the root. Lanes are boxes or candidates while these are tested, against one
// site after another, and a ballot gives each site its hits: no memory is read but once for each candidate.
// Then lanes are sites again and insert their hits. The result does not depend on the size of the subgroup,
// for it is that of looking at every site.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#define DEFAULT_WORKGROUP 8
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/list_bounds.glsl"
#include "common/tiles.glsl"

layout(constant_id = 1) const uint K = 24;
// 8 where a subgroup has eight lanes: each then knows all sites of its subgroup, in registers. 0 otherwise.
layout(constant_id = 2) const uint LANES = 0;
// A face mostly needs no more than this many.
layout(constant_id = 4) const uint NEAR = 16;
// Blocks of four leaves that are tested before the walk.
layout(constant_id = 3) const uint WINDOW = 2;

layout(push_constant) uniform Push {
    uvec4 starts_low;  // first box of levels 0 to 3
    uvec4 starts_high; // of levels 4 to 7
    uint site_count;
    uint levels;
    uint first; // of the block's sites
    uint block_sites;
    uint again; // 1: there are lists of these sites already, 0: there are none
};
READ_VEC4(0, Sites, sites);
READ_VEC4(1, Boxes, boxes);
layout(set = 0, binding = 2) buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 3) writeonly buffer Reach { vec2 reach[]; };
layout(set = 0, binding = 4) buffer ListSites { vec4 list_sites[]; };
layout(set = 0, binding = 5) writeonly buffer Away { vec2 away[]; };

#include "common/blocks.glsl"
#include "common/sites.glsl"

const float FAR = 3.402823466e38;

uint site;
uint lane;
uint lanes;
bool alive;
vec3 at;
// Squared radius within which a site may still enter the list; negative past the last site.
float bound_sq;
// The list and the first site not listed. Every index is known once the loops are unrolled, so they are
// registers.
float best_sq[K + 1u];
uint best[K + 1u];
// Sites of the subgroup, if LANES is 8, and their bounds.
vec3 mates[8];
float mate_bounds[8];
// Leaves that were tested before the walk: from .x to .y.
ivec2 window;
uvec4 block;

void share_sites() {
    if (LANES != 8u) return;
    [[unroll]] for (uint s = 0u; s < 8u; ++s) mates[s] = subgroupBroadcast(at, s);
}

void share_bounds() {
    if (LANES != 8u) return;
    [[unroll]] for (uint s = 0u; s < 8u; ++s) mate_bounds[s] = subgroupBroadcast(bound_sq, s);
}

vec4 mate(uint s) {
    if (LANES == 8u) return vec4(mates[s], mate_bounds[s]);
    return vec4(subgroupBroadcast(at, s), subgroupBroadcast(bound_sq, s));
}

// A constant where it can be, so that loops over the lanes are unrolled and `mates` are registers.
uint mate_count() { return LANES == 8u ? 8u : lanes; }

uint pick(uvec4 v, uint i) { return i < 2u ? (i == 0u ? v.x : v.y) : (i == 2u ? v.z : v.w); }

// One pass of an insertion network: what is displaced moves on, at last out of the list.
void insert(float d_sq, uint point) {
    [[unroll]] for (uint s = 0u; s < K + 1u; ++s) {
        float listed_sq = best_sq[s];
        uint listed = best[s];
        bool enters = d_sq < listed_sq || (d_sq == listed_sq && point < listed);
        best_sq[s] = min(d_sq, listed_sq);
        best[s] = enters ? point : listed;
        d_sq = max(d_sq, listed_sq);
        point = enters ? listed : point;
    }
}

// Tests the sites of the four leaves in `block`, NONE for none. In uniform control flow.
void look() {
    uint hits = 0u;
    for (uint round = 0u; round < 32u; round += mate_count()) {
        uint c = round + lane;
        uint leaf = pick(block, c >> 3);
        uint point = 8u * leaf + (c & 7u);
        bool valid = c < 32u && leaf != NONE && point < site_count;
        vec3 x = site_at(valid ? point : 0u).xyz;
        uint mine = 0u;
        [[unroll]] for (uint s = 0u; s < mate_count(); ++s) {
            vec4 m = mate(s);
            vec3 d = x - m.xyz;
            uint near = subgroupBallot(valid && dot(d, d) <= m.w).x;
            mine = s == lane ? near : mine;
        }
        hits |= mine << round;
    }
    [[unroll]] for (uint l = 0u; l < 4u; ++l) {
        uint own = site - 8u * block[l];
        hits &= own < 8u ? ~(1u << (8u * l + own)) : 0xffffffffu;
    }
    // Two at a time: the list is then stored under the mask of the loop half as often.
    while (hits != 0u) {
        uint c = uint(findLSB(hits));
        hits &= hits - 1u;
        uint other = hits != 0u ? uint(findLSB(hits)) : NONE;
        hits &= hits - 1u;
        uint point = 8u * pick(block, c >> 3) + (c & 7u);
        vec3 d = site_at(point).xyz - at;
        insert(dot(d, d), point);
        point = other != NONE ? 8u * pick(block, other >> 3) + (other & 7u) : NONE;
        d = site_at(other != NONE ? point : site).xyz - at;
        insert(other != NONE ? dot(d, d) : FAR, point);
    }
    // Lanes leave the loop one by one; what follows needs them all.
    subgroupBarrier();
    // A little more than the bound, so that rounding never hides a site.
    bound_sq = alive ? min(1.000001 * best_sq[K], bound_sq) : -1.0;
    share_bounds();
}

// A bit for each of the eight boxes from `base` on of a level that a site of the subgroup must enter. In
// uniform control flow.
uint touched(uint level, uint base) {
    uint start = pick(level < 4u ? starts_low : starts_high, level & 3u) + base;
    uint mask = 0u;
    for (uint round = 0u; round < 8u; round += mate_count()) {
        uint child = min(round + lane, 7u);
        vec3 low = AT(boxes, 2u * (start + child)).xyz, high = AT(boxes, 2u * (start + child) + 1u).xyz;
        bool near = false;
        [[unroll]] for (uint s = 0u; s < mate_count(); ++s) {
            vec4 m = mate(s);
            near = near || box_distance_sq(m.xyz, m.xyz, low, high) <= m.w;
        }
        int leaf = int(base + child);
        bool seen = level == 0u && leaf >= window.x && leaf <= window.y;
        mask |= subgroupBallot(near && !seen).x << round;
    }
    return mask & 0xffu;
}

// Tests the leaves around the subgroup's own, the middle ones first, then those that a walk over the boxes
// finds from the root, four at a time. Loops, not branches, skip what is not needed: some devices run a
// branch that no lane takes.
void walk() {
    int own = int(max(lanes >> 3, 1u));
    int middle = int(subgroupBroadcast(site, 0u) >> 3) + own / 2;
    int leaves = int(site_count + 7u) / 8, around = 4 * int(WINDOW), seen = 0;
    window = ivec2(middle - around / 2, middle + around / 2 - 1);
    // Boxes still to enter: those of the current level (bits of `mask`, counted from `base`), and eight bits
    // for each level above.
    uint level = levels, base = 0u, mask = 1u;
    uvec2 above = uvec2(0u);
    bool more = true;
    while (more) {
        int step = seen / 2;
        ivec4 next = middle + ivec4(step, -step - 1, step + 1, -step - 2);
        bool walks = seen >= around;
        seen += 4;
        // Negative numbers are beyond the last leaf when taken as unsigned.
        bvec4 none = greaterThanEqual(uvec4(next), uvec4(walks ? 0 : leaves));
        block = mix(uvec4(next), uvec4(NONE), none);
        uint count = 0u;
        while (walks && more && count < 4u) {
            while (mask == 0u && level < levels) {
                ++level;
                mask = above.x & 0xffu;
                above = uvec2(above.x >> 8 | above.y << 24, above.y >> 8);
                base = base >> 3 & ~7u;
            }
            more = mask != 0u;
            while (level > 0u && mask != 0u) {
                uint child = uint(findLSB(mask));
                mask &= mask - 1u;
                above = uvec2(above.x << 8 | mask, above.y << 8 | above.x >> 24);
                base = 8u * (base + child);
                --level;
                mask = touched(level, base);
            }
            while (level == 0u && mask != 0u && count < 4u) {
                uint leaf = base + uint(findLSB(mask));
                mask &= mask - 1u;
                block = mix(block, uvec4(leaf), equal(uvec4(count), uvec4(0u, 1u, 2u, 3u)));
                ++count;
            }
        }
        look();
    }
}

// An index as the fourth component of a position: as a float that no device takes for zero. NONE is zero.
float as_component(uint other) { return other == NONE ? 0.0 : uintBitsToFloat(other | 0x40000000u); }

uint from_component(float component) {
    uint bits = floatBitsToUint(component);
    return bits == 0u ? NONE : bits & 0x3fffffffu;
}

// Upper bound for the squared distance of the first site that the new list leaves out: the sites of the list
// so far and the first that it left out are still near. In uniform control flow: lanes past the last site
// look at that one's list.
float known_bound_sq() {
    uint own = min(site, first + block_sites - 1u);
    uint others = PACKED == 0u ? again * (K + 1u) : 0u;
    float farthest_sq = others == 0u ? FAR : 0.0;
    for (uint s = 0u; s < others; ++s) {
        uint other = s < K ? neighbours[block_place(s, own)] : from_component(list_sites[own].w);
        vec3 d = site_at(other == NONE ? own : other).xyz - at;
        farthest_sq = max(farthest_sq, other == NONE ? FAR : dot(d, d));
    }
    return min(1.000001 * farthest_sq, FAR);
}

void main() {
    site = block_site(thread_index());
    lane = gl_SubgroupInvocationID;
    lanes = LANES == 8u ? 8u : subgroupBallotBitCount(subgroupBallot(true));
    alive = in_block(site);
    at = site_at(min(site, site_count - 1u)).xyz;
    bound_sq = known_bound_sq();
    bound_sq = alive ? bound_sq : -1.0;
    [[unroll]] for (uint s = 0u; s < K + 1u; ++s) {
        best_sq[s] = FAR;
        best[s] = NONE;
    }
    share_sites();
    share_bounds();
    walk();
    if (!alive) return;
    [[unroll]] for (uint s = 0u; s < K; ++s) neighbours[block_place(s, site)] = best[s];
    vec2 far = vec2(
        best[min(NEAR, K)] == NONE ? ENDLESS : sqrt(best_sq[min(NEAR, K)]),
        best[K] == NONE ? ENDLESS : sqrt(best_sq[K]));
    reach[site] = far;
    away[site] = far;
    if (PACKED == 0u) list_sites[site] = vec4(at, as_component(best[K]));
    for (uint c = 0u; c < 3u * PACKED; ++c) PACKED_AT(list_sites, 3u * site + c) = at[c];
}
