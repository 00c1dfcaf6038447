//! Exact twins of an effect that was found, in numbers: no record distinguishes them, and each is right with time constants of its own.

use twinlag_cross_relation::{Z_975, log_normal_interval_95};
use twinlag_model::{Fitted, Identifier, ModelFit, Twin, Value};

use crate::grade::{Number, RecordScatter};
use crate::judge::Circumstances;
use crate::propagate::variance;

/// An exact twin of an effect, and what the numbers are if it is the cause.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ExactTwin {
    /// The twin.
    pub effect: Identifier,
    /// Its channel, 0 or 1.
    pub channel: usize,
    /// Its parameter.
    pub parameter: Value,
    /// Time constants of both sensors.
    pub time_constants: [Value; 2],
    /// By how much the second of them is the longer one.
    pub difference: Value,
}

/// Twins of effect `index` of the model `last`, whose uncertainty is that of `fit`.
///
/// - `allowed`: effects that may be named
pub(crate) fn exact_twins(index: usize, last: &Fitted, fit: &ModelFit, allowed: &[Identifier]) -> Vec<ExactTwin> {
    let Some(covariance) = &fit.covariance else { return Vec::new() };
    let places: Vec<usize> = (0..2).chain(last.model.range(index)).collect();
    let all = |values: &[f64]| last.model.effects[index].twins(&values[2..], [values[0], values[1]]);
    let here: Vec<f64> = places.iter().map(|place| last.theta[*place]).collect();
    let possible = last.model.twins(index, &last.theta);
    let in_numbers = |(place, twin): (usize, Twin)| {
        let number = |name: &str, unit: &str, of: &dyn Fn(&Twin) -> f64| {
            let value = of(&twin);
            let error = variance(|values| of(&all(values)[place]), &places, &last.theta, covariance).sqrt();
            let standard_error = Some(error).filter(|error| *error > 0.0 && error.is_finite());
            let interval_95 = standard_error.map(|error| [value - Z_975 * error, value + Z_975 * error]);
            Value { name: name.into(), value, standard_error, interval_95, unit: unit.into() }
        };
        let time_constant = |i: usize| {
            let number = number("time_constant", "s", &|twin| twin.time_constants_s[i]);
            let interval_95 = number.standard_error.map(|error| log_normal_interval_95(number.value, error));
            Value { interval_95, ..number }
        };
        ExactTwin {
            effect: twin.effect,
            channel: twin.channel,
            parameter: number(twin.parameter, "1", &|twin| twin.value),
            time_constants: [0, 1].map(time_constant),
            difference: number("difference", "s", &|twin| twin.time_constants_s[1] - twin.time_constants_s[0]),
        }
    };
    let twins = all(&here).into_iter().enumerate();
    twins.filter(|(_, twin)| possible.contains(twin) && allowed.contains(&twin.effect)).map(in_numbers).collect()
}

impl ExactTwin {
    /// Makes the intervals as wide as those of the numbers that they follow from.
    ///
    /// - `parameter`: place of the parameter of the effect among all of the model
    pub(crate) fn widen(&mut self, parameter: usize, fit: &ModelFit, circumstances: &Circumstances<'_>) {
        let basis = circumstances.whole_basis();
        let [one, two] = &mut self.time_constants;
        for (place, value) in [(0, one), (1, two), (parameter, &mut self.parameter)] {
            let between = fit.between.as_ref().and_then(|between| between.parameters[place].as_ref());
            let number = Number {
                value: value.value,
                interval_95: value.interval_95,
                scatter: fit.scatter[place],
                between: RecordScatter::of(between),
                is_positive: place < 2,
            };
            value.interval_95 = number.judged(Vec::new(), &basis, circumstances.policy).1;
        }
    }
}
