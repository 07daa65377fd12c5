//! Vertices inserted where the mesh is too far from the surface: edges are split there, and the mesh around
//! them is polished, fitted and mended again.

mod split;

use super::mend::after_both;
use super::shared::CoarseToFine;
use crate::local::{MendOptions, mend_angles};
use crate::pipeline::deviation::measured::{Depth, Farthest, Measured, Reference};
use crate::polish::{ConstrainedMesh, OutlierOptions, PassOptions, PolishOptions, improve};
use crate::{ProgressToken, Result};
use split::{Split, WAYS, faces_near, free_vertices, origins_after, splits_at};

/// Maximum number of passes; each splits an edge at every place that is too far away.
const PASSES: u32 = 10;
/// Maximum number of tries in all passes.
const TRIES: u32 = 24;
/// Rounds of polish after a split.
const ROUNDS: u32 = 5;
/// If more faces than this, plus one for every [`VERTICES_PER_FACE`] vertices, are too far away, edges are to
/// be shorter instead.
const FEW: usize = 50;
/// Vertices for each face that may be too far away, in addition to [`FEW`].
const VERTICES_PER_FACE: usize = 8;
/// Samples must be within this share of the largest deviation, since they may miss the farthest point.
const SAMPLED: f64 = 0.97;

/// A mesh with what was measured of it.
struct Candidate {
    local: ConstrainedMesh,
    found: Measured,
    excess: f64,
    /// The former index of each vertex, [`crate::mesh::NONE`] for new ones; empty if nothing has changed.
    origins: Vec<u32>,
}

/// What all passes share.
struct Insertion<'a> {
    run: &'a CoarseToFine<'a>,
    reference: Reference<'a>,
    /// Edge lengths at the surface's vertices.
    lengths: Vec<f64>,
    level_spacing: f64,
    progress: &'a ProgressToken,
}

impl CoarseToFine<'_> {
    /// Inserts vertices where the mesh is too far from the surface, if that is asked for. Returns the former
    /// index of each vertex, [`crate::mesh::NONE`] for new ones; nothing if nothing has changed.
    pub(super) fn insert(
        &self,
        local: &mut ConstrainedMesh,
        level_spacing: f64,
        progress: &ProgressToken,
    ) -> Result<Vec<u32>> {
        let Some(most) = self.context.deviation else { return Ok(Vec::new()) };
        let surface = self.context.surface.mesh();
        let length = |v: u32| level_spacing * self.model.sizes.at_vertex(v);
        let lengths = (0..surface.vertices.len() as u32).map(length).collect();
        let reference = Reference { surface: &surface, bvh: self.model.target.bvh(), most };
        let insertion = Insertion { run: self, reference, lengths, level_spacing, progress };
        let mut now = insertion.measured(local.clone(), Vec::new())?;
        let mut tries = TRIES;
        for _ in 0..PASSES {
            match insertion.pass(&now, local.mesh.vertices.len(), &mut tries)? {
                Some(closer) => now = closer,
                None => break,
            }
        }
        *local = now.local;
        Ok(now.origins)
    }
}

