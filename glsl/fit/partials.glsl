// Sums over a workgroup in a fixed order. Include after common/threads.glsl.
#ifndef FIT_PARTIALS_GLSL
#define FIT_PARTIALS_GLSL

shared float parts[WORKGROUP];

// The sum of all invocations' values, for the first one; all of them must get here. Halves are added while
// there are more than one, the odd one in the middle alone.
float workgroup_sum(float value) {
    uint lane = gl_LocalInvocationID.x;
    parts[lane] = value;
    barrier();
    uint left = WORKGROUP;
    while (left > 1u) {
        uint half_up = (left + 1u) / 2u;
        if (lane + half_up < left) parts[lane] += parts[lane + half_up];
        left = half_up;
        barrier();
    }
    return parts[0];
}

#endif
