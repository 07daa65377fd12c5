// Purpose: the bounding box of every tile of TILE consecutive points.
// Invocation: one tile.
// Reads: points.
// Writes: bounds[2 * tile] (lower corner) and bounds[2 * tile + 1] (upper corner), w = 0.
// Filled by the upload or the step; consumed by neighbours/knn and face/cell.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 16
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/tiles.glsl"

layout(push_constant) uniform Push { uint point_count; };
READ_VEC4(0, Points, points);
layout(set = 0, binding = 1) writeonly buffer Bounds { vec4 bounds[]; };

void main() {
    uint tile = thread_index();
    if (tile >= tile_count(point_count)) return;
    uint start = tile * TILE;
    uint end = min(start + TILE, point_count);
    vec3 low = AT(points, start).xyz, high = low;
    for (uint p = start + 1u; p < end; ++p) {
        vec3 x = AT(points, p).xyz;
        low = min(low, x);
        high = max(high, x);
    }
    bounds[2u * tile] = vec4(low, 0.0);
    bounds[2u * tile + 1u] = vec4(high, 0.0);
}
