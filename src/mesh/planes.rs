//! How much of a surface lies in planes: much of a CAD part does, and hardly anything of a scan.

use super::TriMesh;
use super::chunks::CHUNK;
use super::half_edges::EdgeTable;
use super::topology::Partition;
use glam::DVec3;
use rayon::prelude::*;

/// Triangles that turn by less than this many degrees at the edge between them lie in one plane.
const FLAT: f64 = 0.1;
/// A plane's area is at least this many spacings times its perimeter: for a strip, half its width is as much.
/// Narrower facets may be those of a round surface. Single triangles, however large, may be those of a coarse
/// one.
const WIDE: f64 = 0.25;
/// The triangles of a plane are so nearly parallel: their summed normals over the sum of these.
const PARALLEL: f64 = 0.999;
/// Surfaces with planes have at least this share of their area in them.
const LEAST_SHARE: f64 = 0.2;

/// Whether much of a surface lies in planes not much narrower than the `spacing`, the edge length of a mesh
/// to be made, above 0. Panics if an index is out of range.
pub fn has_planes(mesh: &TriMesh, spacing: f64) -> bool {
    plane_share(mesh, spacing) >= LEAST_SHARE
}

/// The share of the area that lies in such planes.
fn plane_share(mesh: &TriMesh, spacing: f64) -> f64 {
    let count = mesh.triangles.len();
    let normals: Vec<DVec3> =
        (0..count).into_par_iter().with_min_len(CHUNK).map(|t| mesh.doubled_normal(t)).collect();
    let flat = FLAT.to_radians().cos();
    let mut regions = Partition::new(count);
    let mut borders: Vec<(u32, f64)> = Vec::new();
    for sides in EdgeTable::new(&mesh.triangles).edges() {
        if let [one, two] = sides {
            let [m, n] = [one, two].map(|side| normals[side.triangle()].normalize_or_zero());
            if m.dot(n) >= flat {
                regions.join(one.triangle() as u32, two.triangle() as u32);
                continue;
            }
        }
        let (a, b) = sides[0].ends();
        let length = mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
        borders.extend(sides.iter().map(|side| (side.triangle() as u32, length)));
    }
    let mut facets = vec![Facet::default(); count];
    for (t, normal) in (0..).zip(&normals) {
        let facet = &mut facets[regions.root(t) as usize];
        facet.triangles += 1;
        facet.doubled_area += normal.length();
        facet.normal += *normal;
    }
    borders.iter().for_each(|(t, length)| facets[regions.root(*t) as usize].perimeter += length);
    let whole: f64 = facets.iter().map(|facet| facet.doubled_area).sum();
    let planes = facets.iter().filter(|facet| facet.is_plane(spacing));
    let in_planes: f64 = planes.map(|facet| facet.doubled_area).sum();
    if whole > 0.0 { in_planes / whole } else { 0.0 }
}

/// Triangles that each turn by little from one to the next.
#[derive(Clone, Copy, Default)]
struct Facet {
    triangles: usize,
    doubled_area: f64,
    /// The sum of the doubled normals: shorter than the doubled area if they turn by much in all.
    normal: DVec3,
    perimeter: f64,
}

impl Facet {
    fn is_plane(&self, spacing: f64) -> bool {
        self.triangles > 1
            && 0.5 * self.doubled_area >= WIDE * spacing * self.perimeter
            && self.normal.length() >= PARALLEL * self.doubled_area
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::spacing;

    #[test]
    fn a_box_lies_in_planes_and_a_torus_does_not() {
        for (name, vertices, expected) in [("box", 100, 1.0), ("torus", 500, 0.0)] {
            let mesh = sample(name).unwrap();
            let share = plane_share(&mesh, spacing(mesh.area(), vertices));
            assert!((share - expected).abs() < 1e-12, "{name}: {share}");
        }
    }

    #[test]
    fn strips_count_from_half_a_spacing_on() {
        // A cylinder of 12 sides without ends, each side 0.52 wide and 10 long.
        let ring = |z: f64| (0..12).map(move |k| DVec3::from_array(at(f64::from(k), z)));
        fn at(k: f64, z: f64) -> [f64; 3] {
            let angle = k * std::f64::consts::TAU / 12.0;
            [angle.cos(), angle.sin(), z]
        }
        let vertices = ring(0.0).chain(ring(10.0)).collect();
        let sides = |k: u32| {
            let next = (k + 1) % 12;
            [[k, next, next + 12], [k, next + 12, k + 12]]
        };
        let mesh = TriMesh { vertices, triangles: (0..12).flat_map(sides).collect() };
        for (spacing, expected) in [(0.9, 1.0), (1.1, 0.0)] {
            assert!((plane_share(&mesh, spacing) - expected).abs() < 1e-12, "{spacing}");
        }
    }

    #[test]
    fn a_fine_sphere_has_no_planes() {
        // Triangles turn by less than 0.1 degrees from one to the next.
        const ROWS: u32 = 2000;
        let at = |k: u32, row: u32| {
            let [around, up] = [f64::from(k), f64::from(row)].map(|x| 5e-4 * (x - 0.5 * f64::from(ROWS)));
            DVec3::new(around.cos() * up.cos(), around.sin() * up.cos(), up.sin())
        };
        let vertices = (0..=ROWS).flat_map(|row| (0..=1).map(move |k| at(k, row))).collect();
        let pair = |row: u32| [[2 * row, 2 * row + 1, 2 * row + 3], [2 * row, 2 * row + 3, 2 * row + 2]];
        let mesh = TriMesh { vertices, triangles: (0..ROWS).flat_map(pair).collect() };
        assert_eq!(plane_share(&mesh, 1e-5), 0.0);
    }
}
