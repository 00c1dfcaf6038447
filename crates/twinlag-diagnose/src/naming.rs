//! The effects that were found, in numbers.

use std::ops::Range;

use twinlag_cross_relation::{Z_975, log_normal_interval_95};
use twinlag_model::{Defect, Derived, Fitted, Identifier, ModelFit, Parameter, Prepared, Shared, Value};
use twinlag_optimise::Scale;

use crate::candidates::is_on_bound;
use crate::diagnosis::{Found, Masked};
use crate::evidence::Evidence;
use crate::first_state::FirstState;
use crate::grade::{Judgement, Number, Reason, RecordScatter};
use crate::joint::OwnNumber;
use crate::judge::Circumstances;
use crate::moves::Taken;
use crate::propagate::variance;
use crate::rapid::RapidVariation;
use crate::remark::to_digits_of;
use crate::twins::ExactTwin;

/// Numbers of an effect whose values are in `range`, and those that follow from them, with the uncertainty that `covariance` gives;
/// `None` gives none.
pub(crate) fn numbers(
    effect: &Shared,
    range: Range<usize>,
    last: &Fitted,
    covariance: Option<&[Vec<f64>]>,
) -> Vec<Value> {
    let pairs = effect.parameters().iter().zip(range.clone());
    let mut out: Vec<Value> = pairs.map(|(p, i)| value(p, last.theta[i], covariance.map(|c| c[i][i]))).collect();
    out.extend(effect.derived().into_iter().map(|d| derived(&d, &last.theta, range.clone(), covariance)));
    out
}

/// Numbers of the model `last` that belong to one of several records, whose uncertainty is that of `fit`.
pub(crate) fn own_numbers(record: usize, last: &Fitted, fit: &ModelFit) -> Vec<OwnNumber> {
    let of_effect = |index: usize| {
        let effect = &last.model.effects[index];
        let own = effect.in_record(record).map(|(own, places)| {
            let first = last.model.range(index).start;
            numbers(&own, first + places.start..first + places.end, last, fit.covariance.as_deref())
        });
        let seat = (effect.identifier(), effect.channel());
        own.unwrap_or_default().into_iter().map(move |number| OwnNumber { effect: seat, number })
    };
    (0..last.model.effects.len()).flat_map(of_effect).collect()
}

/// Effect `index` of the model `last` with its numbers, whose uncertainty is that of `fit`; without those that belong to one of
/// several records.
///
/// - `exact_twins`, `first_state`: of the effect
pub(crate) fn name(
    index: usize,
    taken: &Taken,
    exact_twins: Vec<ExactTwin>,
    first_state: Option<FirstState>,
    (last, fit): (&Fitted, &ModelFit),
) -> Found {
    let effect = &taken.candidate.effect;
    let is_of_records = effect.record_of(0).is_some();
    let parameters = if is_of_records {
        Vec::new()
    } else {
        numbers(effect, last.model.range(index), last, fit.covariance.as_deref())
    };
    let ties = taken.ties.iter().map(|t| t.effect.identifier());
    let mut alternatives: Vec<Identifier> = ties.chain(exact_twins.iter().map(|twin| twin.effect)).collect();
    let is_of_either = alternatives.contains(&effect.identifier());
    alternatives.retain(|other| *other != effect.identifier());
    alternatives.sort_unstable();
    alternatives.dedup();
    Found {
        effect: effect.identifier(),
        channel: effect.channel().filter(|_| !is_of_either),
        fitted_in: effect.channel(),
        judgements: vec![Judgement::default(); parameters.len()],
        parameters,
        evidence: Some(Evidence::of(&taken.candidate)),
        alternatives,
        exact_twins,
        other_causes: Vec::new(),
        first_state,
        seen: is_of_records.then(|| in_each_record(effect, index, (last, fit)).to_owned()),
        masked: Vec::new(),
        is_of_each_record: is_of_records,
        is_in_the_model: true,
    }
}

