//! The inverse of the whole rig: from both channels' readings to the disagreement of the gas temperatures that they imply.
//!
//! A [`Plant`] is the two-lag model with every effect in its place; an effect that is absent has its neutral value. Each
//! effect's file says which of these numbers are its parameters, nothing more, so any of them can be in the model together.

use std::sync::Arc;

use crate::chain::{Along, Chain, Pointwise, Rows, UNEVEN_REACH};
use crate::flow::Flow;
use crate::observations::{Observations, Stretch};
use crate::spline::Spline;
use crate::whitening::{Source, Variance, Whitened, whiten};

/// 0 °C, K.
pub const ZERO_CELSIUS_K: f64 = 273.15;

/// Noise of a masked reading beside the swing: far beyond what it could say, not so far that rounding is lost to it.
const BOUNDLESS: f64 = 20.0;
/// Fewest disagreements of a stretch: one of fewer is left out.
const LEAST_LEFT: usize = 4;
/// A disagreement that is this many times less certain than most says nothing: it rests on a masked reading.
const UNINFORMED: f64 = 10.0;

/// What is done to a reading to have the temperature of the sensor.
#[derive(Clone, Debug)]
pub struct Reading {
    /// Static gain.
    pub gain: f64,
    /// Added to it, K, at 0 °C.
    pub offset_k: f64,
    /// Added to it per second, from the middle of the record on.
    pub drift_k_per_s: f64,
    /// Static curvature.
    pub curvature: Option<Curvature>,
    /// Sinusoids: frequency in Hz, amplitudes of cosine and sine in K.
    pub lines: Vec<[f64; 3]>,
    /// Share of the other channel in the reading.
    pub crosstalk: f64,
    /// The temperature of the other channel that adds nothing, °C.
    pub crosstalk_about_c: f64,
}

impl Default for Reading {
    fn default() -> Self {
        Self {
            gain: 1.0,
            offset_k: 0.0,
            drift_k_per_s: 0.0,
            curvature: None,
            lines: Vec::new(),
            crosstalk: 0.0,
            crosstalk_about_c: 0.0,
        }
    }
}

/// Static curvature `κ ((T − m)² − v − c (T − m))`, with which gain and offset stay those of the straight line through the record:
/// `m`, `v` and `c` are mean, variance and third moment over variance of its temperatures.
#[derive(Clone, Copy, Debug)]
pub struct Curvature {
    /// `κ`, 1/K.
    pub per_k: f64,
    /// `m` in °C, `v` in K², `c` in K.
    pub moments: [f64; 3],
}

impl Curvature {
    /// The temperature whose reading is `reading_c`, and its derivative.
    fn straighten(&self, reading_c: f64) -> (f64, f64) {
        let [mean, variance, skew] = self.moments;
        let k = self.per_k;
        // (1 − κ c) d + κ d² = reading − mean + κ v, d = T − mean: the root near the reading.
        let linear = 1.0 - k * skew;
        let from = reading_c - mean + k * variance;
        let root = (linear * linear + 4.0 * k * from).max(0.04).sqrt();
        (mean + 2.0 * from / (linear + root), 1.0 / root)
    }
}

impl Reading {
    /// The sum of the sinusoids at a time, K.
    pub fn lines_at(&self, time_s: f64) -> f64 {
        self.lines
            .iter()
            .map(|[hz, cosine, sine]| {
                let (s, c) = (std::f64::consts::TAU * hz * time_s).sin_cos();
                cosine * c + sine * s
            })
            .sum()
    }
}

/// One sensor.
#[derive(Clone, Debug)]
pub struct Sensor {
    pub reading: Reading,
    pub tau_s: f64,
    pub second_tau_s: Option<f64>,
    /// Share and time constant of a slow parallel path.
    pub slow: Option<[f64; 2]>,
    /// Radiation `k (T⁴ − T_wall⁴)` in kelvin: `k` in 1/K³, and what it takes away at the mean temperature, K.
    pub radiation: Option<Radiation>,
    /// `τ ∝ T^p` of its own temperature in kelvin, and the temperature at which `τ` is what it is called, K.
    pub exponent: Option<[f64; 2]>,
}

