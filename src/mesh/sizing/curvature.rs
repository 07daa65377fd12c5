//! Curvature of surfaces and curves, averaged at the scale of a mesh of a given edge length.
//!
//! The curvature tensor is that of the normal cycle (Cohen-Steiner and Morvan 2003): every edge bends by the
//! angle between its triangles, along itself. Summed over a neighbourhood, what noise adds one way it takes
//! away the other way, since bends have a sign.

use crate::TriMesh;
use crate::mesh::csr::Csr;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::polyline::Polyline;
use glam::DVec3;
use rayon::prelude::*;

/// Radius over which tensors are averaged, in edge lengths of the output.
const REACH: f64 = 0.5;
/// Rounds of averaging, at most.
const MOST_ROUNDS: f64 = 60.0;
/// Half the arc length over which a curve's curvature is taken, in edge lengths of the output.
const HALF_STRETCH: f64 = 0.75;

/// A tensor's xx, yy, zz, xy, yz and zx.
type Tensor = [f64; 6];

/// The curvature at each vertex: the root of the sum of the squared principal curvatures, over about half an
/// edge of a mesh of this `spacing`. Half-edges, `3 * triangle + side`, that are `on_curve` do not bend; an
/// empty list means none.
pub fn curvature(surface: &TriMesh, on_curve: &[bool], spacing: f64) -> Vec<f64> {
    let size = |[xx, yy, zz, xy, yz, zx]: Tensor| {
        (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)).sqrt()
    };
    tensors(surface, on_curve, spacing).into_iter().map(size).collect()
}

/// How a surface bends at a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bend {
    /// The direction in which it bends most, of length 1; 0 if no triangle has the vertex.
    pub across: DVec3,
    /// The principal curvature in that direction, without its sign, in the inverse of the surface's unit.
    pub most: f64,
    /// The other one.
    pub least: f64,
}

/// How the surface bends at each vertex, over about half an edge of a mesh of this `spacing`. Half-edges that
/// are `on_curve` do not bend; at a vertex on a curve, the side that bends most counts.
pub fn bends(surface: &TriMesh, on_curve: &[bool], spacing: f64) -> Vec<Bend> {
    let (cut, origin) = cut_along(surface, on_curve);
    let tensors = tensors(&cut, &[], spacing);
    let mut normals = vec![DVec3::ZERO; cut.vertices.len()];
    for (t, triangle) in cut.triangles.iter().enumerate() {
        triangle.iter().for_each(|v| normals[*v as usize] += cut.doubled_normal(t));
    }
    let mut bends = vec![Bend::default(); surface.vertices.len()];
    for ((tensor, normal), v) in tensors.into_iter().zip(normals).zip(origin) {
        let Some(normal) = normal.try_normalize() else { continue };
        let (here, now) = (&mut bends[v as usize], bend(tensor, normal));
        if here.across == DVec3::ZERO || now.most > here.most {
            *here = now;
        }
    }
    bends
}

/// The principal curvatures in the plane of this normal. The tensor has each as the value of the direction
/// across it.
fn bend([xx, yy, zz, xy, yz, zx]: Tensor, normal: DVec3) -> Bend {
    let (u, w) = normal.any_orthonormal_pair();
    let times = |p: DVec3| {
        DVec3::new(
            xx * p.x + xy * p.y + zx * p.z,
            xy * p.x + yy * p.y + yz * p.z,
            zx * p.x + yz * p.y + zz * p.z,
        )
    };
    let (a, b, c) = (u.dot(times(u)), u.dot(times(w)), w.dot(times(w)));
    let (mean, half) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
    let (sin, cos) = (0.5 * (2.0 * b).atan2(a - c)).sin_cos();
    let (first, second) = (cos * u + sin * w, cos * w - sin * u);
    let (one, other) = ((mean + half).abs(), (mean - half).abs());
    if one >= other {
        Bend { across: second, most: one, least: other }
    } else {
        Bend { across: first, most: other, least: one }
    }
}

