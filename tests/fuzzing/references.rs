//! Any text as the address of another file: what lies outside the folder of the file is never read.

use std::path::Path;

use glam::DVec3;
use rtfmesh::Error;
use rtfmesh::io::{Input, Reader, read};

/// An image with a single pixel, as the files inside and outside have it, told apart by its height.
fn image(height: u8) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x01\0\0\0\0\x08\0\0\0\0\0\0\0\0".to_vec();
    bytes[23] = height;
    bytes
}

/// What the file called `name` holds; `size` differs between those that may be read and those that may not.
fn content(name: &str, size: f32) -> Vec<u8> {
    match name {
        "p" => image(size as u8),
        "m" => format!("newmtl m\nKd {} 0 0\n", 1.0 / size).into_bytes(),
        // A triangle, or a volume of its 36 bytes.
        _ => {
            let corners = [[0.0, 0.0, 0.0], [size, 0.0, 0.0], [0.0, size, 0.0]];
            corners.as_flattened().iter().flat_map(|value: &f32| value.to_le_bytes()).collect()
        }
    }
}

/// A scene of one triangle.
fn scene(buffer: &str) -> serde_json::Value {
    serde_json::json!({
        "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": buffer }],
    })
}

fn with_materials(path: &Path) -> rtfmesh::Result<rtfmesh::io::Loaded> {
    Reader::new().materials(true).read(path)
}

/// That images are those inside.
fn check_images(loaded: &rtfmesh::io::Loaded, address: &str) {
    let images: Vec<_> =
        loaded.attributes.materials.iter().flat_map(|materials| materials.images()).collect();
    let is_inside = |bytes: &[u8]| *bytes == *image(1) || address.starts_with("data:");
    assert!(images.iter().all(|found| is_inside(&found.bytes)), "{address}");
    assert!(address != "p" || images.len() == 1, "the one inside is read");
}

/// A triangle of the material `m`.
fn painted(library: &str) -> String {
    format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n")
}

/// The folder `inside`, with files, folders and links out of it, next to the folder `outside`.
pub struct Place(tempfile::TempDir);

impl Place {
    /// Makes the folders, which go with the value.
    pub fn new() -> Self {
        let place = Self(tempfile::tempdir().expect("there is room for temporary files"));
        for folder in ["outside", "inside/folder"] {
            std::fs::create_dir_all(place.path(folder)).expect("folders can be made");
            ["b", "p", "m"].iter().for_each(|name| place.write(&format!("{folder}/{name}"), name, 7.0));
        }
        for name in ["a", "folder/b", "c d", "..b", "p", "m", "folder/p", "folder/m"] {
            place.write(&format!("inside/{name}"), name.rsplit('/').next().unwrap_or(name), 1.0);
        }
        #[cfg(unix)]
        for (to, name) in [("../outside", "inside/o"), ("../outside/b", "inside/l"), ("folder", "inside/f")] {
            std::os::unix::fs::symlink(to, place.path(name)).expect("links can be made");
        }
        place
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, file: &str, name: &str, size: f32) {
        std::fs::write(self.path(file), content(name, size)).expect("files can be written");
    }

    /// Reads files with these bytes as the address of another: of a buffer, an image, a material library, a
    /// picture, the values of a volume.
    pub fn check(&self, data: &[u8]) {
        let address = String::from_utf8_lossy(data);
        self.check_buffer(&address);
        self.check_image(&address);
        self.check_library(&address);
        self.check_picture(&address);
        self.check_values(&address);
    }

    /// A file in the folder `inside`, with this content.
    fn with_file<T>(&self, name: &str, text: &str, read: impl Fn(&Path) -> rtfmesh::Result<T>) -> Option<T> {
        let path = self.path("inside").join(name);
        std::fs::write(&path, text).expect("files can be written");
        match read(&path) {
            Ok(found) => Some(found),
            Err(error @ Error::Input { .. }) => {
                let line = error.to_string();
                assert!(!line.contains(char::is_control) && line.contains(&format!("{name}: ")), "{line:?}");
                None
            }
            Err(other) => panic!("{other:?}"),
        }
    }

    fn check_buffer(&self, address: &str) {
        let Some(loaded) = self.with_file("in.gltf", &scene(address).to_string(), |path| read(path)) else {
            return;
        };
        let expected = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert!(address.starts_with("data:") || loaded.mesh.vertices == expected, "{address}");
    }

    fn check_image(&self, address: &str) {
        let mut scene = scene("a");
        let primitive = &mut scene["meshes"][0]["primitives"][0];
        primitive["material"] = 0.into();
        primitive["attributes"]["TEXCOORD_0"] = 1.into();
        let texture =
            serde_json::json!({ "bufferView": 0, "componentType": 5126, "type": "VEC2", "count": 3 });
        scene["accessors"].as_array_mut().expect("a list").push(texture);
        scene["materials"] =
            serde_json::json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
        scene["textures"] = serde_json::json!([{ "source": 0 }]);
        scene["images"] = serde_json::json!([{ "uri": address }]);
        let loaded = self.with_file("image.gltf", &scene.to_string(), with_materials);
        check_images(&loaded.expect("an image is left out"), address);
    }

    fn check_library(&self, address: &str) {
        let Some(loaded) = self.with_file("in.obj", &painted(address), with_materials) else { return };
        let materials = loaded.attributes.materials.map(|materials| format!("{materials:?}"));
        assert!(address != "m" || materials.is_some(), "the one inside is read");
        // The red of the one outside.
        assert!(!materials.is_some_and(|found| found.contains("0.142")), "{address}");
    }

    fn check_picture(&self, address: &str) {
        let library = self.path("inside/in.mtl");
        std::fs::write(library, format!("newmtl m\nmap_Kd {address}\n")).expect("files can be written");
        let Some(loaded) = self.with_file("picture.obj", &painted("in.mtl"), with_materials) else { return };
        check_images(&loaded, address);
    }

    fn check_values(&self, address: &str) {
        let header = format!(
            "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 3 4\nencoding: raw\ndata file: {address}\n"
        );
        let read = |path: &Path| Reader::new().read_any(path);
        let Some(Input::Volume(volume)) = self.with_file("in.nhdr", &header, read) else {
            assert_ne!(address, "a", "the one inside is read");
            return;
        };
        let bytes: Vec<u8> = volume.values.iter().map(|value| *value as u8).collect();
        assert_ne!(bytes, content("b", 7.0), "{address}");
    }
}
