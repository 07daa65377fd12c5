//! Any text as the address of a buffer: what lies outside the folder of the file is never read.

use std::path::PathBuf;
use std::sync::LazyLock;

use glam::DVec3;
use rtfmesh::Error;
use rtfmesh::io::read;

/// The folder `inside`, with files, folders and links out of it, next to the folder `outside`.
static PLACE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let place = tempfile::tempdir().expect("there is room for temporary files");
    let path = |name: &str| place.path().join(name);
    let triangle = |size: f32| {
        let corners = [[0.0, 0.0, 0.0], [size, 0.0, 0.0], [0.0, size, 0.0]];
        corners.as_flattened().iter().flat_map(|value: &f32| value.to_le_bytes()).collect::<Vec<u8>>()
    };
    for folder in ["outside", "inside/folder"] {
        std::fs::create_dir_all(path(folder)).expect("folders can be made");
        std::fs::write(path(folder).join("b"), triangle(7.0)).expect("files can be written");
    }
    for name in ["inside/a", "inside/folder/b", "inside/c d", "inside/..b"] {
        std::fs::write(path(name), triangle(1.0)).expect("files can be written");
    }
    #[cfg(unix)]
    for (to, name) in [("../outside", "inside/o"), ("../outside/b", "inside/l"), ("folder", "inside/f")] {
        std::os::unix::fs::symlink(to, path(name)).expect("links can be made");
    }
    place
});

/// Reads a scene whose buffer has these bytes as its address.
pub fn check(data: &[u8]) {
    let address = String::from_utf8_lossy(data);
    let scene = serde_json::json!({
        "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": address }],
    });
    let path: PathBuf = PLACE.path().join("inside/in.gltf");
    std::fs::write(&path, scene.to_string()).expect("files can be written");
    match read(&path) {
        Ok(loaded) => {
            let expected = [DVec3::ZERO, DVec3::X, DVec3::Y];
            assert!(address.starts_with("data:") || loaded.mesh.vertices == expected, "{address}");
        }
        Err(error @ Error::Input { .. }) => {
            let line = error.to_string();
            assert!(!line.contains(char::is_control) && line.contains("in.gltf: "), "{line:?}");
        }
        Err(other) => panic!("{other:?}"),
    }
}
