//! Grades target edge lengths: within bounds, of limited growth, and scaled to a number of vertices.

use super::mean_density;
use crate::TriMesh;
use crate::mesh::csr::Csr;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Relative error of the number of vertices at which the scale is good enough: scaling all lengths alike does
/// the rest.
const CLOSE: f64 = 1e-3;
/// Bisection steps to find the scale, at most.
const TRIES: u32 = 40;

/// Limits of edge lengths, all in the unit of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds<'a> {
    /// Edge length of the uniform mesh with as many vertices.
    pub spacing: f64,
    /// Least length; at most the spacing.
    pub least: f64,
    /// Largest length at each vertex; nowhere less than the spacing.
    pub largest: &'a [f64],
    /// Largest growth of edge length per unit of distance along the surface, above 0.
    pub growth: f64,
    /// Lengths at vertices that are as they are, infinite where there is none; empty if there are none at
    /// all. The bounds but for the growth do not hold for them.
    pub fixed: &'a [f64],
    /// Lengths below which those at vertices do not fall, whatever the other bounds, 0 where there is none;
    /// empty if there are none at all.
    pub floors: &'a [f64],
}

/// Lengths that bounds allow.
#[derive(Debug, Clone, PartialEq)]
pub struct Graded {
    /// At each vertex.
    pub lengths: Vec<f64>,
    /// How many vertices they take, over those of the uniform mesh: 1 but for rounding, unless the bounds do
    /// not allow it.
    pub share: f64,
}

/// Edge lengths at the vertices of `surface`: the `targets` there, all above 0, times a common factor, but
/// within `bounds`. The factor is such that the mesh has as many vertices as the uniform one. Panics if a
/// list is too short.
pub fn graded(surface: &TriMesh, targets: &[f64], bounds: &Bounds) -> Graded {
    let edges = Edges::new(surface);
    let areas: Vec<f64> = (0..surface.triangles.len()).map(|t| surface.triangle_area(t)).collect();
    let whole: f64 = areas.iter().sum();
    let at_scale = |scale: f64| {
        let both = targets.iter().zip(bounds.largest);
        let mut lengths: Vec<f64> =
            both.map(|(target, most)| (scale * target).clamp(bounds.least, *most)).collect();
        for (length, fixed) in lengths.iter_mut().zip(bounds.fixed).filter(|(_, fixed)| fixed.is_finite()) {
            *length = *fixed;
        }
        let mut lengths = edges.limited(lengths, bounds.growth);
        lengths.iter_mut().zip(bounds.floors).for_each(|(length, floor)| *length = length.max(*floor));
        lengths
    };
    // Vertices over those of the uniform mesh.
    let share = |lengths: &[f64]| {
        let density =
            |(triangle, area): (&[u32; 3], &f64)| area * mean_density(triangle.map(|v| lengths[v as usize]));
        surface.triangles.iter().zip(&areas).map(density).sum::<f64>() * bounds.spacing.powi(2) / whole
    };
    let (shortest, longest) =
        targets.iter().fold((f64::INFINITY, 0.0f64), |(l, h), w| (l.min(*w), h.max(*w)));
    let most = bounds.largest.iter().copied().fold(bounds.spacing, f64::max);
    // All at the least length, and all at the largest.
    let (mut low, mut high) = (bounds.least / longest, most / shortest);
    let mut tries = 0;
    loop {
        let middle = (low * high).sqrt();
        let lengths = at_scale(middle);
        let got = share(&lengths);
        tries += 1;
        if (got - 1.0).abs() < CLOSE || tries == TRIES {
            return Graded { lengths, share: got };
        }
        if got > 1.0 { low = middle } else { high = middle }
    }
}

/// The largest edge lengths at the vertices of `surface`, none above `lengths`, all above 0, that grow by no
/// more than `growth` per unit of distance along it. Panics if the list is too short.
pub fn grown(surface: &TriMesh, lengths: Vec<f64>, growth: f64) -> Vec<f64> {
    Edges::new(surface).limited(lengths, growth)
}

