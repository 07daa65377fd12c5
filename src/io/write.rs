//! Writes meshes in every format, and says what a format cannot hold.

use std::io;
use std::io::{BufWriter, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::file::{Prepared, check_text_target, folder_of, output_error, unwritable};
use super::format::{Encoding, Format, extension_problem, written_extensions};
use super::{gltf, medit, obj, off, ply, stl, threemf, vtk};
use crate::Result;
use crate::mesh::TriMesh;
use crate::mesh::attributes::{Attribute, Attributes, Role};

/// Writes `mesh` as [`Writer::write`] does by default, without attributes.
///
/// # Errors
///
/// See there.
pub fn write(path: impl AsRef<Path>, mesh: &TriMesh) -> Result<()> {
    Writer::new().write(path, mesh)
}

/// Writes meshes, with settings.
///
/// ```no_run
/// use rtfmesh::io::{Reader, Writer};
///
/// let textured = Reader::new().materials(true).read("car.gltf")?;
/// Writer::new().attributes(&textured.attributes).write("car.glb", &textured.mesh)?;
/// # Ok::<(), rtfmesh::Error>(())
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct Writer<'a> {
    attributes: Option<&'a Attributes>,
    encoding: Option<Encoding>,
}

impl<'a> Writer<'a> {
    /// A writer for meshes without attributes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the attributes to write, as far as the format can hold them; [`lost_attributes_note`] lists the
    /// others. Writing panics if they belong to another mesh.
    #[must_use]
    pub fn attributes(self, attributes: impl Into<Option<&'a Attributes>>) -> Self {
        Self { attributes: attributes.into(), ..self }
    }

    /// Sets the encoding, regardless of the extension.
    #[must_use]
    pub fn encoding(self, encoding: impl Into<Option<Encoding>>) -> Self {
        Self { encoding: encoding.into(), ..self }
    }

    /// Writes `mesh` in the format of the extension of `path`, compressed if that ends in `.gz`: OBJ, OFF and
    /// MEDIT as text, each f64 in the shortest form that reads back the same; PLY, VTP, VTU and VTK as binary
    /// with double coordinates; STL (binary, or text where groups of faces have names) and GLB with 32-bit
    /// numbers, those of GLB relative to the mesh's own position and size. An existing file is replaced only
    /// when the new one is complete.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Output`]: see [`check_target`]; also a full disk, or a mesh that the format cannot
    /// hold.
    pub fn write(&self, path: impl AsRef<Path>, mesh: &TriMesh) -> Result<()> {
        self.prepare(path.as_ref(), mesh)?.put()
    }

    /// Like [`Writer::write`], without putting the file in its place.
    pub(crate) fn prepare(&self, path: &Path, mesh: &TriMesh) -> Result<Prepared> {
        self.with_encoding(path, mesh, |attributes, encoding| {
            let folder = Some(folder_of(path));
            Prepared::new(path, |file| write_encoded(file, mesh, attributes, encoding, folder))
        })
    }

    /// The bytes of the file that [`Writer::write`] would write; errors show `name` as its path.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Output`]: without an encoding, see [`target_encoding`]; a mesh that the format cannot
    /// hold.
    pub fn encode(&self, name: impl AsRef<Path>, mesh: &TriMesh) -> Result<Vec<u8>> {
        let name = name.as_ref();
        self.with_encoding(name, mesh, |attributes, encoding| {
            let mut bytes = Vec::new();
            let written = write_encoded(&mut bytes, mesh, attributes, encoding, None);
            written.map_err(|error| unwritable(name, error)).map(|()| bytes)
        })
    }

    fn with_encoding<T>(
        &self,
        name: &Path,
        mesh: &TriMesh,
        write: impl FnOnce(&Attributes, Encoding) -> Result<T>,
    ) -> Result<T> {
        let encoding = self.encoding.map_or_else(|| target_encoding(name), Ok)?;
        let none = Attributes::default();
        let attributes = self.attributes.unwrap_or(&none);
        check_fits(name, mesh, attributes, encoding.format)?;
        write(attributes, encoding)
    }
}

