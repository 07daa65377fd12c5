// Purpose: the cells: sums over the parts of each site, in the order of the triangles.
// Invocation: one site.
// Reads: keys and values, the pairs sorted by site; moments, energies; extra, what the host adds (vectors of
// two for each site: moment and area; energy).
// Writes: cells[site] = (integral of y - site, area); cell_energies[site].
// Filled by exact/pieces and spatial/radix_scatter; consumed by exact/aim and the host.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"

layout(push_constant) uniform Push {
    uint site_count;
    uint pair_count;
    uint from; // parts of a site that are summed already,
    uint until; // and those that are to be: some devices end long loops
    uint use_extra;
};
layout(set = 0, binding = 0) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 1) readonly buffer Values { uint values[]; };
READ_VEC4(2, Moments, moments);
layout(set = 0, binding = 3) readonly buffer Energies { float energies[]; };
READ_VEC4(4, Extra, extra);
layout(set = 0, binding = 5) buffer Cells { vec4 cells[]; };
layout(set = 0, binding = 6) buffer CellEnergies { float cell_energies[]; };

// Parts of one round.
const uint BATCH = 8u;

// The first entry whose key is not below the given one.
uint lower_bound(uint key) {
    uint low = 0u, high = pair_count;
    while (low < high) {
        uint half_way = (low + high) / 2u;
        bool below = keys[half_way] < key;
        low = below ? half_way + 1u : low;
        high = below ? high : half_way;
    }
    return low;
}

void main() {
    uint site = thread_index();
    if (site >= site_count) return;
    uint first = lower_bound(site), end = lower_bound(site + 1u);
    uint begin = min(first + from, end);
    end = min(end, first + until);
    bool adds = from == 0u && use_extra != 0u;
    vec4 cell = from == 0u ? (adds ? AT(extra, 2u * site) : vec4(0.0)) : cells[site];
    float energy = from == 0u ? (adds ? AT(extra, 2u * site + 1u).x : 0.0) : cell_energies[site];
    for (uint i = begin; i < end; i += BATCH) {
        [[unroll]] for (uint s = 0u; s < BATCH; ++s) {
            bool counts = i + s < end;
            uint pair = values[counts ? i + s : begin];
            cell += counts ? AT(moments, pair) : vec4(0.0);
            energy += counts ? energies[pair] : 0.0;
        }
    }
    cells[site] = cell;
    cell_energies[site] = energy;
}
