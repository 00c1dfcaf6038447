//! Time constants that change faster along a long record than a smooth change over all of it can follow.
//!
//! A smooth change has nineteen coefficients at most, however long the record is: what swings a hundred times along it is
//! beyond them, and looks like noise of the gas in pieces that lie far apart. Consecutive samples, as many as a search takes
//! in, show it. Where they do, it is named with what was seen; no number of the whole record can hold it.

use twinlag_model::{
    Effort, Fitted, ModelError, Observations, Prepared, Settings, Shared, Watch, candidates, evenly_spread,
};

use crate::conclude::leaves_more_than_noise;
use crate::diagnose::search;
use crate::long::{EXCLUDED_DEVIANCE, SEARCHED_SAMPLES};
use crate::moves::{State, Taken};
use crate::rank::worth;
use crate::remark::Remark;

/// Stretches of consecutive samples, spread evenly over the record: the middle one is searched, and one of the others has to
/// confirm.
const STRETCHES: usize = 3;
/// Times that the stretch is halved where it is not explained: what swings too often in one shows in a shorter one. Chosen: the
/// shortest has 3072 samples.
const MAX_HALVINGS: usize = 3;

/// Such a change.
pub(crate) struct RapidVariation {
    pub(crate) taken: Taken,
    /// Ends of what was searched, s: the longest part of the stretch that is explained.
    pub(crate) ends_s: [f64; 2],
    /// Stretches that show it, that one among them, and all that were looked at.
    pub(crate) seen_in: usize,
    pub(crate) looked_in: usize,
}

impl RapidVariation {
    pub(crate) fn remark(&self) -> Remark {
        Remark::VariesTooFast { effect: self.taken.candidate.effect.identifier(), ends_s: self.ends_s }
    }
}

/// What a stretch of a long record shows where its pieces left something to noise or to nothing; `None` where it shows no
/// change of the time constants, or explains no more than what the pieces showed.
pub(crate) fn rapid_variation<'a>(
    whole: &Prepared,
    pieces: &State<'_>,
    settings: &'a Settings,
    watch: Watch<'a>,
) -> Result<Option<(State<'a>, RapidVariation)>, ModelError> {
    if !pieces.has_noise() && pieces.current.mean_energy() < settings.policy.incomplete_energy {
        return Ok(None);
    }
    let observations = &whole.raw.0;
    let starts: Vec<usize> = evenly_spread(observations.samples(), STRETCHES, SEARCHED_SAMPLES).collect();
    let stretch = |place: usize| {
        let out = observations.excerpt(std::iter::once(starts[place]), SEARCHED_SAMPLES);
        (out.samples() == SEARCHED_SAMPLES).then_some(out)
    };
    // Where the record has a gap there is none.
    let Some(middle) = stretch(STRETCHES / 2) else { return Ok(None) };
    let mut state = State::new(whole.of_excerpt(&middle, settings)?, settings, watch);
    search(&mut state, settings, true)?;
    let Some(index) = change_along_the_record(&state) else { return Ok(None) };
    let of_pieces = without_noise(&pieces.current, &state.prepared);
    let of_stretch = without_noise(&state.current, &state.prepared);
    let added = of_stretch.theta.len() as f64 - of_pieces.theta.len() as f64;
    if gain(&of_pieces, &of_stretch) < added * of_stretch.count.ln() + EXCLUDED_DEVIANCE {
        return Ok(None);
    }
    let (mut seen_in, mut looked_in) = (1, 1);
    for other in (0..STRETCHES).filter(|place| *place != STRETCHES / 2).filter_map(stretch) {
        let prepared = whole.of_excerpt(&other, settings)?;
        looked_in += 1;
        seen_in += usize::from(shows(&state, index, &prepared, settings));
    }
    if seen_in == 1 && looked_in > 1 {
        return Ok(None);
    }
    let (mut state, index, ends_s) = shortened(whole, &middle, (state, index, middle.ends_s()), settings, watch)?;
    let taken = state.take_out(index);
    Ok(Some((state, RapidVariation { taken, ends_s, seen_in, looked_in })))
}

/// The longest part of a stretch, by halves, that is explained without noise; if there is none, the longest that is explained.
///
/// - `found`: what was found in the stretch, the place of the change in it, and its ends, s
fn shortened<'a>(
    whole: &Prepared,
    stretch: &Observations,
    mut found: (State<'a>, usize, [f64; 2]),
    settings: &'a Settings,
    watch: Watch<'a>,
) -> Result<(State<'a>, usize, [f64; 2]), ModelError> {
    let mut is_explained = !leaves_more_than_noise(&found.0, settings);
    for halving in 1..=MAX_HALVINGS {
        if is_explained && !found.0.has_noise() {
            break;
        }
        let samples = SEARCHED_SAMPLES >> halving;
        let part = stretch.excerpt(std::iter::once((SEARCHED_SAMPLES - samples) / 2), samples);
        let mut state = State::new(whole.of_excerpt(&part, settings)?, settings, watch);
        search(&mut state, settings, true)?;
        let Some(index) = change_along_the_record(&state) else { break };
        let explains = !leaves_more_than_noise(&state, settings);
        if explains && (!is_explained || !state.has_noise()) {
            (found, is_explained) = ((state, index, part.ends_s()), true);
        }
    }
    Ok(found)
}

