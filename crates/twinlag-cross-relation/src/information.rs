//! How well the record determines the parameters: the covariance of the whitened estimate.
//!
//! `Cov = A⁻¹ M A⁻¹`. `A` is half the Hessian of the sum of squares: what the *signal* says about
//! the parameters. `M` is the variance of half the gradient at the truth, and there are two ways to
//! it:
//!
//! - If the residual is white, `M = A + E`, where `E` is what noise multiplied by noise adds:
//!   `E_ij = Σ_w s1² s2² Re(D_i D_j*)/λ²`, `D_i = ∂_i P Q − ∂_i Q P`, with `P`, `Q` the filters on
//!   the two channels in `u` and `λ = s1² |P|² + s2² |Q|²`. Negligible at low noise; without it
//!   intervals are too short at high noise.
//! - If it is not, because the model lacks something, `M = Σ_w S_w d_w d_w'` with `S` the smoothed
//!   spectrum of the residual itself and `d` the transform of its derivatives: the noise that there
//!   is, not the noise that was assumed.
//!
//! Derivation: docs, chapter "Theory", section 6.

use nalgebra::{Complex, DMatrix, DVector};
use twinlag_transform::sine_transform;

use crate::bands::points_of_long;
use crate::inverse::row;
use crate::parameters::{CostValue, Pair, parts};
use crate::sandwich::{inverse, sandwich};
use crate::transform::Plan;
use crate::whitened::{MAX_KEPT_BINS, Whitened};

/// How the variance of the gradient is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScoreVariance {
    /// From white noise of the stated levels, including the noise-noise term.
    WhiteNoise,
    /// The residual's own smoothed spectrum, for records in which model error is not small against
    /// noise.
    ResidualSpectrum,
}

