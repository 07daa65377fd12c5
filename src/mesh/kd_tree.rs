//! k-d tree over points: the nearest one, and all within a distance of a point or a segment.

use glam::DVec3;

/// Points in a leaf.
const LEAF: usize = 8;
/// Fewer points than this are split by one thread.
const PARALLEL: usize = 4096;

/// Where a node is halved: the axis, and the coordinate.
type Plane = (usize, f64);

/// A balanced k-d tree; any points will do, also many at one position.
pub struct KdTree<'a> {
    points: &'a [DVec3],
    /// Indices; every range of a node is halved by the median of its widest axis.
    order: Vec<u32>,
    /// The planes of a full tree: a node's own, those of its first half, and those of its second half.
    planes: Vec<Plane>,
}

impl<'a> KdTree<'a> {
    /// Of finite points.
    pub fn new(points: &'a [DVec3]) -> Self {
        let leaves = points.len().div_ceil(LEAF).next_power_of_two();
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let mut planes = vec![(0, 0.0); leaves - 1];
        split(points, &mut order, &mut planes);
        Self { points, order, planes }
    }

    /// The nearest point to `p`, of equally near ones the first; `None` without points.
    pub fn nearest(&self, p: DVec3) -> Option<u32> {
        let mut best = (f64::INFINITY, u32::MAX);
        self.search(&self.order, &self.planes, p, &mut |i, distance_sq| {
            if (distance_sq, i) < best {
                best = (distance_sq, i);
            }
            best.0
        });
        (best.1 != u32::MAX).then_some(best.1)
    }

    /// Puts the points within `radius` of `p` into `found`, in a fixed order, but no more than `most`; false
    /// if there are more.
    pub fn within(&self, p: DVec3, radius: f64, most: usize, found: &mut Vec<u32>) -> bool {
        found.clear();
        let radius_sq = radius * radius;
        let mut fits = true;
        self.search(&self.order, &self.planes, p, &mut |i, distance_sq| {
            if distance_sq <= radius_sq {
                fits &= found.len() < most;
                if fits {
                    found.push(i);
                }
            }
            if fits { radius_sq } else { -1.0 }
        });
        fits
    }

    /// Puts the points within `radius` of a segment into `found`, in a fixed order.
    pub fn along(&self, segment: [DVec3; 2], radius: f64, found: &mut Vec<u32>) {
        found.clear();
        self.add_along((&self.order, &self.planes), &Tube { segment, radius }, [0.0, 1.0], found);
    }

    /// Adds the points below a node. Outside of this range of it, from 0 to 1, the tube's segment is too far
    /// from the node's cell.
    fn add_along(
        &self,
        (order, planes): (&[u32], &[Plane]),
        tube: &Tube,
        [from, to]: [f64; 2],
        found: &mut Vec<u32>,
    ) {
        let Some(((axis, plane), below)) = planes.split_first().filter(|_| order.len() > LEAF) else {
            found.extend(order.iter().filter(|i| tube.contains(self.points[**i as usize])));
            return;
        };
        let (left, right) = order.split_at(order.len() / 2);
        let (in_left, in_right) = below.split_at(below.len() / 2);
        let [a, b] = tube.segment.map(|end| end[*axis] - plane);
        // Where the segment is within the radius of either side.
        let sides = [(left, in_left, [tube.radius - a, a - b]), (right, in_right, [a + tube.radius, b - a])];
        for (order, planes, [room, slope]) in sides {
            // `room + slope * t` is not negative for these `t`.
            let range = match -room / slope {
                _ if slope == 0.0 && room >= 0.0 => [from, to],
                root if slope > 0.0 => [from.max(root), to],
                root if slope < 0.0 => [from, to.min(root)],
                _ => continue,
            };
            if range[0] <= range[1] {
                self.add_along((order, planes), tube, range, found);
            }
        }
    }

    /// Puts the `count` nearest points to `p` into `found`, or all if there are fewer, with their squared
    /// distances, nearest first; of equally near ones the first come first.
    pub fn nearest_few(&self, p: DVec3, count: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        if count == 0 {
            return;
        }
        self.search(&self.order, &self.planes, p, &mut |i, distance_sq| {
            let full = found.len() == count;
            if !full || found.last().is_some_and(|last| (distance_sq, i) < *last) {
                if full {
                    found.pop();
                }
                let at = found.partition_point(|other| *other < (distance_sq, i));
                found.insert(at, (distance_sq, i));
            }
            if found.len() < count { f64::INFINITY } else { found[count - 1].0 }
        });
    }

