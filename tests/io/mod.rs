//! Mesh files: reading, writing, and errors.

pub mod attributes;
pub mod gltf;
pub mod gltf_materials;
pub mod gltf_skins;
pub mod hostile;
#[cfg(unix)]
pub mod irregular;
pub mod not_finite;
pub mod obj_and_ply;
pub mod obj_materials;
pub mod other_programs;
pub mod polygons;
pub mod references;
pub mod refused;
pub mod round_trips;
pub mod stl_off_medit;
pub mod text_ends;
pub mod threemf;
pub mod vtk;
pub mod vtk_refused;
