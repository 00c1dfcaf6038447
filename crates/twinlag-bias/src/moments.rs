//! Noise levels from the disagreement of the two inferred gas temperatures, whatever the gas does.
//!
//! `f1 = x + n1`, `f2 = x + n2` with independent noises of known *shape*: so `f1 (f1 − f2)` has
//! expectation `|n1|²` at each frequency and `f2 (f2 − f1)` has `|n2|²`, the gas having dropped
//! out, exactly and without any assumption about it. In bands these are two sets of moments, linear
//! in the two variances; weighted least squares with the moments' own covariance (for a gas that is
//! Gaussian in the band) finds both, and their standard errors. Where the gas has power a moment
//! scatters widely and has little weight; the bands that it leaves alone decide, wherever they are.
//!
//! Unlike third differences ([`crate::estimate_noise`]), this method does not mistake a signal that
//! moves from sample to sample for noise. It needs the time constants, whose estimate needs the
//! levels, so iterate.
//!
//! # Source
//! Own derivation; docs, chapter "Theory", section 5.

use nalgebra::{Matrix2, Vector2};
use twinlag_cross_relation::InferredInputs;
use twinlag_transform::{Complex64, Tapered, hann_between};

/// Width of a band: this factor in frequency, and at least [`MIN_BAND_BINS`] bins.
const BAND_FREQUENCY_RATIO: f64 = 1.25;
const MIN_BAND_BINS: usize = 12;
/// Longer stretches are taken in pieces. The bands are some tenths of their frequency wide, which pieces resolve but for the
/// slowest, where the gas is and moments have no weight; there are as many bins in all.
const MAX_WHOLE_SAMPLES: usize = 1 << 19;
/// Samples of a piece. Chosen: its transform stays in fast memory.
const PIECE_SAMPLES: usize = 1 << 16;
/// Samples of a stretch that is used, at least: its 31 bins make two bands.
const MIN_STRETCH_SAMPLES: usize = 64;
/// Neighbouring bins of a Hann window share power: a mean over them has the variance of this many
/// times fewer bins, `1 + 2 (2/3)² + 2 (1/6)²`.
const BINS_PER_INDEPENDENT_BIN: f64 = 1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0);
/// A level is taken to be no less than this share of the other: below it hardly matters, and
/// weights stay finite.
const MIN_LEVEL_RATIO: f64 = 0.1;
/// Steps towards weights that agree with the levels they give.
const REWEIGHTINGS: usize = 6;

/// Moments of the inferred inputs per band.
#[derive(Clone, Debug)]
pub struct NoiseMoments {
    bands: Vec<Band>,
}

#[derive(Clone, Debug)]
struct Band {
    /// Means of `Re f1 (f1 − f2)*`, `Re f2 (f2 − f1)*`.
    moments: Vector2<f64>,
    /// What the gas has here: mean of `Re f1 f2*`, if positive.
    gas: f64,
    /// Independent bins.
    weight: f64,
    /// For each bin, `cos w`, both filters' power gain, and the number of pieces that share it.
    bins: Vec<(f64, [f64; 2], f64)>,
}

/// Products in one bin, summed over the pieces that share it.
struct Bin {
    /// Cycles per sample.
    frequency: f64,
    moments: Vector2<f64>,
    gas: f64,
    /// Pieces.
    count: f64,
}

impl Bin {
    fn add(&mut self, moments: Vector2<f64>, gas: f64) {
        self.moments += moments;
        self.gas += gas;
        self.count += 1.0;
    }
}

/// What [`NoiseMoments::levels`] finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLevels {
    /// Standard deviations of both channels' noise, K.
    pub std_k: [f64; 2],
    /// Covariance of the two *variances*, K⁴.
    pub covariance_k4: [[f64; 2]; 2],
    /// The channel whose level was held at a tenth of the other's because the moments gave a lower
    /// or negative value. The true level is at most that, within its standard error.
    pub is_held: [bool; 2],
    /// Weighted sum of squares that the levels leave of the moments: about twice the number of
    /// bands, less the parameters, if noise has the assumed shape and both sensors their models.
    pub misfit: f64,
}

impl JointLevels {
    /// Standard errors of the standard deviations, K.
    pub fn standard_error_k(&self) -> [f64; 2] {
        [0, 1].map(|i| 0.5 * self.covariance_k4[i][i].sqrt() / self.std_k[i])
    }
}

