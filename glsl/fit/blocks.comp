// Purpose: the block beside the diagonal of each edge: the parts of its middle and of its triangles.
// Invocation: one edge.
// Reads: edges, twins, edge_samples, face_samples, areas.
// Writes: block_heads (xx, yy, zz, yz), block_tails (zx, xy).
// Filled by fit/face_samples and fit/faces; consumed by fit/blocks_inward and fit/apply.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "fit/shares.glsl"
#include "fit/symmetric.glsl"

layout(push_constant) uniform Push { uint edge_count; };
layout(set = 0, binding = 0) readonly buffer Edges { uint edges[]; };
layout(set = 0, binding = 1) readonly buffer Twins { uint twins[]; };
READ_VEC4(2, EdgeSamples, edge_samples);
READ_VEC4(3, FaceSamples, face_samples);
layout(set = 0, binding = 4) readonly buffer Areas { float areas[]; };
layout(set = 0, binding = 5) writeonly buffer BlockHeads { vec4 block_heads[]; };
layout(set = 0, binding = 6) writeonly buffer BlockTails { vec2 block_tails[]; };

void main() {
    uint e = thread_index();
    if (e >= edge_count) return;
    uint h = edges[e], twin = twins[h];
    Symmetric m = Symmetric(vec3(-COUPLING * areas[h / 3u]), vec3(0.0));
    add_outer(m, AT(edge_samples, e).xyz, 0.25);
    add_outer(m, AT(face_samples, h / 3u).xyz, 1.0 / 9.0);
    if (twin != NONE) {
        m.on -= COUPLING * areas[twin / 3u];
        add_outer(m, AT(face_samples, twin / 3u).xyz, 1.0 / 9.0);
    }
    block_heads[e] = vec4(m.on, m.off.x);
    block_tails[e] = m.off.yz;
}
