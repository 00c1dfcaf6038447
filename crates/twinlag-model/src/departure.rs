//! How far the slow body of a sensor was from the gas when a record began.
//!
//! Whatever temperature a slow body had at first, what is left of it decays as `exp(−t/τ_s)`, and the inverse of a slow path takes just
//! that away: the residual says nothing of it. One number for each record does. Where the body had the temperature of the gas, that
//! number is noise. Derivation: section 8 of `docs/src/theory.md`.

use std::sync::Arc;

use num_dual::DualNum;

use crate::chain::{Chain, difference};
use crate::dense;
use crate::directions::{constants, moved};
use crate::disagreement::{Disagreement, is_long_enough, reading_variances};
use crate::effect::Shared;
use crate::fit::Fitted;
use crate::inverse::Inverse;
use crate::number::Number;
use crate::observations::{Observations, Stretch};
use crate::plant::{Place, Plant, SlowPath};
use crate::selection::Selection;
use crate::summary::covariance;
use crate::whitening::Factor;

/// Slow time constants after the start of a record from which on nothing is left of a first state: `e⁻⁵`, less than a hundredth.
const MEMORY_TIME_CONSTANTS: f64 = 5.0;

/// How far from equilibrium with the gas one record says that the slow body of a sensor began, in standard deviations.
///
/// Let `x_a` be the inverse of the sensor without its slow path, `x_b` that of the other one, and `b` a body that follows `x_b` from the
/// other sensor's first temperature on. Then `v = x_a − (1 − φ) x_b − φ b` is noise if the slow body began there, and has
/// `φ A exp(−t/τ_s)` added if it began `A` away. The departure is the generalised least-squares estimate of that over its standard
/// deviation. An effect that holds a body makes them; there is no other constructor.
#[derive(Clone, Debug)]
pub struct Departure {
    sensor: usize,
    stretch: Arc<Stretch>,
    /// Samples of the stretch in which something is left of the first state.
    samples: usize,
    period_s: Option<f64>,
    step_s: f64,
    /// Weight of each value of `v` in the departure.
    weights: Vec<f64>,
    operators: Operators,
    /// Standard deviation of the departure where the body may have begun anywhere that the gas has been.
    free_std: f64,
}

/// Which operators lie between readings and the values that the weights are of: values that all of them take, how far a delay reaches,
/// and what is left of each noise with a memory after a sample.
type Operators = (usize, usize, Vec<f64>);

fn operators(plant: &Plant, is_even: bool, step_s: f64) -> Operators {
    let reach = if plant.has_delay() { plant.reach } else { 0 };
    (plant.consumed(is_even), reach, plant.extra.iter().map(|extra| extra.rho(step_s)).collect())
}

