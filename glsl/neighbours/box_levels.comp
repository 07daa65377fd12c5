// Purpose: one level of the implicit hierarchy of bounding boxes over sites in Morton order: a box over every
// eight consecutive sites, one over every eight consecutive boxes of those, and so on.
// Invocation: one box.
// Reads: sites (for the lowest level), boxes of the level below (for the others).
// Writes: boxes[2 * (target + box)] (lower corner) and the next (upper corner), w = 0. Boxes from box_end on
// are empty: levels are padded to a multiple of eight, and an empty box is infinitely far from everything.
// Filled by the step; consumed by neighbours/lists.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 32
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint site_end; // the number of sites for the lowest level, 0 for the others
    uint source;   // first box of the level below
    uint target;   // first box of this level
    uint box_end;  // boxes that are not empty
    uint padded;   // all boxes of the level
};
READ_VEC4(0, Sites, sites);
layout(set = 0, binding = 1) buffer Boxes { vec4 boxes[]; };
#include "common/sites.glsl"

void main() {
    uint box = thread_index();
    if (box >= padded) return;
    vec3 low = vec3(3e38), high = vec3(-3e38);
    // One of the two loops is empty; some devices would run both sides of a branch.
    uint child_end = site_end == 0u && box < box_end ? 8u : 0u;
    for (uint s = 8u * box; s < min(8u * box + 8u, site_end); ++s) {
        vec3 at = site_at(s).xyz;
        low = min(low, at);
        high = max(high, at);
    }
    for (uint c = 0u; c < child_end; ++c) {
        uint child = 2u * (source + 8u * box + c);
        low = min(low, boxes[child].xyz);
        high = max(high, boxes[child + 1u].xyz);
    }
    boxes[2u * (target + box)] = vec4(low, 0.0);
    boxes[2u * (target + box) + 1u] = vec4(high, 0.0);
}
