// The index of an invocation. A kernel defines DEFAULT_WORKGROUP before including this.
#ifndef COMMON_THREADS_GLSL
#define COMMON_THREADS_GLSL

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint WORKGROUP = DEFAULT_WORKGROUP;

// Workgroups are folded into y where a device limits x.
uint group_index() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }

// Past the end for the last invocations: a kernel must compare it with its count.
uint thread_index() { return group_index() * WORKGROUP + gl_LocalInvocationID.x; }

// No site, no neighbour.
const uint NONE = 0xffffffffu;

#endif
