//! Exact twins of an effect that was found, in numbers: no record distinguishes them, and each is right with time constants of its own.

use twinlag_cross_relation::Z_975;
use twinlag_model::{Fitted, Identifier, ModelFit, Policy, Twin, Value};
use twinlag_optimise::Scale;

use crate::diagnosis::Found;
use crate::grade::{Number, RecordScatter, further};
use crate::judge::{Circumstances, Judgements};
use crate::naming::interval_95;
use crate::propagate::variance;
use crate::ties::is_known;
use crate::whole_form::cover;

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

/// Twins of effect `index` of the model `last`, whose parameters have this covariance.
///
/// - `allowed`: effects that may be named
pub(crate) fn exact_twins(
    index: usize,
    last: &Fitted,
    covariance: Option<&[Vec<f64>]>,
    allowed: &[Identifier],
) -> Vec<ExactTwin> {
    let Some(covariance) = covariance else { return Vec::new() };
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
        out.set_intervals();
        out
    };
    let twins = all(&here).into_iter().enumerate();
    twins.filter(|(_, twin)| possible.contains(twin) && allowed.contains(&twin.effect)).map(in_numbers).collect()
}

impl ExactTwin {
    /// Makes the intervals wider by as much as those of the numbers that they follow from: the parameter of a twin from that of the
    /// effect alone, and time constants from these as well, by the largest factor.
    ///
    /// - `parameter`: place of the first parameter of the effect among all of the model `last`
    pub(crate) fn widen(&mut self, parameter: usize, last: &Fitted, fit: &ModelFit, circumstances: &Circumstances<'_>) {
        let widening = |place: usize| widening(place, last, fit, circumstances).unwrap_or(1.0);
        let of_parameter = widening(parameter);
        let of_all = [0, 1].map(widening).into_iter().fold(of_parameter, f64::max);
        let [one, two, parameter, difference] = self.numbers();
        for ((number, is_positive), factor) in
            [(one, of_all), (two, of_all), (parameter, of_parameter), (difference, of_all)]
        {
            let value = number.value;
            number.interval_95 =
                number.interval_95.map(|ends| ends.map(|end| further(value, end, factor, is_positive)));
        }
    }

    /// Makes its intervals cover those of the same twin of another form of the effect.
    pub(crate) fn cover(&mut self, mut other: Self) {
        for ((number, _), (other, _)) in self.numbers().into_iter().zip(other.numbers()) {
            other.interval_95.into_iter().for_each(|interval| cover(number, interval));
        }
    }

    fn set_intervals(&mut self) {
        for (number, is_positive) in self.numbers() {
            let scale = if is_positive { Scale::Logarithmic } else { Scale::Linear { typical: 1.0 } };
            number.interval_95 = number.standard_error.map(|error| interval_95(number.value, error, &scale));
        }
    }

    /// All of its numbers, and whether each is positive.
    fn numbers(&mut self) -> [(&mut Value, bool); 4] {
        let [one, two] = &mut self.time_constants;
        [(one, true), (two, true), (&mut self.parameter, false), (&mut self.difference, false)]
    }
}

/// Makes the intervals of both time constants and of their difference cover those under other causes as well, but for a time constant
/// that a record does not determine under one.
pub(crate) fn cover_causes(fit: &mut ModelFit, judgements: &mut Judgements, policy: &Policy, effects: &[Found]) {
    let twins = effects.iter().flat_map(|found| &found.exact_twins);
    let others = effects.iter().flat_map(|found| &found.other_causes).map(|other| (&other.time_constants, None));
    for (time_constants, difference) in twins.map(|twin| (&twin.time_constants, Some(&twin.difference))).chain(others) {
        let ([one, two], [of_one, of_two]) = (&mut fit.time_constants, &mut judgements.time_constants);
        let numbers = [(one, of_one), (two, of_two), (&mut fit.difference, &mut judgements.difference)];
        let of_cause = time_constants.iter().map(Some).chain([difference]);
        for (i, ((number, judgement), of_cause)) in numbers.into_iter().zip(of_cause).enumerate() {
            let Some(of_cause) = of_cause else { continue };
            let is_known = i == 2 || of_cause.standard_error.is_some_and(|e| is_known(of_cause.value, e, policy));
            let other = of_cause.interval_95.filter(|_| is_known);
            if let (Some(interval), Some(other)) = (&mut number.interval_95_s, other) {
                judgement.cover_with(interval, other);
            }
        }
    }
}

/// Factor by which the interval of a number is wider with all that it has to cover; `None` of one without an interval.
pub(crate) fn widening(place: usize, last: &Fitted, fit: &ModelFit, circumstances: &Circumstances<'_>) -> Option<f64> {
    let value = last.theta[place];
    let half = Z_975 * fit.covariance.as_ref()?[place][place].max(0.0).sqrt();
    let between = fit.between.as_ref().and_then(|between| between.parameters[place].as_ref());
    let number = Number {
        value,
        standard_error: None,
        interval_95: (half > 0.0).then_some([value - half, value + half]),
        scatter: fit.scatter[place],
        between: RecordScatter::of(between),
        is_positive: false,
    };
    let [low, high] = number.judged(Vec::new(), &circumstances.whole_basis(), circumstances.policy).1?;
    Some((value - low).max(high - value) / half)
}