/// Radiation to walls, about the sensor's mean temperature.
#[derive(Clone, Copy, Debug)]
pub struct Radiation {
    /// `k`, 1/K³.
    pub coefficient_per_k3: f64,
    /// `k (T_mean⁴ − T_wall⁴)`, K.
    pub loss_k: f64,
    /// `T_mean`, K.
    pub mean_k: f64,
}

/// Noise beside the white noise of the channels: autoregressive of first order.
#[derive(Clone, Copy, Debug)]
pub struct Extra {
    pub place: Place,
    pub std_k: f64,
    pub correlation_s: f64,
}

/// Relative change of both time constants along the record.
#[derive(Clone, Debug)]
pub enum Modulation {
    /// A smooth function of time.
    Spline(Spline),
    /// `(v/v_mean)^exponent − 1` of a measured flow.
    Flow { exponent: f64, of: Arc<Flow> },
    /// Nothing before an instant, s, and this from then on.
    Step { at_s: f64, change: f64 },
}

impl Modulation {
    fn at(&self, time_s: f64) -> f64 {
        match self {
            Self::Spline(spline) => spline.at(time_s),
            Self::Flow { exponent, of } => (exponent * of.log_ratio_at(time_s)).exp_m1(),
            Self::Step { at_s, change } => {
                if time_s < *at_s {
                    0.0
                } else {
                    *change
                }
            }
        }
    }
}

/// Where extra noise enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The reading of a channel.
    Reading(usize),
    /// The gas: the sensors do not see the same.
    Gas,
}

/// The rig's inverse.
#[derive(Clone, Debug)]
pub struct Plant {
    pub sensors: [Sensor; 2],
    /// White noise of the channels, K.
    pub noise_std_k: [f64; 2],
    /// How much later channel 2 is than channel 1, s.
    pub delay_s: Option<f64>,
    /// How many samples a delay may reach.
    pub reach: usize,
    /// Relative change of both time constants along the record.
    pub modulation: Option<Modulation>,
    /// Relative change of the ratio `τ₂/τ₁` along the record.
    pub ratio: Option<Spline>,
    pub extra: Vec<Extra>,
    /// The middle of the record, s.
    pub middle_s: f64,
}

impl Plant {
    /// Two first-order lags.
    pub fn new(observations: &Observations, tau_s: [f64; 2], noise_std_k: [f64; 2]) -> Self {
        let sensor = |tau_s| Sensor {
            reading: Reading::default(),
            tau_s,
            second_tau_s: None,
            slow: None,
            radiation: None,
            exponent: None,
        };
        let [first_s, last_s] = observations.ends_s();
        Self {
            sensors: tau_s.map(sensor),
            noise_std_k,
            delay_s: None,
            reach: reach(observations),
            modulation: None,
            ratio: None,
            extra: Vec::new(),
            middle_s: 0.5 * (first_s + last_s),
        }
    }

