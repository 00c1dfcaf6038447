//! The rig that a diagnosis describes: its sensors with the effects that were found, in a gas with the spectrum of the record's own.
//!
//! Of the gas the powers of its bands are kept, each as one tone, and not the phases. An estimate from a linear model depends on nothing
//! else; one with radiation, or with time constants that go with temperature, depends on phases as well, to second order.

use twinlag::model::ZERO_CELSIUS_K;
use twinlag::signal::{
    ColouredNoise, Gas, Mismatch, MultiTone, Noise, Radiation, Record, Rig, Sensor, Signal, SlowMode,
    TemperatureDependence, Tone,
};
use twinlag::{GasSpectrum, Model, ModelEffect};

use crate::change::phase_rad;
use crate::error::PlanError;
use crate::plan::{Plan, Source};

/// Integration steps for each sample period: ten for each period of the highest frequency that there can be, one half of the sampling
/// frequency, and no fewer at half the rate.
const OVERSAMPLING: usize = 12;
/// Integration steps for each time constant, at least.
const STEPS_PER_TIME_CONSTANT: f64 = 4.0;

impl Plan {
    /// What the next record of a rig is expected to determine, after a diagnosis has found `model` in one.
    ///
    /// # Errors
    /// [`PlanError::NoTimeConstant`], [`PlanError::NotSaved`], [`PlanError::NoSpectrum`] and [`PlanError::ModelNumber`] for a model
    /// that does not describe a rig; else as [`Plan::of_rig`].
    pub fn of_model(model: &Model) -> Result<Self, PlanError> {
        let (rig, mut remarks) = rig(model)?;
        remarks.push("the gas is taken to have the spectrum that the record showed; beyond half its sampling rate that is unknown".into());
        Self::of(&rig, Source::Diagnosis, remarks)
    }
}

/// The rig of a model, and what of the model it does not have.
pub(crate) fn rig(model: &Model) -> Result<(Rig, Vec<String>), PlanError> {
    let spectrum = model.gas_spectrum.as_ref().filter(|s| !s.bands.is_empty()).ok_or(PlanError::NoSpectrum)?;
    let found_in = model.found_in.as_ref().ok_or(PlanError::NotSaved { what: "record that it was found in" })?;
    let noise_std_k = model.noise_std_k.ok_or(PlanError::NotSaved { what: "noise" })?;
    let positive = |what, got: f64| {
        if got.is_finite() && got > 0.0 { Ok(got) } else { Err(PlanError::ModelNumber { what, got }) }
    };
    let mut shortest_s = f64::INFINITY;
    let mut sensors = Vec::new();
    for i in 0..2 {
        let channel = model.channels[i].clone();
        let tau_s = model.time_constants_s[i].ok_or_else(|| PlanError::NoTimeConstant { channel: channel.clone() })?;
        let mut sensor = Sensor::new(channel, positive("a time constant of", tau_s)?);
        sensor.noise = Some(Noise::white(positive("a noise of", noise_std_k[i])?));
        shortest_s = shortest_s.min(tau_s);
        sensors.push(sensor);
    }
    let [first, second] = <[Sensor; 2]>::try_from(sensors).expect("two channels have two sensors");
    let mut made = Made { sensors: [first, second], mismatch: None, remarks: Vec::new(), mean_c: spectrum.mean_c };
    for effect in &model.effects {
        made.add(effect, &model.channels);
    }
    let Made { sensors, mismatch, remarks, .. } = made;
    let period_s = positive("a sample period of", found_in.sample_period_s)?;
    let mut record = Record::new(found_in.samples, period_s);
    for sensor in &sensors {
        let others = [sensor.second_time_constant_s, sensor.slow_mode.map(|slow| slow.time_constant_s)];
        shortest_s = others.into_iter().flatten().fold(shortest_s, f64::min);
    }
    let steps = (STEPS_PER_TIME_CONSTANT * period_s / (0.5 * shortest_s)).ceil() as usize;
    record.oversampling = steps.max(OVERSAMPLING);
    let rig = Rig::new(1, record, gas(spectrum), sensors)?;
    let rig = match mismatch {
        Some(mismatch) => rig.with_mismatch(mismatch)?,
        None => rig,
    };
    Ok((rig, remarks))
}

/// One tone for each band.
fn gas(spectrum: &GasSpectrum) -> Gas {
    let tone = |(place, band): (usize, &twinlag::GasBand)| Tone {
        amplitude_k: (2.0 * band.power_k2).sqrt(),
        frequency_hz: band.frequency_hz,
        phase_rad: phase_rad(place),
    };
    let tones = spectrum.bands.iter().enumerate().map(tone).collect();
    Gas::new(spectrum.mean_c, Signal::MultiTone(MultiTone { tones }))
}

/// A rig that gets one effect after the other.
struct Made {
    sensors: [Sensor; 2],
    mismatch: Option<Mismatch>,
    remarks: Vec<String>,
    mean_c: f64,
}

