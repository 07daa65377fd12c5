//! Who is beside whom: the half-edges of a mesh with their twins, kept up to date by flips.

use super::NONE;
use glam::DVec3;
use rayon::prelude::*;

/// What may happen at a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VertexKind {
    /// Its triangles form one closed fan.
    Inner,
    /// Its triangles form one open fan.
    Boundary,
    /// No triangle uses it, or its triangles form something else.
    Irregular,
}

/// The half-edges of a mesh. Half-edge `3 * t + k` goes from corner `k` of triangle `t` to the next corner.
#[derive(Debug, Clone)]
pub(crate) struct HalfEdgeMesh {
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The half-edge on the other side; [`NONE`] where there is not exactly one, in the opposite direction.
    twin: Vec<u32>,
    /// A half-edge that leaves the vertex; at a boundary the one from which [`HalfEdgeMesh::ring`] reaches all.
    first: Vec<u32>,
    kind: Vec<VertexKind>,
    /// Edges at the vertex; right unless it is irregular.
    valence: Vec<u32>,
    /// The patch of each triangle; empty if there is but one.
    patches: Vec<u32>,
}

/// The half-edge after `h` in its triangle.
pub(crate) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The half-edge before `h` in its triangle.
pub(crate) fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

impl HalfEdgeMesh {
    /// HalfEdgeMesh `triangles` over `vertices` vertices; `patches` has the patch of each triangle, or nothing. Panics if an
    /// index is out of range.
    pub(crate) fn new(triangles: Vec<[u32; 3]>, vertices: usize, patches: &[u32]) -> Self {
        let twin = twins(&triangles);
        let mut links = Self {
            triangles,
            twin,
            first: vec![NONE; vertices],
            kind: vec![VertexKind::Irregular; vertices],
            valence: vec![0; vertices],
            patches: patches.to_vec(),
        };
        links.classify();
        links
    }

    fn classify(&mut self) {
        let mut leaving = vec![0u32; self.first.len()];
        for (h, &v) in (0u32..).zip(self.triangles.as_flattened()) {
            leaving[v as usize] += 1;
            // Any half-edge will do, but one without a twin must be where an open fan begins.
            if self.first[v as usize] == NONE || self.twin[h as usize] == NONE {
                self.first[v as usize] = h;
            }
        }
        for (v, &leaving) in leaving.iter().enumerate() {
            let first = self.first[v];
            if first == NONE {
                continue;
            }
            let (mut h, mut reached) = (first, 0);
            while reached < leaving {
                reached += 1;
                h = self.twin[previous(h) as usize];
                if h == NONE || h == first {
                    break;
                }
            }
            if reached < leaving || (h != NONE && h != first) {
                continue;
            }
            self.kind[v] = if h == NONE { VertexKind::Boundary } else { VertexKind::Inner };
            self.valence[v] = leaving + u32::from(h == NONE);
        }
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

    /// Edges at a vertex that is not irregular.
    pub(crate) fn valence(&self, v: u32) -> u32 {
        self.valence[v as usize]
    }

    pub(crate) fn half_edges(&self) -> u32 {
        self.twin.len() as u32
    }

    pub(crate) fn twin(&self, h: u32) -> Option<u32> {
        let twin = self.twin[h as usize];
        (twin != NONE).then_some(twin)
    }

    /// The vertex that half-edge `h` leaves.
    pub(crate) fn origin(&self, h: u32) -> u32 {
        self.triangles.as_flattened()[h as usize]
    }

    /// The half-edges that leave a vertex, counter-clockwise; none of an irregular one.
    pub(crate) fn ring(&self, v: u32) -> Ring<'_> {
        let first = if self.kind(v) == VertexKind::Irregular { NONE } else { self.first[v as usize] };
        Ring { links: self, first, at: first }
    }

    /// Whether an edge joins `a`, which is not irregular, with `b`.
    pub(crate) fn joined(&self, a: u32, b: u32) -> bool {
        self.ring(a).any(|h| self.origin(next(h)) == b || self.origin(previous(h)) == b)
    }

    /// The corners before and behind half-edge `h` and its twin: `[a, b, c, d]` for triangles `abc` and `bad`.
    pub(crate) fn diamond(&self, h: u32, twin: u32) -> [u32; 4] {
        [self.origin(h), self.origin(twin), self.origin(previous(h)), self.origin(previous(twin))]
    }

    /// Replaces edge a–b of triangles `abc` and `bad` by c–d. That c and d were not joined, and that a and b keep
    /// enough edges, is for the caller to see to.
    pub(crate) fn flip(&mut self, h: u32, g: u32) {
        let [a, b, c, d] = self.diamond(h, g);
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
    }
}

/// The half-edges that leave a vertex.
pub(crate) struct Ring<'a> {
    links: &'a HalfEdgeMesh,
    first: u32,
    at: u32,
}

impl Iterator for Ring<'_> {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        let h = self.at;
        if h == NONE {
            return None;
        }
        let following = self.links.twin[previous(h) as usize];
        self.at = if following == self.first { NONE } else { following };
        Some(h)
    }
}

fn twins(triangles: &[[u32; 3]]) -> Vec<u32> {
    let corners = triangles.as_flattened();
    let mut sides: Vec<(u64, u32)> = (0u32..)
        .zip(corners)
        .map(|(h, &from)| {
            let to = corners[next(h) as usize];
            (u64::from(from.min(to)) << 32 | u64::from(from.max(to)), h)
        })
        .collect();
    sides.par_sort_unstable();
    let mut twin = vec![NONE; corners.len()];
    for edge in sides.chunk_by(|x, y| x.0 == y.0) {
        let &[(_, h), (_, g)] = edge else { continue };
        let opposite = corners[h as usize] != corners[g as usize];
        // Two sides of one triangle, which then repeats a vertex, are not an edge between two.
        if opposite && h / 3 != g / 3 {
            twin[h as usize] = g;
            twin[g as usize] = h;
        }
    }
    twin
}

/// Twice the area of a triangle along its normal.
pub(crate) fn cross([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}
