// The marks in the fourth component of a site on a surface with curves: src/stages/pins.rs has the same. The including
// file has declared the constant CURVES, 0 for surfaces without curves, where there are no marks.
#ifndef COMMON_PINS_GLSL
#define COMMON_PINS_GLSL

// A site on a curve stays where it is.
bool is_pinned(float mark) { return CURVES != 0u && mark < 0.0; }

// Whether the site with the mark `other` may count for the interior site with the mark `own`: it is in the same patch or
// on a curve.
bool same_patch(float own, float other) { return CURVES == 0u || other == own || other < 0.0; }

// A curve site that counts whatever its normal.
bool counts_anywhere(float mark) { return CURVES != 0u && mark < -1.5; }

#endif