impl Made {
    /// Puts an effect into the rig, or remarks that it cannot.
    fn add(&mut self, effect: &ModelEffect, channels: &[String; 2]) {
        let place = effect.channel.as_ref().and_then(|name| channels.iter().position(|c| c == name));
        let value = |name: &str| effect.parameters.iter().find(|p| p.value.name == name).map(|p| p.value.value);
        let is_added = match (effect.effect.name(), place) {
            ("calibration", _) => {
                self.calibrate(value("gain").unwrap_or(1.0), value("offset").unwrap_or(0.0), &value);
                true
            }
            ("delay", _) => value("delay").map(|s| self.sensors[usize::from(s > 0.0)].delay_s = s.abs()).is_some(),
            ("drift", _) => {
                self.sensors[1].offset_k += value("offset").unwrap_or(0.0);
                value("drift").map(|k_per_s| self.sensors[1].drift_k_per_s = k_per_s).is_some()
            }
            ("second-order", Some(i)) => {
                value("second_time_constant").map(|s| self.sensors[i].second_time_constant_s = Some(s)).is_some()
            }
            ("slow-mode", Some(i)) => {
                let slow = value("share").zip(value("slow_time_constant"));
                slow.map(|(fraction, time_constant_s)| {
                    self.sensors[i].slow_mode = Some(SlowMode { fraction, time_constant_s });
                })
                .is_some()
            }
            ("crosstalk", Some(i)) => {
                let neutral_c = value("neutral_temperature").unwrap_or(self.mean_c);
                value("share").map(|share| self.pick_up(i, share, neutral_c)).is_some()
            }
            ("radiation", Some(i)) => {
                let numbers = value("radiative_conductance").zip(value("radiative_loss"));
                let mean_c = value("mean_temperature").unwrap_or(self.mean_c);
                numbers.is_some_and(|(conductance, loss_k)| self.radiate(i, conductance, loss_k, mean_c))
            }
            ("temperature-dependent-time-constant", _) => {
                let mean_c = value("mean_temperature").unwrap_or(self.mean_c);
                let of = |exponent| TemperatureDependence::new(exponent, mean_c);
                let all = place.map_or(vec![0, 1], |i| vec![i]);
                value("exponent")
                    .map(|p| all.into_iter().for_each(|i| self.sensors[i].temperature_dependence = Some(of(p))))
                    .is_some()
            }
            ("coloured-noise", Some(i)) => {
                let numbers = value("noise_std").zip(value("correlation_time"));
                numbers.map(|(k, s)| self.sensors[i].coloured_noise = Some(ColouredNoise::new(k, s))).is_some()
            }
            ("input-mismatch", _) => {
                let numbers = value("noise_std").zip(value("correlation_time"));
                let of = |(k, s): (f64, f64)| Mismatch::new(k, 1.0 / (std::f64::consts::TAU * s));
                numbers.map(|numbers| self.mismatch = Some(of(numbers))).is_some()
            }
            _ => false,
        };
        if !is_added {
            self.remarks
                .push(format!("{} is in the model and not in the plan: it is taken to be absent", effect.effect));
        }
    }

    /// `g (T + κ (d² − c d − v)) + o`, `d = T − m`: the curvature adds nothing to mean and slope over the record's temperatures.
    fn calibrate(&mut self, gain: f64, offset_k: f64, value: &dyn Fn(&str) -> Option<f64>) {
        let [mean_c, variance_k2, skew_k] =
            ["curvature_about", "curvature_variance", "curvature_skew"].map(|name| value(name).unwrap_or(0.0));
        let channels = [("curvature_of_first", 1.0, 0.0), ("curvature", gain, offset_k)];
        for (sensor, (name, gain, offset_k)) in self.sensors.iter_mut().zip(channels) {
            let curvature = value(name).unwrap_or(0.0);
            sensor.gain = gain * (1.0 - curvature * skew_k);
            sensor.offset_k += offset_k + gain * curvature * (skew_k * mean_c - variance_k2);
            (sensor.curvature_per_k, sensor.curvature_about_c) = (gain * curvature, mean_c);
        }
    }

    /// The rig picks up deviations from the mean, the model those from a neutral temperature.
    fn pick_up(&mut self, channel: usize, share: f64, neutral_c: f64) {
        let sensor = &mut self.sensors[channel];
        sensor.crosstalk = share;
        sensor.offset_k += share * (self.mean_c - neutral_c);
    }

    /// Whether there are walls of a temperature with which a sensor loses so much.
    fn radiate(&mut self, sensor: usize, conductance: f64, loss_k: f64, mean_c: f64) -> bool {
        let mean_k = mean_c + ZERO_CELSIUS_K;
        let per_k3 = conductance / (4.0 * mean_k.powi(3));
        let wall_k4 = mean_k.powi(4) - loss_k / per_k3;
        let is_physical = per_k3.is_finite() && per_k3 > 0.0 && wall_k4 > 0.0;
        if is_physical {
            let wall_c = wall_k4.powf(0.25) - ZERO_CELSIUS_K;
            self.sensors[sensor].radiation = Some(Radiation::new(per_k3, wall_c));
        }
        is_physical
    }
}
