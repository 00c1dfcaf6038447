//! A fitted model in the form that a compensation needs: the sensors' own temperatures, and the
//! state of each sensor.

use std::fmt;
use std::sync::Arc;

use twinlag_compensate::{Coloured, Readings, Rig, Sensor, SensorAt, SlowPath};

use crate::effect::{Identifier, Shared};
use crate::error::ModelError;
use crate::fit::Fitted;
use crate::implied::Evaluation;
use crate::model::Model;
use crate::number::Number;
use crate::observations::Observations;
use crate::plant::{Place, Plant};

/// Two lags and the effects that were found, with the record that they were fitted to.
#[derive(Clone)]
pub struct Extended {
    model: Model,
    theta: Vec<f64>,
    observations: Arc<Observations>,
}

impl fmt::Debug for Extended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let effects: Vec<&str> = self.model.effects.iter().map(|e| e.identifier().name()).collect();
        f.debug_struct("Extended").field("effects", &effects).field("parameters", &self.theta).finish_non_exhaustive()
    }
}

/// Two are equal if they have the same effects in the same places, with the same parameters, and make the same sensors
/// of the same record. What an effect holds beside its parameters counts as far as the sensors depend on it.
impl PartialEq for Extended {
    fn eq(&self, other: &Self) -> bool {
        self.theta == other.theta
            && self.observations == other.observations
            && self.seats().eq(other.seats())
            && self.rig(&self.theta) == other.rig(&other.theta)
    }
}

impl Extended {
    /// A fitted model with the record that it was fitted to.
    pub fn new(fitted: &Fitted, observations: &Observations) -> Self {
        let observations = Arc::new(observations.clone());
        Self { model: fitted.model.clone(), theta: fitted.theta.clone(), observations }
    }

    /// This model with pieces of the record, as [`Observations::excerpt`] takes them.
    #[must_use]
    pub fn excerpt(&self, starts: impl Iterator<Item = usize>, length: usize) -> Self {
        Self { observations: Arc::new(self.observations.excerpt(starts, length)), ..self.clone() }
    }

    /// Each effect with its channel and the names of its parameters.
    fn seats(&self) -> impl Iterator<Item = (Identifier, Option<usize>, Vec<&str>)> {
        let names = |e: &Shared| e.parameters().iter().map(|p| p.name).collect();
        self.model.effects.iter().map(move |e| (e.identifier(), e.channel(), names(e)))
    }

    /// The parameters, time constants first, as [`crate::ModelFit::covariance`] has them.
    pub fn parameters(&self) -> &[f64] {
        &self.theta
    }

    /// Both time constants at `time_s` with other `parameters`, s: where they change along the record, as they do then.
    pub fn time_constants_s(&self, parameters: &[f64], time_s: &[f64]) -> [Vec<f64>; 2] {
        let plant = self.model.plant(parameters, &self.observations);
        [0, 1]
            .map(|i| time_s.iter().map(|t| (plant.sensors[i].tau_s * plant.sensors[i].tau_factor_at(*t)).re).collect())
    }

    /// The residual with other `parameters`, and the gas temperatures that it is of.
    pub fn evaluate(&self, parameters: &[f64]) -> Evaluation {
        self.model.evaluate(parameters, &self.observations)
    }

    /// The record that it was fitted to.
    pub(crate) fn observations(&self) -> &Observations {
        &self.observations
    }

    /// The rig that it describes.
    pub(crate) fn plant(&self) -> Plant {
        self.model.plant(&self.theta, &self.observations)
    }

    /// Gain and offset of the second channel against the first, 1 and K.
    pub fn calibration(&self, parameters: &[f64]) -> [f64; 2] {
        let plant = self.model.plant(parameters, &self.observations);
        let [first, second] = [0, 1].map(|i| &plant.sensors[i].reading);
        let gain = second.gain.re / first.gain.re;
        [gain, second.offset_k.re - first.offset_k.re * gain]
    }

    /// The sensors' temperatures at every sample of the record, and the sensors, with other
    /// `parameters`. Readings are returned with the calibration removed; masked readings and grid
    /// gaps are `None`. Coloured noise and crosstalk are kept to first order: each channel has its
    /// own coloured noise.
    ///
    /// # Errors
    /// [`ModelError::Compensate`] for parameters with which there is no rig; [`ModelError::ChangingDelay`] for sensors that stand
    /// apart along the flow.
    pub fn rig(&self, parameters: &[f64]) -> Result<(Readings, Rig), ModelError> {
        let plant = self.model.plant(parameters, &self.observations);
        if plant.separation.is_some() {
            return Err(ModelError::ChangingDelay);
        }
        let stretches = &self.observations.stretches;
        let time_s: Vec<f64> = stretches.iter().flat_map(|stretch| stretch.time_s.iter()).collect();
        let missing = [0, 1].map(|i| stretches.iter().flat_map(|stretch| stretch.masked[i].iter().copied()).collect());
        let temperature_c = match &stretches[..] {
            [stretch] if plant.leaves_readings() => stretch.reading_c.clone(),
            _ => {
                let mut all: [Vec<f64>; 2] = Default::default();
                for stretch in stretches {
                    all.iter_mut().zip(plant.temperatures(stretch)).for_each(|(all, own)| all.extend(own));
                }
                all.map(Arc::new)
            }
        };
        let locals = locals(&plant, &time_s, &temperature_c);
        let readings = Readings::sharing(time_s, temperature_c, missing)?;
        let rig = rig(&plant).with_noise_times(self.observations.noise_factor());
        Ok((if let Some(locals) = locals { readings.with_locals(locals)? } else { readings }, rig))
    }
}

