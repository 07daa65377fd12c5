//! 3MF, the format of 3D printing: a ZIP file with models in XML. Objects are parts; lengths become
//! millimetres.
//!
//! `threemf` 0.8 is not used, because it unpacks whatever a file claims, and knows no models in several
//! files.

mod model;
mod write;

pub(crate) use write::write;

use std::collections::HashMap;
use std::io::{Cursor, Read};
use std::rc::Rc;

use glam::{DAffine3, DVec3};
use serde_json::{Value, json};
use zip::ZipArchive;

use super::checks::{check_counts, excerpt, expands_too_far, outgrows, reserve};
use super::loaded::Loaded;
use crate::grammar::counted;
use crate::mesh::attributes::{Attribute, Attributes, Kind, Materials, Role};
use crate::{Error, Result, TriMesh};
use model::{Content, Mesh, Model, NO_MATERIAL, Named, Object, Reference};

/// The model of a package whose relationships do not say.
const USUAL_MODEL: &str = "3D/3dmodel.model";
const RELATIONSHIPS: &str = "_rels/.rels";
/// How deep components may be nested.
const DEEPEST: usize = 32;
/// The most objects in the build, components counted each time.
const MOST_INSTANCES: usize = 1 << 16;
/// Bytes unpacked at a time.
const CHUNK: usize = 1 << 16;

/// Whether a file begins as a ZIP file does.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// Reads what the build has. Colours of materials come along if asked for.
pub(crate) fn parse(bytes: &[u8], with_materials: bool) -> Result<Loaded> {
    let archive = ZipArchive::new(Cursor::new(bytes)).map_err(zip_error)?;
    let mut package =
        Package { archive, file_bytes: bytes.len() as u64, unpacked: 0, models: HashMap::new() };
    let path = package.root()?;
    let root = package.model(&path)?;
    let mut build = Build::new(package);
    // A model without a build is all that it has.
    let mut all = Vec::new();
    if root.build.is_empty() {
        let meshes = root.objects.iter().filter(|(_, object)| matches!(object.content, Content::Mesh(_)));
        all.extend(meshes.map(|(id, _)| Reference::to(*id)));
        all.sort_by_key(|item| item.object);
    }
    let scale = DAffine3::from_scale(DVec3::splat(root.millimetres));
    for item in root.build.iter().chain(&all) {
        build.place((&path, &root), item, scale, (0, None))?;
    }
    let mut loaded = build.finish(with_materials)?;
    if root.millimetres != 1.0 {
        loaded.notes.push(format!("lengths were converted from {} to millimetres", root.unit));
    }
    Ok(loaded)
}

fn zip_error(error: zip::result::ZipError) -> Error {
    let problem = format!("the ZIP file is damaged ({})", excerpt(&error.to_string()));
    Error::input(None, problem, "get the complete file, or export the mesh again").caused_by(error)
}

/// A ZIP file, and the models read from it.
struct Package<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    file_bytes: u64,
    unpacked: u64,
    models: HashMap<String, Rc<Model>>,
}

impl Package<'_> {
    /// The unpacked file of this name; `None` if there is none.
    fn file(&mut self, name: &str) -> Result<Option<Vec<u8>>> {
        let Some(index) = self.archive.index_for_name(name) else { return Ok(None) };
        let mut entry = self.archive.by_index(index).map_err(zip_error)?;
        let (mut plain, mut chunk) = (Vec::new(), vec![0; CHUNK]);
        loop {
            let read = entry.read(&mut chunk).map_err(|error| {
                let problem = format!("the ZIP data is cut off or damaged ({error})");
                Error::input(Some(excerpt(name)), problem, "get the complete file, or export it again")
                    .caused_by(error)
            })?;
            if read == 0 {
                return Ok(Some(plain));
            }
            self.unpacked += read as u64;
            // Sizes that the file declares are not trusted.
            if expands_too_far(self.unpacked, self.file_bytes) {
                let problem = format!("{} bytes of ZIP data expand to far more", self.file_bytes);
                return Err(Error::input(None, problem, "export the mesh again, or in another format"));
            }
            reserve(&mut plain, read, "the files of a ZIP file")?;
            plain.extend_from_slice(chunk.get(..read).unwrap_or_default());
        }
    }

    /// The name of the model that the package is about.
    fn root(&mut self) -> Result<String> {
        let named = self.file(RELATIONSHIPS)?.and_then(|bytes| model::root_of(&bytes));
        Ok(named.unwrap_or_else(|| USUAL_MODEL.to_owned()))
    }

    fn model(&mut self, path: &str) -> Result<Rc<Model>> {
        if let Some(known) = self.models.get(path) {
            return Ok(Rc::clone(known));
        }
        let Some(bytes) = self.file(path)? else {
            let problem = format!("there is no model '{}' in the ZIP file", excerpt(path));
            return Err(Error::input(None, problem, "give a 3MF file with a model"));
        };
        let read = model::parse(&bytes).map_err(|error| match error {
            Error::Input { path: file, place, problem, remedy, source } => {
                let place = place.map_or(excerpt(path), |place| format!("{}, {place}", excerpt(path)));
                Error::Input { path: file, place: Some(place), problem, remedy, source }
            }
            other => other,
        });
        let read = Rc::new(read?);
        self.models.insert(path.to_owned(), Rc::clone(&read));
        Ok(read)
    }
}

