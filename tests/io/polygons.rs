//! Faces with more than three corners, or fewer, in all formats that have them.

use glam::{DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rtfmesh::TriMesh;
use rtfmesh::io::{Loaded, Reader};
use std::fmt::Write;

fn load(name: &str, text: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    Reader::new().read(path).unwrap()
}

/// A file of each format with these faces.
fn files(points: &[DVec3], faces: &[Vec<usize>]) -> Vec<(&'static str, String)> {
    let row = |p: &DVec3| format!("{} {} {}", p.x, p.y, p.z);
    let rows = |before: &str, after: &str| -> String {
        points.iter().map(|p| format!("{before}{}{after}\n", row(p))).collect()
    };
    let numbers = |face: &[usize], first: usize| {
        face.iter().map(|v| (v + first).to_string()).collect::<Vec<_>>().join(" ")
    };
    let counted = |face: &[usize]| format!("{} {}\n", face.len(), numbers(face, 0));
    let lists: String = faces.iter().map(|face| counted(face)).collect();
    let (n, m) = (points.len(), faces.len());
    let mut obj = rows("v ", "");
    faces.iter().for_each(|face| writeln!(obj, "f {}", numbers(face, 1)).unwrap());
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {n}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {m}\nproperty list int int vertex_indices\nend_header\n{}{lists}",
        rows("", "")
    );
    let off = format!("OFF\n{n} {m} 0\n{}{lists}", rows("", ""));
    let size: usize = faces.iter().map(|face| face.len() + 1).sum();
    let vtk = format!(
        "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS {n} double\n{}POLYGONS {m} {size}\n{lists}",
        rows("", "")
    );
    let facet = |face: &Vec<usize>| {
        let corners: String = face.iter().map(|v| format!("vertex {}\n", row(&points[*v]))).collect();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    let stl = format!("solid a\n{}endsolid\n", faces.iter().map(facet).collect::<String>());
    vec![("a.obj", obj), ("a.ply", ply), ("a.off", off), ("a.vtk", vtk), ("a.stl", stl)]
}

fn normals(mesh: &TriMesh) -> Vec<DVec3> {
    let normal = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.vertices[v as usize]);
        0.5 * (b - a).cross(c - a)
    };
    mesh.triangles.iter().map(|t| normal(*t)).collect()
}

fn volume(mesh: &TriMesh) -> f64 {
    let part = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(part).sum()
}

/// An L in the plane, of area 5 and perimeter 12.
const L: [[f64; 2]; 6] = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];

#[test]
fn faces_that_are_not_convex_keep_their_shape() {
    for start in 0..6 {
        let outline: Vec<[f64; 2]> = (0..6).map(|k| L[(k + start) % 6]).collect();
        let points: Vec<DVec3> =
            [0.0, 1.0].iter().flat_map(|z| outline.iter().map(|[x, y]| DVec3::new(*x, *y, *z))).collect();
        let mut faces: Vec<Vec<usize>> = vec![(0..6).rev().collect(), (6..12).collect()];
        faces.extend((0..6).map(|k| vec![k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6]));
        for (name, text) in files(&points, &faces) {
            let Loaded { mesh, notes, .. } = load(name, &text);
            assert_eq!(mesh.triangles.len(), 2 * 4 + 6 * 2, "{name}, {start}");
            let area: f64 = normals(&mesh).iter().map(|normal| normal.length()).sum();
            assert!((area - 22.0).abs() < 1e-12, "{name}, {start}: {area}");
            assert!((volume(&mesh) - 5.0).abs() < 1e-12, "{name}, {start}: {}", volume(&mesh));
            assert_eq!(notes, ["8 faces with more than 3 vertices were split into triangles"], "{name}");
        }
    }
}

