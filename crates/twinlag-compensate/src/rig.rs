//! Two sensors in one gas: what is known of them when the gas temperature is asked for.

#[cfg(feature = "std")]
use num_complex::Complex64;
#[cfg(feature = "std")]
use serde::{Deserialize, Serialize};

#[cfg(feature = "std")]
use crate::error::CompensateError;

/// Noise that keeps its value for a while: first-order noise, autocovariance `σ² exp(−|t|/t_c)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize))]
pub struct Coloured {
    /// Standard deviation `σ`, K.
    pub std_k: f64,
    /// Correlation time `t_c`, s.
    pub correlation_s: f64,
}

impl Coloured {
    /// Two-sided spectral density at `frequency_hz`, K²/Hz.
    #[cfg(feature = "std")]
    pub fn density_k2_per_hz(&self, frequency_hz: f64) -> f64 {
        let angle = core::f64::consts::TAU * frequency_hz * self.correlation_s;
        2.0 * self.std_k * self.std_k * self.correlation_s / (1.0 + angle * angle)
    }
}

/// A slow path beside the direct one: `(1 − φ) + φ/(1 + τ_s s)` of what the direct path gives.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize))]
pub struct SlowPath {
    /// Share `φ`.
    pub share: f64,
    /// Time constant `τ_s`, s.
    pub tau_s: f64,
}

/// One sensor: `τ dT/dt = x − T − loss`, followed by a second lag, a slow path and noise if it has
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize))]
pub struct Sensor {
    /// Time constant `τ`, s.
    pub tau_s: f64,
    /// Time constant of a second lag in series, s.
    pub second_tau_s: Option<f64>,
    /// A slow path beside the direct one.
    pub slow: Option<SlowPath>,
    /// White noise of its reading, K.
    pub noise_std_k: f64,
    /// Noise of its reading that is not white.
    pub coloured: Option<Coloured>,
}

impl Sensor {
    /// A first-order sensor with white noise.
    pub const fn new(tau_s: f64, noise_std_k: f64) -> Self {
        Self { tau_s, second_tau_s: None, slow: None, noise_std_k, coloured: None }
    }

    /// Frequency response of the sensor at `frequency_hz`, without losses.
    ///
    /// ```
    /// use twinlag_compensate::Sensor;
    ///
    /// let sensor = Sensor::new(0.1, 0.2);
    /// let corner_hz = 1.0 / (std::f64::consts::TAU * 0.1);
    /// assert!((sensor.response(corner_hz).norm_sqr() - 0.5).abs() < 1e-12); // half of the power, to rounding
    /// // A second lag in series takes more away.
    /// let second = Sensor { second_tau_s: Some(0.02), ..sensor };
    /// assert!(second.response(corner_hz).norm() < sensor.response(corner_hz).norm());
    /// ```
    #[cfg(feature = "std")]
    pub fn response(&self, frequency_hz: f64) -> Complex64 {
        let s = |tau_s: f64| Complex64::new(0.0, core::f64::consts::TAU * frequency_hz * tau_s);
        let mut response = 1.0 / (1.0 + s(self.tau_s));
        if let Some(tau_s) = self.second_tau_s {
            response /= 1.0 + s(tau_s);
        }
        if let Some(SlowPath { share, tau_s }) = self.slow {
            response *= 1.0 - share + share / (1.0 + s(tau_s));
        }
        response
    }

    /// Two-sided spectral density of its noise at `frequency_hz`, read every `period_s`, K²/Hz.
    #[cfg(feature = "std")]
    pub fn noise_density_k2_per_hz(&self, frequency_hz: f64, period_s: f64) -> f64 {
        self.noise_std_k * self.noise_std_k * period_s
            + self.coloured.map_or(0.0, |noise| noise.density_k2_per_hz(frequency_hz))
    }
}