impl NoiseMoments {
    /// Moments of `inputs`; `None` if no stretch has 64 samples.
    pub fn new(inputs: &InferredInputs) -> Option<Self> {
        let mut bins: Vec<Bin> = Vec::new();
        let mut tapers: Vec<Tapered> = Vec::new();
        let pieces = inputs.segments.iter().flat_map(|[f1, f2]| {
            // Of shorter stretches the whole is one piece.
            let length = if f1.len() > MAX_WHOLE_SAMPLES { PIECE_SAMPLES } else { f1.len().max(1) };
            f1.chunks(length).zip(f2.chunks(length))
        });
        for (f1, f2) in pieces.filter(|(f1, _)| f1.len() >= MIN_STRETCH_SAMPLES) {
            let n = f1.len();
            let mean = 0.5 * (f1.iter().sum::<f64>() + f2.iter().sum::<f64>()) / n as f64;
            // Pieces of one stretch share their bins.
            let is_next = n == PIECE_SAMPLES && tapers.last().is_some_and(|last| last.taper().len() == n);
            if !is_next {
                tapers = vec![Tapered::new(hann_between(n))];
            }
            let first_bin = if is_next { bins.len() - (n.div_ceil(2) - 1) } else { bins.len() };
            let tapered = &tapers[0];
            let energy = tapered.energy();
            let first = tapered.transform(f1.iter().map(|f| f - mean));
            let difference = tapered.transform(f1.iter().zip(f2).map(|(f1, f2)| f1 - f2));
            // Neither the mean nor the bin at half the sampling rate has an independent imaginary
            // part.
            for k in 1..n.div_ceil(2) {
                let (p, u) = (first[k], difference[k]);
                let q = p - u;
                let moments = Vector2::new((p * u.conj()).re, -(q * u.conj()).re) / energy;
                let gas = (p * q.conj()).re / energy;
                match bins.get_mut(first_bin + k - 1) {
                    Some(bin) => bin.add(moments, gas),
                    None => bins.push(Bin { frequency: k as f64 / n as f64, moments, gas, count: 1.0 }),
                }
            }
        }
        if bins.is_empty() {
            return None;
        }
        bins.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        let mut bands = Vec::new();
        let mut from = 0;
        while from < bins.len() {
            let edge = bins[from].frequency * BAND_FREQUENCY_RATIO;
            let mut to = bins.partition_point(|b| b.frequency <= edge).max(from + MIN_BAND_BINS).min(bins.len());
            if bins.len() - to < MIN_BAND_BINS {
                to = bins.len();
            }
            bands.push(Band::of(&bins[from..to], &inputs.filters));
            from = to;
        }
        Some(Self { bands })
    }

    /// Levels for noise that is white, or autoregressive of first order with coefficients `ar1` (0
    /// is white).
    ///
    /// - `start_std_k`: levels to begin the weights with; the fixed point does not depend on them
    ///
    /// `None` where the moments have no solution with a positive variance.
    pub fn levels(&self, start_std_k: [f64; 2], ar1: [f64; 2]) -> Option<JointLevels> {
        let shapes = self.shapes(ar1);
        let mut std_k = start_std_k;
        let mut out = None;
        for _ in 0..REWEIGHTINGS {
            let found = self.step(&shapes, &self.weights(&shapes, std_k)?)?;
            std_k = found.std_k;
            out = Some(found);
        }
        out
    }

    /// Levels for coefficients `ar1` with the weights that noise of `std_k` and `weighing_ar1`
    /// gives. Its misfit, minimised over `ar1`, determines the colour of the noise. (Weights that
    /// followed `ar1` would favour whatever makes them small.)
    pub fn levels_weighed(&self, std_k: [f64; 2], weighing_ar1: [f64; 2], ar1: [f64; 2]) -> Option<JointLevels> {
        self.step(&self.shapes(ar1), &self.weights(&self.shapes(weighing_ar1), std_k)?)
    }

    fn shapes(&self, ar1: [f64; 2]) -> Vec<Vector2<f64>> {
        self.bands.iter().map(|b| b.shape(ar1)).collect()
    }

