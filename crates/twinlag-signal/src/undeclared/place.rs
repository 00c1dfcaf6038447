//! Puts one effect of random size into a rig.

use std::f64::consts::TAU;

use rand::{Rng, RngExt};

use super::base::Base;
use super::draw::{log_uniform, one_of, sign};
use super::{Kind, Placed};
use crate::effects::ZERO_CELSIUS_K;
use crate::streams::{Purpose, stream};
use crate::{
    Adc, ClockSlip, ColouredNoise, Flow, FlowSine, Hysteresis, IntermittentContact, Mains, Mismatch, Radiation,
    Replaced, Rig, Sensor, SignalError, SlowMode, Spikes, Stream, TemperatureDependence,
};

/// Cold junction, towards which an open contact lets the reading fall, °C.
const AMBIENT_C: f64 = 25.0;

/// A rig in the making.
pub(super) struct Draft {
    pub(super) base: Base,
    pub(super) flow: Option<Flow>,
    pub(super) stream: Option<Stream>,
    pub(super) mismatch: Option<Mismatch>,
    pub(super) rig_seed: u64,
}

impl Draft {
    pub(super) fn rig(&self) -> Result<Rig, SignalError> {
        let Base { record, gas, sensors, .. } = &self.base;
        // Some sensors need the stream: they come after it.
        let bare = sensors.each_ref().map(|sensor| Sensor::new(&sensor.channel, sensor.time_constant_s));
        let mut rig = Rig::new(self.rig_seed, record.clone(), gas.clone(), bare)?;
        if let Some(flow) = self.flow {
            rig = rig.with_flow(flow)?;
        }
        if let Some(stream) = self.stream {
            rig = rig.with_stream(stream)?;
        }
        rig = rig.with_sensors(sensors.clone())?;
        if let Some(mismatch) = &self.mismatch {
            rig = rig.with_mismatch(mismatch.clone())?;
        }
        Ok(rig)
    }

    /// Adds one effect, its size drawn from `rng` and multiplied by `by`. Saturation must be placed
    /// last: it looks for the hottest or coldest part of the record that the other effects leave.
    pub(super) fn place(&mut self, kind: Kind, by: f64, rng: &mut impl Rng) -> Result<Placed, SignalError> {
        let channel = usize::from(rng.random::<bool>());
        let (size, channel) = match kind {
            Kind::None => (0.0, None),
            Kind::IdleStream => {
                self.flow_past();
                (0.0, None)
            }
            Kind::VaryingTimeConstant => (self.vary(by, rng), None),
            Kind::FilmTemperature => (self.follow_film(by, rng), None),
            Kind::Separation | Kind::OneSidedFlow => (self.stand_in_stream(kind, channel, by, rng), Some(channel)),
            Kind::InputMismatch => (self.mislead(channel, by, rng), Some(channel)),
            Kind::Saturation => (self.saturate(channel, by, rng)?, Some(channel)),
            Kind::Gain
            | Kind::Offset
            | Kind::Curvature
            | Kind::Drift
            | Kind::MainsPickup
            | Kind::ColouredNoise
            | Kind::Spikes
            | Kind::Quantisation
            | Kind::Crosstalk
            | Kind::IntermittentContact => (self.disturb(kind, channel, by, rng), Some(channel)),
            Kind::SecondOrder
            | Kind::SlowMode
            | Kind::Delay
            | Kind::TemperatureDependentTimeConstant
            | Kind::Radiation
            | Kind::Hysteresis
            | Kind::ClockSlip
            | Kind::Replaced => (self.slow_down(kind, channel, by, rng), Some(channel)),
        };
        Ok(Placed { kind, channel, size })
    }

    fn vary(&mut self, by: f64, rng: &mut impl Rng) -> f64 {
        let depth = (by * log_uniform(0.15, 0.35, rng)).min(0.9);
        let period_s = self.base.length_s() * rng.random_range(0.4..1.2);
        self.flow = Some(Flow::Sine(FlowSine::new(depth, period_s, rng.random_range(0.0..TAU))));
        depth
    }

    /// Puts the stream past the sensors, the same whatever depends on it.
    fn flow_past(&mut self) -> Stream {
        let rng = &mut stream(self.rig_seed, 1 + Kind::IdleStream as u64, Purpose::RandomRig);
        let (mean_m_per_s, depth) = (log_uniform(0.3, 30.0, rng), log_uniform(0.2, 0.5, rng));
        let period_s = self.base.length_s() * rng.random_range(0.1..1.0);
        let stream = Stream::new(mean_m_per_s, depth, period_s, rng.random_range(0.0..TAU));
        self.stream = Some(stream);
        stream
    }

