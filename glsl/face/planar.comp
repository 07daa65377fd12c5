// Purpose: the face of each site by intervals, its area centroid, and the target that momentum makes of it.
// Invocation: one site; with ROUND 1 every so many entries of the list that round 0 left.
// Reads: sites (w = packed normal), normals, neighbours, reach, status (of neighbours/decide).
// Writes: targets (xyz, w = squared distance to the centroid), centroids (w = 1); insecure: a counter an iteration for
//   each round, then the sites whose lines do not reach the radius of security.
// Filled by neighbours/lists and step/settle; consumed by project/walk and the next iteration.
// reach has, for each site, how near the sites after the first K (x) and outside the list (y) may be.
// Round 0 looks at the nearest K sites, which is enough nearly everywhere; round 1 at whole lists, and what even they
// leave open is bounded by a disc.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"

layout(constant_id = 1) const uint K = 16;
layout(constant_id = 2) const uint ROUND = 0;

layout(push_constant) uniform Push {
    uint site_count;
    uint iteration;
    uint iterations; // counters a round
    float momentum; // share of the last motion that is added, 0 to 1
    float largest_move; // longest step
    float widest; // no face reaches farther from its site
};
layout(set = 0, binding = 0) readonly buffer Sites { vec4 sites[]; };
layout(set = 0, binding = 1) readonly buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 3) readonly buffer Reach { vec2 reach[]; };
layout(set = 0, binding = 4) readonly buffer Status { uint status[]; };
layout(set = 0, binding = 5) writeonly buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 6) buffer Centroids { vec4 centroids[]; };
layout(set = 0, binding = 7) buffer Insecure { uint insecure[]; };

#include "common/planar.glsl"

void main() {
    uint thread = thread_index();
    uint list = 2u * iterations;
    uint count = ROUND == 0u ? site_count : insecure[iteration];
    uint threads = gl_NumWorkGroups.x * gl_NumWorkGroups.y * WORKGROUP;
    // A loop, not a branch: some devices walk through a branch that no lane takes.
    for (uint entry = thread; entry < count; entry += threads) {
        uint site = ROUND == 0u ? entry : insecure[list + entry];
        vec3 at = sites[site].xyz;
        vec3 n = normals[site].xyz;
        vec3 u, v;
        tangent_frame(n, u, v);
        load_lines(site, site_count, at, n, u, v);
        // Sites that no line stands for are at least this far away: the reach changes by no more than the way between
        // two sites, and nobody has moved farther than rho times his own.
        vec2 away = min(reach[site], vec2(10.0));
        float secure = ROUND == 0u ? away.x : away.y;
        secure -= uintBitsToFloat(status[1]) * (secure + 2.0 * away.y);
        float bound = min(max(secure, 0.0), widest);
        cut_lines(bound);
        float twice_area, radius_sq;
        vec2 balance;
        measure_face(twice_area, balance, radius_sq);
        bool security = twice_area > 0.0 && 4.0 * radius_sq <= secure * secure && radius_sq < bound * bound;
        if (!security) {
            uint place = atomicAdd(insecure[ROUND * iterations + iteration], 1u);
            if (ROUND == 0u) insecure[list + place] = site;
        }
        vec3 middle = at + balance.x * u + balance.y * v;
        vec4 last = centroids[site];
        vec3 step = middle - at, motion = (middle - last.xyz) * last.w;
        // Against its motion a site starts anew.
        float share = dot(step, motion) > 0.0 ? momentum : 0.0;
        vec3 move = step + share * motion;
        float length_sq = dot(move, move);
        move *= min(1.0, largest_move * inversesqrt(max(length_sq, 1e-30)));
        targets[site] = vec4(at + move, dot(step, step));
        if (ROUND == 1u || security) centroids[site] = vec4(middle, 1.0);
    }
}
