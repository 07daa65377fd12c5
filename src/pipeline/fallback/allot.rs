//! How the vertices are shared out among components.

use crate::grammar::counted;
use crate::{Error, Result};

/// A component with at most this many vertices consists of corners, none of which can go without a change of
/// its shape.
const FEW: usize = 32;
/// Vertices that show the shape of a compact component: as many as an icosahedron has.
pub(super) const COMPACT: usize = 12;
/// The most vertices that the shape of a component asks for.
pub(super) const MOST_FOR_SHAPE: usize = 64;
/// The shape of a component that would need more than this many is a plate's, which no such number shows.
pub(super) const OF_PLATES: usize = 256;
/// Beyond [`FEW`] for each, shapes get at most this share of all vertices.
const SHARE_FOR_SHAPES: f64 = 0.1;
/// Components that would get at least this many vertices by area keep half of them, whatever others need.
pub(super) const SMALL: f64 = 32.0;

/// A component, as far as its share of the vertices depends on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Claim {
    /// By which the vertices are shared out: more than the area where edges are shorter.
    pub area: f64,
    /// Vertices of the component in the input.
    pub vertices: usize,
    /// Vertices that show its shape: more for long and thin ones.
    pub shape: usize,
    /// The least number of vertices that its topology allows, or 0 if that is not known.
    pub least: usize,
}

/// `count` vertices in all, by area; but where a component would lose its shape, as many as that needs, as
/// far as there are enough.
///
/// # Errors
/// [`Error::Usage`] with the least number of vertices if there are too few.
pub(super) fn allot(claims: &[Claim], count: usize) -> Result<Vec<usize>> {
    let whole: f64 = claims.iter().map(|claim| claim.area).sum();
    let floor = |claim: &Claim, most: usize| {
        let share = count as f64 * claim.area / whole;
        let shape = if claim.vertices <= FEW { claim.vertices } else { claim.shape.min(claim.vertices) };
        let half = if share >= SMALL { (0.5 * share) as usize } else { 0 };
        claim.least.max(shape.min(most)).max(half)
    };
    for most in (0..=MOST_FOR_SHAPE).rev() {
        let floors: Vec<usize> = claims.iter().map(|claim| floor(claim, most)).collect();
        let for_shapes: usize = claims.iter().map(|claim| claim.shape.min(most).saturating_sub(FEW)).sum();
        let is_much = for_shapes as f64 > SHARE_FOR_SHAPES * count as f64;
        if !is_much && floors.iter().sum::<usize>() <= count {
            return Ok(above_floors(claims, &floors, count));
        }
    }
    let floors: Vec<usize> = claims.iter().map(|claim| claim.least).collect();
    let needed = floors.iter().sum();
    if needed > count {
        return Err(too_few(count, claims.len(), needed));
    }
    Ok(above_floors(claims, &floors, count))
}

/// Shares by area, but none below its floor; in all exactly `count`, which the floors must not exceed.
fn above_floors(claims: &[Claim], floors: &[usize], count: usize) -> Vec<usize> {
    let mut at_floor = vec![false; claims.len()];
    let mut rest;
    let mut area: f64;
    loop {
        let free = |part: &usize| !at_floor[*part];
        rest =
            count - (0..claims.len()).filter(|part| at_floor[*part]).map(|part| floors[part]).sum::<usize>();
        area =
            (0..claims.len()).filter(free).map(|part| claims[part].area).sum::<f64>().max(f64::MIN_POSITIVE);
        let share = |part: usize| rest as f64 * claims[part].area / area;
        let low: Vec<usize> =
            (0..claims.len()).filter(free).filter(|part| share(*part) < floors[*part] as f64).collect();
        if low.is_empty() {
            break;
        }
        low.into_iter().for_each(|part| at_floor[part] = true);
    }
    // Rounded so that the sum is right, as evenly as whole numbers can be.
    let (mut passed, mut given) = (0.0, 0);
    let mut counts = floors.to_vec();
    for part in (0..claims.len()).filter(|part| !at_floor[*part]) {
        passed += (rest as f64 * claims[part].area / area - floors[part] as f64).max(0.0);
        let upto = (passed.round() as usize).max(given);
        counts[part] += upto - given;
        given = upto;
    }
    settle(&mut counts, floors, count);
    counts
}

/// Makes the sum right where rounding has left a vertex too many or too few, at the largest component.
fn settle(counts: &mut [usize], floors: &[usize], count: usize) {
    let sum: usize = counts.iter().sum();
    let largest = (0..counts.len()).max_by_key(|part| counts[*part] - floors[*part]);
    if let Some(largest) = largest {
        counts[largest] = (counts[largest] + count).saturating_sub(sum).max(floors[largest]);
    }
}

pub(super) fn too_few(count: usize, components: usize, needed: usize) -> Error {
    let what = if components == 1 { "topology".to_owned() } else { format!("{components} components") };
    Error::usage(
        format!("{} too few for the {what} of this surface", counted(count, ["vertex is", "vertices are"])),
        format!("ask for {needed} vertices or more"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(area: f64, vertices: usize) -> Claim {
        Claim { area, vertices, shape: COMPACT, least: 0 }
    }

    #[test]
    fn shares_are_by_area_where_shapes_do_not_need_more() {
        let claims = [claim(3.0, 5000), claim(1.0, 5000), claim(2.0, 5000)];
        assert_eq!(allot(&claims, 600).unwrap(), [300, 100, 200]);
        assert_eq!(allot(&claims, 601).unwrap().iter().sum::<usize>(), 601);
    }

    #[test]
    fn small_components_keep_their_corners() {
        let claims = [claim(1000.0, 5000), claim(0.1, 8), claim(0.1, 4), claim(0.1, 500)];
        assert_eq!(allot(&claims, 500).unwrap(), [476, 8, 4, 12]);
    }

    #[test]
    fn shapes_get_more_than_their_share_as_far_as_that_is_little() {
        let thin = Claim { shape: 50, ..claim(1.0, 500) };
        assert_eq!(allot(&[claim(1000.0, 5000), thin], 5000).unwrap(), [4950, 50]);
        // Twenty of them may have a tenth of the vertices beyond 32 for each.
        let mut claims = vec![thin; 20];
        claims.push(claim(1000.0, 5000));
        let counts = allot(&claims, 2000).unwrap();
        assert_eq!(counts[..20], [42; 20]);
        assert_eq!(counts.iter().sum::<usize>(), 2000);
    }

    #[test]
    fn a_large_component_keeps_half_of_its_share() {
        let mut claims = vec![claim(1.0, 8); 40];
        claims.push(claim(1000.0, 5000));
        let counts = allot(&claims, 200).unwrap();
        assert_eq!(counts.iter().sum::<usize>(), 200);
        assert!(counts[40] >= 96, "{counts:?}");
        assert!(counts[..40].iter().all(|count| *count == 2), "{counts:?}");
    }

    #[test]
    fn the_topology_comes_first() {
        let claim = |least| Claim { area: 1.0, vertices: 100, shape: COMPACT, least };
        assert_eq!(allot(&[claim(4), claim(20)], 24).unwrap(), [4, 20]);
        let error = allot(&[claim(4), claim(20)], 23).unwrap_err();
        assert!(error.to_string().contains("ask for 24 vertices"), "{error}");
        assert!(allot(&[Claim { area: 0.0, vertices: 3, shape: COMPACT, least: 3 }], 10).unwrap() == [10]);
    }
}
