//! Restricted Voronoi cells by clipping every triangle with every pair of sites.

use glam::DVec3;

/// Area, integral of the way from the site, and integral of the squared distance to it, over a site's cell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    pub area: f64,
    pub first: DVec3,
    pub energy: f64,
}

/// The cells of all sites. Of sites on one spot the first has the cell.
pub fn cells(triangles: &[[DVec3; 3]], sites: &[DVec3]) -> Vec<Moments> {
    (0..sites.len()).map(|i| cell(triangles, sites, i)).collect()
}

/// The cell of one site.
pub fn cell(triangles: &[[DVec3; 3]], sites: &[DVec3], i: usize) -> Moments {
    let mut sum = Moments::default();
    for corners in triangles {
        let mut polygon = corners.to_vec();
        for (j, other) in sites.iter().enumerate().filter(|(j, _)| *j != i) {
            // How much farther a point is from this site than from the other one, squared.
            let behind = |p: DVec3| p.distance_squared(sites[i]) - p.distance_squared(*other);
            if *other == sites[i] && j < i {
                polygon.clear();
            }
            if polygon.iter().any(|p| behind(*p) > 0.0) {
                polygon = kept(&polygon, behind);
            }
            if polygon.is_empty() {
                break;
            }
        }
        for m in 2..polygon.len() {
            add(&mut sum, [polygon[0], polygon[m - 1], polygon[m]].map(|p| p - sites[i]));
        }
    }
    sum
}

/// The part of a convex polygon where `behind`, which is linear, is not positive.
fn kept(polygon: &[DVec3], behind: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut result = Vec::new();
    for m in 0..polygon.len() {
        let (p, q) = (polygon[m], polygon[(m + 1) % polygon.len()]);
        let (f, g) = (behind(p), behind(q));
        if f <= 0.0 {
            result.push(p);
        }
        if f * g < 0.0 {
            result.push(p + (q - p) * (f / (f - g)));
        }
    }
    result
}

/// The rule of the three middles of the sides, which is exact for squares.
fn add(sum: &mut Moments, [a, b, c]: [DVec3; 3]) {
    let area = 0.5 * (b - a).cross(c - a).length();
    let middles = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
    sum.area += area;
    sum.first += middles.into_iter().sum::<DVec3>() * (area / 3.0);
    sum.energy += middles.iter().map(|m| m.length_squared()).sum::<f64>() * (area / 3.0);
}
