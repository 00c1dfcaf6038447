//! The family of the published cost: plain, compensated, normalised, hybrid.
//!
//! These costs have lower minima far out, where the filters' unknown initial state still shows
//! after what was discarded, so without starts of the caller's they begin at the whitened estimate:
//! of several minima the one next to a consistent estimate is the one that is consistent itself.

use twinlag_bias::{Compensated, Hybrid, Noise, Normalised, plain_covariance};
use twinlag_cross_relation::{CrossRelation, Segment};
use twinlag_optimise::{Budget, End, Evaluations, Fit, MultiStart, Problem, Variable};

use crate::error::EstimateError;
use crate::fitting::{add, free, sum};
use crate::levels::NoiseLevels;
use crate::objective::{EstimatorCost, Objective};
use crate::outcome::Solved;
use crate::starts::starts as own_starts;
use crate::task::Task;
use crate::vocabulary::{Estimator, NoiseKnowledge};
use crate::whitened::WhitenedFit;

/// Steps of Dinkelbach's iteration, which converges quadratically: from two digits to twelve in
/// three, the rest for starts far off.
const MAX_LEVEL_STEPS: usize = 12;
/// A level that changes by less, relative, has converged: a thousand roundings of its sums.
const LEVEL_TOLERANCE: f64 = 1e-12;
/// Autocovariances of autoregressive noise are carried until they are this share of the variance, a
/// thousand roundings.
const FORGOTTEN_AUTOCOVARIANCE: f64 = 1e-12;
/// Time constants that a filter's unknown initial state is left to decay, 5e-5 of it remaining:
/// after five of them, 0.7 % is left, which biases a record of 2500 samples by 0.15 %, visible
/// below 5 % noise (experiment `bias-vs-noise`).
const DISCARDED_TIME_CONSTANTS: f64 = 10.0;
/// No more of a stretch than this share is left out unasked.
const MAX_DISCARDED_SHARE: f64 = 0.5;

/// Minimises the cost of `estimator` on `task`, `beside` the whitened fit of it where there is one.
pub(crate) fn solve<const P: usize>(
    estimator: Estimator,
    task: &Task<'_>,
    beside: Option<&WhitenedFit<'_, P>>,
) -> Result<Solved<P>, EstimateError> {
    if let Some(prior) = task.known.iter().find(|k| k.std.is_some()) {
        return Err(EstimateError::Unexpected {
            what: "the published family",
            expected: "known values without standard deviation, which only the whitened estimator weighs".into(),
            got: format!("{:?}", prior.parameter),
        });
    }
    let needs_level = match task.noise {
        NoiseKnowledge::Known { .. } => false,
        NoiseKnowledge::Ratio(_) => !matches!(estimator, Estimator::BiasCompensated | Estimator::Normalised),
        NoiseKnowledge::Found(_) => true,
    };
    // The whitened fit finds levels and start where they are not given.
    let is_alone = beside.is_none() && (task.starts_s.is_empty() || needs_level);
    let own = if is_alone { Some(WhitenedFit::<P>::find(task)?) } else { None };
    let whitened = beside.or(own.as_ref());
    let evaluations = whitened.map_or_else(Evaluations::default, |fit| fit.evaluations);
    let (variables, std_k, ar1) = if let Some(fit) = whitened {
        (fit.variables.clone(), fit.whitened.noise_std(), fit.levels.ar1)
    } else {
        let levels = NoiseLevels::of(task)?;
        (task.variables::<P>(levels.std_k[1]), levels.std_k, levels.ar1)
    };
    let starts = match whitened {
        Some(fit) if task.starts_s.is_empty() => vec![fit.fit.x.clone()],
        _ => task.starts::<P>(&variables),
    };
    let discarded = samples_to_discard(task, &starts[0])?;
    let cost = cost(estimator, CrossRelation::new(task.readings, discarded)?, std_k, ar1)?;
    let mut minimum = minimise::<P>(task, cost, &variables, &starts, std_k)?;
    add(&mut minimum.evaluations, evaluations);
    let Minimum { cost, fit, starts, evaluations, std_k } = minimum;
    let theta: [f64; P] = std::array::from_fn(|i| fit.x[i]);
    let is_wanted = task.intervals && fit.end.is_usable();
    let covariance = if is_wanted { covariance(&cost, &theta, &free(&variables), std_k) } else { None };
    Ok(Solved {
        theta,
        covariance,
        noise_std_k: Some(std_k),
        noise_ar1: ar1,
        end: fit.end.clone(),
        fit: Some(fit),
        starts,
        evaluations,
        discarded,
    })
}

/// Where one of these costs ended.
struct Minimum<'a> {
    cost: EstimatorCost<'a>,
    fit: Fit,
    starts: usize,
    evaluations: Evaluations,
    /// Noise levels, with the size that the cost has profiled where only the ratio was known.
    std_k: [f64; 2],
}

