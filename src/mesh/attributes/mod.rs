//! What a mesh has besides its shape: colours, normals and other numbers of its vertices, texture
//! coordinates of its corners, labels and colours of its faces.

mod charts;
mod materials;
mod seams;
mod skin;
mod textures;
mod transfer;

pub(crate) use materials::CLAMP;
pub use materials::{Image, Materials};
pub use seams::{label_boundaries, uv_seams};
pub(crate) use skin::{Animation, Bone, Channel, Skeleton, Track};
pub use skin::{Influences, Skin};
pub use textures::{Alpha, Textures};
pub use transfer::transfer;

use rayon::prelude::*;
use std::path::PathBuf;

use super::TriMesh;
use super::correspondence::CorrespondenceRequest;
use crate::grammar::counted;

/// The number type that a file has, and that a result is written in; values themselves are f64, which holds
/// each exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Signed, 8 bits.
    I8,
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 32 bits.
    U32,
    /// Floating point, 32 bits.
    F32,
    /// Floating point, 64 bits.
    F64,
}

impl Kind {
    /// The smallest and largest value of an integer type; `None` for floating point.
    pub fn range(self) -> Option<[f64; 2]> {
        match self {
            Self::I8 => Some([i8::MIN.into(), i8::MAX.into()]),
            Self::U8 => Some([0.0, u8::MAX.into()]),
            Self::I16 => Some([i16::MIN.into(), i16::MAX.into()]),
            Self::U16 => Some([0.0, u16::MAX.into()]),
            Self::I32 => Some([i32::MIN.into(), i32::MAX.into()]),
            Self::U32 => Some([0.0, u32::MAX.into()]),
            Self::F32 | Self::F64 => None,
        }
    }

    /// The nearest value that the type has.
    pub fn rounded(self, value: f64) -> f64 {
        match self.range() {
            Some([low, high]) => value.round().clamp(low, high),
            None => value,
        }
    }

    /// Whether the type has this value; floating point has all.
    pub fn holds(self, value: f64) -> bool {
        self.range().is_none_or(|[low, high]| value.fract() == 0.0 && (low..=high).contains(&value))
    }
}

/// What an attribute means, as far as that is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Red, green, blue and, with four components, opacity: 0 to the largest value of an integer type, else 0
    /// to 1.
    Colour,
    /// A unit vector that stands on the surface.
    Normal,
    /// A number that stands for what belongs together: a material, a group, a reference.
    Label,
    /// Anything else.
    Other,
}

/// One to four numbers for each vertex, or for each triangle.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// Its name in files that have names.
    pub name: String,
    /// What it means.
    pub role: Role,
    /// The number type in files.
    pub kind: Kind,
    /// How many numbers each vertex or triangle has, 1 to 4.
    pub components: usize,
    /// The numbers, those of the first vertex or triangle first.
    pub values: Vec<f64>,
    /// The names of labels, if they have any: that of label 0 first.
    pub names: Vec<String>,
}

/// Fewer triangles may each have a label of its own.
const FEW_TRIANGLES: usize = 8;
/// With at least this many triangles, a label has more than two of them on average.
const MANY_TRIANGLES: usize = 100;

/// Whether whole numbers number the triangles, or polygons that are two triangles each now: as labels they
/// would have borders all over.
pub(crate) fn are_numbers_of_triangles(values: &[f64]) -> bool {
    let count = values.len();
    if count < FEW_TRIANGLES {
        return false;
    }
    let mut sorted: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
    sorted.par_sort_unstable();
    let distinct = sorted.chunk_by(|a, b| a == b).count();
    distinct == count || (count >= MANY_TRIANGLES && 2 * distinct >= count)
}

impl Attribute {
    /// An attribute without names for its values.
    pub fn new(name: &str, role: Role, kind: Kind, components: usize, values: Vec<f64>) -> Self {
        Self { name: name.to_owned(), role, kind, components, values, names: Vec::new() }
    }

    /// The numbers of vertex or triangle `index`. Panics if there is none.
    pub fn at(&self, index: usize) -> &[f64] {
        &self.values[index * self.components..(index + 1) * self.components]
    }

