//! Attributes transferred to remeshed surfaces.

use crate::support::device;
use crate::support::shapes::{cut_open, globe, plane};
use glam::DVec3;
use rtfmesh::mesh::attributes::{
    Attribute, Attributes, CornerUv, Kind, Role, label_boundaries, transfer, uv_seams,
};
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::repair::{RepairOptions, repair, repair_with};
use rtfmesh::mesh::samples::sample;
use rtfmesh::{CorrespondenceRequest, Options, TriMesh, remesh};
use std::f64::consts::{PI, TAU};

/// Remeshes, and carries over.
fn run(input: &TriMesh, attributes: &Attributes, options: Options) -> (TriMesh, Attributes) {
    let options = options.correspondence(CorrespondenceRequest::ALL);
    let result = remesh(device(), input, &options).unwrap();
    let carried = transfer(attributes, input, &result.correspondence.unwrap(), &result.mesh);
    (result.mesh, carried)
}

fn of_vertices(mesh: &TriMesh, role: Role, kind: Kind, value: impl Fn(DVec3) -> Vec<f64>) -> Attribute {
    let values: Vec<f64> = mesh.vertices.iter().flat_map(|v| value(*v)).collect();
    Attribute::new("a", role, kind, values.len() / mesh.vertices.len(), values)
}

fn centre(mesh: &TriMesh, t: usize) -> DVec3 {
    mesh.corners(t).iter().sum::<DVec3>() / 3.0
}

#[test]
fn fields_of_vertices_are_interpolated() {
    let input = sample("sphere").unwrap();
    let checker = |v: DVec3| 255.0 * (((4.0 * v.x).floor() + (4.0 * v.z).floor()).rem_euclid(2.0));
    let field = |v: DVec3| 3.0 * v.x - v.y + 0.5 * v.z;
    let attributes = Attributes {
        vertex: vec![
            of_vertices(&input, Role::Colour, Kind::U8, |v| vec![checker(v), 7.0, 255.0]),
            of_vertices(&input, Role::Other, Kind::F64, |v| vec![field(v)]),
            of_vertices(&input, Role::Normal, Kind::F32, |v| v.normalize().to_array().to_vec()),
            of_vertices(&input, Role::Other, Kind::I32, |v| vec![(10.0 * v.z).floor()]),
        ],
        ..Default::default()
    };
    let (output, carried) = run(&input, &attributes, Options::new(600));
    let [colour, values, normals, whole] = carried.vertex.as_slice() else { panic!("{carried:?}") };
    let edge = (0..input.triangles.len()).fold(0.0, |longest: f64, t| {
        let [a, b, c] = input.corners(t);
        longest.max(a.distance(b)).max(b.distance(c)).max(c.distance(a))
    });
    for (v, place) in output.vertices.iter().enumerate() {
        assert!((values.at(v)[0] - field(*place)).abs() < 3.3 * edge, "{v}");
        let normal = DVec3::from_slice(normals.at(v));
        assert!((normal.length() - 1.0).abs() < 1e-6 && normal.dot(place.normalize()) > 0.999, "{normal}");
        assert!(
            (whole.at(v)[0] + 0.5 - 10.0 * place.z).abs() < 0.5 + 10.0 * edge
                && whole.at(v)[0].fract() == 0.0
        );
        let [r, g, b] = [0, 1, 2].map(|k| colour.at(v)[k]);
        assert_eq!((g, b, r.fract()), (7.0, 255.0, 0.0));
        // Away from the borders of the checker the colour is one of the two.
        let far = [place.x, place.z].iter().all(|x| ((4.0 * x).round() - 4.0 * x).abs() > 4.0 * edge);
        assert!(!far || r == checker(*place), "{place}: {r}");
    }
}

