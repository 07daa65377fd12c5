// Purpose: keeps the targets of interior sites off curves.
// Invocation: one site of a block.
// Reads: sites (with the marks of common/pins.glsl), normals (packed), neighbours, lengths (only where sizes
// vary).
// Writes: targets (xyz, w = squared distance to the site, in target lengths there) where they are too near to
// a curve.
// Filled by face/planar; consumed by project/walk. Only for surfaces with curves. A site inside the diametral
// circle of two curve sites has a face that reaches across the curve, where no site bounds it. Its centroid
// is beyond the curve, and the site would move there and stay. Near each curve site the curve is approximated
// by a line as far as the next curve sites; sites stay away from it by nearly half that distance.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/octahedral.glsl"

// Nearest neighbours that are tested.
layout(constant_id = 1) const uint NEAR = 12;
// 1 where sizes vary: lengths has the target edge length at each site, relative to the spacing.
layout(constant_id = 2) const uint SIZED = 0;
#include "common/pins.glsl"

layout(push_constant) uniform Push {
    uint first; // of the block's sites
    uint block_sites;
    float spacing;
};
READ_VEC4(0, Sites, sites);
layout(set = 0, binding = 1) readonly buffer Normals { uint normals[]; };
layout(set = 0, binding = 2) readonly buffer Neighbours { uint neighbours[]; };
layout(set = 0, binding = 3) buffer Targets { vec4 targets[]; };
layout(set = 0, binding = 4) readonly buffer Lengths { float lengths[]; };

#include "common/blocks.glsl"

// Least distance from a line, as a share of how far the curve continues.
const float LEAST = 0.45;

void main() {
    uint site = block_site(thread_index());
    if (!in_block(site)) return;
    vec4 own = AT(sites, site);
    vec3 n = unpack_normal(normals[site]);
    vec3 to = targets[block_place(0u, site)].xyz;
    // Opposite curves push in opposite directions, and the site ends up in the middle.
    vec3 push = vec3(0.0);
    [[unroll]] for (uint s = 0u; s < NEAR; ++s) {
        uint j = neighbours[block_place(s, site)];
        uint known = j == NONE ? site : j;
        vec4 other = AT(sites, known);
        bool faces = counts_anywhere(other.w) || dot(n, unpack_normal(normals[known])) > -0.2;
        vec3 direction = pin_direction(other.w), off = to - other.xyz;
        float along = dot(off, direction);
        float reach = pin_reach(other.w) * spacing * (SIZED != 0u ? lengths[known] : 1.0);
        // In the tangent plane, and on the side where the site is now.
        vec3 now = own.xyz - other.xyz;
        vec3 away = now - dot(now, direction) * direction;
        away -= dot(away, n) * n;
        float size = length(away);
        away /= max(size, 1e-20);
        float missing = LEAST * reach - dot(off, away);
        bool near = is_pinned(other.w) && faces && reach > 0.0 && abs(along) <= reach && missing > 0.0 &&
                    size > 1e-5 * spacing;
        // Several sites of one curve push in the same direction; only what is missing is added.
        push += near ? max(missing - dot(push, away), 0.0) * away : vec3(0.0);
    }
    bool moves = !is_pinned(own.w) && dot(push, push) > 0.0;
    vec3 kept = to + push, step = kept - own.xyz;
    float wanted = SIZED != 0u ? lengths[site] : 1.0;
    if (moves) targets[block_place(0u, site)] = vec4(kept, dot(step, step) / (wanted * wanted));
}
