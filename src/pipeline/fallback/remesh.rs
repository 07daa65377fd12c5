//! One component remeshed by local operations, or simplified where they fail, to a number of vertices.

use super::closer::Closer;
use crate::local::{EdgeLengths, LocalOptions, LocalSurface, MendOptions, mend_angles, relaxed};
use crate::mesh::bvh::Bvh;
use crate::mesh::features::{Curve, FeatureOptions, Features, find_features};
use crate::mesh::half_edges::{edge_key, next};
use crate::mesh::quality::quality;
use crate::mesh::simplify::{Preserved, Simplified, with_vertices};
use crate::mesh::sizing::SizeField;
use crate::mesh::spacing;
use crate::mesh::submesh::extract;
use crate::mesh::topology::{Topology, topology};
use crate::mesh::unit_frame::UnitFrame;
use crate::options::Shortage;
use crate::pipeline::intersections::intersecting_in_units;
use crate::pipeline::missing::MISSING;
use crate::pipeline::sides::face_as;
use crate::polish::{
    ConstrainedMesh, OutlierOptions, Pass, PassOptions, PolishOptions, Target, improve, is_to_be_smoothed,
    smooth,
};
use crate::{Options, ProgressToken, Result, TriMesh};
use glam::DVec3;
use rayon::prelude::*;
use std::cell::OnceCell;
use std::cmp::Ordering;

/// What is to be made of a component, and how.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ComponentTarget<'a> {
    pub vertices: usize,
    /// Edges that turn by more than this many degrees are kept, as far as there are vertices for it.
    pub feature_angle: f64,
    /// Rounds of the polish.
    pub polish_rounds: u32,
    /// Whether vertices may leave the surface for a closer fit.
    pub fit: bool,
    /// Triangles with a smaller angle are mended.
    pub min_angle: f64,
    /// Whether the mesh is smoothed in the end.
    pub smooths: bool,
    /// Edge length of the whole mesh, or of a component that has shorter ones.
    pub spacing: f64,
    /// From the input's units to those of the component.
    pub frame: &'a UnitFrame,
    /// Whether a mesh that is close to the surface, however uneven, comes first: see [`Closer`].
    pub closely: bool,
    /// Whether many cells of the surface were broken.
    pub has_broken_cells: bool,
    /// Whether too few vertices are refused before faces may intersect.
    pub refuses: bool,
    /// Whether faces may intersect where there are too few vertices otherwise.
    pub may_intersect: bool,
    /// Over the whole surface; `None` if edges are equally long everywhere.
    pub sizes: Option<&'a SizeField>,
    pub progress: &'a ProgressToken,
}

impl<'a> ComponentTarget<'a> {
    /// From the options, for a mesh with this spacing.
    pub fn new(
        options: &Options,
        vertices: usize,
        spacing: f64,
        frame: &'a UnitFrame,
        progress: &'a ProgressToken,
    ) -> Self {
        let method = &options.coarse_to_fine;
        Self {
            vertices,
            feature_angle: method.feature_angle,
            polish_rounds: method.polish_rounds,
            fit: method.fit,
            min_angle: method.min_angle,
            smooths: method.polish_rounds > 0 && method.sizing.deviation().is_none(),
            spacing,
            frame,
            closely: false,
            has_broken_cells: false,
            refuses: options.shortage != Shortage::BestEffort,
            may_intersect: false,
            sizes: None,
            progress,
        }
    }

    /// The passes over a mesh made for it.
    fn passes(&self, rounds: u32, keeps_chords: bool) -> PassOptions {
        PassOptions {
            polish: PolishOptions { rounds, keeps_chords, ..Default::default() },
            fit: self.fit,
            outliers: Some(OutlierOptions { keeps_chords, ..Default::default() }),
            edge: self.spacing,
        }
    }

    /// Options that find the features of a component.
    fn features(&self) -> FeatureOptions {
        FeatureOptions { feature_angle: self.feature_angle, ..FeatureOptions::new(self.spacing) }
    }

    /// The same with another number of vertices.
    pub fn with_vertices(self, vertices: usize) -> Self {
        Self { vertices, ..self }
    }
}