    /// What depends on the velocity of the stream.
    fn stand_in_stream(&mut self, kind: Kind, channel: usize, by: f64, rng: &mut impl Rng) -> f64 {
        let (stream, fast_s) = (self.flow_past(), self.base.fast_s());
        let sensor = &mut self.base.sensors[channel];
        if kind == Kind::Separation {
            sensor.downstream_m = by * stream.mean_m_per_s * fast_s * log_uniform(0.1, 0.3, rng);
            sensor.downstream_m
        } else {
            sensor.stream_exponent = -by * log_uniform(0.2, 0.7, rng);
            sensor.stream_exponent
        }
    }

    fn follow_film(&mut self, by: f64, rng: &mut impl Rng) -> f64 {
        let mean_c = self.base.mean_c;
        // From two standard deviations of the gas below its mean to two above, as where one sensor's own temperature counts.
        let change = by * sign(rng) * log_uniform(0.1, 0.3, rng);
        let exponent = change * (mean_c + ZERO_CELSIUS_K) / (4.0 * self.base.scale_k);
        let of_film = TemperatureDependence::of_film(exponent, mean_c);
        self.base.sensors.iter_mut().for_each(|sensor| sensor.temperature_dependence = Some(of_film));
        exponent
    }

    fn mislead(&mut self, channel: usize, by: f64, rng: &mut impl Rng) -> f64 {
        let std_k = by * self.base.scale_k * log_uniform(0.01, 0.04, rng);
        let mut mismatch = Mismatch::new(std_k, self.base.frequency_hz * log_uniform(1.0, 3.0, rng));
        mismatch.channel = Some(self.base.sensors[channel].channel.clone());
        self.mismatch = Some(mismatch);
        std_k
    }

    fn saturate(&mut self, channel: usize, by: f64, rng: &mut impl Rng) -> Result<f64, SignalError> {
        let fraction = (by * log_uniform(0.03, 0.1, rng)).min(0.5);
        let hot = rng.random::<bool>();
        let mut clean_c = self.rig()?.clean(0)?.readings_c[channel].clone();
        clean_c.sort_by(f64::total_cmp);
        let beyond = (fraction * clean_c.len() as f64).round() as usize;
        let last = clean_c.len() - 1;
        let adc = self.base.sensors[channel].adc.get_or_insert_default();
        if hot {
            adc.high_c = Some(clean_c[last - beyond.min(last)]);
        } else {
            adc.low_c = Some(clean_c[beyond.min(last)]);
        }
        Ok(fraction)
    }

    /// What acts on the reading.
    fn disturb(&mut self, kind: Kind, channel: usize, by: f64, rng: &mut impl Rng) -> f64 {
        let (scale_k, mean_c, length_s) = (self.base.scale_k, self.base.mean_c, self.base.length_s());
        let (noise_k, frequency_hz) = (self.base.noise_std_k[channel], self.base.frequency_hz);
        let sample_period_s = self.base.record.sample_period_s;
        let sensor = &mut self.base.sensors[channel];
        match kind {
            Kind::Gain => {
                // Two of seven read low, by 1 to 2 %; the others high, by 1 to 5 %.
                let error = if rng.random_bool(2.0 / 7.0) {
                    -log_uniform(0.01, 0.02, rng)
                } else {
                    log_uniform(0.01, 0.05, rng)
                };
                sensor.gain = (1.0 + by * error).max(0.01);
                sensor.gain - 1.0
            }
            Kind::Offset => {
                sensor.offset_k = by * sign(rng) * log_uniform(1.0, 4.0, rng);
                sensor.offset_k
            }
            Kind::Curvature => {
                // Were the reading Gaussian, (T − mean)² would have a root mean square of √3
                // scale².
                let rms_k = by * scale_k * log_uniform(0.005, 0.02, rng);
                sensor.curvature_per_k = sign(rng) * rms_k / (3.0_f64.sqrt() * scale_k * scale_k);
                sensor.curvature_about_c = mean_c;
                sensor.curvature_per_k
            }
            Kind::Drift => {
                sensor.drift_k_per_s = by * sign(rng) * log_uniform(1.0, 4.0, rng) / length_s;
                sensor.drift_k_per_s
            }
            Kind::MainsPickup => {
                let amplitude_k = by * noise_k * log_uniform(1.0, 3.0, rng);
                let mains_hz = one_of(&[50.0, 60.0], rng);
                // Clear of the gas; if that is fast, the third harmonic is.
                let mains_hz = if mains_hz > 2.0 * frequency_hz { mains_hz } else { 3.0 * mains_hz };
                sensor.mains.push(Mains::new(mains_hz, amplitude_k, rng.random_range(0.0..TAU)));
                amplitude_k
            }
            Kind::ColouredNoise => {
                let std_k = by * noise_k * log_uniform(1.0, 3.0, rng);
                let correlation_s = sample_period_s * log_uniform(5.0, 30.0, rng);
                sensor.coloured_noise = Some(ColouredNoise::new(std_k, correlation_s));
                std_k
            }
            Kind::Spikes => {
                let size_k = by * noise_k * log_uniform(10.0, 40.0, rng);
                sensor.spikes = Some(Spikes::new(log_uniform(0.002, 0.01, rng), size_k));
                size_k
            }
            Kind::Quantisation => {
                let step_k = by * noise_k * log_uniform(2.0, 6.0, rng);
                sensor.adc.get_or_insert_with(Adc::default).step_k = Some(step_k);
                step_k
            }
            Kind::Crosstalk => {
                sensor.crosstalk = (by * log_uniform(0.02, 0.06, rng)).min(1.0);
                sensor.crosstalk
            }
            _ => {
                let fraction = (by * log_uniform(0.03, 0.1, rng)).min(1.0);
                let episodes = f64::from(rng.random_range(5..=20));
                let duration_s = length_s * log_uniform(0.003, 0.015, rng);
                let mut contact = IntermittentContact::new(episodes / length_s, duration_s, fraction);
                contact.towards_c = Some(AMBIENT_C);
                sensor.intermittent_contact = Some(contact);
                fraction
            }
        }
    }

