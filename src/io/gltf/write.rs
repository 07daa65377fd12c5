//! Writes a mesh as one `.glb` file.

use std::collections::HashMap;
use std::io;
use std::io::Write;

use glam::DVec3;
use serde_json::{Value, json};

use super::tangents::{TexturedMesh, needs_tangents};
use super::write_materials::writable_materials;
use super::write_skin::skin_parts;
use super::{tangents, write_materials, write_skin};
use crate::TriMesh;
use crate::io::binary::append_le;
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};

/// Positions farther from the origin than this many times the longest side of the bounding box need a node's
/// translation, because they lose digits in f32.
const FAR: f64 = 2.0;
/// If half the longest side is out of this range, a node's scale keeps products of lengths within f32.
const SMALLEST: f64 = 1e-9;
const LARGEST: f64 = 1e9;

/// Bytes before the JSON, and of the header of the binary chunk.
const HEADER: u64 = 20;
const CHUNK_HEADER: u64 = 8;

/// Targets of buffer views.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
/// More labels without names than this are not taken for materials.
const MAX_UNNAMED_MATERIALS: usize = 1 << 16;

/// The transform of the node, from positions in the buffer to those of the mesh.
pub(super) struct NodeTransform {
    pub translation: DVec3,
    pub scale: f64,
}

impl NodeTransform {
    fn for_mesh(mesh: &TriMesh) -> Self {
        let [low, high] = mesh.bounds().unwrap_or_default();
        // Halved first, because the difference can overflow.
        let half = 0.5 * high - 0.5 * low;
        let largest = half.max_element();
        let is_far = low.abs().max(high.abs()).max_element() > 2.0 * FAR * largest;
        // Positions that f32 holds exactly stay as they are.
        let needs_translation =
            is_far && mesh.vertices.iter().any(|vertex| vertex.as_vec3().as_dvec3() != *vertex);
        let needs_scale = largest > 0.0 && !(SMALLEST..LARGEST).contains(&largest);
        let translation = if needs_translation || needs_scale {
            round_centre(0.5 * low + 0.5 * high, largest)
        } else {
            DVec3::ZERO
        };
        // A power of two, so that no digit is lost.
        let scale = if needs_scale { largest.log2().floor().clamp(-1022.0, 1023.0).exp2() } else { 1.0 };
        Self { translation, scale }
    }

    fn to_buffer(&self, position: DVec3) -> [f32; 3] {
        ((position - self.translation) / self.scale).as_vec3().to_array()
    }

    /// The position that readers get for one in the buffer.
    fn apply(&self, position: [f32; 3]) -> DVec3 {
        DVec3::from_array(position.map(f64::from)) * self.scale + self.translation
    }

    fn node(&self, is_skinned: bool) -> Value {
        let mut node = json!({ "mesh": 0 });
        if is_skinned {
            // Its skin has the transform, since readers ignore that of the node.
            node["skin"] = json!(0);
            return node;
        }
        if self.translation != DVec3::ZERO {
            node["translation"] = json!(self.translation.to_array());
        }
        if self.scale != 1.0 {
            node["scale"] = json!([self.scale, self.scale, self.scale]);
        }
        node
    }
}

/// The centre on a grid about as fine as the mesh is large: it stays the same when positions are rounded, and
/// has few digits, so that adding it to them loses none.
fn round_centre(centre: DVec3, half_size: f64) -> DVec3 {
    /// Beyond, there is nothing left to round.
    const INTEGERS: f64 = (1_u64 << 52) as f64;
    let step = (0.5 * half_size).log2().floor().exp2();
    let round = |x: f64| if (x / step).abs() < INTEGERS { (x / step).round() * step } else { x };
    if step > 0.0 { DVec3::from_array(centre.to_array().map(round)) } else { centre }
}

/// The positions as readers of the file get them.
pub(crate) fn rounded_positions(mesh: &TriMesh) -> Vec<DVec3> {
    let transform = NodeTransform::for_mesh(mesh);
    mesh.vertices.iter().map(|vertex| transform.apply(transform.to_buffer(*vertex))).collect()
}