/// Minimises from `starts`, the one beside a consistent estimate. Where that is no end, none is
/// looked for elsewhere: a lower minimum far from it is one of the filters' initial states.
fn minimise<'a, const P: usize>(
    task: &Task<'_>,
    cost: EstimatorCost<'a>,
    variables: &[Variable],
    starts: &[Vec<f64>],
    std_k: [f64; 2],
) -> Result<Minimum<'a>, EstimateError> {
    let mut evaluations = Evaluations::default();
    let mut run = |cost: &EstimatorCost<'_>, starts: &[Vec<f64>]| -> Result<Fit, EstimateError> {
        let objective = Objective::<P> { cost, priors: &[] };
        let problem = Problem::new(&objective, variables.to_vec())?;
        let mut all = MultiStart::run(&problem, task.minimiser, starts, &Budget::default())?;
        add(&mut evaluations, sum(all.fits()));
        if all.best().end == End::LimitReached {
            // In the right valley, but rounding keeps a solver that compares values from settling
            // there: from elsewhere it may.
            let own = own_starts(&objective, task.readings, variables, [false; 2]);
            all = MultiStart::run(&problem, task.minimiser, &own, &Budget::default())?;
            add(&mut evaluations, sum(all.fits()));
        }
        Ok(all.best().clone())
    };
    let knows_ratio_alone = matches!(task.noise, NoiseKnowledge::Ratio(_));
    let (cost, fit, size) = match cost {
        EstimatorCost::Compensated(cost) if knows_ratio_alone => {
            let (cost, fit) = profile_level::<P>(&cost, starts, &mut run)?;
            let size = cost.level().sqrt();
            (EstimatorCost::Compensated(cost), fit, size)
        }
        cost => {
            let fit = run(&cost, starts)?;
            let profiles = knows_ratio_alone && matches!(cost, EstimatorCost::Normalised(_));
            let size = if profiles { fit.value.max(0.0).sqrt() } else { 1.0 };
            (cost, fit, size)
        }
    };
    Ok(Minimum { cost, fit, starts: starts.len(), evaluations, std_k: std_k.map(|s| s * size) })
}

/// The cost of `estimator` for noise of levels `std_k` and autoregressive coefficients `ar1`.
fn cost(
    estimator: Estimator,
    published: CrossRelation<'_>,
    std_k: [f64; 2],
    ar1: [f64; 2],
) -> Result<EstimatorCost<'_>, EstimateError> {
    let noise = [noise(std_k[0], ar1[0])?, noise(std_k[1], ar1[1])?];
    Ok(match estimator {
        Estimator::BiasCompensated => EstimatorCost::Compensated(Compensated::new(published, noise)),
        Estimator::Normalised => EstimatorCost::Normalised(Normalised::new(published, noise)),
        Estimator::Hybrid => EstimatorCost::Hybrid(Hybrid::new(published, noise)?),
        _ => EstimatorCost::CrossRelation(published),
    })
}

/// Covariance `[P][P]` of the minimum `theta` of `cost` over the `free` parameters; `None` where it
/// is no minimum.
fn covariance<const P: usize>(
    cost: &EstimatorCost<'_>,
    theta: &[f64; P],
    free: &[usize],
    std_k: [f64; 2],
) -> Option<[[f64; P]; P]> {
    match cost {
        EstimatorCost::Compensated(c) => c.covariance(theta, free, std_k),
        EstimatorCost::Normalised(c) => c.covariance(theta, free, std_k),
        EstimatorCost::Hybrid(c) => c.covariance(theta, free, std_k),
        EstimatorCost::CrossRelation(c) => plain_covariance(c, theta, free, std_k),
        EstimatorCost::Whitened(_) => None,
    }
}

/// Level and minimum of the compensated cost when only the ratio of the levels is known: level from
/// the cost at the current estimate, compensate, minimise again (Dinkelbach's iteration). `run`
/// minimises from given starts.
fn profile_level<'a, const P: usize>(
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
        if has_converged || steps == MAX_LEVEL_STEPS || !fit.end.is_usable() {
            return Ok((inner, fit));
        }
        cost = inner.with_level(level)?;
        from = vec![fit.x];
    }
}

/// Samples to leave out at the start of each stretch: as asked, or [`DISCARDED_TIME_CONSTANTS`] of
/// the longer one at `start`, at most half of the longest stretch.
fn samples_to_discard(task: &Task<'_>, start: &[f64]) -> Result<usize, EstimateError> {
    let longest = task.readings.segments().iter().map(Segment::len).max().unwrap_or(0);
    let settled = (DISCARDED_TIME_CONSTANTS * start[0].max(start[1]) / task.readings.mean_step_s()).ceil() as usize;
    let at_most = (MAX_DISCARDED_SHARE * longest as f64) as usize;
    let discard = task.discard.unwrap_or(settled.min(at_most));
    if discard >= longest { Err(EstimateError::DiscardsAll { discard, longest }) } else { Ok(discard) }
}

/// White noise, or autoregressive noise of first order: `s² φ^l` at lag `l`.
fn noise(std_k: f64, ar1: f64) -> Result<Noise, EstimateError> {
    if ar1 == 0.0 {
        return Ok(Noise::white(std_k)?);
    }
    let lags = (FORGOTTEN_AUTOCOVARIANCE.ln() / ar1.abs().ln()).ceil() as i32;
    Ok(Noise::coloured((0..=lags).map(|lag| std_k * std_k * ar1.powi(lag)).collect())?)
}
