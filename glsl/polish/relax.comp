// Purpose: where each vertex goes next: towards the mean of its neighbours, in its tangent plane.
// Invocation: one vertex.
// Reads: positions (w = target edge length there), corners, twins, firsts, states.
// Writes: targets; normals, unit, in octahedral form, or NO_NORMAL.
// Filled by the upload of the mesh and polish/*; consumed by project/walk and polish/land. As
// src/polish/relax.rs.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/half_edges.glsl"
#include "polish/normals.glsl"

layout(push_constant) uniform Push { uint vertex_count; };
READ_VEC4(0, Positions, positions);
layout(set = 0, binding = 1) readonly buffer Corners { uint corners[]; };
layout(set = 0, binding = 2) readonly buffer Twins { uint twins[]; };
layout(set = 0, binding = 3) readonly buffer Firsts { uint firsts[]; };
layout(set = 0, binding = 4) readonly buffer States { uint states[]; };
layout(set = 0, binding = 5) writeonly buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 6) writeonly buffer Normals { uint normals[]; };

// Step towards the mean of the neighbours, as a share of the distance. Above 1, since neighbours move in
// similar directions; on a regular mesh the limit of stability is 4/3.
const float STRIDE = 1.1;

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec4 here = AT(positions, v);
    uint h = firsts[v], state = states[v];
    vec3 sum = vec3(0.0), normal = vec3(0.0);
    float weights = 0.0;
    if (h != NONE) {
        uint left = state & ~FIXED;
        vec4 p = AT(positions, corners[next_half_edge(h)]);
        for (; left > 0u && h != NONE; --left) {
            uint before = previous_half_edge(h);
            vec4 q = AT(positions, corners[before]);
            vec3 to_p = p.xyz - here.xyz;
            normal += cross(to_p, q.xyz - here.xyz);
            // A neighbour has less weight if the edge to it is to be longer, so that a vertex whose edges
            // have their target lengths is at rest.
            float weight = 2.0 * here.w / (here.w + p.w);
            sum += weight * to_p;
            weights += weight;
            p = q;
            h = twins[before];
        }
    }
    float len = length(normal);
    bool has_normal = len > 0.0;
    normal = has_normal ? normal / len : vec3(0.0);
    vec3 to_mean = weights > 0.0 ? sum / weights : vec3(0.0);
    bool moves = has_normal && (state & FIXED) == 0u;
    vec3 step = moves ? STRIDE * (to_mean - dot(to_mean, normal) * normal) : vec3(0.0);
    targets[v] = vec4(here.xyz + step, 0.0);
    normals[v] = has_normal ? pack_normal(normal) : NO_NORMAL;
}
