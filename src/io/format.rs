//! The mesh formats, and how to tell them apart.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::checks::excerpt;
use super::points::{e57, las, pcd};
use super::volumes::{metaimage, nifti, npy, nrrd};
use super::vtk::FileKind;
use super::{off, stl, threemf, vtk};
use crate::Error;

/// A mesh file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// Wavefront OBJ, text.
    Obj,
    /// Stanford PLY, text or binary; written binary.
    Ply,
    /// STL, text or binary; written in 32-bit numbers: as text where there are named groups, else binary.
    Stl,
    /// Geomview's OFF, text.
    Off,
    /// glTF 2.0 as JSON with its buffers inside or next to it; read only.
    Gltf,
    /// glTF 2.0 in one binary file, in 32-bit numbers relative to the mesh's own size.
    Glb,
    /// MEDIT's `.mesh`, text.
    Medit,
    /// Points as lines of numbers, text; read only.
    Xyz,
    /// Points in the PCD format of the Point Cloud Library, text or binary; read only.
    Pcd,
    /// Values on a grid as an array of NumPy; read only.
    Npy,
    /// Values on a grid in NRRD; read only.
    Nrrd,
    /// Values on a grid in NIfTI-1; read only.
    #[serde(rename = "nii")]
    Nifti,
    /// Values on a grid in MetaImage, the format of ITK; read only.
    #[serde(rename = "mha")]
    MetaImage,
    /// Points of laser scanners, plain or packed as LAZ; read only.
    Las,
    /// Scans of points with their poses; read only.
    E57,
    /// VTK's poly data in XML; written with 64-bit numbers.
    Vtp,
    /// VTK's unstructured grids in XML: surface cells, or the boundary of volume cells; written with 64-bit
    /// numbers.
    Vtu,
    /// VTK's older format: poly data, unstructured grids, or values on a grid; written as binary poly data.
    Vtk,
    /// Values on a grid in VTK's XML; read only.
    Vti,
    /// 3MF, the format of 3D printing, in millimetres.
    #[serde(rename = "3mf")]
    ThreeMf,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 20] = [
        Self::Obj,
        Self::Ply,
        Self::Stl,
        Self::Off,
        Self::Gltf,
        Self::Glb,
        Self::Medit,
        Self::Xyz,
        Self::Pcd,
        Self::Npy,
        Self::Nrrd,
        Self::Nifti,
        Self::Las,
        Self::E57,
        Self::MetaImage,
        Self::Vtp,
        Self::Vtu,
        Self::Vtk,
        Self::Vti,
        Self::ThreeMf,
    ];

    /// The usual name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
            Self::Glb => "GLB",
            Self::Medit => "MEDIT",
            Self::Xyz => "XYZ",
            Self::Pcd => "PCD",
            Self::Npy => "NumPy's format",
            Self::Nrrd => "NRRD",
            Self::Nifti => "NIfTI",
            Self::MetaImage => "MetaImage",
            Self::Las => "LAS",
            Self::E57 => "E57",
            Self::Vtp => "VTP",
            Self::Vtu => "VTU",
            Self::Vtk => "VTK",
            Self::Vti => "VTI",
            Self::ThreeMf => "3MF",
        }
    }

    /// The extension of its files, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Off => "off",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::Medit => "mesh",
            Self::Xyz => "xyz",
            Self::Pcd => "pcd",
            Self::Npy => "npy",
            Self::Nrrd => "nrrd",
            Self::Nifti => "nii",
            Self::MetaImage => "mha",
            Self::Las => "las",
            Self::E57 => "e57",
            Self::Vtp => "vtp",
            Self::Vtu => "vtu",
            Self::Vtk => "vtk",
            Self::Vti => "vti",
            Self::ThreeMf => "3mf",
        }
    }

    /// The format with this extension, in upper or lower case, or "medit".
    fn from_word(word: &str) -> Option<Self> {
        let named = |format: &Self| word.eq_ignore_ascii_case(format.extension());
        let is = |other: &&str| word.eq_ignore_ascii_case(other);
        let medit = is(&"medit").then_some(Self::Medit);
        let lines = ["txt", "csv", "asc", "pts", "xyzn", "xyzrgb"].into_iter().find(is).map(|_| Self::Xyz);
        let header = is(&"nhdr").then_some(Self::Nrrd).or(is(&"mhd").then_some(Self::MetaImage));
        let packed = is(&"laz").then_some(Self::Las);
        Self::ALL.into_iter().find(named).or(medit).or(lines).or(header).or(packed)
    }

    /// Whether meshes can be written in it.
    pub fn is_written(self) -> bool {
        !matches!(self, Self::Gltf) && !self.is_of_points() && !self.is_of_volumes()
    }

    /// Whether its files have points without faces.
    pub fn is_of_points(self) -> bool {
        matches!(self, Self::Xyz | Self::Pcd | Self::Las | Self::E57)
    }

    /// Whether its files have values on a grid.
    pub fn is_of_volumes(self) -> bool {
        matches!(self, Self::Npy | Self::Nrrd | Self::Nifti | Self::MetaImage | Self::Vti)
    }

    /// Whether its files are text and never binary.
    pub(crate) fn is_always_text(self) -> bool {
        matches!(self, Self::Obj | Self::Off | Self::Gltf | Self::Medit | Self::Xyz)
    }

    /// Whether it is written as text, which a terminal can show.
    pub fn is_written_as_text(self) -> bool {
        matches!(self, Self::Obj | Self::Off | Self::Medit)
    }
}

