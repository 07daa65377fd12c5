// Purpose: first half of an exclusive prefix scan: the sum of every run of RUN consecutive values.
// Invocation: one run. Runs are added one value after another, so no shared memory and no barrier is needed.
// Reads: values.
// Writes: sums[run], modulo 2^32.
// Filled by the kernels that count; consumed by the same kernel on the next level and by spatial/scan_apply.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "spatial/run.glsl"

layout(push_constant) uniform Push { uint value_count; };
layout(set = 0, binding = 0) readonly buffer Values { uint values[]; };
layout(set = 0, binding = 1) writeonly buffer Sums { uint sums[]; };

void main() {
    uint run = thread_index();
    if (run >= run_count(value_count)) return;
    uint sum = 0u;
    for (uint i = run * RUN; i < min(run * RUN + RUN, value_count); ++i) sum += values[i];
    sums[run] = sum;
}
