// What the rows of the fit's equations are made of; as src/polish/fit/mod.rs and solve.rs.
#ifndef FIT_SHARES_GLSL
#define FIT_SHARES_GLSL

// Weight of squared moves against squared distances.
const float STIFFNESS = 1e-2;
// Weight of squared differences between neighbours' moves, in each of their triangles.
const float COUPLING = 0.07;

#endif
