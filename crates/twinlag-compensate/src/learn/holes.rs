//! A prior of readings that are partly missing, or uneven, by their exact likelihood.
//!
//! Straight lines between readings take high frequencies away, and a periodogram then shows a gas
//! that is smoother than it was. Kalman's filter needs no such lines: what it leads to expect of
//! each reading gives the likelihood of all of them.

use rayon::prelude::*;
use twinlag_optimise::{Budget, Cost, Minimiser, Optimiser, Problem};

use super::part::{self, Part};
use super::whittle::noise_score;
use super::{Search, noise_factor};
use crate::prior::Prior;
use crate::readings::Readings;
use crate::reconstruct::reconstruct;
use crate::rig::Rig;
use crate::smooth::Form;

/// Samples that the likelihood is taken of, at most: of uneven ones, each of which has a matrix
/// exponential of its own, fewer.
const MAX_EVEN_SAMPLES: usize = 4096;
const MAX_UNEVEN_SAMPLES: usize = 1024;
/// Evaluations of it for each candidate: single parts end before, combs of many lines may use all of them.
const EVALUATIONS_PER_CANDIDATE: u64 = 240;
/// Edge of the first simplex in the logarithm of each number, and the spread of scores below which a
/// fit has ended: a tenth of the least gain that counts.
const SIMPLEX_EDGE_LN: f64 = 0.25;
const SPREAD_TOLERANCE: f64 = 0.05;

/// `found` and each kind of single part, their numbers fitted together with the noise of `found`, where that is one of its parts: with
/// minus twice the logarithm of the probability of the readings, allowing for the count of the numbers. The likeliest is the first.
pub(super) fn choose(
    search: &Search<'_>,
    readings: &Readings,
    rig: &Rig,
    level_c: f64,
    found: Vec<Part>,
    is_uneven: bool,
) -> Vec<(f64, Vec<Part>)> {
    let readings = readings.first(if is_uneven { MAX_UNEVEN_SAMPLES } else { MAX_EVEN_SAMPLES });
    let noise: Vec<Part> = found.iter().filter(|part| part.noise().is_some()).cloned().collect();
    let beside_noise = |part| noise.iter().cloned().chain([part]).collect();
    let singles: Vec<Vec<Part>> = search.best_of_each_kind().into_iter().map(beside_noise).collect();
    let mut candidates = singles;
    candidates.push(found);
    let fitted = candidates.into_par_iter().map(|parts| {
        let (parts, deviance) = Exact { readings: &readings, rig, level_c, parts: &parts }.fit(search);
        (deviance + search.cost(&parts), parts)
    });
    let mut fitted: Vec<(f64, Vec<Part>)> = fitted.collect();
    fitted.sort_by(|a, b| a.0.total_cmp(&b.0));
    fitted
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
            // An optimiser's tolerance is a share of the value at the start, which may be near zero.
            let size = self.value(&values).abs().max(self.readings.len() as f64);
            let spread_tolerance = SPREAD_TOLERANCE / size;
            let optimiser = Optimiser::NelderMead { spread_tolerance, edge: SIMPLEX_EDGE_LN };
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
        let parts = part::with(self.parts, x);
        let prior = Prior { level_c: self.level_c, terms: parts.iter().flat_map(Part::terms).collect() };
        let rig = self.rig.with_noise_times(noise_factor(&parts));
        let of_noise: f64 = parts.iter().filter_map(Part::noise).map(noise_score).sum();
        reconstruct(self.readings, &rig, &prior, Form::Filter)
            .map_or(f64::INFINITY, |gas| of_noise - 2.0 * gas.log_likelihood)
    }
}
