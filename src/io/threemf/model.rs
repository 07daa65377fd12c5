//! The XML of a model: objects with meshes or components, materials, and the build.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec3};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::io::checks::{cut_off, excerpt};
use crate::io::text::{Faces, number};
use crate::{Error, Result};

/// The most materials of a model.
const MOST_MATERIALS: usize = 1 << 16;
/// The group of a triangle without a material.
pub(super) const NO_MATERIAL: u32 = u32::MAX;

/// The name of a material, and its colour, if it is known.
pub(super) type Named = (String, Option<[f64; 4]>);

/// What a model has.
#[derive(Debug)]
pub(super) struct Model {
    pub unit: String,
    /// Millimetres in a unit of length.
    pub millimetres: f64,
    pub objects: HashMap<u32, Object>,
    /// The names and colours of each group.
    pub materials: HashMap<u32, Vec<Named>>,
    pub build: Vec<Reference>,
    /// Objects without mesh and components.
    pub skipped: usize,
    /// Items of the build that are not to be printed.
    pub unprinted: usize,
    /// Pictures, and groups of colours, which are not read.
    pub textures: usize,
    pub colour_groups: usize,
}

#[derive(Debug)]
pub(super) struct Object {
    pub name: Option<String>,
    /// Whether it is no part of the model, but support or what a program has for its own use.
    pub is_beside: bool,
    /// Group and index of its material.
    pub material: Option<[u32; 2]>,
    pub content: Content,
}

#[derive(Debug)]
pub(super) enum Content {
    Mesh(Mesh),
    Components(Vec<Reference>),
}

#[derive(Debug, Default)]
pub(super) struct Mesh {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Group and index of each triangle's material; empty if no triangle has its own.
    pub materials: Vec<[u32; 2]>,
}

/// An object at a place.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub object: u32,
    pub transform: DAffine3,
    /// The model that has it, if it is another one.
    pub path: Option<String>,
}

impl Reference {
    pub fn to(object: u32) -> Self {
        Self { object, transform: DAffine3::IDENTITY, path: None }
    }
}

/// The attribute of this name, whatever its namespace.
fn attribute<'t>(tag: &'t BytesStart, name: &str) -> Option<Cow<'t, str>> {
    let mut all = tag.attributes();
    let found = all.with_checks(false).flatten().find(|own| own.key.local_name().as_ref() == name)?;
    let plain = found.normalized_value(XmlVersion::Implicit1_0);
    Some(plain.unwrap_or(found.value))
}

/// The model that relationships name.
pub(super) fn root_of(bytes: &[u8]) -> Option<String> {
    let mut reader = Reader::from_reader(bytes);
    loop {
        match reader.read_event() {
            Ok(Event::Start(tag) | Event::Empty(tag)) if tag.local_name().as_ref() == "Relationship" => {
                if attribute(&tag, "Type").is_some_and(|kind| kind.ends_with("/3dmodel")) {
                    return Some(attribute(&tag, "Target")?.trim_start_matches('/').to_owned());
                }
            }
            Ok(Event::Eof) | Err(_) => return None,
            Ok(_) => {}
        }
    }
}

/// The object that is open.
struct Open {
    id: u32,
    object: Object,
    has_content: bool,
}

struct Walk {
    model: Model,
    open: Option<Open>,
    /// The group of materials that is open.
    group: Option<u32>,
    /// Materials of all groups.
    bases: usize,
}

