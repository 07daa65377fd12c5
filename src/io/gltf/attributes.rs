//! Gathers colours, normals, texture coordinates and materials of a scene's triangles.

use glam::{DMat3, DMat4, DVec3};

use super::accessors::{Buffers, Elements};
use super::model::{Model, Primitive};
use crate::grammar::counted;
use crate::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role};
use crate::{Error, Result};

/// The attributes gathered so far.
#[derive(Default)]
pub(crate) struct AttributeReader {
    vertices: usize,
    triangles: usize,
    /// Red, green, blue and opacity from 0 to 1 of each vertex up to the last one with a colour; white for
    /// those without.
    colours: Vec<[f64; 4]>,
    colour_components: usize,
    colour_kind: Option<Kind>,
    /// Of each vertex; empty once one lacks them.
    normals: Vec<DVec3>,
    /// Vertices without a normal.
    without_normal: usize,
    /// Triangles without texture coordinates.
    without_uv: usize,
    /// Of each corner; empty once a triangle lacks them.
    uv: Vec<[f64; 2]>,
    /// Of each triangle up to the last one with a material.
    materials: Vec<f64>,
    any_material: bool,
}

/// The elements of an accessor, which must have one for each of `count` vertices.
pub(super) fn vertex_elements<'a>(
    buffers: &'a Buffers,
    accessor: usize,
    kind: &str,
    count: usize,
    place: &str,
) -> Result<Elements<'a>> {
    let elements = buffers.elements(accessor, kind)?;
    if elements.count != count {
        let elements = counted(elements.count, ["element", "elements"]);
        let vertices = counted(count, ["vertex", "vertices"]);
        let problem = format!("accessor {accessor} has {elements} for {vertices}");
        return Err(Error::input(Some(place.to_owned()), problem, "export the mesh again"));
    }
    Ok(elements)
}

impl AttributeReader {
    /// Adds the vertices of a primitive.
    pub fn add_vertices(
        &mut self,
        (model, buffers): (&Model, &Buffers),
        primitive: &Primitive,
        (count, transform): (usize, DMat4),
        place: &str,
    ) -> Result<()> {
        let first = self.vertices;
        self.vertices += count;
        if let Some(accessor) = primitive.attributes.colour {
            let opaque = model.accessors.get(accessor).is_none_or(|accessor| accessor.kind != "VEC4");
            let (kind, components) = if opaque { ("VEC3", 3) } else { ("VEC4", 4) };
            let elements = vertex_elements(buffers, accessor, kind, count, place)?;
            self.colours.resize(self.vertices, [1.0; 4]);
            for (index, colour) in self.colours.iter_mut().skip(first).enumerate() {
                let shades = colour.iter_mut().take(components).enumerate();
                shades.for_each(|(at, shade)| *shade = elements.number(index, at));
            }
            let kind = match elements.component {
                Kind::U8 => Kind::U8,
                Kind::U16 => Kind::U16,
                _ => Kind::F32,
            };
            self.colour_kind = Some(self.colour_kind.filter(|old| *old != kind).map_or(kind, |_| Kind::F32));
            self.colour_components = self.colour_components.max(components);
        }
        match primitive.attributes.normal {
            None => {
                self.normals = Vec::new();
                self.without_normal += count;
            }
            // Checked, though it will be ignored.
            Some(accessor) if self.without_normal > 0 => {
                vertex_elements(buffers, accessor, "VEC3", count, place)?;
            }
            Some(accessor) => {
                let elements = vertex_elements(buffers, accessor, "VEC3", count, place)?;
                let linear = DMat3::from_mat4(transform);
                // Normals transform by the inverse transpose; unchanged, without rounding, by the identity.
                let normal_matrix = if linear == DMat3::IDENTITY {
                    None
                } else {
                    Some(linear.inverse().transpose() * linear.determinant().signum())
                };
                let normal = |n: DVec3| normal_matrix.map_or(n, |matrix| (matrix * n).normalize_or_zero());
                self.normals.extend(elements.positions().map(normal));
            }
        }
        Ok(())
    }

