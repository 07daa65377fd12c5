//! What is known of the triangles of a mesh: how far they are from the surface, and whether they are sound.
//!
//! Regions overlap, and many are looked at several times; most of their triangles have not changed then.

use glam::DVec3;

use crate::mesh::NONE;

/// Samples of a triangle: at the corners, three on each edge, and four inside.
pub(super) const SAMPLES: usize = 16;
/// Index of the sample at the centroid, the first of those inside.
pub(super) const MIDDLE: usize = 12;

/// Ranks at which the searches of a triangle's samples ended.
pub(super) type Ranks = [usize; SAMPLES];

/// A sample point of a triangle.
pub(super) fn sample([a, b, c]: [DVec3; 3], k: usize) -> DVec3 {
    let on_edge = |p: DVec3, q: DVec3| p.lerp(q, (k % 3 + 1) as f64 / 4.0);
    let middle = || (a + b + c) / 3.0;
    match k {
        0 => a,
        1 => b,
        2 => c,
        3..=5 => on_edge(a, b),
        6..=8 => on_edge(b, c),
        9..=11 => on_edge(c, a),
        MIDDLE => middle(),
        13 => (a + middle()) * 0.5,
        14 => (b + middle()) * 0.5,
        _ => (c + middle()) * 0.5,
    }
}

/// What is known of a triangle.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    /// The squared distances of its samples, 0 where it is at most `down_to`; NaN where they are unknown.
    samples: [f64; SAMPLES],
    down_to: f64,
    /// `None` where it is unknown.
    pub sound: Option<bool>,
    pub ranks: Ranks,
}

impl Known {
    /// Nothing but a rank near the centroid.
    fn nothing(rank: usize) -> Self {
        Self { samples: [f64::NAN; SAMPLES], down_to: f64::INFINITY, sound: None, ranks: [rank; SAMPLES] }
    }

    /// Finds out about the samples that are `owned` and not known. `search` gives the squared distance of a
    /// sample if it is more than its last argument, and begins at a rank.
    pub fn complete(
        &mut self,
        owned: u16,
        tolerance_sq: f64,
        search: impl Fn(usize, &mut usize, f64) -> Option<f64>,
    ) {
        if tolerance_sq < self.down_to {
            self.down_to = tolerance_sq;
            self.samples.iter_mut().filter(|near| **near == 0.0).for_each(|near| *near = f64::NAN);
        }
        for k in (0..SAMPLES).filter(|k| owned >> k & 1 != 0) {
            if self.samples[k].is_nan() {
                self.samples[k] = search(k, &mut self.ranks[k], self.down_to).unwrap_or(0.0);
            }
        }
    }

    /// Whether there is nothing left to find out.
    fn is_complete(&self, owned: u16, tolerance_sq: f64) -> bool {
        let known = |k: usize| owned >> k & 1 == 0 || !self.samples[k].is_nan();
        self.down_to <= tolerance_sq && self.sound.is_some() && (0..SAMPLES).all(known)
    }

    /// The squared distances beyond the tolerance, of the samples that are `owned`.
    pub fn beyond(&self, owned: u16, tolerance_sq: f64) -> impl Iterator<Item = f64> {
        let owned = move |k: &usize| owned >> k & 1 != 0;
        let is_beyond = move |distance_sq: &f64| *distance_sq > tolerance_sq;
        (0..SAMPLES).filter(owned).map(|k| self.samples[k]).filter(is_beyond)
    }
}

/// What is known of all triangles.
pub(crate) struct KnownTriangles {
    /// Where each triangle is in the list; [`NONE`] where nothing is known.
    place: Vec<u32>,
    known: Vec<Known>,
    /// For each triangle a rank near its centroid.
    ranks: Vec<u32>,
}

impl KnownTriangles {
    /// Of triangles with a rank near the centroid of each.
    pub fn new(ranks: Vec<u32>) -> Self {
        Self { place: vec![NONE; ranks.len()], known: Vec::new(), ranks }
    }

    /// What is known of a triangle. Panics if that is nothing.
    pub fn of(&self, t: u32) -> &Known {
        &self.known[self.place[t as usize] as usize]
    }

