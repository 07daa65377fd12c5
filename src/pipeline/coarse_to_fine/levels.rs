//! The levels of a run: the number of sites of each, and their spacing.

use super::refine::level_counts;
use crate::mesh::spacing;
use crate::sites::curve_sites::CurveCounts;
use crate::sites::surface_curves::SurfaceCurves;
use crate::{Error, Result};

/// Largest fraction of the sites that may be on curves.
const MOST_ON_CURVES: f64 = 0.6;
/// Largest fraction of the curves that may be shorter than a coarse level's spacing without being so at the
/// finest.
const MOST_SHORT: f64 = 0.2;
/// Short curves do not count if they are fewer than this fraction of the level's sites.
const FEW_SHORT: f64 = 0.01;

/// Longer spacings are looked at where that of a number of sites does not do, in steps of this factor.
const LONGER: f64 = 1.02;
/// How many of them: up to twice the spacing.
const LONGER_SPACINGS: i32 = 35;
/// Bisections that locate the spacing at which curves get fewer sites.
const HALVINGS: u32 = 30;

/// Sites of one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LevelPlan {
    /// All sites.
    pub sites: usize,
    /// The sites that are not on curves.
    pub interior: usize,
    /// Whether it is the finest, which alone has what the user wants to be kept exactly.
    pub is_finest: bool,
    /// Of those that are not interior, the user's points.
    pub points: usize,
    /// Edge length of a perfect layout; somewhat longer where curves would get too many sites.
    pub spacing: f64,
}

/// The surface as far as the levels depend on it.
pub(crate) struct Extent<'a> {
    pub area: f64,
    /// Its Euler characteristic.
    pub euler: i64,
    pub curves: Option<&'a SurfaceCurves>,
}

/// Levels from the coarsest to that of `count` sites in all; none but the last has fewer than `coarsest`.
///
/// # Errors
/// [`Error::Usage`] if more than [`MOST_ON_CURVES`] of them would be on curves.
pub(crate) fn levels(on: &Extent, count: usize, coarsest: usize) -> Result<Vec<LevelPlan>> {
    let Some(curves) = on.curves else {
        let plain = |sites| LevelPlan {
            sites,
            interior: sites,
            is_finest: sites == count,
            points: 0,
            spacing: spacing(on.area, sites),
        };
        return Ok(level_counts(count, on.euler, coarsest).into_iter().map(plain).collect());
    };
    let finest = finest(curves, on.area, count)?;
    let curves = curves.coarse();
    let short = |h: f64| curves.lengths().filter(|length| *length < h).count() as f64;
    let already_short = short(finest.spacing);
    let mut levels = vec![finest];
    let mut finer = finest;
    while let Some(next) = coarser(curves, on.euler, &finer) {
        let most_short = (MOST_SHORT * curves.curve_count() as f64).max(FEW_SHORT * next.sites as f64);
        // With fewer interior sites than curve sites, edges between the former say little about the next
        // level.
        let few_inside = 2 * next.interior < next.sites;
        if next.sites < coarsest
            || next.sites >= finer.sites
            || few_inside
            || short(next.spacing) - already_short > most_short
        {
            break;
        }
        levels.push(next);
        finer = next;
    }
    levels.reverse();
    Ok(levels)
}

fn finest(curves: &SurfaceCurves, area: f64, count: usize) -> Result<LevelPlan> {
    if let Some(plan) = fitting(curves, area, count) {
        return Ok(plan);
    }
    let plan = even(curves, area, count);
    let kept = plan.sites - plan.interior;
    let problem = format!(
        "sharp edges and boundaries need {kept} vertices, which leaves too few of {count} for the rest"
    );
    Err(Error::usage(problem, more_vertices(enough(curves, area, count))))
}

/// The remedy where curves leave too few vertices for the rest.
pub(crate) fn more_vertices(enough: usize) -> String {
    format!(
        "ask for {enough} vertices or more, let `shortage` add-vertices add them, or raise `feature_angle`"
    )
}