impl Whitened<'_> {
    /// Half the Hessian of the sum of squares at `theta`, `[P][P]`.
    ///
    /// Central differences of the exact gradient, over a tenth of a standard error each way. Unlike
    /// the Gauss-Newton matrix it does not count noise as signal. Not positive definite where
    /// `theta` is no minimum.
    pub fn observed_information<const P: usize>(&self, theta: &[f64; P]) -> [[f64; P]; P] {
        self.observed_information_at(theta, &self.evaluate(theta))
    }

    /// - `here`: the cost at `theta`
    fn observed_information_at<const P: usize>(&self, theta: &[f64; P], here: &CostValue<P>) -> [[f64; P]; P] {
        let normal = &here.hessian;
        let mut half = [[0.0; P]; P];
        for i in 0..P {
            // Gain and offset are linear; a time constant must stay positive, and a second lag that
            // there is none of has no slope.
            let scale = if matches!(i, 2 | 3) { f64::INFINITY } else { 0.05 * theta[i] };
            let step = (0.1 / (0.5 * normal[i][i]).sqrt()).min(scale);
            if !(step.is_finite() && step > 0.0) {
                continue;
            }
            let slope = |sign: f64| {
                let mut moved = *theta;
                moved[i] += sign * step;
                self.evaluate(&moved).gradient
            };
            let (up, down) = (slope(1.0), slope(-1.0));
            half[i] = std::array::from_fn(|j| 0.25 * (up[j] - down[j]) / step);
        }
        std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (half[i][j] + half[j][i])))
    }

    /// Cramér-Rao bound: the covariance that no unbiased estimate goes below, `[P][P]`, zero for
    /// parameters not in `free`, for noise of the stated levels and a gas that is unknown and not
    /// random.
    /// Call this on the cost of readings *without* noise, at the `theta` that made them:
    /// `(Σ_w d_w d_w')⁻¹` with `d` the derivative of the whitened residual, which is the exact
    /// finite-record form of `d = (∂H2 H1 − ∂H1 H2) X/√(s1² |H2|² + s2² |H1|²)` summed over all
    /// frequencies. On noisy readings noise would count as signal. `None` where the record
    /// determines no such bound.
    ///
    /// ```
    #[doc = include_str!("example.txt")]
    /// let bound_s = |noise_std_k: f64| -> Result<f64, CostError> {
    ///     let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, [noise_std_k; 2])?;
    ///     Ok(cost.cramer_rao(&[0.0238, 0.1168], &[0, 1]).expect("determined")[0][0].sqrt())
    /// };
    /// // Noise twice as loud doubles what no unbiased method can do better than, to rounding.
    /// assert!((bound_s(0.2)? / bound_s(0.1)? - 2.0).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn cramer_rao<const P: usize>(&self, theta: &[f64; P], free: &[usize]) -> Option<[[f64; P]; P]> {
        inverse(&self.evaluate(theta).hessian.map(|row| row.map(|h| 0.5 * h)), free)
    }

    /// Covariance of the parameters at the minimum `theta`, `[P][P]`, zero for those not in `free`.
    ///
    /// - `free`: indices of the parameters that were fitted
    /// - `prior_std`: for each parameter, the standard deviation of independent prior knowledge,
    ///   infinite without any
    ///
    /// `None` if the information matrix of the free parameters is not positive definite: the record
    /// does not determine them.
    pub fn covariance<const P: usize>(
        &self,
        theta: &[f64; P],
        free: &[usize],
        prior_std: &[f64; P],
        middle: ScoreVariance,
    ) -> Option<[[f64; P]; P]> {
        self.covariance_by(&self.observed_information(theta), theta, free, prior_std, middle)
    }

    /// As [`Self::covariance`], by what [`Self::observed_information`] gives at `theta`.
    pub fn covariance_by<const P: usize>(
        &self,
        full: &[[f64; P]; P],
        theta: &[f64; P],
        free: &[usize],
        prior_std: &[f64; P],
        middle: ScoreVariance,
    ) -> Option<[[f64; P]; P]> {
        let score = match middle {
            ScoreVariance::WhiteNoise => {
                let noise = self.noise_noise(theta);
                std::array::from_fn(|i| std::array::from_fn(|j| full[i][j] + noise[i][j]))
            }
            ScoreVariance::ResidualSpectrum => self.score_variance(theta),
        };
        // Independent knowledge adds its own information, and as much variance to the gradient.
        let known = |m: &[[f64; P]; P]| -> [[f64; P]; P] {
            std::array::from_fn(|i| std::array::from_fn(|j| m[i][j] + if i == j { prior_std[i].powi(-2) } else { 0.0 }))
        };
        sandwich(&known(full), &known(&score), free)
    }

    /// Score test of parameters that were not fitted: whether letting the `tested` ones float would
    /// lower the cost by more than noise does, judged at the fit `theta` over the `fitted` ones.
    ///
    /// `S' W⁻¹ S` with `S` half the gradient by the tested parameters and `W = T (A + E) T'`,
    /// `T = [−A_tf A_ff⁻¹, 1]`, its variance once the fitted ones have adapted: chi-square
    /// distributed with as many degrees of freedom as parameters are tested. Evaluated where the
    /// model is taken to be right, it holds also where the record could not determine the tested
    /// parameters. `None` where the fitted ones are not determined.
    ///
    /// # Source
    /// Rao 1948, with the noise-noise term of this module.
    pub fn score_test<const P: usize>(&self, theta: &[f64; P], fitted: &[usize], tested: &[usize]) -> Option<f64> {
        let here = self.evaluate(theta);
        let (a, e) = (self.observed_information_at(theta, &here), self.noise_noise(theta));
        let gradient = here.gradient;
        let order: Vec<usize> = fitted.iter().chain(tested).copied().collect();
        let scale: Vec<f64> = order.iter().map(|&i| (a[i][i] + e[i][i]).sqrt()).collect();
        let block = |m: &dyn Fn(usize, usize) -> f64| {
            DMatrix::from_fn(order.len(), order.len(), |p, q| m(order[p], order[q]) / (scale[p] * scale[q]))
        };
        let (signal, all) = (block(&|i, j| a[i][j]), block(&|i, j| a[i][j] + e[i][j]));
        let (f, t) = (fitted.len(), tested.len());
        let inner = signal.view((0, 0), (f, f)).into_owned().cholesky()?;
        let follow = inner.solve(&signal.view((0, f), (f, t)).into_owned());
        let mut adapt = DMatrix::zeros(t, f + t);
        adapt.view_mut((0, 0), (t, f)).copy_from(&-follow.transpose());
        adapt.view_mut((0, f), (t, t)).fill_with_identity();
        let slope = DVector::from_fn(f + t, |p, _| 0.5 * gradient[order[p]] / scale[p]);
        let score = &adapt * slope;
        let variance = (&adapt * all * adapt.transpose()).cholesky()?;
        let statistic = score.dot(&variance.solve(&score));
        statistic.is_finite().then_some(statistic)
    }

    /// Share of noise multiplied by noise in the apparent information of the residual about
    /// parameter `index`, with the other `free` ones following it: `v'Ev / v'Gv` with the
    /// Gauss-Newton matrix `G`, along the direction `v` in which the cost's profile runs.
    ///
    /// It falls towards zero as the signal determines the parameter, and is of the order of one
    /// where the signal does not determine it. The cost then still has some shape, but no interval
    /// can be read from it. Zero where the residual does not depend on the parameter at all, as on
    /// the time constant of a sensor that is far faster than the sampling.
    pub fn noise_share<const P: usize>(&self, theta: &[f64; P], free: &[usize], index: usize) -> f64 {
        let (g, e) = (self.evaluate(theta).hessian, self.noise_noise(theta));
        let rest: Vec<usize> = free.iter().copied().filter(|&i| i != index).collect();
        let scale = |i: usize| g[i][i].sqrt();
        let inner =
            DMatrix::from_fn(rest.len(), rest.len(), |p, q| g[rest[p]][rest[q]] / (scale(rest[p]) * scale(rest[q])));
        let coupling = DVector::from_fn(rest.len(), |p, _| -g[rest[p]][index] / scale(rest[p]));
        let Some(follow) = inner.cholesky().map(|c| c.solve(&coupling)) else { return 1.0 };
        let mut v = [0.0; P];
        v[index] = 1.0;
        for (p, &i) in rest.iter().enumerate() {
            v[i] = follow[p] / scale(i);
        }
        let form =
            |m: &[[f64; P]; P]| -> f64 { (0..P).map(|i| (0..P).map(|j| v[i] * m[i][j] * v[j]).sum::<f64>()).sum() };
        let all = 0.5 * form(&g);
        if all > 0.0 { form(&e) / all } else { 0.0 }
    }

    /// Share of each channel's noise in the variance of the difference of the inferred inputs at
    /// `theta`, mean over frequency: how much the energy of the whitened residual falls, relative,
    /// when that channel's variance is taken to be larger.
    pub fn noise_shares<const P: usize>(&self, theta: &[f64; P]) -> [f64; 2] {
        let pair = Pair::<num_dual::DualSVec64<P>>::variables(theta);
        let row = row(self.model(), &pair, self.readings().mean_step_s());
        let variance = self.model().white_variance();
        let (mut first, mut all) = (0.0, 0.0);
        for (cosine, bins) in self.points() {
            let turn = Complex::new(cosine, (1.0 - cosine * cosine).max(0.0).sqrt());
            let power = |i: usize| {
                let taps = row.noise[i].as_slice().iter().rev();
                variance[i] * taps.fold(Complex::new(0.0, 0.0), |sum, c| sum * turn + c.re).norm_sqr()
            };
            let (p, q) = (power(0), power(1));
            first += bins * p / (p + q);
            all += bins;
        }
        [first / all, 1.0 - first / all]
    }

    /// The noise-noise term `E`; uneven steps are taken at their mean.
    fn noise_noise<const P: usize>(&self, theta: &[f64; P]) -> [[f64; P]; P] {
        let pair = Pair::<num_dual::DualSVec64<P>>::variables(theta);
        let row = row(self.model(), &pair, self.readings().mean_step_s());
        let [c1, c2]: [Vec<(f64, [f64; P])>; 2] = row.noise.map(|c| c.as_slice().iter().copied().map(parts).collect());
        let [v1, v2] = self.model().white_variance();
        let mut out = [[0.0; P]; P];
        for (cosine, bins) in self.points() {
            let turn = Complex::new(cosine, (1.0 - cosine * cosine).max(0.0).sqrt());
            let at = |c: &[(f64, [f64; P])]| {
                let mut power = Complex::new(1.0, 0.0);
                let mut value = Complex::new(0.0, 0.0);
                let mut slopes = [value; P];
                for (coefficient, by) in c {
                    value += power * coefficient;
                    for i in 0..P {
                        slopes[i] += power * by[i];
                    }
                    power *= turn;
                }
                (value, slopes)
            };
            let ((p, dp), (q, dq)) = (at(&c1), at(&c2));
            let lambda = v1 * p.norm_sqr() + v2 * q.norm_sqr();
            let d: [Complex<f64>; P] = std::array::from_fn(|i| dp[i] * q - dq[i] * p);
            let weight = bins * v1 * v2 / (lambda * lambda);
            for i in 0..P {
                for j in 0..P {
                    out[i][j] += weight * (d[i] * d[j].conj()).re;
                }
            }
        }
        out
    }

    /// Points `x = cos w` for the bins of all segments, and how many bins each stands for. Segments of one length have the same
    /// points, which are made once.
    fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        let of_length = |(samples, segments): (usize, usize)| {
            let of_one =
                if samples > MAX_KEPT_BINS { points_of_long(samples) } else { Plan::of(samples).bands().points() };
            of_one.into_iter().map(move |(cosine, bins)| (cosine, segments as f64 * bins))
        };
        self.readings().lengths().into_iter().flat_map(of_length)
    }

    /// `Σ_w S_w d_w d_w'` over the sine transform of the residual in time and of its derivatives.
    fn score_variance<const P: usize>(&self, theta: &[f64; P]) -> [[f64; P]; P] {
        let mut out = [[0.0; P]; P];
        for segment in self.jacobian(theta) {
            let n = segment.len();
            if n == 0 {
                continue;
            }
            let scale = (2.0 / (n + 1) as f64).sqrt();
            let transform = |x: Vec<f64>| {
                let mut bins = sine_transform(&x);
                bins.iter_mut().for_each(|v| *v *= scale);
                bins
            };
            let spectrum = smoothed(&transform(segment.iter().map(|s| s.0).collect()));
            let slopes: [Vec<f64>; P] = std::array::from_fn(|i| transform(segment.iter().map(|s| s.1[i]).collect()));
            for i in 0..P {
                for j in 0..P {
                    out[i][j] += (0..n).map(|k| spectrum[k] * slopes[i][k] * slopes[j][k]).sum::<f64>();
                }
            }
        }
        out
    }
}

