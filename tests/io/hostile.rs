//! Small files that claim huge contents: refused at once, in one line, with little memory.

use std::io::Write;
use std::time::{Duration, Instant};

use rtfmesh::mesh::samples::sample;
use serde_json::{Value, json};

use crate::support::files::gltf_of;
use crate::support::place::Place;

/// Address space of the program, in KiB: enough for itself and small meshes.
const MEMORY: u64 = 1 << 20;

/// Runs a command that needs no device on a file, in bounded memory; it must refuse the file in one line with
/// a remedy.
#[track_caller]
pub(crate) fn refused(name: &str, content: &[u8], problem: &str) {
    let place = Place::new();
    std::fs::write(place.path(name), content).unwrap();
    for arguments in [format!("inspect {name}"), format!("remesh {name} --dry-run -n 100")] {
        let program = assert_cmd::cargo::cargo_bin!("rtfmesh");
        let start = Instant::now();
        let limited = format!("ulimit -v {MEMORY}; exec \"{}\" {arguments}", program.display());
        let done = std::process::Command::new("sh")
            .args(["-c", &limited])
            .current_dir(place.path("."))
            .output()
            .unwrap();
        let line = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(3), "{arguments}: {line}");
        assert!(line.lines().count() == 1 && line.contains(name) && line.contains("; "), "{line}");
        assert!(line.contains(problem), "'{problem}' is missing in: {line}");
        assert!(start.elapsed() < Duration::from_secs(20), "{name}: {:?}", start.elapsed());
    }
    assert_eq!(place.files(), [name]);
}

/// More than fits memory, more than a signed number holds, the largest number, and more than that.
const COUNTS: [&str; 4] =
    ["1000000000", "9223372036854775808", "18446744073709551615", "99999999999999999999"];

const TRIANGLE: &str = "0 0 0\n1 0 0\n0 1 0\n";

#[test]
fn counts_in_text_headers() {
    for count in COUNTS {
        refused("a.off", format!("OFF\n{count} 1 0\n{TRIANGLE}3 0 1 2\n").as_bytes(), "");
        refused("a.off", format!("OFF\n3 {count} 0\n{TRIANGLE}3 0 1 2\n").as_bytes(), "");
        refused("a.off", format!("OFF\n3 1 0\n{TRIANGLE}{count} 0 1 2\n").as_bytes(), "face 0");
        refused("a.off", format!("OFF\n3 1 0\n{TRIANGLE}3 0 1 {count}\n").as_bytes(), "face 0");
        let medit = |vertices: &str, triangles: &str, index: &str| {
            let places = "0 0 0 0\n1 0 0 0\n0 1 0 0\n";
            format!(
                "MeshVersionFormatted 2\nDimension 3\nVertices {vertices}\n{places}Triangles {triangles}\n1 2 {index} 0\nEnd\n"
            )
        };
        refused("a.mesh", medit(count, "1", "3").as_bytes(), "");
        refused("a.mesh", medit("3", count, "3").as_bytes(), "");
        refused("a.mesh", medit("3", "1", count).as_bytes(), "triangle 1");
        for face in [format!("1 2 {count}"), format!("1 2 -{count}")] {
            let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf {face}\n");
            refused("a.obj", obj.as_bytes(), "line 4");
        }
    }
}

/// A PLY file of a triangle with these counts, and what follows the coordinates.
fn ply(format: &str, [vertices, others, faces]: [&str; 3], list: &str, body: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element other {others}\nproperty list {list} int ids\nelement face {faces}\n\
         property list {list} int vertex_indices\nend_header\n"
    );
    [header.as_bytes(), body].concat()
}