/// How many vertices a mesh has with edges of these `lengths`, above 0, at the vertices of `surface`. Panics
/// if the list is too short.
pub fn vertices_with(surface: &TriMesh, lengths: &[f64]) -> f64 {
    let density = |(t, triangle): (usize, &[u32; 3])| {
        surface.triangle_area(t) * mean_density(triangle.map(|v| lengths[v as usize]))
    };
    surface.triangles.iter().enumerate().map(density).sum::<f64>() * 2.0 / 3f64.sqrt()
}

/// The edges from each vertex of a surface: the other end and the length of each, those between two triangles
/// twice.
pub(super) struct Edges(Csr<(u32, f64)>);

/// A vertex that may shorten the lengths around it; the one with the shortest length comes first.
#[derive(PartialEq)]
struct Next(f64, u32);

impl Eq for Next {}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

impl Edges {
    pub(super) fn new(surface: &TriMesh) -> Self {
        let length = |a: u32, b: u32| surface.vertices[a as usize].distance(surface.vertices[b as usize]);
        let from = |[a, b, c]: [u32; 3]| [(a, b), (a, c), (b, c), (b, a), (c, a), (c, b)];
        let ends = surface.triangles.iter().flat_map(|t| from(*t)).map(|(a, b)| (a, (b, length(a, b))));
        Self(Csr::group(surface.vertices.len(), ends))
    }

    /// The largest lengths, none above the given ones, that grow by no more than `growth` for each unit of
    /// length along edges.
    pub(super) fn limited(&self, mut lengths: Vec<f64>, growth: f64) -> Vec<f64> {
        let around = |v: u32| self.0.of(v);
        let mut heap: BinaryHeap<Next> = (0..lengths.len() as u32)
            .filter(|v| {
                around(*v)
                    .iter()
                    .any(|(w, distance)| lengths[*v as usize] + growth * distance < lengths[*w as usize])
            })
            .map(|v| Next(lengths[v as usize], v))
            .collect();
        while let Some(Next(length, v)) = heap.pop() {
            if length > lengths[v as usize] {
                continue;
            }
            for (w, distance) in around(v) {
                let most = length + growth * distance;
                if most < lengths[*w as usize] {
                    lengths[*w as usize] = most;
                    heap.push(Next(most, *w));
                }
            }
        }
        lengths
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::spacing;

    #[test]
    fn lengths_keep_to_bounds_growth_and_count() {
        let mesh = sample("sphere").unwrap();
        let targets: Vec<f64> = mesh.vertices.iter().map(|p| if p.z > 0.9 { 1e-4 } else { 1.0 }).collect();
        let h = spacing(mesh.area(), 2000);
        let largest = vec![6.0 * h; targets.len()];
        let bounds =
            Bounds { spacing: h, least: 0.2 * h, largest: &largest, growth: 0.2, fixed: &[], floors: &[] };
        let got = graded(&mesh, &targets, &bounds).lengths;
        let mut share = 0.0;
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            share += mesh.triangle_area(t) * mean_density(triangle.map(|v| got[v as usize])) * h * h;
            for [v, w] in [[0, 1], [1, 2], [2, 0]].map(|pair| pair.map(|k| triangle[k] as usize)) {
                let distance = mesh.vertices[v].distance(mesh.vertices[w]);
                assert!((got[v] - got[w]).abs() <= 0.2 * distance + 1e-12);
            }
        }
        assert!((share / mesh.area() - 1.0).abs() < 2.0 * CLOSE, "{share}");
        let (low, high) = got.iter().fold((9.0f64, 0.0f64), |(l, h), x| (l.min(*x), h.max(*x)));
        assert!(low >= 0.2 * h && high > 4.0 * low && high <= 6.0 * h, "{low} {high} {h}");
    }

