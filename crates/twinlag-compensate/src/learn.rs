//! What the gas is like, from the readings themselves.
//!
//! Whittle's likelihood of the periodogram, `−Σ ln P + I/P`, `P` the power that a prior and the
//! noise are expected to give: parts are added one at a time, each where it explains most, and
//! exchanged for others, as long as the readings become more probable, the numbers integrated out
//! (`MacKay` 2003, chapter 28).

mod holes;
mod known;
mod part;
mod whittle;

use rayon::prelude::*;
use twinlag_optimise::{Budget, Minimiser, Optimiser, Problem};

use crate::error::CompensateError;
use crate::prior::{Prior, Term};
use crate::readings::Readings;
use crate::reconstruct::MAX_STATES;
use crate::rig::Rig;
use crate::spectrum::{MAX_PIECE_SAMPLES, MAX_QUICK_PIECE_SAMPLES, Periodogram};
use crate::system::states as states_of;
pub use known::GasParts;
use part::{Limits, Part};
use whittle::{BINS_PER_ONE, Whittle};

/// States of the gas, at most: what is left of [`MAX_STATES`] beside two sensors of two states each.
const MAX_GAS_STATES: usize = 20;
/// Harmonics of a comb, at most and at least.
const MAX_HARMONICS: usize = 8;
const MIN_HARMONICS: usize = 3;
/// Samples with both readings, at least: the periodogram then has 15 bins, worth eight independent
/// ones.
const MIN_SAMPLES: usize = 32;
/// Share of instants that may be missing, and by which steps may differ, before the lines between
/// them matter.
const MAX_MISSING_SHARE: f64 = 0.01;
/// What a harmonic must gain to count as one: chance gains less, 19 times in 20.
const MIN_HARMONIC_GAIN: f64 = 1.0;
/// Candidates that are fitted on ([`ADDED`]), after all were begun.
const CANDIDATES_FITTED: usize = 4;
/// Scores are twice a negative logarithm of a probability. Below this gain a part is not better than
/// none: fits that end early leave as much.
const MIN_SCORE_GAIN: f64 = 0.5;
/// Behind the best by more than this, a candidate is not fitted with all numbers together: at odds of
/// `e^7.5`, 1800 to one, that would not make up for it.
const MAX_SCORE_DEFICIT: f64 = 15.0;
/// Behind the best by less than this, parts of other kinds are nearly as likely: odds of `e³`, twenty
/// to one.
const MAX_ALTERNATIVE_DEFICIT: f64 = 6.0;
/// Probability before the readings that the gas ends at half the sampling rate. It would be chance unless
/// somebody has filtered it, so one in ten; chosen.
const ENDS_BEFORE: f64 = 0.1;
/// Priors beside the best one, at most.
const MAX_ALTERNATIVES: usize = 4;

/// How far numbers are fitted.
struct Effort {
    iterations: u64,
    /// Of the logarithm of a number.
    step_tolerance: f64,
}

/// Of a candidate among many.
const BEGUN: Effort = Effort { iterations: 3, step_tolerance: 1e-3 };
/// Of the few candidates that are left.
const ADDED: Effort = Effort { iterations: 12, step_tolerance: 1e-3 };
/// Of all parts together, while others are looked for.
const TOGETHER: Effort = Effort { iterations: 40, step_tolerance: 1e-4 };
/// Of what was found: the fit ends where rounding, which differs between compilers and processors, does not decide.
const CONVERGED: Effort = Effort { iterations: 100, step_tolerance: 1e-9 };

/// A prior for the gas, and how well the readings determine it.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// The prior.
    pub prior: Prior,
    /// The prior with its numbers moved by a standard error, a column of the covariance's Cholesky
    /// factor at a time.
    pub sigma_priors: Vec<Prior>,
    /// Alternative priors that fit almost as well, with their posterior weights (`prior` has the
    /// remainder). They matter because the readings do not determine how the spectrum continues
    /// below the noise floor.
    pub alternatives: Vec<(f64, Prior)>,
    /// Factors on the standard deviations of both channels' noise; 1 if these are known.
    pub noise_factor: [f64; 2],
    /// Probability that the gas ends at half the sampling rate instead of going on as the prior does,
    /// by what folds back from beyond. Zero if learned quickly, and where lines bridge readings.
    pub ends: f64,
    /// What `prior` and `alternatives` are made of.
    pub parts: GasParts,
}