#[test]
fn counts_in_ply_headers_and_lists() {
    let places = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let start: Vec<u8> = match format {
            "ascii" => TRIANGLE.into(),
            "binary_big_endian" => places.iter().flat_map(|value| value.to_be_bytes()).collect(),
            _ => places.iter().flat_map(|value| value.to_le_bytes()).collect(),
        };
        for count in COUNTS {
            for counts in [[count, "0", "1"], ["3", count, "1"], ["3", "0", count]] {
                refused("a.ply", &ply(format, counts, "uint", &start), "");
            }
        }
        // Lists of four billion, of a negative number and of as many as a byte says, in elements read and
        // skipped.
        for (list, bytes) in [("uint", &[0xff; 4][..]), ("int", &[0x80; 4]), ("uchar", &[0xff])] {
            let size: &[u8] = match (format, list) {
                ("ascii", "int") => b"-2147483648 0 1 2\n",
                ("ascii", _) => b"4294967295 0 1 2\n",
                _ => bytes,
            };
            let body = [&start, size].concat();
            refused("a.ply", &ply(format, ["3", "0", "1"], list, &body), "");
            refused("a.ply", &ply(format, ["3", "1", "1"], list, &body), "");
        }
    }
    let many = "element x 18446744073709551615\n";
    let nothing = format!("ply\nformat ascii 1.0\n{many}element vertex 0\nend_header\n");
    refused("a.ply", nothing.as_bytes(), "no vertices");
}

#[test]
fn counts_in_binary_stl() {
    for count in [1_000_000_000, u32::MAX / 3 + 1, u32::MAX] {
        let mut file = vec![0; 80];
        file.extend(count.to_le_bytes());
        file.extend([0; 50]);
        refused("a.stl", &file, "triangles");
    }
}

