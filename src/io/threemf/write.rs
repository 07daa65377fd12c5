//! Writes 3MF files: an object for each part, with its materials.

use std::collections::HashMap;
use std::io;
use std::io::{BufWriter, Cursor, Write};

use quick_xml::escape::escape;
use serde_json::Value;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::{RELATIONSHIPS, USUAL_MODEL};
use crate::TriMesh;
use crate::io::text::write_number;
use crate::mesh::attributes::{Attribute, Attributes};

const TYPES: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\
    <Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\
    <Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>\
    </Types>\n";
const ROOT: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\
    <Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" \
    Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n";
/// The number of the materials, which come before the objects.
const MATERIALS: usize = 1;

/// A name without control characters, which XML cannot have.
fn plain(name: &str) -> String {
    name.replace(char::is_control, " ")
}

/// The label of one number that names parts or materials.
fn label<'a>(attributes: &'a Attributes, name: &str) -> Option<&'a Attribute> {
    attributes.face_named(name).filter(|label| label.components == 1 && !label.names.is_empty())
}

fn number(label: &Attribute, triangle: usize) -> usize {
    label.at(triangle).first().map_or(0, |value| *value as usize)
}

/// Writes a mesh, in millimetres.
pub(crate) fn write(file: &mut dyn Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    // Numbers as text, three or more a vertex and a triangle.
    let is_large = (mesh.vertices.len() + mesh.triangles.len()) as u64 * 100 > u64::from(u32::MAX);
    // Without the time, so that the same mesh gives the same bytes.
    let options = SimpleFileOptions::default()
        .last_modified_time(zip::DateTime::default())
        .compression_method(zip::CompressionMethod::Deflated)
        .large_file(is_large);
    for (name, text) in [("[Content_Types].xml", TYPES), (RELATIONSHIPS, ROOT)] {
        zip.start_file(name, options)?;
        zip.write_all(text.as_bytes())?;
    }
    zip.start_file(USUAL_MODEL, options)?;
    let mut model = BufWriter::new(zip);
    write_model(&mut model, mesh, attributes)?;
    let zip = model.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.write_all(zip.finish()?.get_ref())
}

fn write_model(file: &mut impl Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    writeln!(
        file,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n<resources>"
    )?;
    let material = label(attributes, "material");
    if let Some(label) = material {
        writeln!(file, "<basematerials id=\"{MATERIALS}\">")?;
        for (index, name) in label.names.iter().enumerate() {
            let name = if name.is_empty() { "none".to_owned() } else { plain(name) };
            let colour = display_colour(attributes, index);
            writeln!(file, "<base name=\"{}\" displaycolor=\"{colour}\"/>", escape(name.as_str()))?;
        }
        writeln!(file, "</basematerials>")?;
    }
    let part = label(attributes, "object");
    let mut order: Vec<usize> = (0..mesh.triangles.len()).collect();
    let part_of = |t: usize| part.map_or(0, |label| number(label, t));
    order.sort_by_key(|t| part_of(*t));
    let parts: Vec<&[usize]> = order.chunk_by(|a, b| part_of(*a) == part_of(*b)).collect();
    for (index, triangles) in parts.iter().enumerate() {
        let number = triangles.first().map_or(0, |t| part_of(*t));
        let name = part.and_then(|label| label.names.get(number)).filter(|name| !name.is_empty());
        let name = name.map_or(String::new(), |name| format!(" name=\"{}\"", escape(plain(name).as_str())));
        let default = material.map_or(String::new(), |_| format!(" pid=\"{MATERIALS}\" pindex=\"0\""));
        writeln!(file, "<object id=\"{}\" type=\"model\"{name}{default}>\n<mesh>", index + MATERIALS + 1)?;
        write_part(file, mesh, triangles, material)?;
        writeln!(file, "</mesh>\n</object>")?;
    }
    writeln!(file, "</resources>\n<build>")?;
    for index in 0..parts.len() {
        writeln!(file, "<item objectid=\"{}\"/>", index + MATERIALS + 1)?;
    }
    writeln!(file, "</build>\n</model>")
}

/// The vertices that these triangles use, and the triangles.
fn write_part(
    file: &mut impl Write,
    mesh: &TriMesh,
    triangles: &[usize],
    material: Option<&Attribute>,
) -> io::Result<()> {
    let mut numbers: HashMap<u32, usize> = HashMap::new();
    writeln!(file, "<vertices>")?;
    for vertex in triangles.iter().flat_map(|t| mesh.triangles[*t]) {
        let next = numbers.len();
        if *numbers.entry(vertex).or_insert(next) < next {
            continue;
        }
        write!(file, "<vertex")?;
        for (axis, value) in ["x", "y", "z"].iter().zip(mesh.vertices[vertex as usize].to_array()) {
            write!(file, " {axis}=\"")?;
            write_number(file, value)?;
            write!(file, "\"")?;
        }
        writeln!(file, "/>")?;
    }
    writeln!(file, "</vertices>\n<triangles>")?;
    for t in triangles {
        let [a, b, c] = mesh.triangles[*t].map(|vertex| numbers[&vertex]);
        write!(file, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"")?;
        if let Some(label) = material {
            write!(file, " pid=\"{MATERIALS}\" p1=\"{}\"", number(label, *t).min(label.names.len() - 1))?;
        }
        writeln!(file, "/>")?;
    }
    writeln!(file, "</triangles>")
}

/// The colour of a material as `#RRGGBBAA`, grey if it is not known.
fn display_colour(attributes: &Attributes, index: usize) -> String {
    let material = attributes.materials.as_ref().and_then(|all| all.materials.get(index));
    let factor = material.and_then(|material| material.pointer("/pbrMetallicRoughness/baseColorFactor"));
    let shade = |k: usize| factor.and_then(|factor| factor.get(k)).and_then(Value::as_f64);
    let byte = |value: f64| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
    let [r, g, b] = [0, 1, 2].map(|k| {
        let linear = shade(k).unwrap_or(0.216);
        byte(if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 })
    });
    format!("#{r:02X}{g:02X}{b:02X}{:02X}", byte(shade(3).unwrap_or(1.0)))
}
