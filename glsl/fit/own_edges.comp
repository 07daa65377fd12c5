// Purpose: adds the middles of edges to the diagonal and the right-hand side.
// Invocation: one vertex.
// Reads: starts and links (neighbour and edge, for each edge at the vertex), edge_samples.
// Writes: own, right.
// Filled by fit/own and fit/face_samples; consumed by fit/own_inward and the solver.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "fit/symmetric.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
layout(set = 0, binding = 0) readonly buffer Starts { uint starts[]; };
READ_UVEC2(1, Links, links);
READ_VEC4(2, EdgeSamples, edge_samples);
layout(set = 0, binding = 3) buffer Own { vec4 own[]; };
layout(set = 0, binding = 4) buffer Right { vec4 right[]; };

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec4 head = own[2u * v], tail = own[2u * v + 1u];
    // A vertex that does not move has no equation.
    if (head.x == 0.0) return;
    Symmetric m = Symmetric(head.xyz, vec3(head.w, tail.xy));
    vec3 r = right[v].xyz;
    uint end = starts[v + 1u];
    for (uint i = starts[v]; i < end; ++i) {
        vec4 middle = AT(edge_samples, AT2(links, i).y);
        add_outer(m, middle.xyz, 0.25);
        r += 0.5 * middle.w * middle.xyz;
    }
    own[2u * v] = vec4(m.on, m.off.x);
    own[2u * v + 1u] = vec4(m.off.yz, 0.0, 0.0);
    right[v] = vec4(r, 0.0);
}
