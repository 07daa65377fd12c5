//! Sharp edges that are given up for want of vertices, and the number of vertices that keeps them.

use super::coarse_to_fine::levels::enough;
use super::result::FeatureSummary;
use super::warning::{Warning, WarningCode};
use crate::grammar::in_groups;
use crate::mesh::features::{FeatureOptions, find_features};
use crate::mesh::spacing;
use crate::sites::surface_curves::SurfaceCurves;
use crate::{ProgressToken, Result, TriMesh};

/// Sharp edges that were given up matter if they are more than this fraction of the total length.
const LEAST: f64 = 0.05;
/// Sharp edges count as given up only if this many times the vertices would keep them, or [`MOST_FOR_FEW`]:
/// no number of vertices keeps the noise of scans. Where a search takes long, only the first is tried.
const MOST_TIMES: [usize; 2] = [16, 64];
/// Number of vertices that is tried however few are asked for.
const MOST_FOR_FEW: usize = 50_000;
/// The number of vertices that a warning names gives up at most this fraction if one below the largest that
/// was tried does, since a run may give up a little more than was found here.
const NAMED: f64 = 0.03;
/// A search takes long on surfaces with more triangles.
const FEW_TRIANGLES: usize = 100_000;
/// Numbers of vertices are tried until two are as close as this, relative to each other.
const CLOSE: f64 = 0.1;

/// A surface whose features were searched for.
pub(crate) struct Searched<'a> {
    /// In the unit-diagonal frame, and its area.
    pub surface: &'a TriMesh,
    pub area: f64,
    /// Degrees.
    pub feature_angle: f64,
    /// The number of vertices for this surface, and how many more there are on other components.
    pub vertices: usize,
    pub elsewhere: usize,
}

/// How many vertices keep sharp edges.
enum Enough {
    /// About this many.
    At(usize),
    /// There was no time to find out.
    Unknown,
    /// Not even this many, far more than were asked for.
    Not(usize),
}

/// Whether so many sharp edges are no features that it matters, and not mainly those between facets.
pub(crate) fn gives_up_many(found: &FeatureSummary) -> bool {
    let given_up = found.discarded.length();
    given_up > LEAST * (given_up + found.sharp_length) && given_up >= found.discarded.facet_length
}

