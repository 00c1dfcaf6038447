//! The family of the published cost: plain, compensated, normalised, hybrid.
//!
//! These costs have lower minima far out, where the filters' unknown initial state still shows after what was discarded, so
//! without starts of the caller's they begin at the whitened estimate: of several minima the one next to a consistent
//! estimate is the one that is consistent itself.

use twinlag_bias::{Compensated, Hybrid, Noise, Normalised, plain_covariance};
use twinlag_cross_relation::{CrossRelation, Segment};
use twinlag_optimise::{Budget, Evaluations, Fit, MultiStart, Problem};

use crate::error::EstimateError;
use crate::intervals::Intervals;
use crate::levels::Levels;
use crate::objective::{EstimatorCost, Objective};
use crate::task::{Outcome, Task};
use crate::vocabulary::{Estimator, NoiseKnowledge};
use crate::whitened::{Found, find, free_parameters, outcome};

/// Steps of Dinkelbach's iteration, which converges quadratically.
const LEVEL_STEPS: usize = 12;
/// A level that changes by less, relative, has converged.
const LEVEL_TOLERANCE: f64 = 1e-12;
/// Autocovariances of autoregressive noise are carried until they are this share of the variance.
const FORGOTTEN: f64 = 1e-12;

pub(crate) fn estimate<const P: usize>(estimator: Estimator, task: &Task<'_>) -> Result<Outcome, EstimateError> {
    let mut evaluations = Evaluations::default();
    // The whitened fit finds levels and start where they are not given.
    let mut levels = match task.noise {
        NoiseKnowledge::Known { std_k, ar1 } => Levels::given(std_k, ar1),
        NoiseKnowledge::Ratio(ratio) => Levels::given([1.0, ratio], [0.0; 2]),
        NoiseKnowledge::Found(_) => Levels::from_differences(task.readings)?,
    };
    let mut starts = task.starts::<P>();
    let profiles_level = matches!(estimator, Estimator::BiasCompensated | Estimator::Normalised);
    let needs_level = match task.noise {
        NoiseKnowledge::Known { .. } => false,
        NoiseKnowledge::Ratio(_) => !profiles_level,
        NoiseKnowledge::Found(_) => true,
    };
    if starts.is_empty() || needs_level {
        let found: Found<'_, P> = find(task)?;
        evaluations = found.evaluations;
        levels = if needs_level { found.levels } else { levels };
        if starts.is_empty() {
            starts = vec![found.theta.to_vec()];
        }
    }
    let discard = discard(task, &starts[0])?;
    let published = CrossRelation::new(task.readings, discard)?;
    let noise = [noise(levels.std_k[0], levels.ar1[0])?, noise(levels.std_k[1], levels.ar1[1])?];
    let cost = match estimator {
        Estimator::BiasCompensated => EstimatorCost::Compensated(Compensated::new(published, noise)),
        Estimator::Normalised => EstimatorCost::Normalised(Normalised::new(published, noise)),
        Estimator::Hybrid => EstimatorCost::Hybrid(Hybrid::new(published, noise)?),
        _ => EstimatorCost::CrossRelation(published),
    };
    let mut run = |cost: &EstimatorCost<'_>, starts: &[Vec<f64>]| -> Result<Fit, EstimateError> {
        let objective = Objective::<P> { cost, priors: &[] };
        let problem = Problem::new(&objective, task.variables::<P>())?;
        let all = MultiStart::run(&problem, task.minimiser, starts, &Budget::default())?;
        for fit in all.fits() {
            evaluations.values += fit.evaluations.values;
            evaluations.derivatives += fit.evaluations.derivatives;
        }
        Ok(all.best().clone())
    };
    let point = |fit: &Fit| -> [f64; P] { std::array::from_fn(|i| fit.x[i]) };
    let (cost, fit) = match (cost, task.noise) {
        (EstimatorCost::Compensated(cost), NoiseKnowledge::Ratio(_)) => {
            let (cost, fit) = profile_level::<P>(&cost, &starts, &mut run)?;
            levels.std_k = levels.std_k.map(|s| s * cost.level().sqrt());
            (EstimatorCost::Compensated(cost), fit)
        }
        (cost, noise) => {
            let fit = run(&cost, &starts)?;
            if matches!((&cost, noise), (EstimatorCost::Normalised(_), NoiseKnowledge::Ratio(_))) {
                levels.std_k = levels.std_k.map(|s| s * fit.value.max(0.0).sqrt());
            }
            (cost, fit)
        }
    };
    let theta = point(&fit);
    let free = free_parameters::<P>(task);
    let covariance = if task.intervals && fit.end.is_usable() {
        match &cost {
            EstimatorCost::Compensated(c) => c.covariance(&theta, &free, levels.std_k),
            EstimatorCost::Normalised(c) => c.covariance(&theta, &free, levels.std_k),
            EstimatorCost::Hybrid(c) => c.covariance(&theta, &free, levels.std_k),
            EstimatorCost::CrossRelation(c) => plain_covariance(c, &theta, &free, levels.std_k),
            EstimatorCost::Whitened(_) => None,
        }
    } else {
        None
    };
    let intervals = covariance.map(|c| Intervals::quadratic(&theta, &c));
    Ok(outcome(&theta, Some(levels.std_k), levels.ar1, intervals, fit.end, evaluations))
}

