//! The spectrum of a whitened residual in bands, and models of noise fitted to it.
//!
//! Blocks of the residual are transformed one by one, so that parts of the record can be held out. The power of white noise of
//! unit variance is 1 in every band.

use num_complex::Complex64;
use twinlag_optimise::{Budget, Cost, Minimiser, Optimiser, Problem, Variable};
use twinlag_transform::Forward;

use crate::dense;
use crate::disagreement::Evaluator;
use crate::effect::coloured_noise::{MAX_CORRELATION_SPANS, MIN_CORRELATION_STEPS};
use crate::implied::{is_all_informed, is_informed};
use crate::model::Model;
use crate::observations::Observations;
use crate::plant::{Extra, Place, Plant};

/// Longest block, samples.
const LONGEST_BLOCK: usize = 1024;
/// Fewest blocks.
const FEWEST_BLOCKS: usize = 8;

/// One band: its frequency in radians per sample, and power and degrees of freedom in the blocks of either half.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Band {
    pub omega: f64,
    /// Sum of powers over the bins of either half.
    sum: [f64; 2],
    /// Degrees of freedom of either half.
    dof: [f64; 2],
}

impl Band {
    pub fn dof(&self) -> f64 {
        self.dof[0] + self.dof[1]
    }

    /// Mean power.
    pub fn power(&self) -> f64 {
        (self.sum[0] + self.sum[1]) / self.dof().max(1.0)
    }
}

/// Power in bands of growing width.
#[derive(Clone, Debug)]
pub struct Bands(pub Vec<Band>);

/// The blocks that are used.
#[derive(Clone, Copy)]
pub(crate) enum Half {
    Both,
    Even,
    Odd,
}

impl Half {
    fn of(self, sums: [f64; 2]) -> f64 {
        match self {
            Self::Both => sums[0] + sums[1],
            Self::Even => sums[0],
            Self::Odd => sums[1],
        }
    }
}

impl Bands {
    /// - `runs`: unbroken stretches of the residual
    pub fn of(runs: &[Vec<f64>]) -> Self {
        let total: usize = runs.iter().map(Vec::len).sum();
        let longest = runs.iter().map(Vec::len).max().unwrap_or(0);
        let block = (total / FEWEST_BLOCKS).min(longest / 2).clamp(8, LONGEST_BLOCK) & !1;
        let edges = edges(block / 2);
        let mut bands: Vec<Band> = edges
            .windows(2)
            .map(|e| Band {
                omega: std::f64::consts::TAU * (e[0] + e[1] - 1) as f64 * 0.5 / block as f64,
                sum: [0.0; 2],
                dof: [0.0; 2],
            })
            .collect();
        let plan = Forward::of(block);
        let mut index = 0;
        for run in runs {
            for piece in run.chunks_exact(block) {
                let spectrum = plan.transform(piece);
                for (band, e) in bands.iter_mut().zip(edges.windows(2)) {
                    for (bin, x) in spectrum.iter().enumerate().take(e[1]).skip(e[0]) {
                        let dof = if bin == 0 || 2 * bin == block { 1.0 } else { 2.0 };
                        band.sum[index % 2] += dof * x.norm_sqr() / block as f64;
                        band.dof[index % 2] += dof;
                    }
                }
                index += 1;
            }
        }
        bands.retain(|b| b.dof() > 0.0);
        Self(bands)
    }

    /// `−2 ln L` with a free level in every band, each with its weight: what is left however the noise is coloured.
    pub fn robust(&self, weight: impl Fn(f64) -> f64) -> f64 {
        self.0.iter().map(|b| weight(b.omega) * b.dof() * b.power().max(1e-300).ln()).sum()
    }

    /// `−2 ln L` of noise whose power is `ratio` times that of the whitening, band by band, less its value for white noise of unit
    /// power.
    fn likelihood(&self, half: Half, ratio: impl Fn(usize, f64) -> f64) -> f64 {
        self.0
            .iter()
            .enumerate()
            .map(|(index, b)| {
                let ratio = ratio(index, b.omega).max(1e-12);
                half.of(b.dof) * ratio.ln() + half.of(b.sum) / ratio
            })
            .sum()
    }
}

