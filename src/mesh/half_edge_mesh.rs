//! Half-edge mesh that supports edge flips.

use super::NONE;
use super::chunks::CHUNK;
use super::half_edges::{next, par_fold_corners, previous, twins};
use rayon::prelude::*;

/// How the triangles around a vertex are arranged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VertexKind {
    /// Its triangles form one closed fan.
    Inner,
    /// Its triangles form one open fan.
    Boundary,
    /// No triangle uses it, or its triangles form something else.
    Irregular,
}

/// The half-edges of a mesh with their twins, kept up to date by flips.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct HalfEdgeMesh {
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The half-edge that runs against each; [`NONE`] where there is not exactly one.
    twin: Vec<u32>,
    /// A half-edge that leaves each vertex; at a boundary the one from which [`HalfEdgeMesh::ring`] reaches
    /// all others.
    first: Vec<u32>,
    kind: Vec<VertexKind>,
    /// Edges at each vertex; meaningless at irregular ones.
    valence: Vec<u32>,
    /// The patch of each triangle; empty if there is but one.
    patches: Vec<u32>,
}

/// A flip that can be undone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flip {
    half_edge: u32,
    /// The vertices around the edge before it, as of [`HalfEdgeMesh::diamond`].
    pub vertices: [u32; 4],
    /// Where their rings began.
    first: [u32; 4],
}

