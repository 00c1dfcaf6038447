//! A fitted model in numbers: time constants with their intervals, tests, and what pictures need.

use twinlag_cross_relation::{CHI2_95, ResidualTest, Z_975, log_normal_interval_95, residual_tests};

use crate::between::between;
use crate::correlation::{autocorrelation, filtered};
use crate::cost::{Linearised, ResidualCost};
use crate::defects::ChannelNoise;
use crate::dense;
use crate::extended::Extended;
use crate::fit::{Effort, Fitted};
use crate::fitted::{ModelFit, TimeConstant};
use crate::influence::Influence;
use crate::lag_pair::{self, LagPair};
use crate::model::MAX_TAU_SPANS;
use crate::observations::Observations;
use crate::policy::Policy;
use crate::residual::Pairs;
use crate::selection::Selection;
use crate::spectrum::Bands;
use crate::trace::Trace;

/// Standard errors from zero beyond which neighbouring readings count as correlated.
const CORRELATED_STANDARD_ERRORS: f64 = 4.0;

/// Whether a time constant is shorter than the samples resolve, or as long as the record. One that is known need not be
/// resolved, and beside it the other may be as short as its interval allows: it is how far one sensor lags behind the other.
pub fn is_unresolved(fitted: &Fitted, observations: &Observations, policy: &Policy) -> bool {
    let is_known = [0, 1].map(|i| fitted.model.knows_of(i));
    let shortest_s = policy.shortest_resolved_periods * observations.step_s();
    let shortest_s = if is_known == [false; 2] { shortest_s } else { 0.0 };
    let seen = shortest_s..longest_resolved_s(observations, policy);
    (0..2).any(|i| !is_known[i] && !seen.contains(&fitted.theta[i]))
}

/// Beyond this a time constant is as good as on the bound of a fit, s.
fn longest_resolved_s(observations: &Observations, policy: &Policy) -> f64 {
    policy.longest_resolved_share * MAX_TAU_SPANS * observations.span_s()
}

/// Whether half or twice a time constant fits as well, the other parameters free: then it is not determined, whatever the curvature
/// at the minimum says, as with two equal sensors. A curvature that is certain to a few per cent is believed where both sensors
/// follow a gas: that of noise alone is certain, and by chance.
fn is_flat(
    fitted: &Fitted,
    observations: &Observations,
    selection: &Selection,
    variance: Option<f64>,
    policy: &Policy,
) -> bool {
    // One that is known ties the other down.
    if (0..2).any(|i| fitted.model.knows_of(i)) {
        return false;
    }
    let tau_s = fitted.theta[0];
    if variance.is_some_and(|v| v.sqrt() < policy.certain_log_std * tau_s)
        && (0..2).all(|i| is_correlated(observations, i))
    {
        return false;
    }
    [1.0 / policy.ridge_factor, policy.ridge_factor].into_iter().any(|factor| {
        let model = fitted.model.clone().holding(0, factor * tau_s);
        let mut theta = fitted.theta.clone();
        // Along the ridge of equal sensors.
        theta[0] = factor * tau_s;
        theta[1] = (fitted.theta[1] + (factor - 1.0) * tau_s).max(0.5 * observations.step_s());
        let other = model.fit(&theta, observations, selection, Effort::Finish);
        other.chi2 - fitted.chi2 < CHI2_95 * fitted.mean_energy().max(1.0)
    })
}

/// Whether neighbouring readings of a channel are correlated, as those of a sensor that lags are. White noise passes once in 30 000: its
/// correlation is normal with the standard error `1/√n`. Each stretch is taken about its own mean, without what is masked.
fn is_correlated(observations: &Observations, channel: usize) -> bool {
    let (mut products, mut squares, mut pairs) = (0.0, 0.0, 0_usize);
    for stretch in &observations.stretches {
        let (y, masked) = (&stretch.reading_c[channel], &stretch.masked[channel]);
        let kept = || y.iter().zip(masked).filter(|(_, masked)| !**masked).map(|(y, _)| *y);
        let mean_c = kept().sum::<f64>() / kept().count().max(1) as f64;
        for k in (1..y.len()).filter(|&k| !masked[k - 1] && !masked[k]) {
            let [before_k, here_k] = [y[k - 1] - mean_c, y[k] - mean_c];
            products += before_k * here_k;
            squares += here_k * here_k;
            pairs += 1;
        }
    }
    products * (pairs as f64).sqrt() > CORRELATED_STANDARD_ERRORS * squares
}

