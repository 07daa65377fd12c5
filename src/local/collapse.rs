//! Edge collapses that keep the topology, the curves and the shape.

use std::cmp::Reverse;

use glam::DVec3;

use super::ahead::Ahead;
use super::curve_edges::CurvePart;
use super::guard::Guard;
use super::star_mesh::{Place, Ring, Star, StarMesh};
use crate::mesh::polyline::Polyline;
use crate::mesh::triangle::{closest_on_triangle, corners_at, doubled_normal};
use crate::{ProgressToken, Result};

/// An edge between vertices inside patches becomes its midpoint if it is longer than this share of the target
/// length; of a shorter one, either end is as good.
const SHORT: f64 = 0.3;
/// Lengths, in target lengths, up to which edges collapse for an exact number of vertices, and how many of
/// the limits are tried for them.
const CAPS: [(f64, usize); 8] =
    [(0.3, 5), (0.5, 4), (0.7, 3), (0.9, 3), (1.2, 3), (1.6, 4), (f64::INFINITY, 5), (f64::INFINITY, 6)];
/// Edges up to this length may take a corner along where angles are mended, in target lengths.
const CORNERS: f64 = 0.05;
/// Edges between two looks at whether to go on.
const BETWEEN_POLLS: u32 = 256;

/// What a collapse must not do.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// The target edge length.
    length: f64,
    /// Least cosine between a triangle's normals before and after.
    cosine: f64,
    /// Least height of a triangle over its longest side, unless one around was lower before.
    height: f64,
    /// Longest edge that it may make, in target lengths, unless it was longer before.
    longest: f64,
    /// Largest distance of a vertex from the triangles that take its place, in target lengths.
    distance: f64,
    /// Largest distance of a curve from its edges, in target lengths.
    deviation: f64,
    /// Longest edge by which a corner may move, in target lengths; 0 if none may.
    corners: f64,
}

impl Limits {
    /// For edges that are too short.
    pub fn regular(length: f64) -> Self {
        Self {
            length,
            cosine: 0.7,
            height: 0.1,
            longest: 4.0 / 3.0,
            distance: 0.1,
            deviation: 0.1,
            corners: 0.0,
        }
    }

    /// For edges of details smaller than the target length.
    pub fn of_details(length: f64) -> Self {
        Self { cosine: 0.1, height: 0.02, longest: 1.6, distance: 0.4, deviation: 0.4, corners: 0.0, length }
    }

    /// For edges on curves that are closer together than they should be.
    pub fn on_curves(length: f64) -> Self {
        Self { longest: 2.0, ..Self::regular(length) }
    }

    /// Where angles are mended: `stray` is the largest distance of a curve from its edges, in target lengths.
    pub fn of_mending(length: f64, stray: f64) -> Self {
        Self {
            height: 0.02,
            longest: 2.0,
            deviation: stray,
            distance: stray.max(0.1),
            corners: CORNERS,
            ..Self::regular(length)
        }
    }

    /// Where samples of the surface tell what may go, within a tolerance: `loose` for an exact number.
    pub fn close(length: f64, tolerance: f64, loose: bool) -> Self {
        let (cosine, height, longest) = if loose { (0.0, 0.01, f64::INFINITY) } else { (0.3, 0.1, 1.6) };
        let deviation = tolerance / length;
        Self { length, cosine, height, longest, distance: f64::INFINITY, deviation, corners: 0.0 }
    }

    /// From strict to loose, for an exact number of vertices; the last ones keep the topology alone.
    fn series(length: f64) -> [Self; 6] {
        let limits = |cosine, height, longest, distance, deviation| Self {
            length,
            cosine,
            height,
            longest,
            distance,
            deviation,
            corners: 0.0,
        };
        [
            limits(0.7, 0.2, 1.6, 0.1, 0.1),
            limits(0.5, 0.1, 2.0, 0.2, 0.2),
            limits(0.3, 0.05, 3.0, 0.3, 0.3),
            limits(0.1, 0.02, 6.0, 0.5, 0.5),
            limits(0.0, 0.005, f64::INFINITY, 1.0, 1.0),
            limits(-1.0, 1e-6, f64::INFINITY, f64::INFINITY, f64::INFINITY),
        ]
    }
}

