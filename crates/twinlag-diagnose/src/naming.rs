//! The effects that were found, in numbers.

use twinlag_cross_relation::{Z_975, log_normal_interval_95};
use twinlag_model::{Defect, Effort, Fitted, Identifier, ModelFit, Parameter, Policy, Prepared, Value, covariance};
use twinlag_optimise::Scale;

use crate::diagnosis::Found;
use crate::evidence::Evidence;
use crate::moves::Taken;
use crate::remark::Remark;

/// Relative change of an end of an interval that is worth a remark.
const NOTICEABLE: f64 = 1e-3;

/// Effect `index` of the model `last` with its numbers, whose uncertainty is that of `fit`.
pub(crate) fn name(index: usize, taken: &Taken, last: &Fitted, fit: &ModelFit) -> Found {
    let effect = &taken.candidate.effect;
    let covariance = fit.covariance.as_ref().filter(|_| !effect.is_noise());
    let range = last.model.range(index);
    let pairs = effect.parameters().iter().zip(range.clone());
    let mut parameters: Vec<Value> = pairs.map(|(p, i)| value(p, last.theta[i], covariance.map(|c| c[i][i]))).collect();
    parameters.extend(effect.derived().into_iter().map(|d| Value {
        name: d.name.into(),
        value: (d.of)(&last.theta[range.clone()]),
        standard_error: None,
        interval_95: None,
        unit: d.unit.into(),
    }));
    let mut alternatives: Vec<Identifier> = taken.ties.iter().map(|t| t.effect.identifier()).collect();
    let is_of_either = alternatives.contains(&effect.identifier());
    alternatives.retain(|other| *other != effect.identifier());
    alternatives.sort_unstable();
    alternatives.dedup();
    Found {
        effect: effect.identifier(),
        channel: effect.channel().filter(|_| !is_of_either),
        fitted_in: effect.channel(),
        parameters,
        evidence: Some(Evidence::of(&taken.candidate)),
        alternatives,
        seen: None,
    }
}

fn value(parameter: &Parameter, value: f64, variance: Option<f64>) -> Value {
    let error = variance.map(f64::sqrt).filter(|s| *s > 0.0 && s.is_finite());
    Value {
        name: parameter.name.into(),
        value,
        standard_error: error,
        interval_95: error.map(|error| interval_95(value, error, &parameter.variable.scale)),
        unit: parameter.unit.into(),
    }
}

/// The 95 % interval of a value, on the scale on which it was fitted: of a positive one it is a
/// factor either way.
fn interval_95(value: f64, error: f64, scale: &Scale) -> [f64; 2] {
    match scale {
        Scale::Logarithmic => log_normal_interval_95(value, error),
        Scale::Linear { .. } => [value - Z_975 * error, value + Z_975 * error],
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

/// Widens the intervals of both time constants, so that they hold whichever of the tied effects is
/// the right one.
pub(crate) fn widen(
    fit: &mut ModelFit,
    ties: &[(Identifier, &Fitted)],
    prepared: &Prepared,
    policy: &Policy,
) -> Option<Remark> {
    let mut effects = Vec::new();
    for (effect, tie) in ties {
        let (observations, everything) = (&prepared.observations, &prepared.everything);
        let other = tie.model.fit(&tie.theta, observations, everything, Effort::Finish).in_order();
        let Some(covariance) = covariance(&other, observations, everything, false) else { continue };
        for i in 0..2 {
            let (value, error) = (other.theta[i], covariance[i][i].max(0.0).sqrt());
            let Some([low, high]) = &mut fit.time_constants[i].interval_95_s else { continue };
            if error > 0.0 && error < policy.vague_log_std * value {
                let [from, to] = interval_95(value, error, &Scale::Logarithmic);
                if from < (1.0 - NOTICEABLE) * *low || to > (1.0 + NOTICEABLE) * *high {
                    effects.push(*effect);
                }
                (*low, *high) = (low.min(from), high.max(to));
            }
        }
    }
    effects.sort_unstable_by_key(|e| e.name());
    effects.dedup();
    (!effects.is_empty()).then_some(Remark::Widened { effects })
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinlag_optimise::Variable;

    /// Failed: a slow time constant of 147 s had the interval [-496, 791] s.
    #[test]
    fn intervals_of_positive_numbers_are_positive() {
        let positive = Parameter::new("slow_time_constant", "s", Variable::logarithmic("slow", 1.0, 1e4));
        let [low, high] = value(&positive, 147.0, Some(328.0 * 328.0)).interval_95.expect("it has an error");
        assert!(low > 0.0, "{low} {high}");
        // As far as a small error goes, both scales agree.
        let [low, high] = value(&positive, 147.0, Some(0.01)).interval_95.expect("it has an error");
        assert!((low - (147.0 - 0.1 * Z_975)).abs() < 2e-4 && (high - (147.0 + 0.1 * Z_975)).abs() < 2e-4);
        let any = Parameter::new("offset", "K", Variable::linear("offset", 1.0, -10.0, 10.0));
        assert_eq!(value(&any, 1.0, Some(1.0)).interval_95, Some([1.0 - Z_975, 1.0 + Z_975]));
        assert_eq!(value(&any, 1.0, Some(0.0)).interval_95, None);
        assert_eq!(value(&any, 1.0, None).interval_95, None);
    }
}
