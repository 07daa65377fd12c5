// What the kernels of the planar faces share: how far lists reach, where a face sends its site, and the counters.
// The including file has declared the buffers targets and centroids and the push constants of the move.
#ifndef COMMON_PLANAR_TARGETS_GLSL
#define COMMON_PLANAR_TARGETS_GLSL

// `insecure` holds three counters for each iteration (all of a kind together), then the sites that face/planar leaves
// to face/planar_rest, then the pairs (site, radius) that this leaves to face/planar_exact.
uint count_near(uint iteration) { return iteration; } // sites that the first lines do not decide
uint count_listed(uint iteration) { return iterations + iteration; } // sites that the list does not decide
uint count_open(uint iteration) { return 2u * iterations + iteration; } // faces that reach `widest`
uint entry_near(uint i) { return 3u * iterations + i; }
uint entry_listed(uint i) { return 3u * iterations + site_count + 2u * i; }

const float CAREFUL = 0.2;

// Where the site at `at` goes whose face has its centroid at `middle`.
void aim(uint site, vec3 at, vec3 middle, bool closed) {
    vec4 last = centroids[site];
    vec3 step = middle - at, motion = (middle - last.xyz) * last.w;
    // Against its motion a site starts anew.
    float share = closed && dot(step, motion) > 0.0 ? momentum : 0.0;
    // An open face, as at the tip of an ear, has a centroid far out: its site goes with care, and without momentum.
    vec3 move = closed ? step + share * motion : CAREFUL * step;
    float longest = closed ? largest_move : CAREFUL * largest_move;
    move *= min(1.0, longest * inversesqrt(max(dot(move, move), 1e-30)));
    targets[site] = vec4(at + move, dot(step, step));
    centroids[site] = vec4(middle, closed ? 1.0 : 0.0);
}

#endif
