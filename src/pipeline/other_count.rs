//! A number of vertices that goes with the edges that are kept, where the one asked for does not.

use super::kept::Kept;
use super::prepare::repaired_for;
use super::preview::plan_of;
use crate::options::Options;
use crate::{Error, ProgressToken, Result, TriMesh};

/// Each number that is tried is this many times the one before it, or that fraction of it.
const STEP: f64 = 1.15;
/// At most so many larger and so many smaller numbers are tried.
const TRIES: usize = 26;
/// Fewer are where that would take long: so many triangles are planned for, each time they are counted.
const MOST_TRIANGLES: usize = 4_000_000;

/// An error about the number of vertices, with a number that can be; other errors as they are.
///
/// Edges that are kept leave room for neither too many vertices nor too few, and each bound is found by
/// itself. Where the number that an error names would lead to the next error, this finds one that does not.
pub(super) fn with_other_count(error: Error, input: &TriMesh, options: &Options) -> Error {
    let method = &options.coarse_to_fine;
    let Error::Usage { problem, remedy, field: None | Some("vertices" | "refine") } = &error else {
        return error;
    };
    if (method.keep.is_empty() && !method.keep_boundary) || options.faces.is_some() {
        return error;
    }
    match other_count(remedy, input, options) {
        Err(_) | Ok(Found::Named) => error,
        Ok(Found::Other(count)) => Error::option("vertices", problem, format!("ask for {count} vertices")),
        Ok(Found::Nothing) => {
            let remedy = "no other number of vertices helps: keep fewer or more triangles, so that no small \
            parts are left between kept ones, or divide the longest edges that are kept";
            Error::option("vertices", problem, remedy)
        }
    }
}

/// The number of vertices that works.
#[derive(Debug, PartialEq, Eq)]
enum Found {
    /// One that the remedy names.
    Named,
    Other(usize),
    Nothing,
}

fn other_count(remedy: &str, input: &TriMesh, options: &Options) -> Result<Found> {
    let repaired = repaired_for(input, None, options, &ProgressToken::default())?;
    let mut rest = repaired.clone();
    let kept = Kept::cut_off(&mut rest, options, input)?;
    let works = |vertices: usize| {
        let options = Options { vertices, ..options.clone() };
        plan_of(input, repaired.clone(), &options).is_ok()
    };
    let named = remedy.split(|c: char| !c.is_ascii_digit()).filter_map(|word| word.parse().ok());
    if named.into_iter().any(works) {
        return Ok(Found::Named);
    }
    let others = kept.as_ref().map_or(0, Kept::own_vertices);
    let least = kept.as_ref().map_or(4, Kept::least_of_rest);
    let asked = options.vertices.saturating_sub(others).max(least);
    let tries = (MOST_TRIANGLES / rest.mesh.triangles.len().max(1)).clamp(4, TRIES);
    // Few others may work where there is hardly room for any.
    let numbers = nearest_first(asked, tries).chain([least]).map(|count| count + others);
    Ok(numbers.into_iter().find(|count| works(*count)).map_or(Found::Nothing, Found::Other))
}

/// This number and others, larger and smaller ones by turns.
fn nearest_first(number: usize, tries: usize) -> impl Iterator<Item = usize> {
    let at = move |power: i32| (number as f64 * STEP.powi(power)).round() as usize;
    let both = (1..=tries as i32).flat_map(|power| [power, -power]);
    std::iter::once(0).chain(both).map(at).filter(|count| *count >= 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_tried_from_the_nearest_on() {
        assert_eq!(nearest_first(100, 2).collect::<Vec<_>>(), [100, 115, 87, 132, 76]);
        assert_eq!(nearest_first(4, 1).collect::<Vec<_>>(), [4, 5]);
    }
}