/// Bins of bands a quarter of an octave wide, the first of them alone.
fn edges(bins: usize) -> Vec<usize> {
    let mut out = vec![0, 1];
    while *out.last().expect("not empty") <= bins {
        let last = *out.last().expect("not empty");
        let next = ((last as f64 * 1.19).ceil() as usize).max(last + 1);
        out.push(next.min(bins + 1));
    }
    out
}

/// Power of each path of noise into the disagreement, per unit variance: both channels, the gas.
pub(crate) struct Paths {
    rows: [Vec<f64>; 3],
    base: [f64; 2],
    extra: Vec<Extra>,
    step_s: f64,
}

fn power(row: &[f64], omega: f64) -> f64 {
    row.iter().enumerate().map(|(j, c)| c * Complex64::cis(-omega * j as f64)).sum::<Complex64>().norm_sqr()
}

/// What first-order autoregressive noise of unit variance has.
fn autoregressive(correlation_s: f64, step_s: f64, omega: f64) -> f64 {
    let rho = (-step_s / correlation_s).exp();
    (1.0 - rho * rho) / (1.0 - 2.0 * rho * omega.cos() + rho * rho)
}

impl Paths {
    pub(crate) fn of(plant: &Plant, observations: &Observations) -> Self {
        Self {
            rows: plant.noise_paths(observations),
            base: plant.noise_std_k.map(|s| s * s),
            extra: plant.extra.clone(),
            step_s: observations.step_s(),
        }
    }

    /// Power that noise of unit variance at `place` has in the disagreement.
    pub(crate) fn power(&self, place: Place, omega: f64) -> f64 {
        let row = match place {
            Place::Reading(i) => &self.rows[i],
            Place::Gas => &self.rows[2],
        };
        power(row, omega)
    }

    /// Power of the disagreement.
    pub(crate) fn total(&self, variance: [f64; 2], extra: &[Extra], omega: f64) -> f64 {
        let white: f64 = (0..2).map(|i| variance[i] * power(&self.rows[i], omega)).sum();
        let coloured: f64 = extra
            .iter()
            .map(|e| {
                e.std_k * e.std_k * autoregressive(e.correlation_s, self.step_s, omega) * self.power(e.place, omega)
            })
            .sum();
        white + coloured
    }
}

/// Levels of the channels' white noise, and with them one more source of noise if there is one.
#[derive(Debug)]
#[non_exhaustive]
pub struct NoiseFit {
    /// White noise, K.
    pub noise_std_k: [f64; 2],
    pub extra: Option<Extra>,
    /// `−2 ln L`.
    pub likelihood: f64,
    /// Likelihood of each half with the parameters of the other half, summed.
    pub held_out: f64,
}

/// Factor by which a fitted noise may change the level of white noise, either way.
const MAX_LEVEL_FACTOR: f64 = 5.0;
/// Standard deviations of the logarithm of levels from third differences: below, since these see coloured noise and what is left
/// of the gas as well; above, where nothing but scatter is.
const LEVELS_LOOSE: f64 = 0.3;
const LEVELS_TIGHT: f64 = 0.03;
/// Standard deviation of the logarithm of levels below those from third differences, where what is left over shows that these are mostly
/// of the gas: a factor of e.
const LEVELS_OF_GAS: f64 = 1.0;
/// Step of derivatives in the logarithm of a parameter: about the cube root of rounding.
const LOG_STEP: f64 = 1e-5;

struct NoiseCost<'a> {
    bands: &'a Bands,
    paths: &'a Paths,
    /// Power of the whitening in each band.
    base: &'a [f64],
    place: Option<Place>,
    half: Half,
    /// Channels whose converter is coarse: third differences may say anything.
    is_coarse: [bool; 2],
    /// Standard deviation of the logarithm of a level below that of third differences.
    below: f64,
}

