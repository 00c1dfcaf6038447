//! The whitened estimator: levels, fit, levels in the light of the fit, fit again. Where levels
//! were found, their ratio is kept and their size is that of the residual: an estimator assumes
//! that its model is right, and then nothing else determines the size.

use twinlag_cross_relation::{Readings, ScoreVariance, Whitened};
use twinlag_optimise::{End, Evaluations, Fit};

use crate::error::EstimateError;
use crate::fitting::{Minimised, minimise_whitened};
use crate::intervals::{self, Intervals, Minimum};
use crate::levels::Levels;
use crate::starts::{second_lags, starts};
use crate::task::{Outcome, Task};
use crate::vocabulary::{IntervalBasis, NoiseColour, NoiseKnowledge};

/// The fit itself, for whoever goes on from it.
pub(crate) struct Found<'a, const P: usize> {
    pub whitened: Whitened<'a>,
    pub levels: Levels,
    pub theta: [f64; P],
    pub end: End,
    pub evaluations: Evaluations,
}

pub(crate) fn estimate<const P: usize>(task: &Task<'_>) -> Result<Outcome, EstimateError> {
    let found = find::<P>(task)?;
    let free = free_parameters::<P>(task);
    let mut intervals = None;
    if task.intervals && found.end.is_usable() {
        let covariance = found.whitened.covariance(&found.theta, &free, &[f64::INFINITY; P], ScoreVariance::WhiteNoise);
        intervals = covariance.map(|c| {
            let c = intervals::with_level_uncertainty(&found.whitened, &found.theta, &free, &c, &found.levels, &[]);
            let variables = task.variables::<P>();
            let (whitened, theta) = (&found.whitened, found.theta);
            Minimum {
                whitened,
                theta,
                free: &free,
                covariance: &c,
                variables: &variables,
                priors: &[],
                minimiser: task.minimiser,
            }
            .intervals(false)
        });
    }
    Ok(outcome(&found.theta, Some(found.levels.std_k), found.levels.ar1, intervals, found.end, found.evaluations))
}

/// What the search ended with, as an outcome.
pub(crate) fn outcome<const P: usize>(
    theta: &[f64; P],
    noise_std_k: Option<[f64; 2]>,
    noise_ar1: [f64; 2],
    intervals: Option<Intervals>,
    end: End,
    evaluations: Evaluations,
) -> Outcome {
    let second = |i: usize| theta.get(i).copied().filter(|t| *t > 0.0);
    Outcome {
        tau_s: [theta[0], theta[1]],
        second_tau_s: [second(4), second(5)],
        standard_error_s: intervals.map(|i| i.standard_error_s),
        interval_95_s: intervals.map(|i| i.interval_95_s),
        interval_basis: intervals.map_or([IntervalBasis::StandardError; 2], |i| i.basis),
        noise_std_k,
        noise_ar1,
        end,
        evaluations,
    }
}

pub(crate) fn free_parameters<const P: usize>(task: &Task<'_>) -> Vec<usize> {
    let variables = task.variables::<P>();
    (0..P).filter(|&i| variables[i].lower < variables[i].upper).collect()
}

/// Finds levels and time constants.
pub(crate) fn find<'a, const P: usize>(task: &Task<'a>) -> Result<Found<'a, P>, EstimateError> {
    let (first, colour) = match task.noise {
        NoiseKnowledge::Known { std_k, ar1 } => (Levels::given(std_k, ar1), NoiseColour::White),
        NoiseKnowledge::Ratio(ratio) => (Levels::given([1.0, ratio], [0.0; 2]), NoiseColour::White),
        NoiseKnowledge::Found(colour) => (Levels::from_differences(task.readings)?, colour),
    };
    let mut levels = first;
    let mut evaluations = Evaluations::default();
    let mut fitted = fit::<P>(task, &levels, None, &mut evaluations)?;
    for _ in 0..colour.rounds() {
        let best = fitted.all.best();
        if first.given || !best.end.is_usable() {
            break;
        }
        let refined = Levels::refined::<P>(&first, task.readings, task.hold, &point(best), colour);
        if refined.agrees_with(&levels, colour) {
            break;
        }
        levels = refined;
        let from = best.x.clone();
        fitted = fit::<P>(task, &levels, Some(from), &mut evaluations)?;
    }
    let best = fitted.all.best();
    let (theta, end) = (larger_first(point(best)), best.end.clone());
    let mut whitened = fitted.whitened;
    if !matches!(task.noise, NoiseKnowledge::Known { .. }) && end.is_usable() {
        // What is not known of the levels but their ratio, the residual tells best.
        let dof = whitened.terms(&theta).saturating_sub(free_parameters::<P>(task).len()).max(1) as f64;
        let scale = (whitened.evaluate(&theta).value / dof).sqrt();
        levels.std_k = levels.std_k.map(|s| s * scale);
        whitened = whitened.with_noise(levels.std_k)?;
    }
    Ok(Found { whitened, levels, theta, end, evaluations })
}

fn point<const P: usize>(fit: &Fit) -> [f64; P] {
    std::array::from_fn(|i| fit.x[i])
}

/// Two lags in series have no order: the larger one comes first.
fn larger_first<const P: usize>(mut theta: [f64; P]) -> [f64; P] {
    for i in 0..2 {
        if P == 6 && theta[4 + i] > theta[i] {
            theta.swap(i, 4 + i);
        }
    }
    theta
}

fn cost<'a>(readings: &'a Readings, task: &Task<'a>, levels: &Levels) -> Result<Whitened<'a>, EstimateError> {
    let cost = Whitened::new(readings, task.hold, levels.std_k)?;
    if levels.ar1 == [0.0; 2] {
        return Ok(cost);
    }
    Ok(cost.with_autoregression(levels.ar1.map(|phi| vec![phi]))?)
}

fn fit<'a, const P: usize>(
    task: &Task<'a>,
    levels: &Levels,
    from: Option<Vec<f64>>,
    evaluations: &mut Evaluations,
) -> Result<Minimised<'a>, EstimateError> {
    let variables = task.variables::<P>();
    let own = match from {
        Some(x) => vec![x],
        None if P == 6 && task.starts_s.is_empty() => second_order_starts::<P>(task, evaluations)?,
        None => task.starts::<P>(),
    };
    let done =
        minimise_whitened::<P>(cost(task.readings, task, levels)?, &[], &variables, task.minimiser, |objective| {
            if own.is_empty() { starts(objective, task.readings, &variables) } else { own }
        })?;
    for fit in done.all.fits() {
        evaluations.values += fit.evaluations.values;
        evaluations.derivatives += fit.evaluations.derivatives;
    }
    Ok(done)
}

/// Second lags of several sizes beside the first-order fit: one found from a single start may be missed.
fn second_order_starts<const P: usize>(
    task: &Task<'_>,
    evaluations: &mut Evaluations,
) -> Result<Vec<Vec<f64>>, EstimateError> {
    let first_order = Task { second_order: [false; 2], starts_s: Vec::new(), ..*task };
    let found = find::<2>(&first_order)?;
    evaluations.values += found.evaluations.values;
    evaluations.derivatives += found.evaluations.derivatives;
    Ok(second_lags::<P>(&[found.theta[0], found.theta[1], 1.0, 0.0], task.second_order))
}