/// Covariance of the parameters: `H⁻¹ B H⁻¹`, `H` half the second derivatives of the energy, `B` the covariance of half its first
/// ones, for white noise or, where the residual is not that, with its own autocorrelation; and that of a mismatch of the gas, of which
/// the record does not say at which sensor it is. Of two lags of one sensor it is
/// that of their sum and of the square of their difference, so that they may be equal.
pub fn covariance(
    fitted: &Fitted,
    observations: &Observations,
    selection: &Selection,
    by_residual: bool,
) -> Option<Vec<Vec<f64>>> {
    let apart = lag_pair::apart(fitted);
    let Fitted { model, theta, .. } = &apart;
    let normal = model.scored_normal_equations(theta, observations, selection, None);
    let mut second = model.second_derivatives(theta, observations, selection, &normal, &[]);
    LagPair::each(model).for_each(|pair| pair.without_slope(&mut second, &normal.slope, theta));
    let inverse = dense::inverse(&second)?;
    let white = normal.slope_covariance;
    let middle = if by_residual {
        let residual = ResidualCost::new(model, &fitted.theta, observations, selection).residuals(&fitted.theta);
        let mut coloured = coloured(&model.linearised(theta, observations, selection), &residual);
        // No less than white noise alone.
        for (a, row) in coloured.iter_mut().enumerate() {
            row[a] = row[a].max(white[a][a]);
        }
        coloured
    } else {
        white
    };
    let mut out = dense::product(&dense::product(&inverse, &middle), &inverse);
    apart.mismatch_covariance(observations, selection).iter().for_each(|other| dense::add(&mut out, other));
    LagPair::each(model).for_each(|pair| pair.covariance_at(&mut out, theta, &fitted.theta));
    Some(out)
}

/// Covariance of half the first derivatives of the energy for noise that is correlated as the residual is: products of the columns
/// with themselves, each filtered by its autocorrelation, under Bartlett's window over the lags in which it remembers.
///
/// - `residual`: where the fit is, which need not be where it was linearised
fn coloured(lin: &Linearised, residual: &[f64]) -> Vec<Vec<f64>> {
    let n = lin.samples.len();
    let lags = (2.0 * (n as f64).sqrt()) as usize;
    let mut kernel = autocorrelation(residual, lags.min(n / 4));
    kernel.iter_mut().enumerate().for_each(|(lag, c)| *c *= 1.0 - lag as f64 / (lags + 1) as f64);
    // A column of another record is zero throughout.
    let is_zero = |column: &[f64]| column.iter().all(|value| *value == 0.0);
    let of_column = |column: &[f64]| if is_zero(column) { Vec::new() } else { filtered(column, &kernel) };
    let filtered: Vec<Vec<f64>> = lin.columns.iter().map(|column| of_column(&column[..n])).collect();
    let of = |a: usize, b: usize| dense::dot(&lin.columns[a][..n], &filtered[b]);
    (0..filtered.len()).map(|a| (0..filtered.len()).map(|b| of(a.max(b), a.min(b))).collect()).collect()
}

/// The fit in numbers: what it leaves over, how certain it is, and what pictures need.
pub fn summarise(
    fitted: &Fitted,
    observations: &Observations,
    selection: &Selection,
    levels: &ChannelNoise,
    policy: &Policy,
) -> ModelFit {
    let Left { tests, chi2_per_dof, trace } = Left::of(fitted, observations, selection, levels, policy);
    let rejects = tests.iter().any(|t| t.can_reject(levels.is_given) && t.p_value < policy.rejection_p_value());
    let covariance = covariance(fitted, observations, selection, rejects);
    let influence = covariance.as_deref().and_then(|c| Influence::of(fitted, observations, selection, c));
    let (time_constants, difference) =
        time_constants(fitted, observations, selection, covariance.as_deref(), influence.as_ref(), policy);
    let scatter = (0..fitted.theta.len()).map(|i| influence.as_ref()?.scatter(&[(i, 1.0)])).collect();
    // What it holds is as long as the record.
    drop(influence);
    let between = between(fitted, observations, selection, rejects);
    ModelFit {
        time_constants,
        difference,
        fit: fitted.report.clone(),
        noise_std_k: fitted.model.noise_std_k(),
        is_noise_of_residual: levels.is_of_residual || fitted.model.noise().is_some(),
        tests,
        rejection_p_value: policy.rejection_p_value(),
        chi2_per_dof,
        is_weighted_by_residual: rejects,
        covariance,
        scatter,
        between,
        extended: Some(Extended::new(fitted, observations)),
        trace,
    }
}