/// The attributes that the format cannot hold, as a sentence; `None` if it holds all.
pub fn lost_attributes_note(attributes: &Attributes, format: Format) -> Option<String> {
    let role = |a: &Attribute, role: Role, components: std::ops::RangeInclusive<usize>| {
        a.role == role && components.contains(&a.components)
    };
    let holds_vertex_attribute = |a: &Attribute| match format {
        Format::Ply | Format::Vtp | Format::Vtu | Format::Vtk => true,
        Format::Obj | Format::Glb => role(a, Role::Colour, 3..=4) || role(a, Role::Normal, 3..=3),
        Format::Off => role(a, Role::Colour, 3..=4),
        Format::Medit => a.name == medit::REFERENCE,
        _ => false,
    };
    let holds_face_attribute = |a: &Attribute| match format {
        Format::Ply | Format::Vtp | Format::Vtu | Format::Vtk => true,
        Format::Obj => matches!(a.name.as_str(), "material" | "group" | "object"),
        Format::Glb => a.name == "material",
        Format::ThreeMf => matches!(a.name.as_str(), "material" | "object") && !a.names.is_empty(),
        Format::Stl => stl::solids(attributes).is_some_and(|label| label.name == a.name),
        Format::Medit => medit::face_label(attributes).is_some_and(|label| label.name == a.name),
        _ => false,
    };
    let is_of_vtk = matches!(format, Format::Vtp | Format::Vtu | Format::Vtk);
    let holds_uv = is_of_vtk || matches!(format, Format::Ply | Format::Obj | Format::Glb);
    let dropped = Attributes {
        vertex: attributes.vertex.iter().filter(|a| !holds_vertex_attribute(a)).cloned().collect(),
        face: attributes.face.iter().filter(|a| !holds_face_attribute(a)).cloned().collect(),
        uv: attributes.uv.clone().filter(|_| !holds_uv),
        // An OBJ file names the library that has them.
        materials: attributes.materials.clone().filter(|materials| {
            let is_named = format == Format::Obj && !attributes.libraries.is_empty();
            // 3MF has colours, but no pictures.
            let is_held = format == Format::ThreeMf && materials.images.is_empty();
            format != Format::Glb && !is_named && !is_held && materials.used_count() > 0
        }),
        skin: attributes.skin.clone().filter(|_| format != Format::Glb),
        ..Attributes::default()
    };
    let list = dropped.listed().join(", ");
    let has_names = |a: &&Attribute| !a.names.is_empty() && holds_face_attribute(a);
    let has_numbers_alone = is_of_vtk || matches!(format, Format::Ply | Format::Medit);
    let loses_names = has_numbers_alone && attributes.face.iter().any(|a| has_names(&a));
    match (list.is_empty(), loses_names) {
        (true, false) => None,
        (true, true) => Some(format!("{} stores labels as numbers, without their names", format.name())),
        (false, _) => Some(format!("{} cannot hold these: {list}", format.name())),
    }
}

/// `folder` is that of the file, if it has one.
fn write_encoded(
    file: &mut dyn Write,
    mesh: &TriMesh,
    attributes: &Attributes,
    encoding: Encoding,
    folder: Option<&Path>,
) -> io::Result<()> {
    if !encoding.gzip {
        return write_uncompressed(file, mesh, attributes, encoding.format, folder);
    }
    // The header has neither name nor time, so that the same mesh gives the same bytes.
    let mut packed = BufWriter::new(GzEncoder::new(file, Compression::default()));
    write_uncompressed(&mut packed, mesh, attributes, encoding.format, folder)?;
    packed.into_inner().map_err(io::IntoInnerError::into_error)?.finish()?;
    Ok(())
}