/// Bytes of the positions and of the indices, and at most those of attributes.
fn data_bytes(mesh: &TriMesh, attributes: &Attributes) -> u64 {
    let (vertices, corners) = (mesh.vertices.len() as u64, 3 * mesh.triangles.len() as u64);
    // With texture seams, every corner may need a vertex of its own.
    let split = if attributes.uv.is_some() { vertices + corners } else { vertices };
    let colour = if attributes.vertex_role(Role::Colour).is_some() { 16 } else { 0 };
    let normal = if attributes.vertex_role(Role::Normal).is_some() { 12 } else { 0 };
    let uv = if attributes.uv.is_some() { 8 } else { 0 };
    let materials = writable_materials(attributes).map_or(0, write_materials::byte_length);
    let tangent = if tangent_normals(attributes).is_some() { tangents::VERTEX_BYTES } else { 0 };
    let influences = if attributes.skin.is_some() { write_skin::VERTEX_BYTES } else { 0 };
    let skeleton = attributes.skin.as_ref().map_or(0, write_skin::byte_length);
    split * (12 + colour + normal + uv + tangent + influences) + 4 * corners + materials + skeleton
}

/// Upper bound for the bytes of the file, except for a few kilobytes of JSON.
pub(crate) fn byte_length(mesh: &TriMesh, attributes: &Attributes) -> u64 {
    HEADER + CHUNK_HEADER + data_bytes(mesh, attributes)
}

/// The mesh with vertices split at texture seams, so that each has one texture coordinate.
struct SplitMesh {
    /// The mesh's vertex that each is a copy of: first all of the mesh's own, then the copies at seams.
    original: Vec<u32>,
    /// Texture coordinates of each, if there are any.
    uv: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl SplitMesh {
    fn new(mesh: &TriMesh, attributes: &Attributes) -> Self {
        let mut original: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        let Some(corners) = &attributes.uv else {
            return Self { original, uv: Vec::new(), triangles: mesh.triangles.clone() };
        };
        let mut uv: Vec<Option<[f64; 2]>> = vec![None; original.len()];
        let mut copies: HashMap<(u32, [u64; 2]), u32> = HashMap::new();
        let mut triangles = mesh.triangles.clone();
        for (vertex, own) in triangles.as_flattened_mut().iter_mut().zip(&corners.values) {
            let Some(first) = uv.get_mut(*vertex as usize) else { continue };
            if *first.get_or_insert(*own) == *own {
                continue;
            }
            let own_vertex = *vertex;
            *vertex = *copies.entry((own_vertex, own.map(f64::to_bits))).or_insert_with(|| {
                original.push(own_vertex);
                uv.push(Some(*own));
                original.len() as u32 - 1
            });
        }
        Self { original, uv: uv.into_iter().map(Option::unwrap_or_default).collect(), triangles }
    }
}

/// The triangles grouped by the number of their material; one group if the mesh has no materials.
fn group_by_material(attributes: &Attributes, triangles: usize) -> Vec<(Option<usize>, Vec<usize>)> {
    let Some(label) = attributes.face_named("material").filter(|label| label.components == 1) else {
        return vec![(None, (0..triangles).collect())];
    };
    let mut order: Vec<usize> = (0..triangles).collect();
    let number = |t: usize| label.at(t).first().map_or(0, |value| *value as i64);
    order.sort_by_key(|t| number(*t));
    let runs = order.chunk_by(|a, b| number(*a) == number(*b));
    let material = |run: &[usize]| run.first().and_then(|t| usize::try_from(number(*t)).ok());
    runs.map(|run| (material(run), run.to_vec())).collect()
}

/// The binary buffer with its views and accessors.
#[derive(Default)]
pub(super) struct BufferBuilder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl BufferBuilder {
    /// Adds an accessor for the bytes from `begin` on; returns its index.
    fn add_accessor(
        &mut self,
        begin: usize,
        stride: Option<usize>,
        target: Option<u32>,
        accessor: Value,
    ) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": begin, "byteLength": self.bytes.len() - begin });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        let mut accessor = accessor;
        accessor["bufferView"] = json!(self.views.len());
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds numbers, vectors or, with 16 numbers each, matrices; returns the index of their accessor.
    pub(super) fn add_floats<const N: usize>(
        &mut self,
        values: impl Iterator<Item = [f32; N]>,
        bounds: bool,
        target: Option<u32>,
    ) -> usize {
        let (mut low, mut high) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        let (begin, mut count) = (self.bytes.len(), 0);
        for element in values {
            count += 1;
            for ((low, high), value) in low.iter_mut().zip(&mut high).zip(element) {
                (*low, *high) = (low.min(value), high.max(value));
                self.bytes.extend(value.to_le_bytes());
            }
        }
        let kind = match N {
            1 => "SCALAR".to_owned(),
            16 => "MAT4".to_owned(),
            _ => format!("VEC{N}"),
        };
        let mut accessor = json!({ "componentType": 5126, "type": kind, "count": count });
        if bounds {
            // Exact in f64, and so in JSON.
            accessor["min"] = json!(low.map(f64::from).as_slice());
            accessor["max"] = json!(high.map(f64::from).as_slice());
        }
        self.add_accessor(begin, None, target, accessor)
    }