/// The place, among what was found, of time constants that change along a record with nothing that was measured.
pub(crate) fn change_along_the_record(state: &State<'_>) -> Option<usize> {
    state.taken.iter().position(|taken| is_change_along_the_record(&taken.candidate.effect))
}

fn is_change_along_the_record(effect: &Shared) -> bool {
    effect.about().changes_time_constants && effect.is_of_the_record()
}

/// Deviance that the second of two fits to the same samples saves.
fn gain(one: &Fitted, other: &Fitted) -> f64 {
    other.count * (one.mean_energy() / other.mean_energy()).ln()
}

/// A model without its noise, which explains whatever is left over, fitted to a record.
pub(crate) fn without_noise(fitted: &Fitted, prepared: &Prepared) -> Fitted {
    let (mut model, mut theta) = (fitted.model.clone(), fitted.theta.clone());
    while let Some(noise) = model.noise() {
        theta.drain(model.range(noise));
        model = model.without(noise);
    }
    let model = model.with_noise(prepared.levels.std_k);
    model.fit(&theta, &prepared.observations, &prepared.searched, Effort::Compare)
}

/// Whether another stretch shows the change in place `index` of what was found in one.
fn shows(state: &State<'_>, index: usize, prepared: &Prepared, settings: &Settings) -> bool {
    let effect = state.taken[index].candidate.effect.identifier();
    let Some(change) = candidates(&[effect], &prepared.context).into_iter().find(is_change_along_the_record) else {
        return false;
    };
    let (without, theta) = state.current.without(index);
    let without = without_noise(&Fitted { model: without, theta, ..state.current.clone() }, prepared);
    let model = without.model.with(change.clone());
    let theta = [&without.theta[..], &change.starts()[0]].concat();
    let with = model.fit(&theta, &prepared.observations, &prepared.searched, Effort::Compare);
    gain(&without, &with) > worth(change.parameters().len(), with.count, &settings.policy)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::ops::ControlFlow;

    use twinlag_model::{Identifier, Stretch};
    use twinlag_signal::{Flow, FlowSine, Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};

    use super::*;
    use crate::diagnose::diagnose;
    use crate::diagnosis::Verdict;
    use crate::remark::Remark;

    const SAMPLES: usize = 60_000;
    const SAMPLE_PERIOD_S: f64 = 0.001;

    /// Turbulence that sensors of 12 and 60 ms read, both with time constants that swing by a quarter `swings` times.
    fn swinging(swings: f64) -> Observations {
        let gas = Gas::new(300.0, Signal::Turbulence(Turbulence { std_k: 20.0, corner_hz: 2.4, cutoff_hz: 200.0 }));
        let mut sensors = [Sensor::new("T1", 0.012), Sensor::new("T2", 0.060)];
        sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.2)));
        let rig = Rig::new(3, Record::new(SAMPLES, SAMPLE_PERIOD_S), gas, sensors).expect("a valid rig");
        let period_s = SAMPLES as f64 * SAMPLE_PERIOD_S / swings;
        let rig = rig.with_flow(Flow::Sine(FlowSine::new(0.25, period_s, 0.1 * TAU))).expect("a valid rig");
        let record = rig.simulate().expect("finite numbers");
        let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
        Observations::new(vec![stretch], Some(SAMPLE_PERIOD_S)).expect("a record")
    }

    /// A swing of 6000 samples goes up and down ten times along the record, which nineteen coefficients cannot follow, and four times
    /// along a stretch. It is named, with where it was seen, and no number of the whole record is said to hold.
    #[test]
    fn what_swings_often_along_a_long_record_is_named_without_numbers() {
        let (observations, settings) = (swinging(10.0), Settings::default());
        let watch = |_: &str, _, _| ControlFlow::Continue(());
        let answer = diagnose(&observations, &settings, &watch).expect("a diagnosis");
        assert_eq!(answer.verdict, Verdict::PartlyExplained);
        let named: Vec<Identifier> = answer.effects.iter().map(|e| e.effect).collect();
        assert_eq!(named, [Identifier::VARYING_TIME_CONSTANT]);
        let found = &answer.effects[0];
        assert!(found.parameters.is_empty() && !found.is_in_the_model);
        assert!(found.seen.as_ref().is_some_and(|seen| seen.contains("3 of 3")), "{:?}", found.seen);
        let ends_s = answer.remarks.iter().find_map(|remark| match remark {
            Remark::VariesTooFast { ends_s, .. } => Some(*ends_s),
            _ => None,
        });
        let [from_s, to_s] = ends_s.expect("the remark that says how to cut the record");
        let first = (from_s / SAMPLE_PERIOD_S).round() as usize;
        let samples = ((to_s - from_s) / SAMPLE_PERIOD_S).round() as usize + 1;
        let part = observations.excerpt(std::iter::once(first), samples);
        let of_part = diagnose(&part, &settings, &watch).expect("a diagnosis");
        assert_eq!(of_part.verdict, Verdict::Explained, "a part of {samples} samples");
        assert!(!answer.remarks.iter().any(|remark| matches!(remark, Remark::SearchedInPieces { .. })));
        assert!(answer.judgements.time_constants.iter().all(|j| j.grade == crate::grade::Grade::NoGo));
    }
}
