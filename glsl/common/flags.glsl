// What can be wrong with a site's face, one bit each; src/stages/flags.rs has the same list.
#ifndef COMMON_FLAGS_GLSL
#define COMMON_FLAGS_GLSL

const uint FLAG_TRIANGLES = 1u;   // more than MAX_TRIANGLES dual triangles; no face
const uint FLAG_PLANES = 2u;      // more than MAX_PLANES planes; no face
const uint FLAG_CORNERS = 4u;     // more than MAX_CORNERS corners; no face
const uint FLAG_OPEN = 8u;        // a cut did not close to one loop; no face
const uint FLAG_SECURITY = 16u;   // k neighbours did not reach the radius of security; all sites were used
const uint FLAG_COINCIDENT = 32u; // another site at the same point; separated by index
const uint FLAG_UNBOUNDED = 64u;  // the face reaches the cube that its cell started from
const uint FLAG_NORMAL = 128u;    // no plane fits neighbours and surface; the surface's normal was taken
const uint FLAG_INCOMPLETE = 256u; // it was not completed; the face by the k neighbours was kept
const uint FLAG_HIDDEN = 512u;    // the shadow sites of others cut off all of it; no face

#endif
