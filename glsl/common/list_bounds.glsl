// How near the sites outside a neighbour list can be by now (see src/stages/neighbours/lists.rs).
#ifndef COMMON_LIST_BOUNDS_GLSL
#define COMMON_LIST_BOUNDS_GLSL

// Farther than any site in the unit-diagonal frame.
const float BEYOND = 10.0;
// Stands for no bound at all. Finite, since some devices compute as if there were no infinity.
const float ENDLESS = 1e18;

struct ListBounds {
    float after_near; // lower bound for the distance of the sites after the first NEAR
    float after_all; // lower bound for the distance of sites not listed
    float rho; // no site has moved farther than this share of its reach
    float reach; // upper bound for this site's reach
    bool endless; // the list has all sites, so there is no such bound
};

// `away` has both reaches less the distance that the site has moved.
ListBounds list_bounds(vec2 away, float rho) {
    vec2 left = min(away, vec2(BEYOND));
    // The site has moved at most rho times its reach, which is subtracted already.
    float reach = max(left.y, 0.0) / (1.0 - rho);
    bool endless = away.y >= BEYOND;
    // The reaches of two sites differ by no more than the distance between them. Lists of all sites have no
    // reach, so nothing is known of the sites after the first ones.
    float after_near = endless && away.x < BEYOND ? 0.0 : left.x - rho * (left.x + (1.0 + rho) * reach);
    return ListBounds(after_near, left.y - 2.0 * rho * reach, rho, reach, endless);
}

// The boxes are as old as the lists: this ball around a site touches the box of every site now nearer than
// `radius`.
float search_radius(ListBounds bounds, float radius) {
    float then = (radius + 2.0 * bounds.rho * bounds.reach) / (1.0 - bounds.rho);
    return bounds.endless ? ENDLESS : 1.00001 * (radius + bounds.rho * (bounds.reach + then));
}

#endif
