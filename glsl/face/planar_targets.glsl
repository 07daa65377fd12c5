// What the kernels of the planar faces share: how far lists reach, where a face sends its site, and the
// counters. The including file has declared the buffers targets and centroids and the push constants of the
// move, and what common/blocks.glsl needs. Targets and centroids are those of the block.
#ifndef COMMON_PLANAR_TARGETS_GLSL
#define COMMON_PLANAR_TARGETS_GLSL
#include "common/blocks.glsl"

// `insecure` holds three counters for each iteration (all of a kind together), then the sites that
// face/planar leaves to face/planar_rest, then what this leaves to face/planar_exact: site, radius of its
// face so far, radius to search.
uint count_near(uint iteration) { return iteration; } // sites that the first lines do not decide
uint count_listed(uint iteration) { return iterations + iteration; } // sites that the list does not decide
uint count_open(uint iteration) { return 2u * iterations + iteration; } // faces that reach `widest`
uint entry_near(uint i) { return 3u * iterations + i; }
uint entry_listed(uint i) { return 3u * iterations + block_sites + 3u * i; }

// A face that reaches farther than this share of `widest` is not one of a site among its like: of a tip, a
// crease, or a gap. Its centroid is far out and not to be trusted.
const float WIDE = 0.45;
const float CAREFUL = 0.2;

// Sets the target of the site at `at` from the centroid `middle` of its face.
void aim(uint site, vec3 at, vec3 middle, float radius_sq) {
    uint place = block_place(0u, site);
    vec4 last = centroids[place];
    vec3 step = middle - at, motion = (middle - last.xyz) * last.w;
    bool wide = radius_sq > WIDE * WIDE * widest * widest;
    // A site whose step opposes its last motion loses its momentum.
    float share = !wide && dot(step, motion) > 0.0 ? momentum : 0.0;
    // Wide faces move in short steps, without momentum.
    vec3 move = wide ? CAREFUL * step : step + share * motion;
    float longest = wide ? CAREFUL * largest_move : largest_move;
    move *= min(1.0, longest * inversesqrt(max(dot(move, move), 1e-30)));
    targets[place] = vec4(at + move, dot(step, step));
    centroids[place] = vec4(middle, wide ? 0.0 : 1.0);
}

#endif