/// Longest target lengths, in spacings, of the tries: where more corners are kept, the rest has fewer
/// vertices.
const TRIES: [f64; 4] = [1.06, 1.06, 1.25, 1.25];
/// With a handle or tunnel for this many vertices or fewer, the first try is guarded, too: between that many
/// sheets, tries without a guard mostly fail.
const VERTICES_PER_HANDLE: usize = 50;
/// Maximum number of polishes; each further one has more vertices fixed, where faces came to intersect.
const POLISHES: u32 = 4;
/// Rings of vertices that are fixed around faces that came to intersect.
const RINGS: u32 = 2;
/// A simplified mesh with more vertices, and more than twice those asked for, is not polished, since it tells
/// only how many there must be.
const FEW: usize = 1000;
/// Edges of a component's own length count if they are shorter than this share of the whole mesh's.
const FINER: f64 = 0.9;
/// One made for the longer ones must have a smallest angle so many degrees larger.
const GAIN: f64 = 5.0;
/// A small mesh whose smallest angle is below this many degrees before the polish is made again, gradually.
const POOR: f64 = 25.0;
/// Meshes with more vertices are not, since that takes too long.
const MOST_GRADUAL: usize = 300;
/// Vertices of the surface at a larger distance, in edge lengths, are left out.
const LEFT_OUT: f64 = 1.0;
/// With more faces, a try takes many seconds, and noise alone leaves some vertices out: there is another only
/// if one is missing.
const MANY_FACES: usize = 300_000;
/// Rounds of polish beyond those of a mesh from cells, whose triangles are more even from the start.
const MORE_ROUNDS: u32 = 10;

/// A remeshed and polished mesh with the target number of vertices, or more if the topology needs more; where
/// that fails or takes too long, a simplified one. `lengths` are relative target edge lengths at the
/// vertices; empty if they are all equal. A component with more vertices than its area's share is made for
/// edges of its own length; if that fails or makes small angles, also for those of the whole mesh.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn remesh_component(
    surface: &TriMesh,
    lengths: &[f64],
    target: &ComponentTarget,
) -> Result<TriMesh> {
    // Edges of the whole mesh's length hide what is sharp on a small component, and make needles there.
    let own = ComponentTarget { spacing: spacing(surface.area(), target.vertices), ..*target };
    let is_finer = own.spacing > 0.0 && own.spacing < FINER * target.spacing;
    // Relative lengths make up for their mean.
    if !is_finer || !lengths.is_empty() || target.closely {
        return make_component(surface, lengths, target);
    }
    let first = make_component(surface, lengths, &own)?;
    let smallest = |mesh: &TriMesh| quality(mesh).map_or(0.0, |quality| quality.min_angle);
    let has_count = first.vertices.len() == target.vertices;
    let is_enough = has_count && (smallest(&first) >= POOR || target.vertices > MOST_GRADUAL);
    if is_enough || target.progress.leave_out() {
        return Ok(first);
    }
    let second = make_component(surface, lengths, target)?;
    let is_better = match second.vertices.len().cmp(&first.vertices.len()) {
        Ordering::Equal => smallest(&second) >= smallest(&first) + GAIN,
        order => order == Ordering::Less,
    };
    Ok(if is_better { second } else { first })
}

/// The component with the edge length of the target.
fn make_component(surface: &TriMesh, lengths: &[f64], target: &ComponentTarget) -> Result<TriMesh> {
    // The share of the phase that this is of is unknown.
    let progress = &target.progress.silent();
    let mut mesh = match remesh_locally(surface, lengths, (&target.features(), target), progress)? {
        Some(mesh) => mesh,
        None => simplify_and_polish(surface, target, progress)?,
    };
    face_as(&mut mesh, surface);
    Ok(mesh)
}

fn simplify_and_polish(
    surface: &TriMesh,
    target: &ComponentTarget,
    progress: &ProgressToken,
) -> Result<TriMesh> {
    let Simplified { mesh: raw, fixed, .. } = simplify_component(surface, target)?;
    let vertices = raw.vertices.len();
    if vertices > FEW && vertices > 2 * target.vertices {
        return Ok(raw);
    }
    let surface = Target::new(surface);
    let (before, most) = (topology(&raw), intersecting_in_units(&raw, target.frame, progress)?.len());
    let is_sound = |mesh: &TriMesh| -> Result<bool> {
        let intersecting = intersecting_in_units(mesh, target.frame, progress)?;
        Ok(intersecting.len() <= most && topology(mesh).matches(&before))
    };
    let relaxed = relaxed(raw.clone(), fixed.clone(), &surface, progress)?;
    let relaxed = if is_sound(&relaxed)? { relaxed } else { raw };
    if progress.leave_out() {
        return Ok(relaxed);
    }
    let mut polished = ConstrainedMesh { fixed, ..relaxed.clone().into() };
    let passes = PassOptions { outliers: None, ..target.passes(target.polish_rounds, false) };
    improve(&mut polished, &surface, &passes, progress, |_| Ok(true))?;
    Ok(if is_sound(&polished.mesh)? { polished.mesh } else { relaxed })
}

