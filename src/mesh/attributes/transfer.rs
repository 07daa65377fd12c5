//! Transfers attributes of a mesh to another one that lies on it.

use super::charts::corner_uv;
use super::{Attribute, Attributes, Role};
use crate::mesh::TriMesh;
use crate::mesh::correspondence::{Correspondence, SurfacePoint};

/// The attributes of `input` for `output`, which lies at `correspondence` on it.
///
/// Numbers of vertices are interpolated linearly in the triangle under a vertex: colours are rounded to their
/// type, normals get length 1, other integers and labels are those of the nearest corner. A face has the
/// label of the triangle under its centre. The texture coordinates of a face are all in the piece of texture
/// under its centre, which is extended where the face runs over a seam. The weights of a skin are
/// interpolated as well; the four largest are kept, with the sum 1. `correspondence` must have at least what
/// [`Attributes::required_correspondence`] says.
///
/// Panics if these do not belong together.
pub fn transfer(
    attributes: &Attributes,
    input: &TriMesh,
    correspondence: &Correspondence,
    output: &TriMesh,
) -> Attributes {
    let of_vertices = |attribute: &Attribute| {
        let values = correspondence.vertices.iter().flat_map(|point| {
            let corners = input.triangles[point.triangle as usize].map(|v| attribute.at(v as usize));
            at(attribute, corners, point)
        });
        Attribute { values: values.collect(), ..like(attribute) }
    };
    let of_faces = |attribute: &Attribute| {
        let values = correspondence.faces.iter().flat_map(|point| attribute.at(point.triangle as usize));
        Attribute { values: values.copied().collect(), ..like(attribute) }
    };
    Attributes {
        vertex: attributes.vertex.iter().map(of_vertices).collect(),
        face: attributes.face.iter().map(of_faces).collect(),
        uv: attributes.uv.as_ref().map(|uv| corner_uv(input, uv, correspondence, output)),
        libraries: attributes.libraries.clone(),
        library_folder: attributes.library_folder.clone(),
        materials: attributes.materials.clone(),
        skin: attributes.skin.as_ref().map(|skin| skin.at(input, &correspondence.vertices)),
    }
}

/// The same attribute without values.
fn like(attribute: &Attribute) -> Attribute {
    let Attribute { name, role, kind, components, names, .. } = attribute;
    Attribute {
        name: name.clone(),
        role: *role,
        kind: *kind,
        components: *components,
        values: Vec::new(),
        names: names.clone(),
    }
}

/// The numbers at a point of a triangle whose corners have these; the unused ones of the four are left out.
fn at(attribute: &Attribute, corners: [&[f64]; 3], point: &SurfacePoint) -> Vec<f64> {
    let weights = point.barycentric;
    let is_whole = attribute.kind.range().is_some() && attribute.role != Role::Normal;
    if attribute.role == Role::Label || (is_whole && attribute.role != Role::Colour) {
        let nearest = (1..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
        return corners[nearest].to_vec();
    }
    // A corner of weight 0 has no say, even if its value is no number.
    let part = |k: usize, c: usize| if weights[k] == 0.0 { 0.0 } else { weights[k] * corners[k][c] };
    let mut values: Vec<f64> =
        (0..attribute.components).map(|c| part(0, c) + part(1, c) + part(2, c)).collect();
    if attribute.role == Role::Normal {
        let length = values.iter().map(|value| value * value).sum::<f64>().sqrt();
        let unit = attribute.kind.range().map_or(1.0, |[_, high]| high);
        if length > 0.0 {
            values.iter_mut().for_each(|value| *value *= unit / length);
        }
    }
    values.iter_mut().for_each(|value| *value = attribute.kind.rounded(*value));
    values
}
