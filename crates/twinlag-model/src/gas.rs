//! The gas temperature along a record, as a fitted model has it, beside what the sensors read: what heat transfer goes with that
//! does not depend on a sensor alone.
//!
//! Where an effect needs the gas temperature within the inverse of a rig, the temperature that one sensor implies from sample to
//! sample will not do: its noise is that of a reading times the time constant over the sample period, and where it enters in a
//! power it is no longer zero on average. The estimate that both sensors give, without the frequencies in which there is only noise,
//! has a tenth of it, and does not depend on the parameters that are fitted.

use std::sync::Arc;

use crate::fit::Fitted;
use crate::number::Number;
use crate::observations::Observations;
use crate::plant::ZERO_CELSIUS_K;
use crate::residual::estimated_gas;
use crate::weighting::Weighting;

/// Least standard deviation of the readings over their absolute temperature at which the gas temperature counts beside that of the
/// sensor: the film's temperature is then up to three per cent from the sensor's, and time constants as far from each other as the
/// widest interval that is of use.
const MIN_RELATIVE_SWING: f64 = 0.03;

/// An estimate of the gas temperature along a record, and the readings at the same instants.
#[derive(Debug)]
pub struct Gas {
    time_s: Vec<f64>,
    gas_k: Vec<f64>,
    reading_k: [Vec<f64>; 2],
}

impl Gas {
    /// The gas temperature that `fitted` has; `None` where it makes no difference to the properties of the gas whether they follow
    /// it or a sensor.
    fn of(fitted: &Fitted, observations: &Observations) -> Option<Arc<Self>> {
        let level_k = 0.5 * (observations.mean_and_std(0)[0] + observations.mean_and_std(1)[0]) + ZERO_CELSIUS_K;
        if observations.swing_k() < MIN_RELATIVE_SWING * level_k {
            return None;
        }
        let mut details = fitted.model.details(&fitted.theta, observations);
        let mut gas_k = estimated_gas(fitted, std::mem::take(&mut details.parts), observations);
        if gas_k.len() < 2 {
            return None;
        }
        let faster_s = fitted.theta[0].min(fitted.theta[1]);
        let half = (faster_s / observations.step_s()).max(1.0) as usize;
        for stretch in details.stretches() {
            // Where no spectrum says which frequencies are noise, changes within the faster time constant are left out.
            if !Weighting::of_gas(observations, fitted.model.noise_std_k()).has_filter() {
                let smooth = Weighting::default().smooth_or_mean(&gas_k[stretch.clone()], half);
                gas_k[stretch].copy_from_slice(&smooth);
            }
        }
        gas_k.iter_mut().for_each(|gas| *gas += ZERO_CELSIUS_K);
        let readings_k: [Vec<f64>; 2] = [0, 1].map(|i| observations.channel(i).map(|y| y + ZERO_CELSIUS_K).collect());
        let reading_k = readings_k.map(|readings| details.sample().map(|sample| readings[sample]).collect());
        Some(Arc::new(Self { time_s: details.time_s.iter().collect(), gas_k, reading_k }))
    }

    /// `(1 − m) T + m x`, K, at an instant: between what a sensor reads and the gas temperature, on straight lines between the samples.
    ///
    /// - `gas_share`: `m`
    pub(crate) fn between_k(&self, sensor: usize, gas_share: Number, time_s: f64) -> Number {
        let after = self.time_s.partition_point(|t| *t <= time_s).clamp(1, self.time_s.len() - 1);
        let before = after - 1;
        let share = ((time_s - self.time_s[before]) / (self.time_s[after] - self.time_s[before])).clamp(0.0, 1.0);
        let at = |values: &[f64]| values[before] + share * (values[after] - values[before]);
        let reading_k = at(&self.reading_k[sensor]);
        gas_share * (at(&self.gas_k) - reading_k) + reading_k
    }
}

impl Fitted {
    /// The gas temperature of this model; `None` where it makes no difference to the properties of the gas whether they follow it
    /// or a sensor.
    pub fn estimated_gas(&self, observations: &Observations) -> Option<Arc<Gas>> {
        Gas::of(self, observations)
    }
}