/// The surface cut along half-edges on curves, and the vertex that each of its vertices was.
fn cut_along(surface: &TriMesh, on_curve: &[bool]) -> (TriMesh, Vec<u32>) {
    let corners = surface.triangles.as_flattened();
    // The corner that stands for all that stay joined.
    let mut joined: Vec<u32> = (0..corners.len() as u32).collect();
    let root = |joined: &mut Vec<u32>, mut corner: u32| {
        while joined[corner as usize] != corner {
            joined[corner as usize] = joined[joined[corner as usize] as usize];
            corner = joined[corner as usize];
        }
        corner
    };
    for sides in EdgeTable::new(&surface.triangles).edges() {
        let &[one, two] = sides else { continue };
        if sides.iter().any(|side| on_curve.get(side.corners().0).is_some_and(|on| *on)) {
            continue;
        }
        let [(a, b), (c, d)] = [one, two].map(|side| side.corners());
        let (c, d) = if corners[a] == corners[c] { (c, d) } else { (d, c) };
        for (p, q) in [(a, c), (b, d)] {
            let (p, q) = (root(&mut joined, p as u32), root(&mut joined, q as u32));
            joined[p.max(q) as usize] = p.min(q);
        }
    }
    let mut names = vec![u32::MAX; corners.len()];
    let (mut vertices, mut origin, mut triangles) = (Vec::new(), Vec::new(), surface.triangles.clone());
    for (corner, v) in triangles.as_flattened_mut().iter_mut().enumerate() {
        let name = &mut names[root(&mut joined, corner as u32) as usize];
        if *name == u32::MAX {
            *name = vertices.len() as u32;
            vertices.push(surface.vertices[*v as usize]);
            origin.push(*v);
        }
        *v = *name;
    }
    (TriMesh { vertices, triangles }, origin)
}

/// The curvature tensor at each vertex.
fn tensors(surface: &TriMesh, on_curve: &[bool], spacing: f64) -> Vec<Tensor> {
    let normals: Vec<DVec3> = (0..surface.triangles.len()).map(|t| surface.doubled_normal(t)).collect();
    let count = surface.vertices.len();
    let mut areas = vec![0.0; count];
    for (triangle, normal) in surface.triangles.iter().zip(&normals) {
        triangle.iter().for_each(|v| areas[*v as usize] += normal.length() / 6.0);
    }
    let mut tensors: Vec<Tensor> = vec![[0.0; 6]; count];
    let mut stops = vec![false; count];
    let mut edges: Vec<[u32; 2]> = Vec::new();
    let mut length_sum = 0.0;
    for sides in EdgeTable::new(&surface.triangles).edges() {
        let Some((a, b)) = sides.first().map(|side| side.ends()) else { continue };
        let along = surface.vertices[b as usize] - surface.vertices[a as usize];
        edges.push([a, b]);
        length_sum += along.length();
        let fixed = sides.iter().any(|side| on_curve.get(side.corners().0).is_some_and(|on| *on));
        let &[one, two] = sides else {
            [a, b].iter().for_each(|v| stops[*v as usize] = true);
            continue;
        };
        if fixed {
            [a, b].iter().for_each(|v| stops[*v as usize] = true);
            continue;
        }
        let [m, n] = [one, two].map(|side| normals[side.triangle()]);
        let direction = along.normalize_or_zero();
        // The sign says which way the edge bends: the first side runs from a to b or the other way.
        let forward = if surface.triangles.as_flattened()[one.corners().0] == a { 1.0 } else { -1.0 };
        let angle = forward * m.cross(n).dot(direction).atan2(m.dot(n));
        // Half of it for either end.
        let share = 0.5 * angle * along.length();
        let [x, y, z] = direction.to_array();
        for v in [a, b] {
            let terms = [x * x, y * y, z * z, x * y, y * z, z * x];
            tensors[v as usize].iter_mut().zip(terms).for_each(|(sum, term)| *sum += share * term);
        }
    }
    let typical = length_sum / edges.len().max(1) as f64;
    // Each round spreads by the root of half an edge's square.
    let rounds = (2.0 * (REACH * spacing / typical.max(f64::MIN_POSITIVE)).powi(2)).round().min(MOST_ROUNDS);
    let mut held: Vec<Held> =
        tensors.into_iter().zip(areas).map(|(tensor, area)| Held { tensor, area }).collect();
    let around = Csr::group(count, edges.iter().flat_map(|[a, b]| [(*b, *a), (*a, *b)]));
    for _ in 0..rounds as u32 {
        held = spread(&around, &stops, &held);
    }
    held.iter().map(|Held { tensor, area }| tensor.map(|term| term / area.max(f64::MIN_POSITIVE))).collect()
}

/// What a vertex has of a sum over the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Held {
    tensor: Tensor,
    area: f64,
}

impl Held {
    fn times(&self, factor: f64) -> Self {
        Self { tensor: self.tensor.map(|term| factor * term), area: factor * self.area }
    }

    fn add(&mut self, other: &Self) {
        self.tensor.iter_mut().zip(other.tensor).for_each(|(sum, term)| *sum += term);
        self.area += other.area;
    }
}