impl Departure {
    /// What each of the records says under `plant`; nothing of one that is too short for the slow path or that begins with a masked
    /// reading, and nothing at all unless this sensor alone has a slow path.
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
        let other = 1 - sensor;
        if !is_long_enough(stretch, plant, is_even) || stretch.masked[other][0] {
            return None;
        }
        let start_s = stretch.time_s.at(0);
        let remembered = stretch.time_s.first_not_before(start_s + MEMORY_TIME_CONSTANTS * slow.tau_s.re);
        let samples = remembered.max(2 * plant.consumed(is_even)).min(stretch.len());
        let direct = without_slow(plant, sensor);
        let mut noise = Disagreement::<f64>::empty();
        noise.inverse.invert(&direct, stretch.cut(0..samples), observations.period_s);
        // The body takes up noise of the other sensor as well: half its share, for weights that decay as it does.
        noise.inverse.chains[other].rows.scale(1.0 - 0.5 * slow.share.re);
        let decays = |time_s: &f64| (-(time_s - start_s) / slow.tau_s.re).exp();
        let mut decay: Vec<f64> = noise.inverse.chains[0].times_s().iter().map(decays).collect();
        plant.extra.iter().for_each(|extra| difference(&mut decay, extra.rho(step_s)));
        noise.compare(&direct, step_s);
        let variances = reading_variances(plant.noise_std_k, stretch, observations.swing_k());
        let mut factor = Factor::empty();
        factor.compute(&noise.sources(&variances, 0), decay.len(), None, None);
        factor.whiten(&mut decay, 0, 0);
        let inverse_std = dense::dot(&decay, &decay).sqrt();
        factor.unwhiten_transposed(&mut decay);
        let std = (slow.share.re * first_reading_std_k(plant, other, stretch) * inverse_std).hypot(1.0);
        let [_, gas_std_k] = observations.of_member(stretch.member).mean_and_std(other);
        let out = Self {
            sensor,
            stretch: Arc::clone(stretch),
            samples,
            period_s: observations.period_s,
            step_s,
            weights: decay.iter().map(|w| w / (inverse_std * std)).collect(),
            operators: operators(plant, is_even, step_s),
            free_std: slow.share.re * gas_std_k * inverse_std / std,
        };
        out.weights.iter().all(|w| w.is_finite()).then_some(out)
    }

    /// Whether it says anything of `observations` under `plant`: they have the beginning of its record, in one piece, and the operators
    /// are those that its weights were made for. Elsewhere the body may have begun anywhere.
    pub(crate) fn counts_in(&self, observations: &Observations, plant: &Plant) -> bool {
        observations.stretches.iter().any(|stretch| Arc::ptr_eq(stretch, &self.stretch))
            && plant.sensors[1 - self.sensor].slow.is_none()
            && operators(plant, self.period_s.is_some(), self.step_s) == self.operators
    }

    /// The departure under `plant`, in standard deviations.
    pub(crate) fn value(&self, plant: &Plant) -> Number {
        let Some(slow) = plant.sensors[self.sensor].slow else { return Number::from(0.0) };
        let mut left = self.beside_the_body(plant, slow);
        plant.extra.iter().for_each(|extra| difference(&mut left, extra.rho(self.step_s)));
        debug_assert_eq!(left.len(), self.weights.len(), "as many as the operators leave");
        left.iter().zip(&self.weights).map(|(value, weight)| *value * *weight).sum()
    }

    /// `x_a − (1 − φ) x_b − φ b`, with a body `b` that has the other sensor's temperature at the first sample and follows the gas from
    /// there on.
    fn beside_the_body(&self, plant: &Plant, slow: SlowPath) -> Vec<Number> {
        let (cut, other) = (self.stretch.cut(0..self.samples), 1 - self.sensor);
        let mut readings = [0, 1].map(|i| Chain::<Number>::of(cut, i, self.period_s));
        plant.correct(&mut readings, [true; 2]);
        if let Some(rest) = &plant.sensors[other].rest {
            // At rest the gas is hotter than a sensor that loses heat.
            readings[other].map(rest);
        }
        let direct = without_slow(plant, self.sensor);
        let mut inverse = Inverse::empty();
        inverse.invert(&direct, cut, self.period_s);
        let [own, gas] = [self.sensor, other].map(|i| &inverse.chains[i]);
        let (start_s, first_s) = (readings[other].times_s()[0], gas.times_s()[0]);
        let mut body = Body {
            temperature_c: readings[other].value[0],
            at_s: Number::from(start_s),
            gas_c: readings[other].value[0],
        };
        let is_masked = |gas: &Chain<Number>, k: usize| {
            let first = gas.rows.start + k;
            self.stretch.masked[other][first..(first + gas.rows.width).min(self.samples)].contains(&true)
        };
        if plant.has_delay() {
            // The first values with a delay come late; those without one show the gas before them.
            let prompt = Plant { delay_s: None, separation: None, ..direct };
            let mut at_once = Inverse::empty();
            at_once.invert(&prompt, cut, self.period_s);
            let gas = &at_once.chains[other];
            let late_s = if other == 1 { plant.delay_at(start_s) } else { Number::from(0.0) };
            for (k, (time_s, gas_c)) in gas.times_s().iter().zip(&gas.value).enumerate() {
                let time_s = -late_s + *time_s;
                if start_s < time_s.re && time_s.re < first_s && !is_masked(gas, k) {
                    body.follow(time_s, *gas_c, slow.tau_s);
                }
            }
        }
        let left =
            gas.times_s().iter().zip(&gas.value).zip(&own.value).enumerate().map(|(k, ((time_s, gas_c), own_c))| {
                if !is_masked(gas, k) {
                    body.follow(Number::from(*time_s), *gas_c, slow.tau_s);
                }
                *own_c - (-slow.share + 1.0) * gas_c - slow.share * body.temperature_c
            });
        left.collect()
    }
}

