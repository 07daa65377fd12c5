// Angles of triangles, and where those of the mesh are kept.
#ifndef FIT_ANGLES_GLSL
#define FIT_ANGLES_GLSL

// After what a work list counts: the bits of the mesh's smallest angle, and of its largest.
const uint SMALLEST = 4u;
const uint LARGEST = 5u;

float angle_at(vec3 at, vec3 p, vec3 q) {
    vec3 u = p - at, v = q - at;
    return atan(length(cross(u, v)), dot(u, v));
}

// The smallest and the largest angle, in radians.
vec2 extreme_angles(vec3 a, vec3 b, vec3 c) {
    vec3 all = vec3(angle_at(a, b, c), angle_at(b, c, a), angle_at(c, a, b));
    return vec2(min(all.x, min(all.y, all.z)), max(all.x, max(all.y, all.z)));
}

#endif
