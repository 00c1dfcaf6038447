//! What the gas is like, from the readings themselves.
//!
//! Whittle's likelihood of the periodogram, `−Σ ln P + I/P`, `P` the power that a prior and the noise are expected to give: parts are
//! added one at a time, each where it explains most, as long as the likelihood gains more than the numbers cost (Akaike's
//! criterion; a line costs the choice of its frequency among all bins as well).

mod holes;
mod part;

use nalgebra::DMatrix;
use twinlag_optimise::{Budget, Cost, Derivatives, Minimiser, Optimiser, Problem};

use crate::error::CompensateError;
use crate::prior::{Prior, Term};
use crate::readings::Readings;
use crate::reconstruct::MOST_STATES;
use crate::rig::Rig;
use crate::spectrum::Periodogram;
use crate::system::states as states_of;
use part::{Limits, Part};

/// Most states of the gas.
const MOST_OF_GAS: usize = 20;
/// Harmonics of a comb, at most and at least.
const HARMONICS: usize = 8;
const FEWEST_HARMONICS: usize = 3;
/// Fewest samples with both readings.
const FEWEST: usize = 32;
/// Share of instants that may be missing, and by which steps may differ, before the lines between them matter.
const FEW_MISSING: f64 = 0.01;
/// Neighbouring bins of a periodogram with Hann's taper go together: this many are worth one, `1 + 2 ((2/3)² + (1/6)²)`.
const BINS_PER_ONE: f64 = 1.944;
/// What a harmonic must gain to count as one: chance gains less, 19 times in 20.
const HARMONIC_GAIN: f64 = 1.0;
/// Step of a logarithm in differences.
const STEP: f64 = 1e-4;
/// Standard deviation of the logarithm of each number before the readings are looked at: what they do not tell is known within a factor
/// of e.
const LOG_STD: f64 = 1.0;

/// A prior, and how well the readings tell it.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// The prior.
    pub prior: Prior,
    /// The prior with its numbers moved by a standard error, a column of the covariance's Cholesky factor at a time.
    pub deviations: Vec<Prior>,
}

/// The prior that `readings` of `rig` support, the covariance of its numbers the inverse of Fisher's information.
///
/// Instants that are missing, and uneven ones, are bridged by straight lines; where that is more than a few the likelihood is that of the
/// readings themselves.
///
/// # Errors
/// [`CompensateError::TooShort`], and as [`crate::reconstruct()`].
pub fn learn(readings: &Readings, rig: &Rig) -> Result<Learned, CompensateError> {
    rig.check()?;
    let both = |k: &usize| (0..2).all(|i| readings.reading_c(i, *k).is_some());
    let got = (0..readings.len()).filter(both).count();
    if got < FEWEST {
        return Err(CompensateError::TooShort { needed: FEWEST, got });
    }
    let known = || (0..readings.len()).flat_map(|k| (0..2).filter_map(move |i| readings.reading_c(i, k)));
    let (sum, count) = known().fold((0.0, 0.0), |(sum, n), y| (sum + y, n + 1.0));
    let level_c = sum / count;
    let swing_k = (known().map(|y| (y - level_c).powi(2)).sum::<f64>() / count).sqrt().max(1e-9);
    let periodogram = Periodogram::of(readings, rig, level_c);
    let span_s = periodogram.samples as f64 * periodogram.period_s;
    let limits = Limits { swing_k, span_s, period_s: periodogram.period_s };
    let room = MOST_STATES.saturating_sub(states_of(rig, &[])).min(MOST_OF_GAS);
    let search = Search { periodogram: &periodogram, limits, room };
    let mut parts = search.run();
    let missing = 1.0 - got as f64 / periodogram.all as f64;
    let is_uneven = readings.unevenness() > FEW_MISSING;
    if missing > FEW_MISSING || is_uneven {
        parts = holes::choose(&search, readings, rig, level_c, parts, is_uneven);
    }
    let prior = |parts: &[Part]| Prior { level_c, terms: parts.iter().flat_map(Part::terms).collect() };
    Ok(Learned { prior: prior(&parts), deviations: search.deviations(&parts).iter().map(|p| prior(p)).collect() })
}