    /// A colour's numbers from 0 to 1, opaque if there is no opacity.
    pub fn unit_colour(&self, index: usize) -> [f64; 4] {
        let largest = self.kind.range().map_or(1.0, |[_, high]| high);
        let own = self.at(index);
        std::array::from_fn(|k| own.get(k).map_or(1.0, |value| value / largest))
    }
}

/// Texture coordinates of the corners of all triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerUv {
    /// The number type in files.
    pub kind: Kind,
    /// Corner `k` of triangle `t` has number `3 * t + k`; v grows upwards.
    pub values: Vec<[f64; 2]>,
}

/// All attributes of a mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Attributes {
    /// Attributes of the vertices.
    pub vertex: Vec<Attribute>,
    /// Attributes of the triangles.
    pub face: Vec<Attribute>,
    /// Texture coordinates of the corners.
    pub uv: Option<CornerUv>,
    /// The `mtllib` lines of an OBJ file, without that word.
    pub libraries: Vec<String>,
    /// The folder that names in `libraries` are relative to. A file written elsewhere names the same files.
    pub library_folder: Option<PathBuf>,
    /// glTF materials, or those of `libraries`, if they were read.
    pub materials: Option<Materials>,
    /// What a glTF skeleton moves.
    pub skin: Option<Skin>,
}

impl Attributes {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.vertex.is_empty() && self.face.is_empty() && self.uv.is_none() && self.skin.is_none()
    }

    /// What of another mesh must be found on this one for [`transfer`]; texture takes both.
    pub fn required_correspondence(&self) -> CorrespondenceRequest {
        let uv = self.uv.is_some();
        CorrespondenceRequest {
            vertices: uv || !self.vertex.is_empty() || self.skin.is_some(),
            faces: uv || !self.face.is_empty(),
        }
    }

    /// The attribute of the vertices that has this role.
    pub fn vertex_role(&self, role: Role) -> Option<&Attribute> {
        self.vertex.iter().find(|attribute| attribute.role == role)
    }

    /// The attribute of the triangles of this name.
    pub fn face_named(&self, name: &str) -> Option<&Attribute> {
        self.face.iter().find(|attribute| attribute.name == name)
    }

    /// What there is, for people: "colour of each vertex (3 x u8)" and the like.
    pub fn listed(&self) -> Vec<String> {
        let each = |attributes: &[Attribute], of: &str| -> Vec<String> {
            let line = |a: &Attribute| {
                let kind = format!("{:?}", a.kind).to_lowercase();
                format!("{} of each {of} ({} x {kind})", a.name, a.components)
            };
            attributes.iter().map(line).collect()
        };
        let mut all = each(&self.vertex, "vertex");
        all.extend(each(&self.face, "face"));
        all.extend(self.uv.iter().map(|uv| {
            let kind = format!("{:?}", uv.kind).to_lowercase();
            format!("texture coordinates of each corner (2 x {kind})")
        }));
        all.extend(self.materials.iter().map(|materials| {
            let pictures = counted(materials.images().len(), ["picture", "pictures"]);
            format!("{} ({pictures})", counted(materials.used_count(), ["material", "materials"]))
        }));
        all.extend(self.skin.iter().map(|skin| {
            let joints = counted(skin.joint_count(), ["joint", "joints"]);
            let animations = counted(skin.animation_count(), ["animation", "animations"]);
            format!("skin with weights of each vertex ({joints}, {animations})")
        }));
        all
    }
}

impl CornerUv {
    /// The coordinates of each vertex, if no two corners at one vertex differ; 0, 0 for vertices without
    /// triangles.
    pub fn by_vertex(&self, mesh: &TriMesh) -> Option<Vec<[f64; 2]>> {
        let mut known: Vec<Option<[f64; 2]>> = vec![None; mesh.vertices.len()];
        for (vertex, uv) in mesh.triangles.as_flattened().iter().zip(&self.values) {
            let own = known[*vertex as usize].get_or_insert(*uv);
            if own != uv {
                return None;
            }
        }
        Some(known.into_iter().map(Option::unwrap_or_default).collect())
    }
}
