// Purpose: the face of each site by intervals as a polygon: the face of face/cell, found another way.
// Invocation: one site.
// Reads: sites, normals (packed), neighbours, reach.
// Writes: corner_count, corners (in the frame of the tangent plane), fan (the site behind the edge that ends in each
//   corner), secure (1 where no site outside the list can cut the face).
// Filled by neighbours/lists; consumed by bench/stages and the tests.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"

layout(constant_id = 1) const uint K = 24;
const uint CURVES = 0u;

#define LOOP [[unroll]]

layout(push_constant) uniform Push {
    uint site_count;
    float widest; // no face reaches farther from its site
};
layout(set = 0, binding = 0) readonly buffer Sites { vec4 sites[]; };
layout(set = 0, binding = 1) readonly buffer Normals { uint normals[]; };
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 3) readonly buffer Reach { vec2 reach[]; };
layout(set = 0, binding = 4) writeonly buffer CornerCount { uint corner_count[]; };
layout(set = 0, binding = 5) writeonly buffer Corners { vec2 corners[]; };
layout(set = 0, binding = 6) writeonly buffer Fan { uint fan[]; };
layout(set = 0, binding = 7) writeonly buffer Secure { uint secure[]; };

#include "common/planar.glsl"

// Grows with the angle of a unit vector, from 0 to 4.
float around(vec2 n) { return n.y >= 0.0 ? 1.0 - n.x : 3.0 + n.x; }

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    vec3 n = unpack_normal(normals[site]);
    vec3 u, v;
    tangent_frame(n, u, v);
    load_lines(site, site_count, sites[site], n, u, v);
    float bound = min(reach[site].y, widest);
    cut_lines(bound);
    float twice_area, radius_sq;
    vec2 balance;
    measure_face(twice_area, balance, radius_sq);
    uint count = 0u;
    [[unroll]] for (uint s = 0u; s < K; ++s) {
        // The place of an edge is the number of edges before it.
        float angle = around(line_normal[s]);
        uint place = 0u;
        [[unroll]] for (uint t = 0u; t < K; ++t) {
            float other = around(line_normal[t]);
            if (is_edge(t) && (other < angle || (other == angle && t < s))) ++place;
        }
        if (is_edge(s)) {
            corners[place * site_count + site] = edge_end(s);
            fan[place * site_count + site] = neighbours[s * site_count + site];
            ++count;
        }
    }
    corner_count[site] = count;
    secure[site] = count > 2u && 4.0 * radius_sq <= reach[site].y * reach[site].y && radius_sq < bound * bound ? 1u : 0u;
}
