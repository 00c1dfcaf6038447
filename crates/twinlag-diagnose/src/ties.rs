//! What explains a record as well as what is named, and what the time constants are then.

use twinlag_model::{Effort, Fitted, Identifier, ModelFit, Policy, Prepared, TimeConstant, Value, covariance};
use twinlag_optimise::Scale;

use crate::candidates::effects_on_bounds;
use crate::grade::further;
use crate::judge::Circumstances;
use crate::naming::{hull, interval_95};
use crate::remark::Remark;
use crate::transfer::EffectInChannel;
use crate::twins::{ExactTwin, widening};
use crate::whole_form::cover;

/// Relative change of an end of an interval that is worth a remark.
const NOTICEABLE: f64 = 1e-3;
/// Share of an interval by which other effects make it longer before the number is one of its cause: half as long again.
const DECISIVE: f64 = 0.5;

/// An effect that explains the record as well as the one that is named.
pub(crate) struct Tie {
    pub(crate) named: EffectInChannel,
    pub(crate) other: EffectInChannel,
    /// Both time constants and their difference if it is the cause.
    numbers: [Option<Estimate>; 3],
    /// Whether the fit with it has ended inside all bounds.
    is_inside_bounds: bool,
}

/// Another effect that explains a record equally well as one that was found, and the time constants if it is the cause.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct OtherCause {
    /// The other effect.
    pub effect: Identifier,
    /// Its channel, 0 or 1; `None` where it is of both.
    pub channel: Option<usize>,
    /// Time constants of both sensors.
    pub time_constants: [Value; 2],
}

impl OtherCause {
    /// Makes its intervals cover those of another form of the same effect.
    pub(crate) fn cover(&mut self, form: &Self) {
        for (number, other) in self.time_constants.iter_mut().zip(&form.time_constants) {
            other.interval_95.into_iter().for_each(|other| cover(number, other));
        }
    }

    /// Makes each of its intervals wider by as much as that of the same time constant of the model `last` is.
    pub(crate) fn widen(&mut self, last: &Fitted, fit: &ModelFit, circumstances: &Circumstances<'_>) {
        for (sensor, number) in self.time_constants.iter_mut().enumerate() {
            let factor = widening(sensor, last, fit, circumstances).unwrap_or(1.0);
            let value = number.value;
            number.interval_95 = number.interval_95.map(|ends| ends.map(|end| further(value, end, factor, true)));
        }
    }
}

struct Estimate {
    value: f64,
    standard_error: f64,
    interval_95: [f64; 2],
}

/// Whether a record determines a time constant under another cause.
pub(crate) fn is_known(time_constant_s: f64, standard_error_s: f64, policy: &Policy) -> bool {
    standard_error_s > 0.0 && standard_error_s < policy.vague_log_std * time_constant_s
}

impl Tie {
    /// By the fit of the whole model with the other effect, which is done once more to the end.
    ///
    /// - `last`: the model with the named one
    pub(crate) fn fitted(
        (named, last): (EffectInChannel, &Fitted),
        other: EffectInChannel,
        fitted: &Fitted,
        prepared: &Prepared,
    ) -> Option<Self> {
        let (observations, everything) = (&prepared.observations, &prepared.everything);
        let fitted = fitted.model.fit(&fitted.theta, observations, everything, Effort::Finish).in_order();
        let fitted = fitted.with_bias_as(last, observations, everything);
        let covariance = covariance(&fitted, observations, everything, false)?;
        Some(Self::of(named, other, &fitted, &covariance))
    }

    /// By a fit of the whole model with the other effect, or with another form of the same, and its covariance.
    pub(crate) fn of(named: EffectInChannel, other: EffectInChannel, fitted: &Fitted, covariance: &[Vec<f64>]) -> Self {
        let theta = &fitted.theta;
        let variance = |i: usize, j: usize| covariance[i][j];
        let estimate = |value: f64, variance: f64, scale: Scale| {
            let standard_error = variance.max(0.0).sqrt();
            Some(Estimate { value, standard_error, interval_95: interval_95(value, standard_error, &scale) })
        };
        let of_difference = variance(0, 0) + variance(1, 1) - 2.0 * variance(0, 1);
        let numbers = [
            estimate(theta[0], variance(0, 0), Scale::Logarithmic),
            estimate(theta[1], variance(1, 1), Scale::Logarithmic),
            estimate(theta[1] - theta[0], of_difference, Scale::Linear { typical: 1.0 }),
        ];
        let is_inside_bounds = fitted.end.is_usable() && effects_on_bounds(fitted).next().is_none();
        Self { named, other, numbers, is_inside_bounds }
    }

    /// By algebra.
    pub(crate) fn exact(named: EffectInChannel, twin: &ExactTwin) -> Self {
        let estimate = |number: &Value| {
            let (standard_error, interval_95) = number.standard_error.zip(number.interval_95)?;
            Some(Estimate { value: number.value, standard_error, interval_95 })
        };
        let [one, two] = &twin.time_constants;
        let numbers = [one, two, &twin.difference].map(estimate);
        Self { named, other: (twin.effect, Some(twin.channel)), numbers, is_inside_bounds: true }
    }