#[test]
fn the_two_sides_of_a_thin_plate_keep_their_colours() {
    let input = sample("thin-plate").unwrap();
    let [low, high] = input.bounds().unwrap();
    let middle = 0.5 * (low.z + high.z);
    let colour = |v: DVec3| if v.z > middle { vec![255.0, 0.0, 0.0] } else { vec![0.0, 0.0, 255.0] };
    let vertex = vec![of_vertices(&input, Role::Colour, Kind::U8, colour)];
    let (output, carried) = run(&input, &Attributes { vertex, ..Default::default() }, Options::new(1500));
    let mut sides = 0;
    for (v, place) in output.vertices.iter().enumerate() {
        let inside = (*place - low).min(high - *place).truncate().min_element() > 0.0;
        if inside {
            assert_eq!(carried.vertex[0].at(v), colour(*place), "{place}");
            sides += 1;
        }
    }
    assert!(sides > 1000);
}

fn uv_of(mesh: &TriMesh, uv: impl Fn(DVec3, DVec3) -> [f64; 2]) -> Attributes {
    let of_corner = |t: usize| mesh.corners(t).map(|corner| uv(corner, centre(mesh, t)));
    let values = (0..mesh.triangles.len()).flat_map(of_corner).collect();
    Attributes { uv: Some(CornerUv { kind: Kind::F64, values }), ..Default::default() }
}

#[test]
fn a_plane_keeps_its_texture_exactly() {
    let input = plane(8, 0.0);
    let uv = |v: DVec3| [0.1 + 0.3 * v.x - 0.2 * v.y, 0.4 * v.x + 0.7 * v.y];
    let attributes = uv_of(&input, |corner, _| uv(corner));
    assert_eq!(uv_seams(&input, &attributes), Vec::<u32>::new());
    let (output, carried) = run(&input, &attributes, Options::new(300));
    for (corner, got) in output.triangles.as_flattened().iter().zip(&carried.uv.unwrap().values) {
        let want = uv(output.vertices[*corner as usize]);
        assert!((got[0] - want[0]).abs().max((got[1] - want[1]).abs()) < 1e-6, "{got:?} {want:?}");
    }
}