    /// Each inferred gas temperature and what carries the noise.
    fn invert(&self, stretch: &Stretch, period_s: Option<f64>, has_gas: bool) -> Inverted {
        let mut chains = [0, 1].map(|i| Chain::of(stretch, i, period_s));
        self.take_off_crosstalk(&mut chains);
        for (chain, sensor) in chains.iter_mut().zip(&self.sensors) {
            self.correct(chain, &sensor.reading);
        }
        // Extra noise of the gas passes the factors that both sensors have.
        let mut gas = has_gas.then(|| Chain::of(stretch, 0, period_s));
        let pass = |gas: &mut Option<Chain>, tau_s: f64| {
            if let Some(gas) = gas {
                gas.factor(&Along::Same(tau_s), None, None);
            }
        };
        if let Some(delay_s) = self.delay_s {
            chains[0].advance(0.0, self.reach);
            chains[1].advance(delay_s, self.reach);
            if let Some(gas) = &mut gas {
                gas.advance(0.0, self.reach);
            }
        }
        for i in 0..2 {
            if let Some(tau_s) = self.sensors[i].second_tau_s {
                chains[i].factor(&Along::Same(tau_s), None, None);
                chains[1 - i].factor(&Along::Same(0.0), None, None);
                pass(&mut gas, 0.0);
            }
        }
        // Both chains have the same instants here.
        let times_s = chains[0].times_after_factor();
        let shared: Option<Vec<f64>> =
            self.modulation.as_ref().map(|modulation| times_s.iter().map(|t| modulation.at(*t)).collect());
        let second = self.ratio.as_ref().map(|_| times_s.iter().map(|t| self.change(1, *t)).collect());
        for (chain, (sensor, own)) in chains.iter_mut().zip(self.sensors.iter().zip([None, second])) {
            Self::lag(chain, sensor, own.as_ref().or(shared.as_ref()).map(Vec::as_slice));
        }
        pass(&mut gas, 0.0);
        for i in 0..2 {
            if let Some([share, tau_s]) = self.sensors[i].slow {
                chains[i].factor(&Along::Same(tau_s), None, None);
                chains[1 - i].factor(&Along::Same((1.0 - share) * tau_s), None, None);
                pass(&mut gas, (1.0 - share) * tau_s);
            }
        }
        Inverted { chains, gas }
    }

    /// Values of a stretch that have no disagreement: each operator takes some at the ends.
    pub fn consumed(&self, is_even: bool) -> usize {
        let factors: usize =
            self.sensors.iter().map(|s| usize::from(s.second_tau_s.is_some()) + usize::from(s.slow.is_some())).sum();
        let (each, delay) = if is_even { (2, 2 * self.reach + 3) } else { (1, 2 * UNEVEN_REACH + 3) };
        each * (1 + factors) + if self.delay_s.is_some() { delay } else { 0 } + self.extra.len()
    }

    /// The temperatures of both sensors: readings without what calibration, lines and crosstalk make of them, °C.
    pub fn temperatures(&self, stretch: &Stretch) -> [Vec<f64>; 2] {
        let mut chains = [0, 1].map(|i| Chain::of(stretch, i, None));
        self.take_off_crosstalk(&mut chains);
        for (chain, sensor) in chains.iter_mut().zip(&self.sensors) {
            self.correct(chain, &sensor.reading);
        }
        chains.map(|chain| chain.value)
    }

    /// Takes off the factors `1 + (1 − φ) τ s` with which slow paths are compared, so that `values` are those of the gas, which was at
    /// `start_c` before.
    pub fn undo_slow(&self, values: &mut [f64], start_c: f64, step_s: f64) {
        for [share, tau_s] in self.sensors.iter().filter_map(|s| s.slow) {
            let keep = (-step_s / ((1.0 - share) * tau_s)).exp();
            let (mut now, mut before) = (start_c, values.first().copied().unwrap_or(start_c));
            for value in values.iter_mut() {
                now = keep * now + (1.0 - keep) * 0.5 * (before + *value);
                before = std::mem::replace(value, now);
            }
        }
    }

    /// `y₁ − ε (y₂ − about)`.
    fn take_off_crosstalk(&self, chains: &mut [Chain; 2]) {
        for i in 0..2 {
            let Reading { crosstalk: share, crosstalk_about_c: about_c, .. } = self.sensors[i].reading;
            if share != 0.0 {
                let other = chains[1 - i].value.clone();
                for (v, o) in chains[i].value.iter_mut().zip(other) {
                    *v -= share * (o - about_c);
                }
            }
        }
    }

    fn correct(&self, chain: &mut Chain, reading: &Reading) {
        let is_plain =
            reading.gain == 1.0 && reading.offset_k == 0.0 && reading.drift_k_per_s == 0.0 && reading.lines.is_empty();
        if !is_plain {
            chain.affine(
                |t| -reading.offset_k - reading.drift_k_per_s * (t - self.middle_s) - reading.lines_at(t),
                1.0 / reading.gain,
            );
        }
        if let Some(curvature) = reading.curvature {
            chain.map(|v| curvature.straighten(v));
        }
    }

