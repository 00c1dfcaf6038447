//! Time constants along the record, in flow that changes: a smooth change that both share, or a step; whether their ratio stays.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::diagnosis::ModelFit;
use crate::effect::{Context, Identifier, Shared, varying};
use crate::error::DiagnoseError;
use crate::known::Known;
use crate::model::{Effort, Fitted};
use crate::observations::Observations;
use crate::prepare::Prepared;
use crate::settings::{KnownEffect, Settings, Watch};
use crate::summary::summarise;

/// Coefficients of the shared change that are tried.
const SIZES: [usize; 8] = [3, 5, 8, 12, 16, 20, 26, 32];
/// Numbers more that take nothing off are a change that is well enough described.
const ENOUGH: usize = 2;
/// Instants at which a step is looked for, and times that the best is looked around.
const INSTANTS: usize = 40;
const ROUNDS: usize = 4;
/// Share of the record at either end in which a step is not told from a slope of the start.
const MARGIN: f64 = 0.05;
/// Part of a standard error by which a parameter is moved for derivatives.
const SMALL: f64 = 0.01;
/// 95 % point of chi-square with one degree of freedom.
const CHI2_95: f64 = 3.841_458_820_694_124;

/// How time constants change along a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// They do not, as far as the record tells.
    Constant,
    /// As a spline with this many coefficients.
    Smooth(usize),
    /// At one instant.
    Step,
}

/// A step of both time constants.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatioTest {
    /// What a changing ratio takes off `−2 ln L`.
    pub statistic: f64,
    /// Coefficients that it takes.
    pub degrees_of_freedom: usize,
    /// Chance of that where the ratio stays.
    pub p_value: f64,
}

/// Time constants along a record.
#[derive(Clone, Debug, PartialEq)]
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
/// Schwarz's criterion prefers, the smooth change with as many coefficients as Akaike's prefers, which leaves less of its shape out.
///
/// # Errors
/// As [`crate::fit_with`].
pub fn track(
    observations: &Observations,
    settings: &Settings,
    effects: &[KnownEffect],
    watch: Watch<'_>,
) -> Result<Track, DiagnoseError> {
    let others: Vec<KnownEffect> =
        effects.iter().filter(|e| e.effect != Identifier::VaryingTimeConstant).cloned().collect();
    let Known { prepared, fitted: constant, .. } = Known::of(observations, settings, &others)?;
    let search = Tracker { prepared: &prepared };
    let mut best = (Change::Constant, constant.clone(), score(&constant, 0.0));
    let mut consider = |change: Change, fitted: Fitted, numbers: f64| {
        let score = score(&fitted, numbers);
        if score < best.2 && fitted.end.is_usable() {
            best = (change, fitted, score);
        }
    };
    if let Some((size, fitted)) = search.smooth(&constant, watch) {
        consider(Change::Smooth(size), fitted, size as f64);
    }
    let step = search.step(&constant, watch);
    if let Some((_, fitted)) = &step {
        // Its size, its instant, and the choice of that.
        consider(Change::Step, fitted.clone(), 3.0);
    }
    let (change, fitted, _) = best;
    let ratio = search.ratio(&fitted);
    let fit = summarise(&fitted, &prepared.observations, &prepared.everything, &prepared.levels);
    let time_s: Vec<f64> = prepared.observations.stretches.iter().flat_map(|s| s.time_s.iter().copied()).collect();
    let [tau_s, log_error] = along(&fit, &time_s);
    let is_determined = fit.time_constants.iter().all(|t| t.value_s.is_some()) && fit.covariance.is_some();
    let log_error = is_determined.then_some(log_error);
    Ok(Track { change, time_s, tau_s, log_error, step: step.map(|s| s.0), ratio, fit })
}

