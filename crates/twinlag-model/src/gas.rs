//! The gas temperature along a record, as a fitted model has it, beside what the sensors read: what heat transfer goes with that
//! does not depend on a sensor alone.
//!
//! Where an effect needs the gas temperature within the inverse of a rig, the temperature that one sensor implies from sample to
//! sample will not do: its noise is that of a reading times the time constant over the sample period, and where it enters in a
//! power it is no longer zero on average. The estimate that both sensors give, without the frequencies in which there is only noise,
//! has a tenth of it, and does not depend on the parameters that are fitted.

use std::sync::Arc;

use crate::effect::Shared;
use crate::fit::Fitted;
use crate::model::Model;
use crate::number::Number;
use crate::observations::Observations;
use crate::plant::ZERO_CELSIUS_K;
use crate::residual::estimated_gas;
use crate::weighting::Weighting;

/// Least standard deviation of the readings over their absolute temperature at which the gas temperature counts beside that of the
/// sensor. Time constants that follow the film's temperature rather than the sensor's differ by up to half of it times an exponent
/// of one or two: by as much as a record of ten thousand samples determines of them. At 0.03, eleven of 29 random rigs whose time
/// constants followed the film were said to have a calibration with curvature (experiment `undeclared`, gases of 150 to
/// 650 °C); at 0.003 none.
const MIN_RELATIVE_SWING: f64 = 0.003;
/// Times that the gas temperature is estimated again with an effect that depends on it. Each takes off most of what the estimate
/// before was wrong by, since this is but a part of what the effect itself is.
const GAS_ROUNDS: usize = 2;

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
        // Where no spectrum says which frequencies are noise, changes within the faster time constant are left out.
        if !Weighting::of_gas(observations, fitted.model.noise_std_k()).has_filter() {
            for stretch in details.stretches() {
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

    /// This model of `observations` with the gas temperature that it implies itself in the effects that follow it: estimated, fitted by
    /// `fit`, and again. As it is where no effect follows the gas.
    #[must_use]
    pub fn in_own_gas(self, observations: &Observations, fit: impl Fn(&Self) -> Self) -> Self {
        let mut out = self;
        for _ in 0..GAS_ROUNDS {
            let Some(model) = out.model_in_gas(&out, observations) else { break };
            out = fit(&Self { model, ..out });
        }
        out
    }

    /// A model of other observations fitted to these by `fit`. What follows the gas does so in the gas temperature of these, of which
    /// the first estimate is made as if nothing followed it.
    #[must_use]
    pub fn carried_to(self, observations: &Observations, fit: impl Fn(&Self) -> Self) -> Self {
        match self.model_in_gas(&self.following_nothing(), observations) {
            Some(model) => fit(&Self { model, ..self }).in_own_gas(observations, fit),
            None => fit(&self),
        }
    }

    /// This model in the gas temperature that `estimator` has; `None` where no effect follows it.
    fn model_in_gas(&self, estimator: &Self, observations: &Observations) -> Option<Model> {
        self.model.effects.iter().any(|effect| effect.about().follows_gas).then_some(())?;
        let gas = estimator.estimated_gas(observations)?;
        let in_gas = self.model.effects.iter().enumerate().filter_map(|(i, effect)| Some((i, effect.in_gas(&gas)?)));
        let in_gas: Vec<(usize, Shared)> = in_gas.collect();
        let replaced = |model: Model, (index, effect): (usize, Shared)| model.replaced(index, effect);
        (!in_gas.is_empty()).then(|| in_gas.into_iter().fold(self.model.clone(), replaced))
    }

    /// This model with each effect that follows the gas where its fits start, which is where it changes nothing.
    fn following_nothing(&self) -> Self {
        let mut out = self.clone();
        for (index, effect) in self.model.effects.iter().enumerate().filter(|(_, effect)| effect.about().follows_gas) {
            let start = effect.starts().into_iter().next().unwrap_or_default();
            out.theta[self.model.range(index)].copy_from_slice(&start);
        }
        out
    }
}
