//! The HTML report of a run: its contents, escaping, and that it loads nothing from elsewhere.

use crate::support::device;
use crate::support::shapes::{cube, mesh, moved, plane};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use glam::DVec3;
use rtfmesh::report::Report;
use rtfmesh::report::html::{MOST_FACES, PageInput, page};
use rtfmesh::{MeasureDepth, Options, Result, Summary, TriMesh, remesh};
use std::io::Read;
use std::sync::OnceLock;

/// The run that the pages report: a cube of 100 vertices.
fn run() -> &'static (Options, TriMesh, Summary) {
    static RUN: OnceLock<(Options, TriMesh, Summary)> = OnceLock::new();
    RUN.get_or_init(|| {
        let options = Options::new(100).iterations(3).measures(MeasureDepth::Full);
        let result = remesh(device(), &cube(), &options).unwrap();
        (options, result.mesh, result.summary)
    })
}

/// A page of that run, about other meshes, `factor` times as large as those of the run.
fn page_about(meshes: [&TriMesh; 2], factor: f64, names: [&str; 2], note: &str) -> Result<String> {
    page_with(meshes, None, factor, names, note)
}

/// The same with the points that the input was made of.
fn page_with(
    meshes: [&TriMesh; 2],
    points: Option<&[DVec3]>,
    factor: f64,
    names: [&str; 2],
    note: &str,
) -> Result<String> {
    let (options, _, summary) = run();
    let mut summary = summary.clone();
    summary.spacing *= factor;
    let report = Report {
        program: "rtfmesh",
        version: "1",
        input_file: names[0].to_owned(),
        output_file: names[1].to_owned(),
        notes: &[note.to_owned()],
        options,
        device: device().info(),
        summary: &summary,
    };
    page(&PageInput { report: &report, input: meshes[0], points, output: meshes[1] })
}

/// The page of that run, with another input, files of these names, and a note.
fn page_of(input: &TriMesh, names: [&str; 2], note: &str) -> String {
    page_about([input, &run().1], 1.0, names, note).unwrap()
}

/// The contents of all elements that start with `tag`.
fn contents<'a>(page: &'a str, tag: &str, end: &str) -> Vec<&'a str> {
    page.split(tag).skip(1).map(|rest| rest.split(end).next().unwrap()).collect()
}

fn decompressed(base64: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    ZlibDecoder::new(&STANDARD.decode(base64).unwrap()[..]).read_to_end(&mut bytes).unwrap();
    bytes
}

/// Coordinates in 65535ths.
fn coordinates(bytes: &[u8]) -> Vec<DVec3> {
    let number = |k: &[u8]| f64::from(u16::from_le_bytes([k[0], k[1]])) / 65535.0;
    bytes.chunks(6).map(|p| DVec3::new(number(p), number(&p[2..]), number(&p[4..]))).collect()
}

fn attribute(tag: &str, name: &str) -> usize {
    contents(tag, &format!("{name}=\""), "\"")[0].parse().unwrap()
}

/// The mesh in the page, with coordinates from 0 to 1, and the bytes of its faces' qualities and distances.
fn drawn(page: &str, which: usize) -> (TriMesh, [Vec<u8>; 2]) {
    let figure = contents(page, "<figure ", ">")[which];
    let [vertices, faces] = ["data-vertices", "data-faces"].map(|name| attribute(figure, name));
    let bytes = decompressed(contents(page, "class=\"mesh\">", "<")[which]);
    assert_eq!(bytes.len(), 6 * vertices + 14 * faces);
    let (corners, rest) = bytes.split_at(12 * faces);
    let (points, shares) = rest.split_at(6 * vertices);
    let corners: Vec<u32> = corners.chunks(4).map(|k| u32::from_le_bytes(k.try_into().unwrap())).collect();
    let triangles = corners.chunks(3).map(|t| t.try_into().unwrap()).collect();
    let (quality, distance) = shares.split_at(faces);
    (TriMesh { vertices: coordinates(points), triangles }, [quality.to_vec(), distance.to_vec()])
}