/// Estimates the prior that `readings` of `rig` support. The covariance of its numbers is the
/// inverse of Fisher's information.
///
/// Straight lines bridge missing and uneven instants. If there are more than a few of these, the
/// likelihood is that of the readings themselves.
///
/// # Errors
/// [`CompensateError::TooShort`], and as [`crate::reconstruct()`].
pub fn learn(readings: &Readings, rig: &Rig) -> Result<Learned, CompensateError> {
    learned(readings, rig, Ask::Gas, None)
}

/// Estimates a prior as [`learn`] does, beginning with what was learned in another record.
///
/// Its numbers are fitted to these readings, so that they need not be right here, and parts are added that explain more than they
/// cost. The search ends there if none is, or if this gas is likelier than what adding parts leads to from nothing; otherwise it
/// goes on as [`learn`] does.
///
/// ```
/// use twinlag_compensate::{Readings, Rig, Sensor, learn, learn_from};
///
/// // A gas that turns this way or that every 50 ms, through a lag; 10 s of it, and the 10 s that come after.
/// let (mut gas_c, mut read_c, mut state) = (20.0, [20.0, 20.0], 1_u32);
/// let mut samples = Vec::new();
/// for k in 0..2000 {
///     if k % 5 == 0 {
///         state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
///         gas_c = 20.0 + f64::from(state >> 16) / 65_536.0;
///     }
///     for (read_c, tau_s) in read_c.iter_mut().zip([0.02, 0.1]) {
///         *read_c = gas_c + (*read_c - gas_c) * (-0.01_f64 / tau_s).exp();
///     }
///     samples.push(read_c);
/// }
/// let part = |range: std::ops::Range<usize>| {
///     let time_s = range.clone().map(|k| 0.01 * k as f64).collect();
///     Readings::new(time_s, [0, 1].map(|i| range.clone().map(|k| samples[k][i]).collect()))
/// };
/// let rig = Rig::new([Sensor::new(0.02, 0.01), Sensor::new(0.1, 0.01)]);
/// let first = learn(&part(0..1000)?, &rig)?;
/// let second = learn_from(&part(1000..2000)?, &rig, &first.parts)?;
/// // Half of the power is below a frequency that the two have alike, within a factor of two.
/// let share = |p: &twinlag_compensate::Prior| p.variance_above_k2(4.0) / p.variance_above_k2(0.1);
/// assert!((share(&first.prior) / share(&second.prior)).ln().abs() < 0.7);
/// # Ok::<(), twinlag_compensate::CompensateError>(())
/// ```
///
/// # Errors
/// As [`learn`].
pub fn learn_from(readings: &Readings, rig: &Rig, known: &GasParts) -> Result<Learned, CompensateError> {
    learned(readings, rig, Ask::Gas, Some(known))
}

/// Estimates a prior as [`learn`] does, but faster: parts are added and not exchanged, and lines of
/// long records are less sharp. Use it for a gas temperature without bands, or to compare rigs.
///
/// # Errors
/// As [`learn`].
pub fn learn_quickly(readings: &Readings, rig: &Rig) -> Result<Learned, CompensateError> {
    learned(readings, rig, Ask::GasQuickly, None)
}

/// Estimates a prior as [`learn`] does, or as [`learn_from`] where something is `known`, together with the noise levels of both
/// channels. Use it if the noise of `rig` was estimated without regard to the gas, since gas that is rough from one sample to the
/// next is then mistaken for noise.
///
/// # Errors
/// As [`learn`].
pub fn learn_with_noise(readings: &Readings, rig: &Rig, known: Option<&GasParts>) -> Result<Learned, CompensateError> {
    learned(readings, rig, Ask::GasAndNoise, known)
}

