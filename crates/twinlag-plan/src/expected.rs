//! What a record of a rig is expected to determine.
//!
//! The record is simulated without noise, and the model with the rig's own effects is fitted to it. With the whitened residual `r` at the
//! fit, `J` its derivatives by the parameters in standard deviations of the noise, `W` the weights of the frequencies, the expected
//! covariance of an estimate from a noisy record is, to first order in the noise,
//!
//! `C = H⁻¹ B H⁻¹`, `H = Jᵀ W J`, `B = Jᵀ W² J`;
//!
//! without weights this is the inverse of Fisher's information `JᵀJ`. This is the covariance that `twinlag` reports of a noisy record, so the
//! two can be compared. What is of second order, noise multiplied by noise, is not in it.

use twinlag::diagnosis::{Observations, Settings, Stretch};
use twinlag::model::{Effort, Fitted, Identifier, Model, Prepared, covariance, dense};
use twinlag::signal::{Rig, Sensor};

use crate::error::PlanError;
use crate::seats;

/// Samples of a record that are simulated: a longer one is taken to go on as it begins. Chosen: it costs time.
pub(crate) const MAX_SAMPLES: usize = 8192;
/// A uniform error over a step of a converter has this part of the step's square as its variance.
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;

/// A record without noise, and the model of the rig fitted to it.
#[derive(Debug)]
pub struct Expected {
    pub(crate) prepared: Prepared,
    pub(crate) fitted: Fitted,
    /// Length of the record over that of the simulated part of it.
    pub(crate) length_ratio: f64,
    /// Covariance of the parameters, where they are determined.
    pub(crate) covariance: Option<Vec<Vec<f64>>>,
    /// Inverse of the information, which is there only where all parameters are determined together.
    inverse: Option<Vec<Vec<f64>>>,
    /// Effects of the rig that no model of the record has.
    pub(crate) missing: Vec<Identifier>,
    /// Standard deviation of the gas, K.
    pub(crate) gas_std_k: f64,
}

