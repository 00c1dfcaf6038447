//! Tests of what a model leaves over, beside those of its energy and whiteness.
//!
//! The residual is tested against the *estimated* input, not against a channel: each channel's noise is in the residual as well. What
//! stands for the input is a reading with its estimated noise taken off, `ŷ = y − Σ Bᵀ V⁻¹ u`: the projection that makes it
//! uncorrelated with the disagreement. Coherence is the same whatever filter lies between it and the gas.

use std::borrow::Cow;
use std::ops::Range;

use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF, Normal};
use twinlag_cross_relation::{ResidualTest, TestName};
use twinlag_transform::{Complex64, Forward, Tapered, fast_length, hann};

use crate::defects::MAX_TRANSFORMED_AS_IT_IS;
use crate::dense;
use crate::fit::Fitted;
use crate::implied::{Details, Inferred, Part, append};
use crate::observations::Observations;
use crate::plant::Place;
use crate::selection::Selection;
use crate::weighting::Weighting;

/// Points of a segment for the coherence.
const COHERENCE_SAMPLES: usize = 256;
/// Power over that of the noise from which on a frequency is the gas's.
const GAS_POWER_RATIO: f64 = 3.0;
/// Parts of the record whose energies are compared.
const ENERGY_PARTS: usize = 20;

/// Residual and estimated input where they count and say anything, in unbroken runs.
pub(crate) struct Pairs {
    /// Runs of the residual.
    pub(crate) residual: Vec<Vec<f64>>,
    /// Runs of the estimated input, as long as those of the residual.
    input: Vec<Vec<f64>>,
    /// White noise of the reading that stands for the input, K.
    noise_std_k: f64,
}

impl Pairs {
    /// - `details`: of the fitted model
    pub(crate) fn of(
        fitted: &Fitted,
        mut details: Details,
        observations: &Observations,
        selection: &Selection,
    ) -> Self {
        let plant = fitted.model.plant(&fitted.theta, observations);
        // A channel without noise of its own beside the white.
        let is_white = |i: usize| plant.extra.iter().all(|e| e.place != Place::Reading(i));
        let channel =
            usize::from(!is_white(0) || (is_white(1) && plant.sensors[1].tau_s.re < plant.sensors[0].tau_s.re));
        let mut input = Runs::default();
        for (part, (samples, places)) in std::mem::take(&mut details.parts).iter().zip(details.samples_and_places()) {
            let stretch = &observations.stretches[part.stretch];
            let noise = part.noise_of(channel, stretch.len());
            let reading_c = &stretch.reading_c[channel];
            input.take(samples, places, selection, &details.is_informed, |_, sample| {
                let k = sample - part.before;
                reading_c[k] - noise[k]
            });
        }
        // What the parts held, as long as the record, is not there any more.
        let mut residual = Runs::default();
        for (samples, places) in details.samples_and_places() {
            residual.take(samples, places, selection, &details.is_informed, |place, _| details.residual[place]);
        }
        Self { residual: residual.all, input: input.all, noise_std_k: plant.noise_std_k[channel] }
    }

    fn runs(&self) -> impl Iterator<Item = (&[f64], &[f64])> {
        self.residual.iter().map(Vec::as_slice).zip(self.input.iter().map(Vec::as_slice))
    }
}

/// Values where residuals count and say anything, in unbroken runs.
#[derive(Default)]
struct Runs {
    all: Vec<Vec<f64>>,
    last: Option<usize>,
}

impl Runs {
    /// Appends the values of a stretch.
    ///
    /// - `places`: those of its residuals among all
    /// - `value`: of a residual by its place and its sample
    fn take(
        &mut self,
        samples: Range<usize>,
        places: Range<usize>,
        selection: &Selection,
        is_informed: &[bool],
        value: impl Fn(usize, usize) -> f64,
    ) {
        let (end, from) = (samples.end, self.all.len());
        for (place, sample) in places.zip(samples).filter(|(_, sample)| selection.holds(*sample)) {
            if self.last.replace(sample).is_none_or(|last| sample != last + 1) {
                self.all.push(Vec::with_capacity(end - sample));
            }
            // A masked reading takes one residual away; those around it are white all the same.
            if is_informed[place] {
                self.all.last_mut().expect("begun").push(value(place, sample));
            }
        }
        self.all[from..].iter_mut().for_each(Vec::shrink_to_fit);
    }
}

