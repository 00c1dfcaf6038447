//! How far the slow body of a sensor was from the gas when a record began.
//!
//! Whatever a slow body's temperature was at first, what is left of it decays as `e^(−t/τ_s)`, and the inverse of a slow path takes just
//! that off: the residual says nothing of it. What it leaves out is one number for each record, which is found here. Where the body had
//! the temperature of the gas, that number is noise.

use std::sync::Arc;

use num_dual::DualNum;

use crate::chain::Chain;
use crate::dense;
use crate::directions::{constants, moved};
use crate::disagreement::{Disagreement, is_long_enough, reading_variances};
use crate::effect::Shared;
use crate::fit::Fitted;
use crate::inverse::Inverse;
use crate::number::{Number, Real};
use crate::observations::{Cut, Observations, Stretch};
use crate::plant::{Plant, SlowPath};
use crate::selection::Selection;
use crate::summary::covariance;
use crate::whitening::Factor;

/// Slow time constants after the start of a record from which on nothing is left of a first state: `e⁻⁵`, less than a hundredth.
const MEMORY_TIME_CONSTANTS: f64 = 5.0;

/// What one record says of the first temperature of the slow body of a sensor.
///
/// With the inverses `x` and `x'` of the sensor without its slow path and of the other one, and the body `b` that follows `x'` from the
/// other sensor's first temperature on, `e = x − (1 − φ) x' − φ b` is noise where the body began there. Where it began `A` elsewhere,
/// `φ A e^(−t/τ_s)` is added. The departure is the generalised least-squares estimate of that over its standard deviation: it has zero
/// mean and unit variance beforehand, and shares nothing with the residual of the slow path.
#[derive(Clone, Debug)]
pub struct FirstState {
    sensor: usize,
    stretch: Arc<Stretch>,
    /// Samples of the stretch in which something is left of the first state.
    samples: usize,
    period_s: Option<f64>,
    step_s: f64,
    /// Of each value of `e` in the departure.
    weights: Vec<f64>,
    /// Standard deviation of the departure where the body may have begun anywhere that the gas has been.
    free_std: f64,
}

impl FirstState {
    /// What each of the records says under `plant`; nothing of one that is too short for the slow path, and nothing at all unless this
    /// sensor alone has one.
    pub(crate) fn of_records(plant: &Plant, sensor: usize, observations: &Observations) -> Vec<Self> {
        let Some(slow) = plant.sensors[sensor].slow.filter(|_| plant.sensors[1 - sensor].slow.is_none()) else {
            return Vec::new();
        };
        let is_first = |index: &usize| {
            let stretches = &observations.stretches;
            index.checked_sub(1).is_none_or(|before| stretches[before].member != stretches[*index].member)
        };
        let first = (0..observations.stretches.len()).filter(is_first).map(|index| &observations.stretches[index]);
        first.filter_map(|stretch| Self::of(plant, sensor, slow, stretch, observations)).collect()
    }

    fn of(
        plant: &Plant,
        sensor: usize,
        slow: SlowPath,
        stretch: &Arc<Stretch>,
        observations: &Observations,
    ) -> Option<Self> {
        let (is_even, step_s) = (observations.period_s.is_some(), observations.step_s());
        if !is_long_enough(stretch, plant, is_even) {
            return None;
        }
        let start_s = stretch.time_s.at(0);
        let remembered = stretch.time_s.first_not_before(start_s + MEMORY_TIME_CONSTANTS * slow.tau_s.re);
        let samples = remembered.max(plant.consumed(is_even) + 1).min(stretch.len());
        let direct = without_slow(plant, sensor);
        let mut noise = Disagreement::<f64>::empty();
        noise.inverse.invert(&direct, stretch.cut(0..samples), observations.period_s);
        let decays = |time_s: &f64| (-(time_s - start_s) / slow.tau_s.re).exp();
        let mut decay: Vec<f64> = noise.inverse.chains[0].times_s().iter().map(decays).collect();
        plant.extra.iter().for_each(|extra| difference(&mut decay, extra.rho(observations.step_s())));
        noise.compare(&direct, observations.step_s());
        let variances = reading_variances(plant.noise_std_k, stretch, observations.swing_k());
        let mut factor = Factor::empty();
        factor.compute(&noise.sources(&variances, 0), decay.len(), None, None);
        factor.whiten(&mut decay, 0, 0);
        let inverse_std = dense::dot(&decay, &decay).sqrt();
        factor.unwhiten_transposed(&mut decay);
        // The first reading that the body begins at has noise as well.
        let begins_std_k = slow.share.re * plant.noise_std_k[1 - sensor] * stretch.noise_factor[1 - sensor];
        let std = (begins_std_k * inverse_std).hypot(1.0);
        let [_, gas_std_k] = observations.mean_and_std(1 - sensor);
        let out = Self {
            sensor,
            stretch: Arc::clone(stretch),
            samples,
            period_s: observations.period_s,
            step_s,
            weights: decay.iter().map(|w| w / (inverse_std * std)).collect(),
            free_std: slow.share.re * gas_std_k * inverse_std / std,
        };
        out.weights.iter().all(|w| w.is_finite()).then_some(out)
    }