/// What each record shows of an effect of its own.
fn in_each_record(effect: &Shared, index: usize, (last, fit): (&Fitted, &ModelFit)) -> &'static str {
    let own = numbers(effect, last.model.range(index), last, fit.covariance.as_deref());
    let holds_zero = |rate: &Value| rate.interval_95.is_some_and(|[low, high]| low <= 0.0 && high >= 0.0);
    let mut rates = own.iter().filter(|number| number.name == "drift").peekable();
    let is_offset = effect.identifier() == Identifier::DRIFT && rates.peek().is_some() && rates.all(holds_zero);
    if is_offset {
        "each record has an offset of its own; none shows that it changes within a record"
    } else {
        "each record has numbers of its own"
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
pub(crate) fn interval_95(value: f64, error: f64, scale: &Scale) -> [f64; 2] {
    match scale {
        Scale::Logarithmic => log_normal_interval_95(value, error),
        Scale::Linear { .. } => [value - Z_975 * error, value + Z_975 * error],
    }
}

/// The shortest interval that holds two others.
pub(crate) fn hull(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [one[0].min(other[0]), one[1].max(other[1])]
}

/// A number that follows from the parameters in `range`, its error to first order.
fn derived(derived: &Derived, theta: &[f64], range: Range<usize>, covariance: Option<&[Vec<f64>]>) -> Value {
    let at = &theta[range.clone()];
    let places: Vec<usize> = range.collect();
    let variance = covariance.map(|c| variance(derived.of.as_ref(), &places, theta, c));
    let value = (derived.of)(at);
    let error = variance.map(f64::sqrt).filter(|s| *s > 0.0 && s.is_finite());
    Value {
        name: derived.name.into(),
        value,
        standard_error: error,
        interval_95: error.map(|error| [value - Z_975 * error, value + Z_975 * error]),
        unit: derived.unit.into(),
    }
}

/// A change that is too fast for a model of the whole record, without numbers: its own are those of a stretch.
pub(crate) fn of_rapid(variation: &RapidVariation) -> Found {
    let RapidVariation { taken, ends_s: [from_s, to_s], seen_in, looked_in } = variation;
    let effect = &taken.candidate.effect;
    let [from, to] = [from_s, to_s].map(|t| to_digits_of(to_s - from_s, *t));
    let seen = format!(
        "seen between {from} and {to} s, and in {seen_in} of {looked_in} stretches of the record; it is faster than a model of \
         the whole record can follow, and in none of its numbers"
    );
    Found {
        effect: effect.identifier(),
        channel: effect.channel(),
        fitted_in: effect.channel(),
        parameters: Vec::new(),
        judgements: Vec::new(),
        evidence: Some(Evidence::of(&taken.candidate)),
        alternatives: Vec::new(),
        exact_twins: Vec::new(),
        other_causes: Vec::new(),
        first_state: None,
        seen: Some(seen),
        masked: Vec::new(),
        is_of_each_record: false,
        is_in_the_model: false,
    }
}

/// A defect of the data as an effect, where `last` is the model with all of them.
pub(crate) fn of_defect(defect: &Defect, prepared: &Prepared, last: &ModelFit) -> Found {
    let mut seen = defect.seen.clone();
    if defect.effect == Identifier::QUANTISATION && !accounts_for_the_rest(defect.channel, prepared, last) {
        seen.push_str(", which is a fact of the data and too small for what is left over");
    }
    Found {
        effect: defect.effect,
        channel: Some(defect.channel),
        fitted_in: Some(defect.channel),
        parameters: Vec::new(),
        judgements: Vec::new(),
        evidence: None,
        alternatives: Vec::new(),
        exact_twins: Vec::new(),
        other_causes: Vec::new(),
        first_state: None,
        seen: Some(seen),
        masked: Masked::runs(&defect.masked, &prepared.observations),
        is_of_each_record: false,
        is_in_the_model: true,
    }
}

/// Whether rounding may be what `last` leaves over beyond the noise. The noise level of a coarse channel holds the `q²/12` of
/// its steps already. That rounding errors hang together adds at most as much again: the rest has no more than their energy, over
/// that of the noise.
fn accounts_for_the_rest(channel: usize, prepared: &Prepared, last: &ModelFit) -> bool {
    let rounding_k2 = prepared.levels.step_k[channel].map_or(0.0, |q| q * q / 12.0);
    last.chi2_per_dof - 1.0 <= rounding_k2 / prepared.levels.std_k[channel].powi(2)
}

/// Grades of the parameters of an effect, and their intervals with all that they have to cover.
///
/// - `effect`: its place in the model `last`
/// - `fit`: that model in numbers
pub(crate) fn judge_effect(
    found: &mut Found,
    effect: usize,
    last: &Fitted,
    fit: &ModelFit,
    circumstances: &Circumstances<'_>,
) {
    let (parameters, range) = (last.model.effects[effect].parameters(), last.model.range(effect));
    // What is derived from parameters has no scatter, nor has a noise, which no residual influences alone.
    let scatter = if found.effect.is_noise() { &[][..] } else { &fit.scatter[range.clone()] };
    let is_on_bound = |index: usize| is_on_bound(&parameters[index], range.start + index, last);
    let is_any_on_bound = (0..parameters.len()).any(is_on_bound);
    // Both time constants come first in a model.
    let hidden = |index: usize| {
        Reason::hidden(circumstances.hidden_from_parameters.get(range.start - 2 + index)?, &circumstances.named)
    };
    let basis = circumstances.whole_basis();
    let is_open = !found.alternatives.is_empty() || found.channel != found.fitted_in;
    let cause = is_open.then_some(Reason::Cause { effect: found.effect, channel: found.fitted_in });
    for (index, value) in found.parameters.iter_mut().enumerate() {
        let is_positive = parameters.get(index).is_some_and(|p| p.variable.scale == Scale::Logarithmic);
        if index >= parameters.len() && value.standard_error.is_none() && !found.effect.is_noise() {
            found.judgements[index] = Judgement::reference_point();
            continue;
        }
        let scatter = scatter.get(index).copied().flatten();
        let between = fit.between.as_ref().filter(|_| index < parameters.len());
        let between = RecordScatter::of(between.and_then(|between| between.parameters[range.start + index].as_ref()));
        let Value { standard_error, interval_95, .. } = *value;
        let number = Number { value: value.value, standard_error, interval_95, scatter, between, is_positive };
        let is_delay = parameters.get(index).is_some_and(|p| p.is_lateness);
        let is_part = circumstances.is_total_delay && is_delay;
        let has_others = is_delay && !circumstances.other_delays_s.is_empty();
        let is_bound = if index < parameters.len() { is_on_bound(index) } else { is_any_on_bound };
        let hidden = if index < parameters.len() { hidden(index) } else { (0..parameters.len()).find_map(hidden) };
        let mut own: Vec<Reason> = cause.clone().into_iter().collect();
        own.extend(hidden);
        own.extend(is_part.then_some(Reason::PartOfTotal));
        own.extend(has_others.then(|| Reason::OtherDelays { delays_s: circumstances.other_delays_s.clone() }));
        own.extend(is_bound.then_some(Reason::OnBound));
        (found.judgements[index], value.interval_95) = number.judged(own, &basis, circumstances.policy);
    }
    // What a twin follows from comes first.
    found.exact_twins.iter_mut().for_each(|twin| twin.widen(range.start, last, fit, circumstances));
    found.other_causes.iter_mut().for_each(|other| other.widen(last, fit, circumstances));
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
