//! Rendered pictures of meshes.

use crate::support::shapes::{cube, mesh, moved, plane, union};
use glam::DVec3;
use rtfmesh::picture::{Colour, Panel, PictureOptions, View, distance_colours, png, quality_colours};
use rtfmesh::{Error, TriMesh};
use tiny_skia::Pixmap;

const FRONT: View = View { azimuth: 0.0, elevation: 0.0, zoom: 1.0, z_up: false };
const SIZE: [u32; 2] = [120, 90];

fn draw(panels: &[Panel], options: &PictureOptions) -> Pixmap {
    let bytes = png(panels, options).unwrap();
    assert_eq!(bytes, png(panels, options).unwrap(), "the same picture");
    Pixmap::decode_png(&bytes).unwrap()
}

fn plain(mesh: &TriMesh) -> Panel<'_> {
    Panel { mesh, colours: &[], lines: &[], discs: None, outlines: false }
}

fn at(picture: &Pixmap, x: u32, y: u32) -> Colour {
    let colour = picture.pixel(x, y).unwrap();
    [colour.red(), colour.green(), colour.blue()]
}

/// Whether the colour's largest part is this one.
fn is_mostly(colour: Colour, part: usize) -> bool {
    (0..3).all(|k| k == part || colour[k] < colour[part])
}

#[test]
fn a_cube_fills_the_centre_only() {
    let cube = cube();
    let options = PictureOptions { size: SIZE, view: FRONT, edges: false };
    let picture = draw(&[plain(&cube)], &options);
    assert_eq!([picture.width(), picture.height()], SIZE);
    let blue = at(&picture, 60, 45);
    assert!(is_mostly(blue, 2), "{blue:?}");
    for [x, y] in [[0, 0], [119, 89], [10, 45], [109, 45]] {
        assert_eq!(at(&picture, x, y), [255; 3]);
    }
    // Up to the margin, and the same wherever it is.
    assert_ne!(at(&picture, 60, 6), [255; 3]);
    for factor in [1e-150, 1e150] {
        let other = moved(&cube, |v| factor * (v + 3.0));
        assert_eq!(draw(&[plain(&other)], &options).data().len(), picture.data().len());
    }
}

#[test]
fn nearer_faces_cover_farther_ones_in_any_order() {
    // A large face behind many small ones.
    let far = moved(&plane(1, 0.0), |v| 4.0 * v - DVec3::new(1.5, 1.5, 1.0));
    let near = moved(&plane(6, 0.0), |v| v + DVec3::Z);
    let options = PictureOptions { size: SIZE, view: FRONT, edges: false };
    for (mesh, first) in [(union(&far, &near), 2), (union(&near, &far), near.triangles.len())] {
        let is_far = |t: usize| (t < first) == (first == 2);
        let colours: Vec<Colour> =
            (0..mesh.triangles.len()).map(|t| if is_far(t) { [255, 0, 0] } else { [0, 255, 0] }).collect();
        let picture = draw(
            &[Panel { mesh: &mesh, colours: &colours, lines: &[], discs: None, outlines: false }],
            &options,
        );
        assert!(is_mostly(at(&picture, 60, 45), 1), "{:?}", at(&picture, 60, 45));
        assert!(is_mostly(at(&picture, 25, 80), 0), "{:?}", at(&picture, 25, 80));
    }
}

#[test]
fn edges_lines_and_back_sides_differ() {
    let sheet = plane(2, 0.0);
    let mut turned = sheet.clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let options = PictureOptions { size: SIZE, view: FRONT, edges: false };
    let bare = draw(&[plain(&sheet)], &options);
    assert!(is_mostly(at(&bare, 60, 45), 2));
    assert!(is_mostly(at(&draw(&[plain(&turned)], &options), 60, 45), 0), "insides are brown");
    let with_edges = draw(&[plain(&sheet)], &PictureOptions { edges: true, ..options });
    let dark = |picture: &Pixmap| picture.pixels().iter().filter(|p| p.blue() < 120).count();
    assert!(dark(&with_edges) > 100 && dark(&bare) == 0);
    let lines = [[DVec3::new(0.0, 0.25, 0.0), DVec3::new(1.0, 0.25, 0.0)]];
    let with_line = draw(&[Panel { lines: &lines, ..plain(&sheet) }], &options);
    let red = (0..90).filter(|y| at(&with_line, 60, *y) == [214, 60, 40]).count();
    assert!((1..=3).contains(&red), "{red}");
}