/// All values of some runs, one after the other.
fn joined(runs: &[Vec<f64>]) -> Cow<'_, [f64]> {
    match runs {
        [run] => Cow::Borrowed(run),
        runs => Cow::Owned(runs.concat()),
    }
}

/// The gas temperature that both readings together give, °C, smoothed as the operators do and where there is only noise.
///
/// - `parts`: of the fitted model, which keep no inferred inputs
pub(crate) fn estimated_gas(fitted: &Fitted, mut parts: impl AsMut<[Part]>, observations: &Observations) -> Vec<f64> {
    let plant = fitted.model.plant(&fitted.theta, observations);
    let filter = Weighting::of_gas(observations, plant.noise_std_k);
    let channel = usize::from(plant.extra.iter().any(|e| e.place == Place::Reading(0)));
    let mut out = Vec::new();
    for part in parts.as_mut() {
        part.inferred[1 - channel].value = Vec::new();
        let stretch = &observations.stretches[part.stretch];
        let noise = part.noise_of(channel, stretch.len());
        let (skipped, count) = (part.skipped, part.len());
        let Inferred { value, rows } = &mut part.inferred[channel];
        let mut gas = std::mem::take(value);
        gas.drain(..skipped);
        gas.truncate(count);
        for (k, gas) in gas.iter_mut().enumerate() {
            let k = k + skipped;
            let first = rows.start + k;
            let taken = rows.at(k).iter().enumerate();
            *gas -= taken.map(|(j, c)| c * noise.get(first + j).copied().unwrap_or(0.0)).sum::<f64>();
        }
        plant.undo_slow(&mut gas, stretch.start_c(), observations.step_s());
        drop(noise);
        append(&mut out, filter.smooth(&gas));
    }
    out
}

/// Coherence with the estimated input, dependence on its level and rate, on time, tails, lines, and readings that repeat.
///
/// - `pairs`: of the fitted model
/// - `is_coarse`: whether a converter is, whose rounding has no tails
pub(crate) fn tests(fitted: &Fitted, pairs: Pairs, observations: &Observations, is_coarse: bool) -> Vec<ResidualTest> {
    let r = joined(&pairs.residual);
    if r.len() < 100 {
        return Vec::new();
    }
    let mut out = Vec::new();
    out.extend(coherence(&pairs));
    out.extend(level(&pairs, &r));
    out.push(rate(&pairs, &r));
    out.push(time(&r));
    if !is_coarse {
        out.push(tails(&r));
    }
    drop(r);
    let Pairs { residual, input, .. } = pairs;
    // The transform of the residual takes several times its memory.
    drop(input);
    out.extend(lines(&residual));
    out.extend(repeated_values(observations, fitted.model.noise_std_k()));
    out
}

fn test(test: TestName, statistic: f64, degrees_of_freedom: Option<f64>, p_value: f64) -> ResidualTest {
    ResidualTest { test, statistic, degrees_of_freedom, p_value: p_value.clamp(0.0, 1.0) }
}

fn two_sided(deviate: f64) -> f64 {
    2.0 * Normal::new(0.0, 1.0).expect("the standard normal exists").sf(deviate.abs())
}