/// Mean square of `bins` in windows that widen with frequency: from 0.7 to 1.4 times it, a few bins
/// at least.
fn smoothed(bins: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0];
    bins.iter().for_each(|b| sums.push(sums[sums.len() - 1] + b * b));
    (0..bins.len())
        .map(|k| {
            let low = (0.7 * k as f64 - 3.0).max(0.0) as usize;
            let high = ((1.4 * k as f64) as usize + 5).min(bins.len());
            (sums[high] - sums[low]) / (high - low) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readings::Readings;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use twinlag_sensor::{Discretisation, FirstOrder};

    const PERIOD_S: f64 = 0.002;
    const THETA: [f64; 4] = [0.0238, 0.1168, 1.1, 0.3];
    const NOISE_STD: [f64; 2] = [0.6, 0.9];

    fn record(swing_k: f64, noise: &mut impl FnMut() -> f64) -> Readings {
        let gas: Vec<f64> =
            (0..600).map(|k| swing_k * ((0.11 * f64::from(k)).sin() + 0.5 * (0.031 * f64::from(k)).cos())).collect();
        let lag = |tau| FirstOrder::new(tau, PERIOD_S).expect("valid sensor").respond(&gas);
        let y1: Vec<f64> = lag(THETA[0]).iter().map(|y| y + NOISE_STD[0] * noise()).collect();
        let y2: Vec<f64> = lag(THETA[1]).iter().map(|y| THETA[2] * y + THETA[3] + NOISE_STD[1] * noise()).collect();
        let segment = crate::Segment::new(y1, y2, crate::Steps::Even(PERIOD_S)).expect("valid channels");
        Readings::about(vec![segment], 0.0).expect("valid record")
    }

    fn cost(readings: &Readings) -> Whitened<'_> {
        Whitened::new(readings, Discretisation::ZeroOrderHold, NOISE_STD).expect("valid")
    }

    /// Half the gradient at the truth has variance `A + E`, with `A` of the record without noise.
    /// Over 2000 records a variance has a relative standard error of `√(2/1999) = 3.2 %`, more
    /// where the score has heavier tails than a Gaussian; five of these. Without a signal `A`
    /// vanishes, and the time constants and the gain see `E` alone.
    #[test]
    fn the_score_varies_as_the_signal_and_the_noise_noise_terms_say() {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        for swing_k in [0.0, 3.0] {
            let clean = record(swing_k, &mut || 0.0);
            let signal = cost(&clean).evaluate(&THETA).hessian;
            let noise = cost(&clean).noise_noise(&THETA);
            let mut squares = [0.0; 4];
            let trials = 2000;
            for _ in 0..trials {
                let readings = record(swing_k, &mut || StandardNormal.sample(&mut rng));
                let gradient = cost(&readings).evaluate(&THETA).gradient;
                for i in 0..4 {
                    squares[i] += 0.25 * gradient[i] * gradient[i] / f64::from(trials);
                }
            }
            for i in 0..4 {
                // At the truth of a clean record the residual is zero and the Gauss-Newton matrix
                // is the Hessian.
                let want = 0.5 * signal[i][i] + noise[i][i];
                let tol = 5.0 * 0.032 * want;
                assert!(
                    (squares[i] - want).abs() < tol,
                    "swing {swing_k} K, {i}: got {:e}, want {want:e} ± {tol:e}",
                    squares[i]
                );
            }
            // The term is no decoration: without a signal it is everything, with one a good part.
            assert!(noise[0][0] > 0.05 * 0.5 * signal[0][0]);
        }
    }

    /// A residual that is white has a flat spectrum of one, and both middles agree to the scatter
    /// of the smoothed spectrum: some 100 bins carry the signal's information, so about
    /// `√(2/100) = 14 %` in the variance; four of these.
    #[test]
    fn both_middles_agree_where_the_residual_is_white() {
        let mut rng = ChaCha8Rng::seed_from_u64(22);
        let readings = record(60.0, &mut || StandardNormal.sample(&mut rng));
        let cost = cost(&readings);
        let variance = |middle| {
            let free = [0, 1, 2, 3];
            cost.covariance(&THETA, &free, &[f64::INFINITY; 4], middle).expect("determined")
        };
        let (a, b) = (variance(ScoreVariance::WhiteNoise), variance(ScoreVariance::ResidualSpectrum));
        for i in 0..4 {
            assert!((b[i][i] / a[i][i] - 1.0).abs() < 0.56, "{i}: {} and {}", a[i][i], b[i][i]);
        }
    }

    /// Noise without a signal leaves a share of a third and more; with the signal the share falls
    /// as its square.
    #[test]
    fn the_noise_share_tells_signal_from_none() {
        let mut rng = ChaCha8Rng::seed_from_u64(24);
        let mut share =
            |swing_k| cost(&record(swing_k, &mut || StandardNormal.sample(&mut rng))).noise_share(&THETA, &[0, 1], 0);
        let [none, some, more] = [0.0, 30.0, 300.0].map(&mut share);
        assert!(none > 0.3, "without a signal: {none}");
        assert!(some < 0.02 && (some / more / 100.0 - 1.0).abs() < 0.2, "at 30 K: {some}, at 300 K: {more}");
    }

    /// 400 records with gain 1.1 and offset 0.3 K as stated: the statistic of both is chi-square
    /// with two degrees of freedom, mean 2 and standard deviation 2, so that the mean of 400 lies
    /// within 2 ± 0.4 (four standard errors). At a gain stated five per cent wrong it is larger by
    /// the square of that error in standard errors of the gain, as Wald's test has it, to leading
    /// order in the error: within a third.
    #[test]
    fn the_score_test_is_chi_square_at_the_truth_and_sees_a_gain_off_it() {
        let mut rng = ChaCha8Rng::seed_from_u64(25);
        let (mut mean, mut wald) = ([0.0; 2], 0.0);
        let off = 0.05 * THETA[2];
        for _ in 0..400 {
            let readings = record(60.0, &mut || StandardNormal.sample(&mut rng));
            let cost = cost(&readings);
            for (mean, gain) in mean.iter_mut().zip([THETA[2], THETA[2] + off]) {
                // Fit the time constants at the stated gain.
                let mut theta = [THETA[0], THETA[1], gain, THETA[3]];
                for _ in 0..20 {
                    let c = cost.evaluate(&theta);
                    let (h, g) = (c.hessian, c.gradient);
                    let det = h[0][0] * h[1][1] - h[0][1] * h[0][1];
                    theta[0] -= (h[1][1] * g[0] - h[0][1] * g[1]) / det;
                    theta[1] -= (h[0][0] * g[1] - h[0][1] * g[0]) / det;
                }
                *mean += cost.score_test(&theta, &[0, 1], &[2, 3]).expect("determined") / 400.0;
            }
            let all = cost
                .covariance(&THETA, &[0, 1, 2, 3], &[f64::INFINITY; 4], ScoreVariance::WhiteNoise)
                .expect("determined");
            wald += off * off / all[2][2] / 400.0;
        }
        assert!((mean[0] - 2.0).abs() < 0.4, "at the truth: mean {}", mean[0]);
        assert!(
            (mean[1] / (2.0 + wald) - 1.0).abs() < 0.33,
            "at a gain off: mean {}, Wald \
            {}",
            mean[1],
            2.0 + wald
        );
        assert!(wald > 20.0, "the signal must show the error at all: {wald}");
    }

    /// What is held is not part of the covariance, and what is known beforehand to ten times the
    /// precision of the record is known to that precision after it.
    #[test]
    fn held_and_known_parameters_are_what_they_were() {
        let mut rng = ChaCha8Rng::seed_from_u64(23);
        let readings = record(30.0, &mut || StandardNormal.sample(&mut rng));
        let cost = cost(&readings);
        let none = [f64::INFINITY; 4];
        let free = cost.covariance(&THETA, &[0, 1], &none, ScoreVariance::WhiteNoise).expect("determined");
        assert!(free[2][2] == 0.0 && free[0][2] == 0.0);
        let known = 0.1 * free[0][0].sqrt();
        let after = cost
            .covariance(&THETA, &[0, 1], &[known, none[1], none[2], none[3]], ScoreVariance::WhiteNoise)
            .expect("determined");
        assert!((after[0][0].sqrt() / known - 1.0).abs() < 0.01);
    }
}