/// The surface remeshed by local operations and polished, with the features of these options; `None` if that
/// does not reach the number of vertices, if more faces intersect than before, or if the work is to finish
/// early. Where a try leaves a vertex of the surface out, the next one keeps it as a corner.
pub(super) fn remesh_locally(
    surface: &TriMesh,
    lengths: &[f64],
    (options, target): (&FeatureOptions, &ComponentTarget),
    progress: &ProgressToken,
) -> Result<Option<TriMesh>> {
    let before = topology(surface);
    // Only simplification comes near such a number, or takes no minutes.
    if progress.leave_out() || before.is_much_for(target.vertices) {
        return Ok(None);
    }
    let Ok(features) = find_features(surface, options) else { return Ok(None) };
    let on = Target::new(surface).in_patches(features.patches.clone());
    let before = Before::new(surface, before);
    let closer = Closer { before: &before, features: &features, lengths, on: &on, target };
    if target.closely {
        let made = closer.made(false, progress)?;
        return made.map(|made| mend_component(made, &before.topology, &on, target, progress)).transpose();
    }
    let wanted = EdgeLengths { lengths, maps: &[] };
    let mut start = LocalSurface::new((surface, &on), &features, (wanted, target.vertices), progress)?;
    let mut best: Option<(f64, ConstrainedMesh)> = None;
    let handles = before.topology.euler.unsigned_abs() as usize / 2;
    let has_handles = before.topology.euler < 0;
    let has_many_handles = has_handles && target.vertices <= VERTICES_PER_HANDLE * handles;
    // A try without a guard mostly fails where many cells between handles were broken, and counts as refused.
    let would_probably_fail = has_handles && target.has_broken_cells && !has_many_handles;
    let mut guarded = has_many_handles || would_probably_fail;
    let mut refused = would_probably_fail.then_some((TRIES[0], false));
    for longest in TRIES {
        // That would be the same once more.
        if refused == Some((longest, guarded)) {
            continue;
        }
        if progress.leave_out() {
            break;
        }
        let local = well_shaped(&start, (longest, guarded), target, progress)?;
        if local.mesh.vertices.len() != target.vertices {
            break;
        }
        let Some(local) = polish_component(local, &before, &on, target, progress)? else {
            refused = Some((longest, guarded));
            guarded = true;
            continue;
        };
        let left_out = left_out(surface, &local.mesh, lengths, target.spacing, progress)?;
        let farthest = left_out.first().map_or(0.0, |(distance, _)| *distance);
        let may_be_enough = best.is_some() || refused.is_some() || surface.triangles.len() > MANY_FACES;
        if best.as_ref().is_none_or(|(least, _)| farthest < *least) {
            best = Some((farthest, local));
        }
        if left_out.is_empty() || (may_be_enough && farthest <= MISSING) {
            break;
        }
        start.fix(spread_out(surface, &left_out, target.spacing));
    }
    let Some((_, mut local)) = best else { return Ok(None) };
    if let Some(closer) = closer.than(&local.mesh, guarded, progress)? {
        local = closer;
    }
    mend_component(local, &before.topology, &on, target, progress).map(Some)
}

/// What a mesh made of a surface is compared with.
pub(super) struct Before<'a> {
    pub surface: &'a TriMesh,
    pub topology: Topology,
    /// Faces of the surface that intersect others, found when they are first asked for: mostly a mesh has
    /// none. `None` if there are none.
    intersecting: OnceCell<Option<Bvh>>,
}

impl<'a> Before<'a> {
    fn new(surface: &'a TriMesh, topology: Topology) -> Self {
        Self { surface, topology, intersecting: OnceCell::new() }
    }

