//! Files that a file names: in its folder or below, of the kind that they claim to be, and told of.

use std::path::Path;

use predicates::prelude::*;
use rtfmesh::io::{Reader, read};
use serde_json::{Value, json};

use crate::support::files::gltf_of;
use crate::support::painted::{checker, one, sphere, textured};
use crate::support::place::Place;
use rtfmesh::mesh::samples::sample;

const SECRET: &str = "the password is swordfish";

/// A scene whose buffer is in the file with this address.
fn scene(uri: &str) -> (Value, Vec<u8>) {
    let mut json: Value = serde_json::from_str(&gltf_of(&sample("box").unwrap())).unwrap();
    let data = json["buffers"][0]["uri"].as_str().unwrap().split_once(',').unwrap().1.to_owned();
    json["buffers"][0]["uri"] = json!(uri);
    (json, base64::Engine::decode(&base64::engine::general_purpose::STANDARD, data).unwrap())
}

/// The folder `inside` with `in.gltf`, and its buffer `outside/data.bin`.
fn place(uri: &str) -> Place {
    let place = Place::new();
    std::fs::create_dir(place.path("inside")).unwrap();
    std::fs::create_dir(place.path("outside")).unwrap();
    let (json, data) = scene(uri);
    std::fs::write(place.path("inside/in.gltf"), json.to_string()).unwrap();
    std::fs::write(place.path("outside/data.bin"), data).unwrap();
    place
}

fn refused(path: &Path, words: &str) {
    let error = read(path).unwrap_err().to_string();
    assert!(error.contains(words) && error.contains("files_from"), "{error}");
}

#[test]
fn a_buffer_outside_the_folder_needs_to_be_allowed() {
    let up = place("../outside/data.bin");
    refused(&up.path("inside/in.gltf"), "it is in '../outside/data.bin', outside the folder of the file");
    let told = predicate::str::contains("allow its folder by --files-from");
    up.program("inspect inside/in.gltf").assert().code(3).stderr(told);
    let line = "inspect inside/in.gltf --files-from outside";
    let told = predicate::str::contains("files that it refers to were read: ../outside/data.bin");
    up.program(line).assert().success().stdout(told);
    // Nor does another folder help.
    std::fs::create_dir(up.path("third")).unwrap();
    up.program("inspect inside/in.gltf --files-from third").assert().code(3);
    let whole = up.path("outside/data.bin").canonicalize().unwrap();
    let absolute = place(whole.to_str().unwrap());
    refused(&absolute.path("inside/in.gltf"), "outside the folder");
    let options = Reader::new().files_from(Some(up.path("outside")));
    options.read_any(absolute.path("inside/in.gltf")).unwrap();
    for address in ["https://example.com/data.bin", "file:///etc/passwd", "C:/data.bin"] {
        let url = place(address);
        let path = url.path("inside/in.gltf");
        refused(&path, "outside the folder");
        assert!(options.read_any(path).unwrap_err().to_string().contains("outside the folder"));
    }
}

#[cfg(unix)]
#[test]
fn links_must_not_lead_out_of_the_folder() {
    use std::os::unix::fs::symlink;
    let place = place("data.bin");
    symlink("../outside/data.bin", place.path("inside/data.bin")).unwrap();
    refused(&place.path("inside/in.gltf"), "it is in 'data.bin', outside the folder");
    std::fs::remove_file(place.path("inside/data.bin")).unwrap();
    // A link to a folder, and one that stays inside.
    let (json, data) = scene("folder/data.bin");
    std::fs::write(place.path("inside/in.gltf"), json.to_string()).unwrap();
    symlink("../outside", place.path("inside/folder")).unwrap();
    refused(&place.path("inside/in.gltf"), "outside the folder");
    std::fs::remove_file(place.path("inside/folder")).unwrap();
    std::fs::create_dir(place.path("inside/real")).unwrap();
    std::fs::write(place.path("inside/real/data.bin"), data).unwrap();
    symlink("real", place.path("inside/folder")).unwrap();
    let loaded = read(place.path("inside/in.gltf")).unwrap();
    assert_eq!(loaded.notes, ["files that it refers to were read: folder/data.bin"]);
}

#[test]
fn what_is_no_image_does_not_get_into_a_result() {
    let place = Place::new();
    std::fs::write(place.path("secret.txt"), SECRET).unwrap();
    let image = json!({ "uri": "secret.txt", "mimeType": "image/png" });
    std::fs::write(place.path("in.gltf"), sphere(one, textured(image)).to_string()).unwrap();
    let loaded = Reader::new().materials(true).read(place.path("in.gltf")).unwrap();
    assert!(loaded.attributes.materials.unwrap().images().is_empty());
    assert!(loaded.notes.iter().any(|note| note.contains("image 0 was left out: it is not an image")));
    place.run("remesh in.gltf out.glb -n 100 --iterations 2 --quality draft --keep-uv");
    let written = place.bytes("out.glb");
    assert!(!written.windows(8).any(|part| part == b"password"), "the text is in the result");
    // A picture is carried, and the report has its name.
    std::fs::write(place.path("secret.txt"), checker(0)).unwrap();
    place.run("remesh in.gltf out.glb -n 100 --iterations 2 --quality draft --keep-uv --report out.json");
    let notes = place.json("out.json")["notes"].to_string();
    assert!(notes.contains("files that it refers to were read: secret.txt"), "{notes}");
}

#[test]
fn a_file_that_many_buffers_name_is_in_memory_once() {
    let place = place("data.bin");
    let (mut json, data) = scene("data.bin");
    let buffer = json["buffers"][0].clone();
    json["buffers"] = Value::Array(vec![buffer; 1000]);
    std::fs::write(place.path("inside/in.gltf"), json.to_string()).unwrap();
    std::fs::write(place.path("inside/data.bin"), data).unwrap();
    let loaded = read(place.path("inside/in.gltf")).unwrap();
    assert_eq!(loaded.notes, ["files that it refers to were read: data.bin"]);
}