impl Searched<'_> {
    /// All warnings of the features `found` by what the number asked for gives.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn warnings(&self, found: &FeatureSummary, progress: &ProgressToken) -> Result<Vec<Warning>> {
        let given_up = self.warning(found, progress)?;
        Ok(given_up.into_iter().chain(self.facets_warning(found, progress)?).collect())
    }

    /// The warning that sharp edges were given up, if they matter; `found` is what the number asked for
    /// gives. If more edges were taken for a coarse tessellation, those given up may belong to it, too.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    fn warning(&self, found: &FeatureSummary, progress: &ProgressToken) -> Result<Option<Warning>> {
        if !gives_up_many(found) {
            return Ok(None);
        }
        let enough = self.enough(false, progress)?;
        // Where nothing is kept, it may be the noise of a scan.
        let may_be_noise = match enough {
            Enough::At(_) => false,
            Enough::Unknown => found.sharp_length <= 0.0,
            Enough::Not(_) => true,
        };
        if may_be_noise {
            return Ok(None);
        }
        let given_up = found.discarded.length();
        let [given_up, all] = [given_up, given_up + found.sharp_length].map(length_text);
        let remedy = self.remedy(&enough);
        let text = format!("sharp edges of length {given_up} (of {all} in total) were given up: {remedy}");
        Ok(Some(Warning { code: WarningCode::SharpEdges, text }))
    }

    /// The warning that edges between narrow facets were taken for those of a round surface, if many were.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    fn facets_warning(&self, found: &FeatureSummary, progress: &ProgressToken) -> Result<Option<Warning>> {
        let FeatureSummary { discarded, sharp_length, .. } = found;
        let all = discarded.length() + discarded.facet_length + sharp_length;
        if discarded.facet_length <= LEAST * all {
            return Ok(None);
        }
        let text = format!(
            "creases of length {} (of {} in total) lie between facets narrower than an edge and were treated \
            as the tessellation of a round surface: {}",
            length_text(discarded.facet_length),
            length_text(all),
            self.remedy(&self.enough(true, progress)?),
        );
        Ok(Some(Warning { code: WarningCode::NarrowFacets, text }))
    }

    /// What a warning says of how many vertices keep the edges.
    fn remedy(&self, enough: &Enough) -> String {
        let number = |vertices: usize| in_groups(&(vertices + self.elsewhere).to_string(), ',');
        match *enough {
            Enough::At(vertices) => format!("{} vertices keep them", number(vertices)),
            Enough::Unknown => "more vertices keep them".to_owned(),
            Enough::Not(vertices) => format!("even {} vertices do not keep them", number(vertices)),
        }
    }

    /// How many vertices keep nearly all sharp edges, nearly the least number; with `round_facets` as in
    /// [`FeatureOptions`], those between facets, too.
    fn enough(&self, round_facets: bool, progress: &ProgressToken) -> Result<Enough> {
        let mut tried = vec![MOST_TIMES[0] * self.vertices];
        if self.surface.triangles.len() <= FEW_TRIANGLES {
            tried.push((MOST_TIMES[1] * self.vertices).max(MOST_FOR_FEW));
        } else if progress.leave_out() {
            return Ok(Enough::Unknown);
        }
        let (mut few, mut many) = (self.vertices, None);
        for vertices in tried {
            if vertices > MOST_TIMES[0] * self.vertices && progress.leave_out() {
                return Ok(Enough::Unknown);
            }
            progress.poll()?;
            if self.gives_up_at_most(LEAST, round_facets, vertices) {
                many = Some(vertices);
                break;
            }
            few = vertices;
        }
        let Some(mut many) = many else { return Ok(Enough::Not(few)) };
        while many as f64 > (1.0 + CLOSE) * few as f64 && !progress.leave_out() {
            progress.poll()?;
            let between = rounded_up((few as f64 * many as f64).sqrt());
            if between >= many || between <= few {
                break;
            }
            if self.gives_up_at_most(NAMED, round_facets, between) {
                many = between;
            } else {
                few = between;
            }
        }
        Ok(Enough::At(many))
    }

    /// Whether a run with this many vertices would give up at most this fraction of the sharp edges; see
    /// [`Searched::enough`].
    fn gives_up_at_most(&self, fraction: f64, round_facets: bool, vertices: usize) -> bool {
        let spacing = spacing(self.area, vertices);
        let options = FeatureOptions {
            feature_angle: self.feature_angle,
            round_facets,
            ..FeatureOptions::new(spacing)
        };
        let Ok(features) = find_features(self.surface, &options) else { return false };
        let FeatureSummary { discarded, sharp_length, .. } = FeatureSummary::of(&features);
        let given_up = discarded.length() + discarded.facet_length;
        let TriMesh { vertices: points, triangles } = self.surface;
        let has_room = || {
            SurfaceCurves::new(points, triangles, &features)
                .is_none_or(|curves| enough(&curves, self.area, vertices) <= vertices)
        };
        // Without `round_facets`, no edge is one between facets.
        given_up <= fraction * (given_up + sharp_length) && has_room()
    }
}

/// A number of vertices rounded up to two digits.
fn rounded_up(number: f64) -> usize {
    let unit = 10_f64.powf((number.log10().floor() - 1.0).max(0.0));
    ((number / unit).ceil() * unit) as usize
}

/// A length with four digits at least before or behind the point.
fn length_text(length: f64) -> String {
    if !(1e-3..1e15).contains(&length) {
        return format!("{length:.3e}");
    }
    let decimals = (3.0 - length.log10().floor()).clamp(0.0, 6.0) as usize;
    in_groups(&format!("{length:.decimals$}"), ',')
}

#[cfg(test)]
mod tests {
    use super::{length_text, rounded_up};

    #[test]
    fn numbers_have_two_digits_and_lengths_four() {
        assert_eq!([7.2, 1811.0, 1900.0, 123_456.0].map(rounded_up), [8, 1900, 1900, 130_000]);
        assert_eq!((length_text(1656.7), length_text(2.5)), ("1,657".into(), "2.500".into()));
        assert_eq!(length_text(2e-9), "2.000e-9");
    }
}
