//! `rtfmesh render`.

use crate::support::place::Place;
use tiny_skia::Pixmap;

#[test]
fn meshes_are_drawn_side_by_side() {
    let place = Place::new();
    place.run("sample genus3 a.obj");
    place.run("sample box b.ply");
    let (text, errors) = place.run("render a.obj b.ply both.png --color quality --curves --size 200x150");
    assert!(text.is_empty() && errors.is_empty(), "{text}{errors}");
    let picture = Pixmap::load_png(place.path("both.png")).unwrap();
    assert_eq!([picture.width(), picture.height()], [400, 150]);
    let drawn = picture.pixels().iter().filter(|p| p.red() < 250).count();
    assert!((2000..50_000).contains(&drawn), "{drawn}");
    let (_, errors) = place.run("render b.ply off.png --color distance --against a.obj");
    assert!(errors.contains("b.ply: largest distance"), "{errors}");
}

#[test]
fn mistakes_are_told_and_nothing_is_written() {
    let place = Place::new();
    place.run("sample box a.ply");
    place.run("sample box b.ply");
    let before = std::fs::read(place.path("b.ply")).unwrap();
    for (line, code, word) in [
        ("render a.ply b.ply", 2, ".png"),
        ("render a.ply", 2, "<MESHES>"),
        ("render a.ply x.png --size 10x10", 2, "16 pixels"),
        ("render a.ply x.png --size big", 2, "720x540"),
        ("render a.ply x.png --zoom 0", 2, "--zoom 0"),
        ("render a.ply x.png --color distance", 2, "--against"),
        ("render a.ply x.png --against b.ply", 2, "--color distance"),
        ("render none.ply x.png", 3, "none.ply"),
        ("render - - x.png", 2, "standard input"),
        ("render a.ply no/x.png", 1, "no"),
    ] {
        let refused = place.program(line).assert().code(code);
        let errors = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
        assert!(errors.starts_with("error: ") && errors.contains(word), "{line}: {errors}");
        assert_eq!(errors.lines().count(), 1, "{line}: {errors}");
    }
    assert_eq!(std::fs::read(place.path("b.ply")).unwrap(), before);
    assert!(!place.path("x.png").exists());
}
