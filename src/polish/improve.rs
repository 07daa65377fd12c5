//! The passes over a connected mesh on the host, in their order.

use super::{
    ConstrainedMesh, FitOptions, OutlierOptions, PolishOptions, Target, fit, polish, reduce_outliers,
};
use crate::{ProgressToken, Result};

/// A pass over a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pass {
    Polish,
    Fit,
    Outliers,
}

/// Settings of [`improve`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct PassOptions {
    pub polish: PolishOptions,
    /// Whether vertices may leave the surface for a closer fit. Without it, the polish is the only pass.
    pub fit: bool,
    /// `None` leaves outliers as they are.
    pub outliers: Option<OutlierOptions>,
    /// The typical edge length of the mesh.
    pub edge: f64,
}

/// Improves a mesh by all passes, in order: triangles, fit, outliers. Ends after the first pass that
/// `is_accepted` rejects, and returns it. The mesh of the last level has the same passes in
/// `CoarseToFine::improve`, where the device may make them.
///
/// # Errors
/// [`crate::Error::Cancelled`], and those of `is_accepted`.
pub(crate) fn improve(
    mesh: &mut ConstrainedMesh,
    target: &Target,
    options: &PassOptions,
    progress: &ProgressToken,
    mut is_accepted: impl FnMut(&ConstrainedMesh) -> Result<bool>,
) -> Result<Option<Pass>> {
    polish(mesh, target, &options.polish, progress)?;
    if !is_accepted(mesh)? {
        return Ok(Some(Pass::Polish));
    }
    if !options.fit {
        return Ok(None);
    }
    fit(mesh, target, &FitOptions::default(), progress)?;
    if !is_accepted(mesh)? {
        return Ok(Some(Pass::Fit));
    }
    let Some(outliers) = &options.outliers else { return Ok(None) };
    reduce_outliers(mesh, target, options.edge, outliers, progress)?;
    Ok(if is_accepted(mesh)? { None } else { Some(Pass::Outliers) })
}
