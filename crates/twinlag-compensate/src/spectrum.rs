//! The power of the gas as both readings together show it, and what a gas of known spectrum would
//! show.

use std::f64::consts::TAU;

use num_complex::Complex64;
use twinlag_transform::{Forward, Inverse, Tapered, fast_length, hann};

use crate::prior::Term;
use crate::readings::Readings;
use crate::rig::Rig;
use crate::slopes::{Direction, add_autocovariance_slope, density_slope};

/// Longest piece of a record that is transformed at once: the cost of a fit grows with it, and what
/// lasts longer the smoother sees all the same.
pub(crate) const MAX_PIECE_SAMPLES: usize = 16384;
/// Longest piece where a prior is wanted quickly: a quarter of the time, and lines are four times as
/// wide.
pub(crate) const MAX_QUICK_PIECE_SAMPLES: usize = 4096;
/// Multiples of the sampling frequency from which power folds back; what is farther away is taken
/// as if the gas were sampled.
const FOLDS: [f64; 6] = [-1.0, 1.0, -2.0, 2.0, -3.0, 3.0];
/// As many of them each way where the gas is taken to end at half the sampling rate: beyond, noise that
/// falls as `1/f²` has a twelfth of what it has above that rate.
const ENDING_FOLDS: i32 = 6;
/// Distance from critical damping below which both exponentials of a resonance cancel.
const NEARLY_CRITICAL_ETA: f64 = 1e-3;
/// Overlapping pieces are worth so much less than separate ones under Hann's taper, `1/(1 + 2/36)`.
const OVERLAPPING_WORTH: f64 = 0.947;

/// A tapered periodogram of the gas, of long records the mean over pieces that overlap by half,
/// with what noise adds to it.
#[derive(Clone)]
pub(crate) struct Periodogram {
    pub(crate) period_s: f64,
    /// Instants of the even grid.
    pub(crate) all: usize,
    /// Samples of a piece.
    pub(crate) samples: usize,
    /// Pieces that the mean is of, counted as if they did not overlap.
    pub(crate) pieces: f64,
    /// The bins' frequencies, from the second on: the first is the level.
    pub(crate) frequency_hz: Vec<f64>,
    /// Two-sided, K²/Hz.
    pub(crate) power: Vec<f64>,
    /// What the noise of each channel adds to it.
    pub(crate) noise: [Vec<f64>; 2],
    /// The periodogram of what both sensors disagree on, `H₂ Y₁ − H₁ Y₂`, which the gas is not in,
    /// over what it is expected to be, and the share of the first channel in that; the lowest bins
    /// are left out, where the taper lets the gas through.
    pub(crate) disagreement: Vec<[f64; 2]>,
    /// The part of the folded-back power that the sensors remove, in each bin, by multiples of the
    /// sampling frequency.
    flattened: Vec<(f64, Vec<f64>)>,
    /// Autocorrelation of the taper.
    taper: Vec<f64>,
    /// The transform of twice the length.
    plan: Forward,
}

/// Hann's taper, of unit energy.
fn taper(n: usize) -> Vec<f64> {
    let raw = hann(n);
    let energy = raw.iter().map(|w| w * w).sum::<f64>().sqrt();
    raw.iter().map(|w| w / energy).collect()
}

