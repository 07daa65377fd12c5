//! From one level to the next: a new site at the midpoint of every edge.

use crate::TriMesh;
use crate::mesh::NONE;
use crate::mesh::chunks::CHUNK;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::half_edges::edge_key;
use crate::mesh::triangle::closest_on_triangle;
use crate::sites::curve_clearance::CurveClearance;
use crate::sites::curve_sites::CurveSites;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::place::Place;
use crate::sites::surface_curves::SurfaceCurves;
use glam::DVec3;
use rayon::prelude::*;

/// Rounds over all triangles in which only points clear of curves are taken; after these any point is.
const PICKY_ROUNDS: usize = 6;

/// A coarser level, to be refined.
pub(crate) struct Coarser<'a> {
    pub mesh: &'a TriMesh,
    /// The surface's triangle at each vertex.
    pub triangles: &'a [u32],
    /// Edge length at each vertex from the size field, relative to the spacing; empty if all are equal.
    pub lengths: Vec<f64>,
    /// On surfaces with curves.
    pub on_curves: Option<CoarserCurves<'a>>,
}

/// The curve sites of a coarser level, and the distance that finer sites keep from curves.
pub(crate) struct CoarserCurves<'a> {
    pub curves: &'a SurfaceCurves,
    pub sites: &'a CurveSites,
    /// The index of each vertex among these sites, [`NONE`] for an interior one.
    pub pins: &'a [u32],
    /// Around the curve sites of the finer level.
    pub clearance: &'a CurveClearance<'a>,
}

impl CoarserCurves<'_> {
    fn place(&self, v: u32) -> Option<Place> {
        let pin = self.pins[v as usize];
        (pin != NONE).then(|| self.sites.places[pin as usize])
    }

    /// The edges along curves, each with the smaller vertex first, sorted.
    fn edges(&self) -> Vec<(u32, u32)> {
        let mut vertex_of = vec![NONE; self.sites.places.len()];
        for (v, pin) in (0..).zip(self.pins).filter(|(_, pin)| **pin != NONE) {
            vertex_of[*pin as usize] = v;
        }
        let ends = |segment: &[u32; 2]| segment.map(|site| vertex_of[site as usize]);
        let mut edges: Vec<(u32, u32)> =
            self.sites.segments.iter().map(ends).map(|[a, b]| edge_key(a, b)).collect();
        edges.sort_unstable();
        edges
    }

    /// The triangle nearest to `point` among those at the vertices, which are all on curves; only triangles
    /// in a patch common to the vertices are considered, if there is one.
    fn triangle_near(&self, vertices: &[u32], point: DVec3) -> u32 {
        let around: Vec<Vec<u32>> =
            vertices.iter().filter_map(|v| self.place(*v)).map(|place| self.curves.around(place)).collect();
        let patch = |t: u32| self.curves.patches[t as usize];
        let common = |t: u32| around.iter().all(|list| list.iter().any(|other| patch(*other) == patch(t)));
        let distance =
            |t: u32| closest_on_triangle(point, self.curves.corners_of(t)).point.distance_squared(point);
        around
            .concat()
            .into_iter()
            .map(|t| (!common(t), distance(t), t))
            .min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)))
            .map_or(0, |(_, _, t)| t)
    }
}

impl Coarser<'_> {
    fn is_free(&self, v: u32) -> bool {
        self.on_curves.as_ref().is_none_or(|on| on.pins[v as usize] == NONE)
    }

    /// Mean edge length at some vertices, relative to the spacing.
    fn length(&self, vertices: &[u32]) -> f64 {
        if self.lengths.is_empty() {
            return 1.0;
        }
        vertices.iter().map(|v| self.lengths[*v as usize]).sum::<f64>() / vertices.len() as f64
    }

    fn is_clear(&self, point: DVec3, triangle: u32) -> bool {
        self.on_curves.as_ref().is_none_or(|on| on.clearance.is_clear(point, triangle))
    }

    /// A triangle of the surface near `point`, which is between these vertices and may be off the surface.
    fn triangle(&self, vertices: &[u32], point: DVec3) -> u32 {
        let free = vertices.iter().find(|v| self.is_free(**v));
        match (free, &self.on_curves) {
            (None, Some(on)) => on.triangle_near(vertices, point),
            (free, _) => self.triangles[free.copied().unwrap_or(0) as usize],
        }
    }
}

