//! What each value of the first time constant would make of the record.
//!
//! Two sensors of which nothing is known determine how much one lags behind the other long before they determine both time
//! constants. With one of them known nearly every record determines the other. So where the record alone does not, the first is
//! held at each value of a grid, everything else is fitted again with the effects that were found, and the likelihood says which
//! of the values the record excludes.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use twinlag_cross_relation::CHI2_95;
use twinlag_model::{
    Effort, Fitted, Identifier, KnownTimeConstant, Observations, Policy, TimeConstant, Value, summarise,
};

use crate::candidates::effects_on_bounds;
use crate::grade::{Basis, Grade, Judgement, Reason, excess};
use crate::judge::Circumstances;
use crate::moves::{State, Taken};
use crate::naming::name;

/// The shortest value, in sample periods: a thermistor of half a second that is read every ten or twenty.
const SHORTEST_STEPS: f64 = 0.02;
/// Values of the grid: four for each decade from a fiftieth of a sample period to a tenth of a record of a thousand samples, less
/// of a longer one. Chosen, each costs a fit.
const POINTS: usize = 15;
/// The ends of an interval of the other time constant are within this factor where a value settles it: a factor of two either way.
/// Of noise alone chance makes wider ones. Chosen.
const SETTLED_FACTOR: f64 = 4.0;
/// The other time constant where a fit begins is no less than this, in sample periods.
const SHORTEST_START_STEPS: f64 = 0.05;

/// What each value of the first time constant would make of the record, where the record alone does not determine both; `Channel`
/// is the place of a channel, 0 or 1, or its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct IfKnown<Channel = usize> {
    /// The channel whose time constant is held.
    pub held: Channel,
    /// The channel whose time constant is fitted.
    pub fitted: Channel,
    /// The energy of the residual per degree of freedom with both free: the unit of every deviance, if it is above 1.
    pub chi2_per_dof: f64,
    /// Each value, from the shortest to the longest.
    pub values: Vec<Held<Channel>>,
}

/// The record with one time constant held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Held<Channel = usize> {
    /// The value, s.
    pub time_constant_s: f64,
    /// The time constant of the other sensor: without a value, but mostly with an interval, where it is not determined.
    pub other: TimeConstant,
    /// The time constant of the second channel less that of the first; without a value where the other one may not be used.
    pub difference: TimeConstant,
    /// The effects with their parameters.
    pub effects: Vec<HeldEffect<Channel>>,
    /// Root mean square of what the gas temperature differs from the reading of the faster sensor, K.
    #[serde(rename = "gas_change_K")]
    pub gas_change_k: f64,
    /// How much larger `−2 ln L` is than that of the best value, the energy of the residual its unit.
    pub deviance: f64,
    /// Whether the record excludes the value: a deviance beyond the 95 % point of chi-square with one degree of freedom. `None`
    /// where what is left over is not noise: an effect that was not found might account for it, and allow any value.
    pub is_excluded: Option<bool>,
    /// Whether the time constant of the other sensor may be used if this value is right.
    #[serde(default, flatten)]
    pub judgement: Judgement,
}

/// An effect that was found, with its parameters where a time constant is held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct HeldEffect<Channel = usize> {
    /// The effect.
    pub effect: Identifier,
    /// The channel to which the parameters refer; `None` if they refer to both.
    pub channel: Option<Channel>,
    /// Parameters of the effect.
    pub parameters: Vec<Value>,
}

impl IfKnown {
    /// Whether `difference` holds whichever of the values is the right one: that of each value that the record allows lies in
    /// its interval, and there is one.
    pub(crate) fn holds(&self, difference: &TimeConstant) -> bool {
        let Some([low, high]) = difference.interval_95_s else { return false };
        let allowed = self.values.iter().filter(|held| held.is_excluded != Some(true));
        let values_s: Vec<f64> = allowed.filter_map(|held| held.difference.value_s).collect();
        !values_s.is_empty() && values_s.iter().all(|value_s| low <= *value_s && *value_s <= high)
    }

    /// What each value would make of the record, with the names of the channels.
    pub fn named(&self, channels: &[String; 2]) -> IfKnown<String> {
        let of_effect = |e: &HeldEffect| HeldEffect {
            effect: e.effect,
            channel: e.channel.map(|i| channels[i].clone()),
            parameters: e.parameters.clone(),
        };
        let of_value = |held: &Held| Held {
            time_constant_s: held.time_constant_s,
            other: held.other,
            difference: held.difference,
            effects: held.effects.iter().map(of_effect).collect(),
            gas_change_k: held.gas_change_k,
            deviance: held.deviance,
            is_excluded: held.is_excluded,
            judgement: held.judgement.clone(),
        };
        IfKnown {
            held: channels[self.held].clone(),
            fitted: channels[self.fitted].clone(),
            chi2_per_dof: self.chi2_per_dof,
            values: self.values.iter().map(of_value).collect(),
        }
    }
}

