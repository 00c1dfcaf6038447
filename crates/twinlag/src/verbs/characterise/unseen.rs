//! Effects that two lags may hide, which their residual does not show.

use std::ops::ControlFlow;

use twinlag_diagnose::{Grade, Identifier, ModelError, Observations, Reason, unseen};

use crate::answers::{Characterisation, Status};
use crate::error::Error;
use crate::options::Options;
use crate::rows::settings_of;
use crate::watch::Stop;

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
    let is_any = answer.sensors.iter().any(|sensor| sensor.time_constant_s.is_some());
    if !is_any || answer.status == Status::ModelRejected {
        return Ok(());
    }
    // A time constant that is not given is too short to be seen, or hardly is: a fit begins at the longest that it may be.
    let tau_s = answer.sensors.each_ref().map(|sensor| {
        let longest_s = sensor.interval_95_s.map_or(answer.record.sample_period_s, |[_, high_s]| high_s);
        sensor.time_constant_s.unwrap_or(longest_s)
    });
    let calibration = options.calibrates().then_some((Identifier::CALIBRATION, 1));
    let lags = (0..2).filter(|i| options.has_second_lag()[*i]).map(|i| (Identifier::SECOND_ORDER, i));
    let beside: Vec<(Identifier, usize)> = calibration.into_iter().chain(lags).collect();
    let half = |interval: Option<[f64; 2]>| interval.map(|[low, high]| 0.5 * (high - low));
    let [one, two] = answer.sensors.each_ref().map(|sensor| half(sensor.interval_95_s));
    let half_s = [one, two, half(answer.time_constant_difference_s.interval_95_s)];
    let watch = |_: &str, _, _| if stop.is_wanted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
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