/// An open tube around z with a texture that goes round once, cut open on one line.
fn tube(around: u32, along: u32) -> (TriMesh, Attributes) {
    let mut mesh = TriMesh::default();
    for j in 0..=along {
        for i in 0..around {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
            mesh.vertices.push(DVec3::new(cos, sin, 3.0 * f64::from(j) / f64::from(along)));
        }
    }
    let at = |i: u32, j: u32| j * around + i % around;
    for j in 0..along {
        for i in 0..around {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let attributes = uv_of(&mesh, |corner, centre| {
        let turn = corner.y.atan2(corner.x).rem_euclid(TAU) / TAU;
        // The corner on the cut belongs to the side that its triangle is on.
        let wraps = centre.y < 0.0 && turn < 0.25;
        [if wraps { turn + 1.0 } else { turn }, corner.z / 3.0]
    });
    (mesh, attributes)
}

#[test]
fn a_tube_that_is_cut_open_keeps_its_texture_on_both_sides_of_the_cut() {
    let (input, attributes) = tube(48, 20);
    let (output, carried) = run(&input, &attributes, Options::new(500));
    let values = carried.uv.unwrap().values;
    for (t, triangle) in output.triangles.iter().enumerate() {
        for (k, v) in triangle.iter().enumerate() {
            let (place, got) = (output.vertices[*v as usize], values[3 * t + k]);
            let turn = got[0] - place.y.atan2(place.x) / TAU;
            assert!(
                (turn - turn.round()).abs() < 0.006 && (got[1] - place.z / 3.0).abs() < 0.006,
                "{got:?} {place}"
            );
            let of_first = values[3 * t][0];
            assert!((got[0] - of_first).abs() < 0.15, "face {t} runs around the texture");
        }
    }
}

#[test]
fn seams_that_are_kept_make_the_texture_exact() {
    let (input, attributes) = tube(48, 20);
    let seams = uv_seams(&input, &attributes);
    assert_eq!(seams.len(), 40, "both sides of every edge on the cut");
    let options = Options::new(500).fixed_half_edges(seams).feature_angle(180.0);
    let (output, carried) = run(&input, &attributes, options);
    let values = carried.uv.unwrap().values;
    assert!(values.iter().flatten().all(|x| (-1e-9..=1.0 + 1e-9).contains(x)));
    // The faces tile the texture, without gaps or overlaps.
    let area =
        |[a, b, c]: &[[f64; 2]; 3]| 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]));
    let areas: Vec<f64> = values.as_chunks::<3>().0.iter().map(area).collect();
    assert_eq!(areas.len(), output.triangles.len());
    assert!((areas.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{}", areas.iter().sum::<f64>());
    assert!(areas.iter().all(|area| *area > 0.0));
}

/// A sphere by longitude and latitude, with a texture as maps of the world have it: a line at the poles, each
/// triangle there with its own part of it.
fn world(around: u32, along: u32) -> (TriMesh, Attributes) {
    let mesh = globe(around, along);
    let turn = |v: DVec3| v.y.atan2(v.x).rem_euclid(TAU) / TAU;
    let attributes = uv_of(&mesh, |corner, centre| {
        let (of_face, height) = (turn(centre), corner.z.asin() / PI + 0.5);
        if corner.z.abs() > 1.0 - 1e-9 {
            return [of_face, height];
        }
        let own = turn(corner);
        [own + (of_face - own).round(), height]
    });
    (mesh, attributes)
}

#[test]
fn the_poles_of_a_globe_are_no_seams() {
    let (input, attributes) = world(24, 12);
    let seams = uv_seams(&input, &attributes);
    assert_eq!(seams.len(), 2 * 12, "both sides of every edge of one meridian");
    for half in &seams {
        let corners = input.triangles[*half as usize / 3];
        let ends = [corners[*half as usize % 3], corners[(*half as usize + 1) % 3]];
        for end in ends.map(|v| input.vertices[v as usize]) {
            assert!(end.y.abs() < 1e-9 && end.x > -1e-9, "{end} is not on the meridian");
        }
    }
    let options = Options::new(400).fixed_half_edges(seams).feature_angle(180.0);
    let (output, carried) = run(&input, &attributes, options);
    let values = carried.uv.unwrap().values;
    for (corner, got) in output.triangles.as_flattened().iter().zip(&values) {
        let place = output.vertices[*corner as usize].normalize();
        let turn = got[0] - place.y.atan2(place.x) / TAU;
        let near_pole = place.z.abs() > (PI / 12.0).cos();
        assert!(near_pole || (turn - turn.round()).abs() < 0.02, "{got:?} {place}");
        assert!((got[1] - place.z.asin() / PI - 0.5).abs() < 0.03, "{got:?} {place}");
    }
    let worst = quality(&output).unwrap().min_angle;
    assert!(worst > 25.0, "an angle of {worst}");
}

#[test]
fn cracks_that_are_welded_stay_seams() {
    let (whole, attributes) = world(24, 12);
    // Both sides of the meridian have vertices of their own, a hair apart.
    let input = cut_open(&whole, 1e-5);
    assert_eq!(uv_seams(&input, &attributes).len(), 0);
    assert_eq!(repair(&input).unwrap().at_welded_places(&input), None);
    let repaired = repair_with(&input, &RepairOptions::default().weld(1e-4)).unwrap();
    let welded = repaired.at_welded_places(&input).unwrap();
    let seams = uv_seams(&welded, &attributes);
    assert_eq!(seams.len(), 2 * 12);
    for fixed_half_edges in [Vec::new(), seams] {
        let options = Options::new(400).fixed_half_edges(fixed_half_edges).weld(1e-4).feature_angle(180.0);
        let (output, carried) = run(&input, &attributes, options);
        let values = carried.uv.unwrap().values;
        for (triangle, got) in output.triangles.iter().zip(values.chunks(3)) {
            let place = triangle.map(|v| output.vertices[v as usize].normalize());
            if place.iter().any(|place| place.z.abs() > (PI / 6.0).cos()) {
                continue;
            }
            for (place, got) in place.iter().zip(got) {
                let turn = got[0] - place.y.atan2(place.x) / TAU;
                assert!((turn - turn.round()).abs() < 0.02, "{got:?} {place}");
            }
            let [low, high] = [f64::min, f64::max].map(|f| got.iter().map(|uv| uv[0]).reduce(f).unwrap());
            assert!(high - low < 0.25, "{got:?}");
        }
    }
}

#[test]
fn the_edges_of_a_star_are_seams() {
    // A pyramid whose sides are unfolded around its base.
    let base = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    let mut vertices: Vec<DVec3> = base.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect();
    vertices.push(DVec3::Z);
    let mesh = TriMesh { vertices, triangles: vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]] };
    let unfolded = |corner: DVec3, centre: DVec3| if corner.z > 0.5 { 3.0 * centre } else { corner };
    let attributes = uv_of(&mesh, |corner, centre| unfolded(corner, centre).truncate().to_array());
    assert_eq!(uv_seams(&mesh, &attributes).len(), 2 * 4);
    // Where three cuts meet and the texture goes on between them.
    let mesh = plane(8, 0.0);
    let middle = DVec3::new(0.5, 0.5, 0.0);
    let attributes = uv_of(&mesh, |corner, centre| {
        let third = ((centre - middle).truncate().to_angle() / TAU * 3.0).rem_euclid(3.0).floor();
        if corner.distance(middle) < 1e-9 { [third, 0.0] } else { [corner.x, corner.y] }
    });
    assert_eq!(uv_seams(&mesh, &attributes).len(), 2 * 3);
}