/// Noise of the other sensor's first temperature, at which the body begins, K.
fn first_reading_std_k(plant: &Plant, other: usize, stretch: &Stretch) -> f64 {
    let white_k = plant.noise_std_k[other] * stretch.noise_factor[other];
    let extra = plant.extra.iter().filter(|extra| extra.place != Place::Reading(1 - other));
    let variance_k2 = white_k * white_k + extra.map(|extra| extra.std_k * extra.std_k).sum::<f64>();
    variance_k2.sqrt() / plant.sensors[other].reading.gain.re.abs()
}

/// A rig whose sensor has no slow path.
fn without_slow(plant: &Plant, sensor: usize) -> Plant {
    let mut direct = plant.clone();
    direct.sensors[sensor].slow = None;
    direct
}

/// A slow body in a gas whose temperature goes in straight lines.
struct Body {
    temperature_c: Number,
    at_s: Number,
    gas_c: Number,
}

impl Body {
    /// On to an instant at which the gas has a temperature, °C. That the gas counts with its mean over the step is wrong by the square
    /// of the step over the time constant.
    fn follow(&mut self, time_s: Number, gas_c: Number, tau_s: Number) {
        let keep = (tau_s.recip() * (self.at_s - time_s)).exp();
        self.temperature_c = self.temperature_c * keep + (self.gas_c + gas_c) * 0.5 * (-keep + 1.0);
        (self.at_s, self.gas_c) = (time_s, gas_c);
    }
}

