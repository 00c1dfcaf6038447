//! Time constants along the record, in flow that changes: a smooth change that both share, or a step; whether their ratio stays.

#[cfg(test)]
pub(crate) mod fixture;
mod local;
mod near;
mod scan;
mod smooth;

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::cost::{Linearised, ResidualCost};
use crate::effect::KnownEffect;
use crate::effect::{Shared, varying};
use crate::error::ModelError;
use crate::fit::{Effort, Fitted};
use crate::fitted::ModelFit;
use crate::known::{Known, KnownNumbers};
use crate::model::Model;
use crate::observations::Observations;
use crate::prepare::Prepared;
use crate::selection::Selection;
use crate::settings::{Settings, Watch, report};
use crate::summary::summarise;
use local::{Curve, Local};
use near::Near;
use scan::Scan;
use smooth::smooth;

/// Times that a step is looked for where the one before was found, and the largest share by which parameters move in one of them.
const STEP_ROUNDS: usize = 6;
const LARGEST_MOVE: f64 = 0.5;
/// Share of the record at either end in which a step is not distinguished from a slope of the
/// start.
const STEP_MARGIN_SHARE: f64 = 0.05;
/// Samples whose time constants are computed at a time.
const SAMPLES_AT_ONCE: usize = 4096;
/// Part of a standard error by which a parameter is moved for derivatives.
const DERIVATIVE_STEP_SE: f64 = 0.01;
/// 95 % point of the evidence against the true instant of a step, `(1 − exp(−x/2))² = 0.95`: the likelihood of instants is a random walk
/// with a drift away from it on either side, and no parabola (Yao 1987, Hansen 2000).
const INSTANT_95: f64 = 7.352_277;

/// How time constants change along a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// No change of the time constants is detected.
    Constant,
    /// Smoothly, with this many coefficients: the effective number of a smoothing spline.
    Smooth(usize),
    /// At one instant.
    Step,
}

/// A step of both time constants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ChangePoint {
    /// When, s.
    pub at_s: f64,
    /// 95 % interval, s: no shorter than a sample.
    pub interval_95_s: [f64; 2],
    /// Time constants after over those before.
    pub factor: f64,
    /// What it takes off `−2 ln L` against constant ones.
    pub evidence: f64,
}

/// Whether the ratio of the time constants stays while they change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RatioTest {
    /// Reduction of `−2 ln L` by a changing ratio.
    pub statistic: f64,
    /// Number of coefficients of the changing ratio.
    pub degrees_of_freedom: usize,
    /// Probability of such a reduction if the ratio is constant.
    pub p_value: f64,
}

/// Time constants along a record.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Track {
    /// How they change.
    pub change: Change,
    /// Sample instants, s.
    pub time_s: Vec<f64>,
    /// Both time constants there, s.
    pub tau_s: [Vec<f64>; 2],
    /// Standard errors of their logarithms; `None` where the record does not determine them.
    pub log_error: Option<[Vec<f64>; 2]>,
    /// The step that explains most, whether or not it is what is taken.
    pub step: Option<ChangePoint>,
    /// Whether the ratio stays.
    pub ratio: RatioTest,
    /// The fit that this is of.
    pub fit: ModelFit,
}

/// Both time constants along `observations`, `effects` in the model as they are: of a shared smooth change, a step and none the one that
/// Schwarz's criterion prefers.
///
/// The smooth change is a smoothing spline: its curvature is white noise beforehand, of the strength under which the record is most
/// likely. So it is determined where the record says little, and its bands hold what smoothing may have left out (Wahba 1983).
///
/// # Errors
/// As [`crate::fit_with`].
pub fn track(
    observations: &Observations,
    settings: &Settings,
    effects: &[KnownEffect],
    watch: Watch<'_>,
) -> Result<Track, ModelError> {
    let others: Vec<KnownEffect> =
        effects.iter().filter(|e| !e.effect.about().changes_time_constants).cloned().collect();
    let Known { prepared, fitted: constant, .. } = Known::of(observations, settings, &others, KnownNumbers::Held)?;
    let has_delay = constant.model.parameters().any(|p| p.is_lateness);
    let selection = if has_delay { prepared.everything.clone() } else { prepared.without_delay() };
    let constant = constant.model.fit(&constant.theta, &prepared.observations, &selection, Effort::Finish);
    let time_s: Vec<f64> = prepared.observations.stretches.iter().flat_map(|s| s.time_s.iter()).collect();
    let search = Tracker { prepared: &prepared, selection: &selection, time_s: &time_s };
    let mut best = (Change::Constant, constant.clone(), score(&constant, 0.0));
    let mut consider = |change: Change, fitted: Fitted, numbers: f64| {
        // Without what is known of its shape, which the others have nothing like.
        let known: f64 = fitted.model.prior_energy(&fitted.theta);
        let data = Fitted { chi2: fitted.chi2 - known, count: constant.count, ..fitted.clone() };
        let score = score(&data, numbers);
        if score < best.2 && fitted.end.is_usable() {
            best = (change, fitted, score);
        }
    };
    let mut local = None;
    if let Some(smooth) = smooth(&search, &constant, watch)? {
        local = smooth.local;
        consider(Change::Smooth(smooth.coefficients.round() as usize), smooth.fitted, smooth.coefficients);
    }
    let step = search.step(&constant, watch)?;
    if let Some((_, fitted)) = &step {
        // Its size, its instant, and the choice of that.
        consider(Change::Step, fitted.clone(), 3.0);
    }
    let (change, fitted, _) = best;
    let ratio = search.ratio(&fitted, local.filter(|_| matches!(change, Change::Smooth(_))));
    let fit = summarise(&fitted, &prepared.observations, &selection, &prepared.levels, &prepared.policy);
    let [tau_s, log_error] = along(&fit, &time_s);
    let is_determined = fit.time_constants.iter().all(|t| t.value_s.is_some()) && fit.covariance.is_some();
    let log_error = is_determined.then_some(log_error);
    Ok(Track { change, time_s, tau_s, log_error, step: step.map(|s| s.0), ratio, fit })
}