/// Largest coherence of the frequencies in which the gas stands out of the noise: under a right model that of `L` independent
/// segments exceeds `c` with probability `(1 − c)^(L − 1)`. Elsewhere the estimated input is noise, and a level that is a little off
/// leaves some of the residual's in it.
fn coherence(pairs: &Pairs) -> Option<ResidualTest> {
    let tapered = Tapered::new(hann(COHERENCE_SAMPLES));
    let bins = COHERENCE_SAMPLES / 2 - 2;
    let mut cross = vec![Complex64::default(); bins];
    let (mut of_r, mut of_x) = (vec![0.0; bins], vec![0.0; bins]);
    let mut count = 0.0_f64;
    for (r, x) in pairs.runs() {
        for (r, x) in tapered.halves(r).zip(tapered.halves(x)) {
            let transform = |v: &[f64]| {
                // Both ends on a straight line: a slope would leak into every bin.
                let (a, b) = (v[0], v[COHERENCE_SAMPLES - 1]);
                let mean = v.iter().sum::<f64>() / COHERENCE_SAMPLES as f64;
                let line = |k: usize| (b - a) * (k as f64 / (COHERENCE_SAMPLES - 1) as f64 - 0.5);
                tapered.transform(v.iter().enumerate().map(|(k, v)| v - mean - line(k)))
            };
            let (fr, fx) = (transform(r), transform(x));
            for j in 0..bins {
                cross[j] += fr[j + 2] * fx[j + 2].conj();
                of_r[j] += fr[j + 2].norm_sqr();
                of_x[j] += fx[j + 2].norm_sqr();
            }
            count += 1.0;
        }
    }
    // Half overlapping segments under Hann's window share a thirty-sixth of their power.
    let independent = count / (1.0 + 2.0 / 36.0);
    if independent < 4.0 {
        return None;
    }
    let noise = GAS_POWER_RATIO * pairs.noise_std_k.powi(2) * tapered.energy() * count;
    let coherence = |j: usize| cross[j].norm_sqr() / (of_r[j] * of_x[j]).max(1e-300);
    let of_gas: Vec<f64> = (0..bins).filter(|j| of_x[*j] > noise).map(coherence).collect();
    let largest = of_gas.iter().copied().reduce(f64::max)?;
    let of_one = (1.0 - largest).max(0.0).powf(independent - 1.0);
    let p = -((of_gas.len() as f64) * (-of_one).ln_1p()).exp_m1();
    Some(test(TestName::Coherence, largest, Some(independent), p))
}

/// The residual itself against the level of the input, in ten classes of equal size: a static error shows as a mean that differs.
fn level(pairs: &Pairs, r: &[f64]) -> Option<ResidualTest> {
    const CLASSES: usize = 10;
    let x = joined(&pairs.input);
    let mut order: Vec<u32> = (0..x.len() as u32).collect();
    order.sort_by(|&a, &b| x[a as usize].total_cmp(&x[b as usize]));
    drop(x);
    let variance = dense::dot(r, r) / r.len() as f64;
    let size = r.len() / CLASSES;
    if variance <= 0.0 || size < 10 {
        return None;
    }
    let statistic: f64 = order
        .chunks(size)
        .take(CLASSES)
        .map(|class| {
            let sum: f64 = class.iter().map(|&k| r[k as usize]).sum();
            sum * sum / (class.len() as f64 * variance)
        })
        .sum();
    let p = ChiSquared::new(CLASSES as f64).ok()?.sf(statistic);
    Some(test(TestName::Level, statistic, Some(CLASSES as f64), p))
}

/// Correlation of the residual's energy with how fast the input changes.
fn rate(pairs: &Pairs, r: &[f64]) -> ResidualTest {
    let change_k = |x: &[f64], k: usize| (x[(k + 4).min(x.len() - 1)] - x[k.saturating_sub(4)]).abs();
    let pace = pairs.input.iter().flat_map(|x| (0..x.len()).map(|k| change_k(x, k)));
    let z = correlation(r.iter().map(|r| r * r), pace, r.len() as f64) * (r.len() as f64).sqrt();
    test(TestName::Rate, z, None, two_sided(z))
}

