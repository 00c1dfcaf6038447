//! The effects of a rig, as a model has them, with the values that they have.
//!
//! Rig and model share no code, and several effects have other variables there: a delay of either channel is one of channel 2 against
//! channel 1, radiation has a wall here and a loss at the mean temperature there. A fit to a record without noise follows, so a value
//! that is right to a part of itself is enough.

use twinlag::model::{Context, Identifier, Shared, ZERO_CELSIUS_K, candidates};
use twinlag::signal::{Rig, Sensor};

/// An effect of a rig, as a model has it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Seat {
    effect: Identifier,
    channel: Option<usize>,
    values: Vec<(&'static str, f64)>,
}

impl Seat {
    /// The effect, made for a record, with its values.
    fn made(&self, context: &Context) -> Option<(Shared, Vec<f64>)> {
        let value = |name: &str| self.values.iter().find(|(own, _)| *own == name).map(|(_, value)| *value);
        let is_this = |e: &Shared| {
            let names = e.parameters();
            e.channel() == self.channel
                && names.len() == self.values.len()
                && names.iter().all(|p| value(p.name).is_some())
        };
        let effect = candidates(&[self.effect], context).into_iter().rfind(is_this)?;
        let inside =
            |p: &twinlag::model::Parameter| value(p.name).unwrap_or_default().clamp(p.variable.lower, p.variable.upper);
        let values = effect.parameters().iter().map(inside).collect();
        Some((effect, values))
    }
}

/// The effects of `rig`, made for a record of it, each with its values; and those that no model of the record has.
pub(crate) fn effects(rig: &Rig, context: &Context) -> (Vec<(Shared, Vec<f64>)>, Vec<Identifier>) {
    let seats = seats(rig, context);
    let made: Vec<Option<(Shared, Vec<f64>)>> = seats.iter().map(|seat| seat.made(context)).collect();
    let missing = seats.iter().zip(&made).filter(|(_, made)| made.is_none()).map(|(seat, _)| seat.effect).collect();
    (made.into_iter().flatten().collect(), missing)
}

fn seats(rig: &Rig, context: &Context) -> Vec<Seat> {
    let sensors = rig.sensors();
    let mut out: Vec<Seat> = calibration(sensors).into_iter().collect();
    let [first, second] = sensors;
    let mut push = |effect, channel, values| out.push(Seat { effect, channel, values });
    let later_s = second.delay_s - first.delay_s;
    if later_s != 0.0 {
        push(Identifier::DELAY, Some(1), vec![("delay", later_s)]);
    }
    let drift_k_per_s = second.drift_k_per_s - first.drift_k_per_s;
    if drift_k_per_s != 0.0 {
        push(Identifier::DRIFT, Some(1), vec![("drift", drift_k_per_s)]);
    }
    for (i, sensor) in sensors.iter().enumerate() {
        if let Some(tau_s) = sensor.second_time_constant_s {
            let shorter_s = tau_s.min(sensor.time_constant_s);
            push(Identifier::SECOND_ORDER, Some(i), vec![("second_time_constant", shorter_s)]);
        }
        if let Some(slow) = sensor.slow_mode {
            let values = vec![("share", slow.fraction), ("slow_time_constant", slow.time_constant_s)];
            push(Identifier::SLOW_MODE, Some(i), values);
        }
        if sensor.crosstalk != 0.0 {
            push(Identifier::CROSSTALK, Some(i), vec![("share", sensor.crosstalk)]);
        }
        if let Some(radiation) = &sensor.radiation {
            let (mean_k, wall_k) = (context.mean_c[i] + ZERO_CELSIUS_K, radiation.wall_c + ZERO_CELSIUS_K);
            let conductance = 4.0 * radiation.coefficient_per_k3 * mean_k.powi(3);
            let loss_k = radiation.coefficient_per_k3 * (mean_k.powi(4) - wall_k.powi(4));
            let values = vec![("radiative_conductance", conductance), ("radiative_loss", loss_k)];
            push(Identifier::RADIATION, Some(i), values);
        }
        if let Some(noise) = &sensor.coloured_noise {
            let values = vec![("noise_std", noise.std_k), ("correlation_time", noise.correlation_time_s)];
            push(Identifier::COLOURED_NOISE, Some(i), values);
        }
    }
    let exponents = [first, second].map(|sensor| sensor.temperature_dependence.map(|d| d.exponent));
    let (channel, exponent) = match exponents {
        [Some(a), Some(b)] if a == b => (None, Some(a)),
        [Some(a), _] => (Some(0), Some(a)),
        [None, b] => (Some(1), b),
    };
    if let Some(exponent) = exponent {
        push(Identifier::TEMPERATURE_DEPENDENT_TIME_CONSTANT, channel, vec![("exponent", exponent)]);
    }
    if let Some(mismatch) = rig.mismatch() {
        let correlation_s = 1.0 / (std::f64::consts::TAU * mismatch.corner_hz);
        let values = vec![("noise_std", mismatch.std_k), ("correlation_time", correlation_s)];
        push(Identifier::INPUT_MISMATCH, None, values);
    }
    out
}

/// Channel 2 against channel 1; no offset beside radiation, whose loss is one.
fn calibration([first, second]: &[Sensor; 2]) -> Option<Seat> {
    let gain = second.gain / first.gain;
    let offset_k = second.offset_k - gain * first.offset_k;
    let is_curved = [first, second].iter().any(|sensor| sensor.curvature_per_k != 0.0);
    let has_radiation = [first, second].iter().any(|sensor| sensor.radiation.is_some());
    let mut values = Vec::new();
    if gain != 1.0 || is_curved {
        values.push(("gain", gain));
    }
    if (offset_k != 0.0 || is_curved) && !has_radiation {
        values.push(("offset", offset_k));
    }
    if is_curved && !has_radiation {
        // The model's curvature is per unit of gain, and of one channel: of two the difference counts.
        let [of_first, of_second] = [first, second].map(|sensor| sensor.curvature_per_k / sensor.gain);
        let is_second = of_second != 0.0;
        values.push(if is_second { ("curvature", of_second - of_first) } else { ("curvature_of_first", of_first) });
    }
    (!values.is_empty()).then_some(Seat { effect: Identifier::CALIBRATION, channel: Some(1), values })
}
