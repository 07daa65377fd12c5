// Symmetric 3 x 3 matrices: `on` has xx, yy, zz, and `off` has yz, zx, xy.
#ifndef FIT_SYMMETRIC_GLSL
#define FIT_SYMMETRIC_GLSL

struct Symmetric {
    vec3 on;
    vec3 off;
};

void add_outer(inout Symmetric m, vec3 d, float weight) {
    m.on += weight * d * d;
    m.off += weight * d.yzx * d.zxy;
}

vec3 times(Symmetric m, vec3 x) { return m.on * x + m.off.zxy * x.yzx + m.off.yzx * x.zxy; }

// The product with the inverse; 0 for a matrix that is not positive definite.
vec3 solve(Symmetric m, vec3 x) {
    // Rows of the adjugate matrix.
    vec3 on = m.on.yzx * m.on.zxy - m.off * m.off;
    vec3 off = m.off.yzx * m.off.zxy - m.on * m.off;
    float determinant = m.on.x * on.x + m.off.z * off.z + m.off.y * off.y;
    return determinant > 0.0 ? times(Symmetric(on, off), x) / determinant : vec3(0.0);
}

#endif