/// A collapse: which vertex goes, which one stays, and where that is then.
#[derive(Debug, Clone, Copy)]
struct Collapse {
    gone: u32,
    kept: u32,
    to: DVec3,
    /// On a curve, the shifts of the arc lengths of the vertex that goes and of the one that stays.
    shifts: Option<[f64; 2]>,
}

/// An edge by its relative length.
type Entry = Reverse<(u64, (u32, u32))>;

impl StarMesh {
    /// Collapses edges shorter than `shortest`, the shortest first.
    pub fn collapse_short(
        &mut self,
        shortest: f64,
        limits: &Limits,
        polylines: &[Polyline],
        progress: &ProgressToken,
    ) -> Result<()> {
        self.collapse_edges(shortest, 0, limits, polylines, progress)
    }

    /// Collapses the shortest edges until there are `count` vertices, or none may collapse.
    pub fn collapse_to(
        &mut self,
        count: usize,
        length: f64,
        polylines: &[Polyline],
        guard: Guard,
    ) -> Result<()> {
        let series = Limits::series(length);
        // The shorter an edge, the more shape may be lost for it.
        for (cap, levels) in CAPS {
            for limits in &series[..levels] {
                if self.used() <= count {
                    return Ok(());
                }
                guard.run(self, |mesh| {
                    mesh.collapse_edges(cap * length, count, limits, polylines, guard.progress)
                })?;
            }
            guard.run(self, |mesh| mesh.flip(guard.progress))?;
        }
        Ok(())
    }

    /// Collapses edges shorter than `shortest` until there are `count` vertices, the shortest first.
    pub fn collapse_edges(
        &mut self,
        shortest: f64,
        count: usize,
        limits: &Limits,
        polylines: &[Polyline],
        progress: &ProgressToken,
    ) -> Result<()> {
        let entry = |mesh: &Self, a: u32, b: u32| -> Option<Entry> {
            let length = mesh.relative_length(a, b);
            (length < shortest).then(|| Reverse((length.to_bits(), (a.min(b), a.max(b)))))
        };
        let find = |mesh: &Self, Reverse((bits, (a, b))): &Entry| {
            // An end may have moved or gone since.
            if !mesh.has_edge(*a, *b) || mesh.relative_length(*a, *b).to_bits() != *bits {
                return None;
            }
            let collapse = mesh.shaped_collapse(*a, *b, limits, polylines)?;
            mesh.collapse_stays_close(&collapse).then_some(collapse)
        };
        let mut edges = self.queue(entry);
        let mut ahead = Ahead::new(self);
        let mut polls = 0;
        while self.used() > count {
            let known = ahead.next(edges.first(), |entry| find(self, entry));
            let left = edges.first().len();
            let Some(next @ Reverse((_, (a, b)))) = edges.pop() else { return Ok(()) };
            polls += 1;
            if polls % BETWEEN_POLLS == 0 {
                progress.poll()?;
            }
            let is_ahead = edges.first().len() < left && !ahead.has_changed([a, b]);
            let collapse = known.filter(|_| is_ahead).unwrap_or_else(|| find(self, &next));
            let Some(collapse) = collapse.filter(|collapse| self.collapse_keeps_apart(collapse)) else {
                continue;
            };
            self.apply(&collapse);
            let kept = collapse.kept;
            let around = self.neighbours(kept);
            ahead.note(&around);
            ahead.note(&[a, b]);
            for w in around {
                entry(self, kept, w).into_iter().for_each(|entry| edges.push(entry));
            }
        }
        Ok(())
    }

    /// Collapses an edge if the limits allow it; returns the vertex that is left.
    pub fn collapse_edge(&mut self, a: u32, b: u32, limits: &Limits, polylines: &[Polyline]) -> Option<u32> {
        let collapse = self.shaped_collapse(a, b, limits, polylines)?;
        if !self.collapse_keeps_apart(&collapse) || !self.collapse_stays_close(&collapse) {
            return None;
        }
        self.apply(&collapse);
        Some(collapse.kept)
    }

    /// How an edge collapses, as far as the triangles around it tell: shape is what most collapses are
    /// refused for.
    fn shaped_collapse(&self, a: u32, b: u32, limits: &Limits, polylines: &[Polyline]) -> Option<Collapse> {
        let collapse = self.collapse(a, b, limits, polylines)?;
        let keeps = self.keeps_shape(&collapse, limits) && self.keeps_topology(collapse.gone, collapse.kept);
        keeps.then_some(collapse)
    }