    fn add_colours(&mut self, colour: &Attribute, of: &[u32]) -> usize {
        let (kind, code, size) = match colour.kind {
            Kind::U8 => (Kind::U8, 5121, 1),
            Kind::U16 => (Kind::U16, 5123, 2),
            _ => (Kind::F32, 5126, 4),
        };
        let largest = kind.range().map_or(1.0, |[_, high]| high);
        let begin = self.bytes.len();
        // glTF aligns vertex attributes to four bytes.
        let stride = (colour.components * size).next_multiple_of(4);
        for (index, v) in of.iter().enumerate() {
            let shades = colour.unit_colour(*v as usize);
            shades.iter().take(colour.components).for_each(|shade| {
                append_le(&mut self.bytes, kind, kind.rounded(shade * largest));
            });
            self.bytes.resize(begin + (index + 1) * stride, 0);
        }
        let mut accessor =
            json!({ "componentType": code, "type": format!("VEC{}", colour.components), "count": of.len() });
        if kind != Kind::F32 {
            accessor["normalized"] = json!(true);
        }
        self.add_accessor(begin, Some(stride), Some(VERTICES), accessor)
    }

    /// Adds the numbers of joints, as bytes if they fit.
    fn add_joints(&mut self, joints: impl ExactSizeIterator<Item = [u16; 4]>, fit_bytes: bool) -> usize {
        let (begin, count) = (self.bytes.len(), joints.len());
        let (kind, code) = if fit_bytes { (Kind::U8, 5121) } else { (Kind::U16, 5123) };
        joints.flatten().for_each(|joint| append_le(&mut self.bytes, kind, joint.into()));
        let accessor = json!({ "componentType": code, "type": "VEC4", "count": count });
        self.add_accessor(begin, None, Some(VERTICES), accessor)
    }

    fn add_indices(&mut self, triangles: impl Iterator<Item = [u32; 3]>) -> usize {
        let begin = self.bytes.len();
        triangles.flatten().for_each(|index| self.bytes.extend(index.to_le_bytes()));
        let count = (self.bytes.len() - begin) / 4;
        let accessor = json!({ "componentType": 5125, "type": "SCALAR", "count": count });
        self.add_accessor(begin, None, Some(INDICES), accessor)
    }