fn glb(json: &str, lengths: [Option<u32>; 3]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let [total, of_json, of_data] = lengths;
    let honest = 12 + 8 + json.len() as u32 + 8;
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(total.unwrap_or(honest).to_le_bytes());
    file.extend(of_json.unwrap_or(json.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(json);
    file.extend(of_data.unwrap_or(0).to_le_bytes());
    file.extend(b"BIN\0");
    file
}

#[test]
fn counts_in_gltf() {
    let most = u32::MAX;
    let text = gltf_of(&sample("tetrahedron").unwrap());
    for lengths in [[Some(most), None, None], [None, Some(most), None], [None, None, Some(most)]] {
        refused("a.glb", &glb(&text, lengths), "cut off");
    }
    let whole: Value = serde_json::from_str(&text).unwrap();
    let numbers = [json!(1_000_000_000), json!(9_223_372_036_854_775_808_u64), json!(u64::MAX), json!(1e30)];
    for number in numbers {
        for pointer in [
            "/accessors/0/count",
            "/accessors/1/count",
            "/bufferViews/0/byteLength",
            "/bufferViews/1/byteOffset",
            "/buffers/0/byteLength",
            "/scenes/0/nodes/0",
            "/nodes/0/mesh",
            "/meshes/0/primitives/0/indices",
        ] {
            let mut lie = whole.clone();
            *lie.pointer_mut(pointer).unwrap() = number.clone();
            refused("a.gltf", lie.to_string().as_bytes(), "");
        }
        for (pointer, key) in [("/accessors/0", "byteOffset"), ("/bufferViews/0", "byteStride")] {
            let mut lie = whole.clone();
            lie.pointer_mut(pointer).unwrap()[key] = number.clone();
            refused("a.gltf", lie.to_string().as_bytes(), "");
        }
    }
    let deep = format!("{}{}", "[".repeat(1 << 20), "]".repeat(1 << 20));
    refused("a.gltf", format!("{{\"x\":{deep}}}").as_bytes(), "not glTF");
}

/// A few kilobytes that refer to the same data again and again.
#[test]
fn scenes_that_repeat_themselves() {
    let mut scene: Value = serde_json::from_str(&gltf_of(&sample("bumpy-sphere").unwrap())).unwrap();
    let primitive = scene["meshes"][0]["primitives"][0].clone();
    scene["meshes"][0]["primitives"] = Value::Array(vec![primitive; 200]);
    scene["nodes"] = Value::Array(vec![json!({ "mesh": 0 }); 200]);
    scene["scenes"][0]["nodes"] = (0..200).collect();
    refused("a.gltf", scene.to_string().as_bytes(), "repeats its meshes");
}

/// `count` members of gzip, one behind the other, each of as many blanks.
fn bomb(start: &[u8], blanks: usize, count: usize) -> Vec<u8> {
    let packed = |plain: &[u8]| {
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        packer.write_all(plain).unwrap();
        packer.finish().unwrap()
    };
    [packed(start), packed(&vec![b' '; blanks]).repeat(count)].concat()
}

#[test]
fn compressed_files_of_many_gibibytes() {
    // Sixteen mebibytes compress to some sixteen kibibytes.
    for (name, start) in [
        ("a.obj.gz", "v 0 0 0\n"),
        ("a.ply.gz", "ply\nformat ascii 1.0\n"),
        ("a.stl.gz", "solid x\nfacet\n"),
        ("a.off.gz", "OFF\n"),
        ("a.gltf.gz", "{"),
        ("a.glb.gz", "glTF\x02\0\0\0"),
        ("a.mesh.gz", "MeshVersionFormatted 2\n"),
    ] {
        refused(name, &bomb(start.as_bytes(), 16 << 20, 64), "expand to more than");
    }
    // A plausible ratio, but more than fits memory.
    refused("a.off.gz", &bomb(b"OFF\n", 16 << 20, 512), "memory");
}

/// Long lines and lists of names, for which work must not grow with the square of their number.
#[test]
fn many_continued_lines_and_names_take_linear_time() {
    let pieces = format!("v 0 0 0 {}\nf 1 2 3\n", "\\\n".repeat(1 << 20));
    refused("a.obj", pieces.as_bytes(), "there is no vertex");
    let names = |kind: &str| (0..100_000).map(|k| format!("{kind} n{k}\n")).collect::<String>();
    let elements = names("element").replace('\n', " 0\n");
    refused("a.ply", format!("ply\nformat ascii 1.0\n{elements}end_header\n").as_bytes(), "no vertices");
    let header = "ply\nformat ascii 1.0\nelement vertex 0\n";
    let properties = names("property float");
    refused("a.ply", format!("{header}{properties}end_header\n").as_bytes(), "no vertices");
    let values = "0 ".repeat(100_000);
    let one =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    refused("a.ply", format!("{one}{properties}{face}0 0 0 {values}\n3 0 1 2\n").as_bytes(), "no vertex 1");
}

/// Primitives that share one accessor, without indices or with, and nodes that share a mesh of empty ones.
#[test]
fn scenes_whose_primitives_share_their_data() {
    let mut scene: Value = serde_json::from_str(&gltf_of(&sample("bumpy-sphere").unwrap())).unwrap();
    let mut primitive = scene["meshes"][0]["primitives"][0].clone();
    scene["meshes"][0]["primitives"] = Value::Array(vec![primitive.clone(); 5000]);
    refused("a.gltf", scene.to_string().as_bytes(), "repeats its meshes");
    primitive.as_object_mut().unwrap().remove("indices");
    primitive["mode"] = json!(5);
    scene["meshes"][0]["primitives"] = Value::Array(vec![primitive.clone(); 5000]);
    refused("a.gltf", scene.to_string().as_bytes(), "repeats its meshes");
    // No triangle at all, 25 million times.
    let accessors = scene["accessors"].as_array_mut().unwrap();
    accessors.push(json!({ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 0 }));
    let empty = json!({ "attributes": { "POSITION": accessors.len() - 1 } });
    scene["meshes"][0]["primitives"] = Value::Array(vec![empty; 5000]);
    scene["nodes"] = Value::Array(vec![json!({ "mesh": 0 }); 5000]);
    scene["scenes"][0]["nodes"] = (0..5000).collect();
    refused("a.gltf", scene.to_string().as_bytes(), "repeats its meshes");
    let nodes = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{{}}{}]}}", ",{}".repeat(1 << 21));
    refused("a.gltf", nodes.as_bytes(), "too many empty objects");
}

/// A million materials are read in the time of a million lines.
#[test]
fn many_materials_take_linear_time() {
    let names: String = (0..300_000).map(|k| format!("usemtl m{k}\nmtllib l{k}\n")).collect();
    refused("a.obj", format!("v 0 0 0\n{names}f 1 2 3\n").as_bytes(), "there is no vertex");
}