/// What a fit leaves over.
struct Left {
    tests: Vec<ResidualTest>,
    chi2_per_dof: f64,
    trace: Trace,
}

impl Left {
    fn of(
        fitted: &Fitted,
        observations: &Observations,
        selection: &Selection,
        levels: &ChannelNoise,
        policy: &Policy,
    ) -> Self {
        // What is as long as the record goes as soon as it can.
        let mut details = fitted.model.details(&fitted.theta, observations);
        let trace = Trace::of(fitted, &mut details, observations, selection, policy);
        let pairs = Pairs::of(fitted, details, observations, selection);
        let trace = trace.with_bands(&Bands::of(&pairs.residual), observations);
        let mut tests = residual_tests(&pairs.residual, fitted.model.free_count(), levels.log_variance_error());
        let count: usize = pairs.residual.iter().map(Vec::len).sum();
        let dof = count.saturating_sub(fitted.model.free_count()).max(1);
        let chi2_per_dof = pairs.residual.iter().flatten().map(|r| r * r).sum::<f64>() / dof as f64;
        let is_coarse = levels.coarse_step_k().iter().any(Option::is_some);
        tests.extend(crate::residual::tests(fitted, pairs, observations, is_coarse));
        Self { tests, chi2_per_dof, trace }
    }
}

/// Both time constants, and how much the second is later than the first.
fn time_constants(
    fitted: &Fitted,
    observations: &Observations,
    selection: &Selection,
    covariance: Option<&[Vec<f64>]>,
    influence: Option<&Influence<'_>>,
    policy: &Policy,
) -> ([TimeConstant; 2], TimeConstant) {
    let theta = &fitted.theta;
    let variance = |i: usize| covariance.map(|c| c[i][i]);
    // A time constant that the samples do not resolve is on its bound, or as good as there; the other is then a guess as well.
    let unresolved =
        is_unresolved(fitted, observations, policy) || is_flat(fitted, observations, selection, variance(0), policy);
    let both = [0, 1].map(|i| {
        if unresolved && !fitted.model.knows_of(i) {
            return TimeConstant::default();
        }
        let scatter = influence.and_then(|i_of| i_of.scatter(&[(i, 1.0)]));
        let found = TimeConstant { scatter, ..time_constant(theta[i], variance(i), policy) };
        if found.value_s.is_none() && fitted.model.knows_of(1 - i) {
            return at_most(theta[i], variance(i), longest_resolved_s(observations, policy));
        }
        found
    });
    // Where the time constants cannot be distinguished from a delay, the total lag of channel 2 is reported.
    let delay = fitted.model.parameters().position(|p| p.is_lateness);
    let lag: Vec<(usize, f64)> = match delay.filter(|_| unresolved) {
        Some(index) => vec![(0, -1.0), (1, 1.0), (2 + index, 1.0)],
        None => vec![(0, -1.0), (1, 1.0)],
    };
    let value: f64 = lag.iter().map(|(i, s)| s * theta[*i]).sum();
    let variance = covariance
        .map(|c| lag.iter().map(|(i, s)| lag.iter().map(|(j, t)| s * t * c[*i][*j]).sum::<f64>()).sum::<f64>());
    let standard_error_s = standard_error(variance);
    let interval_95_s = standard_error_s.map(|se| [value - Z_975 * se, value + Z_975 * se]);
    let scatter = influence.and_then(|influence| influence.scatter(&lag));
    (both, TimeConstant { value_s: Some(value), standard_error_s, interval_95_s, scatter })
}

/// What is known of a time constant that is as uncertain as it is large, beside one that is known: no value, and an interval,
/// mostly down to nothing. The disagreement is linear in it, so it is itself normal, and not its logarithm.
///
/// - `longest_s`: an interval that reaches further says nothing
fn at_most(value_s: f64, variance: Option<f64>, longest_s: f64) -> TimeConstant {
    let around = standard_error(variance).map(|se| [(value_s - Z_975 * se).max(0.0), value_s + Z_975 * se]);
    TimeConstant { interval_95_s: around.filter(|[_, most_s]| *most_s < longest_s), ..TimeConstant::default() }
}