/// The values of the grid, s: up to the longest time constant that is given.
fn grid_s(observations: &Observations, policy: &Policy) -> Vec<f64> {
    let shortest_s = SHORTEST_STEPS * observations.step_s();
    let longest_s = policy.longest_given_share * observations.span_s();
    (0..POINTS).map(|i| shortest_s * (longest_s / shortest_s).powf(i as f64 / (POINTS - 1) as f64)).collect()
}

/// What each value of the first time constant would make of the record; `None` where one was known beforehand, and where none of
/// the values that the record allows would give the other.
///
/// - `free`: the model with the effects, both time constants free
/// - `chi2_per_dof`: what it leaves over
/// - `is_whole`: whether that is noise
pub(crate) fn if_known(
    free: &Fitted,
    chi2_per_dof: f64,
    is_whole: bool,
    state: &State<'_>,
    policy: &Policy,
) -> Option<IfKnown> {
    if (0..2).any(|i| free.model.knows_of(i)) {
        return None;
    }
    let grid_s = grid_s(&state.prepared.observations, policy);
    // From where the free fit is outwards, each from its neighbour.
    let middle = grid_s.partition_point(|tau_s| *tau_s < free.theta[0]);
    let (below, above) = grid_s.split_at(middle);
    let (mut fits, fits_above) =
        rayon::join(|| along(below.iter().rev(), free, state), || along(above.iter(), free, state));
    fits.reverse();
    fits.extend(fits_above);
    let best = fits.iter().fold(free.chi2, |best, f| best.min(f.chi2));
    let unit = free.mean_energy().max(1.0);
    let values = grid_s.par_iter().zip(&fits).map(|(tau_s, fitted)| {
        let deviance = (fitted.chi2 - best) / unit;
        let is_excluded = is_whole.then_some(deviance > CHI2_95);
        let mut out = Held { deviance, is_excluded, ..held(*tau_s, fitted, state, policy) };
        if is_excluded == Some(true) {
            let what = format!("T1 = {tau_s:.2e} s");
            out.judgement =
                Judgement::of(&[Reason::Contradicted { what, deviations: deviance.sqrt(), grade: Grade::NoGo }]);
        }
        if out.judgement.grade == Grade::NoGo {
            out.difference = TimeConstant::default();
            // An upper limit without a value stays.
            out.other = Some(out.other).filter(|other| other.value_s.is_none()).unwrap_or_default();
        }
        out
    });
    let values: Vec<Held> = values.collect();
    let settles = |v: &Held| {
        let is_narrow = v.other.interval_95_s.is_some_and(|[low, high]| high < SETTLED_FACTOR * low);
        v.judgement.grade != Grade::NoGo && is_narrow
    };
    values.iter().any(settles).then_some(IfKnown { held: 0, fitted: 1, chi2_per_dof, values })
}

/// Fits with the first time constant held at each value in turn.
fn along<'a>(values_s: impl Iterator<Item = &'a f64>, free: &Fitted, state: &State<'_>) -> Vec<Fitted> {
    let (observations, everything) = (&state.prepared.observations, &state.prepared.everything);
    let (pieces, of_pieces) = state.prepared.excerpt();
    let mut theta = free.theta.clone();
    values_s
        .map(|tau_s| {
            let model = free.model.clone().holding(0, *tau_s);
            let shortest_s = SHORTEST_START_STEPS * observations.step_s();
            // The other stays, or the difference does.
            let starts = [theta[1], theta[1] + tau_s - theta[0]].map(|other_s| {
                let mut start = theta.clone();
                (start[0], start[1]) = (*tau_s, other_s.max(shortest_s));
                start
            });
            let fits = starts.map(|start| model.fit(&start, &pieces, &of_pieces, Effort::Look));
            let [one, other] = &fits;
            let start = if one.chi2 < other.chi2 { one } else { other };
            let fitted = model.fit(&start.theta, observations, everything, Effort::Compare);
            theta.clone_from(&fitted.theta);
            fitted
        })
        .collect()
}