    /// Adds bytes unchanged; returns the index of their view.
    fn add_bytes(&mut self, bytes: &[u8]) -> usize {
        let view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.views.push(view);
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }
}

/// The names of the materials up to the last one used; an empty name stands for no material.
fn material_names(attributes: &Attributes, groups: &[(Option<usize>, Vec<usize>)]) -> Vec<String> {
    let Some(label) = attributes.face_named("material") else { return Vec::new() };
    if !label.names.is_empty() {
        return label.names.clone();
    }
    let count = groups.iter().filter_map(|(number, _)| *number).max().map_or(0, |last| last + 1);
    // Labels that are not materials can be of any size.
    if count > MAX_UNNAMED_MATERIALS {
        Vec::new()
    } else {
        (0..count).map(|k| format!("material{k}")).collect()
    }
}

/// Normals of the vertices.
fn normals(attributes: &Attributes) -> Option<&Attribute> {
    attributes.vertex_role(Role::Normal).filter(|normal| normal.components == 3)
}

/// Normals of the vertices, if there are pictures of normals, which are relative to these.
fn tangent_normals(attributes: &Attributes) -> Option<&Attribute> {
    let is_textured = attributes.uv.is_some() && attributes.face_named("material").is_some();
    let materials = writable_materials(attributes).filter(|_| is_textured)?;
    normals(attributes).filter(|_| needs_tangents(materials))
}

/// The numbers of a vertex as a vector.
fn vector(of: &Attribute, v: u32) -> DVec3 {
    let own = of.at(v as usize);
    DVec3::from_array([0, 1, 2].map(|k| own.get(k).copied().unwrap_or(0.0)))
}

/// Adds the vertices' numbers to the buffer; returns their accessors by name.
fn add_vertices(
    mesh: &TriMesh,
    attributes: &Attributes,
    transform: &NodeTransform,
    split: &SplitMesh,
    buffer: &mut BufferBuilder,
) -> Value {
    let target = Some(VERTICES);
    let of = |v: &u32| transform.to_buffer(mesh.vertices[*v as usize]);
    let positions = buffer.add_floats(split.original.iter().map(of), true, target);
    let mut accessors = json!({ "POSITION": positions });
    if let Some(colour) = attributes.vertex_role(Role::Colour).filter(|c| (3..=4).contains(&c.components)) {
        accessors["COLOR_0"] = json!(buffer.add_colours(colour, &split.original));
    }
    if let Some(normal) = normals(attributes) {
        let of = |v: &u32| vector(normal, *v).as_vec3().to_array();
        accessors["NORMAL"] = json!(buffer.add_floats(split.original.iter().map(of), false, target));
    }
    if let Some(normal) = tangent_normals(attributes) {
        let found = tangents::tangents(&TexturedMesh {
            positions: &split.original.iter().map(|v| mesh.vertices[*v as usize]).collect::<Vec<_>>(),
            normals: &split
                .original
                .iter()
                .map(|v| vector(normal, *v).normalize_or_zero())
                .collect::<Vec<_>>(),
            uv: &split.uv,
            triangles: &split.triangles,
        });
        accessors["TANGENT"] = json!(buffer.add_floats(found.into_iter(), false, target));
    }
    if !split.uv.is_empty() {
        // In glTF, v points down.
        let uv = split.uv.iter().map(|[u, v]| [*u as f32, (1.0 - v) as f32]);
        accessors["TEXCOORD_0"] = json!(buffer.add_floats(uv, false, target));
    }
    if let Some(skin) = &attributes.skin {
        let of = |v: &u32| skin.vertices[*v as usize];
        let joints = split.original.iter().map(|v| of(v).joints);
        accessors["JOINTS_0"] = json!(buffer.add_joints(joints, skin.joint_count() <= 256));
        let weights = split.original.iter().map(|v| of(v).weights);
        accessors["WEIGHTS_0"] = json!(buffer.add_floats(weights, false, target));
    }
    accessors
}

fn document(
    mesh: &TriMesh,
    attributes: &Attributes,
    transform: &NodeTransform,
    buffer: &mut BufferBuilder,
) -> Value {
    let split = SplitMesh::new(mesh, attributes);
    let vertex_accessors = add_vertices(mesh, attributes, transform, &split, buffer);
    let groups = group_by_material(attributes, mesh.triangles.len());
    let names = material_names(attributes, &groups);
    let mut primitives = Vec::new();
    for (number, group) in &groups {
        let indices = buffer.add_indices(group.iter().filter_map(|t| split.triangles.get(*t).copied()));
        let mut primitive = json!({ "attributes": vertex_accessors, "indices": indices, "mode": 4 });
        if let Some(number) = number.filter(|n| names.get(*n).is_some_and(|name| !name.is_empty())) {
            primitive["material"] = json!(number);
        }
        primitives.push(primitive);
    }
    let materials = writable_materials(attributes).filter(|_| !names.is_empty());
    let views: Vec<usize> = materials
        .iter()
        .flat_map(|materials| &materials.images)
        .map(|image| buffer.add_bytes(&image.bytes))
        .collect();
    let skin = attributes.skin.as_ref().map(|skin| skin_parts(skin, transform, buffer));
    let mut document = json!({
        "asset": { "version": "2.0", "generator": concat!("rtfmesh ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [transform.node(skin.is_some())],
        "meshes": [{ "primitives": primitives }],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{ "byteLength": buffer.bytes.len() }],
    });
    let list = write_materials::material_entries(&names, materials);
    if !list.is_empty() {
        document["materials"] = Value::Array(list);
    }
    if let Some(materials) = materials {
        write_materials::add_textures(&mut document, materials, &views);
    }
    if let Some(skin) = skin {
        write_skin::add_parts(&mut document, skin);
    }
    document
}

/// Writes a mesh, which must have faces and fit into 4 GiB.
pub(crate) fn write(file: &mut dyn Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    let transform = NodeTransform::for_mesh(mesh);
    let mut buffer = BufferBuilder::default();
    let mut json = document(mesh, attributes, &transform, &mut buffer).to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = HEADER + json.len() as u64 + CHUNK_HEADER + buffer.bytes.len() as u64;
    let word = |value: u64| u32::try_from(value).map(u32::to_le_bytes).map_err(io::Error::other);
    file.write_all(b"glTF")?;
    file.write_all(&word(2)?)?;
    file.write_all(&word(total)?)?;
    file.write_all(&word(json.len() as u64)?)?;
    file.write_all(b"JSON")?;
    file.write_all(&json)?;
    file.write_all(&word(buffer.bytes.len() as u64)?)?;
    file.write_all(b"BIN\0")?;
    file.write_all(&buffer.bytes)
}
