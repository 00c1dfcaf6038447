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
    /// Makes the intervals wider by as much as those of the numbers that they follow from: by the largest factor of these.
    ///
    /// - `parameter`: place of the parameter of the effect among all of the model `last`
    pub(crate) fn widen(&mut self, parameter: usize, last: &Fitted, fit: &ModelFit, circumstances: &Circumstances<'_>) {
        let factor = [0, 1, parameter]
            .into_iter()
            .filter_map(|place| widening(place, last, fit, circumstances))
            .fold(1.0, f64::max);
        let [one, two] = &mut self.time_constants;
        for number in [one, two] {
            number.interval_95 =
                number.standard_error.map(|error| log_normal_interval_95(number.value, factor * error));
        }
        for number in [&mut self.parameter, &mut self.difference] {
            let half = number.standard_error.map(|error| factor * Z_975 * error);
            number.interval_95 = half.map(|half| [number.value - half, number.value + half]);
        }
    }
}

/// Factor by which the interval of a number is wider with all that it has to cover; `None` of one without an interval.
fn widening(place: usize, last: &Fitted, fit: &ModelFit, circumstances: &Circumstances<'_>) -> Option<f64> {
    let value = last.theta[place];
    let half = Z_975 * fit.covariance.as_ref()?[place][place].max(0.0).sqrt();
    let between = fit.between.as_ref().and_then(|between| between.parameters[place].as_ref());
    let number = Number {
        value,
        interval_95: (half > 0.0).then_some([value - half, value + half]),
        scatter: fit.scatter[place],
        between: RecordScatter::of(between),
        is_positive: false,
    };
    let [low, high] = number.judged(Vec::new(), &circumstances.whole_basis(), circumstances.policy).1?;
    Some((value - low).max(high - value) / half)
}