/// Both time constants at `time_s`, and the standard errors of their logarithms.
fn along(fit: &ModelFit, time_s: &[f64]) -> [[Vec<f64>; 2]; 2] {
    let extended = fit.extended.as_ref().expect("a fit of a record");
    let theta = extended.parameters();
    let tau_s = extended.time_constants_s(theta, time_s);
    let nothing = vec![vec![0.0; theta.len()]; theta.len()];
    let covariance = fit.covariance.as_ref().unwrap_or(&nothing);
    let slopes: Vec<[Vec<f64>; 2]> = (0..theta.len())
        .map(|a| {
            let by = SMALL * covariance[a][a].max(0.0).sqrt().max(1e-6 * theta[a].abs()).max(1e-9);
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
}

impl Tracker<'_> {
    fn fit(&self, from: &Fitted, effect: Shared, start: &[f64], effort: Effort) -> Fitted {
        let mut theta = from.theta.clone();
        theta.extend_from_slice(start);
        let model = from.model.with(effect);
        model.fit(&theta, &self.prepared.observations, &self.prepared.everything, effort)
    }

    /// The smooth change with the coefficients that Akaike's criterion prefers.
    fn smooth(&self, constant: &Fitted, watch: Watch<'_>) -> Option<(usize, Fitted)> {
        let Context { ends_s, samples, .. } = self.prepared.context;
        let mut best: Option<(f64, usize, Fitted)> = None;
        let mut needless = 0;
        for (done, size) in SIZES.into_iter().enumerate() {
            watch("smooth changes", done, SIZES.len());
            let Some(effect) = varying::of_size(size, ends_s, samples) else { break };
            let fitted = self.fit(constant, effect, &vec![0.0; size], Effort::Finish);
            let score = score(&fitted, 0.0) + 2.0 * size as f64;
            if best.as_ref().is_none_or(|b| score < b.0) {
                best = Some((score, size, fitted));
                needless = 0;
            } else {
                needless += 1;
                if needless == ENOUGH {
                    break;
                }
            }
        }
        best.map(|(_, size, fitted)| (size, fitted))
    }

    /// The step that takes most off, and the fit with it.
    fn step(&self, constant: &Fitted, watch: Watch<'_>) -> Option<(ChangePoint, Fitted)> {
        let [first_s, last_s] = self.prepared.observations.ends_s();
        let span_s = last_s - first_s;
        let mut from_s = first_s + MARGIN * span_s;
        let mut apart_s = (1.0 - 2.0 * MARGIN) * span_s / (INSTANTS - 1) as f64;
        let mut tried: Vec<(f64, Fitted)> = Vec::new();
        for round in 0..ROUNDS {
            watch("steps", round, ROUNDS);
            let instants: Vec<f64> = (0..INSTANTS).map(|k| from_s + k as f64 * apart_s).collect();
            for at_s in instants.into_iter().filter(|t| *t > first_s && *t < last_s) {
                tried.push((at_s, self.fit(constant, varying::step(at_s), &[0.0], Effort::Look)));
            }
            let best_s = tried.iter().min_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2))?.0;
            from_s = best_s - apart_s;
            apart_s *= 2.0 / (INSTANTS - 1) as f64;
            if apart_s < 0.25 * self.prepared.context.step_s {
                break;
            }
        }
        let (at_s, looked) = tried.iter().min_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2))?.clone();
        let fitted = self.fit(constant, varying::step(at_s), &[looked.theta[constant.theta.len()]], Effort::Finish);
        let energy = fitted.mean_energy().max(1.0);
        let within = tried.iter().filter(|t| t.1.chi2 - looked.chi2 < CHI2_95 * energy).map(|t| t.0);
        let half_s = 0.5 * self.prepared.context.step_s;
        let [low, high] = within.fold([at_s, at_s], |[low, high], t| [low.min(t), high.max(t)]);
        let point = ChangePoint {
            at_s,
            interval_95_s: [low - half_s, high + half_s],
            factor: 1.0 + fitted.theta[constant.theta.len()],
            evidence: score(constant, 0.0) - score(&fitted, 0.0),
        };
        Some((point, fitted))
    }

    fn ratio(&self, fitted: &Fitted) -> RatioTest {
        let effect = varying::ratio(self.prepared.context.ends_s);
        let other = self.fit(fitted, effect, &[0.0; varying::RATIO], Effort::Finish);
        let statistic = (score(fitted, 0.0) - score(&other, 0.0)).max(0.0);
        let chi2 = ChiSquared::new(varying::RATIO as f64).expect("a positive number of degrees of freedom");
        RatioTest { statistic, degrees_of_freedom: varying::RATIO, p_value: chi2.sf(statistic) }
    }
}