/// The level of `count` sites, if that leaves enough besides those on curves. Curves of one length all get
/// another site at once, so that a somewhat smaller number may leave enough where this one does not: then as
/// many sites on curves do.
fn fitting(curves: &SurfaceCurves, area: f64, count: usize) -> Option<LevelPlan> {
    let plan = even(curves, area, count);
    if fits(&plan) {
        return Some(plan);
    }
    let kept = |on: CurveCounts| on.sites + plan.points;
    // No longer spacing has more on curves.
    let are_few = |on: CurveCounts| kept(on) as f64 <= MOST_ON_CURVES * count as f64;
    let longest = plan.spacing * LONGER.powi(LONGER_SPACINGS);
    if !are_few(curves.count(longest)) {
        return None;
    }
    // The most sites with the spacing of a drop: one more would shorten it below that.
    let most = |below: f64, on: CurveCounts| area / covered(below) + on.sites as f64 - 0.5 * on.sides as f64;
    let drop_at = |ends: [f64; 2], is_past: &dyn Fn(CurveCounts) -> bool| {
        let [below, spacing] = first_past(curves, ends, is_past);
        let kept = kept(curves.count(spacing));
        let fits = kept as f64 <= MOST_ON_CURVES * most(below, curves.count(below)).min(count as f64);
        fits.then(|| LevelPlan { sites: count, interior: count - kept, spacing, ..plan })
    };
    if let Some(level) = drop_at([plan.spacing, longest], &are_few) {
        return Some(level);
    }
    let (mut low, mut on) = (plan.spacing, curves.count(plan.spacing));
    while low < longest {
        let (high, at_high) = (LONGER * low, curves.count(LONGER * low));
        let may_fit = kept(at_high) as f64 <= MOST_ON_CURVES * most(low, on).max(most(low, at_high));
        if at_high != on && are_few(at_high) && may_fit {
            let level = drop_at([low, high], &|on| on == at_high);
            if level.is_some() {
                return level;
            }
        }
        (low, on) = (high, at_high);
    }
    None
}

/// The first spacing between these at which the counts on curves are past a drop, as those at the second one
/// are; before it, one just below.
fn first_past(
    curves: &SurfaceCurves,
    [mut low, mut high]: [f64; 2],
    is_past: &dyn Fn(CurveCounts) -> bool,
) -> [f64; 2] {
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        if is_past(curves.count(middle)) {
            high = middle;
        } else {
            low = middle;
        }
    }
    [low, high]
}

/// The area of an interior site at this spacing.
fn covered(spacing: f64) -> f64 {
    0.75_f64.sqrt() * spacing * spacing
}