    /// A copy of what is known of a triangle, unless that is all.
    pub fn incomplete(&self, t: u32, owned: u16, tolerance_sq: f64) -> Option<Known> {
        let place = self.place[t as usize];
        if place == NONE {
            return Some(Known::nothing(self.ranks[t as usize] as usize));
        }
        let known = &self.known[place as usize];
        (!known.is_complete(owned, tolerance_sq)).then(|| known.clone())
    }

    /// Notes what is known of a triangle.
    pub fn set(&mut self, t: u32, known: Known) {
        match self.place[t as usize] {
            NONE => {
                self.place[t as usize] = self.known.len() as u32;
                self.known.push(known);
            }
            place => self.known[place as usize] = known,
        }
    }

    /// Forgets a triangle that has changed, except for where to search.
    pub fn forget(&mut self, t: u32) {
        let place = self.place[t as usize];
        if place != NONE {
            let known = &mut self.known[place as usize];
            (known.samples, known.sound) = ([f64::NAN; SAMPLES], None);
        }
    }

    /// Forgets whether a triangle next to one that has changed is sound.
    pub fn forget_sound(&mut self, t: u32) {
        let place = self.place[t as usize];
        if place != NONE {
            self.known[place as usize].sound = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_unknown_is_searched_for() {
        let mut triangles = KnownTriangles::new(vec![7, 8]);
        let asked = |known: &mut Known, owned: u16, tolerance_sq: f64| {
            let asked = std::cell::RefCell::new(Vec::new());
            known.complete(owned, tolerance_sq, |k, rank, most| {
                asked.borrow_mut().push((k, *rank));
                *rank = 100 + k;
                Some(k as f64).filter(|distance_sq| *distance_sq > most)
            });
            known.sound = Some(true);
            asked.into_inner()
        };
        let mut known = triangles.incomplete(1, 0b1011, 2.0).unwrap();
        assert_eq!(asked(&mut known, 0b1011, 2.0), [(0, 8), (1, 8), (3, 8)]);
        triangles.set(1, known);
        assert!(triangles.incomplete(1, 0b1010, 2.0).is_none());
        assert!(triangles.incomplete(1, 0b1010, 2.5).is_none());
        assert_eq!(triangles.of(1).beyond(0b1111, 2.0).collect::<Vec<_>>(), [3.0]);
        // Another sample; a smaller tolerance, for which more is to be known than for the first.
        let mut known = triangles.incomplete(1, 0b10011, 2.0).unwrap();
        assert_eq!(asked(&mut known, 0b10011, 2.0), [(4, 8)]);
        assert_eq!(asked(&mut known, 0b11011, 0.5), [(0, 100), (1, 101)]);
        assert_eq!(known.beyond(0b11011, 0.5).collect::<Vec<_>>(), [1.0, 3.0, 4.0]);
        assert_eq!(known.beyond(0b01011, 2.0).collect::<Vec<_>>(), [3.0]);
        // What has changed.
        triangles.set(1, known);
        triangles.forget(1);
        let mut known = triangles.incomplete(1, 0b1, 1.5).unwrap();
        assert_eq!(asked(&mut known, 0b1, 1.5), [(0, 100)]);
        triangles.set(1, known);
        triangles.forget_sound(1);
        let known = triangles.incomplete(1, 0b1, 1.5).unwrap();
        assert!(known.sound.is_none() && known.beyond(0b1, 0.0).next().is_none());
    }

    #[test]
    fn samples_are_spread_over_the_triangle() {
        let corners = [DVec3::ZERO, 12.0 * DVec3::X, 12.0 * DVec3::Y];
        let at = |k| sample(corners, k).truncate().to_array();
        assert_eq!([0, 1, 2].map(at), [[0.0, 0.0], [12.0, 0.0], [0.0, 12.0]]);
        assert_eq!([3, 4, 5].map(at), [[3.0, 0.0], [6.0, 0.0], [9.0, 0.0]]);
        assert_eq!([6, 7, 8].map(at), [[9.0, 3.0], [6.0, 6.0], [3.0, 9.0]]);
        assert_eq!([9, 10, 11].map(at), [[0.0, 9.0], [0.0, 6.0], [0.0, 3.0]]);
        assert_eq!([12, 13, 14, 15].map(at), [[4.0, 4.0], [2.0, 2.0], [8.0, 2.0], [2.0, 8.0]]);
    }
}
