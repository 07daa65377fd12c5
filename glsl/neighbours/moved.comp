// Purpose: how far the sites have moved since their lists were made.
// Invocation: one site.
// Reads: sites, list_sites, reach.
// Writes: away[site], the reach less that distance; status[0], the largest moved / reach so far, as the bits
// of a float: those of floats that are not negative compare like the floats, so the maximum does not depend
// on the order.
// Filled by neighbours/lists and the step; consumed by neighbours/decide and the faces.
#version 450
#extension GL_GOOGLE_include_directive : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "common/list_bounds.glsl"

layout(push_constant) uniform Push { uint site_count; };
READ_VEC4(0, Sites, sites);
READ_VEC4(1, ListSites, list_sites);
READ_VEC2(2, Reach, reach);
layout(set = 0, binding = 3) writeonly buffer Away { vec2 away[]; };
layout(set = 0, binding = 4) buffer Status { uint status[]; };

#include "common/sites.glsl"

shared uint group_rho;

void main() {
    uint site = thread_index();
    if (gl_LocalInvocationID.x == 0u) group_rho = 0u;
    barrier();
    if (site < site_count) {
        float far = distance(site_at(site).xyz, SITE_AT(list_sites, site).xyz);
        vec2 own = AT2(reach, site);
        away[site] = own - far;
        float rho = 0.0;
        // A site whose list is all at its own point has no reach: any move is too far.
        if (far > 0.0) rho = own.y > 0.0 ? far / own.y : ENDLESS;
        atomicMax(group_rho, floatBitsToUint(rho));
    }
    barrier();
    if (gl_LocalInvocationID.x == 0u) atomicMax(status[0], group_rho);
}
