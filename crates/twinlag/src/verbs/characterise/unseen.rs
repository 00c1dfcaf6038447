//! What two lags leave across missing readings, and effects that they may hide, which their residual does not show.

use std::ops::ControlFlow;

use twinlag_diagnose::{Grade, Identifier, ModelError, Observations, Reason, energy_across_missing, unseen};
use twinlag_estimate::REJECTION_P_VALUE;

use crate::answers::{Characterisation, Status};
use crate::error::Error;
use crate::options::Options;
use crate::rows::settings_of;
use crate::watch::Stop;

/// Below this probability that noise leaves as much energy across missing readings, numbers rest on it: one in twenty sound records. Between this
/// and [`REJECTION_P_VALUE`] are records with a delay of 0.8 samples and every eighth reading of either channel missing, of which 8 of 48 numbers
/// were `go` and wrong.
const SUSPICION_P_VALUE: f64 = 0.05;

/// Withholds the numbers of `answer` where two lags leave more than noise across missing readings, at which its estimate is cut, or makes them
/// rest on chance.
///
/// # Errors
/// [`Error::Cancelled`].
pub(super) fn judge_across_missing(
    answer: &mut Characterisation,
    observations: &Observations,
    options: &Options,
    stop: &Stop<'_>,
) -> Result<(), Error> {
    if is_judged(answer) || !observations.has_missing() {
        return Ok(());
    }
    let watch = |_: &str, _, _| while_wanted(stop);
    let settings = settings_of(options);
    let (energy, p_value) =
        match energy_across_missing(observations, &settings, starts_s(answer), &beside(options), &watch) {
            Ok(left) => left,
            Err(ModelError::Cancelled) => return Err(Error::Cancelled),
            // What the model of a diagnosis cannot take, it cannot judge.
            Err(_) => return Ok(()),
        };
    let what = format!(
        "across the missing readings, at which this estimate is cut, two lags leave {energy:.3} times the energy of the noise (p = {p_value:.1e})"
    );
    if p_value >= REJECTION_P_VALUE {
        if p_value < SUSPICION_P_VALUE {
            answer.rest_on(&Reason::Fault {
                what: format!("right if it is chance that {what}"),
                grade: Grade::Conditional,
            });
        }
        return Ok(());
    }
    answer.status = Status::ModelRejected;
    answer.rest_on(&Reason::LeftOver);
    answer.warnings.push(format!("{what}: something is missing from the model. `twinlag diagnose` looks for it"));
    if !options.best_effort {
        answer.withhold();
    }
    Ok(())
}

/// Whether there is no number to be judged, or all of them are judged already.
fn is_judged(answer: &Characterisation) -> bool {
    let is_any = answer.sensors.iter().any(|sensor| sensor.time_constant_s.is_some());
    !is_any || answer.status == Status::ModelRejected
}

/// Where a fit of the model of a diagnosis begins, s. A time constant that is not given is too short to be seen, or hardly is: the fit begins at
/// the longest that it may be.
fn starts_s(answer: &Characterisation) -> [f64; 2] {
    answer.sensors.each_ref().map(|sensor| {
        let longest_s = sensor.interval_95_s.map_or(answer.record.sample_period_s, |[_, high_s]| high_s);
        sensor.time_constant_s.unwrap_or(longest_s)
    })
}

/// The effects that the options ask for beside two lags, each with its channel.
fn beside(options: &Options) -> Vec<(Identifier, usize)> {
    let calibration = options.calibrates().then_some((Identifier::CALIBRATION, 1));
    let lags = (0..2).filter(|i| options.has_second_lag()[*i]).map(|i| (Identifier::SECOND_ORDER, i));
    calibration.into_iter().chain(lags).collect()
}

fn while_wanted(stop: &Stop<'_>) -> ControlFlow<()> {
    if stop.is_wanted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// Puts down for each number of `answer` the effects that may be there unseen and would move it out of its interval.
///
/// # Errors
/// [`Error::Cancelled`].
pub(in crate::verbs) fn judge_unseen(
    answer: &mut Characterisation,
    observations: &Observations,
    options: &Options,
    stop: &Stop<'_>,
) -> Result<(), Error> {
    if is_judged(answer) {
        return Ok(());
    }
    let (tau_s, beside) = (starts_s(answer), beside(options));
    let half = |interval: Option<[f64; 2]>| interval.map(|[low, high]| 0.5 * (high - low));
    let [one, two] = answer.sensors.each_ref().map(|sensor| half(sensor.interval_95_s));
    let half_s = [one, two, half(answer.time_constant_difference_s.interval_95_s)];
    let watch = |_: &str, _, _| while_wanted(stop);
    let mut hidden = match unseen(observations, &settings_of(options), tau_s, &beside, half_s, &watch) {
        Ok(hidden) => hidden,
        Err(ModelError::Cancelled) => return Err(Error::Cancelled),
        // What the model of a diagnosis cannot take, it cannot judge.
        Err(_) => [const { Vec::new() }; 3],
    };
    for (i, effects) in hidden.iter_mut().take(2).enumerate() {
        let other = &answer.sensors[1 - i];
        // Where the other channel is later, or lags twice, a sensor may seem too fast to be seen. The fit is then on a bound, and a slope
        // does not show what would move it from there.
        if other.time_constant_s.is_none() && !other.known {
            let later = [Identifier::SECOND_ORDER, Identifier::DELAY];
            effects.extend(later.into_iter().filter(|effect| !effects.contains(effect)).collect::<Vec<_>>());
        }
    }
    let [sensor_1, sensor_2] = &mut answer.sensors;
    let judgements =
        [&mut sensor_1.judgement, &mut sensor_2.judgement, &mut answer.time_constant_difference_s.judgement];
    let is_known = [sensor_1.known, sensor_2.known, false];
    for ((judgement, effects), is_known) in judgements.into_iter().zip(hidden).zip(is_known) {
        if !effects.is_empty() && !is_known && judgement.grade != Grade::NoGo {
            *judgement = std::mem::take(judgement).and(&Reason::Hidden { effects, in_other_sensor: Vec::new() });
        }
    }
    Ok(())
}