    /// Offers the points below a node with their squared distances, the near side first; `visit` says how
    /// far, squared, others may be.
    fn search(
        &self,
        order: &[u32],
        planes: &[Plane],
        p: DVec3,
        visit: &mut impl FnMut(u32, f64) -> f64,
    ) -> f64 {
        let mut limit = f64::INFINITY;
        let Some(((axis, plane), below)) = planes.split_first().filter(|_| order.len() > LEAF) else {
            for i in order {
                limit = visit(*i, self.points[*i as usize].distance_squared(p));
            }
            return limit;
        };
        let (left, right) = order.split_at(order.len() / 2);
        let (in_left, in_right) = below.split_at(below.len() / 2);
        let off = p[*axis] - plane;
        let sides = [(left, in_left), (right, in_right)];
        let near = usize::from(off >= 0.0);
        limit = self.search(sides[near].0, sides[near].1, p, visit);
        if off * off <= limit {
            limit = self.search(sides[1 - near].0, sides[1 - near].1, p, visit);
        }
        limit
    }
}

/// All places within a radius of a segment.
struct Tube {
    segment: [DVec3; 2],
    radius: f64,
}

impl Tube {
    fn contains(&self, p: DVec3) -> bool {
        let [a, b] = self.segment;
        let direction = b - a;
        let share = ((p - a).dot(direction) / direction.length_squared()).clamp(0.0, 1.0);
        // A segment without a length has no share.
        let nearest = if share.is_nan() { a } else { a + direction * share };
        p.distance_squared(nearest) <= self.radius * self.radius
    }
}

/// Halves the points of a node, and of all below it.
fn split(points: &[DVec3], order: &mut [u32], planes: &mut [Plane]) {
    let Some((plane, below)) = planes.split_first_mut().filter(|_| order.len() > LEAF) else { return };
    let at = |i: u32| points[i as usize];
    let first = at(order[0]);
    let (low, high) = order.iter().fold((first, first), |(l, h), i| (l.min(at(*i)), h.max(at(*i))));
    let axis = (high - low).max_position();
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |a, b| at(*a)[axis].total_cmp(&at(*b)[axis]).then(a.cmp(b)));
    *plane = (axis, at(order[middle])[axis]);
    let is_large = order.len() > PARALLEL;
    let (left, right) = order.split_at_mut(middle);
    let (in_left, in_right) = below.split_at_mut(below.len() / 2);
    if is_large {
        rayon::join(|| split(points, left, in_left), || split(points, right, in_right));
    } else {
        split(points, left, in_left);
        split(points, right, in_right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn finds_what_a_search_of_all_points_finds() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        for count in [0, 1, 8, 9, 17, 100, 1000] {
            // On a grid: many ties, many at one position.
            let mut point = || DVec3::from_array(std::array::from_fn(|_| f64::from(rng.random_range(0..6))));
            let points: Vec<DVec3> = (0..count).map(|_| point()).collect();
            let tree = KdTree::new(&points);
            for _ in 0..50 {
                let p = point() + 0.25;
                let far = |i: &usize| points[*i].distance_squared(p);
                let want = (0..count).min_by(|a, b| far(a).total_cmp(&far(b)));
                assert_eq!(tree.nearest(p), want.map(|i| i as u32));
                let mut few = Vec::new();
                tree.nearest_few(p, 12, &mut few);
                let mut all: Vec<(f64, u32)> = (0..count).map(|i| (far(&i), i as u32)).collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                all.truncate(12);
                assert_eq!(few, all);
                let mut found = Vec::new();
                assert!(tree.within(p, 2.0, count, &mut found));
                found.sort_unstable();
                let want: Vec<u32> = (0..count).filter(|i| far(i) <= 4.0).map(|i| i as u32).collect();
                assert_eq!(found, want);
                assert!(want.is_empty() || !tree.within(p, 2.0, want.len() - 1, &mut found));
                // Parallel to axes and without a length, too.
                let segment = [p, point() + 0.25];
                let tube = Tube { segment, radius: 0.8 };
                tree.along(segment, 0.8, &mut found);
                found.sort_unstable();
                let near = (0..count).filter(|i| tube.contains(points[*i]));
                assert_eq!(found, near.map(|i| i as u32).collect::<Vec<_>>());
            }
        }
    }
}