    /// Adds the triangles of a primitive, with indices into its own vertices.
    pub fn add_triangles(
        &mut self,
        (model, buffers): (&Model, &Buffers),
        primitive: &Primitive,
        (count, triangles): (usize, &[[u32; 3]]),
        place: &str,
    ) -> Result<()> {
        let first = self.triangles;
        self.triangles += triangles.len();
        match primitive.attributes.uv {
            None => {
                self.without_uv += triangles.len();
                if self.without_uv > 0 {
                    self.uv = Vec::new();
                }
            }
            Some(accessor) if self.without_uv > 0 => {
                vertex_elements(buffers, accessor, "VEC2", count, place)?;
            }
            Some(accessor) => {
                let elements = vertex_elements(buffers, accessor, "VEC2", count, place)?;
                // In glTF, v points down.
                let uv = |v: &u32| [elements.number(*v as usize, 0), 1.0 - elements.number(*v as usize, 1)];
                self.uv.extend(triangles.as_flattened().iter().map(uv));
            }
        }
        if let Some(material) = primitive.material.filter(|material| *material >= model.materials.len()) {
            let problem = format!("there is no material {material}");
            return Err(Error::input(Some(place.to_owned()), problem, "export the mesh again"));
        }
        if let Some(material) = primitive.material {
            self.materials.resize(first, model.materials.len() as f64);
            self.materials.resize(self.triangles, material as f64);
            self.any_material = true;
        }
        Ok(())
    }

    /// Bytes of what is gathered, with those of the attributes made of it.
    pub fn bytes(&self) -> usize {
        64 * self.colours.len() + 48 * self.normals.len() + 16 * self.uv.len() + 8 * self.materials.len()
    }

    /// The attributes that all vertices or triangles have.
    pub fn into_attributes(mut self, model: &Model, notes: &mut Vec<String>) -> Attributes {
        let mut found = Attributes::default();
        if let Some(kind) = self.colour_kind {
            self.colours.resize(self.vertices, [1.0; 4]);
            let (components, largest) = (self.colour_components, kind.range().map_or(1.0, |[_, high]| high));
            let shades = self.colours.iter().flat_map(|colour| colour.iter().take(components));
            let values = shades.map(|shade| kind.rounded(shade * largest)).collect();
            found.vertex.push(Attribute::new("colour", Role::Colour, kind, components, values));
        }
        if self.without_normal == 0 {
            let values = self.normals.iter().flat_map(|normal| normal.to_array()).collect();
            found.vertex.push(Attribute::new("normal", Role::Normal, Kind::F32, 3, values));
        } else if self.without_normal < self.vertices {
            let vertices = counted(self.without_normal, ["vertex lacks", "vertices lack"]);
            notes.push(format!("normals were ignored: {vertices} one"));
        }
        if self.without_uv == 0 && self.triangles > 0 {
            found.uv = Some(CornerUv { kind: Kind::F32, values: self.uv });
        } else if self.without_uv < self.triangles {
            let triangles = counted(self.without_uv, ["triangle lacks", "triangles lack"]);
            notes.push(format!("texture coordinates were ignored: {triangles} them"));
        }
        if self.any_material {
            let name_of = |(index, material): (usize, &super::model::Material)| {
                material.name.clone().unwrap_or_else(|| format!("material{index}"))
            };
            let mut names: Vec<String> = model.materials.iter().enumerate().map(name_of).collect();
            self.materials.resize(self.triangles, model.materials.len() as f64);
            if self.materials.iter().any(|material| *material as usize == names.len()) {
                names.push(String::new());
            }
            let label = Attribute::new("material", Role::Label, Kind::U32, 1, self.materials);
            found.face.push(Attribute { names, ..label });
        }
        found
    }
}