/// What is asked of the readings.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ask {
    Gas,
    /// Parts are added and not exchanged, and long records are transformed in shorter pieces.
    GasQuickly,
    GasAndNoise,
}

fn learned(readings: &Readings, rig: &Rig, ask: Ask, from: Option<&GasParts>) -> Result<Learned, CompensateError> {
    rig.check()?;
    let both = |k: &usize| (0..2).all(|i| readings.reading_c(i, *k).is_some());
    let got = (0..readings.len()).filter(both).count();
    if got < MIN_SAMPLES {
        return Err(CompensateError::TooShort { needed: MIN_SAMPLES, got });
    }
    let known = || (0..readings.len()).flat_map(|k| (0..2).filter_map(move |i| readings.reading_c(i, k)));
    let (sum, count) = known().fold((0.0, 0.0), |(sum, n), y| (sum + y, n + 1.0));
    let level_c = sum / count;
    let swing_k = (known().map(|y| (y - level_c).powi(2)).sum::<f64>() / count).sqrt().max(1e-9);
    let max_piece_samples = if ask == Ask::GasQuickly { MAX_QUICK_PIECE_SAMPLES } else { MAX_PIECE_SAMPLES };
    let periodogram = Periodogram::of(readings, rig, level_c, max_piece_samples);
    let span_s = periodogram.samples as f64 * periodogram.period_s;
    let limits = Limits { swing_k, span_s, period_s: periodogram.period_s };
    let room = MAX_STATES.saturating_sub(states_of(rig, &[])).min(MAX_GAS_STATES);
    let pooled = periodogram.pooled();
    let search = Search { bins: &periodogram, periodogram: &pooled, limits, room, ask };
    let from = from.map(|parts| parts.within(periodogram.period_s, room)).unwrap_or_default();
    let beside_noise = |parts: Vec<Part>| search.noise().into_iter().chain(parts).collect();
    let (best, mut others) = search.run(from.into_iter().map(beside_noise).collect());
    let score = best.score();
    // What was found in pools is fitted to all bins.
    let search = Search { periodogram: &periodogram, ..search };
    let best = search.converged(best);
    others.retain(|other| kinds(&other.parts) != kinds(&best.parts));
    let missing = 1.0 - got as f64 / periodogram.all as f64;
    let is_uneven = readings.unevenness() > MAX_MISSING_SHARE;
    let is_bridged = missing > MAX_MISSING_SHARE || is_uneven;
    let (ends, ended) = if is_bridged || ask == Ask::GasQuickly { (0.0, Vec::new()) } else { search.ended(&best) };
    let mut parts = if ends > 0.5 { ended } else { best.parts };
    let mut score = score;
    if is_bridged {
        let mut exact = holes::choose(&search, readings, rig, level_c, parts, is_uneven).into_iter();
        (score, parts) = exact.next().expect("what was found is among them");
        let alike = |(score, parts)| Fitted { parts, deviance: BINS_PER_ONE * score, cost: 0.0 };
        others = nearly_as_likely(kinds(&parts), score, exact.map(alike));
    }
    let sigma_parts = search.sigma_points(&parts);
    let all_parts = std::iter::once(&parts[..]).chain(others.iter().map(|o| &o.parts[..]));
    let gas_parts = GasParts::of(all_parts);
    let prior = |parts: &[Part]| Prior { level_c, terms: parts.iter().flat_map(Part::terms).collect() };
    // Kinds were equally probable before the readings.
    let weights: Vec<f64> = others.iter().map(|o| (0.5 * (score - o.score())).exp()).collect();
    let all = 1.0 + weights.iter().sum::<f64>();
    let alternatives = weights.iter().zip(&others).map(|(weight, other)| (weight / all, prior(&other.parts))).collect();
    Ok(Learned {
        prior: prior(&parts),
        sigma_priors: sigma_parts.iter().map(|p| prior(p)).collect(),
        alternatives,
        noise_factor: noise_factor(&parts),
        ends,
        parts: gas_parts,
    })
}