    /// Whether the time constant of sensor `i` changes along the record.
    pub fn changes(&self, i: usize) -> bool {
        self.modulation.is_some() || (i == 1 && self.ratio.is_some())
    }

    /// Its relative change at an instant.
    pub fn change(&self, i: usize, time_s: f64) -> f64 {
        let shared = self.modulation.as_ref().map_or(0.0, |m| m.at(time_s));
        match self.ratio.as_ref().filter(|_| i == 1) {
            Some(ratio) => (1.0 + shared) * (1.0 + ratio.at(time_s)) - 1.0,
            None => shared,
        }
    }

    /// - `change`: relative change of the time constants at each value, where they change along the record
    fn lag(chain: &mut Chain, sensor: &Sensor, change: Option<&[f64]>) {
        let tau_s = match change {
            None => Along::Same(sensor.tau_s),
            Some(change) => Along::Each(change.iter().map(|m| sensor.tau_s * (1.0 + m).max(0.02)).collect()),
        };
        let value = sensor.radiation.map(|radiation| pointwise(&chain.value, |v| radiation.add_to(v)));
        let slope = sensor.exponent.map(|[p, reference_k]| {
            pointwise(&chain.value, |v| {
                let q = (v + ZERO_CELSIUS_K).max(1.0) / reference_k;
                // ∫ (T/T₀)^p dT from T₀ on.
                let l = q.ln();
                let e = (p + 1.0) * l;
                let integral = if e.abs() < 1e-6 { l * (1.0 + 0.5 * e) } else { e.exp_m1() / (p + 1.0) };
                (reference_k * integral, q.powf(p))
            })
        });
        chain.factor(&tau_s, value.as_ref(), slope.as_ref());
    }

    /// The rows, in the middle of the record, by which noise of either channel and of the gas enters the disagreement.
    pub fn noise_paths(&self, observations: &Observations) -> [Vec<f64>; 3] {
        let stretch = observations.stretches.iter().max_by_key(|s| s.len()).expect("not empty");
        let (middle, around) = (stretch.len() / 2, self.reach + 16);
        let (from, to) = (middle.saturating_sub(around), (middle + around).min(stretch.len()));
        let cut =
            Stretch::new(stretch.time_s[from..to].to_vec(), [0, 1].map(|i| stretch.reading_c[i][from..to].to_vec()));
        let Inverted { chains, gas } = self.invert(&cut, observations.period_s, true);
        let count = chains[0].len().min(chains[1].len());
        let k = count / 2;
        let [one, two] = self.disagreement_rows(&chains, count);
        let gas = gas.expect("asked for");
        [one.at(k).to_vec(), two.at(k).to_vec(), gas.rows.at(k).to_vec()]
    }

    /// The rows by which noise of either reading enters `x₁ − x₂`: through its own chain, and through crosstalk as well.
    fn disagreement_rows(&self, chains: &[Chain; 2], count: usize) -> [Rows; 2] {
        let [one, two] = chains;
        let mut minus_two = two.rows.clone();
        minus_two.scale(-1.0);
        let [e1, e2] = [0, 1].map(|i| self.sensors[i].reading.crosstalk);
        [
            if e2 == 0.0 { one.rows.clone() } else { one.rows.plus(&minus_two, -e2, count) },
            if e1 == 0.0 { minus_two.clone() } else { minus_two.plus(&one.rows, -e1, count) },
        ]
    }

