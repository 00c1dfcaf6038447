//! The wording of effects, of what is left over, and of what cannot be known.

use statrs::distribution::{ChiSquared, ContinuousCDF};
use twinlag_cross_relation::ResidualTest;
use twinlag_model::{
    Defect, Effect, Effort, Fitted, Identifier, LEFT_OVER, ModelFit, Observations, Selection, Value, Z_975, covariance,
};

use crate::diagnosis::{Evidence, Found, Unexplained};
use crate::search::Tried;

/// Tones of the gas up to which equations are counted.
const FEW_TONES: usize = 4;

/// Effect `index` of the model `last` with its numbers, whose certainty follows from `fit`.
pub(crate) fn name(index: usize, tried: &Tried, ties: &[Tried], last: &Fitted, fit: &ModelFit) -> Found {
    let effect: &dyn Effect = tried.effect.as_ref();
    let covariance = fit.covariance.as_ref().filter(|_| !effect.is_noise());
    let range = last.model.range(index);
    let mut parameters: Vec<Value> = effect
        .parameters()
        .iter()
        .zip(range.clone())
        .map(|(p, i)| {
            let se = covariance.map(|c| c[i][i].sqrt()).filter(|s| *s > 0.0 && s.is_finite());
            let value = last.theta[i];
            Value {
                name: p.name.into(),
                value,
                standard_error: se,
                interval_95: se.map(|se| [value - Z_975 * se, value + Z_975 * se]),
                unit: p.unit.into(),
            }
        })
        .collect();
    parameters.extend(effect.derived().into_iter().map(|d| Value {
        name: d.name.into(),
        value: (d.of)(&last.theta[range.clone()]),
        standard_error: None,
        interval_95: None,
        unit: d.unit.into(),
    }));
    let mut alternatives: Vec<Identifier> = ties.iter().map(|t| t.effect.identifier()).collect();
    let is_of_either = alternatives.contains(&effect.identifier());
    alternatives.retain(|other| *other != effect.identifier());
    alternatives.sort_unstable();
    alternatives.dedup();
    Found {
        effect: effect.identifier(),
        channel: effect.channel().filter(|_| !is_of_either),
        fitted_in: effect.channel(),
        parameters,
        evidence: Some(Evidence {
            statistic: tried.gain,
            dof: tried.added,
            p_value: tail(tried.added, tried.gain),
            held_out_gain_nats: tried.held_out_nats,
            robust_statistic: (!effect.is_noise()).then_some(tried.robust_gain),
        }),
        alternatives,
        seen: None,
    }
}

/// A defect of the data as an effect.
pub(crate) fn of_defect(defect: &Defect) -> Found {
    Found {
        effect: defect.effect,
        channel: Some(defect.channel),
        fitted_in: Some(defect.channel),
        parameters: Vec::new(),
        evidence: None,
        alternatives: Vec::new(),
        seen: Some(defect.seen.clone()),
    }
}

fn tail(dof: usize, statistic: f64) -> f64 {
    ChiSquared::new(dof.max(1) as f64).map_or(1.0, |c| c.sf(statistic.max(0.0)))
}

/// Intervals of both time constants that hold whichever of the tied effects is the right one.
pub(crate) fn widen<'a>(
    fit: &mut ModelFit,
    ties: impl Iterator<Item = &'a Tried>,
    observations: &Observations,
    selection: &Selection,
    remarks: &mut Vec<String>,
) {
    let mut widened = Vec::new();
    for tie in ties {
        let other = tie.fitted.model.fit(&tie.fitted.theta, observations, selection, Effort::Finish).in_order();
        let Some(covariance) = covariance(&other, observations, selection, false) else { continue };
        for i in 0..2 {
            let (value, se) = (other.theta[i], covariance[i][i].max(0.0).sqrt());
            let Some([low, high]) = &mut fit.time_constants[i].interval_95_s else { continue };
            if se > 0.0 && se < 0.5 * value {
                let f = (Z_975 * se / value).exp();
                if value / f < 0.999 * *low || value * f > 1.001 * *high {
                    widened.push(tie.effect.identifier().name());
                }
                (*low, *high) = (low.min(value / f), high.max(value * f));
            }
        }
    }
    widened.sort_unstable();
    widened.dedup();
    if !widened.is_empty() {
        remarks.push(format!(
            "the intervals of the time constants also cover the alternatives ({}), which give different values",
            widened.join(", ")
        ));
    }
}

/// What no record of two sensors reveals, and what this one does not.
///
/// - `tones`: separate tones of the gas, where it has few
pub(crate) fn not_testable(observations: &Observations, tones: Option<usize>) -> Vec<String> {
    let mut out = vec![
        "anything that both sensors share (gain, offset, drift, delay, a second lag, a slow mode, \
         radiation)"
            .to_owned(),
        "crosstalk that replaces part of a reading (it only makes one time constant wrong)".to_owned(),
        "which channel picked up a sinusoid that is also in the gas".to_owned(),
    ];
    if let Some(tones) = tones.filter(|t| (2..=FEW_TONES).contains(t)) {
        let (equations, left) = (2 * tones, 2 * tones - 2);
        out.push(format!(
            "more than {left} numbers beside the time constants (the gas has {tones} tones with an amplitude \
             and a phase each, which are {equations} equations, and the time constants take two of them)"
        ));
    }
    if observations.period_s.is_none() {
        out.push("coloured noise, input mismatch and lines (these need evenly spaced samples)".to_owned());
    }
    out
}

/// What is left, if more than noise is.
pub(crate) fn what_is_left(fit: &ModelFit) -> Option<Unexplained> {
    // Less than noise is no effect: the level of the noise is overestimated.
    let is_less = |t: &ResidualTest| t.test == "total-energy" && t.statistic < 1.0;
    let fails: Vec<&ResidualTest> = fit.tests.iter().filter(|t| t.p_value < LEFT_OVER && !is_less(t)).collect();
    if fails.is_empty() {
        return None;
    }
    let worst_band = fit
        .trace
        .bands
        .iter()
        .max_by(|a, b| ((a[1] - 1.0) * a[2]).total_cmp(&((b[1] - 1.0) * b[2])))
        .copied()
        .unwrap_or([0.0, 1.0, 1.0]);
    let n = fit.trace.residual.len();
    let tenth = (n / 10).max(1);
    let worst_time = fit
        .trace
        .residual
        .chunks(tenth)
        .enumerate()
        .max_by(|a, b| energy(a.1).total_cmp(&energy(b.1)))
        .map(|(i, chunk)| [fit.trace.time_s[i * tenth], fit.trace.time_s[i * tenth + chunk.len() - 1]]);
    let names: Vec<&str> = fails.iter().map(|t| t.test.as_str()).collect();
    let [hz, ratio, _] = worst_band;
    let place = match hz {
        0.0 => "at the lowest frequencies".to_owned(),
        hz if hz < 1e-3 => format!("around {hz:.1e} Hz"),
        hz => format!("around {hz:.4} Hz"),
    };
    let where_most = if ratio > 1.0 {
        format!("; most of the excess lies {place}, {ratio:.2} times the noise there")
    } else {
        String::new()
    };
    Some(Unexplained {
        description: format!("the residual is not noise ({}){where_most}", names.join(", ")),
        band_hz: Some([worst_band[0] / 1.19_f64.sqrt(), worst_band[0] * 1.19_f64.sqrt()]),
        energy_ratio: worst_band[1],
        worst_s: worst_time,
    })
}

fn energy(chunk: &[f64]) -> f64 {
    chunk.iter().map(|r| r * r).sum::<f64>() / chunk.len().max(1) as f64
}