/// Level and minimum of the compensated cost when only the ratio of the levels is known: level from the cost at the current
/// estimate, compensate, minimise again (Dinkelbach's iteration). `run` minimises from given starts.
pub fn profile_level<'a, const P: usize>(
    cost: &Compensated<'a>,
    starts: &[Vec<f64>],
    mut run: impl FnMut(&EstimatorCost<'a>, &[Vec<f64>]) -> Result<Fit, EstimateError>,
) -> Result<(Compensated<'a>, Fit), EstimateError> {
    let level_at = |cost: &Compensated<'a>, x: &[f64]| cost.profiled_level::<P>(&std::array::from_fn(|i| x[i]));
    let first = level_at(cost, &starts[0]);
    let mut cost = cost.with_level(first)?;
    let mut from = starts.to_vec();
    let mut steps = 0;
    loop {
        let wrapped = EstimatorCost::Compensated(cost);
        let fit = run(&wrapped, &from)?;
        let EstimatorCost::Compensated(inner) = wrapped else { unreachable!("wrapped above") };
        let level = level_at(&inner, &fit.x);
        let has_converged = (level / inner.level() - 1.0).abs() < LEVEL_TOLERANCE;
        steps += 1;
        if has_converged || steps == LEVEL_STEPS || !fit.end.is_usable() {
            return Ok((inner, fit));
        }
        cost = inner.with_level(level)?;
        from = vec![fit.x];
    }
}

/// Time constants that a filter's unknown initial state is left to decay, 5e-5 of it remaining: after five of them, 0.7 % is left,
/// which biases a record of 2500 samples by 0.15 %, visible below 5 % noise.
pub const SETTLED: f64 = 10.0;

/// Samples to leave out: as asked, or ten times the longest time constant at `start`, at most half of a stretch.
fn discard(task: &Task<'_>, start: &[f64]) -> Result<usize, EstimateError> {
    let longest = task.readings.segments().iter().map(Segment::len).max().unwrap_or(0);
    let settled = (SETTLED * start[0].max(start[1]) / task.readings.mean_step_s()).ceil() as usize;
    let discard = task.discard.unwrap_or(settled.min(longest / 2));
    if discard >= longest { Err(EstimateError::DiscardsAll { discard, longest }) } else { Ok(discard) }
}

/// White noise, or autoregressive noise of first order: `s² φ^l` at lag `l`.
pub fn noise(std_k: f64, ar1: f64) -> Result<Noise, EstimateError> {
    if ar1 == 0.0 {
        return Ok(Noise::white(std_k)?);
    }
    let lags = (FORGOTTEN.ln() / ar1.abs().ln()).ceil() as i32;
    Ok(Noise::coloured((0..=lags).map(|lag| std_k * std_k * ar1.powi(lag)).collect())?)
}
