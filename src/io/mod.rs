//! Reading and writing mesh files: OBJ, PLY, STL, OFF, glTF, MEDIT, 3MF and VTK's, plain or gzipped.
//! Points are read from PLY, OFF, PCD, glTF, VTK's files and lines of numbers (XYZ), volumes from NumPy's
//! arrays, NRRD, NIfTI, MetaImage and VTK's images.

mod binary;
mod cells;
mod checks;
mod file;
mod format;
mod gltf;
mod gzip;
mod image_type;
mod loaded;
mod lzf;
mod medit;
mod not_finite;
mod obj;
mod off;
mod open;
mod ply;
mod points;
mod polygons;
mod read;
mod references;
mod rounding;
mod rows;
mod stl;
mod text;
mod threemf;
mod unused;
mod volumes;
mod vtk;
mod write;

pub(crate) use cells::check_cells_target;
pub use cells::{encode_cells, write_cells};
pub(crate) use file::Prepared;
pub use format::{Encoding, Format};
pub use loaded::Loaded;
pub(crate) use obj::feature_lines::read_feature_lines;
pub use obj::feature_lines::write_features;
pub use open::Patience;
pub(crate) use open::{read_file_bytes, read_standard_input};
pub use read::{Input, Reader, read};
pub(crate) use rounding::{KEEPING_64_BITS, has_32_bits};
pub use rounding::{lost_precision_note, rounded};
pub use volumes::Volume;
pub use write::{Writer, check_target, lost_attributes_note, target_encoding, write};

#[cfg(not(feature = "internals"))]
pub(crate) use file::{check_text_target, write_bytes, write_text};
#[cfg(feature = "internals")]
pub use file::{check_text_target, write_bytes, write_text};