#[test]
fn a_cut_that_ends_inside_the_texture_stays_a_seam_to_its_end() {
    let mesh = plane(8, 0.0);
    // Opened like a dart on one line up to the middle.
    let attributes = uv_of(&mesh, |corner, centre| {
        let on_cut = (corner.y - 0.5).abs() < 1e-9 && corner.x < 0.5 - 1e-9;
        [corner.x, if on_cut && centre.y > 0.5 { corner.y + 0.1 } else { corner.y }]
    });
    assert_eq!(uv_seams(&mesh, &attributes).len(), 2 * 4);
}

fn labelled(mesh: &TriMesh, label: impl Fn(DVec3) -> f64) -> Attributes {
    let values = (0..mesh.triangles.len()).map(|t| label(centre(mesh, t))).collect();
    let label = Attribute::new("material", Role::Label, Kind::U32, 1, values);
    Attributes { face: vec![label], ..Default::default() }
}

#[test]
fn the_sides_of_a_box_keep_their_labels() {
    let input = sample("box").unwrap();
    let [low, high] = input.bounds().unwrap();
    let side = |v: DVec3| {
        let away = [v - low, high - v].map(|d| d.to_array()).concat();
        // A device polishes in single precision.
        away.iter().position(|d| d.abs() < 1e-6).map_or(9.0, |k| k as f64)
    };
    let attributes = labelled(&input, side);
    assert_eq!(label_boundaries(&input, &attributes).len(), 24);
    let (output, carried) = run(&input, &attributes, Options::new(400));
    for t in 0..output.triangles.len() {
        assert_eq!(carried.face[0].at(t), [side(centre(&output, t))], "{t}");
    }
}

#[test]
fn borders_that_are_kept_are_not_run_over() {
    // A staircase through a plate: no crease tells where the border is.
    let input = plane(12, 0.0);
    let label = |v: DVec3| f64::from(u8::from(v.x > if v.y > 0.5 { 0.25 } else { 0.75 }));
    let attributes = labelled(&input, label);
    let free = run(&input, &attributes, Options::new(500));
    let fixed_half_edges = label_boundaries(&input, &attributes);
    assert_eq!(fixed_half_edges.len(), 36);
    let kept = run(&input, &attributes, Options::new(500).fixed_half_edges(fixed_half_edges));
    for (name, (output, carried)) in [("free", free), ("kept", kept)] {
        let mut straddling = 0;
        for t in 0..output.triangles.len() {
            assert_eq!(carried.face[0].at(t), [label(centre(&output, t))], "{name}");
            let own = carried.face[0].at(t)[0];
            // A corner on the border is on neither side.
            let inside = |v: &DVec3| label(v.lerp(centre(&output, t), 1e-6)) == own;
            straddling += usize::from(!output.corners(t).iter().all(inside));
        }
        assert_eq!(straddling > 0, name == "free", "{name}: {straddling}");
    }
}
