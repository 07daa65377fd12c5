// Coordinates in the tangent plane of a site. Faces are stored in them, two floats a corner.
#ifndef COMMON_TANGENT_GLSL
#define COMMON_TANGENT_GLSL

// Two unit vectors that make a right-handed frame with the unit vector n (Duff et al. 2017).
void tangent_frame(vec3 n, out vec3 u, out vec3 v) {
    float s = n.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    u = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    v = vec3(b, s + n.y * n.y * a, -n.y);
}

#endif