/// Reads a model.
///
/// # Errors
/// [`Error::Input`] with the byte.
pub(super) fn parse(bytes: &[u8]) -> Result<Model> {
    let mut reader = Reader::from_reader(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    let model = Model {
        unit: "millimeter".to_owned(),
        millimetres: 1.0,
        objects: HashMap::new(),
        materials: HashMap::new(),
        build: Vec::new(),
        skipped: 0,
        unprinted: 0,
        textures: 0,
        colour_groups: 0,
    };
    let mut walk = Walk { model, open: None, group: None, bases: 0 };
    loop {
        let place = || Some(format!("byte {}", reader.buffer_position()));
        let at = place();
        let event = reader.read_event().map_err(|error| {
            let problem = format!("this is not valid XML ({})", excerpt(&error.to_string()));
            let remedy = "get the complete file, or export the mesh again";
            Error::input(at.clone(), problem, remedy).caused_by(error)
        })?;
        let placed = |error: Error| match error {
            Error::Input { path, place, problem, remedy, source } => {
                Error::Input { path, place: place.or_else(|| at.clone()), problem, remedy, source }
            }
            other => other,
        };
        match event {
            Event::Start(tag) => walk.start(&tag).map_err(placed)?,
            Event::Empty(tag) => {
                walk.start(&tag).map_err(placed)?;
                walk.end(tag.local_name().as_ref());
            }
            Event::End(tag) => {
                walk.end(tag.local_name().as_ref());
                if tag.local_name().as_ref() == "model" {
                    return Ok(walk.model);
                }
            }
            Event::Eof => return Err(cut_off(at.unwrap_or_default(), "there is no </model>")),
            _ => {}
        }
    }
}

impl Walk {
    fn start(&mut self, tag: &BytesStart) -> Result<()> {
        let local = tag.local_name();
        match local.as_ref() {
            "model" => self.unit(tag)?,
            "basematerials" => {
                let id = require(tag, "id")?;
                self.model.materials.insert(id, Vec::new());
                self.group = Some(id);
            }
            "base" => {
                self.bases += 1;
                if self.bases > MOST_MATERIALS {
                    let problem = format!("the model has more than {MOST_MATERIALS} materials");
                    return Err(Error::input(None, problem, "export the mesh again with fewer"));
                }
                let name = attribute(tag, "name").unwrap_or_default().into_owned();
                let colour = attribute(tag, "displaycolor").and_then(|text| colour(&text));
                let group = self.group.and_then(|id| self.model.materials.get_mut(&id));
                // The empty name stands for no material.
                let name = if name.is_empty() { "material".to_owned() } else { name };
                group.into_iter().for_each(|group| group.push((name.clone(), colour)));
            }
            "object" => {
                let material = match (index(tag, "pid")?, index(tag, "pindex")?) {
                    (Some(group), Some(index)) => Some([group, index]),
                    _ => None,
                };
                let name = attribute(tag, "name").map(Cow::into_owned).filter(|name| !name.trim().is_empty());
                let kind = attribute(tag, "type").unwrap_or_default();
                let is_beside = matches!(kind.as_ref(), "support" | "solidsupport" | "other");
                let object = Object { name, is_beside, material, content: Content::Mesh(Mesh::default()) };
                self.open = Some(Open { id: require(tag, "id")?, object, has_content: false });
            }
            "mesh" => {
                if let Some(open) = &mut self.open {
                    open.has_content = true;
                }
            }
            "components" => {
                if let Some(open) = &mut self.open {
                    open.has_content = true;
                    open.object.content = Content::Components(Vec::new());
                }
            }
            "vertex" => self.vertex(tag)?,
            "triangle" => self.triangle(tag)?,
            "component" => {
                let part = reference(tag)?;
                if let Some(Open { object: Object { content: Content::Components(parts), .. }, .. }) =
                    &mut self.open
                {
                    parts.push(part);
                }
            }
            "item" if attribute(tag, "printable").is_some_and(|is| is == "0") => self.model.unprinted += 1,
            "item" => self.model.build.push(reference(tag)?),
            "texture2d" => self.model.textures += 1,
            "colorgroup" => self.model.colour_groups += 1,
            _ => {}
        }
        Ok(())
    }

    fn end(&mut self, name: &str) {
        match name {
            "basematerials" => self.group = None,
            "object" => match self.open.take() {
                Some(Open { id, object, has_content: true }) => drop(self.model.objects.insert(id, object)),
                Some(_) => self.model.skipped += 1,
                None => {}
            },
            _ => {}
        }
    }

    fn unit(&mut self, tag: &BytesStart) -> Result<()> {
        let unit = attribute(tag, "unit").unwrap_or(Cow::Borrowed("millimeter"));
        self.model.millimetres = match unit.as_ref() {
            "micron" => 1e-3,
            "millimeter" => 1.0,
            "centimeter" => 10.0,
            "inch" => 25.4,
            "foot" => 304.8,
            "meter" => 1000.0,
            other => {
                let problem = format!("unknown unit '{}'", excerpt(other));
                return Err(Error::input(None, problem, "write the model in millimeter"));
            }
        };
        self.model.unit = unit.into_owned();
        Ok(())
    }

    fn mesh(&mut self) -> Option<&mut Mesh> {
        match &mut self.open.as_mut()?.object.content {
            Content::Mesh(mesh) => Some(mesh),
            Content::Components(_) => None,
        }
    }

    fn vertex(&mut self, tag: &BytesStart) -> Result<()> {
        let Some(mesh) = self.mesh() else { return Ok(()) };
        let mut position = [0.0; 3];
        for (axis, value) in ["x", "y", "z"].iter().zip(&mut position) {
            let text = attribute(tag, axis).unwrap_or_default();
            let own = number(text.trim().as_bytes()).filter(|value| value.is_finite());
            *value = own.ok_or_else(|| {
                let problem = format!("the {axis} coordinate '{}' is not a finite number", excerpt(&text));
                Error::input(None, problem, "repair the vertex")
            })?;
        }
        mesh.vertices.push(DVec3::from_array(position));
        Ok(())
    }

    fn triangle(&mut self, tag: &BytesStart) -> Result<()> {
        let group_of_object =
            self.open.as_ref().and_then(|open| open.object.material).map(|[group, _]| group);
        let Some(mesh) = self.mesh() else { return Ok(()) };
        let mut corners = [0; 3];
        for (name, corner) in ["v1", "v2", "v3"].iter().zip(&mut corners) {
            *corner = require(tag, name)?.into();
        }
        let mut faces = Faces::new(0, mesh.vertices.len() as u64);
        let count = mesh.triangles.len();
        faces.push(&corners, &|| format!("triangle {count}"))?;
        mesh.triangles.append(&mut faces.triangles);
        let (group, own) = (index(tag, "pid")?.or(group_of_object), index(tag, "p1")?);
        if let (Some(group), Some(own)) = (group, own) {
            mesh.materials.resize(count, [NO_MATERIAL, 0]);
            mesh.materials.push([group, own]);
        }
        Ok(())
    }
}

/// A whole number, if there is one.
fn index(tag: &BytesStart, name: &str) -> Result<Option<u32>> {
    let Some(text) = attribute(tag, name) else { return Ok(None) };
    text.trim().parse().map(Some).map_err(|error| {
        let problem = format!("{name}=\"{}\" is not an index", excerpt(&text));
        Error::input(None, problem, "repair the file, or export the mesh again").caused_by(error)
    })
}

fn require(tag: &BytesStart, name: &str) -> Result<u32> {
    let element = excerpt(tag.local_name().as_ref());
    index(tag, name)?.ok_or_else(|| {
        let problem = format!("an element '{element}' has no '{name}'");
        Error::input(None, problem, "repair the file, or export the mesh again")
    })
}

fn reference(tag: &BytesStart) -> Result<Reference> {
    let path = attribute(tag, "path").map(|path| path.trim_start_matches('/').to_owned());
    let mut transform = DAffine3::IDENTITY;
    if let Some(text) = attribute(tag, "transform") {
        let values: Vec<f64> =
            text.split_whitespace().take(13).filter_map(|word| number(word.as_bytes())).collect();
        let Ok(values) = <[f64; 12]>::try_from(values) else {
            let problem = format!("the transform '{}' does not have 12 numbers", excerpt(&text));
            return Err(Error::input(None, problem, "repair the file"));
        };
        // Rows, from which vectors stand on the left.
        let row = |k: usize| DVec3::from_slice(&values[3 * k..]);
        transform = DAffine3 { matrix3: DMat3::from_cols(row(0), row(1), row(2)), translation: row(3) };
    }
    Ok(Reference { object: require(tag, "objectid")?, transform, path })
}

/// A colour as `#RRGGBB` or `#RRGGBBAA`.
fn colour(text: &str) -> Option<[f64; 4]> {
    let digits = text.trim().strip_prefix('#').filter(|digits| matches!(digits.len(), 6 | 8))?;
    let mut colour = [1.0; 4];
    for (k, value) in colour.iter_mut().enumerate().take(digits.len() / 2) {
        *value = f64::from(u8::from_str_radix(digits.get(2 * k..2 * k + 2)?, 16).ok()?) / 255.0;
    }
    Some(colour)
}
