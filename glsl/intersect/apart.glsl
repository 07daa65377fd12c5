// A plane between two triangles of a mesh, sought in single precision.
#ifndef INTERSECT_APART_GLSL
#define INTERSECT_APART_GLSL

// Bound of the relative rounding of a scalar product of differences.
const float RELATIVE = 1.0 / 1048576.0;

bvec3 shared_with(uvec3 one, uvec3 other) {
    return bvec3(any(equal(uvec3(one.x), other)), any(equal(uvec3(one.y), other)),
                 any(equal(uvec3(one.z), other)));
}

vec3 unit_or_zero(vec3 x) {
    float len = length(x);
    return len > 0.0 ? x / len : vec3(0.0);
}

// The direction from the corners that both triangles have to the others of one of them.
vec3 away(vec3 corners[3], bvec3 joint, vec3 edge) {
    vec3 sum = vec3(0.0);
    [[unroll]] for (uint k = 0u; k < 3u; ++k) {
        vec3 across = corners[k] - dot(corners[k], edge) * edge;
        sum += joint[k] ? vec3(0.0) : unit_or_zero(across);
    }
    return unit_or_zero(sum);
}

// Whether a plane has the corners of two triangles that are not those of both on different sides, and common
// ones in it, so that they meet nowhere else; `indices` and `corners` of both. No coordinate is off by more
// than `rounding`. False if there may be no such plane.
bool are_apart(uvec3 indices[2], vec3 corners[2][3], float rounding) {
    bvec3 joint[2] = bvec3[2](shared_with(indices[0], indices[1]), shared_with(indices[1], indices[0]));
    bool meet = any(joint[0]);
    // A common corner, and the edge from it to another one.
    vec3 origin = joint[0].y ? corners[0][1] : joint[0].z ? corners[0][2] : corners[0][0];
    origin = joint[0].x ? corners[0][0] : origin;
    vec3 edge = vec3(0.0);
    float reach = 0.0;
    [[unroll]] for (uint i = 0u; i < 2u; ++i) {
        [[unroll]] for (uint k = 0u; k < 3u; ++k) {
            corners[i][k] -= origin;
            reach = max(reach, length(corners[i][k]));
        }
    }
    [[unroll]] for (uint k = 0u; k < 3u; ++k)
        edge = joint[0][k] && corners[0][k] != vec3(0.0) ? corners[0][k] : edge;
    float edge_length = length(edge);
    bool have_edge = edge_length > 0.0;
    vec3 along = have_edge ? edge / edge_length : vec3(0.0);
    vec3 normal = away(corners[1], joint[1], along) - away(corners[0], joint[0], along);
    vec3 sums[2];
    [[unroll]] for (uint i = 0u; i < 2u; ++i) sums[i] = corners[i][0] + corners[i][1] + corners[i][2];
    normal = unit_or_zero(meet ? normal : sums[1] - sums[0]);
    // How far a corner may be on the other side of a plane that has all of a common edge in it.
    float ratio = have_edge ? reach / edge_length : 0.0;
    float off = (4.0 * rounding + RELATIVE * reach) * (1.0 + ratio) + abs(dot(normal, edge)) * ratio;
    float below = -1e30, above = 1e30;
    [[unroll]] for (uint k = 0u; k < 3u; ++k) {
        below = joint[0][k] ? below : max(below, dot(normal, corners[0][k]));
        above = joint[1][k] ? above : min(above, dot(normal, corners[1][k]));
    }
    bool parted = meet ? below < -off && above > off : above - below > 2.0 * off;
    return parted && !all(joint[0]);
}

#endif