fn rig(plant: &Plant) -> Rig {
    let extra = |place: Place| {
        let found = plant.extra.iter().find(|e| e.place == place)?;
        Some(Coloured { std_k: found.std_k, correlation_s: found.correlation_s })
    };
    let sensors = [0, 1].map(|i| {
        let sensor = &plant.sensors[i];
        let gain = sensor.reading.gain.re.abs();
        Sensor {
            tau_s: sensor.tau_s.re,
            second_tau_s: sensor.second_tau_s.map(|tau_s| tau_s.re),
            slow: sensor.slow.map(|slow| SlowPath { share: slow.share.re, tau_s: slow.tau_s.re }),
            noise_std_k: plant.noise_std_k[i] / gain,
            coloured: extra(Place::Reading(i)).map(|c| Coloured { std_k: c.std_k / gain, ..c }),
        }
    });
    Rig { sensors, delay_s: plant.delay_s.map_or(0.0, |delay_s| delay_s.re), clock: 0, mismatch: extra(Place::Gas) }
}

/// What each sensor does at each instant, where that changes.
fn locals(plant: &Plant, time_s: &[f64], temperature_c: &[Arc<Vec<f64>>; 2]) -> Option<[Vec<SensorAt>; 2]> {
    let changes = |s: &crate::plant::Sensor| !s.changes.is_empty() || s.rest.is_some() || s.heat.is_some();
    plant.sensors.iter().any(changes).then(|| {
        [0, 1].map(|i| {
            let sensor = &plant.sensors[i];
            let each = time_s.iter().zip(temperature_c[i].iter()).map(|(&time_s, &c)| {
                let temperature_c = Number::from(c);
                // The slope of the heat that it holds is the factor of its time constant.
                let with_temperature = sensor.heat.as_ref().map_or(1.0, |heat| heat(temperature_c).1.re);
                let rest = sensor.rest.as_ref().map(|rest| rest(temperature_c));
                let (loss_k, loss_slope) = rest.map_or((0.0, 0.0), |(with, slope)| (with.re - c, slope.re - 1.0));
                SensorAt { tau_factor: sensor.tau_factor_at(time_s).re * with_temperature, loss_k, loss_slope }
            });
            each.collect()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::candidates;
    use crate::observations::Stretch;
    use crate::prepare::Prepared;
    use crate::settings::Settings;

    /// Failed: two models with the same numbers for different effects were equal.
    #[test]
    fn models_of_the_same_numbers_are_equal_if_their_effects_are() {
        let time_s: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        let gas_c = |t: f64| 300.0 + (9.0 * t).sin() + (31.0 * t).sin().powi(3);
        let reading_c = [0.0, 0.4].map(|late_s| time_s.iter().map(|t| gas_c(t - late_s)).collect());
        let observations = Observations::new(vec![Stretch::new(time_s, reading_c)], Some(0.01)).expect("a record");
        let context = Prepared::new(&observations, &Settings::default()).expect("a record").context;
        let with = |effect: Identifier, place: usize| {
            let model = Model::new(&[], [0.1, 0.1]).with(candidates(&[effect], &context).remove(place));
            let theta = vec![0.1, 0.3, 0.02];
            Extended { model, theta, observations: Arc::new(observations.clone()) }
        };
        let offset = with(Identifier::CALIBRATION, 0);
        assert_eq!(offset, with(Identifier::CALIBRATION, 0), "made twice");
        assert_ne!(offset, with(Identifier::DELAY, 0), "another effect");
        let crosstalk = with(Identifier::CROSSTALK, 0);
        assert_ne!(crosstalk, with(Identifier::CROSSTALK, 1), "another channel");
        let mut other = offset.clone();
        other.theta[2] = 0.03;
        assert_ne!(offset, other, "another offset");
        let louder = Model::new(&[], [0.2, 0.1]).with(offset.model.effects[0].clone());
        assert_ne!(offset, Extended { model: louder, ..offset.clone() }, "other noise");
    }
}
