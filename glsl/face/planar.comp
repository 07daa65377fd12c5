// Purpose: the face of each site by intervals, its area centroid, and the target that momentum makes of it.
// Invocation: one site.
// Reads: sites, normals (packed), neighbours, away, status (of neighbours/decide).
// Writes: targets (xyz, w = squared distance to the centroid), centroids (w = 1); insecure: a counter an iteration for
//   each round, then the sites whose lines do not reach the radius of security.
// Filled by neighbours/lists, step/settle and normals/smooth; consumed by project/walk and the next iteration.
// away has, for each site, how near the sites after the first K (x) and outside the list (y) would be had they not
// moved. The nearest K are enough nearly everywhere; face/planar_rest does the rest.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"

layout(constant_id = 1) const uint K = 16;
// 1 where sites bear the marks of common/pins.glsl.
layout(constant_id = 2) const uint CURVES = 0;

#define LOOP [[unroll]]
const bool FIRST = true;
#include "common/planar_targets.glsl"