impl NoiseCost<'_> {
    fn parts(&self, x: &[f64]) -> ([f64; 2], Vec<Extra>) {
        let variance = [0, 1].map(|i| self.paths.base[i] * x[i] * x[i]);
        let mut extra = self.paths.extra.clone();
        if let Some(place) = self.place {
            extra.push(Extra { place, std_k: x[2], correlation_s: x[3] });
        }
        (variance, extra)
    }

    fn likelihood(&self, x: &[f64], half: Half) -> f64 {
        let (variance, extra) = self.parts(x);
        self.bands.likelihood(half, |index, omega| self.paths.total(variance, &extra, omega) / self.base[index])
    }
}

impl Cost for NoiseCost<'_> {
    fn value(&self, x: &[f64]) -> f64 {
        let prior = |(factor, is_coarse): (&f64, &bool)| {
            let above = if *is_coarse { LEVELS_LOOSE } else { LEVELS_TIGHT };
            let scatter = if *factor > 1.0 { above } else { self.below };
            (factor.ln() / scatter).powi(2)
        };
        self.likelihood(x, self.half) + x[..2].iter().zip(&self.is_coarse).map(prior).sum::<f64>()
    }
}

/// What a noise is fitted to, and from where.
struct NoiseSearch<'a> {
    observations: &'a Observations,
    bands: &'a Bands,
    paths: Paths,
    /// Power of the whitening in each band.
    base: Vec<f64>,
    place: Option<Place>,
    /// Factors of both levels, and the extra noise, that solvers start from.
    starts: Vec<Vec<f64>>,
    is_coarse: [bool; 2],
    below: f64,
}

impl<'a> NoiseSearch<'a> {
    fn of(plant: &Plant, observations: &'a Observations, bands: &'a Bands, is_coarse: [bool; 2]) -> Self {
        let paths = Paths::of(plant, observations);
        let power = |b: &Band| paths.total(paths.base, &paths.extra, b.omega).max(f64::MIN_POSITIVE);
        let base = bands.0.iter().map(power).collect();
        let starts = vec![vec![1.0; 2]];
        Self { observations, bands, paths, base, place: None, starts, is_coarse, below: LEVELS_LOOSE }
    }

    /// A search for the extra noise of `plant` at `place`, and this noise as it is; `None` of a plant without it.
    fn of_extra(
        plant: &Plant,
        place: Place,
        observations: &'a Observations,
        bands: &'a Bands,
        is_coarse: [bool; 2],
    ) -> Option<(Self, Extra)> {
        let mut search = Self { place: Some(place), ..Self::of(plant, observations, bands, is_coarse) };
        let at = search.paths.extra.iter().position(|extra| extra.place == place)?;
        let extra = search.paths.extra.remove(at);
        Some((search, extra))
    }

    fn cost(&self, half: Half) -> NoiseCost<'_> {
        let Self { bands, paths, base, place, is_coarse, below, .. } = self;
        NoiseCost { bands, paths, base, place: *place, half, is_coarse: *is_coarse, below: *below }
    }

    /// Levels of the channels, K.
    fn noise_std_k(&self, x: &[f64]) -> [f64; 2] {
        [0, 1].map(|i| self.paths.base[i].sqrt() * x[i])
    }

    fn extra(&self, x: &[f64]) -> Option<Extra> {
        self.place.map(|place| Extra { place, std_k: x[2], correlation_s: x[3] })
    }

    /// The best levels, and the best extra noise, of a half.
    fn solve(&self, half: Half) -> Vec<f64> {
        let cost = self.cost(half);
        let mut variables = ["level 1", "level 2"]
            .map(|name| Variable::logarithmic(name, 1.0 / MAX_LEVEL_FACTOR, MAX_LEVEL_FACTOR))
            .to_vec();
        if self.place.is_some() {
            let swing = self.observations.swing_k();
            variables.push(Variable::logarithmic("noise std", 1e-6 * swing, 10.0 * swing));
            variables.push(Variable::logarithmic(
                "correlation time",
                MIN_CORRELATION_STEPS * self.observations.step_s(),
                MAX_CORRELATION_SPANS * self.observations.span_s(),
            ));
        }
        let problem = Problem::new(&cost, variables).expect("bounds are in order");
        let simplex = Optimiser::NelderMead { spread_tolerance: 1e-7, edge: 0.5 };
        let fits = self.starts.iter().map(|start| {
            let fit = simplex.minimise(&problem, start, &Budget { iterations: 300, evaluations: 600 });
            fit.expect("the start is finite")
        });
        fits.min_by(|a, b| a.value.total_cmp(&b.value)).expect("at least one start").x
    }
}