/// The mesh so far.
struct Build<'a> {
    package: Package<'a>,
    mesh: TriMesh,
    /// Names of parts, and the part of each triangle.
    parts: Vec<String>,
    part_of: Vec<f64>,
    /// Names and colours of materials, their numbers, and the material of each triangle.
    materials: Vec<Named>,
    numbers: HashMap<(String, [u32; 2]), usize>,
    material_of: Vec<f64>,
    instances: usize,
    /// Parts that are not of the model.
    beside: usize,
}

impl<'a> Build<'a> {
    fn new(package: Package<'a>) -> Self {
        Self {
            package,
            mesh: TriMesh::default(),
            parts: Vec::new(),
            part_of: Vec::new(),
            materials: vec![(String::new(), None)],
            numbers: HashMap::new(),
            material_of: Vec::new(),
            instances: 0,
            beside: 0,
        }
    }

    /// Adds an object of `model`, and those that it consists of. `name` is that of the object around it.
    fn place(
        &mut self,
        (path, model): (&str, &Model),
        item: &Reference,
        outer: DAffine3,
        (depth, name): (usize, Option<&str>),
    ) -> Result<()> {
        let refuse = |problem: String| Err(Error::input(Some(excerpt(path)), problem, "repair the file"));
        self.instances += 1;
        if depth > DEEPEST || self.instances > MOST_INSTANCES {
            return refuse("its components are nested too deep, or are too many".to_owned());
        }
        // Objects of another model, in its unit.
        let other = match &item.path {
            Some(other) if other != path => Some((other.as_str(), self.package.model(other)?)),
            _ => None,
        };
        let (path, model, outer) = match &other {
            Some((path, other)) => {
                let unit = DAffine3::from_scale(DVec3::splat(other.millimetres / model.millimetres));
                (*path, other.as_ref(), outer * item.transform * unit)
            }
            None => (path, model, outer * item.transform),
        };
        let Some(object) = model.objects.get(&item.object) else {
            return refuse(format!("there is no object {}", item.object));
        };
        if object.is_beside {
            self.beside += 1;
            return Ok(());
        }
        let name = object.name.as_deref().or(name);
        match &object.content {
            Content::Components(parts) => {
                for part in parts {
                    self.place((path, model), part, outer, (depth + 1, name))?;
                }
                Ok(())
            }
            Content::Mesh(mesh) => {
                let name = name.map_or_else(|| format!("object_{}", item.object), str::to_owned);
                self.add(mesh, (path, model, object), outer, name)
            }
        }
    }

