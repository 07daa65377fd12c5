// Purpose: the block of each vertex on the diagonal of the fit's equations, and its right-hand side: the
// parts of the vertex itself and of the centres of triangles.
// Invocation: one vertex.
// Reads: frames, firsts, twins, corner_samples, face_samples, areas.
// Writes: own (xx, yy, zz, yz; then zx, xy), right; 0 for vertices that do not move.
// Filled by fit/*_samples; consumed by fit/own_edges and the solver.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/half_edges.glsl"
#include "fit/shares.glsl"
#include "fit/symmetric.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_VEC4(0, Frames, frames);
layout(set = 0, binding = 1) readonly buffer Firsts { uint firsts[]; };
layout(set = 0, binding = 2) readonly buffer Twins { uint twins[]; };
READ_VEC4(3, CornerSamples, corner_samples);
READ_VEC4(4, FaceSamples, face_samples);
layout(set = 0, binding = 5) readonly buffer Areas { float areas[]; };
layout(set = 0, binding = 6) writeonly buffer Own { vec4 own[]; };
layout(set = 0, binding = 7) writeonly buffer Right { vec4 right[]; };

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec4 frame = AT(frames, v);
    Symmetric m = Symmetric(vec3(0.0), vec3(0.0));
    vec3 r = vec3(0.0);
    uint first = firsts[v];
    if (frame.xyz != vec3(0.0) && first != NONE) {
        vec4 corner = AT(corner_samples, v);
        m.on = vec3(STIFFNESS * frame.w);
        add_outer(m, corner.xyz, 1.0);
        r = corner.w * corner.xyz;
        for (uint h = first; h != NONE;) {
            uint t = h / 3u;
            vec4 centre = AT(face_samples, t);
            m.on += 2.0 * COUPLING * areas[t];
            add_outer(m, centre.xyz, 1.0 / 9.0);
            r += centre.w / 3.0 * centre.xyz;
            h = twins[previous_half_edge(h)];
            h = h == first ? NONE : h;
        }
    }
    own[2u * v] = vec4(m.on, m.off.x);
    own[2u * v + 1u] = vec4(m.off.yz, 0.0, 0.0);
    right[v] = vec4(r, 0.0);
}
