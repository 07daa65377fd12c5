//! One mesh after another on one device.

use crate::mesh::repair::repair_with;
use crate::pipeline::kept::vertices_for;
use crate::pipeline::{compile, compile_later, remesh_repaired};
use crate::{Device, Flow, Options, Progress, Remeshed, Result, Size, TriMesh};

/// Remeshes any number of meshes with the same options on the same device. Compiled kernels and device memory
/// are reused.
///
/// Threads may share a remesher or have a clone each; runs on one device then take turns on it.
///
/// ```
/// use rtfmesh::{Device, DeviceOptions, Options, Remesher, mesh::samples::sample};
///
/// let device = Device::open(&DeviceOptions::from_env())?;
/// let remesher = Remesher::new(&device, Options::new(300))?;
/// for name in ["torus", "bumpy-sphere"] {
///     let result = remesher.remesh(&sample(name)?)?;
///     assert_eq!(result.mesh.vertices.len(), 300);
/// }
/// # Ok::<(), rtfmesh::Error>(())
/// ```
#[derive(Clone)]
pub struct Remesher {
    device: Device,
    options: Options,
    /// The size of every result; `None` stands for the options' vertices.
    size: Option<Size>,
}

impl Remesher {
    /// Checks the options and compiles the kernels they need.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for options out of range, and the device's errors.
    pub fn new(device: &Device, options: Options) -> Result<Self> {
        options.validate()?;
        compile(device, options.method)?;
        compile_later(device, options.method, options.vertices)?;
        Ok(Self { device: device.clone(), options, size: None })
    }

    /// Sets the size of the results, which may depend on the mesh, instead of [`Options::vertices`].
    ///
    /// # Errors
    /// [`crate::Error::Usage`] as [`Size::validate`].
    pub fn with_size(self, size: Size) -> Result<Self> {
        size.validate()?;
        Ok(Self { size: Some(size), ..self })
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// The options.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Same as [`crate::remesh`].
    ///
    /// # Errors
    /// See there.
    pub fn remesh(&self, mesh: &TriMesh) -> Result<Remeshed> {
        self.remesh_with_progress(mesh, |_| {})
    }

    /// Same as [`crate::remesh_with_progress`].
    ///
    /// # Errors
    /// See there; also those of [`Size::vertices`] for this mesh.
    pub fn remesh_with_progress<F: Into<Flow>>(
        &self,
        mesh: &TriMesh,
        progress: impl FnMut(Progress) -> F,
    ) -> Result<Remeshed> {
        let Some(size) = self.size else {
            return remesh_repaired(&self.device, mesh, None, &self.options, progress);
        };
        // Ratios and edge lengths refer to what is left after the repair.
        let repaired = repair_with(mesh, &self.options.repairs())?;
        let faces = if let Size::Faces(count) = size { Some(count) } else { self.options.faces };
        let vertices = vertices_for(size, &repaired, &self.options, mesh)?;
        let options = self.options.clone().vertices(vertices).faces(faces);
        remesh_repaired(&self.device, mesh, Some(repaired), &options, progress)
    }
}
