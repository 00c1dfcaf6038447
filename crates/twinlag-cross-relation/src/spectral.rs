//! The whitened cost by discrete sine transform: a few additions per sample and evaluation.
//!
//! For one-step inverses and even sampling the covariance of `u` is tridiagonal Toeplitz, and the sine transform of type I
//! diagonalises such a matrix *exactly*. So the four shifted channels are transformed once, `D = DST-I/√(2(n+1))` of
//! `y1[1..]`, `y1[..n]`, `y2[1..]`, `y2[..n]` (and of ones, for the offset), and each evaluation is a sum over bins:
//! `U_j = Σ p_i(θ) D_i,j`, `λ_j = α(θ) + β(θ) cos w_j`, `w_j = π j/(n+1)`, cost `Σ U_j²/λ_j`. A circular transform is not a
//! substitute: its end effects swamp the small eigenvalues.

use num_dual::DualSVec64;
use rustdct::DctPlanner;
use twinlag_sensor::Discretisation;

use crate::inverse::row;
use crate::parameters::{Pair, parts};
use crate::readings::{Segment, Steps};

/// Transforms that the sum of one bin takes: the two channels, each shifted and not, and ones.
const TERMS: usize = 5;

/// One evenly sampled segment, transformed.
#[derive(Clone, Debug)]
pub(crate) struct Transformed {
    period_s: f64,
    /// `cos w_j`.
    cosines: Vec<f64>,
    /// `[y1[1..], y1[..n], y2[1..], y2[..n], 1]`, transformed.
    terms: [Vec<f64>; TERMS],
}

/// Sums of squares and products over the bins: value, gradient and Gauss-Newton matrix of `Σ r²/2`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sums<const P: usize> {
    pub(crate) squares: f64,
    pub(crate) gradient: [f64; P],
    pub(crate) normal: [[f64; P]; P],
}

impl<const P: usize> Sums<P> {
    pub(crate) const ZERO: Self = Self { squares: 0.0, gradient: [0.0; P], normal: [[0.0; P]; P] };

    /// Adds one residual with its derivatives.
    #[inline]
    pub(crate) fn add(&mut self, r: f64, dr: &[f64; P]) {
        self.squares += r * r;
        for i in 0..P {
            self.gradient[i] += r * dr[i];
            for j in i..P {
                self.normal[i][j] += dr[i] * dr[j];
            }
        }
    }
}

impl Transformed {
    /// `None` if the segment is unevenly sampled.
    pub(crate) fn new(segment: &Segment) -> Option<Self> {
        let Steps::Even(period_s) = *segment.steps() else { return None };
        let n = segment.len() - 1;
        let plan = DctPlanner::new().plan_dst1(n);
        let scale = (2.0 / (n + 1) as f64).sqrt();
        let transform = |x: &[f64]| {
            let mut out = x.to_vec();
            plan.process_dst1(&mut out);
            out.iter_mut().for_each(|v| *v *= scale);
            out
        };
        let (y1, y2) = (segment.y1(), segment.y2());
        Some(Self {
            period_s,
            cosines: (1..=n).map(|j| (std::f64::consts::PI * j as f64 / (n + 1) as f64).cos()).collect(),
            terms: [&y1[1..], &y1[..n], &y2[1..], &y2[..n], &vec![1.0; n]].map(transform),
        })
    }

    /// Bins of this segment.
    pub(crate) fn len(&self) -> usize {
        self.cosines.len()
    }

    /// The whitened residual of every bin, `U_j/√λ_j`, from slow to fast.
    pub(crate) fn residuals<const P: usize>(
        &self,
        hold: Discretisation,
        noise_std: [f64; 2],
        pair: &Pair<DualSVec64<P>>,
    ) -> Vec<f64> {
        let weights = Weights::new(hold, noise_std, pair, self.period_s);
        (0..self.len())
            .map(|j| {
                let u: f64 = (0..TERMS).map(|i| weights.terms[i].0 * self.terms[i][j]).sum();
                u / (weights.alpha.0 + weights.beta.0 * self.cosines[j]).sqrt()
            })
            .collect()
    }

    /// Adds this segment's bins to `sums`.
    pub(crate) fn accumulate<const P: usize>(
        &self,
        hold: Discretisation,
        noise_std: [f64; 2],
        pair: &Pair<DualSVec64<P>>,
        sums: &mut Sums<P>,
    ) {
        let weights = Weights::new(hold, noise_std, pair, self.period_s);
        // Without gain and offset the transform of ones has no weight.
        match P {
            2 => self.accumulate_terms::<P, 4>(&weights, sums),
            _ => self.accumulate_terms::<P, TERMS>(&weights, sums),
        }
    }

    fn accumulate_terms<const P: usize, const T: usize>(&self, weights: &Weights<P>, sums: &mut Sums<P>) {
        let n = self.len();
        let terms: [&[f64]; T] = std::array::from_fn(|i| &self.terms[i][..n]);
        let cosines = &self.cosines[..n];
        for j in 0..n {
            let cosine = cosines[j];
            let inverse = 1.0 / (weights.alpha.0 + weights.beta.0 * cosine);
            let mut u = 0.0;
            let mut du = [0.0; P];
            for i in 0..T {
                let d = terms[i][j];
                u += weights.terms[i].0 * d;
                for p in 0..P {
                    du[p] += weights.terms[i].1[p] * d;
                }
            }
            // r = U/√λ, ∂r = (∂U − ½ r² ∂λ/r …)/√λ, written without the square root.
            let s = u * inverse;
            for p in 0..P {
                du[p] -= 0.5 * s * (weights.alpha.1[p] + weights.beta.1[p] * cosine);
            }
            sums.squares += u * s;
            for p in 0..P {
                sums.gradient[p] += s * du[p];
                for q in p..P {
                    sums.normal[p][q] += du[p] * du[q] * inverse;
                }
            }
        }
    }
}

/// Weights of the transforms and of the eigenvalues, each with its gradient.
struct Weights<const P: usize> {
    terms: [(f64, [f64; P]); TERMS],
    alpha: (f64, [f64; P]),
    beta: (f64, [f64; P]),
}

impl<const P: usize> Weights<P> {
    fn new(hold: Discretisation, noise_std: [f64; 2], pair: &Pair<DualSVec64<P>>, period_s: f64) -> Self {
        let row = row(hold, pair, period_s);
        let variance = noise_std.map(|s| s * s);
        let zero = DualSVec64::<P>::from_re(0.0);
        let (mut alpha, mut beta) = (zero, zero);
        for (c, v) in [(&row.c1, variance[0]), (&row.c2, variance[1])] {
            alpha += (c[0] * c[0] + c[1] * c[1]) * v;
            beta += c[0] * c[1] * (2.0 * v);
        }
        let ones = (row.c2[0] + row.c2[1]) * pair.offset;
        Self {
            terms: [row.c1[1], row.c1[0], -row.c2[1], -row.c2[0], ones].map(parts),
            alpha: parts(alpha),
            beta: parts(beta),
        }
    }
}