    /// The faces of a mesh that intersect others where those of the surface do not. The finer a mesh is, the
    /// more of its faces run through others where the surface does.
    fn new_crossings(&self, mesh: &TriMesh, target: &ComponentTarget) -> Result<Vec<u32>> {
        let mut crossing = intersecting_in_units(mesh, target.frame, target.progress)?;
        if crossing.is_empty() {
            return Ok(crossing);
        }
        if self.intersecting.get().is_none() {
            let faces = intersecting_in_units(self.surface, target.frame, target.progress)?;
            let tree = (!faces.is_empty()).then(|| Bvh::new(&extract(self.surface, &faces)));
            // Another call cannot have come between.
            self.intersecting.get_or_init(|| tree);
        }
        if let Some(Some(tree)) = self.intersecting.get() {
            crossing.retain(|t| {
                let middle = mesh.corners(*t as usize).into_iter().sum::<DVec3>() / 3.0;
                tree.closest(middle).is_none_or(|found| found.distance_sq > target.spacing.powi(2))
            });
        }
        Ok(crossing)
    }
}

/// The surface remeshed by local operations. If that makes a small angle, and there are few vertices, it is
/// made gradually as well, and the better one is taken.
fn well_shaped(
    start: &LocalSurface,
    (longest, guarded): (f64, bool),
    target: &ComponentTarget,
    progress: &ProgressToken,
) -> Result<ConstrainedMesh> {
    let make = |gradual| start.remeshed(&LocalOptions { longest, guarded, gradual }, progress);
    let smallest = |made: &ConstrainedMesh| quality(&made.mesh).map_or(0.0, |quality| quality.min_angle);
    let plain = make(false)?;
    if target.vertices > MOST_GRADUAL || smallest(&plain) >= POOR || progress.leave_out() {
        return Ok(plain);
    }
    let gradual = make(true)?;
    let is_better = gradual.mesh.vertices.len() == target.vertices
        && (plain.mesh.vertices.len() != target.vertices || smallest(&gradual) > smallest(&plain));
    Ok(if is_better { gradual } else { plain })
}

/// The vertices of the surface that the mesh leaves out, with their distances in edge lengths, the farthest
/// first.
pub(super) fn left_out(
    surface: &TriMesh,
    mesh: &TriMesh,
    lengths: &[f64],
    spacing: f64,
    progress: &ProgressToken,
) -> Result<Vec<(f64, u32)>> {
    progress.poll()?;
    let bvh = Bvh::new(mesh);
    let far = |v: u32| {
        let edge = spacing * lengths.get(v as usize).copied().unwrap_or(1.0);
        let nearest = bvh.closest(surface.vertices[v as usize])?;
        let distance = nearest.distance_sq.sqrt() / edge;
        (distance > LEFT_OUT).then_some((distance, v))
    };
    let mut far: Vec<(f64, u32)> =
        (0..surface.vertices.len() as u32).into_par_iter().filter_map(far).collect();
    far.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    Ok(far)
}

/// Of these vertices, the farthest ones that are not close together.
fn spread_out(surface: &TriMesh, far: &[(f64, u32)], spacing: f64) -> Vec<DVec3> {
    let mut list: Vec<DVec3> = Vec::new();
    for p in far.iter().map(|(_, v)| surface.vertices[*v as usize]) {
        if list.iter().all(|q| p.distance(*q) > MISSING * spacing) {
            list.push(p);
        }
    }
    list
}

/// A mesh made by local operations, polished as far as its faces do not intersect more than the surface's:
/// where they would, vertices stay. `None` if they do so from the beginning.
pub(super) fn polish_component(
    local: ConstrainedMesh,
    before: &Before,
    on: &Target,
    target: &ComponentTarget,
    progress: &ProgressToken,
) -> Result<Option<ConstrainedMesh>> {
    let mut fixed = local.fixed.clone();
    // The faces that intersect where none did, if there are any or the topology is another.
    let crossing_in = |mesh: &TriMesh| -> Result<Option<Vec<u32>>> {
        let crossing = before.new_crossings(mesh, target)?;
        let is_sound = crossing.is_empty() && topology(mesh).matches(&before.topology);
        Ok((!is_sound).then_some(crossing))
    };
    // After the last of the steps that leaves it sound.
    let mut best = crossing_in(&local.mesh)?.is_none().then(|| local.clone());
    let mut keeps_chords = false;
    for _ in 0..POLISHES {
        if best.is_some() && progress.leave_out() {
            break;
        }
        let mut polishing = ConstrainedMesh { fixed: fixed.clone(), ..local.clone() };
        let passes = target.passes(target.polish_rounds + MORE_ROUNDS, keeps_chords);
        let mut crossing = None;
        let rejected = improve(&mut polishing, on, &passes, progress, |mesh| {
            crossing = crossing_in(&mesh.mesh)?;
            if crossing.is_none() {
                best = Some(mesh.clone());
            }
            Ok(crossing.is_none())
        })?;
        // Without fewer outliers it is good enough.
        if matches!(rejected, None | Some(Pass::Outliers)) {
            break;
        }
        fix_around(&mut fixed, &polishing.mesh, &crossing.unwrap_or_default());
        keeps_chords = true;
    }
    Ok(best.map(|best| ConstrainedMesh { fixed: local.fixed, ..best }))
}

