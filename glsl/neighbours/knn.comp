// Purpose: k-nearest neighbours by brute force (Garcia et al. 2008), nearest first, ties by index.
// Invocation: one query.
// Reads: queries, points, bounds.
// Writes: neighbours[slot * query_count + query], NONE where there are fewer than K points.
// Filled by neighbours/tile_bounds; fills the lists of normals/plane_fit, face/cell and
// project/nearest_vertices. The workgroup stages the points in shared memory, one tile after another. It
// begins with the tile nearest to its queries, and then skips every tile whose box is farther from theirs
// than its longest list reaches.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/tiles.glsl"

layout(constant_id = 1) const uint K = 32;

layout(push_constant) uniform Push {
    uint query_count;
    uint point_count;
    uint exclude_self; // 1: queries are the points themselves, and none is its own neighbour
};
READ_VEC4(0, Queries, queries);
READ_VEC4(1, Points, points);
READ_VEC4(2, Bounds, bounds);
layout(set = 0, binding = 3) writeonly buffer Neighbours { uint neighbours[]; };

// Tiles that are tested at a time.
const uint BLOCK = 256u;

shared vec4 tile[TILE];
// Distance of each tile of the block from the box of the queries, and a bit for each that may hold a
// neighbour.
shared float gap_sq[BLOCK];
shared uint needed[BLOCK / 32u];
// Bounds of the workgroup's queries and reach of its longest list: floats in the order-keeping form of
// `sortable`.
shared uint group_low[3];
shared uint group_high[3];
shared uint group_reach;
shared uint nearest_key;
shared uint nearest_at;

// Sorted, nearest first. Every index into these is known once the loops are unrolled, so they are registers.
float best_sq[K];
uint best[K];
uint query;
uint lane;
bool alive;
vec3 at;

// Unsigned integers that compare like the floats they stand for; atomics on them do not depend on the order.
uint sortable(float x) {
    uint bits = floatBitsToUint(x);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

float unsortable(uint x) { return uintBitsToFloat((x & 0x80000000u) != 0u ? x & 0x7fffffffu : ~x); }

bool before(float a_sq, uint a, float b_sq, uint b) { return a_sq < b_sq || (a_sq == b_sq && a < b); }

// One pass of an insertion network: what is displaced moves on, at last out of the list.
void insert(float d_sq, uint point) {
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        bool enters = before(d_sq, point, best_sq[s], best[s]);
        float out_sq = enters ? best_sq[s] : d_sq;
        uint out_point = enters ? best[s] : point;
        best_sq[s] = enters ? d_sq : best_sq[s];
        best[s] = enters ? point : best[s];
        d_sq = out_sq;
        point = out_point;
    }
}

// Tests all points of one tile and updates the workgroup's reach. In uniform control flow.
void scan(uint t) {
    uint start = t * TILE;
    barrier();
    for (uint i = lane; i < TILE; i += WORKGROUP) {
        tile[i] = AT(points, min(start + i, point_count - 1u));
    }
    if (lane == 0u) group_reach = 0u;
    barrier();
    // First find what may enter, then insert: lanes then insert what they found at the same time.
    // A subgroup whose queries are all too far from the tile leaves the loop at once.
    vec3 low = AT(bounds, 2u * t).xyz, high = AT(bounds, 2u * t + 1u).xyz;
    bool near = box_distance_sq(at, at, low, high) <= best_sq[K - 1u];
    uint end = near ? 32u : 0u;
    uvec2 hits = uvec2(0u);
    for (uint l = 0u; l < end; ++l) {
        vec3 d = tile[l].xyz - at, e = tile[l + 32u].xyz - at;
        hits.x |= dot(d, d) <= best_sq[K - 1u] ? 1u << l : 0u;
        hits.y |= dot(e, e) <= best_sq[K - 1u] ? 1u << l : 0u;
    }
    // Points past the end do not count.
    uint inside = point_count - start;
    if (inside < 32u) hits.x &= (1u << inside) - 1u;
    if (inside < 64u) hits.y &= inside < 32u ? 0u : (1u << (inside - 32u)) - 1u;
    uint self = query - start;
    if (exclude_self != 0u && self < 32u) hits.x &= ~(1u << self);
    if (exclude_self != 0u && self >= 32u && self < 64u) hits.y &= ~(1u << (self - 32u));
    while ((hits.x | hits.y) != 0u) {
        bool low = hits.x != 0u;
        uint l = low ? findLSB(hits.x) : 32u + findLSB(hits.y);
        if (low) hits.x &= hits.x - 1u;
        else hits.y &= hits.y - 1u;
        vec3 d = tile[l].xyz - at;
        insert(dot(d, d), start + l);
    }
    if (alive) atomicMax(group_reach, sortable(best_sq[K - 1u]));
    barrier();
}

