// Purpose: the face of each site by intervals as a polygon: the face of face/cell, found another way.
// Invocation: one site.
// Reads: sites, normals (packed), neighbours, boxes.
// Writes: corner_count, corners (in the frame of the tangent plane), fan (the site behind the edge that ends
//   in each corner), state: 0 for a closed face, then bits: 1 where it is open and bounded by the disc, 2
//   where it has more edges than corners are stored.
// Filled by neighbours/lists and box_levels, which must be of the sites where they are; consumed by
// bench/stages and the tests.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(constant_id = 1) const uint K = 24;

layout(push_constant) uniform Push {
    uvec4 starts_low;  // first box of levels 0 to 3
    uvec4 starts_high; // of levels 4 to 7
    uint levels;
    uint site_count;
    float widest; // no face reaches farther from its site
};
READ_VEC4(0, Sites, sites);
layout(set = 0, binding = 1) readonly buffer Normals { uint normals[]; };
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
READ_VEC4(3, Boxes, boxes);
layout(set = 0, binding = 4) writeonly buffer CornerCount { uint corner_count[]; };
layout(set = 0, binding = 5) writeonly buffer Corners { vec2 corners[]; };
layout(set = 0, binding = 6) writeonly buffer Fan { uint fan[]; };
layout(set = 0, binding = 7) writeonly buffer State { uint state[]; };

#include "face/planar_walk.glsl"

// Grows with the angle of a unit vector, from 0 to 4.
float around(vec2 n) { return n.y >= 0.0 ? 1.0 - n.x : 3.0 + n.x; }

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    start_face(site, widest);
    float last_sq = 0.0;
    for (uint s = 0u; s < K; ++s) {
        uint j = neighbours[s * site_count + site];
        cut_face(j, j != NONE);
        vec3 d = site_at(j == NONE ? site : j).xyz - site_place;
        last_sq = j == NONE ? 3e38 : dot(d, d);
    }
    // Sites that are not listed are no nearer than the last that is.
    if (4.0 * grown_radius_sq > last_sq) sum_near(2.00001 * sqrt(grown_radius_sq));
    uint count = 0u;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        // The place of an edge is the number of edges before it.
        float angle = around(slots[s].xy);
        uint place = 0u;
        [[unroll]] for (uint t = 0u; t < SLOTS; ++t) {
            float other = around(slots[t].xy);
            if (is_slot_edge(t) &&
                (other < angle || (other == angle && slot_site[t] < slot_site[s]))) ++place;
        }
        if (is_slot_edge(s)) {
            vec2 n = slots[s].xy;
            corners[place * site_count + site] = slots[s].z * n + slot_left[s].y * turned(n);
            fan[place * site_count + site] = slot_site[s];
            ++count;
        }
    }
    corner_count[site] = count;
    state[site] = (is_open() ? 1u : 0u) | (grown_full ? 2u : 0u);
}