#[test]
fn texture_coordinates_stay_at_their_corners() {
    // Each corner has the coordinates of its place, and another face uses the same vertices with others.
    let mut obj: String = L.iter().map(|[x, y]| format!("v {x} {y} 0\n")).collect();
    obj.extend(L.iter().map(|[x, y]| format!("vt {x} {y}\n")));
    obj.extend(L.iter().map(|[x, y]| format!("vt {} {}\n", x + 9.0, y + 9.0)));
    obj += "usemtl one\nf 3/3 4/4 5/5 6/6 1/1 2/2\nusemtl other\nf 2/8 1/7 6/12 5/11 4/10 3/9\n";
    let ply_row = |shift: f64, order: [usize; 6]| {
        let numbers = order.map(|k| k.to_string()).join(" ");
        let pairs = order.map(|k| format!("{} {}", L[k][0] + shift, L[k][1] + shift)).join(" ");
        format!("6 {numbers} 12 {pairs} {}\n", f64::from(shift > 0.0))
    };
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty double x\nproperty double y\nproperty double z\n\
         element face 2\nproperty list int int vertex_indices\nproperty list int double texcoord\n\
         property double heat\nend_header\n{}{}{}",
        L.iter().map(|[x, y]| format!("{x} {y} 0\n")).collect::<String>(),
        ply_row(0.0, [2, 3, 4, 5, 0, 1]),
        ply_row(9.0, [1, 0, 5, 4, 3, 2])
    );
    for (name, text) in [("a.obj", obj), ("a.ply", ply)] {
        let Loaded { mesh, attributes, .. } = load(name, &text);
        let facing: Vec<f64> = normals(&mesh).iter().map(|normal| normal.z).collect();
        assert!(facing[..4].iter().all(|z| *z > 0.0) && facing[4..].iter().all(|z| *z < 0.0), "{facing:?}");
        assert!((facing.iter().map(|z| z.abs()).sum::<f64>() - 10.0).abs() < 1e-12, "{name}: {facing:?}");
        let uv = attributes.uv.as_ref().unwrap();
        for (corner, (v, uv)) in mesh.triangles.as_flattened().iter().zip(&uv.values).enumerate() {
            let shift = if corner < 12 { 0.0 } else { 9.0 };
            let at = mesh.vertices[*v as usize];
            assert_eq!(*uv, [at.x + shift, at.y + shift], "{name}, corner {corner}");
        }
        assert_eq!(attributes.face[0].values, [0., 0., 0., 0., 1., 1., 1., 1.], "{name}");
    }
}

#[test]
fn outlines_of_any_shape_are_split_into_triangles_that_face_one_way() {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
    for round in 0..300 {
        let n = rng.random_range(4..60);
        let turn = DQuat::from_axis_angle(DVec3::new(0.3, 0.5, 0.8).normalize(), rng.random_range(0.0..6.0));
        let (size, far) = ([1e-9, 1.0, 1e9][round % 3], [0.0, 1e3][round / 3 % 2]);
        // Around the origin, and so without crossings.
        let points: Vec<DVec3> = (0..n)
            .map(|k| {
                let (angle, radius) =
                    (std::f64::consts::TAU * f64::from(k) / f64::from(n), rng.random_range(0.2..1.0));
                let bump = 0.02 * rng.random_range(-1.0..1.0);
                size * (turn * DVec3::new(radius * angle.cos(), radius * angle.sin(), bump) + far)
            })
            .collect();
        let centre = size * DVec3::splat(far);
        let normal = turn * DVec3::Z;
        let parts = (0..points.len()).map(|k| {
            let [a, b] = [points[k] - centre, points[(k + 1) % points.len()] - centre];
            0.5 * a.cross(b).dot(normal)
        });
        let area: f64 = parts.sum();
        let mesh = load("a.off", &files(&points, &[(0..points.len()).collect()])[2].1).mesh;
        assert_eq!(mesh.triangles.len(), points.len() - 2);
        let facing: Vec<f64> = normals(&mesh).iter().map(|own| own.dot(normal)).collect();
        let whole: f64 = facing.iter().map(|own| own.abs()).sum();
        assert!((whole / area - 1.0).abs() < 1e-6, "round {round}: {whole} of {area}");
    }
}

#[test]
fn corners_on_a_line_make_no_triangle_without_an_area() {
    let outline = [[0., 0.], [1., 0.], [2., 0.], [3., 0.], [3., 1.], [3., 2.], [0., 2.], [0., 1.]];
    for start in 0..8 {
        let points: Vec<DVec3> =
            (0..8).map(|k| outline[(k + start) % 8]).map(|[x, y]| DVec3::new(x, y, 1.0)).collect();
        for (name, text) in files(&points, &[(0..8).collect()]) {
            let mesh = load(name, &text).mesh;
            let areas: Vec<f64> = normals(&mesh).iter().map(|normal| normal.z).collect();
            assert!(areas.iter().all(|area| *area > 0.4), "{name}, {start}: {areas:?}");
            assert!((areas.iter().sum::<f64>() - 6.0).abs() < 1e-12, "{name}, {start}");
        }
    }
}

