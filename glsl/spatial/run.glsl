// Runs of consecutive values that one invocation of a scan walks along; src/stages/sort.rs has the same
// length.
#ifndef SPATIAL_RUN_GLSL
#define SPATIAL_RUN_GLSL

const uint RUN = 32u;

uint run_count(uint values) { return (values + RUN - 1u) / RUN; }

#endif
