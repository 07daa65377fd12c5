// Purpose: brute-force k-nearest neighbours (Garcia et al. 2008), nearest first, ties by index.
// Invocation: one query.
// Reads: queries, points.
// Writes: neighbours[slot * query_count + query], NONE where there are fewer than K points.
// Fills the lists of normals/plane_fit, face/cell and project/nearest_vertices. The workgroup stages the points in
// shared memory, one tile after another, and starts where its own queries lie if both are in the same spatial
// order: the lists are then nearly final after the first tile and later points seldom enter.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_ballot : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"

layout(constant_id = 1) const uint K = 32;

layout(push_constant) uniform Push {
    uint query_count;
    uint point_count;
    uint exclude_self; // 1: queries are the points themselves, and none is its own neighbour
};
layout(set = 0, binding = 0) readonly buffer Queries { vec4 queries[]; };
layout(set = 0, binding = 1) readonly buffer Points { vec4 points[]; };
layout(set = 0, binding = 2) writeonly buffer Neighbours { uint neighbours[]; };

const float FARTHEST = 3.402823466e38;

shared vec4 tile[WORKGROUP];

bool before(float a_sq, uint a, float b_sq, uint b) { return a_sq < b_sq || (a_sq == b_sq && a < b); }

void main() {
    uint query = thread_index();
    uint lane = gl_LocalInvocationID.x;
    bool alive = query < query_count;
    vec3 at = alive ? queries[query].xyz : vec3(0.0);
    uint self = exclude_self != 0u ? query : NONE;
    // Sorted, nearest first. Every index into these is known when the loops are unrolled, so they are registers.
    float best_sq[K];
    uint best[K];
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        best_sq[s] = alive ? FARTHEST : -1.0;
        best[s] = NONE;
    }
    // The workgroup is a power of two: either whole subgroups, or the first lanes of one. At most 32 bits of hits.
    uint chunk = min(min(gl_SubgroupSize, WORKGROUP), 32u);
    uint tiles = (point_count + WORKGROUP - 1u) / WORKGROUP;
    uint first = uint(float(tiles) * (float(group_index() * WORKGROUP) / float(query_count)));
    for (uint t = 0u; t < tiles; ++t) {
        uint start = ((first + t) % tiles) * WORKGROUP;
        barrier();
        // What is past the end is infinitely far and never enters a list.
        tile[lane] = start + lane < point_count ? points[start + lane] : vec4(uintBitsToFloat(0x7f800000u));
        barrier();
        for (uint j = 0u; j < WORKGROUP; j += chunk) {
            // Every lane fetches one point of the chunk and hands it round: one load for `chunk` distances.
            vec3 mine = tile[j + gl_SubgroupInvocationID % chunk].xyz;
            uint hits = 0u;
            [[unroll]] for (uint l = 0u; l < chunk; ++l) {
                vec3 d = subgroupBroadcast(mine, l) - at;
                if (dot(d, d) <= best_sq[K - 1u]) hits |= 1u << l;
            }
            while (hits != 0u) {
                uint l = findLSB(hits);
                hits &= hits - 1u;
                vec3 d = tile[j + l].xyz - at;
                float d_sq = dot(d, d);
                uint point = start + j + l;
                if (point == self) continue;
                // One pass of an insertion network: what is displaced moves on, at last out of the list.
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
        }
    }
    if (!alive) return;
    [[unroll]] for (uint s = 0u; s < K; ++s) neighbours[s * query_count + query] = best[s];
}