impl Fitted {
    /// Effect `index` with the body that it holds in equilibrium with the gas as each record began, and the logarithm of the odds for
    /// that against a body that may have begun anywhere the gas has been; `None` of an effect that holds no such body.
    ///
    /// Under either, the departures from equilibrium are normal about zero, with the covariance that they have by themselves and by
    /// the uncertainty of the parameters, and in the second case by the spread of the gas: the odds are the ratio of their densities.
    ///
    /// # Panics
    /// If there is no effect `index`.
    pub fn in_equilibrium(
        &self,
        index: usize,
        observations: &Observations,
        selection: &Selection,
    ) -> Option<(Shared, f64)> {
        let plant = self.model.plant(&self.theta, observations);
        let effect = self.model.effects[index].in_equilibrium(&plant, observations)?;
        let covariance = covariance(self, observations, selection, false)?;
        let states = effect.departures();
        let departures = |theta: &[Number]| -> Vec<Number> {
            let plant = self.model.plant_of(theta, observations);
            states.iter().map(|state| state.value(&plant)).collect()
        };
        let at: Vec<f64> = departures(&constants(&self.theta)).iter().map(|z| z.re).collect();
        let slopes: Vec<Vec<f64>> =
            (0..self.theta.len()).map(|i| departures(&moved(&self.theta, i)).iter().map(|z| z.eps).collect()).collect();
        let by_parameters = |a: usize, b: usize| -> f64 {
            let along = |i: usize| (0..slopes.len()).map(|j| covariance[i][j] * slopes[j][b]).sum::<f64>();
            (0..slopes.len()).map(|i| slopes[i][a] * along(i)).sum()
        };
        let density = |spread: &dyn Fn(&Departure) -> f64| {
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
    use twinlag_signal::{ColouredNoise, Gas, Noise, Record, Rig, Sensor, Signal, SlowMode, Turbulence};

    use super::*;
    use crate::effect::{Identifier, candidates};
    use crate::model::Model;
    use crate::plant::Extra;
    use crate::prepare::Prepared;
    use crate::settings::Settings;

    const PERIOD_S: f64 = 0.02;
    const TAU_S: [f64; 2] = [0.1, 0.3];
    const SLOW_S: f64 = 4.0;
    const DELAY_S: f64 = 0.13;
    const COLOURED: (f64, f64) = (0.1, 0.2);

    /// A rig whose sensor has a support, and what is done to its record.
    #[derive(Clone, Copy)]
    struct Case {
        sensor: usize,
        share: f64,
        noise_k: [f64; 2],
        /// Delay of channel 2, s.
        delay_s: f64,
        /// The channel whose noise has a memory as well.
        coloured: Option<usize>,
        /// Every third interval is twice as long.
        is_uneven: bool,
        /// One reading in twenty of the other sensor is masked, and off by a hundred times the noise.
        is_masked: bool,
        /// How long the sensors have been in the gas as the record begins.
        settled_s: f64,
    }

    const PLAIN: Case = Case {
        sensor: 1,
        share: 0.08,
        noise_k: [0.05; 2],
        delay_s: 0.0,
        coloured: None,
        is_uneven: false,
        is_masked: false,
        settled_s: 0.0,
    };

    fn record(case: Case, seed: u64) -> Observations {
        let mut sensors = [0, 1].map(|i| Sensor::new(format!("T{i}"), TAU_S[i]));
        for (sensor, std_k) in sensors.iter_mut().zip(case.noise_k) {
            sensor.noise = Some(Noise::white(std_k));
        }
        sensors[case.sensor].slow_mode = Some(SlowMode { fraction: case.share, time_constant_s: SLOW_S });
        sensors[1].delay_s = case.delay_s;
        if let Some(channel) = case.coloured {
            sensors[channel].coloured_noise = Some(ColouredNoise::new(COLOURED.0, COLOURED.1));
        }
        let gas = Gas::new(300.0, Signal::Turbulence(Turbulence { std_k: 5.0, corner_hz: 0.05, cutoff_hz: 1.0 }));
        let mut form = Record::new(1000, PERIOD_S);
        form.settle_s = Some(case.settled_s);
        let record = Rig::new(seed, form, gas, sensors).expect("a rig").simulate().expect("a record");
        let kept: Vec<usize> = (0..1000).filter(|k| !case.is_uneven || k % 4 != 3).collect();
        let of = |values: &[f64]| kept.iter().map(|k| values[*k]).collect::<Vec<f64>>();
        let mut reading_c = [of(&record.t1_c), of(&record.t2_c)];
        let mut masked = [vec![false; kept.len()], vec![false; kept.len()]];
        let other = 1 - case.sensor;
        for k in (7..kept.len()).step_by(20).filter(|_| case.is_masked) {
            masked[other][k] = true;
            reading_c[other][k] += 100.0 * case.noise_k[other];
        }
        let mut stretch = Stretch::new(of(&record.time_s), reading_c);
        stretch.masked = masked;
        Observations::new(vec![stretch], (!case.is_uneven).then_some(PERIOD_S)).expect("a record")
    }

    /// The true model with its parameters.
    fn truth(case: Case, observations: &Observations) -> (Model, Vec<f64>) {
        let context = Prepared::new(observations, &Settings::default()).expect("a record").context;
        let slow_mode = candidates(&[Identifier::SLOW_MODE], &context).remove(case.sensor);
        let mut model = Model::new(&[], case.noise_k).with(slow_mode);
        let mut theta = vec![TAU_S[0], TAU_S[1], case.share, SLOW_S];
        if case.delay_s > 0.0 {
            model = model.with(candidates(&[Identifier::DELAY], &context).remove(0));
            theta.push(case.delay_s);
        }
        (model, theta)
    }

    fn plant(case: Case, observations: &Observations) -> Plant {
        let (model, theta) = truth(case, observations);
        let mut plant = model.plant(&theta, observations);
        if let Some(channel) = case.coloured {
            plant.extra.push(Extra { place: Place::Reading(channel), std_k: COLOURED.0, correlation_s: COLOURED.1 });
        }
        plant
    }

    fn departure(case: Case, seed: u64) -> f64 {
        let observations = record(case, seed);
        let plant = plant(case, &observations);
        Departure::of_records(&plant, case.sensor, &observations)[0].value(&plant).re
    }

    /// In equilibrium it has zero mean and unit variance: of a hundred, the mean is off by a tenth and the mean square by a seventh, and the
    /// bounds are four times that. A tenth of a standard error is left for what straight lines make of a gas on uneven samples.
    #[test]
    fn a_departure_is_noise_where_there_was_equilibrium() {
        let cases = [
            ("plain", PLAIN),
            ("the first sensor", Case { sensor: 0, ..PLAIN }),
            ("uneven", Case { is_uneven: true, ..PLAIN }),
            ("masked", Case { is_masked: true, ..PLAIN }),
            ("delay", Case { delay_s: DELAY_S, ..PLAIN }),
            ("delay of the other sensor", Case { sensor: 0, delay_s: DELAY_S, ..PLAIN }),
            ("coloured noise", Case { coloured: Some(1), ..PLAIN }),
            ("coloured noise of the other sensor", Case { coloured: Some(0), ..PLAIN }),
            ("large share", Case { share: 0.4, noise_k: [0.2, 0.02], ..PLAIN }),
        ];
        for (name, case) in cases {
            let at: Vec<f64> = (0..100).map(|seed| departure(case, seed)).collect();
            let of = |power: i32| at.iter().map(|z| z.powi(power)).sum::<f64>() / at.len() as f64;
            let (mean, square) = (of(1), of(2));
            assert!(
                mean.abs() < 0.5 && (square - 1.0).abs() < 4.0 * (2.0_f64 / 100.0).sqrt(),
                "{name}: {mean}, {square}"
            );
        }
    }

    /// Of a body that has been in the gas for five of its time constants most are far off.
    #[test]
    fn a_departure_shows_where_there_was_none() {
        let case = Case { settled_s: 5.0 * SLOW_S, ..PLAIN };
        let elsewhere = (0..10).filter(|seed| departure(case, *seed).abs() > 4.0).count();
        assert!(elsewhere >= 6, "{elsewhere} of ten");
    }

    /// Its derivative by each parameter is that of central differences, which over `1e-4` of the parameter are off by about `1e-8` of the
    /// third derivative; a thousand times that leaves room for rounding.
    #[test]
    fn derivatives_of_a_departure_are_exact() {
        for case in [PLAIN, Case { delay_s: DELAY_S, ..PLAIN }, Case { sensor: 0, delay_s: DELAY_S, ..PLAIN }] {
            let observations = record(case, 3);
            let (model, theta) = truth(case, &observations);
            let at = |theta: &[Number]| model.plant_of(theta, &observations);
            let departure = &Departure::of_records(&at(&constants(&theta)), case.sensor, &observations)[0];
            for i in 0..theta.len() {
                let got = departure.value(&at(&moved(&theta, i))).eps;
                let step = 1e-4 * theta[i];
                let [above, below] = [step, -step].map(|by| {
                    let mut theta = theta.clone();
                    theta[i] += by;
                    departure.value(&at(&constants(&theta))).re
                });
                let want = (above - below) / (2.0 * step);
                assert!((got - want).abs() < 1e-5 * want.abs().max(1.0), "parameter {i}: got {got}, want {want}");
            }
        }
    }

    /// Of a record with a gap one departure counts, that of its beginning; none in a piece of the record, and none under operators other
    /// than its own: a model with a delay beside it has a residual as before.
    #[test]
    fn a_departure_counts_where_its_record_begins() {
        let whole = record(PLAIN, 4);
        let stretch = &whole.stretches[0];
        let cut = |samples: std::ops::Range<usize>| {
            let of = |i: usize| stretch.reading_c[i][samples.clone()].to_vec();
            Stretch::new(stretch.time_s.of(samples.clone()).collect(), [of(0), of(1)])
        };
        let observations = Observations::new(vec![cut(0..600), cut(640..1000)], Some(PERIOD_S)).expect("two stretches");
        let (free, theta) = truth(PLAIN, &observations);
        let plant = free.plant(&theta, &observations);
        let known = free.effects[0].in_equilibrium(&plant, &observations).expect("a body");
        assert_eq!(known.departures().len(), 1);
        assert!(Arc::ptr_eq(&known.departures()[0].stretch, &observations.stretches[0]));
        let model = free.replaced(0, known);
        let count = |model: &Model, theta: &[f64], observations: &Observations| {
            model.knowledge(&constants(theta), observations).count()
        };
        assert_eq!(count(&model, &theta, &observations), 1);
        let piece = Observations::new(vec![cut(0..500)], Some(PERIOD_S)).expect("a piece");
        assert_eq!(count(&model, &theta, &piece), 0);
        let context = Prepared::new(&observations, &Settings::default()).expect("a record").context;
        let later = model.with(candidates(&[Identifier::DELAY], &context).remove(0));
        let with_delay: Vec<f64> = theta.iter().copied().chain([DELAY_S]).collect();
        assert_eq!(count(&later, &with_delay, &observations), 0);
    }
}