impl Insertion<'_> {
    /// The largest distance of samples.
    fn most(&self) -> f64 {
        SAMPLED * self.reference.most
    }

    fn measured(&self, local: ConstrainedMesh, origins: Vec<u32>) -> Result<Candidate> {
        let found = self.reference.measured(&local.mesh, &self.lengths, Depth::Coarse, self.progress)?;
        let excess = found.of_face.iter().map(|farthest| self.excess(farthest)).sum();
        Ok(Candidate { local, found, excess, origins })
    }

    /// The squared excess of a squared distance over the largest one allowed, relative to that.
    fn excess(&self, farthest: &Farthest) -> f64 {
        ((farthest.distance / self.most()).powi(2) - 1.0).max(0.0).powi(2)
    }

    /// The faces that are too far away, the farthest first.
    fn far_faces(&self, found: &Measured) -> Vec<(u32, Farthest)> {
        let all = (0..).zip(found.of_face.iter().copied());
        let mut far: Vec<(u32, Farthest)> =
            all.filter(|(_, farthest)| farthest.distance > self.most()).collect();
        far.sort_by(|p, q| q.1.distance.total_cmp(&p.1.distance).then(p.0.cmp(&q.0)));
        far
    }

    /// A closer mesh, if there is one and it need be; `vertices` are those before the first pass, and `tries`
    /// those that are left.
    fn pass(&self, before: &Candidate, vertices: usize, tries: &mut u32) -> Result<Option<Candidate>> {
        let mesh = &before.local.mesh;
        let mut far = self.far_faces(&before.found);
        if far.len() > FEW + vertices / VERTICES_PER_FACE || self.progress.leave_out() {
            return Ok(None);
        }
        if far.is_empty() {
            let closely = self.reference.measured(mesh, &self.lengths, Depth::Fine, self.progress)?;
            far = self.far_faces(&closely);
        }
        if far.is_empty() {
            let largest = self.reference.largest(mesh, self.progress)?;
            if largest.upper <= self.reference.most {
                return Ok(None);
            }
            far.push((largest.face, Farthest { distance: largest.upper, at: largest.at }));
        }
        let mut splits = splits_at(mesh, &far);
        // Those for which no way is left are done without.
        for _ in 0..=WAYS.len() {
            splits.retain(|split| !split.ways.is_empty());
            if splits.is_empty() || *tries == 0 {
                break;
            }
            *tries -= 1;
            let (after, new) = self.split(before, &splits)?;
            if after.excess < before.excess || after.excess == 0.0 {
                return Ok(Some(after));
            }
            if !self.drop_harmful(&mut splits, &new, [before, &after]) {
                break;
            }
        }
        Ok(None)
    }

    /// The mesh with edges split, and the new vertex of each split, if it is still there.
    fn split(&self, before: &Candidate, splits: &[Split]) -> Result<(Candidate, Vec<Option<u32>>)> {
        let edges: Vec<[u32; 2]> = splits.iter().map(|split| split.way().edge).collect();
        let mut local = before.local.clone();
        local.split_edges(&edges);
        let mut origins = origins_after(&before.local.mesh, edges.len());
        let first = (origins.len() - edges.len()) as u32;
        let mut new: Vec<Option<u32>> = (first..).take(edges.len()).map(Some).collect();
        let is_free = free_vertices(&local.mesh, first, splits);
        let fixed = local.fixed.iter().zip(is_free).map(|(fixed, free)| *fixed || !free).collect();
        let mended = self.improve(&mut local, fixed)?;
        if !mended.is_empty() {
            let place = |v: u32| mended.iter().position(|origin| *origin == v).map(|v| v as u32);
            new.iter_mut().for_each(|v| *v = v.and_then(place));
            origins = after_both(&origins, mended);
        }
        Ok((self.measured(local, after_both(&before.origins, origins))?, new))
    }

    /// Takes from each split the way that did harm; whether any did.
    fn drop_harmful(
        &self,
        splits: &mut [Split],
        new: &[Option<u32>],
        [before, after]: [&Candidate; 2],
    ) -> bool {
        let excess = |of: &Candidate, around: &[u32], rings: u32| -> f64 {
            let faces = faces_near(&of.local.mesh, around, rings);
            faces.iter().map(|t| self.excess(&of.found.of_face[*t as usize])).sum()
        };
        let mut harmful = false;
        for (split, new) in splits.iter_mut().zip(new) {
            let way = split.way();
            let was = excess(before, &way.edge, way.rings + 1);
            if new.is_none_or(|v| excess(after, &[v], way.rings + 1) > was) {
                split.ways.pop();
                harmful = true;
            }
        }
        harmful
    }

    /// Polishes, fits and mends a mesh again, except for what is `fixed`; returns where its vertices come
    /// from if mending changed these.
    fn improve(&self, local: &mut ConstrainedMesh, fixed: Vec<bool>) -> Result<Vec<u32>> {
        let progress = &self.progress.silent();
        let target = &self.run.model.target;
        let method = &self.run.context.options.coarse_to_fine;
        let own = std::mem::replace(&mut local.fixed, fixed);
        let passes = PassOptions {
            polish: PolishOptions { rounds: ROUNDS, slides: false, ..Default::default() },
            fit: method.fit,
            outliers: Some(OutlierOptions { tolerance: self.most(), ..Default::default() }),
            edge: self.level_spacing,
        };
        improve(local, target, &passes, progress, |_| Ok(true))?;
        local.fixed = own;
        let (min_angle, deviation) = (method.min_angle, Some(self.most()));
        let options = MendOptions { min_angle, spacing: self.level_spacing, deviation };
        Ok(mend_angles(local, target, &options, progress)?.origins)
    }
}