/// `count`, or the least larger count that leaves enough sites besides those on curves.
pub(crate) fn enough(curves: &SurfaceCurves, area: f64, count: usize) -> usize {
    // Each corner has a site, whatever the spacing.
    let least = ((curves.corners.len() + curves.points.len()) as f64 / MOST_ON_CURVES) as usize;
    let count = count.max(least);
    let needed = |n: usize| fitting(curves, area, n).is_some();
    let mut high = count.max(1);
    while !needed(high) && high < usize::MAX / 4 {
        high *= 2;
    }
    let mut low = count.max(high / 2);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if needed(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Whether `count` leaves enough sites besides those on curves, with edges of one length.
pub(crate) fn leaves_enough(curves: &SurfaceCurves, area: f64, count: usize) -> bool {
    fits(&even(curves, area, count))
}

fn fits(plan: &LevelPlan) -> bool {
    plan.interior as f64 >= (1.0 - MOST_ON_CURVES) * plan.sites as f64
}

/// The level of `count` sites, with the spacing at which they, together with those on curves, cover the area
/// evenly.
fn even(curves: &SurfaceCurves, area: f64, count: usize) -> LevelPlan {
    // A site on a boundary covers half the area of an interior one, and one where three sides meet one and a
    // half times.
    let all_cover = |h: f64, on: CurveCounts| {
        let sites = count as f64 - on.sites as f64 + 0.5 * on.sides as f64;
        covered(h) * sites
    };
    let plain = spacing(area, count);
    let (mut low, mut high) = (plain / 64.0, plain * 64.0);
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if all_cover(middle, curves.count(middle)) < area {
            low = middle;
        } else {
            high = middle;
        }
    }
    // From above: the number of curve sites may jump here, and the smaller number leaves more interior sites.
    let points = curves.points.len();
    let kept = curves.count(high).sites + points;
    let interior = count.saturating_sub(kept);
    LevelPlan { sites: interior + kept, interior, is_finest: true, points, spacing: high }
}

/// The level of twice the spacing whose interior sites, with a new one on every edge off the curves, are as
/// many as those of `finer`.
fn coarser(curves: &SurfaceCurves, euler: i64, finer: &LevelPlan) -> Option<LevelPlan> {
    let spacing = 2.0 * finer.spacing;
    let on = curves.count(spacing);
    let [sites, segments, sides] = [on.sites, on.segments, on.sides].map(|count| count as i64);
    // V - E + F = χ, and the sides of F triangles are two for each edge off the curves and `sides` on them,
    // so there are 3 (V - segments - χ) + sides such edges.
    // Where the finer level has points, the coarser one has nothing.
    let finer_interior = (finer.interior + finer.points) as i64;
    let interior = (finer_interior - 3 * (sites - segments - euler) - sides).div_euclid(4);
    let interior = usize::try_from(interior).ok()?;
    let sites = interior + on.sites;
    Some(LevelPlan { sites, interior, is_finest: false, points: 0, spacing })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriMesh;
    use crate::mesh::features::{FeatureOptions, find_features};
    use crate::mesh::samples::sample;
    use crate::mesh::topology::topology;

    fn curves_of(mesh: &TriMesh) -> SurfaceCurves {
        let found = find_features(mesh, &FeatureOptions::new(0.05)).unwrap();
        SurfaceCurves::new(&mesh.vertices, &mesh.triangles, &found).unwrap()
    }

    fn plan(mesh: &TriMesh, count: usize) -> Result<Vec<LevelPlan>> {
        let curves = curves_of(mesh);
        levels(&Extent { area: mesh.area(), euler: topology(mesh).euler, curves: Some(&curves) }, count, 300)
    }

    #[test]
    fn levels_end_with_the_exact_count_and_an_even_spacing() {
        for (name, count) in [("box", 600), ("box", 5000), ("thin-plate", 9999), ("open-hemisphere", 4000)] {
            let mesh = sample(name).unwrap();
            let plans = plan(&mesh, count).unwrap();
            let last = plans.last().unwrap();
            assert_eq!(last.sites, count, "{name}");
            let on = curves_of(&mesh).count(last.spacing);
            assert_eq!(last.interior + on.sites, count, "{name}");
            let evenly = last.interior as f64 + 0.5 * on.sides as f64;
            let ratio = spacing(mesh.area(), 1) / evenly.sqrt() / last.spacing;
            assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
            for pair in plans.windows(2) {
                assert_eq!(pair[0].spacing, 2.0 * pair[1].spacing, "{name}");
                let growth = pair[1].interior as f64 / pair[0].interior as f64;
                assert!((3.5..6.0).contains(&growth), "{name}: {growth}");
                assert!(pair[0].sites >= 300 && 2 * pair[0].interior >= pair[0].sites, "{name}");
            }
        }
    }

    #[test]
    fn a_few_short_curves_do_not_end_the_levels() {
        let mut mesh = sample("box").unwrap();
        let (vertices, size) = (mesh.vertices.clone(), mesh.vertices.len() as u32);
        let spacing = spacing(mesh.area(), 5000);
        // Its twelve edges are half of all curves, and shorter than two spacings.
        let scale = 1.5 * spacing;
        mesh.vertices.extend(vertices.iter().map(|p| *p * scale + 9.0 * glam::DVec3::X));
        mesh.triangles.extend(mesh.triangles.clone().iter().map(|t| t.map(|v| v + size)));
        assert_eq!(curves_of(&mesh).curve_count(), 24);
        let counts: Vec<usize> = plan(&mesh, 5000).unwrap().iter().map(|plan| plan.sites).collect();
        assert!(counts.len() == 2 && (1200..1300).contains(&counts[0]) && counts[1] == 5000, "{counts:?}");
    }

    #[test]
    fn the_count_that_long_curves_need_is_found_at_once() {
        let mut mesh = sample("box").unwrap();
        mesh.vertices.iter_mut().for_each(|p| *p *= glam::DVec3::new(1e6, 1.0, 1e-3));
        let curves = curves_of(&mesh);
        let enough = enough(&curves, mesh.area(), 800);
        let on = |n: usize| 1.0 - even(&curves, mesh.area(), n).interior as f64 / n as f64;
        assert!(enough > 1_000_000 && on(enough) <= MOST_ON_CURVES && on(enough - 1) > MOST_ON_CURVES);
    }

    /// A sheet of squares with curves around each, all of one length.
    fn chequered_sheet(squares: usize) -> (TriMesh, SurfaceCurves) {
        let (cells, row) = (4 * squares, 4 * squares + 1);
        let at = |k: usize| glam::DVec3::new((k % row) as f64, (k / row) as f64, 0.0) / cells as f64;
        let mut mesh = TriMesh { vertices: (0..row * row).map(at).collect(), ..TriMesh::default() };
        let mut options = FeatureOptions::new(0.1 / squares as f64);
        for k in (0..row * row).map(|k| k as u32) {
            let (x, y, row) = (k as usize % row, k as usize / row, row as u32);
            if x < cells && y < cells {
                mesh.triangles.extend([[k, k + 1, k + row], [k + 1, k + row + 1, k + row]]);
            }
            if x < cells && y % 4 == 0 {
                options.user_edges.push([k, k + 1]);
            }
            if y < cells && x % 4 == 0 {
                options.user_edges.push([k, k + row]);
            }
        }
        let found = find_features(&mesh, &options).unwrap();
        let curves = SurfaceCurves::new(&mesh.vertices, &mesh.triangles, &found).unwrap();
        (mesh, curves)
    }

    #[test]
    fn more_sites_never_leave_too_few_for_the_rest() {
        // Where the curves get their second site, far more are on curves than before.
        for (squares, counts, step) in [(4, 30..130, 1), (6, 60..420, 12)] {
            let (mesh, curves) = chequered_sheet(squares);
            let extent = Extent { area: mesh.area(), euler: 1, curves: Some(&curves) };
            let counts: Vec<usize> = counts.step_by(step).collect();
            let alone: Vec<bool> = counts.iter().map(|n| fits(&even(&curves, mesh.area(), *n))).collect();
            assert!(!alone.is_sorted(), "no such case: {alone:?}");
            let found: Vec<bool> = counts.iter().map(|n| levels(&extent, *n, 300).is_ok()).collect();
            assert!(found.is_sorted() && !found[0], "{squares}: {found:?}");
            let first = |list: &[bool]| list.iter().position(|is| *is).unwrap();
            assert!(first(&found) <= first(&alone), "{squares}: {found:?}");
            for (n, alone) in counts.into_iter().zip(alone).skip(first(&found)) {
                let last = *levels(&extent, n, 300).unwrap().last().unwrap();
                let kept = curves.count(last.spacing).sites;
                assert_eq!((last.sites, last.interior + kept), (n, n), "{squares}, {alone}");
            }
        }
    }

    #[test]
    fn too_few_sites_for_the_curves_are_refused_with_a_count_that_does() {
        let mesh = sample("box").unwrap();
        for count in [4, 8, 20] {
            let text = plan(&mesh, count).unwrap_err().to_string();
            let enough: usize =
                text.split("ask for ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
            assert!(plan(&mesh, enough).is_ok() && plan(&mesh, enough - 1).is_err(), "{text}");
        }
    }
}
