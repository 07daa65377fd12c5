//! Attributes as columns of numbers, and back.

use crate::errors::one_of;
use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyString};
use rtfmesh::mesh::attributes;
use rtfmesh::mesh::attributes::{Alpha, Attribute, Attributes, CornerUv, Image, Kind, Role, Textures};

const ROLES: [(&str, Role); 4] =
    [("colour", Role::Colour), ("normal", Role::Normal), ("label", Role::Label), ("other", Role::Other)];

const KINDS: [(&str, Kind); 8] = [
    ("int8", Kind::I8),
    ("uint8", Kind::U8),
    ("int16", Kind::I16),
    ("uint16", Kind::U16),
    ("int32", Kind::I32),
    ("uint32", Kind::U32),
    ("float32", Kind::F32),
    ("float64", Kind::F64),
];

/// What a glTF file says of materials, with its images, or the material libraries of an OBJ file. Opaque: it
/// comes from `read` and goes to `write`.
#[pyclass(frozen, module = "rtfmesh")]
pub struct Materials {
    libraries: Vec<String>,
    library_folder: Option<PathBuf>,
    materials: Option<attributes::Materials>,
}

const ALPHA: [(&str, Alpha); 3] = [("opaque", Alpha::Opaque), ("mask", Alpha::Mask), ("blend", Alpha::Blend)];

#[pymethods]
impl Materials {
    /// One material with pictures: those of colour, metalness with roughness, normals and light, as PNG;
    /// metalness and roughness; what opacity means; whether triangles have two sides.
    #[staticmethod]
    fn textured(
        pictures: [Option<Vec<u8>>; 4],
        surface: (f64, f64),
        alpha: &Bound<'_, PyString>,
        double_sided: bool,
    ) -> PyResult<Self> {
        let image = |(name, bytes): (&str, Option<Vec<u8>>)| {
            bytes.map(|bytes| Image {
                name: Some(name.to_owned()),
                mime: "image/png".to_owned(),
                bytes: bytes.into(),
            })
        };
        let [colour, metallic_roughness, normal, emissive] = pictures;
        let (metallic, roughness) = surface;
        let of_colour = image(("base colour", colour));
        let textures = Textures {
            base_colour: of_colour
                .ok_or_else(|| PyValueError::new_err("there is no picture of the colour"))?,
            metallic_roughness: image(("metalness and roughness", metallic_roughness)),
            normal: image(("normals", normal)),
            emissive: image(("light", emissive)),
            metallic,
            roughness,
            alpha: one_of(alpha, "alpha", &ALPHA)?,
            double_sided,
        };
        let materials = Some(attributes::Materials::textured(textures));
        Ok(Self { libraries: Vec::new(), library_folder: None, materials })
    }

    /// Materials, textures and samplers as JSON, as glTF has them; none if there are none.
    fn json(&self) -> Option<String> {
        self.materials.as_ref().map(attributes::Materials::to_json)
    }

    /// The bytes of the pictures that textures refer to.
    fn images<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyBytes>> {
        let images = self.materials.iter().flat_map(attributes::Materials::images);
        images.map(|image| PyBytes::new(py, &image.bytes)).collect()
    }
}

/// Name, role, number type, components, numbers, names of the values.
#[derive(FromPyObject)]
pub struct Column<'py> {
    name: String,
    role: Bound<'py, PyString>,
    kind: Bound<'py, PyString>,
    components: usize,
    values: PyReadonlyArray1<'py, f64>,
    names: Vec<String>,
}

/// Attributes of the vertices and of the faces, texture coordinates (F x 3 x 2) with their number type,
/// materials.
#[derive(FromPyObject)]
pub struct Given<'py> {
    vertex: Vec<Column<'py>>,
    face: Vec<Column<'py>>,
    uv: Option<PyReadonlyArray3<'py, f64>>,
    uv_kind: Bound<'py, PyString>,
    materials: Option<Bound<'py, Materials>>,
}

/// A [`Column`] on its way out.
type NewColumn<'py> = (String, &'static str, &'static str, usize, Bound<'py, PyArray1<f64>>, Vec<String>);

/// A [`Given`] on its way out; the texture coordinates in one row.
pub type New<'py> = (
    Vec<NewColumn<'py>>,
    Vec<NewColumn<'py>>,
    Option<Bound<'py, PyArray1<f64>>>,
    &'static str,
    Option<Materials>,
);

/// The attributes for the library.
///
/// # Errors
/// `InputError` for roles and kinds that there are not, which the package's other modules do not give.
pub fn given(from: &Given<'_>) -> PyResult<Attributes> {
    let column = |column: &Column<'_>| -> PyResult<Attribute> {
        let role = one_of(&column.role, "role", &ROLES)?;
        let kind = one_of(&column.kind, "kind", &KINDS)?;
        let values = column.values.as_slice()?.to_vec();
        let names = column.names.clone();
        Ok(Attribute { names, ..Attribute::new(&column.name, role, kind, column.components, values) })
    };
    let uv = match &from.uv {
        Some(uv) => {
            let (values, _) = uv.as_slice()?.as_chunks::<2>();
            Some(CornerUv { kind: one_of(&from.uv_kind, "kind", &KINDS)?, values: values.to_vec() })
        }
        None => None,
    };
    let materials = from.materials.as_ref().map(|materials| materials.get());
    Ok(Attributes {
        vertex: from.vertex.iter().map(column).collect::<PyResult<_>>()?,
        face: from.face.iter().map(column).collect::<PyResult<_>>()?,
        uv,
        libraries: materials.map(|own| own.libraries.clone()).unwrap_or_default(),
        library_folder: materials.and_then(|own| own.library_folder.clone()),
        materials: materials.and_then(|own| own.materials.clone()),
        // Python does not carry it.
        skin: None,
    })
}

/// The attributes for Python.
pub fn new(py: Python<'_>, attributes: Attributes) -> New<'_> {
    let column = |attribute: Attribute| {
        let role = ROLES.iter().find(|(_, role)| *role == attribute.role).map_or("other", |(name, _)| name);
        let Attribute { name, kind, components, values, names, .. } = attribute;
        (name, role, kind_name(kind), components, PyArray1::from_vec(py, values), names)
    };
    let Attributes { vertex, face, uv, libraries, library_folder, materials, skin: _ } = attributes;
    let kind = uv.as_ref().map_or("float64", |uv| kind_name(uv.kind));
    let uv = uv.map(|uv| PyArray1::from_vec(py, uv.values.into_flattened()));
    let has_materials = materials.is_some() || !libraries.is_empty();
    (
        vertex.into_iter().map(column).collect(),
        face.into_iter().map(column).collect(),
        uv,
        kind,
        has_materials.then_some(Materials { libraries, library_folder, materials }),
    )
}

fn kind_name(kind: Kind) -> &'static str {
    KINDS.iter().find(|(_, known)| *known == kind).map_or("float64", |(name, _)| name)
}
