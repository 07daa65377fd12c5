// The plane that best fits some points: the eigenvectors of their covariance.
#ifndef COMMON_PLANE_FIT_GLSL
#define COMMON_PLANE_FIT_GLSL

// A symmetric matrix.
struct Covariance {
    float xx, yy, zz, xy, xz, yz;
};

void add_point(inout Covariance c, vec3 d) {
    c.xx += d.x * d.x;
    c.yy += d.y * d.y;
    c.zz += d.z * d.z;
    c.xy += d.x * d.y;
    c.xz += d.x * d.z;
    c.yz += d.y * d.z;
}

// One Jacobi rotation that clears a_pq; vp and vq are the matching columns of the eigenvector matrix.
void rotate(inout float app, inout float aqq, inout float apq, inout float arp, inout float arq,
            inout vec3 vp, inout vec3 vq) {
    if (apq == 0.0) return;
    float theta = (aqq - app) / (2.0 * apq);
    float t = (theta >= 0.0 ? 1.0 : -1.0) / (abs(theta) + sqrt(theta * theta + 1.0));
    float c = inversesqrt(t * t + 1.0);
    float s = t * c;
    app -= t * apq;
    aqq += t * apq;
    apq = 0.0;
    float rp = arp;
    arp = c * rp - s * arq;
    arq = s * rp + c * arq;
    vec3 p = vp;
    vp = c * p - s * vq;
    vq = s * p + c * vq;
}

// The axis of least extent, nearly a unit vector, and whether the points span a plane (are not all on a line
// or equal).
vec3 least_axis(Covariance c, out bool planar) {
    vec3 ex = vec3(1.0, 0.0, 0.0), ey = vec3(0.0, 1.0, 0.0), ez = vec3(0.0, 0.0, 1.0);
    for (uint sweep = 0u; sweep < 5u; ++sweep) {
        rotate(c.xx, c.yy, c.xy, c.xz, c.yz, ex, ey);
        rotate(c.xx, c.zz, c.xz, c.xy, c.yz, ex, ez);
        rotate(c.yy, c.zz, c.yz, c.xy, c.xz, ey, ez);
    }
    float lowest = min(c.xx, min(c.yy, c.zz));
    float highest = max(c.xx, max(c.yy, c.zz));
    float middle = c.xx + c.yy + c.zz - lowest - highest;
    planar = middle > 1e-5 * highest;
    return lowest == c.xx ? ex : lowest == c.yy ? ey : ez;
}

#endif
