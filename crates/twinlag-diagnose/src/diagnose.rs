//! The closed loop: fit, look at what is left over, add what explains it, look again, and judge by
//! what has seen none of it.

use twinlag_model::{ModelError, Observations, Prepared, Settings, Watch, is_unresolved, report};

use crate::conclude::conclude;
use crate::diagnosis::Diagnosis;
use crate::excitation::{SINGLE, tones};
use crate::moves::{Proposal, State};

/// Finds what two first-order lags leave over in `observations`, and which effects account for it.
///
/// ```
/// use std::ops::ControlFlow;
/// use twinlag_diagnose::{ModelError, Observations, Settings, Stretch, diagnose};
/// # let time_s: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
/// # let gas_c = |t: f64| (4.0 * t).sin() + (17.0 * t).cos();
/// # let reading_c = [0.1, 0.3].map(|late| time_s.iter().map(|t| gas_c(t - late)).collect());
///
/// // `time_s` and `reading_c` are a record; whoever asked for its diagnosis has gone away.
/// let observations = Observations::new(vec![Stretch::new(time_s, reading_c)], Some(0.02))?;
/// let watch = |_: &str, _, _| ControlFlow::Break(());
/// let answer = diagnose(&observations, &Settings::default(), &watch);
/// assert_eq!(answer.err(), Some(ModelError::Cancelled));
/// # Ok::<(), ModelError>(())
/// ```
///
/// # Errors
/// [`ModelError`] for a record that is too short, or in which a channel never changes, for a
/// policy that means nothing, and for a run that `watch` cancels.
pub fn diagnose(observations: &Observations, settings: &Settings, watch: Watch<'_>) -> Result<Diagnosis, ModelError> {
    let prepared = Prepared::new(observations, settings)?;
    report(watch, "two lags", 0, 1)?;
    let tones = tones(observations, &settings.policy);
    let mut state = State::new(prepared, settings, watch);
    let can_learn = tones != Some(SINGLE);
    while can_learn && state.taken.len() < settings.policy.most_effects && advance(&mut state, settings)? {}
    conclude(state, settings, tones)
}

/// The next move: an effect, reviewed with all others; where there is none, the noise; where that
/// is right, the weights. Whether there was one.
fn advance(state: &mut State<'_>, settings: &Settings) -> Result<bool, ModelError> {
    if let Some(addition) = state.add()? {
        state.apply(addition);
        let is_blind =
            settings.known.is_empty() && is_unresolved(&state.current, &state.prepared.observations, &settings.policy);
        // What imitates a time constant that is not resolved can be refined at will.
        if !is_blind || state.taken.last().is_some_and(|t| t.candidate.effect.is_noise()) {
            review(state)?;
            return Ok(true);
        }
    }
    let next = state.lower_noise().or_else(|| state.reweigh());
    let has_moved = next.is_some();
    next.into_iter().for_each(|proposal| state.apply(proposal));
    Ok(has_moved)
}

/// Looks at every effect again, now that one more is known.
fn review(state: &mut State<'_>) -> Result<(), ModelError> {
    tidy(state);
    for index in 0..state.taken.len() {
        if state.taken.len() < 2 {
            break;
        }
        if let Some(exchange) = state.exchange(index)? {
            state.apply(exchange);
            tidy(state);
            break;
        }
    }
    if let Some(removal) = state.remove_explained_noise() {
        state.apply(removal);
        at_each(state, State::remove_needless);
    }
    Ok(())
}

/// Takes out what has become needless, and extends what the data support.
fn tidy(state: &mut State<'_>) {
    at_each(state, State::remove_needless);
    at_each(state, State::extend);
}

/// Makes a move at each effect as long as there is one.
fn at_each<'a>(state: &mut State<'a>, propose: impl Fn(&State<'a>, usize) -> Option<Proposal>) {
    let mut index = 0;
    while index < state.taken.len() {
        match propose(state, index) {
            Some(proposal) => state.apply(proposal),
            None => index += 1,
        }
    }
}
