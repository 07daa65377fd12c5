//! Wished edge lengths made fit for a mesh: within bounds, no longer than the next ones allow, and for a
//! number of vertices.

use super::mean_crowd;
use crate::TriMesh;
use crate::mesh::csr::Csr;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Within this share of the number of vertices the scale is good enough: what is left is taken from all
/// lengths alike.
const CLOSE: f64 = 1e-3;
/// Tries to find the scale.
const TRIES: u32 = 40;

/// What edge lengths have to keep to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds<'a> {
    /// Edge length of the uniform mesh with as many vertices.
    pub spacing: f64,
    /// Least length; at most the spacing.
    pub least: f64,
    /// Largest length at each vertex; nowhere less than the spacing.
    pub largest: &'a [f64],
    /// How much longer edges may be for each unit of way along the surface.
    pub growth: f64,
}

/// Lengths at the vertices of `surface` in proportion to `wished` ones, all above 0, but within `bounds`, for
/// as many vertices as the uniform mesh has.
pub fn graded(surface: &TriMesh, wished: &[f64], bounds: &Bounds) -> Vec<f64> {
    let edges = Edges::new(surface);
    let areas: Vec<f64> = (0..surface.triangles.len()).map(|t| surface.triangle_area(t)).collect();
    let whole: f64 = areas.iter().sum();
    let at_scale = |scale: f64| {
        let both = wished.iter().zip(bounds.largest);
        let lengths = both.map(|(wish, most)| (scale * wish).clamp(bounds.least, *most)).collect();
        edges.limited(lengths, bounds.growth)
    };
    // Vertices over those of the uniform mesh.
    let share = |lengths: &[f64]| {
        let crowd =
            |(triangle, area): (&[u32; 3], &f64)| area * mean_crowd(triangle.map(|v| lengths[v as usize]));
        surface.triangles.iter().zip(&areas).map(crowd).sum::<f64>() * bounds.spacing.powi(2) / whole
    };
    let (shortest, longest) = wished.iter().fold((f64::INFINITY, 0.0f64), |(l, h), w| (l.min(*w), h.max(*w)));
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
            return lengths;
        }
        if got > 1.0 { low = middle } else { high = middle }
    }
}

/// The edges from each vertex of a surface: the other end and the length of each, those between two triangles
/// twice.
struct Edges(Csr<(u32, f64)>);

/// A vertex that may shorten those around it; the one with the shortest length comes first.
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
    fn new(surface: &TriMesh) -> Self {
        let length = |a: u32, b: u32| surface.vertices[a as usize].distance(surface.vertices[b as usize]);
        let from = |[a, b, c]: [u32; 3]| [(a, b), (a, c), (b, c), (b, a), (c, a), (c, b)];
        let ends = surface.triangles.iter().flat_map(|t| from(*t)).map(|(a, b)| (a, (b, length(a, b))));
        Self(Csr::group(surface.vertices.len(), ends))
    }

    /// The largest lengths, none above the given ones, that grow by no more than `growth` for each unit of
    /// way along edges.
    fn limited(&self, mut lengths: Vec<f64>, growth: f64) -> Vec<f64> {
        let around = |v: u32| self.0.of(v);
        let mut heap: BinaryHeap<Next> = (0..lengths.len() as u32)
            .filter(|v| {
                around(*v).iter().any(|(w, way)| lengths[*v as usize] + growth * way < lengths[*w as usize])
            })
            .map(|v| Next(lengths[v as usize], v))
            .collect();
        while let Some(Next(length, v)) = heap.pop() {
            if length > lengths[v as usize] {
                continue;
            }
            for (w, way) in around(v) {
                let most = length + growth * way;
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
        let wished: Vec<f64> = mesh.vertices.iter().map(|p| if p.z > 0.9 { 1e-4 } else { 1.0 }).collect();
        let h = spacing(mesh.area(), 2000);
        let largest = vec![6.0 * h; wished.len()];
        let bounds = Bounds { spacing: h, least: 0.2 * h, largest: &largest, growth: 0.2 };
        let got = graded(&mesh, &wished, &bounds);
        let mut share = 0.0;
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            share += mesh.triangle_area(t) * mean_crowd(triangle.map(|v| got[v as usize])) * h * h;
            for [v, w] in [[0, 1], [1, 2], [2, 0]].map(|pair| pair.map(|k| triangle[k] as usize)) {
                let way = mesh.vertices[v].distance(mesh.vertices[w]);
                assert!((got[v] - got[w]).abs() <= 0.2 * way + 1e-12);
            }
        }
        assert!((share / mesh.area() - 1.0).abs() < 2.0 * CLOSE, "{share}");
        let (low, high) = got.iter().fold((9.0f64, 0.0f64), |(l, h), x| (l.min(*x), h.max(*x)));
        assert!(low >= 0.2 * h && high > 4.0 * low && high <= 6.0 * h, "{low} {high} {h}");
    }

    #[test]
    fn the_same_wish_everywhere_is_a_uniform_mesh() {
        let mesh = sample("torus").unwrap();
        let h = spacing(mesh.area(), 500);
        let largest = vec![8.0 * h; mesh.vertices.len()];
        let bounds = Bounds { spacing: h, least: h / 8.0, largest: &largest, growth: 0.3 };
        let got = graded(&mesh, &vec![5.0; mesh.vertices.len()], &bounds);
        assert!(got.iter().all(|length| (length / h - 1.0).abs() < CLOSE), "{:?}", &got[..3]);
    }
}
