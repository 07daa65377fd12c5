//! Ragged curves may be cut off where that mends small angles; smooth ones may not.

use glam::DVec3;
use rtfmesh::ProgressToken;
use rtfmesh::local::{CurveEdge, LocalMesh, MendOptions, mend_angles};
use rtfmesh::mesh::TriMesh;
use rtfmesh::mesh::polyline::Polyline;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{SlidingCurve, Target};

const LENGTH: f64 = 6.0;
/// Vertices on the curve, too many for good triangles.
const ON_CURVE: u32 = 19;
/// How far the curves sway to both sides.
const SWAY: f64 = 0.06;

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

/// A flat field with a curve through it, which has this many points at these heights.
fn field(points: u32, curve: impl Fn(f64) -> f64) -> LocalMesh {
    let line = Polyline::new(row(points, curve), false);
    let share = line.length() / f64::from(ON_CURVE - 1);
    let on_curve: Vec<DVec3> = (0..ON_CURVE).map(|k| line.at(share * f64::from(k)).0).collect();
    let rows = [row(7, |_| -1.7), row(7, |_| -0.85), on_curve, row(7, |_| 0.85), row(7, |_| 1.7)];
    let mut mesh = TriMesh::default();
    let firsts = [0, 7, 14, 14 + ON_CURVE, 21 + ON_CURVE];
    for k in 0..4 {
        band([firsts[k], firsts[k + 1]], [&rows[k], &rows[k + 1]], &mut mesh.triangles);
    }
    mesh.vertices = rows.concat();
    let is_on_frame = |p: &DVec3| p.x < 1e-9 || p.x > LENGTH - 1e-9 || p.y.abs() > 1.69;
    let mut fixed: Vec<bool> = mesh.vertices.iter().map(is_on_frame).collect();
    (14..14 + ON_CURVE).for_each(|v| fixed[v as usize] = true);
    let edge = |k: u32| {
        let [from, to] = [k, k + 1].map(|k| share * f64::from(k));
        CurveEdge { ends: [14 + k, 15 + k], curve: 0, from, to }
    };
    let sliders = (1..ON_CURVE - 1).map(|k| (14 + k, share * f64::from(k))).collect();
    LocalMesh {
        mesh,
        fixed,
        curve_edges: (0..ON_CURVE - 1).map(edge).collect(),
        sliding_curves: vec![SlidingCurve { line, sliders }],
        ..LocalMesh::default()
    }
}

/// Vertices on the curve after small angles were mended.
fn left_on_curve(mut local: LocalMesh) -> usize {
    let before = local.mesh.clone();
    assert!(quality(&before).unwrap().theta_min < 25.0);
    let options = MendOptions { min_angle: 30.0, spacing: 1.0, deviation: None };
    let target = Target::new(&before);
    mend_angles(&mut local, &target, &options, &ProgressToken::default()).unwrap();
    assert_eq!(topology(&local.mesh), topology(&before));
    assert_eq!(local.mesh.vertices.len(), before.vertices.len());
    assert!(local.mesh.vertices.iter().all(|p| p.z == 0.0));
    local.curve_edges.len() + 1
}

#[test]
fn ragged_curves_are_cut_off_where_smooth_ones_are_not() {
    let zigzag = field(73, |x| if (12.0 * x).round() as i64 % 2 == 0 { SWAY } else { -SWAY });
    let wave = field(361, |x| SWAY * (std::f64::consts::TAU * x).sin());
    let [zigzag, wave] = [zigzag, wave].map(left_on_curve);
    assert!(zigzag < 16 && wave > 17, "{zigzag} and {wave} of {ON_CURVE}");
}