/// The mesh with its small angles mended, then smoothed: each unless more faces then intersect.
fn mend_component(
    mut local: ConstrainedMesh,
    surface: &Topology,
    on: &Target,
    target: &ComponentTarget,
    progress: &ProgressToken,
) -> Result<TriMesh> {
    let count = |mesh: &TriMesh| Ok(intersecting_in_units(mesh, target.frame, progress)?.len());
    let mut intersecting = None;
    let mut is_worse = |mesh: &TriMesh, before: &TriMesh| -> Result<bool> {
        let most = match intersecting {
            Some(most) => most,
            None => count(before)?,
        };
        let found = count(mesh)?;
        let is_worse = found > most || !topology(mesh).matches(surface);
        intersecting = Some(if is_worse { most } else { found });
        Ok(is_worse)
    };
    let before = local.clone();
    let options = MendOptions { min_angle: target.min_angle, spacing: target.spacing, deviation: None };
    let mended = mend_angles(&mut local, on, &options, progress)?;
    if mended.edits > 0 && is_worse(&local.mesh, &before.mesh)? {
        local = before;
    }
    if !target.smooths || !is_to_be_smoothed(&local) {
        return Ok(local.mesh);
    }
    let before = local.mesh.clone();
    let has_moved = smooth(&mut local, on, progress)?;
    Ok(if has_moved && is_worse(&local.mesh, &before)? { before } else { local.mesh })
}

/// Fixes the vertices of these faces and [`RINGS`] rings around them.
fn fix_around(fixed: &mut [bool], mesh: &TriMesh, faces: &[u32]) {
    let mut near = vec![false; fixed.len()];
    faces.iter().flat_map(|t| mesh.triangles[*t as usize]).for_each(|v| near[v as usize] = true);
    for _ in 0..RINGS {
        let touched: Vec<u32> = (mesh.triangles.iter().filter(|t| t.iter().any(|v| near[*v as usize])))
            .flatten()
            .copied()
            .collect();
        touched.into_iter().for_each(|v| near[v as usize] = true);
    }
    fixed.iter_mut().zip(near).for_each(|(fixed, near)| *fixed |= near);
}

/// The least number of vertices that a component can have.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn least_vertices(surface: &TriMesh, target: &ComponentTarget) -> Result<usize> {
    simplify_component(surface, &target.with_vertices(0)).map(|least| least.mesh.vertices.len())
}

/// The component simplified, without the polish.
///
/// # Errors
/// [`crate::Error::Cancelled`].
fn simplify_component(surface: &TriMesh, target: &ComponentTarget) -> Result<Simplified> {
    let simplify = |preserved: Preserved| with_vertices(surface, preserved, target.vertices, target.progress);
    // A number that the topology does not allow is not reached with curves, either.
    if target.vertices >= topology(surface).vertices_needed()
        && let Ok(features) = find_features(surface, &target.features())
        && features.corners.len() <= target.vertices
    {
        let curves = curve_half_edges(surface, &features);
        let with_curves =
            simplify(Preserved { curves: &curves, corners: &features.corners, ..Default::default() })?;
        if with_curves.mesh.vertices.len() <= target.vertices {
            return Ok(with_curves);
        }
    }
    // The number of vertices comes before sharp edges, but not before the topology.
    simplify(Preserved { may_intersect: target.may_intersect, ..Default::default() })
}

/// For each half-edge whether it is on a curve.
pub(crate) fn curve_half_edges(surface: &TriMesh, features: &Features) -> Vec<bool> {
    let ends = features.curves.iter().flat_map(Curve::edge_ends);
    let mut edges: Vec<(u32, u32)> = ends.map(|[a, b]| edge_key(a, b)).collect();
    edges.sort_unstable();
    let corners = surface.triangles.as_flattened();
    let key = |h: u32| edge_key(corners[h as usize], corners[next(h) as usize]);
    (0..corners.len() as u32).map(|h| edges.binary_search(&key(h)).is_ok()).collect()
}
