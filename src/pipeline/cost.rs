//! Estimated cost of the phases of an attempt, from which its progress is reported.

use crate::polish::{FEW_FIT_ROUNDS, FEW_ROUNDS, FitOptions};
use crate::progress::CONNECT;
use crate::{Method, Options};

/// Iterations of each level in a run that is to finish early.
pub(crate) const FEW_ITERATIONS: u32 = 5;

/// Costs for each site, relative to one iteration of a site, as measured on the CPU.
const ROUND: f64 = 0.4;
const FIT: f64 = 12.0;
const OUTLIERS: f64 = 6.0;
const CHECK: f64 = 3.0;
const MEND: f64 = 1.0;
const MEASURE: f64 = 5.0;
/// Cost for each triangle of the input.
const PREPARE: f64 = 3.0;

/// Fractions of an attempt's cost at which its phases end.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct AttemptCost {
    /// At the end of the preparation.
    pub prepared: f64,
    pub levels: Vec<PhaseCost>,
    pub polish: PhaseCost,
    pub fit: PhaseCost,
    pub outliers: PhaseCost,
    pub check: PhaseCost,
    pub mend: PhaseCost,
}

/// Work on one level.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LevelWork {
    pub sites: usize,
    pub iterations: u32,
}

/// Fractions of an attempt's cost around the end of a phase.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct PhaseCost {
    /// At the end of the phase.
    pub until: f64,
    /// Of what follows the phase if the run is to finish early, as [`crate::Progress::to_finish`].
    pub after: f64,
}

impl AttemptCost {
    /// `triangles` are those of the input.
    pub fn new(levels: &[LevelWork], triangles: usize, options: &Options, vertices: usize) -> Self {
        let sites = vertices as f64;
        let (rounds, fit) = match options.method {
            Method::CoarseToFine => (options.coarse_to_fine.polish_rounds, options.coarse_to_fine.fit),
            Method::AllAtOnce => (0, false),
        };
        let fit = if fit { sites } else { 0.0 };
        let mends = options.method == Method::CoarseToFine && options.coarse_to_fine.min_angle > 0.0;
        let mend = if mends { MEND * sites } else { 0.0 };
        let polish = |rounds: u32| sites * ROUND * f64::from(rounds);
        let level =
            |level: &LevelWork, iterations: u32| level.sites as f64 * (CONNECT + f64::from(iterations));
        // The cost of each phase, and its cost in a run that is to finish early.
        let mut costs: Vec<(f64, f64)> = (levels.iter())
            .map(|l| (level(l, l.iterations), level(l, FEW_ITERATIONS.min(l.iterations))))
            .collect();
        costs.extend([
            (polish(rounds), polish(FEW_ROUNDS.min(rounds))),
            (FIT * fit, FIT * fit * f64::from(FEW_FIT_ROUNDS) / f64::from(FitOptions::default().rounds)),
            (OUTLIERS * fit, 0.0),
            (CHECK * sites, CHECK * sites),
            (mend, 0.0),
        ]);
        let (prepare, measure) = (PREPARE * triangles as f64, MEASURE * sites);
        let total = prepare + costs.iter().map(|(cost, _)| cost).sum::<f64>() + measure;
        let mut until = prepare;
        let mut after = measure + costs.iter().map(|(_, cost)| cost).sum::<f64>();
        // A level is always connected, however few its iterations are.
        let connect = levels.iter().map(|level| CONNECT * level.sites as f64).chain(std::iter::repeat(0.0));
        let mut phases = costs.into_iter().zip(connect).map(|((cost, early_cost), connect)| {
            until += cost;
            after -= early_cost;
            PhaseCost { until: until / total, after: (after + connect) / total }
        });
        Self {
            prepared: prepare / total,
            levels: phases.by_ref().take(levels.len()).collect(),
            polish: phases.next().unwrap_or_default(),
            fit: phases.next().unwrap_or_default(),
            outliers: phases.next().unwrap_or_default(),
            check: phases.next().unwrap_or_default(),
            mend: phases.next().unwrap_or_default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_rise_and_less_and_less_follows() {
        let levels =
            [(100, 60), (400, 40), (1600, 10)].map(|(sites, iterations)| LevelWork { sites, iterations });
        let cost = AttemptCost::new(&levels, 5000, &Options::new(1600), 1600);
        assert_eq!(cost.levels.len(), 3);
        let ends = [cost.polish, cost.fit, cost.outliers, cost.check, cost.mend];
        let ends: Vec<PhaseCost> = cost.levels.iter().copied().chain(ends).collect();
        assert!(cost.prepared > 0.0 && cost.prepared < ends[0].until);
        for pair in ends.windows(2) {
            assert!(pair[0].until < pair[1].until && pair[0].after >= pair[1].after, "{ends:?}");
        }
        assert!(ends[6].until < 1.0 && ends[6].after > 0.0, "measuring follows: {ends:?}");
    }
}