impl Periodogram {
    /// The periodogram of `readings` about `level_c`, on an even grid with straight lines over
    /// missing readings.
    ///
    /// The inferred gas is `Σ H_i* Y_i/N_i` over `Σ |H_i|²/N_i`, which has the least noise of all
    /// that are true to the gas.
    ///
    /// - `max_piece_samples`: the longest piece that is transformed at once
    pub(crate) fn of(readings: &Readings, rig: &Rig, level_c: f64, max_piece_samples: usize) -> Self {
        let period_s = readings.period_s();
        let first_s = readings.time_s()[0];
        let span_s = readings.time_s()[readings.len() - 1] - first_s;
        let all = (span_s / period_s).round() as usize + 1;
        let even = [0, 1].map(|i| on_grid(readings, i, first_s, period_s, all));
        let count = if all > max_piece_samples { 2 * all.div_ceil(max_piece_samples) - 1 } else { 1 };
        let samples = fast_length(2 * all / (count + 1));
        let tapered = Tapered::new(taper(samples));
        let transform = |values: &[f64]| tapered.transform(values.iter().map(|y| y - level_c));
        let pieces: Vec<[Vec<Complex64>; 2]> = (0..count)
            .map(|k| k * (all - samples) / count.saturating_sub(1).max(1))
            .map(|from| [0, 1].map(|i| transform(&even[i][from..from + samples])))
            .collect();
        let bins = 1..samples.div_ceil(2);
        let frequency_hz: Vec<f64> = bins.clone().map(|j| j as f64 / (samples as f64 * period_s)).collect();
        let weights_at = |hz: f64| rig.sensors.map(|s| s.response(hz).conj() / s.noise_density_k2_per_hz(hz, period_s));
        let seen = |hz: f64, weights: &[Complex64; 2]| -> Complex64 {
            weights.iter().zip(&rig.sensors).map(|(w, s)| w * s.response(hz)).sum()
        };
        let flattened = FOLDS.map(|fold| {
            let away_hz = fold / period_s;
            let taken_off = |hz: &f64| {
                let weights = weights_at(*hz);
                1.0 - (seen(hz + away_hz, &weights) / seen(*hz, &weights)).norm_sqr()
            };
            (away_hz, frequency_hz.iter().map(taken_off).collect())
        });
        let power = bins.zip(&frequency_hz).map(|(j, &hz)| {
            let weights = weights_at(hz);
            let information = seen(hz, &weights).re;
            let of = |piece: &[Vec<Complex64>; 2]| (weights[0] * piece[0][j] + weights[1] * piece[1][j]).norm_sqr();
            pieces.iter().map(of).sum::<f64>() / (information * information * count as f64) * period_s
        });
        let power = power.collect();
        let noise = [0, 1].map(|i| {
            let of = |hz: &f64| {
                let weights = weights_at(*hz);
                let density = rig.sensors[i].noise_density_k2_per_hz(*hz, period_s);
                weights[i].norm_sqr() * density / seen(*hz, &weights).norm_sqr()
            };
            frequency_hz.iter().map(of).collect()
        });
        let disagreement = frequency_hz.iter().enumerate().skip(frequency_hz.len() / 8).map(|(k, &hz)| {
            let [h1, h2] = rig.sensors.map(|s| s.response(hz));
            let [n1, n2] = rig.sensors.map(|s| s.noise_density_k2_per_hz(hz, period_s));
            let [first, second] = [h2.norm_sqr() * n1, h1.norm_sqr() * n2];
            let of = |piece: &[Vec<Complex64>; 2]| (h2 * piece[0][k + 1] - h1 * piece[1][k + 1]).norm_sqr();
            let power = pieces.iter().map(of).sum::<f64>() / count as f64 * period_s;
            [power / (first + second), first / (first + second)]
        });
        let disagreement = disagreement.collect();
        let taper = autocorrelation(tapered.taper());
        let plan = Forward::of(2 * samples);
        let pieces = if count > 1 { OVERLAPPING_WORTH * count as f64 } else { 1.0 };
        let flattened = flattened.to_vec();
        Self { period_s, all, samples, pieces, frequency_hz, power, noise, disagreement, flattened, taper, plan }
    }

    /// The periodogram as it would have come of a gas that does not move faster than half the sampling
    /// rate: nothing folds back.
    pub(crate) fn of_ending_gas(&self) -> Self {
        let nothing = vec![1.0; self.frequency_hz.len()];
        let flattened = (1..=ENDING_FOLDS)
            .flat_map(|m| [-f64::from(m), f64::from(m)])
            .map(|m| (m / self.period_s, nothing.clone()));
        Self { flattened: flattened.collect(), ..self.clone() }
    }

    /// What the periodogram of a gas with these terms is expected to be:
    /// `Ts Σ_m r(m Ts) a(m) exp(−2πi f m Ts)`, `a` the taper's autocorrelation, which is exact for
    /// a record of any length (Sykulski et al. 2019). That is the gas as if it were sampled itself;
    /// what it has above the sampling folds back through sensors that have flattened it, so
    /// `Σ_k S(f + k/Ts) (1 − |G(f + k/Ts)/G(f)|²)` comes off, `G` what both sensors together make
    /// of the gas.
    pub(crate) fn expected(&self, terms: &[Term]) -> Vec<f64> {
        let mut expected = self.expected_signed(terms);
        expected.iter_mut().for_each(|sum| *sum = sum.max(0.0));
        expected
    }

    /// As [`Periodogram::expected`], below zero where what folds back is more than there is.
    pub(crate) fn expected_signed(&self, terms: &[Term]) -> Vec<f64> {
        let mut out = self.tapered(|lags| terms.iter().for_each(|term| add_autocovariances(term, self.period_s, lags)));
        for term in terms {
            self.take_off_beyond(|hz| term.density_k2_per_hz(hz), &mut out);
        }
        out
    }

    /// How fast [`Periodogram::expected_signed`] changes where the numbers of terms change at these rates.
    pub(crate) fn expected_slope(&self, directions: &[Direction]) -> Vec<f64> {
        let add = |lags: &mut [f64]| directions.iter().for_each(|by| add_autocovariance_slope(by, self.period_s, lags));
        let mut out = self.tapered(add);
        for by in directions {
            self.take_off_beyond(|hz| density_slope(by, hz), &mut out);
        }
        out
    }

    /// What a periodogram shows of an autocovariance, which `add` adds at multiples of the period.
    fn tapered(&self, add: impl Fn(&mut [f64])) -> Vec<f64> {
        let n = self.samples;
        let mut input = vec![0.0; 2 * n];
        add(&mut input[..n]);
        input.iter_mut().zip(&self.taper).for_each(|(r, a)| *r *= a);
        let (lags, mirrored) = input.split_at_mut(n);
        mirrored[1..].iter_mut().rev().zip(&lags[1..]).for_each(|(to, from)| *to = *from);
        let out = self.plan.transform(&input);
        (1..=self.frequency_hz.len()).map(|j| out[2 * j].re * self.period_s).collect()
    }