    #[test]
    fn lengths_that_grow_take_more_vertices() {
        let mesh = sample("sphere").unwrap();
        let h = spacing(mesh.area(), 2000);
        let even = vec![h; mesh.vertices.len()];
        assert!((vertices_with(&mesh, &even) / 2000.0 - 1.0).abs() < 1e-9);
        assert_eq!(grown(&mesh, even.clone(), 0.1), even);
        let mut short = even;
        short[0] = 0.1 * h;
        let lengths = grown(&mesh, short, 0.1);
        assert!(lengths.iter().all(|length| *length <= h) && lengths[0] == 0.1 * h);
        for [v, w] in mesh.triangles.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]) {
            let [v, w] = [*v as usize, *w as usize];
            let distance = mesh.vertices[v].distance(mesh.vertices[w]);
            assert!((lengths[v] - lengths[w]).abs() <= 0.1 * distance + 1e-12);
        }
        assert!(vertices_with(&mesh, &lengths) > 2010.0);
    }

    #[test]
    fn fixed_lengths_stay_and_the_others_make_up_for_them() {
        let mesh = sample("sphere").unwrap();
        let h = spacing(mesh.area(), 2000);
        let largest = vec![8.0 * h; mesh.vertices.len()];
        let fixed = |length: f64| -> Vec<f64> {
            mesh.vertices.iter().map(|p| if p.z > 0.8 { length } else { f64::INFINITY }).collect()
        };
        let even = vec![1.0; mesh.vertices.len()];
        let at = |fixed: &[f64]| {
            let bounds =
                Bounds { spacing: h, least: 0.5 * h, largest: &largest, growth: 0.3, fixed, floors: &[] };
            graded(&mesh, &even, &bounds)
        };
        for length in [0.4 * h, 2.0 * h] {
            let got = at(&fixed(length));
            assert!((got.share - 1.0).abs() < CLOSE, "{}", got.share);
            let inside = got.lengths.iter().zip(&mesh.vertices).filter(|(_, p)| p.z > 0.8);
            // Longer ones begin at the border with the growth from the others.
            assert!(inside.clone().all(|(got, _)| *got <= length + 1e-12));
            assert!(inside.clone().filter(|(_, p)| p.z > 0.98).all(|(got, _)| (got - length).abs() < 1e-12));
        }
        let too_short = at(&fixed(0.1 * h));
        assert!(too_short.share > 5.0, "{}", too_short.share);
    }

    #[test]
    fn lengths_do_not_fall_below_their_floors() {
        let mesh = sample("sphere").unwrap();
        let h = spacing(mesh.area(), 2000);
        let list = |inside: f64, outside: f64| -> Vec<f64> {
            mesh.vertices.iter().map(|p| if p.z > 0.9 { inside } else { outside }).collect()
        };
        let (largest, targets) = (list(6.0 * h, 6.0 * h), list(1.0, 1.0));
        let (fixed, floors) = (list(3.0 * h, f64::INFINITY), list(3.0 * h, 0.0));
        let bounds = Bounds {
            spacing: h,
            least: 0.2 * h,
            largest: &largest,
            growth: 0.1,
            fixed: &fixed,
            floors: &floors,
        };
        let got = graded(&mesh, &targets, &bounds);
        assert!((got.share - 1.0).abs() < CLOSE, "{}", got.share);
        let inside = got.lengths.iter().zip(&mesh.vertices).filter(|(_, p)| p.z > 0.9);
        assert!(inside.clone().count() > 20 && inside.clone().all(|(got, _)| *got == 3.0 * h));
        // Others do not grow to them.
        assert!(got.lengths.iter().zip(&mesh.vertices).all(|(got, p)| p.z > 0.9 || *got < 1.5 * h));
    }

    #[test]
    fn equal_targets_give_a_uniform_mesh() {
        let mesh = sample("torus").unwrap();
        let h = spacing(mesh.area(), 500);
        let largest = vec![8.0 * h; mesh.vertices.len()];
        let bounds =
            Bounds { spacing: h, least: h / 8.0, largest: &largest, growth: 0.3, fixed: &[], floors: &[] };
        let got = graded(&mesh, &vec![5.0; mesh.vertices.len()], &bounds).lengths;
        assert!(got.iter().all(|length| (length / h - 1.0).abs() < CLOSE), "{:?}", &got[..3]);
    }
}