#[test]
fn panels_are_side_by_side_and_do_not_overlap() {
    let cube = cube();
    let options = PictureOptions { size: SIZE, view: View { zoom: 3.0, ..FRONT }, edges: false };
    let small = moved(&cube, |v| 0.01 * v + 0.5);
    let picture = draw(&[plain(&cube), plain(&small)], &options);
    assert_eq!([picture.width(), picture.height()], [240, 90]);
    assert!(at(&picture, 119, 45) != [255; 3] && at(&picture, 121, 45) == [255; 3]);
}

#[test]
fn views_rotate_the_mesh() {
    let flat = moved(&plane(1, 0.0), |v| DVec3::new(v.x, v.y, 0.0));
    let seen = |view: View| {
        let picture = draw(&[plain(&flat)], &PictureOptions { size: SIZE, view, edges: false });
        picture.pixels().iter().filter(|p| p.red() != 255).count()
    };
    assert!(seen(FRONT) > 3000);
    assert!(seen(View { azimuth: 90.0, ..FRONT }) < 200, "from the side");
    assert!(seen(View { elevation: 90.0, ..FRONT }) < 200, "from above");
    assert!(seen(View { z_up: true, ..FRONT }) < 200);
    assert!(seen(View { z_up: true, elevation: 90.0, ..FRONT }) > 3000, "from above, where z is up");
}

#[test]
fn colours_show_quality_and_distance() {
    let height = 0.75f64.sqrt();
    let vertices = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, height, 0.0), DVec3::new(0.5, -0.01, 0.0)];
    for factor in [1.0, 1e-200, 1e200] {
        let both = mesh(&vertices.map(|v| (factor * v).to_array()), &[[0, 1, 2], [1, 0, 3]]);
        let [good, bad] = quality_colours(&both)[..] else { panic!() };
        let light = |c: Colour| c.iter().map(|part| u32::from(*part)).sum::<u32>();
        assert!(light(good) > 2 * light(bad), "{good:?} {bad:?}");
    }
    let both = [union(&plane(2, 0.0), &plane(2, 0.5)), plane(2, 0.25), plane(2, 1e-9)];
    let [found, halfway, rounding] = &distance_colours(&both, &plane(3, 0.0)).unwrap()[..] else { panic!() };
    assert_eq!((found.largest, found.colours.len(), halfway.largest), (0.5, 16, 0.25));
    assert!(![found.colours[0], found.colours[8]].contains(&halfway.colours[0]), "one scale for all");
    assert_eq!(rounding.colours[0], found.colours[0]);
    let alone = distance_colours(&both[2..], &plane(3, 0.0)).unwrap();
    let near = alone[0].colours[0].iter().zip(&found.colours[0]).all(|(a, b)| a.abs_diff(*b) < 8);
    assert!(near, "rounding is not far off: {:?}", alone[0].colours[0]);
    assert!(found.colours[..8].iter().all(|c| *c == found.colours[0]));
    assert!(found.colours[8..].iter().all(|c| *c == found.colours[8] && *c != found.colours[0]));
    assert!(distance_colours(&[cube()], &TriMesh::default()).is_err());
}

#[test]
fn invalid_meshes_and_sizes_are_refused() {
    let cube = cube();
    let options = PictureOptions { size: SIZE, view: FRONT, edges: true };
    for size in [[15, 90], [120, 8193], [4100, 90]] {
        let wrong = png(&[plain(&cube), plain(&cube)], &PictureOptions { size, ..options }).unwrap_err();
        assert!(matches!(wrong, Error::Usage { .. }), "{wrong}");
    }
    assert!(matches!(png(&[], &options).unwrap_err(), Error::Usage { .. }));
    let bad = [
        TriMesh::default(),
        mesh(&[[0.0; 3], [1.0; 3], [f64::NAN; 3]], &[[0, 1, 2]]),
        mesh(&[[0.0; 3], [1.0; 3], [0.0, 1.0, 0.0]], &[[0, 1, 3]]),
        mesh(&[[1.0; 3]; 3], &[[0, 1, 2]]),
    ];
    for mesh in bad {
        assert!(matches!(png(&[plain(&mesh)], &options).unwrap_err(), Error::Input { .. }), "{mesh:?}");
    }
}