    /// Takes off what sensors flatten of a density beyond the sampling.
    fn take_off_beyond(&self, density: impl Fn(f64) -> f64, out: &mut [f64]) {
        for (away_hz, taken_off) in &self.flattened {
            for ((sum, hz), share) in out.iter_mut().zip(&self.frequency_hz).zip(taken_off) {
                *sum -= share * density(hz + away_hz);
            }
        }
    }
}

/// Adds to `out` what [`Term::autocovariance_k2`] gives at multiples of `period_s`: real and
/// complex exponentials, each a product of the one before.
fn add_autocovariances(term: &Term, period_s: f64, out: &mut [f64]) {
    let mut add = |start: Complex64, rate: Complex64| {
        let factor = (rate * period_s).exp();
        let mut value = start;
        for sum in &mut *out {
            *sum += value.re;
            value *= factor;
        }
    };
    let real = |re: f64| Complex64::new(re, 0.0);
    match *term {
        Term::Rough { std_k, corner_hz } => add(real(std_k * std_k), real(-TAU * corner_hz)),
        Term::Resonance { std_k, frequency_hz, quality } => {
            let (rate, half) = (TAU * frequency_hz, 0.5 / quality);
            let square = 1.0 - half * half;
            let eta = square.abs().sqrt();
            let variance = std_k * std_k;
            if eta < NEARLY_CRITICAL_ETA {
                let at = (0..out.len()).map(|m| term.autocovariance_k2(m as f64 * period_s));
                out.iter_mut().zip(at).for_each(|(sum, r)| *sum += r);
            } else if square > 0.0 {
                add(variance * Complex64::new(1.0, -half / eta), rate * Complex64::new(-half, eta));
            } else {
                add(real(0.5 * variance * (1.0 + half / eta)), real((eta - half) * rate));
                add(real(0.5 * variance * (1.0 - half / eta)), real(-(eta + half) * rate));
            }
        }
    }
}

fn autocorrelation(window: &[f64]) -> Vec<f64> {
    let n = window.len();
    let mut spectrum = Forward::of(2 * n).transform(window);
    spectrum.iter_mut().for_each(|s| *s = Complex64::new(s.norm_sqr() / (2 * n) as f64, 0.0));
    let mut out = Inverse::of(2 * n).transform(spectrum);
    out.truncate(n);
    out
}

fn on_grid(readings: &Readings, channel: usize, first_s: f64, period_s: f64, samples: usize) -> Vec<f64> {
    let known: Vec<(f64, f64)> = (0..readings.len())
        .filter_map(|k| Some(((readings.time_s()[k] - first_s) / period_s, readings.reading_c(channel, k)?)))
        .collect();
    let mut next = 0;
    (0..samples)
        .map(|j| {
            let at = j as f64;
            while next < known.len() && known[next].0 < at {
                next += 1;
            }
            match (next.checked_sub(1).and_then(|k| known.get(k)), known.get(next)) {
                (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (at - a.0) / (b.0 - a.0),
                (Some(only), None) | (None, Some(only)) => only.1,
                (None, None) => 0.0,
            }
        })
        .collect()
}

/// Frequencies, Hz, and two-sided spectral densities, K²/Hz, of `values` that are read every
/// `period_s`: the periodogram under Hann's taper, its mean in bands that widen with frequency, a
/// tenth of it each. For pictures.
pub fn power_spectrum(values: &[f64], period_s: f64) -> (Vec<f64>, Vec<f64>) {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / (n as f64).max(1.0);
    let spectrum = if n > 0 { Tapered::new(taper(n)).transform(values.iter().map(|v| v - mean)) } else { Vec::new() };
    let (mut hz, mut density) = (Vec::new(), Vec::new());
    let mut from = 1;
    while from < spectrum.len() {
        let to = (from + 1 + from / 10).min(spectrum.len());
        let power: f64 = spectrum[from..to].iter().map(Complex64::norm_sqr).sum();
        hz.push(0.5 * (from + to - 1) as f64 / (n as f64 * period_s));
        density.push(power / (to - from) as f64 * period_s);
        from = to;
    }
    (hz, density)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 000 products of 2⁻⁵³ each.
    #[test]
    fn products_are_the_autocovariances() {
        let resonance = |quality| Term::Resonance { std_k: 3.0, frequency_hz: 5.0, quality };
        for term in [
            Term::Rough { std_k: 3.0, corner_hz: 2.0 },
            resonance(0.3),
            resonance(0.5),
            resonance(0.8),
            resonance(50.0),
        ] {
            let mut got = vec![0.0; 20_000];
            add_autocovariances(&term, 0.001, &mut got);
            for (m, got) in got.iter().enumerate() {
                let want = term.autocovariance_k2(m as f64 * 0.001);
                assert!((got - want).abs() < 9.0 * 20_000.0 * f64::EPSILON, "{term:?} at {m}: {got}, want {want}");
            }
        }
    }
}