/// A fit in numbers, compared with no other.
fn held(tau_s: f64, fitted: &Fitted, state: &State<'_>, policy: &Policy) -> Held {
    let prepared = &state.prepared;
    let mut fit = summarise(fitted, &prepared.observations, &prepared.everything, &prepared.levels, policy);
    let known = [KnownTimeConstant { sensor: 0, value_s: tau_s, std_s: None }];
    let mut basis = Basis::of(excess(&fit, fitted.model.noise().is_some()), true, policy);
    basis.reasons.extend(effects_on_bounds(fitted));
    let judgements = Circumstances::new(basis, &known, prepared.observations.span_s(), policy).judge(&mut fit);
    let [_, judgement] = judgements.time_constants;
    if judgements.difference.grade == Grade::NoGo {
        fit.difference = TimeConstant::default();
    }
    let of_effect = |(index, taken): (usize, &Taken)| {
        let found = name(index, taken, Vec::new(), None, (fitted, &fit));
        HeldEffect { effect: found.effect, channel: found.fitted_in, parameters: found.parameters }
    };
    Held {
        time_constant_s: tau_s,
        other: fit.time_constants[1],
        difference: fit.difference,
        effects: state.taken.iter().enumerate().map(of_effect).collect(),
        gas_change_k: fit.trace.gas_change_k,
        deviance: 0.0,
        is_excluded: None,
        judgement,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::ops::ControlFlow;
    use std::sync::Arc;

    use twinlag_model::{Settings, Stretch};

    use super::*;
    use crate::diagnose::diagnose;

    /// Tones through two lags in closed form, 10 s or so apart, and uniform noise of 0.1 K: periods of 13 steps and more, to which
    /// half a second and six are as good as delays.
    fn observations(tau_s: [f64; 2]) -> Observations {
        let time_s: Vec<f64> = (0..600).map(|k| 10.0 * f64::from(k) + 2.0 * (1.7 * f64::from(k)).sin()).collect();
        let mut state = 7_u64;
        let mut noise_k = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            0.1 * 12.0_f64.sqrt() * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let tones = [131.0, 157.0, 173.0, 199.0, 241.0, 277.0, 317.0, 389.0, 470.0, 1010.0];
        let reading_c = tau_s.map(|tau_s| {
            let through = |t: f64, period_s: f64| {
                let x: f64 = TAU / period_s * tau_s;
                (TAU / period_s * t + period_s - x.atan()).sin() / x.hypot(1.0)
            };
            time_s.iter().map(|t| 20.0 + tones.iter().map(|p| through(*t, *p)).sum::<f64>() + noise_k()).collect()
        });
        Observations::new(vec![Stretch::new(time_s, reading_c)], None).expect("a record")
    }

    /// Half a second and six seconds, read every ten: the difference is determined, and for each value of the first that the
    /// record allows the second is as much longer. A first of many minutes leaves nothing of the tones, which the record excludes.
    #[test]
    fn the_difference_is_right_wherever_the_record_allows_the_first() {
        let watch = |_: &str, _, _| ControlFlow::Continue(());
        let observations = observations([0.5, 6.0]);
        let answer = diagnose(&observations, &Settings::default(), &watch).expect("a diagnosis");
        assert!(answer.last.time_constants[0].value_s.is_none(), "{:?}", answer.last.time_constants);
        let table = answer.if_known.expect("not determined");
        assert_eq!(table.values.len(), POINTS);
        let allowed = table.values.iter().filter(|v| v.is_excluded == Some(false));
        let mut seen = 0;
        for value in allowed {
            let [low_s, high_s] = value.difference.interval_95_s.expect("determined");
            // The 95 % interval, doubled: 4 standard errors. Beside it the attenuation, of second order in the lag over a period: 2 s over
            // 131 s / 2π, squared, of 6 s is 0.05 s.
            let slack_s = 0.5 * (high_s - low_s) + 0.05;
            assert!(low_s - slack_s < 5.5 && 5.5 < high_s + slack_s, "{value:?}");
            seen += usize::from(value.time_constant_s < 1.0);
            assert_eq!(value.judgement.grade, Grade::Conditional, "right if the first is: {value:?}");
        }
        // Half a second is between two of them, and nearer to one.
        assert!(seen >= 1, "{table:?}");
        let longest = &table.values[POINTS - 1];
        assert_eq!(longest.is_excluded, Some(true), "{longest:?}");
        // Failed: what the record excludes had a number, and no grade.
        assert!(longest.other.value_s.is_none() && longest.judgement.grade == Grade::NoGo, "{longest:?}");
        // With one of them known there is nothing to ask.
        let known = vec![KnownTimeConstant { sensor: 0, value_s: 0.5, std_s: Some(0.05) }];
        let settings = Settings { known, ..Settings::default() };
        assert_eq!(diagnose(&observations, &settings, &watch).expect("a diagnosis").if_known, None);
    }

    /// Failed: of noise alone there was a table, with a difference of many minutes in it.
    #[test]
    fn of_noise_alone_no_value_settles_anything() {
        let watch = |_: &str, _, _| ControlFlow::Continue(());
        let mut observations = observations([0.5, 6.0]);
        let mut state = 11_u64;
        for reading in
            observations.stretches.iter_mut().flat_map(|s| &mut Arc::make_mut(s).reading_c).flat_map(Arc::make_mut)
        {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *reading = 20.0 + (state >> 11) as f64 / (1_u64 << 53) as f64;
        }
        let answer = diagnose(&observations, &Settings::default(), &watch).expect("a diagnosis");
        assert_eq!(answer.if_known, None);
        assert!(answer.judgements.time_constants.iter().all(|j| j.grade == Grade::NoGo), "{:?}", answer.judgements);
    }
}