#[test]
fn an_outline_that_runs_to_a_hole_and_back_leaves_the_hole_open() {
    let outer = [[0., 0.], [4., 0.], [4., 4.], [0., 4.]];
    let inner = [[1., 1.], [1., 3.], [3., 3.], [3., 1.]];
    let points: Vec<DVec3> = outer.iter().chain(&inner).map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect();
    let faces = [vec![0, 1, 2, 3, 0, 4, 5, 6, 7, 4]];
    for (name, text) in files(&points, &faces) {
        let mesh = load(name, &text).mesh;
        let areas: Vec<f64> = normals(&mesh).iter().map(|normal| normal.z).collect();
        assert!(areas.len() == 8 && areas.iter().all(|area| *area > 0.0), "{name}: {areas:?}");
        assert!((areas.iter().sum::<f64>() - 12.0).abs() < 1e-12, "{name}: {areas:?}");
    }
}

#[test]
fn an_outline_that_crosses_itself_keeps_all_corners() {
    let points = [[0., 0.], [2., 2.], [2., 0.], [0., 2.], [-1., 1.]].map(|[x, y]| DVec3::new(x, y, 0.0));
    for (name, text) in files(&points, &[(0..5).collect()]) {
        assert_eq!(load(name, &text).mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]], "{name}");
    }
}

#[test]
fn corners_that_repeat_and_faces_that_are_none_do_not_stop_a_file() {
    let points: Vec<DVec3> = L.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect();
    // A corner of the second face twice in a row, a triangle that is an edge.
    let faces = [vec![0, 1], vec![2, 3, 3, 4, 5, 0, 1], vec![0, 1, 1]];
    for (name, text) in files(&points, &faces) {
        // STL has no indices, and VTK no polygons of two points.
        if name == "a.stl" || name == "a.vtk" {
            continue;
        }
        let Loaded { mesh, notes, .. } = load(name, &text);
        let area: f64 = normals(&mesh).iter().map(|normal| normal.z.abs()).sum();
        assert!((area - 5.0).abs() < 1e-12, "{name}: {area}");
        assert!(notes.contains(&"1 face with fewer than 3 vertices was ignored".to_owned()), "{notes:?}");
        let repaired = rtfmesh::mesh::repair::repair(&mesh).unwrap();
        assert_eq!(repaired.mesh.triangles.len(), 4, "{name}");
    }
    // Values of faces stay with theirs.
    let ply = "ply\nformat ascii 1.0\nelement vertex 6\nproperty double x\nproperty double y\n\
               property double z\nelement face 3\nproperty list int int vertex_indices\nproperty int tag\n\
               end_header\n0 0 0\n3 0 0\n3 1 0\n1 1 0\n1 3 0\n0 3 0\n2 0 1 7\n6 2 3 4 5 0 1 8\n3 0 1 2 9\n";
    assert_eq!(load("a.ply", ply).attributes.face[0].values, [8.0, 8.0, 8.0, 8.0, 9.0]);
}

#[test]
fn strips_of_triangles_in_ply_files_are_read() {
    let start = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
                 element tristrips 2\nproperty list int int vertex_indices\nend_header\n\
                 0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n2 1 0\n";
    // Two strips in one list, of which one begins with a vertex three times; one in a list of its own.
    let mesh = load("a.ply", &format!("{start}11 0 2 1 3 -1 2 2 2 4 3 5\n3 3 1 0\n")).mesh;
    assert_eq!(mesh.triangles, [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5], [3, 1, 0]]);
    assert!(normals(&mesh).iter().all(|normal| normal.z > 0.0));
    let folder = tempfile::tempdir().unwrap();
    for (strips, problem) in [
        ("4 0 2 1 6\n3 3 1 0\n", "line 16, strip 0: there is no vertex 6"),
        ("4 0 2 1 -2\n3 3 1 0\n", "there is no vertex -2"),
        ("4 0 2 1 1.5\n3 3 1 0\n", "there is no vertex 1.5"),
        ("4 0 2 1 3\n3 3 1\n", "tristrips 1 of 2 is incomplete"),
    ] {
        let path = folder.path().join("a.ply");
        std::fs::write(&path, format!("{start}{strips}")).unwrap();
        let error = Reader::new().read(path).unwrap_err().to_string();
        assert!(error.contains(problem), "{error}");
    }
}
