// Purpose: moves every target to a closest point of the surface by walking over neighbouring triangles
// downhill.
// Invocation: one site.
// Reads: targets, site_triangle (where the walk starts), rank, order, records, corner_normals.
// Writes: projected (xyz on the surface, w = distance of the projection), normals (unit, w = 1 where the walk
// was stopped after max_steps triangles, otherwise 0), site_triangle.
// Filled by centroid/* and the upload of the surface; consumed by step/step, face/* and project/closest. The
// distance falls with every step, so a walk stays on its sheet and ends. Where it ends, no triangle across
// the side, or around the corner, that the point lies on is nearer.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "project/closest.glsl"

layout(push_constant) uniform Push {
    uint site_count;
    uint triangle_count;
    uint max_steps; // most triangles tested
};
layout(set = 0, binding = 0) readonly buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 1) readonly buffer Rank { uint rank[]; };
layout(set = 0, binding = 2) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 3) readonly buffer Records { uvec4 records[]; };
layout(set = 0, binding = 4) readonly buffer CornerNormals { uvec4 corner_normals[]; };
layout(set = 0, binding = 5) writeonly buffer Projected { vec4 projected[]; };
layout(set = 0, binding = 6) writeonly buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 7) buffer SiteTriangle { uint site_triangle[]; };
#include "project/records.glsl"

uint pick(uvec3 twins, uint side) { return side == 0u ? twins.x : side == 1u ? twins.y : twins.z; }

uint after(uint corner) { return corner == 2u ? 0u : corner + 1u; }

uint before(uint corner) { return corner == 0u ? 2u : corner - 1u; }

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec3 at = targets[site].xyz;
    // The half-edge by which the next triangle is entered; for the first one it does not matter.
    uint half_edge = 3u * rank[min(site_triangle[site], triangle_count - 1u)];
    Closest best = Closest(vec3(0.0), 3.402823466e38, vec3(0.0), INSIDE);
    uint best_rank = 0u;
    // While circling a corner: the direction, and the half-edge at which the other direction begins.
    bool circling = false, leftward = false;
    uint other_way = NONE;
    for (uint step = 0u; half_edge != NONE && step < max_steps; ++step) {
        uint t = half_edge / 3u, entry = half_edge - 3u * t;
        uvec4 ra = records[3u * t], rb = records[3u * t + 1u], rc = records[3u * t + 2u];
        vec3 a = uintBitsToFloat(ra.xyz), b = uintBitsToFloat(rb.xyz), c = uintBitsToFloat(rc.xyz);
        uvec3 twins = uvec3(ra.w, rb.w, rc.w);
        Closest here = closest_on_triangle(at, a, b, c);
        if (here.sq < best.sq * NEARER) {
            best = here;
            best_rank = t;
            circling = here.place >= ON_CORNER && here.place != INSIDE;
            uint corner = here.place - ON_CORNER;
            // The side that points more towards the target is the shorter way around the corner.
            vec3 p = corner == 0u ? a : corner == 1u ? b : c;
            vec3 to_next = (corner == 0u ? b : corner == 1u ? c : a) - p;
            vec3 to_last = (corner == 0u ? c : corner == 1u ? a : b) - p;
            leftward = dot(here.offset, to_last) * inversesqrt(dot(to_last, to_last)) <
                       dot(here.offset, to_next) * inversesqrt(dot(to_next, to_next));
            uint outgoing = pick(twins, corner), incoming = pick(twins, before(corner));
            other_way = leftward ? outgoing : incoming;
            half_edge = here.place == INSIDE ? NONE
                        : !circling          ? pick(twins, here.place)
                        : leftward           ? incoming
                                             : outgoing;
        } else {
            // Twin half-edges are opposite, so going leftward the entered side begins at the corner,
            // otherwise it ends there.
            half_edge = circling ? pick(twins, leftward ? before(entry) : after(entry)) : NONE;
            if (half_edge != NONE && half_edge / 3u == best_rank) {
                half_edge = NONE;
                circling = false;
            }
        }
        if (circling && half_edge == NONE) {
            half_edge = other_way;
            other_way = NONE;
            leftward = !leftward;
        }
    }
    projected[site] = vec4(at + best.offset, sqrt(best.sq));
    bool stopped = half_edge != NONE;
    normals[site] = vec4(surface_normal(best_rank, best.weights), stopped ? 1.0 : 0.0);
    site_triangle[site] = order[best_rank];
}
