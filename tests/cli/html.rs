//! `rtfmesh remesh --html`.

use crate::support::place::Place;

#[test]
fn the_page_is_written_beside_the_mesh() {
    let place = Place::with("box");
    let told = place.run("remesh in.ply out.ply -n 60 --iterations 2 --html page.html -q");
    assert_eq!(told, (String::new(), String::new()));
    assert_eq!(place.files(), ["in.ply", "out.ply", "page.html"]);
    let page = std::fs::read_to_string(place.path("page.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    assert!(page.contains("<title>in.ply → out.ply</title>") && page.contains("Hausdorff"));
}

#[test]
fn pages_overwrite_nothing_and_need_a_place() {
    let place = Place::with("box");
    let before = std::fs::read(place.path("in.ply")).unwrap();
    std::fs::write(place.path("lines.obj"), "v 0 0 0\nv 1 0 0\nl 1 2\n").unwrap();
    for (options, code, word) in [
        ("--html in.ply", 2, "--html"),
        ("--html out.ply", 2, "--html"),
        ("--html r.json --report ./r.json", 2, "--html"),
        ("--html lines.obj --features lines.obj", 2, "--features"),
        ("--html no/page.html", 1, "no"),
    ] {
        let refused = place.program(&format!("remesh in.ply out.ply -n 60 {options}")).assert().code(code);
        let errors = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
        assert!(errors.starts_with("error: ") && errors.contains(word), "{options}: {errors}");
        assert_eq!(errors.lines().count(), 1, "{options}: {errors}");
    }
    assert_eq!(place.files(), ["in.ply", "lines.obj"]);
    assert_eq!(std::fs::read(place.path("in.ply")).unwrap(), before);
}
