// The marks in the fourth component of a site: src/stages/pins.rs has the same. On surfaces without curves
// all are 0.
#ifndef COMMON_PINS_GLSL
#define COMMON_PINS_GLSL
#include "common/octahedral.glsl"

// Whether the site is on a curve and stays where it is.
bool is_pinned(float mark) { return mark < 0.0; }

// Whether the site with the mark `other` may count for the interior site with the mark `own`: it is in the
// same patch or on a curve.
bool same_patch(float own, float other) { return other == own || other < 0.0; }

// The number in the mark of a curve site; all floats of its size are exact.
uint pin_code(float mark) { return uint(max(-mark, 1.0)) - 1u; }

// Whether a curve site counts regardless of its normal.
bool counts_anywhere(float mark) { return mark < 0.0 && (pin_code(mark) >> 20 & 1u) != 0u; }

// How far the curve continues in both directions, in spacings; 0 at corners.
float pin_reach(float mark) { return 0.25 * float(pin_code(mark) >> 21 & 7u); }

// The direction of the curve, or the opposite one.
vec3 pin_direction(float mark) {
    uint code = pin_code(mark);
    return unfold(vec2(float(code & 1023u), float(code >> 10 & 1023u)) / 511.0 - 1.0);
}

#endif
