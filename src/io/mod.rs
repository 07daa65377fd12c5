//! Reading and writing mesh files: OBJ, PLY, STL, OFF, glTF, MEDIT, 3MF and VTK's, plain or gzipped.
//! Points are read from PLY, OFF, PCD, VTK's files and lines of numbers (XYZ), volumes from NumPy's arrays,
//! NRRD, NIfTI, MetaImage and VTK's images.

mod binary;
mod checks;
mod file;
mod format;
mod gltf;
mod gzip;
mod loaded;
mod lzf;
mod medit;
mod obj;
mod off;
mod open;
mod ply;
mod points;
mod read;
mod references;
mod rounding;
mod stl;
mod text;
mod threemf;
mod volumes;
mod vtk;
mod write;

pub(crate) use file::Prepared;
pub use file::{check_text_target, write_bytes, write_text};
pub use format::{Encoding, Format};
pub use loaded::Loaded;
pub use obj::feature_lines::{read_feature_lines, write_features};
pub(crate) use open::read_file_bytes;
pub use open::{Patience, read_standard_input};
pub use read::{
    Input, ReadOptions, read, read_any, read_any_bytes, read_any_with, read_as, read_bytes,
    read_bytes_with_materials, read_with_materials,
};
pub(crate) use rounding::KEEPING_64_BITS;
pub use rounding::{lost_precision_note, rounded};
pub use volumes::Volume;
pub(crate) use write::prepare;
pub use write::{
    check_target, encode, encode_with, lost_attributes_note, target_encoding, write, write_as, write_with,
};