/// Levels of white noise, K, where what is left over is clearly less than third differences say: most of these is the gas.
///
/// Each channel's noise has a spectrum of its own in the disagreement: that of T1 is filtered by the model of T2, and that of T2 by
/// the model of T1. So the spectrum of the residual determines both levels, while third differences hold more of the gas in the
/// reading of the faster sensor than in the other.
pub(crate) fn levels_below(
    plant: &Plant,
    observations: &Observations,
    bands: &Bands,
    is_coarse: [bool; 2],
) -> [f64; 2] {
    let search = NoiseSearch { below: LEVELS_OF_GAS, ..NoiseSearch::of(plant, observations, bands, is_coarse) };
    search.noise_std_k(&search.solve(Half::Both))
}

/// `−2 ln L` of white noise with the best levels for the residual of `plant`.
///
/// - `is_coarse`: channels whose levels third differences do not determine
pub fn white_deviance(plant: &Plant, observations: &Observations, bands: &Bands, is_coarse: [bool; 2]) -> f64 {
    let search = NoiseSearch::of(plant, observations, bands, is_coarse);
    search.cost(Half::Both).likelihood(&search.solve(Half::Both), Half::Both)
}

/// Fits the levels of white noise, and extra noise at `place` from each of `starts`, to the residual of `plant`.
///
/// - `is_coarse`: channels whose levels third differences do not determine
///
/// # Panics
/// If extra noise is asked for without a start.
pub fn fit_noise(
    plant: &Plant,
    observations: &Observations,
    bands: &Bands,
    place: Option<Place>,
    starts: &[[f64; 2]],
    is_coarse: [bool; 2],
) -> NoiseFit {
    let mut search = NoiseSearch { place, ..NoiseSearch::of(plant, observations, bands, is_coarse) };
    if place.is_some() {
        search.starts = starts.iter().map(|s| vec![1.0, 1.0, s[0], s[1]]).collect();
    }
    let [x, even, odd] = [Half::Both, Half::Even, Half::Odd].map(|half| search.solve(half));
    let cost = search.cost(Half::Both);
    NoiseFit {
        noise_std_k: search.noise_std_k(&x),
        extra: search.extra(&x),
        likelihood: cost.likelihood(&x, Half::Both),
        held_out: cost.likelihood(&even, Half::Odd) + cost.likelihood(&odd, Half::Even),
    }
}

/// Fits the levels of white noise, and the extra noise of `plant` that enters at `place`, to the residual whitened with all its noise:
/// nearly white, so that hardly any power leaks from low frequencies into the bands of high ones. `None` of a plant without such noise.
///
/// - `levels_k`: levels of the channels as third differences have them
/// - `is_coarse`: channels whose levels these do not determine
pub fn fit_noise_again(
    plant: &Plant,
    place: Place,
    levels_k: [f64; 2],
    observations: &Observations,
    bands: &Bands,
    is_coarse: [bool; 2],
) -> Option<([f64; 2], Extra)> {
    let (mut search, extra) = NoiseSearch::of_extra(plant, place, observations, bands, is_coarse)?;
    search.paths.base = levels_k.map(|k| k * k);
    let factor = |i: usize| (plant.noise_std_k[i] / levels_k[i]).clamp(1.0 / MAX_LEVEL_FACTOR, MAX_LEVEL_FACTOR);
    search.starts = vec![vec![factor(0), factor(1), extra.std_k, extra.correlation_s]];
    let x = search.solve(Half::Both);
    Some((search.noise_std_k(&x), search.extra(&x)?))
}