    /// How an edge collapses; `None` if that would pull a vertex off its curve or corner, or if it is frozen.
    fn collapse(&self, a: u32, b: u32, limits: &Limits, polylines: &[Polyline]) -> Option<Collapse> {
        if self.is_frozen(a) || self.is_frozen(b) {
            return None;
        }
        let [at, bt] = [a, b].map(|v| self.places[v as usize]);
        let (gone, kept) = if at <= bt { (a, b) } else { (b, a) };
        let [p, q] = [gone, kept].map(|v| self.points[v as usize]);
        match (self.places[gone as usize], self.places[kept as usize]) {
            (Place::Inside, Place::Inside) => {
                let is_short = match self.map_at([a, b]) {
                    Some(map) => (map * (q - p)).length() < SHORT * limits.length,
                    None => p.distance(q) < SHORT * limits.length * self.size(a, b),
                };
                let to = if is_short { q } else { 0.5 * (p + q) };
                Some(Collapse { gone, kept, to, shifts: None })
            }
            (Place::Inside, _) => Some(Collapse { gone, kept, to: q, shifts: None }),
            (Place::Curve, Place::Curve) => {
                let CurvePart { curve, from, to } = self.curves.get(gone, kept)?;
                let middle = 0.5 * (from + to);
                let collapse = Collapse {
                    gone,
                    kept,
                    to: polylines[curve as usize].at(middle).0,
                    shifts: Some([middle - from, middle - to]),
                };
                self.keeps_curve(&collapse, limits, polylines).then_some(collapse)
            }
            (Place::Curve, Place::Corner) => {
                let CurvePart { from, to, .. } = self.curves.get(gone, kept)?;
                let collapse = Collapse { gone, kept, to: q, shifts: Some([to - from, 0.0]) };
                if self.keeps_curve(&collapse, limits, polylines) {
                    return Some(collapse);
                }
                // Perhaps the corner may move instead.
                self.corner_moves(kept, gone, limits)
            }
            (Place::Corner, Place::Corner) => {
                self.corner_moves(gone, kept, limits).or_else(|| self.corner_moves(kept, gone, limits))
            }
            _ => None,
        }
    }

    /// The collapse by which a corner moves along a curve to the next vertex, if the limits let corners move:
    /// on a boundary with two edges if that cuts off little, elsewhere if it is near.
    fn corner_moves(&self, gone: u32, kept: u32, limits: &Limits) -> Option<Collapse> {
        if limits.corners == 0.0 {
            return None;
        }
        self.curves.get(gone, kept)?;
        let length = limits.length * self.size(gone, kept);
        let [p, q] = [gone, kept].map(|v| self.points[v as usize]);
        let mut others =
            self.neighbours(gone).into_iter().filter(|w| *w != kept && self.curves.contains(gone, *w));
        let is_near = match (others.next(), others.next()) {
            (Some(w), None) if self.at_edge_in_any_order(gone, kept).count() == 1 => {
                let r = self.points[w as usize];
                let share = (p - q).dot(r - q) / (r - q).length_squared().max(f64::MIN_POSITIVE);
                p.distance(q.lerp(r, share.clamp(0.0, 1.0))) <= limits.deviation * length
            }
            _ => p.distance(q) <= limits.corners * length,
        };
        is_near.then_some(Collapse { gone, kept, to: q, shifts: Some([0.0; 2]) })
    }

    /// The parts of curves that the edges at a vertex on a curve stand for after a collapse, without the
    /// edge that collapses: each with the vertex at its other end.
    fn parts_after(&self, v: u32, other: u32, shift: f64) -> Vec<(u32, CurvePart)> {
        let parts = self.neighbours(v).into_iter().filter(|w| *w != other);
        parts
            .filter_map(|w| Some((w, self.curves.get(v, w)?)))
            .map(|(w, part)| (w, CurvePart { from: part.from + shift, ..part }))
            .collect()
    }