struct Search<'a> {
    periodogram: &'a Periodogram,
    limits: Limits,
    /// States that the gas may have.
    room: usize,
}

/// Parts with what they leave unlikely.
#[derive(Clone, Debug)]
struct Fitted {
    parts: Vec<Part>,
    deviance: f64,
}

impl Fitted {
    /// Twice the negative logarithm of the likelihood, and what the numbers cost. A part of a periodogram of `bins` independent bins.
    fn score(&self, bins: f64) -> f64 {
        self.deviance / BINS_PER_ONE + self.parts.iter().map(|p| p.cost(bins)).sum::<f64>()
    }
}

impl Search<'_> {
    /// Independent bins.
    fn bins(&self) -> f64 {
        self.periodogram.power.len() as f64 / BINS_PER_ONE
    }

    fn run(&self) -> Vec<Part> {
        let n = self.bins();
        let nothing = Fitted { parts: Vec::new(), deviance: f64::INFINITY };
        let mut current = self.best(&nothing, self.first());
        loop {
            let room = self.room.saturating_sub(states(&current.parts));
            let candidates = self.more(&current).into_iter().filter(|p| states(std::slice::from_ref(p)) <= room);
            let mut next = self.best(&current, candidates.collect());
            if next.parts.len() > 1 {
                next = self.fit(&next.parts, &self.periodogram.noise, 25);
                next.parts.retain(|p| !p.is_nothing(&self.limits));
            }
            if next.score(n) >= current.score(n) {
                return current.parts;
            }
            current = next;
        }
    }

    /// `current` with the one of `candidates` that explains most beside it.
    fn best(&self, current: &Fitted, candidates: Vec<Part>) -> Fitted {
        let others = self.expected(&current.parts);
        let added = candidates.into_iter().map(|part| self.fit(&[part], &others, 12));
        let n = self.bins();
        match added.min_by(|a, b| a.score(n).total_cmp(&b.score(n))) {
            Some(added) => {
                Fitted { parts: current.parts.iter().cloned().chain(added.parts).collect(), deviance: added.deviance }
            }
            None => current.clone(),
        }
    }

    /// `parts` with their numbers moved by a standard error, one column at a time.
    fn deviations(&self, parts: &[Part]) -> Vec<Vec<Part>> {
        let values: Vec<f64> = parts.iter().flat_map(Part::values).collect();
        let cost = Whittle { periodogram: self.periodogram, others: &self.periodogram.noise, parts };
        let Some(derivatives) = cost.derivatives(&values) else { return Vec::new() };
        // Of the logarithms; the deviance is twice the logarithm of the likelihood.
        let information = DMatrix::from_fn(values.len(), values.len(), |a, b| {
            let told = derivatives.curvature[a][b] * values[a] * values[b] / (2.0 * BINS_PER_ONE);
            told + if a == b { 1.0 / (LOG_STD * LOG_STD) } else { 0.0 }
        });
        let Some(factor) = information.cholesky() else { return Vec::new() };
        let columns = factor.l().transpose().try_inverse().unwrap_or_default();
        let moved = columns.column_iter().map(|column| {
            let moved: Vec<f64> = values.iter().zip(column.iter()).map(|(v, by)| v * by.exp()).collect();
            part::with(parts, &moved)
        });
        moved.collect()
    }

    fn first(&self) -> Vec<Part> {
        self.kinds().concat()
    }

    /// Of each kind of single part the one that explains most.
    fn best_of_each_kind(&self) -> Vec<Part> {
        let nothing = Fitted { parts: Vec::new(), deviance: f64::INFINITY };
        self.kinds().into_iter().flat_map(|kind| self.best(&nothing, kind).parts).collect()
    }

    /// Single parts to begin with, of each kind at several frequencies.
    fn kinds(&self) -> [Vec<Part>; 3] {
        let Limits { swing_k, span_s, period_s } = self.limits;
        let [low, high] = [1.0 / span_s, 0.3 / period_s];
        let at = |part: &dyn Fn(f64) -> Part| {
            (0..4).map(|k| part(low * (high / low).powf(f64::from(k) / 4.0))).collect::<Vec<Part>>()
        };
        let smooth = |frequency_hz| Part::Single(Term::Resonance { std_k: swing_k, frequency_hz, quality: 0.3 });
        [
            at(&|corner_hz| Part::Turbulent { std_k: swing_k, corner_hz, fastest_hz: 0.5 / period_s }),
            at(&|corner_hz| Part::Single(Term::Rough { std_k: swing_k, corner_hz })),
            at(&smooth),
        ]
    }

    /// What might be added to `current`, where there is most above what is expected: a line, a band, a broad process, a comb.
    fn more(&self, current: &Fitted) -> Vec<Part> {
        let p = self.periodogram;
        let expected = self.expected(&current.parts);
        let ratio: Vec<f64> = p.power.iter().zip(&expected).map(|(i, e)| i / e).collect();
        let excess_k = |j: usize, half: usize| {
            let range = j.saturating_sub(half)..(j + half + 1).min(ratio.len());
            let above: f64 = range.map(|k| (p.power[k] - expected[k]).max(0.0)).sum();
            (2.0 * above / self.limits.span_s).sqrt().max(1e-6 * self.limits.swing_k)
        };
        let mut out = Vec::new();
        for half in [1, 4, 16, 64] {
            let width = (2 * half + 1) as f64;
            let gain = |window: &[f64]| {
                let mean = window.iter().sum::<f64>() / width;
                if mean > 1.0 { width * (mean - 1.0 - mean.ln()) } else { 0.0 }
            };
            let gains = ratio.windows(2 * half + 1).map(gain).enumerate();
            let Some((j, _)) = gains.filter(|g| g.1 > 0.0).max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let j = j + half;
            let hz = p.frequency_hz[j];
            let quality = (hz * self.limits.span_s / width).max(0.5);
            out.push(Part::Single(Term::Resonance { std_k: excess_k(j, half), frequency_hz: hz, quality }));
            if half >= 16 {
                out.push(Part::Single(Term::Rough { std_k: excess_k(j, half), corner_hz: hz }));
            }
        }
        out.extend(self.comb(&ratio, excess_k));
        out
    }

    /// The comb whose harmonics stick out most.
    fn comb(&self, ratio: &[f64], excess_k: impl Fn(usize, usize) -> f64) -> Option<Part> {
        let gain = |j: usize| {
            let r = ratio[j];
            if r > 1.0 { self.periodogram.pieces * (r - 1.0 - r.ln()) } else { 0.0 }
        };
        // Bins count from the second one; a quarter of a bin of the highest harmonic is the step.
        let bins = ratio.len() as f64;
        let per_bin = 4 * HARMONICS;
        let at =
            |first: f64, m: usize| ((first * m as f64).round() as usize).checked_sub(1).filter(|j| *j < ratio.len());
        let total = |first: f64| {
            let gains = (1..=HARMONICS).filter_map(|m| Some(gain(at(first, m)?) - HARMONIC_GAIN));
            // Up to the harmonic at which the sum is largest.
            let sums = gains.scan(0.0, |sum, g| {
                *sum += g;
                Some(*sum)
            });
            sums.enumerate().map(|(m, sum)| (sum, m + 1)).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0))
        };
        let steps = 3 * per_bin..(bins / FEWEST_HARMONICS as f64) as usize * per_bin;
        let (first, (_, harmonics)) = steps
            .map(|s| s as f64 / per_bin as f64)
            .map(|first| (first, total(first)))
            .max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
        let std_k = (1..=harmonics).map_while(|m| Some(excess_k(at(first, m)?, 2))).collect::<Vec<f64>>();
        (std_k.len() >= FEWEST_HARMONICS).then(|| Part::Comb {
            frequency_hz: first / self.limits.span_s,
            width_hz: 0.1 / self.limits.span_s,
            std_k,
        })
    }

    fn expected(&self, parts: &[Part]) -> Vec<f64> {
        let mut out = self.periodogram.noise.clone();
        if !parts.is_empty() {
            let terms: Vec<Term> = parts.iter().flat_map(Part::terms).collect();
            out.iter_mut().zip(self.periodogram.expected(&terms)).for_each(|(sum, p)| *sum += p);
        }
        out
    }

    /// The numbers of `parts` that are likeliest beside `others`.
    fn fit(&self, parts: &[Part], others: &[f64], iterations: u64) -> Fitted {
        let cost = Whittle { periodogram: self.periodogram, others, parts };
        let variables = parts.iter().flat_map(|p| p.variables(&self.limits)).collect();
        let values: Vec<f64> = parts.iter().flat_map(Part::values).collect();
        let fit = Problem::new(&cost, variables).ok().and_then(|problem| {
            let optimiser = Optimiser::LevenbergMarquardt { step_tolerance: 1e-3 };
            optimiser.minimise(&problem, &values, &Budget { iterations, ..Budget::default() }).ok()
        });
        match fit {
            Some(fit) => Fitted { parts: part::with(parts, &fit.x), deviance: fit.value },
            None => Fitted { parts: parts.to_vec(), deviance: f64::INFINITY },
        }
    }
}