    /// The whitened disagreement along the record.
    pub fn whitened(&self, observations: &Observations, keep: bool) -> Evaluation {
        let mut out = Evaluation::default();
        let mut first_sample = 0;
        for (index, stretch) in observations.stretches.iter().enumerate() {
            if stretch.len() < self.consumed(observations.period_s.is_some()) + LEAST_LEFT {
                out.begins.push(out.sample.len());
                first_sample += stretch.len();
                continue;
            }
            let has_gas = self.extra.iter().any(|e| e.place == Place::Gas);
            let Inverted { mut chains, gas } = self.invert(stretch, observations.period_s, has_gas);
            let mut sources = Vec::new();
            for i in 0..2 {
                let variance = self.noise_std_k[i] * self.noise_std_k[i];
                sources.push(Source {
                    rows: Rows::identity(),
                    variance: mask(variance, &stretch.masked[i], observations.swing_k()),
                });
            }
            // What the sensors imply, before the differences that whiten extra noise.
            let inferred = chains.clone();
            // Innovations of the extra noise, before the difference that makes them of it.
            let mut extra_rows: Vec<Rows> = Vec::new();
            for (index, extra) in self.extra.iter().enumerate() {
                let rho = (-observations.step_s() / extra.correlation_s).exp();
                let mut rows = match extra.place {
                    Place::Reading(i) => {
                        let count = chains[0].len().min(chains[1].len());
                        let [one, two] = self.disagreement_rows(&chains, count);
                        if i == 0 { one } else { two }
                    }
                    Place::Gas => gas.as_ref().expect("made for it").rows.clone(),
                };
                // Those before have had their differences; the gas chain has not.
                if extra.place == Place::Gas {
                    for before in &self.extra[..index] {
                        let rho = (-observations.step_s() / before.correlation_s).exp();
                        let mut chain = gas.clone().expect("made for it");
                        chain.rows = rows;
                        chain.difference(rho);
                        rows = chain.rows;
                    }
                }
                let mut chain_of_rows = Vec::new();
                for other in &mut extra_rows {
                    let mut chain = chains[0].clone();
                    chain.rows = other.clone();
                    chain.difference(rho);
                    chain_of_rows.push(chain.rows);
                }
                extra_rows = chain_of_rows;
                rows.start += 1;
                extra_rows.push(rows);
                chains.iter_mut().for_each(|c| c.difference(rho));
            }
            let count = chains[0].len().min(chains[1].len());
            for (source, rows) in sources.iter_mut().zip(self.disagreement_rows(&chains, count)) {
                source.rows = rows;
            }
            let [one, two] = chains;
            let u: Vec<f64> = one.value.iter().zip(&two.value).map(|(a, b)| a - b).collect();
            for (rows, extra) in extra_rows.into_iter().zip(&self.extra) {
                let rho = (-observations.step_s() / extra.correlation_s).exp();
                let variance = extra.std_k * extra.std_k * (1.0 - rho * rho);
                sources.push(Source { rows, variance: Variance::Same(variance) });
            }
            let first_s = one.time_s[0];
            let start = stretch.time_s.partition_point(|t| *t < first_s - 0.25 * observations.step_s());
            let whitened = whiten(&u, &sources, keep);
            out.begins.push(out.sample.len());
            out.sample.extend((0..count).map(|k| first_sample + start + k));
            out.time_s.extend_from_slice(&one.time_s);
            let skipped = self.extra.len();
            let mut gas = inferred.clone().map(|chain| chain.value);
            gas.iter_mut().for_each(|gas| self.undo_slow(gas, stretch.start_c(), observations.step_s()));
            let [c1, c2] = [0, 1].map(|i| &gas[i][skipped..skipped + count]);
            out.gas_c.extend(c1.iter().zip(c2).map(|(a, b)| 0.5 * (a + b)));
            out.disagreement_k.extend(c1.iter().zip(c2).map(|(a, b)| a - b));
            out.residual.extend_from_slice(&whitened.residual);
            let typical = median(&whitened.diagonal);
            out.is_informed.extend(whitened.diagonal.iter().map(|d| *d < UNINFORMED * typical));
            out.log_determinant += whitened.log_determinant;
            if keep {
                out.parts.push(Part { stretch: index, sources, whitened, inferred, skipped, first_sample });
            }
            first_sample += stretch.len();
        }
        out
    }
}

