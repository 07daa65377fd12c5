//! What readers take of memory, counted: never more than 64 MiB and 40 times the unpacked file.

#[path = "../fuzzing/memory.rs"]
mod memory;

use std::path::Path;

use peak_alloc::PeakAlloc;
use rand::{Rng, RngExt, SeedableRng};
use rtfmesh::io::{Encoding, Format, Reader};
use zip::result::ZipResult;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The most bytes that the job had at a time.
fn peak(job: &mut dyn FnMut()) -> usize {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    job();
    MEMORY.peak_usage().saturating_sub(before)
}

/// Just more than lists that double have room for.
const MANY: usize = (1 << 19) + 16;
/// As many that the 64 MiB hardly count.
const VERY_MANY: usize = (1 << 21) + 16;

/// Files of some mebibytes with as much as possible in few bytes; the second part is repeated.
fn dense() -> Vec<(&'static str, Format, Vec<u8>)> {
    let text = |begin: &str, part: &str, times: usize, end: &str| {
        [begin, &part.repeat(times), end].concat().into_bytes()
    };
    let off = |count: usize, body: &str| text(&format!("OFF\n{count} 1 0\n"), body, count, "3 0 1 2\n");
    let objects = |key: &str, part: &str| {
        let begin = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"{key}\":[{{}}");
        text(&begin, part, 2 * MANY, "]}")
    };
    let skinned = "{\"asset\":{\"version\":\"2.0\"},\"meshes\":[{\"primitives\":[]}],\
                   \"nodes\":[{\"mesh\":0,\"skin\":0}";
    let corners = " 1 2 3 4".repeat(MANY / 2);
    vec![
        ("vertices of OBJ", Format::Obj, text("", "v 0 0 0\n", VERY_MANY, "f 1 2 3\n")),
        ("faces of OBJ", Format::Obj, text("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "f 1 2 3\n", VERY_MANY, "")),
        ("corners of an OBJ face", Format::Obj, format!("v 0 0 0\nf{corners}\n").into_bytes()),
        (
            "materials of OBJ",
            Format::Obj,
            text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "g\no\n", 2 * MANY, ""),
        ),
        ("vertices of OFF", Format::Off, off(MANY, "0 0 0\n")),
        ("lines of XYZ", Format::Xyz, text("", "1 2 3\n", MANY, "")),
        ("nodes of glTF", Format::Gltf, objects("nodes", ",{}")),
        ("meshes of glTF", Format::Gltf, objects("meshes", ",{}")),
        ("images of glTF", Format::Gltf, objects("images", ",[]")),
        ("materials of glTF", Format::Gltf, objects("materials", ",{}")),
        ("nodes of a glTF skeleton", Format::Gltf, {
            text(skinned, ",{\"name\":\"abcdefghijklmnopqrstuvwxyz\"}", MANY / 4, "]}")
        }),
        ("animations of glTF", Format::Gltf, {
            let channel = "{\"sampler\":0,\"target\":{\"node\":1,\"path\":\"scale\"}}";
            let begin = format!("{skinned}],\"animations\":[{{\"samplers\":[],\"channels\":[{channel}");
            text(&begin, &format!(",{channel}"), MANY / 4, "]}]}")
        }),
        ("facets of STL", Format::Stl, {
            let facet = "facet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
            text("solid\n", facet, 1 << 16, "endsolid\n")
        }),
    ]
}

/// As [`dense`], for VTK's formats.
fn dense_vtk() -> Vec<(&'static str, Format, Vec<u8>)> {
    let head = |kind: &str, form: &str| format!("# vtk DataFile Version 3.0\nx\n{form}\nDATASET {kind}\n");
    let legacy = |kind: &str, parts: &[(&str, usize)]| {
        let body = parts.iter().map(|(part, times)| part.repeat(*times)).collect::<Vec<_>>().concat();
        [head(kind, "ASCII"), body.replace('#', &MANY.to_string())].concat().into_bytes()
    };
    let four = ("POINTS 4 float 0 0 0 1 0 0 0 1 0 0 0 1\n", 1);
    // One bit for each of many points, which are bytes themselves.
    let bits = [
        format!("{}POINTS {MANY} unsigned_char\n", head("POLYDATA", "BINARY")).into_bytes(),
        vec![7; 3 * MANY],
        format!("\nPOINT_DATA {MANY}\nFIELD f 1\nm 1 {MANY} bit\n").into_bytes(),
        vec![0xaa; MANY / 8],
    ];
    // A polygon with many corners, and numbers of its own.
    let labels = "a 1 1 int\n7\n".repeat(4000);
    let corners: String = (0..20_000).map(|corner| format!("{corner} ")).collect();
    let polygon = format!(
        "{}POINTS 20000 float\n{}POLYGONS 1 20001\n20000 {corners}\nCELL_DATA 1\nFIELD f 4000\n{labels}",
        head("POLYDATA", "ASCII"),
        "0 0 0\n".repeat(20_000)
    );
    let arrays = "<DataArray type=\"Int8\" format=\"ascii\">1</DataArray>".repeat(60_000);
    let xml = format!(
        "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"1\"><PointData>{arrays}</PointData>\
         <Points><DataArray type=\"Int8\" NumberOfComponents=\"3\">1 1 1</DataArray></Points></Piece>\
         </PolyData></VTKFile>"
    );
    vec![
        ("points of VTK", Format::Vtk, legacy("POLYDATA", &[("POINTS # float\n", 1), ("0 0 0\n", MANY)])),
        (
            "cells of VTK",
            Format::Vtk,
            legacy("POLYDATA", &[four, ("POLYGONS # 2097216\n", 1), ("3 0 1 2\n", MANY)]),
        ),
        (
            "tetrahedra of VTK",
            Format::Vtk,
            legacy(
                "UNSTRUCTURED_GRID",
                &[
                    four,
                    ("CELLS # 2621520\n", 1),
                    ("4 0 1 2 3\n", MANY),
                    ("CELL_TYPES #\n", 1),
                    ("10\n", MANY),
                ],
            ),
        ),
        ("bits of VTK", Format::Vtk, bits.concat()),
        ("labels of a polygon of VTK", Format::Vtk, polygon.into_bytes()),
        ("arrays of VTP", Format::Vtp, xml.into_bytes()),
        ("pieces of VTP", Format::Vtp, {
            let piece = "<Piece/>".repeat(2 * MANY);
            format!("<VTKFile type=\"PolyData\"><PolyData>{piece}</PolyData></VTKFile>").into_bytes()
        }),
    ]
}