fn states(parts: &[Part]) -> usize {
    parts.iter().flat_map(Part::terms).map(|t| t.states()).sum()
}

/// Twice the negative logarithm of Whittle's likelihood.
struct Whittle<'a> {
    periodogram: &'a Periodogram,
    /// Power that is expected of everything else.
    others: &'a [f64],
    parts: &'a [Part],
}

impl Whittle<'_> {
    fn deviance(&self, expected: &[f64]) -> f64 {
        let sum: f64 = expected.iter().zip(&self.periodogram.power).map(|(e, i)| e.ln() + i / e).sum();
        2.0 * self.periodogram.pieces * sum
    }
}

impl Cost for Whittle<'_> {
    fn value(&self, x: &[f64]) -> f64 {
        let terms: Vec<Term> = part::with(self.parts, x).iter().flat_map(Part::terms).collect();
        let own = self.periodogram.expected(&terms);
        self.deviance(&self.others.iter().zip(own).map(|(a, b)| a + b).collect::<Vec<f64>>())
    }

    /// Fisher's scoring: the curvature is its expectation, `2 Σ ∂_a ln P ∂_b ln P`.
    fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
        let p = self.periodogram;
        let parts = part::with(self.parts, x);
        let mut expected = self.others.to_vec();
        let mut slopes: Vec<Vec<f64>> = Vec::new();
        for part in &parts {
            let each: Vec<Vec<f64>> = part.terms().iter().map(|t| p.expected(&[*t])).collect();
            let mut own = vec![0.0; expected.len()];
            for line in &each {
                own.iter_mut().zip(line).for_each(|(sum, p)| *sum += p);
            }
            expected.iter_mut().zip(&own).for_each(|(sum, p)| *sum += p);
            let values = part.values();
            for (a, value) in values.iter().enumerate() {
                slopes.push(if let Some(term) = part.size_of(a) {
                    each[term].iter().map(|p| 2.0 * p / value).collect()
                } else {
                    let mut moved = values.clone();
                    moved[a] *= STEP.exp();
                    let moved = p.expected(&part::with(std::slice::from_ref(part), &moved)[0].terms());
                    moved.iter().zip(&own).map(|(b, a)| (b - a) / (STEP.exp_m1() * value)).collect()
                });
            }
        }
        for slope in &mut slopes {
            slope.iter_mut().zip(&expected).for_each(|(s, e)| *s /= e);
        }
        let residual: Vec<f64> = p.power.iter().zip(&expected).map(|(i, e)| 1.0 - i / e).collect();
        let dot = |a: &[f64], b: &[f64]| 2.0 * p.pieces * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        Some(Derivatives {
            value: self.deviance(&expected),
            gradient: slopes.iter().map(|s| dot(s, &residual)).collect(),
            curvature: slopes.iter().map(|a| slopes.iter().map(|b| dot(a, b)).collect()).collect(),
        })
    }
}
