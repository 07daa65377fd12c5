// How near the sites that a list does not hold may have come since it was made (see src/stages/lists.rs).
#ifndef COMMON_LIST_BOUNDS_GLSL
#define COMMON_LIST_BOUNDS_GLSL

// Farther than any site in the unit-diagonal frame.
const float BEYOND = 10.0;

struct ListBounds {
    float after_near; // distance of the sites after the first ones, at least
    float after_all; // of those that are not listed
    float rho; // no site has gone farther than this share of its reach,
    float reach; // and this site's reach was at most this
    bool endless; // the list has all sites, and there is no such bound
};

// `away` is the reach of both less the site's own way.
ListBounds list_bounds(vec2 away, float rho) {
    vec2 left = min(away, vec2(BEYOND));
    // The site's own way is at most rho times its reach, and is taken off already.
    float reach = max(left.y, 0.0) / (1.0 - rho);
    bool endless = away.y >= BEYOND;
    // The reach changes from site to site by no more than the distance between them. Where lists hold all
    // sites there is none, and only they themselves are sure.
    float after_near = endless && away.x < BEYOND ? 0.0 : left.x - rho * (left.x + (1.0 + rho) * reach);
    return ListBounds(after_near, left.y - 2.0 * rho * reach, rho, reach, endless);
}

// Boxes were made with the lists: this ball around a site meets the box of every site that is now nearer than
// `radius`.
float search_radius(ListBounds bounds, float radius) {
    float then = (radius + 2.0 * bounds.rho * bounds.reach) / (1.0 - bounds.rho);
    return bounds.endless ? 1e18 : 1.00001 * (radius + bounds.rho * (bounds.reach + then));
}

#endif