impl Radiation {
    /// `T + k (T⁴ − T_mean⁴) + loss`, T in °C, with its derivative.
    pub fn add_to(&self, reading_c: f64) -> (f64, f64) {
        let t = reading_c + ZERO_CELSIUS_K;
        let (k, m) = (self.coefficient_per_k3, self.mean_k);
        let more = k * (t - m) * (t + m) * (t * t + m * m) + self.loss_k;
        (reading_c + more, 1.0 + 4.0 * k * t * t * t)
    }
}

fn pointwise(values: &[f64], f: impl Fn(f64) -> (f64, f64)) -> Pointwise {
    let (value, derivative) = values.iter().map(|v| f(*v)).unzip();
    Pointwise { value, derivative }
}

/// How many samples a delay may reach: not so many that stretches with a tenth of the record or more are lost to it.
pub fn reach(observations: &Observations) -> usize {
    let samples = observations.samples();
    let mut lengths: Vec<usize> = observations.stretches.iter().map(Stretch::len).collect();
    lengths.sort_unstable();
    let mut shorter = 0;
    let typical = lengths.into_iter().find(|n| {
        shorter += n;
        10 * shorter >= samples
    });
    (samples / 50).min(typical.unwrap_or(0) / 10).clamp(2, 64)
}

/// Variance of each sample: boundless, to all purposes, where it is masked.
fn mask(variance: f64, masked: &[bool], swing_k: f64) -> Variance {
    if masked.iter().any(|m| *m) {
        let boundless = (BOUNDLESS * swing_k).powi(2);
        Variance::Each(masked.iter().map(|m| if *m { boundless } else { variance }).collect())
    } else {
        Variance::Same(variance)
    }
}

fn median(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 1.0;
    }
    let mut all = values.to_vec();
    let middle = all.len() / 2;
    *all.select_nth_unstable_by(middle, f64::total_cmp).1
}

struct Inverted {
    chains: [Chain; 2],
    gas: Option<Chain>,
}

/// The whitened disagreement of a whole record.
#[derive(Clone, Debug, Default)]
pub struct Evaluation {
    /// Whitened residual.
    pub residual: Vec<f64>,
    /// The sample, counted through all stretches, in the middle of each residual's reach.
    pub sample: Vec<usize>,
    /// Its instant, s.
    pub time_s: Vec<f64>,
    /// Mean of the two inferred gas temperatures, smoothed by the operators, °C.
    pub gas_c: Vec<f64>,
    /// Their difference, K.
    pub disagreement_k: Vec<f64>,
    /// Whether it says anything: one for each masked reading does not.
    pub is_informed: Vec<bool>,
    /// Where stretches begin among the residuals.
    pub begins: Vec<usize>,
    /// Logarithm of the determinant of the noise covariance.
    pub log_determinant: f64,
    /// Details by stretch, where they were asked for.
    pub parts: Vec<Part>,
}

/// One stretch with its factor.
#[derive(Clone, Debug)]
pub struct Part {
    /// Which of the stretches: those that are too short have none.
    pub stretch: usize,
    pub sources: Vec<Source>,
    pub whitened: Whitened,
    /// Both inferred inputs.
    pub inferred: [Chain; 2],
    /// Values of them that come before the first disagreement.
    pub skipped: usize,
    pub first_sample: usize,
}

impl Part {
    /// The noise of each reading of a channel that makes both inputs agree with the least of it, K: `s² Bᵀ V⁻¹ u`.
    pub fn noise_of(&self, channel: usize, samples: usize) -> Vec<f64> {
        let source = &self.sources[channel];
        let mut out = vec![0.0; samples];
        for (k, w) in self.whitened.weighted().iter().enumerate() {
            for (j, c) in source.rows.at(k).iter().enumerate() {
                let sample = source.rows.start + k + j;
                if let Some(n) = out.get_mut(sample) {
                    *n += c * w * source.variance.at(sample);
                }
            }
        }
        out
    }
}