/// Correlation of `n` values with as many others.
fn correlation(a: impl Iterator<Item = f64> + Clone, b: impl Iterator<Item = f64> + Clone, n: f64) -> f64 {
    let (ma, mb) = (a.clone().sum::<f64>() / n, b.clone().sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in a.zip(b) {
        ab += (a - ma) * (b - mb);
        aa += (a - ma) * (a - ma);
        bb += (b - mb) * (b - mb);
    }
    ab / (aa * bb).sqrt().max(1e-300)
}

/// Energies of twenty parts of the record against each other.
fn time(r: &[f64]) -> ResidualTest {
    let size = r.len() / ENERGY_PARTS;
    let mean = dense::dot(r, r) / r.len() as f64;
    let statistic: f64 = r
        .chunks(size)
        .take(ENERGY_PARTS)
        .map(|part| {
            let n = part.len() as f64;
            let z = (dense::dot(part, part) / (n * mean) - 1.0) * (0.5 * n).sqrt();
            z * z
        })
        .sum();
    let dof = (ENERGY_PARTS - 1) as f64;
    test(TestName::Time, statistic, Some(dof), ChiSquared::new(dof).map_or(1.0, |c| c.sf(statistic)))
}

/// Largest power of a single frequency over the mean of its neighbours', in the longest run: among `m` neighbours of the same
/// expectation it exceeds `x` times their mean with probability `(1 + x/m)^−m`.
fn lines(residual: &[Vec<f64>]) -> Option<ResidualTest> {
    const NEIGHBOURS: usize = 30;
    let run = residual.iter().max_by_key(|r| r.len())?;
    if run.len() < 4 * NEIGHBOURS {
        return None;
    }
    // Of a long one less than 4 % is left out, so that its length is quick to transform.
    let count = if run.len() > MAX_TRANSFORMED_AS_IT_IS { fast_length(run.len()) } else { run.len() };
    let run = &run[..count];
    let spectrum = Forward::once(count).transform(run);
    let power: Vec<f64> = spectrum[1..(run.len() - 1) / 2].iter().map(Complex64::norm_sqr).collect();
    let half = NEIGHBOURS / 2;
    let bins = half + 1..power.len().saturating_sub(half + 1);
    let ratio = |j: usize| {
        // A line between two frequencies is in both.
        let below: f64 = power[j - half - 1..j - 1].iter().sum();
        let above: f64 = power[j + 2..j + 2 + half].iter().sum();
        power[j] / ((below + above) / NEIGHBOURS as f64).max(f64::MIN_POSITIVE)
    };
    let count = bins.len();
    let largest = bins.filter(|j| j + 2 + half <= power.len()).map(ratio).fold(0.0, f64::max);
    let of_one = (1.0 + largest / NEIGHBOURS as f64).powi(-(NEIGHBOURS as i32));
    let p = -((count as f64) * (-of_one).ln_1p()).exp_m1();
    Some(test(TestName::Lines, largest, Some(NEIGHBOURS as f64), p))
}

/// Readings that equal the one before them, more often than noise `σ` on a grid of step `q` makes them, `q/(2 √π σ)`: a logger that
/// repeats what it last read. None where the grid is coarser than the noise.
fn repeated_values(observations: &Observations, noise_std_k: [f64; 2]) -> Option<ResidualTest> {
    let of_channel = |i: usize| -> Option<(f64, f64)> {
        let mut values: Vec<f64> = observations.channel(i).collect();
        values.sort_unstable_by(f64::total_cmp);
        let apart = values.windows(2).map(|w| w[1] - w[0]);
        let step_k = apart.filter(|d| *d > 1e-9 * observations.swing_k()).fold(f64::INFINITY, f64::min);
        if step_k > noise_std_k[i] {
            return None;
        }
        let share = step_k / (2.0 * std::f64::consts::PI.sqrt() * noise_std_k[i]);
        let pairs = || {
            observations.stretches.iter().flat_map(|s| {
                let masked = &s.masked[i];
                s.reading_c[i].windows(2).enumerate().filter(|(k, _)| !masked[*k] && !masked[k + 1]).map(|(_, w)| w)
            })
        };
        let count = pairs().count() as u64;
        let equal = pairs().filter(|w| w[0] == w[1]).count() as u64;
        if equal == 0 {
            return Some((0.0, 1.0));
        }
        // As many or more.
        let p = Binomial::new(share, count).ok()?.sf(equal - 1);
        Some((equal as f64 / count as f64, p))
    };
    let found = (0..2).filter_map(of_channel).min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(test(TestName::RepeatedValues, found.0, None, 2.0 * found.1))
}

/// Kurtosis: Gaussian noise has 3 with standard error `√(24/n)`.
fn tails(r: &[f64]) -> ResidualTest {
    let n = r.len() as f64;
    let second = dense::dot(r, r) / n;
    let fourth = r.iter().map(|r| r.powi(4)).sum::<f64>() / n;
    let z = (fourth / (second * second).max(1e-300) - 3.0) / (24.0 / n).sqrt();
    test(TestName::Tails, z, None, two_sided(z))
}