struct Search<'a> {
    /// Where candidates are looked for.
    bins: &'a Periodogram,
    /// What they are fitted to.
    periodogram: &'a Periodogram,
    limits: Limits,
    /// States that the gas may have.
    room: usize,
    ask: Ask,
}

/// Parts with what they leave unlikely.
#[derive(Clone, Debug)]
struct Fitted {
    parts: Vec<Part>,
    deviance: f64,
    /// Twice the logarithm of how much more there was to choose from than the readings leave.
    cost: f64,
}

impl Fitted {
    /// Parts that are yet to be fitted.
    const fn unknown(parts: Vec<Part>) -> Self {
        Self { parts, deviance: f64::INFINITY, cost: 0.0 }
    }

    /// Minus twice the logarithm of the probability of the readings, the numbers integrated out by
    /// Laplace's method.
    fn score(&self) -> f64 {
        self.deviance / BINS_PER_ONE + self.cost
    }
}

impl Search<'_> {
    /// The likeliest parts: they are added, and then each is exchanged for what explains more in
    /// its place, until neither gains. With those of other kinds that came up on the way and are
    /// nearly as likely.
    ///
    /// - `known`: parts to begin with, where there are some
    fn run(&self, known: Vec<Vec<Part>>) -> (Fitted, Vec<Fitted>) {
        let known_kinds: Vec<Vec<&str>> = known.iter().map(|parts| kinds(parts)).collect();
        let mut seen: Vec<Fitted> =
            known.into_par_iter().map(|parts| self.jointly(Fitted::unknown(parts), &TOGETHER)).collect();
        let first = if seen.is_empty() { self.first() } else { likeliest(&seen) };
        seen.extend(self.grown(first));
        let mut current = likeliest(&seen);
        let mut is_settled = known_kinds.contains(&kinds(&current.parts));
        if !known_kinds.is_empty() && !is_settled {
            // There is more in this gas than in that one: what is found without it has to be less likely.
            let rivals = self.grown(self.first());
            is_settled = current.score() <= likeliest(&rivals).score();
            seen.extend(rivals);
            current = likeliest(&seen);
        }
        if !is_settled {
            current = self.improved(current, &mut seen);
        }
        seen.sort_by(|a, b| a.score().total_cmp(&b.score()));
        let others = nearly_as_likely(kinds(&current.parts), current.score(), seen);
        let current = self.converged(current);
        let mut others: Vec<Fitted> = others.into_par_iter().map(|other| self.converged(other)).collect();
        // Fitted to the end, some may have become simpler, and the same as others.
        others.sort_by(|a, b| a.score().total_cmp(&b.score()));
        let others = nearly_as_likely(kinds(&current.parts), current.score(), others);
        (current, others)
    }

    /// `current` with parts exchanged until that gains nothing. What comes up on the way is added to what was `seen`.
    fn improved(&self, mut current: Fitted, seen: &mut Vec<Fitted>) -> Fitted {
        loop {
            let others = if self.ask == Ask::GasQuickly { Vec::new() } else { self.exchanged(&current) };
            seen.extend(others.iter().cloned());
            let better = likeliest(&others);
            if better.score() >= current.score() - MIN_SCORE_GAIN {
                return current;
            }
            seen.extend(self.grown(better));
            current = likeliest(seen);
        }
    }

    /// The single part that explains most.
    fn first(&self) -> Fitted {
        self.jointly(self.best(&Fitted::unknown(self.noise()), self.kinds().concat()), &TOGETHER)
    }

    /// The noise as a part, where it is asked for.
    fn noise(&self) -> Vec<Part> {
        if self.ask == Ask::GasAndNoise { vec![Part::Noise([1.0; 2])] } else { Vec::new() }
    }

    /// Probability that the gas ends at half the sampling rate, and the parts of `best` as they are then: their
    /// numbers fitted again with nothing that folds back.
    fn ended(&self, best: &Fitted) -> (f64, Vec<Part>) {
        let periodogram = self.periodogram.of_ending_gas();
        let ended =
            Search { periodogram: &periodogram, ..*self }.jointly(Fitted::unknown(best.parts.clone()), &CONVERGED);
        let odds_against = (1.0 / ENDS_BEFORE - 1.0) * (0.5 * (ended.score() - best.score())).exp();
        (1.0 / (1.0 + odds_against), ended.parts)
    }

    /// `from`, and then with more parts, as long as each gains more than it costs.
    fn grown(&self, from: Fitted) -> Vec<Fitted> {
        let mut out = vec![from];
        loop {
            let current = &out[out.len() - 1];
            let next = self.jointly(self.best(current, self.within(&current.parts, self.more(current))), &TOGETHER);
            if next.score() >= current.score() - MIN_SCORE_GAIN {
                return out;
            }
            out.push(next);
        }
    }

    /// `current` with one part left out, or one of each kind in its place, or one that continues otherwise.
    fn exchanged(&self, current: &Fitted) -> Vec<Fitted> {
        let gas = (0..current.parts.len()).filter(|i| current.parts[*i].noise().is_none());
        let others: Vec<Vec<Fitted>> =
            gas.collect::<Vec<usize>>().into_par_iter().map(|i| self.without(current, i)).collect();
        others.concat()
    }

    /// `current` without part `i`, or with others in its place.
    fn without(&self, current: &Fitted, i: usize) -> Vec<Fitted> {
        let mut out = Vec::new();
        let mut parts = current.parts.clone();
        parts.remove(i);
        let others = self.jointly(Fitted::unknown(parts), &TOGETHER);
        for kind in self.kinds() {
            let other = self.best(&others, self.within(&others.parts, kind));
            if other.score() < current.score() + MAX_SCORE_DEFICIT {
                out.push(self.jointly(other, &TOGETHER));
            }
        }
        if has_gas(&others.parts) {
            out.push(others);
        }
        for otherwise in current.parts[i].otherwise(&self.limits) {
            let mut parts = current.parts.clone();
            parts[i] = otherwise;
            if states(&parts) <= self.room {
                out.push(self.jointly(Fitted::unknown(parts), &TOGETHER));
            }
        }
        out
    }

    /// All numbers fitted together, parts that come to nothing left out.
    fn jointly(&self, current: Fitted, effort: &Effort) -> Fitted {
        if !has_gas(&current.parts) || (current.parts.len() == 1 && current.deviance.is_finite()) {
            return current;
        }
        let mut fitted = self.fit(&current.parts, &self.beside(&current.parts), effort);
        let simpler: Vec<Part> =
            fitted.parts.iter().map(|part| part.simpler().unwrap_or_else(|| part.clone())).collect();
        if simpler != fitted.parts {
            let other = self.fit(&simpler, &self.beside(&simpler), effort);
            if other.score() <= fitted.score() {
                fitted = other;
            }
        }
        fitted.parts.retain(|p| !p.is_nothing(&self.limits));
        fitted
    }

    /// All numbers of a gas fitted to the end.
    fn converged(&self, found: Fitted) -> Fitted {
        if has_gas(&found.parts) { self.jointly(Fitted::unknown(found.parts), &CONVERGED) } else { found }
    }

    /// The `candidates` for which `parts` leave room.
    fn within(&self, parts: &[Part], candidates: Vec<Part>) -> Vec<Part> {
        let room = self.room.saturating_sub(states(parts));
        candidates.into_iter().filter(|p| states(std::slice::from_ref(p)) <= room).collect()
    }

    /// `current` with the one of `candidates` that explains most beside it.
    fn best(&self, current: &Fitted, candidates: Vec<Part>) -> Fitted {
        let others = expected(self.periodogram, &current.parts);
        let mut begun: Vec<Fitted> =
            candidates.into_par_iter().map(|part| self.fit(&[part], &others, &BEGUN)).collect();
        begun.sort_by(|a, b| a.score().total_cmp(&b.score()));
        begun.truncate(CANDIDATES_FITTED);
        let noise = current.parts.iter().filter_map(Part::noise);
        let of_noise: f64 = noise.map(|factors| self.periodogram.of_factors(factors).0).sum();
        let added: Vec<Fitted> = begun.into_par_iter().map(|begun| self.fit(&begun.parts, &others, &ADDED)).collect();
        match added.into_iter().min_by(|a, b| a.score().total_cmp(&b.score())) {
            Some(added) => Fitted {
                parts: current.parts.iter().cloned().chain(added.parts).collect(),
                deviance: added.deviance + of_noise,
                cost: current.cost + added.cost,
            },
            None => current.clone(),
        }
    }

    /// What the choice of the numbers of `parts` costs.
    fn cost(&self, parts: &[Part]) -> f64 {
        Whittle { periodogram: self.periodogram, others: &self.beside(parts), parts }.cost()
    }

    /// `parts` with their numbers moved by a standard error, one column at a time.
    fn sigma_points(&self, parts: &[Part]) -> Vec<Vec<Part>> {
        let cost = Whittle { periodogram: self.periodogram, others: &self.beside(parts), parts };
        let Some(information) = cost.information() else { return Vec::new() };
        let values: Vec<f64> = parts.iter().flat_map(Part::values).collect();
        let Some(factor) = information.cholesky() else { return Vec::new() };
        let columns = factor.l().transpose().try_inverse().unwrap_or_default();
        let moved = columns.column_iter().map(|column| {
            let moved: Vec<f64> = values.iter().zip(column.iter()).map(|(v, by)| v * by.exp()).collect();
            part::with(parts, &moved)
        });
        moved.collect()
    }

    /// The single part of each kind that explains most.
    fn best_of_each_kind(&self) -> Vec<Part> {
        let nothing = Fitted::unknown(Vec::new());
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
            at(&|corner_hz| Part::Turbulent { std_k: swing_k, corner_hz, fastest_hz: self.limits.fastest_hz() }),
            at(&|corner_hz| Part::Single(Term::Rough { std_k: swing_k, corner_hz })),
            at(&smooth),
        ]
    }

    /// What might be added to `current`, where there is most above what is expected: a line, a
    /// band, a broad process, a comb.
    fn more(&self, current: &Fitted) -> Vec<Part> {
        let p = self.bins;
        let expected = expected(p, &current.parts);
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
                let std_k = excess_k(j, half);
                out.push(Part::Single(Term::Rough { std_k, corner_hz: hz }));
                out.push(Part::Turbulent { std_k, corner_hz: hz, fastest_hz: self.limits.fastest_hz() });
            }
        }
        out.extend(self.combs(&ratio, excess_k));
        out
    }

    /// The comb whose harmonics stick out most: one that ends with them, and one that goes on.
    fn combs(&self, ratio: &[f64], excess_k: impl Fn(usize, usize) -> f64) -> Vec<Part> {
        let gain = |j: usize| {
            let r = ratio[j];
            if r > 1.0 { self.bins.pieces * (r - 1.0 - r.ln()) } else { 0.0 }
        };
        // Bins count from the second one; a quarter of a bin of the highest harmonic is the step.
        let bins = ratio.len() as f64;
        let per_bin = 4 * MAX_HARMONICS;
        let at =
            |first: f64, m: usize| ((first * m as f64).round() as usize).checked_sub(1).filter(|j| *j < ratio.len());
        let total = |first: f64| {
            let gains = (1..=MAX_HARMONICS).filter_map(|m| Some(gain(at(first, m)?) - MIN_HARMONIC_GAIN));
            // Up to the harmonic at which the sum is largest.
            let sums = gains.scan(0.0, |sum, g| {
                *sum += g;
                Some(*sum)
            });
            sums.enumerate().map(|(m, sum)| (sum, m + 1)).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0))
        };
        let steps = 3 * per_bin..(bins / MIN_HARMONICS as f64) as usize * per_bin;
        let best = steps
            .map(|s| s as f64 / per_bin as f64)
            .map(|first| (first, total(first)))
            .max_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let Some((first, (_, harmonics))) = best else { return Vec::new() };
        let std_k = (1..=harmonics).map_while(|m| Some(excess_k(at(first, m)?, 2))).collect::<Vec<f64>>();
        if std_k.len() < MIN_HARMONICS {
            return Vec::new();
        }
        let [frequency_hz, width_hz] = [first / self.limits.span_s, 0.1 / self.limits.span_s];
        [false, true].map(|goes_on| Part::Comb { frequency_hz, width_hz, std_k: std_k.clone(), goes_on }).to_vec()
    }

    /// What is expected beside `parts`: noise, unless that is one of them.
    fn beside(&self, parts: &[Part]) -> Vec<f64> {
        beside(self.periodogram, parts)
    }

    /// The numbers of `parts` that are likeliest beside `others`.
    fn fit(&self, parts: &[Part], others: &[f64], effort: &Effort) -> Fitted {
        let cost = Whittle { periodogram: self.periodogram, others, parts };
        let variables = parts.iter().flat_map(|p| p.variables(&self.limits)).collect();
        let values: Vec<f64> = parts.iter().flat_map(Part::values).collect();
        let fit = Problem::new(&cost, variables).ok().and_then(|problem| {
            let optimiser = Optimiser::LevenbergMarquardt { step_tolerance: effort.step_tolerance };
            optimiser.minimise(&problem, &values, &Budget { iterations: effort.iterations, ..Budget::default() }).ok()
        });
        match fit {
            Some(fit) => {
                let parts = part::with(parts, &fit.x);
                let cost = Whittle { parts: &parts, ..cost }.cost();
                Fitted { parts, deviance: fit.value, cost }
            }
            None => Fitted::unknown(parts.to_vec()),
        }
    }
}