/// Variances of the logarithms of the size and of the correlation time of the extra noise of `plant` that enters at `place`, the levels
/// of white noise unknown beside them: the inverse of Whittle's information `½ Σ ν ∂ ln S ∂ ln S`, over bands of `ν` degrees of
/// freedom and with the power `S`. `None` of a plant without such noise, or where the residual does not determine it.
///
/// - `bands`: those of the residual that it was fitted to
pub fn noise_log_variances(
    plant: &Plant,
    place: Place,
    observations: &Observations,
    bands: &Bands,
    is_coarse: [bool; 2],
) -> Option<[f64; 2]> {
    let (search, extra) = NoiseSearch::of_extra(plant, place, observations, bands, is_coarse)?;
    let cost = search.cost(Half::Both);
    let log_power = |omega: f64, changed: usize, by: f64| {
        let mut x = [1.0, 1.0, extra.std_k, extra.correlation_s];
        x[changed] *= by.exp();
        let (variance, extra) = cost.parts(&x);
        search.paths.total(variance, &extra, omega).ln()
    };
    let mut information = vec![vec![0.0; 4]; 4];
    for band in &bands.0 {
        let slope = [0, 1, 2, 3]
            .map(|i| (log_power(band.omega, i, LOG_STEP) - log_power(band.omega, i, -LOG_STEP)) / (2.0 * LOG_STEP));
        for (row, a) in information.iter_mut().zip(slope) {
            row.iter_mut().zip(slope).for_each(|(sum, b)| *sum += 0.5 * band.dof() * a * b);
        }
    }
    // What third differences say of the levels.
    (0..2).for_each(|i| information[i][i] += LEVELS_LOOSE.powi(-2));
    let covariance = dense::inverse(&information)?;
    let variances = [covariance[2][2], covariance[3][3]];
    variances.iter().all(|variance| *variance > 0.0).then_some(variances)
}

/// Runs of samples, each with its residual and whether this says anything.
fn runs_of(residuals: impl Iterator<Item = (usize, (f64, bool))>, holds: impl Fn(usize) -> bool) -> Vec<Vec<f64>> {
    let mut out: Vec<Vec<f64>> = Vec::new();
    let mut last = None;
    for (sample, (residual, is_informed)) in residuals.filter(|(sample, _)| holds(*sample)) {
        let is_next = last.is_some_and(|l| sample == l + 1);
        last = Some(sample);
        if !is_next || out.is_empty() {
            out.push(Vec::new());
        }
        // A masked reading takes one residual away; those around it are white all the same.
        if let Some(run) = out.last_mut().filter(|_| is_informed) {
            run.push(residual);
        }
    }
    out
}

impl Model {
    /// Unbroken runs of the residuals that count and say anything.
    pub fn residual_runs(
        &self,
        theta: &[f64],
        observations: &Observations,
        holds: impl Fn(usize) -> bool,
    ) -> Vec<Vec<f64>> {
        let plant = self.plant(theta, observations);
        let mut evaluator = Evaluator::new(observations, plant.noise_std_k);
        let is_even = observations.period_s.is_some();
        let is_all = observations.stretches.iter().all(|stretch| is_all_informed(stretch, is_even));
        let mut scales = Vec::new();
        if is_all {
            evaluator.evaluate(&plant);
        } else {
            evaluator.evaluate_with(&plant, |scale| scales.push(scale));
        }
        let mut first = 0;
        let of_piece = evaluator.pieces.iter().flat_map(|piece| {
            let all = first..first + piece.count;
            first = all.end;
            let informed = if is_all {
                vec![true; piece.count]
            } else {
                is_informed(scales[all.clone()].to_vec(), &observations.stretches[piece.stretch])
            };
            (piece.first_sample..).zip(evaluator.residual[all].iter().copied().zip(informed))
        });
        runs_of(of_piece, holds)
    }
}
