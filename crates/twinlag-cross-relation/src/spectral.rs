//! The whitened cost by discrete sine transform: a few additions per sample and evaluation.
//!
//! For one-step inverses and even sampling the covariance of `u` is tridiagonal Toeplitz, and the
//! sine transform of type I diagonalises such a matrix *exactly*. So the channels are transformed
//! once, and each evaluation is a sum over bins: `U_j = Σ_i v_i(θ) D_i,j`,
//! `λ_j = α(θ) + β(θ) cos w_j`, cost `Σ U_j²/λ_j`. With `T_i`, `S_i` the transforms of channel `i`
//! without its last and without its first sample, `D` is `T1 − T2`, `S1 − T1`, `S2 − T2`, and with
//! a gain or an offset also `T2` and the transform of ones. A circular transform is not a
//! substitute: its end effects swamp the small eigenvalues.

use num_dual::{DualNum, DualSVec64};

use crate::inverse::row;
use crate::noise_model::HoldAndNoise;
use crate::parameters::{Pair, parts};
use crate::transform::Transformed;

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

/// A number and its gradient.
pub(crate) type Sloped<const P: usize> = (f64, [f64; P]);

/// Weights of the transforms and of the eigenvalues, each with its gradient.
pub(crate) struct Weights<const P: usize> {
    pub(crate) parts: [Sloped<P>; 5],
    pub(crate) alpha: Sloped<P>,
    pub(crate) beta: Sloped<P>,
}

impl<const P: usize> Weights<P> {
    /// The pair must be of one step.
    pub(crate) fn new(model: &HoldAndNoise, pair: &Pair<DualSVec64<P>>, period_s: f64) -> Self {
        let row = row(model, pair, period_s);
        let [c1, c2] = [0, 1].map(|i| row.data[i].as_slice());
        let variance = model.white_variance();
        let zero = DualSVec64::<P>::from_re(0.0);
        let (mut alpha, mut beta) = (zero, zero);
        for (c, v) in [(c1, variance[0]), (c2, variance[1])] {
            alpha += (c[0] * c[0] + c[1] * c[1]) * v;
            beta += c[0] * c[1] * (2.0 * v);
        }
        // c1 · (T1, S1) − c2 · (T2, S2) + Σ c2 · o, in differences: channel 1 has unit gain at
        // rest, channel 2 its share.
        let share = pair.gain.recip();
        let parts_of_u = [zero + 1.0, c1[1], -c2[1], -share + 1.0, share * pair.offset];
        Self { parts: parts_of_u.map(parts), alpha: parts(alpha), beta: parts(beta) }
    }
}

/// The whitened residual of every bin, `U_j/√λ_j`, from slow to fast.
pub(crate) fn residuals<const P: usize>(
    segment: &Transformed,
    model: &HoldAndNoise,
    pair: &Pair<DualSVec64<P>>,
) -> Vec<f64> {
    let weights = Weights::new(model, pair, segment.period_s);
    let series = segment.parts();
    let cosines = &segment.plan.cosines;
    (0..segment.len())
        .map(|j| {
            let u: f64 = weights.parts.iter().zip(&series).map(|(w, d)| w.0 * d[j]).sum();
            u / (weights.alpha.0 + weights.beta.0 * cosines[j]).sqrt()
        })
        .collect()
}

/// Adds the bins of `segment` to `sums`.
pub(crate) fn accumulate<const P: usize>(
    segment: &Transformed,
    model: &HoldAndNoise,
    pair: &Pair<DualSVec64<P>>,
    sums: &mut Sums<P>,
) {
    let weights = Weights::new(model, pair, segment.period_s);
    match P {
        2 => accumulate_parts::<P, 3>(segment, &weights, sums),
        _ => accumulate_parts::<P, 5>(segment, &weights, sums),
    }
}

fn accumulate_parts<const P: usize, const T: usize>(segment: &Transformed, weights: &Weights<P>, sums: &mut Sums<P>) {
    let n = segment.len();
    let all = segment.parts();
    let series: [&[f64]; T] = std::array::from_fn(|i| &all[i][..n]);
    let cosines = &segment.plan.cosines[..n];
    for j in 0..n {
        let cosine = cosines[j];
        let inverse = 1.0 / (weights.alpha.0 + weights.beta.0 * cosine);
        let mut u = 0.0;
        let mut du = [0.0; P];
        for i in 0..T {
            let d = series[i][j];
            u += weights.parts[i].0 * d;
            for p in 0..P {
                du[p] += weights.parts[i].1[p] * d;
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
