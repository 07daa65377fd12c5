// Purpose: the closest point of all triangles that face the same way as a projection found before, if it is nearer.
// Invocation: one site.
// Reads: targets, projected and normals (an earlier projection), records, corner_normals, order, nodes.
// Writes: projected, normals, site_triangle as project/walk does, where a nearer triangle was found.
// Filled by project/walk, project/join and the upload of the surface; consumed by step/step and face/*.
// The earlier projection bounds the search from above, so most searches look at few triangles.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/closest.glsl"
#include "common/hierarchy.glsl"

// Leaves that a search gathers before it looks at their triangles: lanes then do the same at the same time.
layout(constant_id = 3) const uint GATHERED = 8;

layout(push_constant) uniform Push {
    uint site_count;
    uint triangle_count;
    uint node_count;
};
layout(set = 0, binding = 0) readonly buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 1) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 2) readonly buffer Records { uvec4 records[]; };
layout(set = 0, binding = 3) readonly buffer CornerNormals { uvec4 corner_normals[]; };
layout(set = 0, binding = 4) readonly buffer Nodes { uvec4 nodes[]; };
layout(set = 0, binding = 5) buffer Projected { vec4 projected[]; };
layout(set = 0, binding = 6) buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 7) writeonly buffer SiteTriangle { uint site_triangle[]; };
#include "common/records.glsl"

shared uint gathered[GATHERED * WORKGROUP];

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    uint lane = gl_LocalInvocationID.x;
    vec3 at = targets[site].xyz;
    vec3 side = normals[site].xyz;
    vec3 before = projected[site].xyz - at;
    Closest best = Closest(before, dot(before, before), vec3(0.0), INSIDE);
    uint best_rank = NONE;
    uint node = 0u;
    while (node < node_count) {
        uint count = 0u;
        while (node < node_count && count < GATHERED) {
            uvec4 n = nodes[node];
            bool near = box_gap_sq(n.xyz, at) < best.sq;
            bool leaf = n.w >= LEAF_BIT;
            gathered[count * WORKGROUP + lane] = n.w & ~LEAF_BIT;
            count += near && leaf ? 1u : 0u;
            node = near || leaf ? node + 1u : n.w;
        }
        for (uint m = 0u; m < count * LEAF; ++m) {
            uint t = min(gathered[m / LEAF * WORKGROUP + lane] * LEAF + m % LEAF, triangle_count - 1u);
            vec3 a = uintBitsToFloat(records[3u * t].xyz);
            vec3 b = uintBitsToFloat(records[3u * t + 1u].xyz);
            vec3 c = uintBitsToFloat(records[3u * t + 2u].xyz);
            bool agrees = dot(unpack_normal(corner_normals[t].w), side) > 0.0;
            Closest here = closest_on_triangle(at, a, b, c);
            if (agrees && here.sq < best.sq * NEARER) {
                best = here;
                best_rank = t;
            }
        }
    }
    if (best_rank == NONE) return;
    projected[site] = vec4(at + best.offset, sqrt(best.sq));
    normals[site] = vec4(surface_normal(best_rank, best.weights), 0.0);
    site_triangle[site] = order[best_rank];
}