fn write_uncompressed(
    file: &mut dyn Write,
    mesh: &TriMesh,
    attributes: &Attributes,
    format: Format,
    folder: Option<&Path>,
) -> io::Result<()> {
    match format {
        Format::Obj => obj::write::write(file, mesh, attributes, folder),
        Format::Ply => ply::write::write(file, mesh, attributes),
        Format::Stl => stl::write(file, mesh, attributes),
        Format::Off => off::write(file, mesh, attributes),
        Format::Glb => gltf::write(file, mesh, attributes),
        Format::Medit => medit::write(file, mesh, attributes),
        Format::Vtp => vtk::write_poly_data(file, mesh, attributes),
        Format::Vtu => vtk::write_unstructured(file, mesh, attributes),
        Format::Vtk => vtk::write_legacy(file, mesh, attributes),
        Format::ThreeMf => threemf::write(file, mesh, attributes),
        // `check_fits` has refused it.
        Format::Gltf => Err(io::Error::other(ONLY_GLB)),
        Format::Xyz
        | Format::Pcd
        | Format::Las
        | Format::E57
        | Format::Npy
        | Format::Nrrd
        | Format::Nifti
        | Format::MetaImage
        | Format::Vti => Err(io::Error::other(NO_MESHES)),
    }
}

const ONLY_GLB: &str = "glTF is written as .glb only";
/// What is wrong with writing a mesh in a format of points or volumes.
const NO_MESHES: &str = "this format has no faces";

/// Refuses what the format cannot hold.
fn check_fits(path: &Path, mesh: &TriMesh, attributes: &Attributes, format: Format) -> Result<()> {
    match format {
        Format::Gltf => Err(output_error(path, ONLY_GLB, "name the result .glb")),
        other if other.is_of_points() || other.is_of_volumes() => {
            Err(output_error(path, NO_MESHES, &format!("name the result {}", written_extensions())))
        }
        Format::Glb if mesh.triangles.is_empty() => {
            Err(output_error(path, "a GLB file cannot hold a mesh without faces", "choose another format"))
        }
        // 64 KiB are for the JSON.
        Format::Glb if gltf::byte_length(mesh, attributes) > u64::from(u32::MAX) - (1 << 16) => {
            Err(output_error(path, "a GLB file cannot hold more than 4 GiB", "choose another format"))
        }
        Format::Stl if mesh.triangles.len() as u64 > u64::from(u32::MAX) => Err(output_error(
            path,
            "the mesh has too many triangles for an STL file",
            "choose another \
            format",
        )),
        Format::Vtk if mesh.triangles.len() >= 1 << 29 || mesh.vertices.len() >= 1 << 31 => {
            Err(output_error(path, "the mesh has too many triangles for a .vtk file", "name the result .vtp"))
        }
        Format::Stl if mesh.vertices.iter().any(|vertex| !vertex.as_vec3().is_finite()) => {
            Err(output_error(path, "an STL file cannot hold numbers beyond 3.4e38", "choose another format"))
        }
        _ => Ok(()),
    }
}

/// Checks in advance whether [`write()`] can write to `path`, and leaves nothing behind.
///
/// # Errors
///
/// [`crate::Error::Output`]: no format that can be written has this extension; the folder is missing or may
/// not be written to; the target is a directory, a device or read-only, or `-`.
pub fn check_target(path: impl AsRef<Path>) -> Result<()> {
    target_encoding(&path)?;
    check_text_target(path)
}

/// The encoding in which [`write()`] writes a file of this name.
///
/// # Errors
///
/// [`crate::Error::Output`]: no format that can be written has this extension.
pub fn target_encoding(path: impl AsRef<Path>) -> Result<Encoding> {
    let path = path.as_ref();
    let remedy = format!("name the result {}", written_extensions());
    match Encoding::of_name(path) {
        Some(Encoding { format: Format::Gltf, .. }) => {
            Err(output_error(path, ONLY_GLB, "name the result .glb"))
        }
        Some(Encoding { format, .. }) if format.is_of_points() || format.is_of_volumes() => {
            Err(output_error(path, NO_MESHES, &remedy))
        }
        Some(encoding) => Ok(encoding),
        None => Err(output_error(path, extension_problem(path), &remedy)),
    }
}