/// The vertices of the coarser mesh, and new sites at the midpoints of its edges: `count` in all, which must
/// be at least the number of vertices. If there are too few edges, the largest triangles get a site at their
/// centre; if there are too many, the shortest edges get none, both relative to the sizes there. Vertices on
/// curves and edges along curves are left out and do not count.
///
/// The midpoint of an edge is off the surface; its triangle is that of one end, from where the surface leads
/// to it.
pub(crate) fn refine(coarser: &Coarser, count: usize) -> SitesOnSurface {
    let mesh = coarser.mesh;
    let free = (0..mesh.vertices.len()).filter(|v| coarser.is_free(*v as u32));
    let (positions, triangles) = free
        .map(|v| (mesh.vertices[v], coarser.triangles[v]))
        .filter(|(point, t)| coarser.is_clear(*point, *t))
        .unzip();
    let mut sites = SitesOnSurface { positions, triangles };
    let along = coarser.on_curves.as_ref().map(CoarserCurves::edges).unwrap_or_default();
    let middle = |&(a, b): &(u32, u32)| 0.5 * (mesh.vertices[a as usize] + mesh.vertices[b as usize]);
    let triangle = |edge: &(u32, u32)| coarser.triangle(&[edge.0, edge.1], middle(edge));
    let mut edges: Vec<(u32, u32)> = EdgeTable::new(&mesh.triangles)
        .par_edges()
        .filter_map(|e| e.first().map(|side| side.ends()))
        .filter(|edge| along.binary_search(edge).is_err())
        .filter(|edge| coarser.on_curves.is_none() || coarser.is_clear(middle(edge), triangle(edge)))
        .collect();
    let missing = count.saturating_sub(sites.len());
    if edges.len() > missing {
        let length_sq = |(a, b): (u32, u32)| {
            let length_sq = mesh.vertices[a as usize].distance_squared(mesh.vertices[b as usize]);
            length_sq / coarser.length(&[a, b]).powi(2)
        };
        edges.par_sort_unstable_by(|a, b| length_sq(*b).total_cmp(&length_sq(*a)).then(a.cmp(b)));
        edges.truncate(missing);
    }
    sites.positions.par_extend(edges.par_iter().with_min_len(CHUNK).map(middle));
    sites.triangles.par_extend(edges.par_iter().with_min_len(CHUNK).map(triangle));
    if sites.len() < count {
        add_centres(coarser, count, &mut sites);
    }
    sites.truncate(count);
    sites.in_morton_order()
}

/// Adds sites at the centres of the largest triangles, until there are `count`.
fn add_centres(coarser: &Coarser, count: usize, sites: &mut SitesOnSurface) {
    let mesh = coarser.mesh;
    let mut largest: Vec<(f64, usize)> = (0..mesh.triangles.len())
        .map(|t| (mesh.doubled_normal(t).length_squared() / coarser.length(&mesh.triangles[t]).powi(4), t))
        .collect();
    largest.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (round, (_, t)) in (0..).flat_map(|round| largest.iter().map(move |l| (round, l))) {
        if sites.len() >= count {
            break;
        }
        // Further sites in the same triangle are shifted towards different corners.
        let corners = mesh.corners(*t);
        let towards = corners[round % 3] / (3 + round) as f64;
        let point = (corners[0] + corners[1] + corners[2]) / 3.0 * (1.0 - 1.0 / (3 + round) as f64) + towards;
        let mut vertices = mesh.triangles[*t];
        vertices.rotate_left(round % 3);
        let triangle = coarser.triangle(&vertices, point);
        if round >= PICKY_ROUNDS || coarser.is_clear(point, triangle) {
            sites.push(point, triangle);
        }
    }
}

/// Sites of every level, from the coarsest to `count`: refining a closed mesh of one level gives the next
/// count or a few less. No level but the last has fewer than `coarsest` sites.
pub(crate) fn level_counts(count: usize, euler: i64, coarsest: usize) -> Vec<usize> {
    let mut counts = vec![count];
    // V' = 4 V - 3 χ, so V - χ grows by four.
    let mut finest = count;
    // With more components than vertices the coarser count would be larger.
    while let Some(next) = coarser(finest, euler).filter(|c| (coarsest..finest).contains(c)) {
        counts.push(next);
        finest = next;
    }
    counts.reverse();
    counts
}

fn coarser(count: usize, euler: i64) -> Option<usize> {
    usize::try_from((count as i64 - euler).div_euclid(4) + euler).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriMesh {
        TriMesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, 3.0 * DVec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        }
    }

    #[test]
    fn edges_first_then_large_triangles() {
        for (count, edges) in [(4, 0), (6, 2), (10, 6), (13, 6), (20, 6)] {
            let mesh = tetrahedron();
            let seeds = refine(
                &Coarser { mesh: &mesh, triangles: &[5, 6, 7, 8], lengths: Vec::new(), on_curves: None },
                count,
            );
            assert_eq!((seeds.positions.len(), seeds.triangles.len()), (count, count));
            let corners = tetrahedron().vertices;
            let middles = (0..4).flat_map(|a| (0..a).map(move |b| (a, b)));
            let found =
                middles.filter(|(a, b)| seeds.positions.contains(&(0.5 * (corners[*a] + corners[*b]))));
            assert_eq!(found.count(), edges, "{count} sites");
            assert!(seeds.triangles.iter().all(|t| (5..9).contains(t)));
            let mut sorted: Vec<_> = seeds.positions.iter().map(|s| s.to_array().map(f64::to_bits)).collect();
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(sorted.len(), count, "sites coincide");
        }
    }

    #[test]
    fn levels_multiply_by_four_but_for_the_euler_characteristic() {
        assert_eq!(level_counts(10_000, 0, 300), [625, 2500, 10_000]);
        assert_eq!(level_counts(10_002, 2, 300), [627, 2502, 10_002]);
        assert_eq!(level_counts(100, 2, 300), [100]);
        assert_eq!(level_counts(1000, -16, 100), [238, 1000]);
        assert_eq!(level_counts(4, 2, 4), [4]);
        assert_eq!(level_counts(1000, 1000, 300), [1000], "as many components as vertices");
        assert_eq!(level_counts(1000, 2000, 300), [1000]);
    }
}
