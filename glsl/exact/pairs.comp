// Purpose: one entry for each site that may have a part of a triangle, in the order of the triangles.
// Invocation: one triangle, or one entry that is not needed.
// Reads: starts, the scanned counts of exact/listed and walked; candidates.
// Writes: pair_triangle[entry], keys[entry] = site, values[entry] = entry; entries that are not needed get a
// key behind all sites.
// Filled by spatial/scan_apply; consumed by exact/pieces and spatial/radix_count.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"

// As in exact/exact_triangle.glsl.
layout(constant_id = 1) const uint PIECES = 12;

layout(push_constant) uniform Push {
    uint triangle_count;
    uint site_count;
    uint pair_count;
    uint capacity;
};
layout(set = 0, binding = 0) readonly buffer Starts { uint starts[]; };
layout(set = 0, binding = 1) readonly buffer Candidates { uint candidates[]; };
layout(set = 0, binding = 2) writeonly buffer PairTriangle { uint pair_triangle[]; };
layout(set = 0, binding = 3) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 4) writeonly buffer Values { uint values[]; };

void main() {
    uint thread = thread_index();
    uint begin = thread < triangle_count ? starts[thread] : 0u;
    uint end = thread < triangle_count ? min(starts[thread + 1u], capacity) : 0u;
    for (uint entry = begin; entry < end; ++entry) {
        pair_triangle[entry] = thread;
        keys[entry] = candidates[thread * (PIECES + 1u) + 1u + entry - begin];
        values[entry] = entry;
    }
    if (thread >= pair_count && thread < capacity) {
        keys[thread] = site_count;
        values[thread] = thread;
    }
}