/// A format, plain or compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Encoding {
    /// The format of the uncompressed file.
    pub format: Format,
    /// Whether the file is compressed with gzip.
    pub gzip: bool,
}

impl Encoding {
    /// From the name of a file, such as `kitten.ply` or `kitten.ply.gz`; `None` if the extension is unknown.
    pub fn of_name(path: impl AsRef<Path>) -> Option<Self> {
        let path = path.as_ref();
        let uncompressed = without_gz(path);
        let format = Format::from_word(uncompressed.extension()?.to_str()?)?;
        Some(Self { format, gzip: uncompressed != path })
    }
}

/// The path without a final `.gz`.
fn without_gz(path: &Path) -> &Path {
    let compressed = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    match path.file_stem() {
        Some(stem) if compressed => Path::new(stem),
        _ => path,
    }
}

impl fmt::Display for Encoding {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        write!(out, "{}{}", self.format.extension(), if self.gzip { ".gz" } else { "" })
    }
}

impl FromStr for Encoding {
    type Err = Error;

    /// `ply`, `ply.gz` and the like, in upper or lower case; `medit` means `mesh`.
    fn from_str(text: &str) -> Result<Self, Error> {
        let plain = text.len().checked_sub(3).and_then(|at| text.split_at_checked(at));
        let plain = plain.filter(|(_, end)| end.eq_ignore_ascii_case(".gz")).map(|(plain, _)| plain);
        match Format::from_word(plain.unwrap_or(text)) {
            Some(format) => Ok(Self { format, gzip: plain.is_some() }),
            None => {
                let problem = format!("unknown format '{}'", excerpt(text));
                Err(Error::usage(
                    problem,
                    format!("use one for {}; all may end in .gz", known_extensions("")),
                ))
            }
        }
    }
}

