// Purpose: second half of an exclusive prefix scan: replaces every value by the sum of those before it.
// Invocation: one run of RUN consecutive values.
// Reads: starts, the scanned sums of the runs (not read if there is only one run).
// Writes: values, in place.
// Filled by spatial/scan_sum and by the same kernel on the level above; consumed by spatial/radix_scatter.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "spatial/run.glsl"

layout(push_constant) uniform Push { uint value_count; };
layout(set = 0, binding = 0) buffer Values { uint values[]; };
layout(set = 0, binding = 1) readonly buffer Starts { uint starts[]; };

void main() {
    uint run = thread_index();
    if (run >= run_count(value_count)) return;
    // The sum of a single run stays what it is: the total.
    uint before = run == 0u ? 0u : starts[run];
    for (uint i = run * RUN; i < min(run * RUN + RUN, value_count); ++i) {
        uint value = values[i];
        values[i] = before;
        before += value;
    }
}