    /// The other cause in numbers; `None` where the record does not determine one of them, where its best fit lies on a bound, and of
    /// another form of the effect that is named.
    pub(crate) fn other_cause(&self, policy: &Policy) -> Option<OtherCause> {
        let [one, two, _] = &self.numbers;
        let number = |estimate: &Option<Estimate>| {
            let known = estimate.as_ref().filter(|e| is_known(e.value, e.standard_error, policy))?;
            let (standard_error, interval_95) = (Some(known.standard_error), Some(known.interval_95));
            Some(Value {
                name: "time_constant".into(),
                value: known.value,
                standard_error,
                interval_95,
                unit: "s".into(),
            })
        };
        let time_constants = [number(one)?, number(two)?];
        let (effect, channel) = self.other;
        (self.is_inside_bounds && self.other != self.named).then_some(OtherCause { effect, channel, time_constants })
    }
}

/// Widens the intervals of both time constants and of their difference, so that they hold whichever of the tied effects is
/// the right one; returns what to say of that, and with which effect alone, in its channel, each of them was right before.
pub(crate) fn widen(
    [one, two]: &mut [TimeConstant; 2],
    difference: &mut TimeConstant,
    ties: &[Tie],
    policy: &Policy,
) -> (Option<Remark>, [Option<EffectInChannel>; 3]) {
    let (mut effects, mut causes) = (Vec::new(), [None; 3]);
    for (i, number) in [one, two, difference].into_iter().enumerate() {
        let Some([low, high]) = number.interval_95_s else { continue };
        for Tie { named, other, numbers, .. } in ties {
            let Some(Estimate { value, standard_error, interval_95 }) = &numbers[i] else { continue };
            let is_determined = if i == 2 { *standard_error > 0.0 } else { is_known(*value, *standard_error, policy) };
            // What the other cause leaves open is right with the named one alone.
            if !is_determined && i < 2 && other != named {
                causes[i] = Some(*named);
            }
            if is_determined {
                let more = (low - interval_95[0]).max(0.0) + (interval_95[1] - high).max(0.0);
                // Another form of the same effect is no other cause.
                if i < 2 && more > NOTICEABLE * value && other != named {
                    effects.push(other.0);
                }
                if more > DECISIVE * (high - low) && other != named {
                    causes[i] = Some(*named);
                }
                number.interval_95_s = number.interval_95_s.map(|widened| hull(widened, *interval_95));
            }
        }
    }
    effects.sort_unstable_by_key(|e| e.name());
    effects.dedup();
    ((!effects.is_empty()).then_some(Remark::Widened { effects }), causes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cause(intervals: [Option<[f64; 2]>; 2]) -> OtherCause {
        let time_constants = intervals.map(|interval_95| Value {
            name: "time_constant".to_owned(),
            value: 1.0,
            standard_error: interval_95.map(|_| 0.1),
            interval_95,
            unit: "s".to_owned(),
        });
        OtherCause { effect: Identifier::DELAY, channel: Some(1), time_constants }
    }

    #[test]
    fn a_cause_in_two_forms_has_the_interval_of_both() {
        let mut found = cause([Some([0.8, 1.2]), Some([0.9, 1.1])]);
        found.cover(&cause([Some([0.9, 1.5]), None]));
        assert_eq!(found.time_constants.map(|number| number.interval_95), [Some([0.8, 1.5]), Some([0.9, 1.1])]);
    }

    /// Of the time constants as found T1 is ± 2 %; with the other cause it is anything within a factor of seven and more.
    #[test]
    fn what_another_cause_leaves_open_is_right_with_the_named_one_alone() {
        let estimate = |value: f64, standard_error: f64| {
            Some(Estimate {
                value,
                standard_error,
                interval_95: interval_95(value, standard_error, &Scale::Logarithmic),
            })
        };
        let named = (Identifier::DELAY, Some(1));
        let tie = |of_one: f64, other| Tie {
            named,
            other,
            numbers: [estimate(1.0, of_one), estimate(3.0, 0.03), None],
            is_inside_bounds: true,
        };
        let found = |ties: &[Tie]| {
            let mut numbers = [TimeConstant::default(); 2];
            for (number, value) in numbers.iter_mut().zip([1.0, 3.0]) {
                number.interval_95_s = Some([0.98 * value, 1.02 * value]);
            }
            let (_, causes) = widen(&mut numbers, &mut TimeConstant::default(), ties, &Policy::default());
            (causes, numbers[0].interval_95_s)
        };
        let second_lag = (Identifier::SECOND_ORDER, Some(0));
        assert_eq!(found(&[tie(0.6, second_lag)]), ([Some(named), None, None], Some([0.98, 1.02])));
        // Another form of the same effect is no other cause, and one that determines T1 there is none either.
        assert_eq!(found(&[tie(0.6, named), tie(0.01, second_lag)]).0, [None; 3]);
    }
}