/// A time constant, whose logarithm is normal. An interval that spans a factor of seven is no estimate; one that is held has none.
fn time_constant(value_s: f64, variance: Option<f64>, policy: &Policy) -> TimeConstant {
    let error_s = standard_error(variance).filter(|se| se / value_s < policy.vague_log_std);
    let is_held = variance == Some(0.0);
    TimeConstant {
        value_s: (error_s.is_some() || is_held).then_some(value_s),
        standard_error_s: error_s,
        interval_95_s: error_s.map(|se| log_normal_interval_95(value_s, se)),
        scatter: None,
    }
}

fn standard_error(variance: Option<f64>) -> Option<f64> {
    variance.filter(|v| v.is_finite() && *v > 0.0).map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use twinlag_signal::Rig;

    use super::*;
    use crate::model::Model;
    use crate::observations::Stretch;
    use crate::prepare::whole_selection;
    use crate::track::fixture;
    use crate::weighting::Weighting;

    const SAMPLES: usize = 4000;
    const PERIOD_S: f64 = 0.01;

    /// Two sensors of 50 ms in a gas that moves so much, with noise of 1 K.
    fn readings(gas_std_k: f64) -> [Vec<f64>; 2] {
        let sensor = |channel| json!({"channel": channel, "time_constant_s": 0.05, "noise": {"std_k": 1.0}});
        let rig: Rig = serde_json::from_value(json!({
            "seed": 1,
            "record": {"samples": SAMPLES, "sample_period_s": PERIOD_S},
            "gas": {"kind": "broadband", "mean_c": 300.0, "std_k": gas_std_k, "corner_hz": 1.0},
            "sensors": [sensor("T1"), sensor("T2")],
        }))
        .expect("a rig");
        let simulated = rig.simulate().expect("a sound rig");
        [simulated.t1_c, simulated.t2_c]
    }

    fn stretch(reading_c: [Vec<f64>; 2]) -> Stretch {
        Stretch::new((0..reading_c[0].len()).map(|k| PERIOD_S * k as f64).collect(), reading_c)
    }

    fn are_correlated(stretches: Vec<Stretch>) -> [bool; 2] {
        let observations = Observations::new(stretches, Some(PERIOD_S)).expect("a record");
        [0, 1].map(|channel| is_correlated(&observations, channel))
    }

    /// A gas that moves as much as the noise correlates neighbours by about a half. Noise is not correlated; nor is it by the lines that
    /// stand for what is masked, nor by another level in another stretch, each of which would give products of neighbours.
    #[test]
    fn noise_alone_is_not_correlated() {
        assert_eq!(are_correlated(vec![stretch(readings(1.0))]), [true; 2]);
        let noise = readings(1e-9);
        assert_eq!(are_correlated(vec![stretch(noise.clone())]), [false; 2]);
        let is_masked = |k: usize| k % 10 == 5;
        let bridged = |y: &Vec<f64>| -> Vec<f64> {
            (0..y.len()).map(|k| if is_masked(k) { 0.5 * (y[k - 1] + y[k + 1]) } else { y[k] }).collect()
        };
        let masked = [0, 1].map(|_| (0..SAMPLES).map(is_masked).collect());
        let bridged = stretch([bridged(&noise[0]), bridged(&noise[1])]);
        assert_eq!(are_correlated(vec![bridged.clone()]), [true; 2], "unmasked, lines are taken for readings");
        assert_eq!(are_correlated(vec![bridged.with_missing(masked)]), [false; 2]);
        let hotter = noise.clone().map(|y| y.iter().map(|c| c + 20.0).collect());
        let mut later = stretch(hotter);
        later.time_s = (0..SAMPLES).map(|k| 100.0 + PERIOD_S * k as f64).collect::<Vec<f64>>().into();
        assert_eq!(are_correlated(vec![stretch(noise), later]), [false; 2]);
    }

    /// Towards long time constants the energy approaches that of readings which nothing follows, and bends the other way.
    #[test]
    fn where_the_energy_has_no_minimum_there_is_no_covariance() {
        let record = fixture::observations(2000, 0.05, |_| 1.0);
        let model = Model::new(&[], [0.05; 2]);
        let selection = whole_selection(&record, &Weighting::default());
        let mut fitted = model.fit(&fixture::TAU_S, &record, &selection, Effort::Finish);
        assert!(covariance(&fitted, &record, &selection, false).is_some());
        fitted.theta = fixture::TAU_S.map(|tau_s| 30.0 * tau_s).to_vec();
        assert_eq!(covariance(&fitted, &record, &selection, false), None);
    }
}