    /// Whether the curve stays close to its edges.
    fn keeps_curve(&self, collapse: &Collapse, limits: &Limits, polylines: &[Polyline]) -> bool {
        let Collapse { gone, kept, shifts: Some([shift, kept_shift]), .. } = *collapse else { return true };
        let limit = limits.deviation * limits.length * self.size(gone, kept);
        let mut parts = self.parts_after(gone, kept, shift);
        if self.places[kept as usize] == Place::Curve {
            parts.extend(self.parts_after(kept, gone, kept_shift));
        }
        parts.iter().all(|(_, part)| part.deviation(polylines) <= limit)
    }

    /// The link condition: what the two vertices have in common is what lies at their edge.
    fn keeps_topology(&self, gone: u32, kept: u32) -> bool {
        let theirs = self.neighbours(kept);
        let mut apexes: Ring = self
            .at_edge_in_any_order(gone, kept)
            .flat_map(|t| self.triangles[t as usize])
            .filter(|w| *w != gone && *w != kept)
            .collect();
        apexes.sort_unstable();
        let distinct = apexes.windows(2).all(|pair| pair[0] != pair[1]);
        let own = self.neighbours(gone);
        let common = own.iter().copied().filter(|w| theirs.binary_search(w).is_ok());
        if !distinct || !common.eq(apexes.iter().copied()) {
            return false;
        }
        // A curve of three edges stays one, and so does a surface of four triangles.
        let doubles_curve =
            apexes.iter().any(|w| self.curves.contains(gone, *w) && self.curves.contains(kept, *w));
        let doubles_face = self.moved(gone, kept).any(|(_, triangle)| {
            let others = triangle.map(|w| if w == gone { kept } else { w });
            self.star[kept as usize]
                .iter()
                .any(|t| others.iter().all(|w| self.triangles[*t as usize].contains(w)))
        });
        !doubles_curve && !doubles_face
    }

    /// The triangles of `v` without `other`.
    fn moved(&self, v: u32, other: u32) -> impl Iterator<Item = (u32, [u32; 3])> {
        let of = move |t: &u32| (*t, self.triangles[*t as usize]);
        self.star[v as usize].iter().map(of).filter(move |(_, triangle)| !triangle.contains(&other))
    }

    fn keeps_shape(&self, collapse: &Collapse, limits: &Limits) -> bool {
        let Collapse { gone, kept, to, .. } = *collapse;
        let length = limits.length * self.size(gone, kept);
        let at = |w: u32| if w == gone || w == kept { to } else { self.points[w as usize] };
        let moved = || self.moved(gone, kept).chain(self.moved(kept, gone));
        let map = self.map_at([gone, kept]);
        // Where stretched triangles are even.
        let even = |corners: [DVec3; 3]| map.map_or(corners, |map| corners.map(|p| map * p));
        // Where a triangle is lower already, even one of those that go, others may become as low.
        let least_height = || {
            let around = [gone, kept].into_iter().flat_map(|v| self.star[v as usize].iter());
            around
                .map(|t| height_of(even(self.corners(self.triangles[*t as usize]))))
                .fold(limits.height, f64::min)
        };
        let longest = limits.longest * if map.is_some() { limits.length } else { length };
        let mut least = None;
        for (_, triangle) in moved() {
            // What takes least time comes first.
            let (old, new) = (self.corners(triangle), corners_at(triangle, at));
            let even_new = even(new);
            let longer = longest_side(even_new);
            if longer > longest && longer > longest.max(longest_side(even(old))) {
                return false;
            }
            let (n, m) = (doubled_normal(old), doubled_normal(new));
            let doubled_area = m.length();
            if n.dot(m) < limits.cosine * n.length() * doubled_area {
                return false;
            }
            let even_area = if map.is_some() { doubled_normal(even_new).length() } else { doubled_area };
            let height = height_over(longer, even_area);
            if height < limits.height && height < *least.get_or_insert_with(least_height) {
                return false;
            }
        }
        let is_near = |p: DVec3| {
            let distance_sq = |triangle| closest_on_triangle(p, triangle).point.distance_squared(p);
            moved()
                .any(|(_, triangle)| distance_sq(corners_at(triangle, at)).sqrt() <= limits.distance * length)
        };
        limits.distance.is_infinite() || [gone, kept].into_iter().all(|v| is_near(self.points[v as usize]))
    }