// Tests the tiles from `start` on against the workgroup's reach; `only`, if not NONE, is the only one taken,
// and `but` the one left out. In uniform control flow.
void test_block(uint start, uint tiles, vec3 low, vec3 high, uint only, uint but) {
    barrier();
    for (uint i = lane; i < BLOCK / 32u; i += WORKGROUP) needed[i] = 0u;
    barrier();
    float reach_sq = unsortable(group_reach);
    for (uint i = lane; i < BLOCK && start + i < tiles; i += WORKGROUP) {
        uint t = start + i;
        gap_sq[i] = box_distance_sq(low, high, AT(bounds, 2u * t).xyz, AT(bounds, 2u * t + 1u).xyz);
        bool take = only != NONE ? t == only : t != but && gap_sq[i] <= reach_sq;
        if (take) atomicOr(needed[i >> 5], 1u << (i & 31u));
    }
    barrier();
}

// The tile whose middle is nearest to `middle`, the lower one of two. In uniform control flow.
uint nearest_tile(vec3 middle, uint tiles) {
    uint mine = 0xffffffffu, mine_at = NONE;
    for (uint t = lane; t < tiles; t += WORKGROUP) {
        vec3 d = 0.5 * (AT(bounds, 2u * t).xyz + AT(bounds, 2u * t + 1u).xyz) - middle;
        uint key = sortable(dot(d, d));
        if (key < mine) {
            mine = key;
            mine_at = t;
        }
    }
    atomicMin(nearest_key, mine);
    barrier();
    if (mine == nearest_key) atomicMin(nearest_at, mine_at);
    barrier();
    return min(nearest_at, tiles - 1u);
}

void main() {
    query = thread_index();
    lane = gl_LocalInvocationID.x;
    alive = query < query_count;
    at = alive ? AT(queries, query).xyz : vec3(0.0);
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        // Nothing is nearer than -1: lanes past the end find nothing.
        best_sq[s] = alive ? 3.402823466e38 : -1.0;
        best[s] = NONE;
    }
    if (lane == 0u) {
        group_reach = 0u;
        nearest_key = 0xffffffffu;
        nearest_at = NONE;
        for (uint a = 0u; a < 3u; ++a) {
            group_low[a] = 0xffffffffu;
            group_high[a] = 0u;
        }
    }
    barrier();
    for (uint a = 0u; a < 3u && alive; ++a) {
        atomicMin(group_low[a], sortable(at[a]));
        atomicMax(group_high[a], sortable(at[a]));
    }
    barrier();
    vec3 low = vec3(unsortable(group_low[0]), unsortable(group_low[1]), unsortable(group_low[2]));
    vec3 high = vec3(unsortable(group_high[0]), unsortable(group_high[1]), unsortable(group_high[2]));
    uint tiles = tile_count(point_count);
    uint first = nearest_tile(0.5 * (low + high), tiles);
    // Loops, not branches, skip what is not needed: some devices run a branch that no lane takes.
    uint start = first / BLOCK * BLOCK;
    for (bool nearest = true; start < tiles; nearest = false) {
        test_block(start, tiles, low, high, nearest ? first : NONE, first);
        uint word = 0u, bits = needed[0];
        while (true) {
            // A list may have become shorter since the test; the nearest tile is taken in any case.
            uint t = NONE;
            while (t == NONE && (bits != 0u || word + 1u < BLOCK / 32u)) {
                if (bits == 0u) bits = needed[++word];
                uint i = 32u * word + uint(max(findLSB(bits), 0));
                if (bits != 0u && (nearest || gap_sq[i] <= unsortable(group_reach))) t = start + i;
                bits &= bits - 1u;
            }
            if (t == NONE) break;
            scan(t);
        }
        start = nearest ? 0u : start + BLOCK;
    }
    if (!alive) return;
    [[unroll]] for (uint s = 0u; s < K; ++s) neighbours[s * query_count + query] = best[s];
}
