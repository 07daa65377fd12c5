//! Ragged curves may be cut off where that mends small angles; smooth ones may not.

use std::f64::consts::TAU;

use glam::DVec3;
use rtfmesh::ProgressToken;
use rtfmesh::local::{MendOptions, mend_angles};
use rtfmesh::mesh::TriMesh;
use rtfmesh::mesh::polyline::Polyline;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{ConstrainedMesh, CurveEdge, SlidingCurve, Target};

const LENGTH: f64 = 6.0;
/// Vertices on the curve, too many for good triangles.
const ON_CURVE: u32 = 19;

/// A row of vertices with equal distances in x.
fn row(count: u32, y: impl Fn(f64) -> f64) -> Vec<DVec3> {
    let x = |k| LENGTH * f64::from(k) / f64::from(count - 1);
    (0..count).map(|k| DVec3::new(x(k), y(x(k)), 0.0)).collect()
}

/// Triangles between two rows, which begin at the vertices `below` and `above`.
fn band([below, above]: [u32; 2], rows: [&[DVec3]; 2], triangles: &mut Vec<[u32; 3]>) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < rows[0].len() || j + 1 < rows[1].len() {
        let next = [rows[0].get(i + 1), rows[1].get(j + 1)].map(|p| p.map_or(f64::INFINITY, |p| p.x));
        let [a, b] = [below + i as u32, above + j as u32];
        if next[0] <= next[1] {
            triangles.push([a, a + 1, b]);
            i += 1;
        } else {
            triangles.push([a, b + 1, b]);
            j += 1;
        }
    }
}

/// A flat field with a curve through it, or as its boundary.
fn field(line: Polyline, is_boundary: bool) -> ConstrainedMesh {
    let share = line.length() / f64::from(ON_CURVE - 1);
    let on_curve: Vec<DVec3> = (0..ON_CURVE).map(|k| line.at(share * f64::from(k)).0).collect();
    let below = if is_boundary { Vec::new() } else { vec![row(7, |_| -1.7), row(7, |_| -0.85)] };
    let first = 7 * below.len() as u32;
    let rows = [below, vec![on_curve, row(7, |_| 0.85), row(7, |_| 1.7)]].concat();
    let mut mesh = TriMesh { vertices: rows.concat(), triangles: Vec::new() };
    let mut begin = 0;
    for pair in rows.windows(2) {
        let next = begin + pair[0].len() as u32;
        band([begin, next], [&pair[0], &pair[1]], &mut mesh.triangles);
        begin = next;
    }
    let is_on_frame = |p: &DVec3| p.x < 1e-9 || p.x > LENGTH - 1e-9 || p.y.abs() > 1.69;
    let mut fixed: Vec<bool> = mesh.vertices.iter().map(is_on_frame).collect();
    (first..first + ON_CURVE).for_each(|v| fixed[v as usize] = true);
    let edge = |k: u32| {
        let [from, to] = [k, k + 1].map(|k| share * f64::from(k));
        CurveEdge { ends: [first + k, first + k + 1], curve: 0, from, to }
    };
    let sliders = (1..ON_CURVE - 1).map(|k| (first + k, share * f64::from(k))).collect();
    ConstrainedMesh {
        mesh,
        fixed,
        curve_edges: (0..ON_CURVE - 1).map(edge).collect(),
        sliding_curves: vec![SlidingCurve { line, sliders }],
        ..ConstrainedMesh::default()
    }
}

/// Vertices on the curve after small angles were mended.
fn left_on_curve(mut local: ConstrainedMesh) -> usize {
    let before = local.mesh.clone();
    assert!(quality(&before).unwrap().min_angle < 25.0);
    let options = MendOptions { min_angle: 30.0, spacing: 1.0, deviation: None };
    let target = Target::new(&before);
    mend_angles(&mut local, &target, &options, &ProgressToken::default()).unwrap();
    let shape = |mesh: &TriMesh| {
        let found = topology(mesh);
        (found.euler, found.components, found.boundary_loops, found.nonmanifold_edges)
    };
    assert_eq!(shape(&local.mesh), shape(&before));
    assert_eq!(local.mesh.vertices.len(), before.vertices.len());
    assert!(local.mesh.vertices.iter().all(|p| p.z == 0.0));
    local.curve_edges.len() + 1
}

#[test]
fn ragged_curves_are_cut_off_where_smooth_ones_are_not() {
    // A boundary that is cut off leads farther from the surface than a change inside may.
    for (is_boundary, sway) in [(false, 0.06), (true, 0.09)] {
        let zigzag = row(73, |x| if (12.0 * x).round() as i64 % 2 == 0 { sway } else { -sway });
        let wave = row(361, |x| sway * (TAU * x).sin());
        let [zigzag, wave] = [zigzag, wave].map(|points| Polyline::new(points, false));
        let drawn = zigzag.clone().drawn(true);
        let [zigzag, wave, drawn] = [zigzag, wave, drawn].map(|line| left_on_curve(field(line, is_boundary)));
        assert!(zigzag < 18 && wave > 17 && drawn > 17, "{is_boundary}: {zigzag}, {wave} and {drawn}");
    }
}