/// As [`dense`], for 3MF.
fn dense_packages() -> ZipResult<Vec<(&'static str, Format, Vec<u8>)>> {
    // Stored, so that the file has its unpacked length.
    let package = |resources: &str, build: &str| {
        let options = zip::write::SimpleFileOptions::default();
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        zip.start_file("3D/3dmodel.model", options.compression_method(zip::CompressionMethod::Stored))?;
        let model = format!("<model><resources>{resources}</resources><build>{build}</build></model>");
        std::io::Write::write_all(&mut zip, model.as_bytes())?;
        zip.finish().map(std::io::Cursor::into_inner)
    };
    Ok(vec![
        ("items of 3MF", Format::ThreeMf, package("", &"<item objectid=\"1\"/>".repeat(MANY))?),
        ("materials of 3MF", Format::ThreeMf, package(&"<base/>".repeat(MANY), "")?),
        ("objects of 3MF", Format::ThreeMf, {
            let objects: String =
                (0..MANY / 4).map(|k| format!("<object id=\"{k}\"><mesh/></object>")).collect();
            package(&objects, "")?
        }),
        ("triangles of 3MF", Format::ThreeMf, {
            let vertices = "<vertex x=\"0\" y=\"0\" z=\"0\"/>".repeat(MANY / 4);
            let triangles = "<triangle v1=\"0\" v2=\"1\" v3=\"2\" pid=\"1\" p1=\"0\"/>".repeat(MANY / 4);
            package(&format!("<object id=\"1\"><mesh>{vertices}{triangles}</mesh></object>"), "")?
        }),
    ])
}

/// A scene in which many primitives share one accessor.
fn sharing(primitives: usize, mode: u32) -> Vec<u8> {
    let data = vec!["AAAA"; 1 << 12].concat();
    let primitive = format!("{{\"attributes\":{{\"POSITION\":0}},\"mode\":{mode},\"material\":0}}");
    let primitives = vec![primitive; primitives].join(",");
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{{\"mesh\":0}}],\"materials\":[{{}}],\
         \"meshes\":[{{\"primitives\":[{primitives}]}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5121,\"type\":\"VEC3\",\"count\":4095}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":12288}}],\
         \"buffers\":[{{\"byteLength\":12288,\"uri\":\"data:;base64,{data}\"}}]}}"
    )
    .into_bytes()
}

/// A copy with a few faults, as `tests/fuzzing/replay.rs` makes them.
fn changed(seed: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut copy: Vec<u8> = (0..4).map(|_| random.random::<u8>()).collect();
    copy.insert(0, seed.first().copied().unwrap_or_default());
    copy.extend(seed.iter().skip(1));
    for _ in 0..random.random_range(0..4) {
        let at = random.random_range(5..=copy.len());
        let end = (at + random.random_range(0..24)).min(copy.len());
        match random.random_range(0..3) {
            0 => copy[at..end].fill(b"\0\xff09 \n{["[random.random_range(0..8)]),
            1 => drop(copy.drain(at..end)),
            _ => drop(copy.splice(at..at, copy[at..end].to_vec())),
        }
    }
    copy
}

/// How often files are changed; more with RTFMESH_FUZZ_ROUNDS.
fn rounds() -> usize {
    std::env::var("RTFMESH_FUZZ_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(1500)
}

#[test]
fn readers_take_what_the_length_of_the_file_justifies() {
    let mut wrong = Vec::new();
    let mut check = |what: String, format: Format, file: &[u8]| {
        for materials in [false, true] {
            let reader = Reader::new().format(Encoding { format, gzip: false }).materials(materials);
            let taken = peak(&mut || drop(reader.read_any_bytes(file)));
            if taken > (64 << 20) + 40 * file.len() {
                wrong.push(format!("{what}: {taken} bytes for {}, {} each", file.len(), taken / file.len()));
            }
        }
    };
    for (what, format, file) in dense().into_iter().chain(dense_vtk()).chain(dense_packages().unwrap()) {
        check(what.to_owned(), format, &file);
    }
    for (primitives, mode) in [(20_000, 4), (20_000, 5), (20_000, 6)] {
        check(format!("{primitives} primitives of mode {mode}"), Format::Gltf, &sharing(primitives, mode));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    // The seeds of the readers, with a part of them many times.
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/read");
    let mut seeds: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    seeds.sort();
    let seeds: Vec<Vec<u8>> = seeds.iter().map(|seed| std::fs::read(seed).unwrap()).collect();
    assert!(seeds.len() >= 10, "the seeds are missing");
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
    for round in 0..rounds() {
        memory::check(&changed(&seeds[round % seeds.len()], &mut random), &peak);
    }
}
