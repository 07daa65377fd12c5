//! How the work of an attempt is shared among its phases, by estimate: progress is told in these.

use super::coarse_to_fine::levels::LevelPlan;
use crate::progress::CONNECT;
use crate::{Method, Options};

/// Iterations of each level that are left when a run is to come to an end early.
pub(crate) const FEW_ITERATIONS: u32 = 5;
/// Rounds of the polish then.
pub(crate) const FEW_ROUNDS: u32 = 4;

/// What costs how much for each site, in iterations of a site on the CPU: as measured.
const ROUND: f64 = 0.4;
const FIT: f64 = 12.0;
const SPOTS: f64 = 6.0;
const CHECK: f64 = 3.0;
const MEASURE: f64 = 5.0;
/// And for each triangle of the input.
const PREPARE: f64 = 3.0;

/// Fractions at which the phases of an attempt end, and what follows each in a run that comes to an end
/// early.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Shares {
    /// Of preparing.
    pub prepared: f64,
    pub levels: Vec<Share>,
    pub polish: Share,
    pub fit: Share,
    pub spots: Share,
    pub check: Share,
}

/// One phase.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Share {
    pub until: f64,
    /// As [`crate::Progress::to_finish`], from its end.
    pub after: f64,
}

impl Shares {
    /// `iterations` are those of each level; `triangles` those of the input.
    pub fn new(plans: &[LevelPlan], iterations: &[u32], triangles: usize, options: &Options) -> Self {
        let sites = options.vertices as f64;
        let (rounds, fit) = match options.method {
            Method::CoarseToFine => (options.coarse_to_fine.polish_rounds, options.coarse_to_fine.fit),
            Method::AllAtOnce => (0, false),
        };
        let fit = if fit { sites } else { 0.0 };
        let polish = |rounds: u32| sites * ROUND * f64::from(rounds);
        let level = |plan: &LevelPlan, iterations: u32| plan.sites as f64 * (CONNECT + f64::from(iterations));
        // What each takes, and what it takes in a hurry.
        let mut costs: Vec<(f64, f64)> = (plans.iter().zip(iterations))
            .map(|(plan, count)| (level(plan, *count), level(plan, FEW_ITERATIONS.min(*count))))
            .collect();
        costs.extend([
            (polish(rounds), polish(FEW_ROUNDS.min(rounds))),
            (FIT * fit, FIT * fit),
            (SPOTS * fit, 0.0),
            (CHECK * sites, CHECK * sites),
        ]);
        let (prepare, measure) = (PREPARE * triangles as f64, MEASURE * sites);
        let all = prepare + costs.iter().map(|(cost, _)| cost).sum::<f64>() + measure;
        let mut done = prepare;
        let mut hurried = measure + costs.iter().map(|(_, cost)| cost).sum::<f64>();
        // A level is connected whenever its iterations end.
        let connect = plans.iter().map(|plan| CONNECT * plan.sites as f64).chain(std::iter::repeat(0.0));
        let mut shares = costs.into_iter().zip(connect).map(|((cost, in_a_hurry), connect)| {
            done += cost;
            hurried -= in_a_hurry;
            Share { until: done / all, after: (hurried + connect) / all }
        });
        Self {
            prepared: prepare / all,
            levels: shares.by_ref().take(plans.len()).collect(),
            polish: shares.next().unwrap_or_default(),
            fit: shares.next().unwrap_or_default(),
            spots: shares.next().unwrap_or_default(),
            check: shares.next().unwrap_or_default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_rise_and_less_and_less_is_to_follow() {
        let plan = |sites| LevelPlan { sites, interior: sites, spacing: 1.0 };
        let plans = [plan(100), plan(400), plan(1600)];
        let shares = Shares::new(&plans, &[60, 40, 10], 5000, &Options::new(1600));
        assert_eq!(shares.levels.len(), 3);
        let ends = [shares.polish, shares.fit, shares.spots, shares.check];
        let ends: Vec<Share> = shares.levels.iter().copied().chain(ends).collect();
        assert!(shares.prepared > 0.0 && shares.prepared < ends[0].until);
        for pair in ends.windows(2) {
            assert!(pair[0].until < pair[1].until && pair[0].after >= pair[1].after, "{ends:?}");
        }
        assert!(ends[6].until < 1.0 && ends[6].after > 0.0, "measuring follows: {ends:?}");
    }
}
