// The main part of face/planar and face/planar_rest, which differ in what their threads are and in their loops.
#ifndef COMMON_PLANAR_TARGETS_GLSL
#define COMMON_PLANAR_TARGETS_GLSL

layout(push_constant) uniform Push {
    uint site_count;
    uint iteration;
    uint iterations; // counters a round
    float momentum; // share of the last motion that is added, 0 to 1
    float largest_move; // longest step
    float widest; // no face reaches farther from its site
};
layout(set = 0, binding = 0) readonly buffer Sites { vec4 sites[]; };
layout(set = 0, binding = 1) readonly buffer Normals { uint normals[]; };
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 3) readonly buffer Away { vec2 away[]; };
layout(set = 0, binding = 4) readonly buffer Status { uint status[]; };
layout(set = 0, binding = 5) writeonly buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 6) buffer Centroids { vec4 centroids[]; };
layout(set = 0, binding = 7) buffer Insecure { uint insecure[]; };

#include "common/planar.glsl"

const float CAREFUL = 0.2;

void main() {
    uint thread = thread_index();
    uint list = 2u * iterations;
    uint count = FIRST ? site_count : insecure[iteration];
    uint threads = gl_NumWorkGroups.x * gl_NumWorkGroups.y * WORKGROUP;
    // A loop, not a branch: some devices walk through a branch that no lane takes.
    for (uint entry = thread; entry < count; entry += threads) {
        uint site = FIRST ? entry : insecure[list + entry];
        vec4 own = sites[site];
        vec3 at = own.xyz;
        bool pinned = is_pinned(own.w);
        vec3 n = unpack_normal(normals[site]);
        vec3 u, v;
        tangent_frame(n, u, v);
        load_lines(site, site_count, own, n, u, v);
        // Sites that no line stands for are at least this far away: nobody has moved farther than rho times the reach
        // of his list, which changes by no more than the way between two sites. This site's own way is taken off
        // already, so its reach was at most farthest.
        vec2 left = min(away[site], vec2(10.0));
        float rho = uintBitsToFloat(status[1]);
        float farthest = max(left.y, 0.0) / (1.0 - rho);
        float then = FIRST ? left.x + rho * farthest : farthest;
        float secure = (FIRST ? left.x : left.y) - rho * (then + farthest);
        float bound = min(max(secure, 0.0), widest);
        cut_lines(bound);
        float twice_area, radius_sq;
        vec2 balance;
        measure_face(twice_area, balance, radius_sq);
        // A site that stays needs no face.
        balance = pinned ? vec2(0.0) : balance;
        bool security = pinned || twice_area > 0.0 && 4.0 * radius_sq <= secure * secure && radius_sq < bound * bound;
        if (!security) {
            uint place = atomicAdd(insecure[(FIRST ? 0u : iterations) + iteration], 1u);
            if (FIRST) insecure[list + place] = site;
        }
        vec3 middle = at + balance.x * u + balance.y * v;
        vec4 last = centroids[site];
        vec3 step = middle - at, motion = (middle - last.xyz) * last.w;
        // Against its motion a site starts anew.
        float share = security && dot(step, motion) > 0.0 ? momentum : 0.0;
        // An open face, as at the tip of an ear, has a centroid far out: its site goes with care, and without momentum.
        vec3 move = security ? step + share * motion : CAREFUL * step;
        float longest = security ? largest_move : CAREFUL * largest_move;
        move *= min(1.0, longest * inversesqrt(max(dot(move, move), 1e-30)));
        targets[site] = vec4(at + move, dot(step, step));
        if (!FIRST || security) centroids[site] = vec4(middle, security ? 1.0 : 0.0);
    }
}

#endif
