//! The passes that improve a mesh, for meshes without constraints.

use rtfmesh::polish::{
    ConstrainedMesh, FitCounts, FitOptions, OutlierOptions, PolishOptions, Polished, ReducedOutliers, Target,
};
use rtfmesh::{ProgressToken, Result, TriMesh};

pub fn polish(mesh: &mut TriMesh, target: &Target, options: &PolishOptions) -> Polished {
    unconstrained(mesh, |mesh, progress| rtfmesh::polish::polish(mesh, target, options, progress))
}

pub fn fit(mesh: &mut TriMesh, target: &Target, options: &FitOptions) -> FitCounts {
    unconstrained(mesh, |mesh, progress| rtfmesh::polish::fit(mesh, target, options, progress))
}

pub fn reduce_outliers(
    mesh: &mut TriMesh,
    target: &Target,
    edge: f64,
    options: &OutlierOptions,
) -> ReducedOutliers {
    unconstrained(mesh, |mesh, progress| {
        rtfmesh::polish::reduce_outliers(mesh, target, edge, options, progress)
    })
}

fn unconstrained<R>(
    mesh: &mut TriMesh,
    pass: impl FnOnce(&mut ConstrainedMesh, &ProgressToken) -> Result<R>,
) -> R {
    let mut constrained = ConstrainedMesh::from(std::mem::take(mesh));
    let made = pass(&mut constrained, &ProgressToken::default()).unwrap();
    *mesh = constrained.mesh;
    made
}
