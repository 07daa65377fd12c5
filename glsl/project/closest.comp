// Purpose: the closest point of all triangles that face the same way as a projection found before, if it is
// nearer.
// Invocation: one site.
// Reads: targets, projected and normals (an earlier projection), corners, wedges, triangle_normals,
// nodes.
// Writes: projected, normals, site_triangle as project/walk does, where a nearer triangle was found.
// Filled by project/walk, project/join and the upload of the surface; consumed by step/step and face/*.
// The earlier projection bounds the search from above, so most searches test few triangles.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "project/closest.glsl"
#include "project/tree_walk.glsl"

// Lowest nodes that a search gathers before it tests their triangles, so that lanes do the same work at the
// same time.
layout(constant_id = 1) const uint GATHERED = 8;

layout(push_constant) uniform Push {
    uint site_count;
    uint levels; // of the tree
    float least; // projections no farther than this are kept as they are
};
READ_VEC4(0, Targets, targets);
layout(set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
READ_UVEC4(2, Wedges, wedges);
layout(set = 0, binding = 3) readonly buffer TriangleNormals { uint triangle_normals[]; };
layout(set = 0, binding = 4) readonly buffer Nodes { uvec4 nodes[]; };
layout(set = 0, binding = 5) buffer Projected { vec4 projected[]; };
layout(set = 0, binding = 6) buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 7) writeonly buffer SiteTriangle { uint site_triangle[]; };
#include "project/records.glsl"

// Lowest nodes by number, and below that a bit for each of their triangles within reach.
shared uint gathered[GATHERED * WORKGROUP];

// A bit for each box of the node that is nearer than the root of reach_sq; both lengths in steps of the grid.
uint boxes_within(uint place, vec3 at, float reach_sq) {
    Node node = Node(nodes[2u * place], nodes[2u * place + 1u]);
    uvec3 corner = node_corner(node), shift = node_shift(node);
    uint found = 0u;
    [[unroll]] for (uint box = 0u; box < WIDTH; ++box) {
        vec3 low = vec3(corner + (node_low(node, box) << shift));
        vec3 high = vec3(corner + (node_high(node, box) << shift));
        vec3 gap = max(max(low - at, at - high), vec3(0.0));
        // A little less than the true distance: rounding must not hide a triangle.
        found |= 0.9999 * dot(gap, gap) < reach_sq ? 1u << box : 0u;
    }
    return found & node_boxes(node);
}

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    uint lane = gl_LocalInvocationID.x;
    vec3 at = AT(targets, site).xyz;
    vec3 side = normals[site].xyz;
    if (projected[site].w <= least) return;
    vec3 before = projected[site].xyz - at;
    Closest best = Closest(before, dot(before, before), vec3(0.0), INSIDE);
    uint best_triangle = NONE;
    TreeWalk walk = at_root(levels);
    bool more = true;
    vec3 at_grid = to_grid(at);
    while (more) {
        uint count = 0u;
        float reach_sq = best.sq / (GRID_STEP * GRID_STEP);
        while (more && count < GATHERED) {
            uint found = boxes_within(walk.place, at_grid, reach_sq);
            gathered[count * WORKGROUP + lane] = walk.number << WIDTH | found;
            count += walk.level == 0u && found != 0u ? 1u : 0u;
            more = next_node(walk, found, levels);
        }
        uint slot = 0u, entry = count > 0u ? gathered[lane] : 0u;
        while (slot < count) {
            uint t = (entry >> WIDTH) * WIDTH + uint(findLSB(entry));
            uvec3 at_corners = triangle_wedges(t);
            vec3 a = wedge_position(at_corners.x), b = wedge_position(at_corners.y);
            vec3 c = wedge_position(at_corners.z);
            bool agrees = dot(unpack_normal(triangle_normals[t]), side) > 0.0;
            Closest here = closest_on_triangle(at, a, b, c);
            if (agrees && here.sq < best.sq * NEARER) {
                best = here;
                best_triangle = t;
            }
            entry &= entry - 1u;
            if ((entry & 15u) == 0u) {
                ++slot;
                entry = slot < count ? gathered[slot * WORKGROUP + lane] : 1u;
            }
        }
    }
    if (best_triangle == NONE) return;
    projected[site] = vec4(at + best.offset, sqrt(best.sq));
    normals[site] = vec4(surface_normal(best_triangle, best.weights), normals[site].w);
    site_triangle[site] = best_triangle;
}
