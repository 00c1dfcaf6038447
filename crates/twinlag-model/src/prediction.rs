//! The slower sensor as the faster one predicts it: what a user of system identification asks of a model first.
//!
//! The inverse of the rig says of each reading which gas temperature it implies. What the slower sensor, given the difference
//! `d = u_s − u_f` of both, would read on top of what the faster one predicts is `e = g [(1 − φ) + φ L(τ_φ)] L(τ₂) L(τ) d`, with `L(τ)`
//! a first-order lag, so the prediction is the reading less `e`. Every effect is in the inverse; where a time constant depends on
//! temperature, `e` has that of no change, which is right to first order in `d`.

use crate::extended::Extended;
use crate::plant::Sensor;
use crate::trace::Line;

/// Samples beside a masked reading whose inferred inputs rest on it.
const MASK_REACH: usize = 4;

/// The reading of one channel as the other one predicts it, each lag at rest where an unbroken stretch begins.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Prediction {
    /// The channel that is predicted, 0 or 1: the slower one.
    pub channel: usize,
    /// The prediction, °C, NaN about masked readings; of a long record its smallest and largest values.
    pub predicted_c: Line,
    /// `100 (1 − |y − ŷ| / |y − mean(y)|)` over the record, %, the fit of a comparison; `None` of a reading that never changes.
    pub fit_percent: Option<f64>,
    /// Root mean square of `y − ŷ`, K.
    pub rms_k: f64,
}

/// A first-order lag of a series that is linear between its samples.
fn lag(values: &mut [f64], step_s: f64, tau_s: impl Fn(usize) -> f64) {
    let (mut state, mut before) = (0.0, 0.0);
    for (k, value) in values.iter_mut().enumerate() {
        let now = *value;
        let ratio = step_s / tau_s(k);
        let pole = (-ratio).exp();
        // Weight of the newer sample: the ramp between both, through the lag.
        let newer = 1.0 - (1.0 - pole) / ratio;
        state = pole * state + newer * now + (1.0 - pole - newer) * before;
        before = now;
        *value = state;
    }
}

/// What a sensor makes of a difference of gas temperatures, K.
fn through(sensor: &Sensor, difference_k: Vec<f64>, time_s: &[f64], step_s: f64) -> Vec<f64> {
    let mut out = difference_k;
    lag(&mut out, step_s, |k| sensor.tau_s.re * sensor.tau_factor_at(time_s[k]).re);
    if let Some(second_s) = sensor.second_tau_s.filter(|second_s| second_s.re > 0.0) {
        lag(&mut out, step_s, |_| second_s.re);
    }
    if let Some(slow) = sensor.slow.filter(|slow| slow.tau_s.re > 0.0) {
        let mut late = out.clone();
        lag(&mut late, step_s, |_| slow.tau_s.re);
        out.iter_mut().zip(late).for_each(|(now, late)| *now += slow.share.re * (late - *now));
    }
    out.iter_mut().for_each(|k| *k *= sensor.reading.gain.re);
    out
}

impl Prediction {
    /// The slower sensor of `model` from the faster one; `None` of a record in which nothing can be inferred.
    pub fn of(model: &Extended) -> Option<Self> {
        let (plant, observations) = (model.plant(), model.observations());
        let channel = usize::from(plant.sensors[1].tau_s.re >= plant.sensors[0].tau_s.re);
        let sign = if channel == 0 { 1.0 } else { -1.0 };
        let evaluation = model.evaluate(model.parameters());
        let stretches = || observations.stretches.iter();
        let step_s = observations.step_s();
        let (mut time_s, mut predicted_c, mut error_k, mut reading_c) = (vec![], vec![], vec![], vec![]);
        let mut runs = Vec::new();
        let all_s: Vec<f64> = stretches().flat_map(|stretch| stretch.time_s.iter()).collect();
        let all_c: Vec<f64> = stretches().flat_map(|stretch| stretch.reading_c[channel].iter().copied()).collect();
        // What either channel has masked is in the disagreement.
        let masked: Vec<bool> = stretches()
            .flat_map(|stretch| stretch.masked[0].iter().zip(&stretch.masked[1]).map(|(one, other)| *one || *other))
            .collect();
        let rests_on_masked = |k: usize| {
            let near = k.saturating_sub(MASK_REACH)..(k + MASK_REACH + 1).min(masked.len());
            masked[near].iter().any(|masked| *masked)
        };
        for (samples, places) in evaluation.samples.iter().zip(evaluation.stretches()) {
            let difference_k = evaluation.disagreement_k[places].iter().map(|k| sign * k).collect();
            let instants_s = &all_s[samples.clone()];
            let errors_k = through(&plant.sensors[channel], difference_k, instants_s, step_s);
            let from = time_s.len();
            for (k, error) in samples.clone().zip(errors_k) {
                time_s.push(all_s[k]);
                let is_usable = !rests_on_masked(k);
                predicted_c.push(if is_usable { all_c[k] - error } else { f64::NAN });
                if is_usable {
                    error_k.push(error);
                    reading_c.push(all_c[k]);
                }
            }
            runs.push(from..time_s.len());
        }
        let count = error_k.len() as f64;
        if error_k.is_empty() {
            return None;
        }
        let mean_c = reading_c.iter().sum::<f64>() / count;
        let square = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>() / count;
        let [rms_k, swing_k] =
            [square(&mut error_k.iter().copied()).sqrt(), square(&mut reading_c.iter().map(|c| c - mean_c)).sqrt()];
        let fit_percent = (swing_k > 0.0).then(|| 100.0 * (1.0 - rms_k / swing_k)).filter(|fit| fit.is_finite());
        let predicted_c = Line::thinned(&time_s.into(), &predicted_c, runs.into_iter());
        rms_k.is_finite().then_some(Self { channel, predicted_c, fit_percent, rms_k })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp through a lag of `τ` is `t − τ (1 − exp(−t/τ))`, and a series that is linear between its samples is one.
    #[test]
    fn a_ramp_through_a_lag_is_that_of_the_closed_form() {
        let (step_s, tau_s) = (0.1, 0.7);
        let mut values: Vec<f64> = (0..200).map(|k| step_s * f64::from(k)).collect();
        lag(&mut values, step_s, |_| tau_s);
        for (k, got) in values.iter().enumerate() {
            let t = step_s * k as f64;
            let want = t - tau_s * (1.0 - (-t / tau_s).exp());
            assert!((got - want).abs() < 1e-12, "{got} at {t}, not {want}");
        }
    }
}
