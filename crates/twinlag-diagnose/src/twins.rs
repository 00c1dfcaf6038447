//! Exact twins of an effect that was found, in numbers: no record distinguishes them, and each is right with time constants of its own.

use twinlag_cross_relation::Z_975;
use twinlag_model::{Fitted, Identifier, ModelFit, Twin, Value};
use twinlag_optimise::Scale;

use crate::grade::{Number, RecordScatter};
use crate::judge::Circumstances;
use crate::naming::interval_95;
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
            let error = variance(|values| of(&all(values)[place]), &places, &last.theta, covariance).sqrt();
            let standard_error = Some(error).filter(|error| *error > 0.0 && error.is_finite());
            Value { name: name.into(), value: of(&twin), standard_error, interval_95: None, unit: unit.into() }
        };
        let mut out = ExactTwin {
            effect: twin.effect,
            channel: twin.channel,
            parameter: number(twin.parameter, "1", &|twin| twin.value),
            time_constants: [0, 1].map(|i| number("time_constant", "s", &|twin| twin.time_constants_s[i])),
            difference: number("difference", "s", &|twin| twin.time_constants_s[1] - twin.time_constants_s[0]),
        };
        out.set_intervals(1.0);
        out
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
        self.set_intervals(factor);
    }

    /// Intervals of so many times the standard errors' own.
    fn set_intervals(&mut self, factor: f64) {
        let set = |number: &mut Value, scale: Scale| {
            number.interval_95 = number.standard_error.map(|error| interval_95(number.value, factor * error, &scale));
        };
        self.time_constants.iter_mut().for_each(|number| set(number, Scale::Logarithmic));
        set(&mut self.parameter, Scale::Linear { typical: 1.0 });
        set(&mut self.difference, Scale::Linear { typical: 1.0 });
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