    fn weights(&self, shapes: &[Vector2<f64>], std_k: [f64; 2]) -> Option<Vec<Matrix2<f64>>> {
        let variance = Vector2::from(std_k.map(|s| s * s));
        self.bands.iter().zip(shapes).map(|(b, s)| b.information(&s.component_mul(&variance))).collect()
    }

    /// The weighted least-squares solution.
    fn step(&self, shapes: &[Vector2<f64>], weights: &[Matrix2<f64>]) -> Option<JointLevels> {
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for ((band, shape), weight) in self.bands.iter().zip(shapes).zip(weights) {
            let design = Matrix2::from_diagonal(shape);
            normal += design * weight * design;
            right += design * weight * band.moments;
        }
        let covariance = normal.try_inverse()?;
        let mut found = covariance * right;
        let mut is_held = [false; 2];
        for i in 0..2 {
            let other = 1 - i;
            if found[i] < MIN_LEVEL_RATIO * MIN_LEVEL_RATIO * found[other] {
                // The other one alone explains the moments.
                found[other] = right[other] / normal[(other, other)];
                found[i] = MIN_LEVEL_RATIO * MIN_LEVEL_RATIO * found[other];
                is_held[i] = true;
                break;
            }
        }
        if !(found.min() > 0.0 && found.max().is_finite()) {
            return None;
        }
        let misfit = self.bands.iter().zip(shapes).zip(weights).map(|((band, shape), weight)| {
            let left = band.moments - shape.component_mul(&found);
            left.dot(&(weight * left))
        });
        Some(JointLevels {
            std_k: [found[0].sqrt(), found[1].sqrt()],
            covariance_k4: [[covariance[(0, 0)], covariance[(0, 1)]], [covariance[(1, 0)], covariance[(1, 1)]]],
            is_held,
            misfit: misfit.sum(),
        })
    }
}

impl Band {
    fn of(bins: &[Bin], filters: &[Vec<f64>; 2]) -> Self {
        let count = bins.iter().map(|b| b.count).sum::<f64>();
        let gain = |filter: &[f64], turn: Complex64| {
            filter.iter().rev().fold(Complex64::new(0.0, 0.0), |sum, c| sum * turn + c).norm_sqr()
        };
        Self {
            moments: bins.iter().map(|b| b.moments).sum::<Vector2<f64>>() / count,
            gas: (bins.iter().map(|b| b.gas).sum::<f64>() / count).max(0.0),
            weight: count / BINS_PER_INDEPENDENT_BIN,
            bins: bins
                .iter()
                .map(|b| {
                    let turn = Complex64::from_polar(1.0, std::f64::consts::TAU * b.frequency);
                    (turn.re, [gain(&filters[0], turn), gain(&filters[1], turn)], b.count)
                })
                .collect(),
        }
    }

    /// Noise of unit variance in each inferred input, mean over the band.
    fn shape(&self, ar1: [f64; 2]) -> Vector2<f64> {
        let colour = |phi: f64, cosine: f64| (1.0 - phi * phi) / (1.0 + phi * phi - 2.0 * phi * cosine);
        let mean = |i: usize| -> f64 {
            self.bins.iter().map(|(cosine, gain, count)| count * gain[i] * colour(ar1[i], *cosine)).sum::<f64>()
                / self.bins.iter().map(|bin| bin.2).sum::<f64>()
        };
        Vector2::new(mean(0), mean(1))
    }

    /// Inverse covariance of the two moments where the noises have powers `noise`, all Gaussian.
    ///
    /// With `p = x + n1`, `u = n1 − n2`: `Var Re(p u*) = ½ (⟨|p|²⟩⟨|u|²⟩ + ⟨n1²⟩²)`, likewise for
    /// the other, and covariance `−½ (⟨x²⟩⟨|u|²⟩ − ⟨n1²⟩⟨n2²⟩)`, over the number of bins.
    fn information(&self, noise: &Vector2<f64>) -> Option<Matrix2<f64>> {
        let (n1, n2, gas) = (noise[0], noise[1], self.gas);
        let both = n1 + n2;
        let shared = -(gas * both - n1 * n2);
        let covariance = Matrix2::new((gas + n1) * both + n1 * n1, shared, shared, (gas + n2) * both + n2 * n2);
        (covariance * (0.5 / self.weight)).try_inverse()
    }
}