    fn add(
        &mut self,
        mesh: &Mesh,
        (path, model, object): (&str, &Model, &Object),
        frame: DAffine3,
        name: String,
    ) -> Result<()> {
        let vertices = (self.mesh.vertices.len() + mesh.vertices.len()) as u64;
        let triangles = (self.mesh.triangles.len() + mesh.triangles.len()) as u64;
        if outgrows(24 * vertices + 28 * triangles, self.package.unpacked.max(self.package.file_bytes)) {
            let problem = "the file repeats its objects too often";
            return Err(Error::input(None, problem, "export the mesh again with fewer copies"));
        }
        check_counts(vertices, triangles.max(1))?;
        if !frame.is_finite() || frame.matrix3.determinant() == 0.0 {
            let problem = format!("the transform of the object '{}' is flat or not finite", excerpt(&name));
            return Err(Error::input(Some(excerpt(path)), problem, "repair the file"));
        }
        let first = self.mesh.vertices.len() as u32;
        for vertex in &mesh.vertices {
            let place = frame.transform_point3(*vertex);
            if !place.is_finite() {
                let problem = "the coordinates of a vertex are too large";
                return Err(Error::input(Some(excerpt(path)), problem, "repair the file"));
            }
            self.mesh.vertices.push(place);
        }
        let is_mirrored = frame.matrix3.determinant() < 0.0;
        let part = self.parts.len() as f64;
        self.parts.push(name);
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|corner| corner + first);
            self.mesh.triangles.push(if is_mirrored { [a, c, b] } else { [a, b, c] });
            self.part_of.push(part);
            let own = mesh.materials.get(t).copied().filter(|own| own[0] != NO_MATERIAL);
            let own = own.or(object.material);
            let number = own.map_or(0, |own| self.material(path, model, own));
            self.material_of.push(number as f64);
        }
        Ok(())
    }

    /// The number of a material: 0 for none that is known.
    fn material(&mut self, path: &str, model: &Model, [group, index]: [u32; 2]) -> usize {
        let Some(known) = model.materials.get(&group).and_then(|all| all.get(index as usize)) else {
            return 0;
        };
        if let Some(number) = self.numbers.get(&(path.to_owned(), [group, index])) {
            return *number;
        }
        self.materials.push(known.clone());
        let number = self.materials.len() - 1;
        self.numbers.insert((path.to_owned(), [group, index]), number);
        number
    }

    fn finish(self, with_materials: bool) -> Result<Loaded> {
        let Self { mesh, parts, part_of, materials, material_of, package, beside, .. } = self;
        check_counts(mesh.vertices.len() as u64, mesh.triangles.len() as u64)?;
        let mut attributes = Attributes::default();
        let mut label = |name: &str, values: Vec<f64>, names: Vec<String>| {
            let own = Attribute::new(name, Role::Label, Kind::U32, 1, values);
            attributes.face.push(Attribute { names, ..own });
        };
        // A single part of all triangles is no information.
        if parts.len() > 1 {
            label("object", part_of, unlike(parts));
        }
        if materials.len() > 1 {
            // The one without a name, which is first here, is last where materials are written.
            let none = materials.len() - 1;
            let number = |own: f64| if own == 0.0 { none as f64 } else { own - 1.0 };
            let values = material_of.into_iter().map(number).collect();
            let (_, named) =
                materials.split_first().ok_or_else(|| Error::Internal("no materials".to_owned()))?;
            let names = named.iter().map(|(name, _)| name.clone()).chain([String::new()]).collect();
            label("material", values, names);
            if with_materials {
                let made = named.iter().map(|(_, colour)| colour.map_or_else(|| json!({}), factor));
                let materials = made.chain([Value::Null]).collect();
                attributes.materials = Some(Materials { materials, ..Materials::default() });
            }
        }
        Ok(Loaded { mesh, attributes, notes: notes(&package, beside), ..Loaded::default() })
    }
}

/// What of the models was not read.
fn notes(package: &Package, beside: usize) -> Vec<String> {
    let note = |count: fn(&Model) -> usize, what: [&str; 2]| {
        let count: usize = package.models.values().map(|model| count(model)).sum();
        (count > 0).then(|| format!("{} ignored", counted(count, what)))
    };
    let objects = ["object of another kind than a mesh was", "objects of other kinds than meshes were"];
    let parts =
        ["part that is not of the model, such as support, was", "parts that are not of the model were"];
    let items = ["item that is not to be printed was", "items that are not to be printed were"];
    let all = [
        (beside > 0).then(|| format!("{} ignored", counted(beside, parts))),
        note(|model| model.unprinted, items),
        note(|model| model.skipped, objects),
        note(|model| model.textures, ["texture was", "textures were"]),
        note(|model| model.colour_groups, ["group of colours was", "groups of colours were"]),
    ];
    all.into_iter().flatten().collect()
}

/// A material of this colour. What 3MF has is sRGB, and glTF's factors are linear.
fn factor(colour: [f64; 4]) -> Value {
    let [r, g, b, a] = colour;
    let linear = |value: f64| {
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    let factor = [linear(r), linear(g), linear(b), a];
    let mut made = json!({ "pbrMetallicRoughness": { "baseColorFactor": factor, "metallicFactor": 0.0 } });
    if a < 1.0 {
        made["alphaMode"] = json!("BLEND");
    }
    made
}

/// Names of which no two are the same.
fn unlike(names: Vec<String>) -> Vec<String> {
    let mut counts: HashMap<String, usize> = HashMap::new();
    let mut number = |name: String| {
        let count = counts.entry(name.clone()).or_insert(0);
        *count += 1;
        if *count == 1 { name } else { format!("{name} {count}") }
    };
    names.into_iter().map(&mut number).collect()
}