impl Expected {
    /// What a record of `rig` determines.
    ///
    /// # Errors
    /// [`PlanError::NoNoise`] for a sensor without noise, [`PlanError::ChangingFlow`], [`PlanError::InStream`];
    /// [`PlanError::Signal`] and [`PlanError::Model`] for a rig that cannot be simulated, and for a record that is too short or never
    /// changes.
    ///
    /// ```
    /// use twinlag::signal::{Broadband, Gas, Noise, Record, Rig, Sensor, Signal};
    /// use twinlag_plan::Expected;
    ///
    /// let mut sensors = [Sensor::new("fine", 0.024), Sensor::new("coarse", 0.117)];
    /// sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.1)));
    /// let gas = Gas::new(300.0, Signal::Broadband(Broadband { std_k: 10.0, corner_hz: 3.0 }));
    /// let rig = Rig::new(1, Record::new(1500, 0.004), gas, sensors)?;
    /// let expected = Expected::of(&rig)?;
    /// let [fine_s, coarse_s] = [0, 1].map(|i| expected.standard_error(i).expect("determined"));
    /// assert!(fine_s < 0.05 * 0.024 && coarse_s < 0.05 * 0.117);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(rig: &Rig) -> Result<Self, PlanError> {
        let noise_std_k = noise_std_k(rig)?;
        if rig.flow().is_some() {
            return Err(PlanError::ChangingFlow);
        }
        let in_stream = |s: &Sensor| s.downstream_m != 0.0 || s.stream_exponent != 0.0;
        if let Some(sensor) = rig.sensors().iter().position(in_stream) {
            return Err(PlanError::InStream { sensor, channel: rig.sensors()[sensor].channel.clone() });
        }
        let mut record = rig.record().clone();
        let all = record.samples;
        record.samples = all.min(MAX_SAMPLES);
        let length_ratio = all as f64 / record.samples as f64;
        let period_s = record.sample_period_s;
        let clean = rig.clone().with_record(record)?.clean(0)?;
        let gas_std_k = std(&clean.gas_c);
        let observations = Observations::new(vec![Stretch::new(clean.time_s, clean.readings_c)], Some(period_s))?;
        let settings = Settings {
            noise_std_k: Some(noise_std_k),
            effects: Identifier::ALL.into_iter().filter(|effect| can_be_planned(*effect)).collect(),
            ..Settings::default()
        };
        let mut prepared = Prepared::new(&observations, &settings)?;
        let tau_s = rig.sensors().each_ref().map(|s| s.time_constant_s.max(s.second_time_constant_s.unwrap_or(0.0)));
        prepared.context.tau_s = tau_s;
        let (effects, missing) = seats::effects(rig, &prepared.context);
        let mut model = Model::new(&[], noise_std_k);
        let mut theta = tau_s.to_vec();
        for (effect, values) in effects {
            model = model.with(effect);
            theta.extend(values);
        }
        let fitted = model.fit(&theta, &prepared.observations, &prepared.everything, Effort::Finish);
        let normal = fitted.model.normal_equations(&fitted.theta, &prepared.observations, &prepared.everything, None);
        let inverse = without_held(&normal.products);
        let covariance = covariance(&fitted, &prepared.observations, &prepared.everything, false);
        Ok(Self { prepared, fitted, length_ratio, covariance, inverse, missing, gas_std_k })
    }

    /// The value of a parameter, time constants first.
    pub fn value(&self, parameter: usize) -> f64 {
        self.fitted.theta[parameter]
    }

    /// The expected standard error of a parameter, time constants first; `None` where the record does not determine it.
    pub fn standard_error(&self, parameter: usize) -> Option<f64> {
        let error = self.error_of(&[(parameter, 1.0)])?;
        // The weights of frequencies may hide that two parameters do the same: the inverse of the information does not.
        let unweighted = (self.inverse.as_ref()?[parameter][parameter] / self.length_ratio).sqrt();
        let is_tau = parameter < 2;
        let is_vague = is_tau && unweighted / self.value(parameter) > self.prepared.policy.vague_log_std;
        (unweighted.is_finite() && !is_vague).then_some(error)
    }

    /// The expected standard error of a sum of parameters, each with its weight.
    pub(crate) fn error_of(&self, sum: &[(usize, f64)]) -> Option<f64> {
        let covariance = self.covariance.as_ref()?;
        let variance: f64 =
            sum.iter().map(|(i, a)| sum.iter().map(|(j, b)| a * b * covariance[*i][*j]).sum::<f64>()).sum();
        let error = (variance / self.length_ratio).sqrt();
        (error.is_finite() && error > 0.0).then_some(error)
    }

    /// The energy that a fit leaves over, all samples of the record counted.
    pub(crate) fn energy(&self, fitted: &Fitted) -> f64 {
        self.length_ratio * fitted.chi2
    }

    /// Number of residuals of a fit as it weighs frequencies, all samples of the record counted.
    pub(crate) fn residual_count(&self) -> f64 {
        self.length_ratio * self.fitted.count.max(1.0)
    }
}

/// The inverse of a matrix; of parameters that are held, whose rows are zero, that is zero as well.
fn without_held(products: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let free: Vec<usize> = (0..products.len()).filter(|i| products[*i][*i] > 0.0).collect();
    let of_free: Vec<Vec<f64>> = free.iter().map(|i| free.iter().map(|j| products[*i][*j]).collect()).collect();
    let inverse = dense::inverse(&of_free)?;
    let mut out = vec![vec![0.0; products.len()]; products.len()];
    for (a, i) in free.iter().enumerate() {
        free.iter().enumerate().for_each(|(b, j)| out[*i][*j] = inverse[a][b]);
    }
    Some(out)
}

/// Whether an effect can be in a plan: defects of data and steady lines are no part of what the sensors do.
fn can_be_planned(effect: Identifier) -> bool {
    !effect.about().is_defect && !effect.about().is_narrow
}

/// White noise of both channels, K: that of the sensor, and the rounding of its converter.
fn noise_std_k(rig: &Rig) -> Result<[f64; 2], PlanError> {
    let mut out = [0.0; 2];
    for (i, sensor) in rig.sensors().iter().enumerate() {
        let white_k = sensor.noise.map_or(0.0, |noise| noise.std_k);
        let step_k = sensor.adc.as_ref().and_then(|adc| adc.step_k).unwrap_or(0.0);
        out[i] = (white_k * white_k + ROUNDING_VARIANCE * step_k * step_k).sqrt();
        if out[i] <= 0.0 {
            return Err(PlanError::NoNoise { sensor: i, channel: sensor.channel.clone() });
        }
    }
    Ok(out)
}

fn std(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}