/// What is expected of `parts` and everything else.
fn expected(periodogram: &Periodogram, parts: &[Part]) -> Vec<f64> {
    let mut out = beside(periodogram, parts);
    out.iter_mut().zip(periodogram.of_parts(parts)).for_each(|(sum, p)| *sum += p);
    out
}

fn beside(periodogram: &Periodogram, parts: &[Part]) -> Vec<f64> {
    if parts.iter().any(|part| part.noise().is_some()) {
        return vec![0.0; periodogram.power.len()];
    }
    periodogram.of_noise([1.0; 2])
}

/// The one of `all` with the least score.
fn likeliest(all: &[Fitted]) -> Fitted {
    let best = all.iter().min_by(|a, b| a.score().total_cmp(&b.score()));
    best.cloned().unwrap_or(Fitted::unknown(Vec::new()))
}

/// The first of each kind in `sorted` that is not `best` and whose score is not far above that of it.
fn nearly_as_likely(best: Vec<&'static str>, score: f64, sorted: impl IntoIterator<Item = Fitted>) -> Vec<Fitted> {
    let mut told = vec![best];
    let near = sorted.into_iter().take_while(|other| other.score() < score + MAX_ALTERNATIVE_DEFICIT);
    let new = near.filter(|other| {
        let kinds = kinds(&other.parts);
        let is_new = !told.contains(&kinds);
        told.push(kinds);
        is_new
    });
    new.take(MAX_ALTERNATIVES).collect()
}

/// What the standard deviations of both channels' noise are multiplied by, of `parts`.
fn noise_factor(parts: &[Part]) -> [f64; 2] {
    parts.iter().find_map(Part::noise).map_or([1.0; 2], |factors| factors.map(f64::sqrt))
}

/// What `parts` are, in the order of the alphabet.
fn kinds(parts: &[Part]) -> Vec<&'static str> {
    let mut kinds: Vec<&str> = parts.iter().map(Part::kind).collect();
    kinds.sort_unstable();
    kinds
}

fn has_gas(parts: &[Part]) -> bool {
    parts.iter().any(|part| part.noise().is_none())
}

fn states(parts: &[Part]) -> usize {
    parts.iter().flat_map(Part::terms).map(|t| t.states()).sum()
}