impl HalfEdgeMesh {
    /// Of `triangles` over `vertices` vertices; `patches` has the patch of each triangle, or nothing. Panics
    /// if an index is out of range.
    pub(crate) fn new(triangles: Vec<[u32; 3]>, vertices: usize, patches: &[u32]) -> Self {
        let mut twin = twins(&triangles);
        // Two half-edges of one triangle, which then repeats a vertex, are not an edge between two.
        twin.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(h, twin)| {
            if *twin != NONE && *twin as usize / 3 == h / 3 {
                *twin = NONE;
            }
        });
        let mut mesh = Self {
            triangles,
            twin,
            first: vec![NONE; vertices],
            kind: vec![VertexKind::Irregular; vertices],
            valence: vec![0; vertices],
            patches: patches.to_vec(),
        };
        mesh.classify();
        mesh
    }

    /// Gets the triangles back that were taken out, and begins rings where those of a new mesh begin. Panics
    /// if there are more or fewer.
    #[must_use]
    pub(crate) fn with_triangles(mut self, triangles: Vec<[u32; 3]>) -> Self {
        assert_eq!(self.twin.len(), 3 * triangles.len(), "these are the triangles of another mesh");
        self.triangles = triangles;
        self.begin_rings();
        self
    }

    /// Begins the ring of each vertex at its first half-edge, but at a boundary where its open fan begins.
    fn begin_rings(&mut self) {
        let Self { triangles, first, twin, .. } = self;
        first.fill(NONE);
        par_fold_corners(triangles.as_flattened(), first, |first, h| {
            if *first == NONE || twin[h as usize] == NONE {
                *first = h;
            }
        });
    }

    fn classify(&mut self) {
        self.begin_rings();
        // The half-edges that leave each vertex are counted where its valence will be.
        let Self { triangles, first, twin, kind, valence, .. } = self;
        par_fold_corners(triangles.as_flattened(), valence, |leaving, _| *leaving += 1);
        let vertices = first.par_iter().zip(kind).zip(valence).with_min_len(CHUNK);
        vertices.for_each(|((&first, kind), valence)| {
            let leaving = std::mem::take(valence);
            if first == NONE {
                return;
            }
            let (mut h, mut reached) = (first, 0);
            while reached < leaving {
                reached += 1;
                h = twin[previous(h) as usize];
                if h == NONE || h == first {
                    break;
                }
            }
            if reached < leaving || (h != NONE && h != first) {
                return;
            }
            *kind = if h == NONE { VertexKind::Boundary } else { VertexKind::Inner };
            *valence = leaving + u32::from(h == NONE);
        });
    }

    /// The patch of a triangle, the same before and after flips.
    pub(crate) fn patch(&self, t: u32) -> u32 {
        self.patches.get(t as usize).copied().unwrap_or(0)
    }

    /// The patch of a vertex, if it has triangles; of one on a curve, any of its patches.
    pub(crate) fn patch_at(&self, v: u32) -> u32 {
        let first = self.first[v as usize];
        if first == NONE { 0 } else { self.patch(first / 3) }
    }

    pub(crate) fn kind(&self, v: u32) -> VertexKind {
        self.kind[v as usize]
    }

    /// The number of edges at a vertex that is not irregular.
    pub(crate) fn valence(&self, v: u32) -> u32 {
        self.valence[v as usize]
    }

    pub(crate) fn half_edge_count(&self) -> u32 {
        self.twin.len() as u32
    }

    #[inline]
    pub(crate) fn twin(&self, h: u32) -> Option<u32> {
        let twin = self.twin[h as usize];
        (twin != NONE).then_some(twin)
    }

    /// The vertex that half-edge `h` leaves.
    #[inline]
    pub(crate) fn origin(&self, h: u32) -> u32 {
        self.triangles.as_flattened()[h as usize]
    }

    /// The half-edges that leave a vertex, counter-clockwise; none of an irregular one.
    #[inline]
    pub(crate) fn ring(&self, v: u32) -> Ring<'_> {
        let first = if self.kind(v) == VertexKind::Irregular { NONE } else { self.first[v as usize] };
        Ring { mesh: self, first, at: first }
    }

    /// Whether an edge joins `a`, which is not irregular, with `b`.
    pub(crate) fn joined(&self, a: u32, b: u32) -> bool {
        self.ring(a).any(|h| self.origin(next(h)) == b || self.origin(previous(h)) == b)
    }

    /// The vertices of the two triangles at half-edge `h` and its `twin`: `[a, b, c, d]` for triangles `abc`
    /// and `bad`.
    pub(crate) fn diamond(&self, h: u32, twin: u32) -> [u32; 4] {
        [self.origin(h), self.origin(twin), self.origin(previous(h)), self.origin(previous(twin))]
    }

    /// The half-edge that runs against each, [`NONE`] where there is not exactly one.
    pub(crate) fn twins(&self) -> &[u32] {
        &self.twin
    }

    /// Where the ring of each vertex begins, [`NONE`] for irregular ones.
    pub(crate) fn firsts(&self) -> Vec<u32> {
        let first = |(first, kind): (&u32, &VertexKind)| {
            if *kind == VertexKind::Irregular { NONE } else { *first }
        };
        self.first.par_iter().zip(&self.kind).with_min_len(CHUNK).map(first).collect()
    }

    /// Takes over what flips elsewhere have made of the same mesh: triangles, twins, where rings begin, and
    /// valences. Irregular vertices keep theirs.
    pub(crate) fn replace(
        &mut self,
        triangles: Vec<[u32; 3]>,
        twin: Vec<u32>,
        first: &[u32],
        valence: Vec<u32>,
    ) {
        self.first.par_iter_mut().zip(first).with_min_len(CHUNK).for_each(|(own, new)| {
            *own = if *new == NONE { *own } else { *new };
        });
        (self.triangles, self.twin, self.valence) = (triangles, twin, valence);
    }

    /// Replaces edge a–b of triangles `abc` and `bad` by c–d. The caller sees to it that no edge joins c and
    /// d yet and that a and b keep enough edges.
    pub(crate) fn flip(&mut self, h: u32, g: u32) -> Flip {
        let vertices @ [a, b, c, d] = self.diamond(h, g);
        let flip = Flip { half_edge: h, vertices, first: vertices.map(|v| self.first[v as usize]) };
        let (h_next, h_previous, g_next, g_previous) = (next(h), previous(h), next(g), previous(g));
        let [bc, ca, ad, db] = [h_next, h_previous, g_next, g_previous].map(|s| self.twin[s as usize]);
        let corners = self.triangles.as_flattened_mut();
        // Triangle d c a in place of a b c, and c d b in place of b a d.
        for (slot, v) in [(h, d), (h_next, c), (h_previous, a), (g, c), (g_next, d), (g_previous, b)] {
            corners[slot as usize] = v;
        }
        for (slot, outer) in [(h_next, ca), (h_previous, ad), (g_next, db), (g_previous, bc)] {
            self.twin[slot as usize] = outer;
            if outer != NONE {
                self.twin[outer as usize] = slot;
            }
        }
        // The same directed edges under their new numbers; an open fan must begin where it did.
        let moved = [
            (c, h_previous, h_next),
            (a, g_next, h_previous),
            (d, g_previous, g_next),
            (b, h_next, g_previous),
        ];
        let first = moved.map(|(v, old, _)| self.first[v as usize] == old);
        for (&(v, _, new), was_first) in moved.iter().zip(first) {
            if was_first {
                self.first[v as usize] = new;
            }
        }
        // a–b itself is gone, and its two numbers now stand for d–c.
        if self.first[a as usize] == h {
            self.first[a as usize] = h_previous;
        }
        if self.first[b as usize] == g {
            self.first[b as usize] = g_previous;
        }
        self.valence[a as usize] -= 1;
        self.valence[b as usize] -= 1;
        self.valence[c as usize] += 1;
        self.valence[d as usize] += 1;
        flip
    }

    /// Undoes the last flip without a trace: the triangles get their numbers back and rings begin where they
    /// did, so that whoever sums around a vertex afterwards rounds as if there had been no flip.
    pub(crate) fn undo(&mut self, flip: &Flip) {
        // One flip back would restore the edge, but swap the numbers of its triangles.
        for _ in 0..3 {
            let twin = self.twin[flip.half_edge as usize];
            self.flip(flip.half_edge, twin);
        }
        for (v, first) in flip.vertices.into_iter().zip(flip.first) {
            self.first[v as usize] = first;
        }
    }
}