/// Both sensors and what they share.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize))]
pub struct Rig {
    /// The sensors.
    pub sensors: [Sensor; 2],
    /// How much later the second channel is, s.
    pub delay_s: f64,
    /// The channel, 0 or 1, whose clock the gas is wanted by.
    pub clock: usize,
    /// What the gas at the second sensor has that the gas at the first has not: half of it is added
    /// to the gas at one and taken from that at the other.
    pub mismatch: Option<Coloured>,
}

impl Rig {
    /// Two sensors in the same gas.
    pub const fn new(sensors: [Sensor; 2]) -> Self {
        Self { sensors, delay_s: 0.0, clock: 0, mismatch: None }
    }

    /// This rig with the standard deviation of each sensor's white noise multiplied by a factor.
    ///
    /// ```
    /// use twinlag_compensate::{Rig, Sensor};
    ///
    /// let rig = Rig::new([Sensor::new(0.02, 0.1), Sensor::new(0.1, 0.1)]).with_noise_times([2.0, 1.0]);
    /// assert_eq!(rig.sensors.map(|sensor| sensor.noise_std_k), [0.2, 0.1]);
    /// ```
    #[must_use]
    pub fn with_noise_times(mut self, factors: [f64; 2]) -> Self {
        self.sensors.iter_mut().zip(factors).for_each(|(sensor, factor)| sensor.noise_std_k *= factor);
        self
    }
}

#[cfg(feature = "std")]
impl Rig {
    /// What each reading has of the gas at `frequency_hz`: of the second channel with its delay.
    pub(crate) fn responses(&self, frequency_hz: f64) -> [Complex64; 2] {
        let [first, second] = self.sensors.each_ref().map(|sensor| sensor.response(frequency_hz));
        [first, second * Complex64::cis(-core::f64::consts::TAU * frequency_hz * self.delay_s)]
    }

    pub(crate) fn check(&self) -> Result<(), CompensateError> {
        let positive = |what: &str, got: f64| {
            let is_good = got.is_finite() && got > 0.0;
            if is_good { Ok(()) } else { Err(CompensateError::NotPositive { what: what.into(), got }) }
        };
        for (i, sensor) in self.sensors.iter().enumerate() {
            let name = i + 1;
            positive(&format!("the time constant of sensor {name}"), sensor.tau_s)?;
            positive(&format!("the noise of sensor {name}"), sensor.noise_std_k)?;
            if let Some(tau_s) = sensor.second_tau_s {
                positive(&format!("the second time constant of sensor {name}"), tau_s)?;
            }
            if let Some(slow) = sensor.slow {
                positive(&format!("the slow time constant of sensor {name}"), slow.tau_s)?;
            }
            if let Some(noise) = sensor.coloured {
                positive(&format!("the correlation time of the noise of sensor {name}"), noise.correlation_s)?;
            }
        }
        self.mismatch.map_or(Ok(()), |m| positive("the correlation time of the mismatch", m.correlation_s))
    }

    /// Two-sided spectral density of the noise of both inferred gas temperatures together at
    /// `frequency_hz`, read every `period_s`, K²/Hz: `1/Σ |H_i|²/N_i`, and a quarter of the
    /// mismatch's.
    pub fn noise_density_k2_per_hz(&self, frequency_hz: f64, period_s: f64) -> f64 {
        let information: f64 = self
            .sensors
            .iter()
            .map(|s| s.response(frequency_hz).norm_sqr() / s.noise_density_k2_per_hz(frequency_hz, period_s))
            .sum();
        1.0 / information + self.mismatch.map_or(0.0, |m| 0.25 * m.density_k2_per_hz(frequency_hz))
    }
}

/// The state of a sensor at one instant, for sensors that change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorAt {
    /// Time constant at this instant over [`Sensor::tau_s`].
    pub tau_factor: f64,
    /// Loss by radiation at the reading, K.
    pub loss_k: f64,
    /// Derivative of that with respect to its temperature.
    pub loss_slope: f64,
}
