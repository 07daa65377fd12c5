//! Any bytes read as a mesh file.

use rtfmesh::Error;
use rtfmesh::io::{Encoding, Format, Input, Loaded, Reader, Writer, lost_precision_note};

/// The format for the first byte of the data: each one in turn, then none, as for standard input.
fn declared(kind: u8) -> Option<Format> {
    let kinds = Format::ALL.len() + 1;
    Format::ALL.get(usize::from(kind) % kinds).copied()
}

/// Reads the data behind the first byte as a file of the kind that the first byte says. It must be refused
/// with one line and a remedy, or be a mesh that can be written and read again.
pub fn check(data: &[u8]) {
    let Some((kind, file)) = data.split_first() else { return };
    let declared = declared(*kind).map(|format| Encoding { format, gzip: false });
    check_volume(file, declared);
    match Reader::new().format(declared).read_bytes(file) {
        Ok(loaded) => {
            check_loaded(&loaded);
            check_materials(file, &loaded);
        }
        Err(error) => {
            let line = error.to_string();
            assert!(!line.contains('\n') && line.chars().count() < 400, "{line}");
            match error {
                Error::Input { path: None, remedy, .. } => assert!(!remedy.is_empty(), "{line}"),
                other => panic!("{other:?}"),
            }
        }
    }
}

/// What is read as a volume must be whole.
fn check_volume(file: &[u8], declared: Option<Encoding>) {
    let read = Reader::new().format(declared).read_any_bytes(file);
    let Ok(Input::Volume(volume)) = read else { return };
    assert_eq!(volume.values.len(), volume.size.iter().product::<usize>());
    assert!(volume.size.iter().all(|nodes| *nodes >= 2) && volume.frame.is_finite());
}

fn check_loaded(loaded: &Loaded) {
    let Loaded { mesh, attributes, notes, .. } = loaded;
    let count = mesh.vertices.len();
    assert!(count > 0 && !mesh.triangles.is_empty());
    assert!(mesh.vertices.iter().all(|vertex| vertex.is_finite()));
    assert!(mesh.triangles.as_flattened().iter().all(|vertex| (*vertex as usize) < count));
    for (all, elements) in [(&attributes.vertex, count), (&attributes.face, mesh.triangles.len())] {
        for attribute in all {
            assert_eq!(attribute.values.len(), attribute.components * elements, "{}", attribute.name);
        }
    }
    if let Some(uv) = &attributes.uv {
        assert_eq!(uv.values.len(), 3 * mesh.triangles.len());
    }
    for note in notes {
        assert!(!note.is_empty() && !note.contains('\n'), "{note:?}");
    }
    // Triangles of STL and glTF may have a vertex twice, which faces of the other formats may not.
    if mesh.triangles.iter().any(|[a, b, c]| a == b || b == c || c == a) {
        return;
    }
    // Formats with 64-bit numbers return the same bits; STL must at least not fail.
    for format in [Format::Ply, Format::Off, Format::Medit, Format::Vtp, Format::Vtk] {
        let again = again(loaded, format);
        assert_eq!(again.mesh, *mesh, "{}", format.name());
    }
    let rounded = mesh.vertices.iter().any(|vertex| !vertex.as_vec3().is_finite());
    if !rounded && lost_precision_note(mesh, Format::Stl).is_none() {
        assert_eq!(again(loaded, Format::Stl).mesh.triangles.len(), mesh.triangles.len());
    }
}

/// Materials change nothing else, and are the same after writing and reading a GLB file.
fn check_materials(file: &[u8], plain: &Loaded) {
    let Ok(loaded) = Reader::new().materials(true).read_bytes(file) else { return };
    let Some(materials) = &loaded.attributes.materials else { return };
    assert_eq!(loaded.mesh, plain.mesh);
    let glb = Encoding { format: Format::Glb, gzip: false };
    let writer = Writer::new().attributes(&loaded.attributes).encoding(glb);
    let Ok(bytes) = writer.encode("again", &loaded.mesh) else { return };
    let again = Reader::new().format(glb).materials(true).read_bytes(&bytes);
    let again = again.expect("what was written can be read");
    assert!(again.attributes.materials.is_none_or(|again| again.images().len() == materials.images().len()));
    // What is written is valid glTF.
    assert!(!again.notes.iter().any(|note| note.contains("left out")), "{:?}", again.notes);
}

fn again(loaded: &Loaded, format: Format) -> Loaded {
    let encoding = Encoding { format, gzip: false };
    let bytes = Writer::new().encoding(encoding).encode("again", &loaded.mesh);
    let bytes = bytes.expect("what was read can be written");
    Reader::new().format(encoding).read_bytes(&bytes).expect("what was written can be read")
}