/// Every vertex gives half of what it has to its neighbours in equal parts; those that stop keep all.
fn spread(around: &Csr, stops: &[bool], held: &[Held]) -> Vec<Held> {
    let gives = |v: usize| !stops[v] && !around.of(v as u32).is_empty();
    let of = |v: usize| held[v].times(0.5 / around.of(v as u32).len() as f64);
    let given: Vec<Held> = (0..held.len()).into_par_iter().map(of).collect();
    let after = |v: usize| {
        let mut own = if gives(v) { held[v].times(0.5) } else { held[v] };
        let near = around.of(v as u32).iter().map(|w| *w as usize);
        near.filter(|w| !stops[*w]).for_each(|w| own.add(&given[w]));
        own
    };
    (0..held.len()).into_par_iter().map(after).collect()
}

/// The curvature of a curve at an arc length, taken over about an edge of a mesh of this `spacing`, in the
/// inverse of the curve's unit; 0 too near to an end.
pub fn along_curve(line: &Polyline, arc_length: f64, spacing: f64) -> f64 {
    let available =
        if line.is_closed() { 0.25 * line.length() } else { arc_length.min(line.length() - arc_length) };
    let half = (HALF_STRETCH * spacing).min(available);
    // Too near to an end to tell.
    if half < 0.1 * spacing {
        return 0.0;
    }
    let [before, here, after] = [arc_length - half, arc_length, arc_length + half].map(|a| line.at(a).0);
    (before + after - 2.0 * here).length() / (half * half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn a_sphere_bends_alike_everywhere() {
        let mesh = sample("sphere").unwrap();
        let radius = mesh.vertices[0].length();
        // Vertices with five neighbours are off by more at themselves than over a neighbourhood.
        for (spacing, tolerance) in [(0.01, 0.2), (0.4, 0.12)] {
            for (v, k) in curvature(&mesh, &[], spacing).iter().enumerate() {
                let expected = 2f64.sqrt() / radius;
                assert!((k / expected - 1.0).abs() < tolerance, "vertex {v}: {k} and not {expected}");
            }
        }
    }

    #[test]
    fn gathering_adds_what_giving_away_in_the_order_of_the_edges_does() {
        let mesh = sample("bumpy-sphere").unwrap();
        let count = mesh.vertices.len();
        let edges: Vec<[u32; 2]> =
            EdgeTable::new(&mesh.triangles).edges().map(|sides| <[u32; 2]>::from(sides[0].ends())).collect();
        let stops: Vec<bool> = (0..count).map(|v| v % 7 == 0).collect();
        let held: Vec<Held> = (0..count)
            .map(|v| Held {
                tensor: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|k| (k * v as f64).sin()),
                area: v as f64,
            })
            .collect();
        let mut degrees = vec![0.0; count];
        edges.as_flattened().iter().for_each(|v| degrees[*v as usize] += 1.0);
        let mut expected: Vec<Held> =
            (0..count).map(|v| if stops[v] { held[v] } else { held[v].times(0.5) }).collect();
        for [from, to] in edges.iter().flat_map(|[a, b]| [[*a, *b], [*b, *a]]) {
            if !stops[from as usize] {
                expected[to as usize].add(&held[from as usize].times(0.5 / degrees[from as usize]));
            }
        }
        let around = Csr::group(count, edges.iter().flat_map(|[a, b]| [(*b, *a), (*a, *b)]));
        assert_eq!(spread(&around, &stops, &held), expected);
    }

    /// A cylinder of radius 0.5 about the z axis.
    fn cylinder() -> TriMesh {
        let (around, up) = (40, 30);
        let at = |i: u32, j: u32| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(around);
            DVec3::new(0.5 * angle.cos(), 0.5 * angle.sin(), 0.08 * f64::from(j))
        };
        let vertices = (0..up).flat_map(|j| (0..around).map(move |i| at(i, j))).collect();
        let quad = |i: u32, j: u32| {
            let [a, b] = [i, (i + 1) % around].map(|i| j * around + i);
            [[a, b, b + around], [a, b + around, a + around]]
        };
        TriMesh {
            vertices,
            triangles: (0..up - 1).flat_map(|j| (0..around).flat_map(move |i| quad(i, j))).collect(),
        }
    }

    #[test]
    fn a_cylinder_bends_one_way_and_noise_is_left_out() {
        let mut mesh = cylinder();
        let inner: Vec<usize> =
            (0..mesh.vertices.len()).filter(|v| (0.7..1.6).contains(&mesh.vertices[*v].z)).collect();
        let smooth = curvature(&mesh, &[], 0.2);
        assert!(inner.iter().all(|v| (smooth[*v] / 2.0 - 1.0).abs() < 0.05), "{:?}", smooth[inner[0]]);
        for (v, p) in mesh.vertices.iter_mut().enumerate() {
            *p += 0.008 * DVec3::new(p.x, p.y, 0.0).normalize() * (v as f64 * 12.9898).sin();
        }
        let (near, far) = (curvature(&mesh, &[], 0.01), curvature(&mesh, &[], 0.3));
        let mean = |list: &[f64]| inner.iter().map(|v| list[*v]).sum::<f64>() / inner.len() as f64;
        assert!(mean(&near) > 3.0, "rough: {}", mean(&near));
        assert!((mean(&far) / 2.0 - 1.0).abs() < 0.1, "seen from afar: {}", mean(&far));
    }

    #[test]
    fn a_cylinder_bends_around_its_axis_and_its_caps_do_not() {
        let mesh = cylinder();
        let check = |bend: &Bend, p: DVec3| {
            let around = DVec3::new(-p.y, p.x, 0.0).normalize();
            assert!((bend.most / 2.0 - 1.0).abs() < 0.06 && bend.least < 0.1, "{bend:?}");
            assert!(bend.across.dot(around).abs() > 0.99, "{bend:?} at {p}");
        };
        for (bend, p) in bends(&mesh, &[], 0.2).iter().zip(&mesh.vertices) {
            check(bend, *p);
        }
        // With a cap on the lower rim, which is a curve.
        let rim = 40;
        let mut capped = mesh.clone();
        let middle = capped.vertices.len() as u32;
        capped.vertices.push(DVec3::ZERO);
        capped.triangles.extend((0..rim).map(|i| [(i + 1) % rim, i, middle]));
        let on_rim = |v: u32| v < rim;
        let on_curve: Vec<bool> = (capped.triangles.iter())
            .flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)].map(|(a, b)| on_rim(*a) && on_rim(*b)))
            .collect();
        let found = bends(&capped, &on_curve, 0.2);
        found.iter().zip(&mesh.vertices).for_each(|(bend, p)| check(bend, *p));
        assert!(found[middle as usize].most < 1e-12);
    }

    #[test]
    fn a_torus_bends_most_around_its_tube() {
        let mesh = sample("torus").unwrap();
        let radius = |p: DVec3| p.truncate().length();
        let (low, high) =
            mesh.vertices.iter().fold((9.0f64, 0.0f64), |(l, h), p| (l.min(radius(*p)), h.max(radius(*p))));
        let (around, tube) = (0.5 * (low + high), 0.5 * (high - low));
        // Its triangles are uneven, so that single vertices are off.
        let found = bends(&mesh, &[], 0.3);
        let mean = |of: &dyn Fn(&Bend, DVec3) -> f64| {
            found.iter().zip(&mesh.vertices).map(|(bend, p)| of(bend, *p)).sum::<f64>() / found.len() as f64
        };
        let most = mean(&|bend, _| bend.most * tube);
        assert!((most - 1.0).abs() < 0.1, "{most}");
        let along = mean(&|bend, p| bend.across.dot(DVec3::new(-p.y, p.x, 0.0).normalize()).abs());
        assert!(along < 0.1, "{along}");
        let least = mean(&|bend, p| {
            let cosine = (radius(p) - around) / tube;
            (bend.least - (cosine / radius(p)).abs()).abs() * around
        });
        assert!(least < 0.2, "{least}");
    }

    #[test]
    fn edges_on_curves_do_not_bend() {
        let mesh = sample("box").unwrap();
        let fixed = curvature(&mesh, &vec![true; 3 * mesh.triangles.len()], 0.1);
        assert!(fixed.iter().all(|k| *k == 0.0));
        let bent = curvature(&mesh, &[], 1e-3);
        assert!(bent.iter().all(|k| *k > 1.0), "{bent:?}");
    }

    #[test]
    fn a_circle_bends_by_one_over_its_radius() {
        let angle = |k: u32| std::f64::consts::TAU * f64::from(k % 90) / 90.0;
        let points = (0..=90).map(|k| 3.0 * DVec3::new(angle(k).cos(), angle(k).sin(), 0.0)).collect();
        let circle = Polyline::new(points, true);
        for arc_length in [0.0, 3.3, 18.0] {
            assert!((along_curve(&circle, arc_length, 1.0) * 3.0 - 1.0).abs() < 0.05);
        }
        let straight = Polyline::new(vec![DVec3::ZERO, DVec3::X, 2.0 * DVec3::X], false);
        assert_eq!([0.0, 0.5, 1.0].map(|a| along_curve(&straight, a, 0.5)), [0.0; 3]);
    }
}
