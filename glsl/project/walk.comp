// Purpose: moves every target to a closest point of the surface by walking over neighbouring triangles
// downhill.
// Invocation: one site.
// Reads: targets, site_triangle (where the walk starts), corners, twins, wedges, triangle_normals.
// Writes: projected (xyz on the surface, w = distance of the projection), normals (unit, w = 1 where the walk
// was stopped after max_steps triangles, otherwise 0), site_triangle.
// Filled by centroid/* and the upload of the surface; consumed by step/step, face/* and project/closest. The
// distance falls with every step, so a walk stays on its sheet and ends. Where it ends, no triangle across
// the side, or around the corner, that the point lies on is nearer.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "project/closest.glsl"

layout(push_constant) uniform Push {
    uint site_count;
    uint triangle_count;
    uint max_steps; // most triangles tested
};
READ_VEC4(0, Targets, targets);
layout(set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 2) readonly buffer Twins { uint twins[]; };
READ_UVEC4(3, Wedges, wedges);
layout(set = 0, binding = 4) readonly buffer TriangleNormals { uint triangle_normals[]; };
layout(set = 0, binding = 5) writeonly buffer Projected { vec4 projected[]; };
layout(set = 0, binding = 6) writeonly buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 7) buffer SiteTriangle { uint site_triangle[]; };
#include "project/records.glsl"

uint after(uint corner) { return corner == 2u ? 0u : corner + 1u; }

uint before(uint corner) { return corner == 0u ? 2u : corner - 1u; }

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec3 at = AT(targets, site).xyz;
    // The half-edge by which the next triangle is entered; for the first one it does not matter.
    uint half_edge = 3u * min(site_triangle[site], triangle_count - 1u);
    Closest best = Closest(vec3(0.0), 3.402823466e38, vec3(0.0), INSIDE);
    uint best_triangle = 0u;
    // While circling a corner: the direction, and the half-edge at which the other direction begins.
    bool circling = false, leftward = false;
    uint other_way = NONE;
    for (uint step = 0u; half_edge != NONE && step < max_steps; ++step) {
        uint t = half_edge / 3u, entry = half_edge - 3u * t;
        uvec3 at_corners = triangle_wedges(t);
        vec3 a = wedge_position(at_corners.x), b = wedge_position(at_corners.y);
        vec3 c = wedge_position(at_corners.z);
        Closest here = closest_on_triangle(at, a, b, c);
        if (here.sq < best.sq * NEARER) {
            best = here;
            best_triangle = t;
            circling = here.place >= ON_CORNER && here.place != INSIDE;
            uint corner = here.place - ON_CORNER;
            // The side that points more towards the target is the shorter way around the corner.
            vec3 p = corner == 0u ? a : corner == 1u ? b : c;
            vec3 to_next = (corner == 0u ? b : corner == 1u ? c : a) - p;
            vec3 to_last = (corner == 0u ? c : corner == 1u ? a : b) - p;
            leftward = dot(here.offset, to_last) * inversesqrt(dot(to_last, to_last)) <
                       dot(here.offset, to_next) * inversesqrt(dot(to_next, to_next));
            // The sides that the walk may leave by; where there is no corner or no side, any will do.
            uint near = circling ? corner : here.place < ON_CORNER ? here.place : 0u;
            uint outgoing = twins[3u * t + near], incoming = twins[3u * t + before(near)];
            other_way = leftward ? outgoing : incoming;
            half_edge = here.place == INSIDE ? NONE : circling && leftward ? incoming : outgoing;
        } else {
            // Twin half-edges are opposite, so going leftward the entered side begins at the corner,
            // otherwise it ends there.
            half_edge = circling ? twins[3u * t + (leftward ? before(entry) : after(entry))] : NONE;
            if (half_edge != NONE && half_edge / 3u == best_triangle) {
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
    normals[site] = vec4(surface_normal(best_triangle, best.weights), stopped ? 1.0 : 0.0);
    site_triangle[site] = best_triangle;
}