/// The extensions as "obj, ply or stl".
fn list(formats: &[Format]) -> String {
    let names: Vec<&str> = formats.iter().map(|format| format.extension()).collect();
    match names.as_slice() {
        [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => names.join(", "),
    }
}

/// The extensions of the formats that are written, as ".obj, .ply or .stl".
pub(crate) fn written_extensions() -> String {
    let written: Vec<Format> = Format::ALL.into_iter().filter(|format| format.is_written()).collect();
    format!(".{}", list(&written).replace(", ", ", .").replace("or ", "or ."))
}

/// The extensions of all formats by what their files have, each after `dot`: "meshes (obj, ply or stl),
/// points (xyz or las) or volumes (npy or nrrd)".
pub(crate) fn known_extensions(dot: &str) -> String {
    let group = |what: &str, is_in: &dyn Fn(&Format) -> bool| {
        let formats: Vec<Format> = Format::ALL.into_iter().filter(is_in).collect();
        let named = list(&formats).replace(", ", &format!(", {dot}")).replace("or ", &format!("or {dot}"));
        format!("{what} ({dot}{named})")
    };
    let meshes = group("meshes", &|format| !format.is_of_points() && !format.is_of_volumes());
    let points = group("points", &|format| format.is_of_points());
    format!("{meshes}, {points} or {}", group("volumes", &|format| format.is_of_volumes()))
}

/// What is wrong with a name whose extension is not that of a format.
pub(crate) fn extension_problem(path: &Path) -> String {
    match path.extension() {
        Some(extension) => format!("unknown file type '.{}'", extension.to_string_lossy()),
        None => "the file name has no extension".to_owned(),
    }
}

/// Bytes of a text file that are examined.
const START_BYTES: usize = 4096;

/// The format if the content leaves no doubt about it.
pub(crate) fn format_of_content(bytes: &[u8]) -> Option<Format> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Some(Format::Ply);
    }
    if pcd::starts(bytes) {
        return Some(Format::Pcd);
    }
    if las::starts(bytes) {
        return Some(Format::Las);
    }
    if e57::starts(bytes) {
        return Some(Format::E57);
    }
    if bytes.starts_with(b"glTF") {
        return Some(Format::Glb);
    }
    if npy::starts(bytes) {
        return Some(Format::Npy);
    }
    if nrrd::starts(bytes) {
        return Some(Format::Nrrd);
    }
    if metaimage::starts(bytes) {
        return Some(Format::MetaImage);
    }
    if threemf::starts(bytes) {
        return Some(Format::ThreeMf);
    }
    if vtk::starts_legacy(bytes) {
        return Some(Format::Vtk);
    }
    if let Some(kind) = vtk::kind_of(bytes) {
        // What other kinds cannot be read for is said when they are.
        return Some(match kind {
            Ok(FileKind::UnstructuredGrid) => Format::Vtu,
            Ok(FileKind::ImageData) => Format::Vti,
            Ok(FileKind::PolyData) | Err(_) => Format::Vtp,
        });
    }
    if stl::has_binary_size(bytes) {
        return Some(Format::Stl);
    }
    if nifti::starts(bytes) {
        return Some(Format::Nifti);
    }
    if bytes.trim_ascii_start().starts_with(b"{") {
        return Some(Format::Gltf);
    }
    let start = String::from_utf8_lossy(bytes.get(..START_BYTES).unwrap_or(bytes));
    let lines = || {
        let has_content = |line: &&str| !line.is_empty() && !line.starts_with('#');
        start.split(['\n', '\r']).map(str::trim).filter(has_content)
    };
    let first_word = |line: &str| line.split_whitespace().next().unwrap_or_default().to_owned();
    let first = lines().next().map(first_word).unwrap_or_default();
    if first.eq_ignore_ascii_case("MeshVersionFormatted") {
        return Some(Format::Medit);
    }
    if off::is_keyword(&first) {
        return Some(Format::Off);
    }
    let facet = |line: &str| ["facet", "endsolid"].iter().any(|w| first_word(line).eq_ignore_ascii_case(w));
    if first.eq_ignore_ascii_case("solid") && lines().any(facet) {
        return Some(Format::Stl);
    }
    // Comments and names may come first; only OBJ has lines of "v" and three numbers.
    let vertex_line = |line: &str| {
        let mut words = line.split_whitespace();
        words.next() == Some("v") && words.take(3).filter(|word| word.parse::<f64>().is_ok()).count() == 3
    };
    lines().any(vertex_line).then_some(Format::Obj)
}
