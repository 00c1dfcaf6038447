//! A prior of readings that are partly missing, or uneven, by their exact likelihood.
//!
//! Straight lines between readings take high frequencies away, and a periodogram then shows a gas
//! that is smoother than it was. Kalman's filter needs no such lines: what it leads to expect of
//! each reading gives the likelihood of all of them.

use twinlag_optimise::{Budget, Cost, Minimiser, Optimiser, Problem};

use super::Search;
use super::part::{self, Part};
use crate::prior::Prior;
use crate::readings::Readings;
use crate::reconstruct::reconstruct;
use crate::rig::Rig;
use crate::smooth::Form;

/// Samples that the likelihood is taken of, at most: of uneven ones, each of which has a matrix
/// exponential of its own, fewer.
const MAX_EVEN_SAMPLES: usize = 4096;
const MAX_UNEVEN_SAMPLES: usize = 1024;
/// Evaluations of it for each candidate.
const EVALUATIONS_PER_CANDIDATE: u64 = 120;
/// Edge of the first simplex in the logarithm of each number, and the spread of scores below which a
/// fit has ended: a tenth of the least gain that counts.
const SIMPLEX_EDGE_LN: f64 = 0.25;
const SPREAD_TOLERANCE_LN: f64 = 0.05;

/// The likeliest of `found` and each kind of single part, with fitted numbers, allowing for their
/// count.
pub(super) fn choose(
    search: &Search<'_>,
    readings: &Readings,
    rig: &Rig,
    level_c: f64,
    found: Vec<Part>,
    is_uneven: bool,
) -> Vec<Part> {
    let readings = readings.first(if is_uneven { MAX_UNEVEN_SAMPLES } else { MAX_EVEN_SAMPLES });
    let singles = search.best_of_each_kind().into_iter().map(|part| vec![part]);
    let candidates = singles.chain([found.clone()]).map(|parts| {
        let cost = Exact { readings: &readings, rig, level_c, parts: &parts };
        let (parts, deviance) = cost.fit(search);
        let score = deviance + search.cost(&parts);
        (parts, score)
    });
    candidates.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(found, |best| best.0)
}

struct Exact<'a> {
    readings: &'a Readings,
    rig: &'a Rig,
    level_c: f64,
    parts: &'a [Part],
}

impl Exact<'_> {
    fn fit(&self, search: &Search<'_>) -> (Vec<Part>, f64) {
        let values: Vec<f64> = self.parts.iter().flat_map(Part::values).collect();
        let variables = self.parts.iter().flat_map(|p| p.variables(&search.limits)).collect();
        let fit = Problem::new(self, variables).ok().and_then(|problem| {
            let optimiser = Optimiser::NelderMead { spread_tolerance: SPREAD_TOLERANCE_LN, edge: SIMPLEX_EDGE_LN };
            let budget = Budget { evaluations: EVALUATIONS_PER_CANDIDATE, ..Budget::default() };
            optimiser.minimise(&problem, &values, &budget).ok()
        });
        match fit {
            Some(fit) => (part::with(self.parts, &fit.x), fit.value),
            None => (self.parts.to_vec(), self.value(&values)),
        }
    }
}

impl Cost for Exact<'_> {
    fn value(&self, x: &[f64]) -> f64 {
        let terms = part::with(self.parts, x).iter().flat_map(Part::terms).collect();
        let prior = Prior { level_c: self.level_c, terms };
        reconstruct(self.readings, self.rig, &prior, Form::Filter)
            .map_or(f64::INFINITY, |gas| -2.0 * gas.log_likelihood)
    }
}