/// Both time constants at `time_s`, and the standard errors of their logarithms.
fn along(fit: &ModelFit, time_s: &[f64]) -> [[Vec<f64>; 2]; 2] {
    let mut out: [[Vec<f64>; 2]; 2] = std::array::from_fn(|_| std::array::from_fn(|_| vec![0.0; time_s.len()]));
    let [[tau_1, tau_2], [error_1, error_2]] = &mut out;
    let chunks = |all| <[f64]>::par_chunks_mut(all, SAMPLES_AT_ONCE);
    let numbers = chunks(tau_1).zip(chunks(tau_2)).zip(chunks(error_1).zip(chunks(error_2)));
    time_s.par_chunks(SAMPLES_AT_ONCE).zip(numbers).for_each(|(part, ((tau_1, tau_2), (error_1, error_2)))| {
        let all = part_along(fit, part).into_iter().flatten();
        all.zip([tau_1, tau_2, error_1, error_2]).for_each(|(from, to)| to.copy_from_slice(&from));
    });
    out
}

/// [`along`] at some instants: what each parameter moves there takes as much memory as there are parameters.
fn part_along(fit: &ModelFit, time_s: &[f64]) -> [[Vec<f64>; 2]; 2] {
    let extended = fit.extended.as_ref().expect("a fit of a record");
    let theta = extended.parameters();
    let tau_s = extended.time_constants_s(theta, time_s);
    let nothing = vec![vec![0.0; theta.len()]; theta.len()];
    let covariance = fit.covariance.as_ref().unwrap_or(&nothing);
    let slopes: Vec<[Vec<f64>; 2]> = (0..theta.len())
        .map(|a| {
            let by = DERIVATIVE_STEP_SE * covariance[a][a].max(0.0).sqrt().max(1e-6 * theta[a].abs()).max(1e-9);
            let mut moved = theta.to_vec();
            moved[a] += by;
            let other = extended.time_constants_s(&moved, time_s);
            [0, 1].map(|i| other[i].iter().zip(&tau_s[i]).map(|(b, a)| (b / a).ln() / by).collect())
        })
        .collect();
    let error = [0, 1].map(|i| {
        (0..time_s.len())
            .map(|k| {
                let pairs = (0..slopes.len()).flat_map(|a| (0..slopes.len()).map(move |b| (a, b)));
                let variance: f64 = pairs.map(|(a, b)| slopes[a][i][k] * covariance[a][b] * slopes[b][i][k]).sum();
                variance.max(0.0).sqrt()
            })
            .collect()
    });
    [tau_s, error]
}

/// `−2 ln L`, the level of the noise free, and what the numbers cost.
fn score(fitted: &Fitted, numbers: f64) -> f64 {
    fitted.count * fitted.mean_energy().ln() + numbers * fitted.count.ln()
}

struct Tracker<'a> {
    prepared: &'a Prepared,
    selection: &'a Selection,
    /// Instants of all samples, s.
    time_s: &'a [f64],
}

