//! Effects that two lags may hide, which their residual does not show.

use std::ops::ControlFlow;

use twinlag_diagnose::{Identifier, ModelError, Observations, Reason, unseen};

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
    let [Some(one_s), Some(two_s)] = answer.sensors.each_ref().map(|sensor| sensor.time_constant_s) else {
        return Ok(());
    };
    if answer.status != Status::Ok {
        return Ok(());
    }
    let calibration = options.calibrates().then_some((Identifier::CALIBRATION, 1));
    let lags = (0..2).filter(|i| options.has_second_lag()[*i]).map(|i| (Identifier::SECOND_ORDER, i));
    let beside: Vec<(Identifier, usize)> = calibration.into_iter().chain(lags).collect();
    let half = |interval: Option<[f64; 2]>| interval.map(|[low, high]| 0.5 * (high - low));
    let [one, two] = answer.sensors.each_ref().map(|sensor| half(sensor.interval_95_s));
    let half_s = [one, two, half(answer.time_constant_difference_s.interval_95_s)];
    let watch = |_: &str, _, _| if stop.is_wanted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let hidden = match unseen(observations, &settings_of(options), [one_s, two_s], &beside, half_s, &watch) {
        Ok(hidden) => hidden,
        Err(ModelError::Cancelled) => return Err(Error::Cancelled),
        // What the model of a diagnosis cannot take, it cannot judge.
        Err(_) => return Ok(()),
    };
    let [sensor_1, sensor_2] = &mut answer.sensors;
    let judgements =
        [&mut sensor_1.judgement, &mut sensor_2.judgement, &mut answer.time_constant_difference_s.judgement];
    let is_known = [sensor_1.known, sensor_2.known, false];
    for ((judgement, effects), is_known) in judgements.into_iter().zip(hidden).zip(is_known) {
        if !effects.is_empty() && !is_known {
            *judgement = std::mem::take(judgement).and(&Reason::Hidden { effects, in_other_sensor: Vec::new() });
        }
    }
    Ok(())
}