/// The half-edges that leave a vertex.
pub(crate) struct Ring<'a> {
    mesh: &'a HalfEdgeMesh,
    first: u32,
    at: u32,
}

impl Iterator for Ring<'_> {
    type Item = u32;

    #[inline]
    fn next(&mut self) -> Option<u32> {
        let h = self.at;
        if h == NONE {
            return None;
        }
        let following = self.mesh.twin[previous(h) as usize];
        self.at = if following == self.first { NONE } else { following };
        Some(h)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn flips_that_are_undone_leave_no_trace() {
        for name in ["thin-plate", "open-hemisphere"] {
            let input = sample(name).unwrap_or_default();
            let before = HalfEdgeMesh::new(input.triangles, input.vertices.len(), &[]);
            let mut mesh = before.clone();
            let mut flips = 0;
            for h in 0..mesh.half_edge_count() {
                let Some(twin) = mesh.twin(h) else { continue };
                let flip = mesh.flip(h, twin);
                assert_ne!(mesh, before);
                mesh.undo(&flip);
                assert_eq!(mesh, before, "half-edge {h} of {name}");
                flips += 1;
            }
            assert!(flips > 1000, "{flips} flips of {name}");
        }
    }

    #[test]
    fn rings_begin_as_those_of_a_new_mesh() {
        for name in ["thin-plate", "open-hemisphere"] {
            let input = sample(name).unwrap_or_default();
            let count = input.vertices.len();
            let mut mesh = HalfEdgeMesh::new(input.triangles, count, &[]);
            for h in (0..mesh.half_edge_count()).step_by(7) {
                let Some(twin) = mesh.twin(h) else { continue };
                let [a, b, c, d] = mesh.diamond(h, twin);
                if !mesh.joined(c, d) && mesh.valence(a).min(mesh.valence(b)) > 4 {
                    mesh.flip(h, twin);
                }
            }
            let triangles = std::mem::take(&mut mesh.triangles);
            let new = HalfEdgeMesh::new(triangles.clone(), count, &[]);
            assert_ne!(mesh.first, new.first, "no flip of {name} changed where a ring begins");
            assert_eq!(mesh.with_triangles(triangles), new, "{name}");
        }
    }
}
