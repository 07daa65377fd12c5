// Purpose: the pairs of triangles of a mesh that may intersect: all that do, and few others.
// Invocation: one triangle, with those after it.
// Reads: corners, wedges (positions), nodes.
// Writes: pairs, counters[0] (how many there are, also where the list is too short).
// Filled by project/leaves and project/join; consumed by the host, which decides by exact predicates.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DEFAULT_WORKGROUP 64
#include "common/threads.glsl"
#include "common/vectors.glsl"
#include "project/tree_walk.glsl"
#include "intersect/apart.glsl"

// Lowest nodes that a walk gathers before it looks at their triangles, so that lanes do the same work at the
// same time.
layout(constant_id = 1) const uint GATHERED = 8;
layout(push_constant) uniform Push {
    uint triangle_count;
    uint levels; // of the tree
    uint most; // pairs in the list
    float rounding; // by which a coordinate may be off
};
layout(set = 0, binding = 0) readonly buffer Corners { uint corners[]; };
READ_UVEC4(1, Wedges, wedges);
layout(set = 0, binding = 2) readonly buffer Nodes { uvec4 nodes[]; };
layout(set = 0, binding = 3) writeonly buffer Pairs { uvec2 pairs[]; };
layout(set = 0, binding = 4) buffer Counters { uint counters[]; };

// Lowest nodes by number, and below that a bit for each of their triangles that may be met.
shared uint gathered[GATHERED * WORKGROUP];

uvec3 corners_of(uint t) { return uvec3(corners[3u * t], corners[3u * t + 1u], corners[3u * t + 2u]); }

vec3 position(uint v) { return uintBitsToFloat(AT(wedges, v).xyz); }

// A bit for each box of the node that touches the one from `low` to `high`, in steps of the grid, and has
// triangles after the first `done`.
uint touched_boxes(TreeWalk walk, uvec3 low, uvec3 high, uint done) {
    Node node = Node(nodes[2u * walk.place], nodes[2u * walk.place + 1u]);
    uvec3 corner = node_corner(node), shift = node_shift(node);
    uint found = 0u;
    [[unroll]] for (uint box = 0u; box < WIDTH; ++box) {
        uvec3 box_low = corner + (node_low(node, box) << shift);
        uvec3 box_high = corner + (node_high(node, box) << shift);
        bool touches = all(lessThanEqual(box_low, high)) && all(lessThanEqual(low, box_high));
        bool is_after = (WIDTH * walk.number + box + 1u) << 2u * walk.level > done;
        found |= touches && is_after ? 1u << box : 0u;
    }
    return found & node_boxes(node);
}

void main() {
    uint s = thread_index();
    if (s >= triangle_count) return;
    uint lane = gl_LocalInvocationID.x;
    uvec3 own = corners_of(s);
    vec3 a = position(own.x), b = position(own.y), c = position(own.z);
    uvec3 low = grid_below(min(a, min(b, c))), high = grid_above(max(a, max(b, c)));
    TreeWalk walk = at_root(levels);
    bool more = true;
    while (more) {
        uint count = 0u;
        while (more && count < GATHERED) {
            uint found = touched_boxes(walk, low, high, s + 1u);
            gathered[count * WORKGROUP + lane] = walk.number << WIDTH | found;
            count += walk.level == 0u && found != 0u ? 1u : 0u;
            more = next_node(walk, found, levels);
        }
        uint slot = 0u, entry = count > 0u ? gathered[lane] : 0u;
        while (slot < count) {
            uint t = (entry >> WIDTH) * WIDTH + uint(findLSB(entry));
            uvec3 other = corners_of(t);
            vec3 there[3] = vec3[3](position(other.x), position(other.y), position(other.z));
            if (!are_apart(uvec3[2](own, other), vec3[2][3](vec3[3](a, b, c), there), rounding)) {
                uint place = atomicAdd(counters[0], 1u);
                if (place < most) pairs[place] = uvec2(s, t);
            }
            entry &= entry - 1u;
            if ((entry & 15u) == 0u) {
                ++slot;
                entry = slot < count ? gathered[slot * WORKGROUP + lane] : 1u;
            }
        }
    }
}