    /// What acts on the way from the gas to the junction, and on time.
    fn slow_down(&mut self, kind: Kind, channel: usize, by: f64, rng: &mut impl Rng) -> f64 {
        let (scale_k, mean_c, length_s) = (self.base.scale_k, self.base.mean_c, self.base.length_s());
        let (fast_s, slow_s, step_s) = (self.base.fast_s(), self.base.slow_s(), self.base.record.step_s());
        let mean_k = mean_c + ZERO_CELSIUS_K;
        let sensor = &mut self.base.sensors[channel];
        let tau_s = sensor.time_constant_s;
        match kind {
            Kind::SecondOrder => {
                // However small it is asked to be, the integration must follow it.
                let second_s = (by * tau_s * log_uniform(0.1, 0.4, rng)).max(1.5 * step_s);
                sensor.second_time_constant_s = Some(second_s);
                second_s
            }
            Kind::SlowMode => {
                let fraction = (by * log_uniform(0.03, 0.12, rng)).min(1.0);
                sensor.slow_mode = Some(SlowMode { fraction, time_constant_s: slow_s * log_uniform(3.0, 15.0, rng) });
                fraction
            }
            Kind::Delay => {
                sensor.delay_s = by * fast_s * log_uniform(0.1, 0.3, rng);
                sensor.delay_s
            }
            Kind::TemperatureDependentTimeConstant => {
                // From two standard deviations of the gas below its mean to two above.
                let change = by * sign(rng) * log_uniform(0.1, 0.3, rng);
                let exponent = change * mean_k / (4.0 * scale_k);
                sensor.temperature_dependence = Some(TemperatureDependence::new(exponent, mean_c));
                exponent
            }
            Kind::Radiation => {
                let slope = by * log_uniform(0.02, 1.5, rng);
                let coefficient_per_k3 = slope / (4.0 * mean_k.powi(3));
                sensor.radiation = Some(Radiation::new(coefficient_per_k3, mean_c - rng.random_range(50.0..150.0)));
                coefficient_per_k3
            }
            Kind::Hysteresis => {
                let width_k = by * scale_k * log_uniform(0.03, 0.1, rng);
                sensor.hysteresis = Some(Hysteresis::new(width_k));
                width_k
            }
            Kind::ClockSlip => {
                let by_s = by * fast_s * log_uniform(0.2, 0.6, rng);
                sensor.clock_slip = Some(ClockSlip::new(length_s * rng.random_range(0.3..0.7), by_s));
                by_s
            }
            _ => {
                let factor = 1.0 + by * (log_uniform(1.4, 2.0, rng) - 1.0);
                let factor = if rng.random() { factor } else { factor.recip() };
                let other_s = (factor * tau_s).max(1.5 * step_s);
                sensor.replaced = Some(Replaced::new(length_s * rng.random_range(0.3..0.7), other_s));
                other_s / tau_s
            }
        }
    }
}