#[test]
fn meshes_curves_and_figures_are_in_the_page() {
    let cube = cube();
    let text = page_of(&cube, ["a.ply", "b.ply"], "a remark");
    assert_eq!(text, page_of(&cube, ["a.ply", "b.ply"], "a remark"), "the same bytes");
    for (which, mesh) in [&cube, &run().1].into_iter().enumerate() {
        let (found, [quality, distance]) = drawn(&text, which);
        assert_eq!(found.triangles, mesh.triangles);
        // Both are in the unit cube, but the vertices of the output not to the last bit.
        for (a, b) in found.vertices.iter().zip(&mesh.vertices) {
            assert!(a.abs_diff_eq(*b, 2.0 / 65535.0), "{a} {b}");
        }
        if which == 0 {
            // Right angles; all of the surface in place.
            assert!(quality.iter().all(|q| *q == quality[0] && (100..220).contains(q)), "{quality:?}");
        } else {
            assert!(quality.iter().any(|q| *q > 220) && distance.len() == mesh.triangles.len());
        }
    }
    // The twelve edges of the cube, each as two ends.
    let lines = coordinates(&decompressed(contents(&text, "id=\"lines\">", "<")[0]));
    assert!(lines.len() >= 24 && lines.len().is_multiple_of(2), "{}", lines.len());
    assert!(lines.iter().all(|p| p.to_array().iter().filter(|x| **x == 0.0 || **x == 1.0).count() >= 2));
    for word in [
        "<title>a.ply → b.ply</title>",
        "a remark",
        "Hausdorff to, from reference",
        "peak device memory",
        "last level",
        "iteration 3: ",
        "output, valence 6: ",
        "&#34;feature_angle&#34;: 40",
    ] {
        assert!(text.contains(word), "'{word}' is missing");
    }
    assert!(text.len() < 400_000, "{} bytes", text.len());
}

#[test]
fn points_are_drawn_as_faces_around_them() {
    let cube = cube();
    // Inside of the upper side.
    let at = |k: i32| f64::from(k + 1) / 11.0;
    let points: Vec<DVec3> = (0..100).map(|k| DVec3::new(at(k % 10), at(k / 10), 1.0)).collect();
    let text = page_with([&cube, &run().1], Some(&points), 1.0, ["a.xyz", "b"], "").unwrap();
    let (found, [_, distance]) = drawn(&text, 0);
    assert_eq!(found.triangles.len(), points.len());
    for (t, p) in points.iter().enumerate() {
        let [a, b, c] = found.corners(t);
        assert!((b - a).cross(c - a).normalize().z > 0.99, "outward at {p}");
        let sides = [a.distance(b), b.distance(c), c.distance(a)];
        assert!(sides.iter().all(|side| (side / sides[0] - 1.0).abs() < 1e-3), "{sides:?} around {p}");
    }
    assert!(distance.iter().any(|d| *d != distance[0]), "{distance:?}");
    for word in ["100 points", "Surface through the points", "data-points>"] {
        assert!(text.contains(word), "'{word}' is missing");
    }
    let many: Vec<DVec3> =
        (0..250_000).map(|k| DVec3::new(f64::from(k % 500), f64::from(k / 500), 500.0) / 500.0).collect();
    let text = page_with([&cube, &run().1], Some(&many), 1.0, ["a.xyz", "b"], "").unwrap();
    assert!(text.contains("83\u{202f}334 of them are drawn here"));
}

#[test]
fn nothing_is_loaded_and_no_name_breaks_out() {
    let odd = "x</script><script>alert(1)</script>\"'&<b>.ply";
    let text = page_of(&cube(), [odd, "</title><img src=x onerror=alert(1)>"], "</p><svg onload=alert(1)>");
    let plain = page_of(&cube(), ["a", "b"], "c");
    for tag in ["<script", "</script", "<img", "<b>", "<svg", "</title", "<p", "\"'"] {
        assert_eq!(text.matches(tag).count(), plain.matches(tag).count(), "{tag}");
    }
    assert!(plain.contains("default-src 'none'"));
    for reference in ["http://", "https://", "//cdn", " src=", " href=", "url(", "@import", "fetch("] {
        assert!(!plain.contains(reference), "{reference}");
    }
}

#[test]
fn large_meshes_are_drawn_coarser_and_the_page_says_so() {
    let side = (MOST_FACES as f64 / 2.0).sqrt() as u32 + 20;
    let large = plane(side, 0.5);
    assert!(large.triangles.len() > MOST_FACES);
    let text = page_of(&large, ["a", "b"], "");
    let (found, _) = drawn(&text, 0);
    let faces = found.triangles.len();
    assert!((MOST_FACES / 4..=MOST_FACES).contains(&faces), "{faces}");
    assert!(text.contains("Drawn here with only") && text.len() < 5_000_000, "{}", text.len());
    assert!(found.vertices.iter().all(|p| (p.z - 0.5).abs() < 1e-4), "on the surface");
}

#[test]
fn sizes_beyond_reason_and_bad_meshes_are_no_trouble() {
    for factor in [1e-100, 1e100] {
        let [input, output] = [&cube(), &run().1].map(|mesh| moved(mesh, |v| factor * v));
        let text = page_about([&input, &output], factor, ["a", "b"], "").unwrap();
        let (found, _) = drawn(&text, 0);
        assert_eq!(found, cube(), "from 0 to 1 again");
    }
    let beyond = mesh(&[[0.0; 3], [1.0; 3], [0.0, 1.0, 0.0]], &[[0, 1, 3]]);
    for bad in [TriMesh::default(), beyond] {
        for meshes in [[&cube(), &bad], [&bad, &cube()]] {
            assert!(page_about(meshes, 1.0, ["a", "b"], "").is_err());
        }
    }
}