    /// The record that it is of, from 0.
    pub(crate) fn record(&self) -> usize {
        self.stretch.member
    }

    /// The departure from equilibrium under `plant`, in standard deviations.
    pub(crate) fn departure(&self, plant: &Plant) -> Number {
        let Some(slow) = plant.sensors[self.sensor].slow else { return Number::from(0.0) };
        let cut = self.stretch.cut(0..self.samples);
        let mut left = beside_the_body(plant, self.sensor, slow, cut, self.period_s);
        plant.extra.iter().for_each(|extra| difference(&mut left, extra.rho(self.step_s)));
        left.iter().zip(&self.weights).map(|(value, weight)| *value * *weight).sum()
    }
}

/// A rig whose sensor has no slow path.
fn without_slow(plant: &Plant, sensor: usize) -> Plant {
    let mut direct = plant.clone();
    direct.sensors[sensor].slow = None;
    direct
}

/// `x − (1 − φ) x' − φ b`, the body `b` having the other sensor's temperature at the first sample, and following it up to the first
/// value of the inverses, and from there on the gas.
fn beside_the_body(plant: &Plant, sensor: usize, slow: SlowPath, cut: Cut<'_>, period_s: Option<f64>) -> Vec<Number> {
    let mut readings = [0, 1].map(|i| Chain::<Number>::of(cut, i, period_s));
    plant.correct(&mut readings, [true; 2]);
    let mut inverse = Inverse::empty();
    inverse.invert(&without_slow(plant, sensor), cut, period_s);
    let [own, gas] = [sensor, 1 - sensor].map(|i| &inverse.chains[i]);
    let reading = &readings[1 - sensor];
    let first_s = gas.times_s()[0];
    let before = reading.times_s().iter().zip(&reading.value).take_while(|(time_s, _)| **time_s < first_s);
    let mut body = Body { temperature_c: reading.value[0], at_s: reading.times_s()[0], gas_c: reading.value[0] };
    before.for_each(|(time_s, reading_c)| body.follow(*time_s, *reading_c, slow.tau_s));
    let left = gas.times_s().iter().zip(&gas.value).zip(&own.value).map(|((time_s, gas_c), own_c)| {
        body.follow(*time_s, *gas_c, slow.tau_s);
        *own_c - (-slow.share + 1.0) * gas_c - slow.share * body.temperature_c
    });
    left.collect()
}

/// A slow body in a gas whose temperature goes in straight lines.
struct Body {
    temperature_c: Number,
    at_s: f64,
    gas_c: Number,
}

impl Body {
    /// On to the next instant, at which the gas has a temperature, °C. That the gas counts with its mean over the step is wrong by the
    /// square of the step over the time constant.
    fn follow(&mut self, time_s: f64, gas_c: Number, tau_s: Number) {
        let keep = (tau_s.recip() * (self.at_s - time_s)).exp();
        self.temperature_c = self.temperature_c * keep + (self.gas_c + gas_c) * 0.5 * (-keep + 1.0);
        (self.at_s, self.gas_c) = (time_s, gas_c);
    }
}

/// `v[k+1] − ρ v[k]`.
fn difference<T: Real>(values: &mut Vec<T>, rho: f64) {
    let count = values.len().saturating_sub(1);
    for k in 0..count {
        values[k] = values[k + 1] - values[k] * rho;
    }
    values.truncate(count);
}

impl Fitted {
    /// Effect `index` with the body that it holds in equilibrium with the gas as each record began, and the logarithm of the odds for
    /// that against a body that may have begun anywhere the gas has been; `None` of an effect that holds no such body.
    ///
    /// Under either, the departures from equilibrium are normal about zero, with the covariance that they have by themselves and by
    /// the uncertainty of the parameters, and in the second case by the spread of the gas: the odds are the ratio of their densities.
    pub fn in_equilibrium(
        &self,
        index: usize,
        observations: &Observations,
        selection: &Selection,
    ) -> Option<(Shared, f64)> {
        let plant = self.model.plant(&self.theta, observations);
        let effect = self.model.effects[index].in_equilibrium(&plant, observations)?;
        let covariance = covariance(self, observations, selection, false)?;
        let states = effect.first_states();
        let departures = |theta: &[Number]| -> Vec<Number> {
            let plant = self.model.plant_of(theta, observations);
            states.iter().map(|state| state.departure(&plant)).collect()
        };
        let at: Vec<f64> = departures(&constants(&self.theta)).iter().map(|z| z.re).collect();
        let slopes: Vec<Vec<f64>> =
            (0..self.theta.len()).map(|i| departures(&moved(&self.theta, i)).iter().map(|z| z.eps).collect()).collect();
        let by_parameters = |a: usize, b: usize| -> f64 {
            let along = |i: usize| (0..slopes.len()).map(|j| covariance[i][j] * slopes[j][b]).sum::<f64>();
            (0..slopes.len()).map(|i| slopes[i][a] * along(i)).sum()
        };
        let density = |spread: &dyn Fn(&FirstState) -> f64| {
            let of =
                |a: usize, b: usize| by_parameters(a, b) + if a == b { 1.0 + spread(&states[a]).powi(2) } else { 0.0 };
            let covariance: Vec<Vec<f64>> =
                (0..states.len()).map(|a| (0..states.len()).map(|b| of(a, b)).collect()).collect();
            let square = dense::dot(&at, &dense::times(&dense::inverse(&covariance)?, &at));
            Some(-0.5 * (dense::log_determinant(&covariance)? + square))
        };
        let log_odds = density(&|_| 0.0)? - density(&|state| state.free_std)?;
        Some((effect, log_odds))
    }
}

