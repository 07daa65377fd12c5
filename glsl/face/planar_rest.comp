// Purpose: face/planar for the sites that it leaves undecided, by their whole lists: faces, centroids, targets.
// Invocation: every so many entries of the list of undecided sites.
// Reads: sites, normals (packed), neighbours, away, status (of neighbours/decide).
// Writes: targets (xyz, w = squared distance to the centroid), centroids (w = 1); insecure: a counter an iteration for
//   each round, then the sites whose lines do not reach the radius of security.
// Filled by neighbours/lists, step/settle and normals/smooth; consumed by project/walk and the next iteration.
// What even the lists leave open is bounded by a disc. Few sites come here: short code is worth more than registers.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 8
#include "common/threads.glsl"

layout(constant_id = 1) const uint K = 24;
// 1 where sites bear the marks of common/pins.glsl.
layout(constant_id = 2) const uint CURVES = 0;

#define LOOP [[dont_unroll]]
const bool FIRST = false;
#include "common/planar_targets.glsl"
