// Purpose: normals and areas of the vertices, and their positions as a surface to walk on.
// Invocation: one vertex.
// Reads: positions, corners, twins, firsts, states.
// Writes: frames (unit normal, 0 if the vertex does not move; w = a third of the area around it), sides (the
// same normals), wedges.
// Filled by the upload of the mesh and polish/*; consumed by project/walk and fit/*.
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
layout(set = 0, binding = 5) writeonly buffer Frames { vec4 frames[]; };
layout(set = 0, binding = 6) writeonly buffer Wedges { uvec4 wedges[]; };
layout(set = 0, binding = 7) writeonly buffer Sides { vec4 sides[]; };

void main() {
    uint v = thread_index();
    if (v >= vertex_count) return;
    vec3 here = AT(positions, v).xyz, normal = vec3(0.0);
    float doubled = 0.0;
    uint h = firsts[v], state = states[v];
    if (h != NONE) {
        uint left = state & ~FIXED;
        vec3 p = AT(positions, corners[next_half_edge(h)]).xyz - here;
        for (; left > 0u && h != NONE; --left) {
            uint before = previous_half_edge(h);
            vec3 q = AT(positions, corners[before]).xyz - here;
            vec3 n = cross(p, q);
            normal += n;
            doubled += length(n);
            p = q;
            h = twins[before];
        }
    }
    float len = length(normal);
    bool moves = (state & FIXED) == 0u && len > 0.0;
    normal = moves ? normal / len : vec3(0.0);
    frames[v] = vec4(normal, doubled / 6.0);
    sides[v] = vec4(normal, 0.0);
    wedges[v] = uvec4(floatBitsToUint(here), NO_NORMAL);
}