#[cfg(test)]
mod tests {
    use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, SlowMode as Support, Turbulence};

    use super::*;
    use crate::effect::{Identifier, candidates};
    use crate::model::Model;
    use crate::prepare::Prepared;
    use crate::settings::Settings;

    const TAU_S: [f64; 2] = [0.1, 0.3];
    const NOISE_K: f64 = 0.05;
    const SHARE: f64 = 0.08;
    const SLOW_S: f64 = 4.0;
    /// True parameters, those of the slow path last.
    const TRUTH: [f64; 4] = [TAU_S[0], TAU_S[1], SHARE, SLOW_S];

    /// A record of a rig whose second sensor has a support, which has been in the gas for a while before.
    fn record(seed: u64, settled_s: f64) -> Observations {
        let mut sensors = [0, 1].map(|i| Sensor::new(format!("T{i}"), TAU_S[i]));
        sensors.iter_mut().for_each(|s| s.noise = Some(Noise::white(NOISE_K)));
        sensors[1].slow_mode = Some(Support { fraction: SHARE, time_constant_s: SLOW_S });
        let gas = Gas::new(300.0, Signal::Turbulence(Turbulence { std_k: 5.0, corner_hz: 0.05, cutoff_hz: 2.0 }));
        let mut form = Record::new(1000, 0.02);
        form.settle_s = Some(settled_s);
        let record = Rig::new(seed, form, gas, sensors).expect("a rig").simulate().expect("a record");
        let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
        Observations::new(vec![stretch], Some(0.02)).expect("a record")
    }

    fn model(observations: &Observations) -> Model {
        let context = Prepared::new(observations, &Settings::default()).expect("a record").context;
        Model::new(&[], [NOISE_K; 2]).with(candidates(&[Identifier::SLOW_MODE], &context).remove(1))
    }

    fn departure(observations: &Observations) -> f64 {
        let plant = model(observations).plant(&TRUTH, observations);
        FirstState::of_records(&plant, 1, observations)[0].departure(&plant).re
    }

    /// Of a support in equilibrium it is normal with zero mean and unit variance: of a hundred, the mean is off by a tenth and the mean
    /// square by a seventh, and the bounds are four times that. Of one that has been in the gas for some of its time constants it is not,
    /// in most of a few records.
    #[test]
    fn a_departure_is_noise_where_there_was_equilibrium() {
        let at: Vec<f64> = (0..100).map(|seed| departure(&record(seed, 0.0))).collect();
        let of = |power: i32| at.iter().map(|z| z.powi(power)).sum::<f64>() / at.len() as f64;
        assert!(of(1).abs() < 0.4 && (of(2) - 1.0).abs() < 4.0 * (2.0_f64 / 100.0).sqrt(), "{} and {}", of(1), of(2));
        let elsewhere = (0..10).filter(|seed| departure(&record(*seed, 5.0 * SLOW_S)).abs() > 4.0).count();
        assert!(elsewhere >= 6, "{elsewhere} of ten");
    }

    /// Its derivative by each parameter is that of central differences, wrong by their third derivative: `1e-8` of the second power of
    /// the number itself.
    #[test]
    fn derivatives_of_a_departure_are_exact() {
        let observations = record(3, 0.0);
        let model = model(&observations);
        let at = |theta: &[Number]| model.plant_of(theta, &observations);
        let state = &FirstState::of_records(&at(&constants(&TRUTH)), 1, &observations)[0];
        for i in 0..TRUTH.len() {
            let got = state.departure(&at(&moved(&TRUTH, i))).eps;
            let step = 1e-4 * TRUTH[i];
            let [above, below] = [step, -step].map(|by| {
                let mut theta = TRUTH;
                theta[i] += by;
                state.departure(&at(&constants(&theta))).re
            });
            let want = (above - below) / (2.0 * step);
            assert!((got - want).abs() < 1e-5 * want.abs().max(1.0), "parameter {i}: got {got}, want {want}");
        }
    }
}