    /// Whether the collapse turns triangles by little, or no more of those around intersect after it.
    fn collapse_keeps_apart(&self, collapse: &Collapse) -> bool {
        self.collapse_turns_little(collapse) || self.collapse_stays_apart(collapse)
    }

    fn collapse_turns_little(&self, collapse: &Collapse) -> bool {
        let Collapse { gone, kept, to, .. } = *collapse;
        let at = |w: u32| if w == gone || w == kept { to } else { self.points[w as usize] };
        let moved = self.moved(gone, kept).chain(self.moved(kept, gone));
        self.turn_little(moved.map(|(_, triangle)| triangle), at)
    }

    /// Whether no more triangles around intersect after the collapse.
    fn collapse_stays_apart(&self, collapse: &Collapse) -> bool {
        let Collapse { gone, kept, to, .. } = *collapse;
        // Where one vertex takes the other's place, the triangles around that one stay.
        let stays = to == self.points[kept as usize];
        let old = if stays { self.star[gone as usize].clone() } else { self.around_edge(gone, kept) };
        let of_kept = self.moved(kept, gone).filter(|_| !stays);
        let moved = self.moved(gone, kept).chain(of_kept);
        let new: Vec<[u32; 3]> = moved.map(|(_, t)| t.map(|w| if w == gone { kept } else { w })).collect();
        let at = |w: u32| if w == kept { to } else { self.points[w as usize] };
        self.change_stays_apart(&[gone, kept], &old, &new, at)
    }

    fn collapse_stays_close(&self, collapse: &Collapse) -> bool {
        if self.samples.is_none() {
            return true;
        }
        let Collapse { gone, kept, to, .. } = *collapse;
        let at = |w: u32| if w == gone || w == kept { to } else { self.points[w as usize] };
        let moved = self.moved(gone, kept).chain(self.moved(kept, gone));
        let new: Vec<[DVec3; 3]> = moved.map(|(_, triangle)| corners_at(triangle, at)).collect();
        self.stays_close(&self.around_edge(gone, kept), &new)
    }

    /// The triangles around the ends of an edge.
    fn around_edge(&self, a: u32, b: u32) -> Star {
        let of_b = self.star[b as usize].iter().filter(|t| !self.triangles[**t as usize].contains(&a));
        self.star[a as usize].iter().chain(of_b).copied().collect()
    }

    fn apply(&mut self, collapse: &Collapse) {
        let Collapse { gone, kept, to, shifts } = *collapse;
        if let Some([shift, kept_shift]) = shifts {
            let moved = self.parts_after(gone, kept, shift);
            let own = self.parts_after(kept, gone, kept_shift);
            self.curves.remove(gone, kept);
            for (w, part) in moved {
                self.curves.remove(gone, w);
                self.curves.insert(kept, w, part);
            }
            // A corner stays where it is on all of its curves.
            if self.places[kept as usize] == Place::Curve {
                own.into_iter().for_each(|(w, part)| self.curves.insert(kept, w, part));
            }
        }
        if self.places[gone as usize] == Place::Corner {
            self.places[kept as usize] = Place::Corner;
        }
        let old = if self.samples.is_some() { self.around_edge(gone, kept) } else { Star::new() };
        let dead: Star = self.at_edge(gone, kept).collect();
        dead.into_iter().for_each(|t| self.remove_triangle(t));
        let moved: Vec<(u32, [u32; 3])> = self.moved(gone, kept).collect();
        for (t, triangle) in moved {
            self.replace(t, triangle.map(|w| if w == gone { kept } else { w }));
        }
        if !self.sizes.is_empty() && to != self.points[kept as usize] {
            self.sizes[kept as usize] = self.size(gone, kept);
            if let Some(map) = self.map_at([gone, kept]) {
                self.maps[kept as usize] = map;
            }
        }
        self.points[kept as usize] = to;
        self.count_removed_vertex();
        if self.samples.is_some() {
            let around = self.star[kept as usize].clone();
            self.pass_samples(&old, &around);
        }
    }
}

/// The height of a triangle over its longest side, as a share of that.
fn height_of(corners: [DVec3; 3]) -> f64 {
    height_over(longest_side(corners), doubled_normal(corners).length())
}

fn height_over(longest: f64, doubled_area: f64) -> f64 {
    doubled_area / (longest * longest).max(f64::MIN_POSITIVE)
}

fn longest_side([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt()
}
