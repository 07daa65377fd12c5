// Samples of the fit: distances between mesh and surface, and the direction in which they change; as
// src/polish/fit/samples.rs.
#ifndef FIT_SAMPLE_GLSL
#define FIT_SAMPLE_GLSL

// Distances below this share of a face's size have no reliable direction; the normal is used.
const float NO_DIRECTION = 1e-3;

// Direction and distance (w), both times the root of the sample's weight. `offset` leads to the closest
// point, `facing` is the unit normal there.
vec4 sample_of(vec3 offset, vec3 facing, float size_sq, float weight) {
    float far = length(offset);
    vec3 direction = far * far <= NO_DIRECTION * NO_DIRECTION * size_sq ? facing : offset / max(far, 1e-30);
    return sqrt(weight) * vec4(direction, dot(offset, direction));
}

#endif