impl Tracker<'_> {
    fn fit(&self, from: &Fitted, effect: Shared, start: &[f64], effort: Effort) -> Fitted {
        let mut theta = from.theta.clone();
        theta.extend_from_slice(start);
        let model = from.model.with(effect);
        model.fit(&theta, &self.prepared.observations, self.selection, effort)
    }

    /// The instant of a step before a sample, s: between two samples, where it is, there is nothing to see.
    fn instant_s(&self, sample: usize) -> f64 {
        0.5 * (self.time_s[sample.max(1) - 1] + self.time_s[sample])
    }

    /// Whether a spline of `size` coefficients is found as [`Local`] finds it.
    fn is_local(&self, constant: &Fitted, ends_s: [f64; 2], size: usize) -> bool {
        local::is_close(&constant.model, &constant.theta, &self.prepared.observations, self.selection, ends_s, size)
    }

    fn local<'b>(&'b self, model: &'b Model, curves: Vec<Curve>) -> Local<'b> {
        let (observations, time_s) = (&self.prepared.observations, self.time_s);
        Local { model, curves, observations, selection: self.selection, time_s }
    }

    /// The step that takes most off, and the fit with it.
    fn step(&self, constant: &Fitted, watch: Watch<'_>) -> Result<Option<(ChangePoint, Fitted)>, ModelError> {
        let time_s = self.time_s;
        let [first_s, last_s] = self.prepared.observations.ends_s();
        let margin_s = STEP_MARGIN_SHARE * (last_s - first_s);
        let place = |t: f64| time_s.partition_point(|time_s| *time_s < t);
        let within = place(first_s + margin_s)..place(last_s - margin_s);
        let (mut theta, mut change, mut sample) = (constant.theta.clone(), 0.0, usize::MAX);
        for round in 0..STEP_ROUNDS {
            report(watch, "steps", round, STEP_ROUNDS)?;
            let Some(scan) = self.scan(constant, &theta, change, within.clone(), 0.0) else { return Ok(None) };
            let (likeliest, _, by) = &scan.best;
            let largest = change + by[theta.len()];
            for (theta, by) in theta.iter_mut().zip(by) {
                *theta += by.clamp(-LARGEST_MOVE * theta.abs(), LARGEST_MOVE * theta.abs());
            }
            change =
                largest.clamp((1.0 - LARGEST_MOVE) * (1.0 + change) - 1.0, (1.0 + LARGEST_MOVE) * (1.0 + change) - 1.0);
            if std::mem::replace(&mut sample, *likeliest) == *likeliest {
                break;
            }
        }
        let from = Fitted { theta, ..constant.clone() };
        let fit = |sample: usize, effort| self.fit(&from, varying::step(self.instant_s(sample)), &[change], effort);
        let looked = fit(sample, Effort::Look);
        let near = Near::of(self, &looked, sample);
        let at = near.likeliest(sample, &within);
        let fitted = fit(at, Effort::Finish);
        let limit = INSTANT_95 * fitted.mean_energy().max(1.0);
        let n = constant.theta.len();
        let Some(scan) = self.scan(constant, &fitted.theta[..n], fitted.theta[n], within, limit) else {
            return Ok(None);
        };
        let half_s = 0.5 * self.prepared.context.step_s;
        let [low, high] = near.interval(at, &scan, limit);
        let point = ChangePoint {
            at_s: self.instant_s(at),
            interval_95_s: [self.instant_s(low) - half_s, self.instant_s(high) + half_s],
            factor: 1.0 + fitted.theta[n],
            evidence: score(constant, 0.0) - score(&fitted, 0.0),
        };
        Ok(Some((point, fitted)))
    }

    /// How likely a step is at each sample `within`, linearised at these parameters and this change.
    ///
    /// - `limit`: energies that exceed the least by so much are not kept
    fn scan(&self, constant: &Fitted, theta: &[f64], change: f64, within: Range<usize>, limit: f64) -> Option<Scan> {
        let (observations, selection) = (&self.prepared.observations, self.selection);
        let before = constant.model.linearised(theta, observations, selection);
        // Time constants are others all along.
        let changed = constant.model.with(varying::step(f64::NEG_INFINITY));
        let after: Vec<f64> = theta.iter().copied().chain([change]).collect();
        let cost = || ResidualCost::new(&changed, &after, observations, selection);
        // What is in memory as a whole is linearised once.
        let kept = cost().is_kept().then(|| cost().into_linearised(&after, 0));
        let visit_after = |visit: &mut dyn FnMut(&Linearised)| match &kept {
            Some(all) => visit(all),
            None => cost().visit_linearised(&after, visit),
        };
        Scan::of(&before, visit_after, within, limit)
    }

    /// - `curve`: the spline of the fit, where its columns are those of [`Local`]
    fn ratio(&self, fitted: &Fitted, curve: Option<Curve>) -> RatioTest {
        let ends_s = self.prepared.context.ends_s;
        let (effect, start) = (varying::ratio(ends_s), [0.0; varying::RATIO_SIZE]);
        let other = match curve {
            Some(curve) => {
                let model = fitted.model.with(effect);
                let of_ratio = Curve { effect: model.effects.len() - 1, ends_s, of_ratio: true };
                let start: Vec<f64> = fitted.theta.iter().copied().chain(start).collect();
                self.local(&model, vec![curve, of_ratio]).fit(&start)
            }
            None => self.fit(fitted, effect, &start, Effort::Finish),
        };
        let statistic = (score(fitted, 0.0) - score(&other, 0.0)).max(0.0);
        let chi2 = ChiSquared::new(varying::RATIO_SIZE as f64).expect("a positive number of degrees of freedom");
        RatioTest { statistic, degrees_of_freedom: varying::RATIO_SIZE, p_value: chi2.sf(statistic) }
    }
}
