//! Estimators from the difference equation, which is linear in two numbers.
//!
//! With `λ = (1 − c)/(1 − a)` and `κ = −a λ` the two zero-order-hold sensors obey, sample by sample
//! and without the gas,
//!
//! ```text
//! λ (y1[k] − y2[k−1]) + κ (y1[k−1] − y2[k−1]) − (y2[k] − y2[k−1]) = 0        η' x[k] = 0,  η = [λ, κ, 1]
//! ```
//!
//! exactly for gas held between samples. All three estimators here minimise a ratio
//! `Σ (η' x[k])² / η' W η` over the direction of `η`; they differ in `W`, the assumed distribution
//! of the noise over the three columns of `x`. No start is needed, and no sample is discarded.
//! Noise of neighbouring `x` is correlated, which none of them uses: the whitened cost does, and is
//! more precise.

use faer::{Mat, Side};
use nalgebra::{Matrix2, Matrix3, Matrix3x4, Matrix4, Vector3};

use crate::error::CostError;
use crate::readings::Readings;

/// Rows that are factorised at a time. Chosen: 100 kB, which stays in the cache.
const ROWS_AT_A_TIME: usize = 4096;

/// How the difference equation is solved for the two time constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DifferenceEquationEstimator {
    /// `W = diag(0, 0, 1)`, all the noise in the third column: least squares by QR factorisation.
    /// Noise in the regressors biases it, badly from a few per cent on; towards short time
    /// constants if sensor 1 is the faster.
    LeastSquares,
    /// `W = 1`, equal and independent noise in the three columns: the smallest right singular
    /// vector. But all three hold `y2[k−1]`, and their noise is neither equal nor independent, so
    /// it is biased, strongly so at high noise.
    TotalLeastSquares,
    /// `W` the covariance that white noise gives the three columns: consistent. The smallest right
    /// singular vector of the columns whitened by its Cholesky factor.
    Generalised {
        /// Ratio `s2/s1` of the noise levels, all that is needed of them. An error in it goes
        /// straight into the estimate.
        noise_ratio: f64,
    },
}

impl DifferenceEquationEstimator {
    /// Time constants `[τ1, τ2]` (s).
    ///
    /// ```
    #[doc = include_str!("example.txt")]
    /// // An error that goes up and down from sample to sample, in the second channel alone.
    /// let wrong: Vec<f64> = (0..).zip(&y2).map(|(k, y)| if k % 2 == 0 { y + 0.05 } else { y - 0.05 }).collect();
    /// let readings = Readings::even(&y1, &wrong, 0.002)?;
    ///
    /// // Errors among the regressors pull least squares to short time constants where sensor 1 is
    /// // the faster.
    /// let [tau1_s, tau2_s] = DifferenceEquationEstimator::LeastSquares.estimate(&readings)?;
    /// assert!(tau1_s < 0.0238 && tau2_s < 0.1168, "{tau1_s} {tau2_s}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`CostError::UnevenSampling`]; [`CostError::NotPositive`] for an invalid noise ratio;
    /// [`CostError::Singular`] if the solution is not a pair of positive time constants.
    ///
    /// # Source
    /// Difference equation: Hung, McLoone, Irwin, Kee, *A difference equation approach to
    /// two-thermocouple sensor characterisation in constant velocity flow environments*, 2005
    /// (abstract seen). Weights: own derivation, docs, chapter "Theory", section 2.
    pub fn estimate(self, readings: &Readings) -> Result<[f64; 2], CostError> {
        let period_s = readings.even_period_s().ok_or(CostError::UnevenSampling)?;
        let columns = || -> Vec<Vector3<f64>> { runs(readings).flatten().collect() };
        let [lambda, kappa] = match self {
            Self::LeastSquares => least_squares(runs(readings).flatten()),
            Self::TotalLeastSquares => smallest_direction(&columns(), &Matrix3::identity())?,
            Self::Generalised { .. } => smallest_direction(&columns(), &self.spread()?)?,
        };
        let poles = [-kappa / lambda, 1.0 - lambda - kappa];
        if poles.iter().all(|p| *p > 0.0 && *p < 1.0) {
            Ok(poles.map(|p| -period_s / p.ln()))
        } else {
            Err(CostError::Singular)
        }
    }

    /// Covariance `[2][2]` (s²) of the estimate `tau_s` of this estimator under white Gaussian
    /// noise of `noise_std` `[s1, s2]` (K).
    ///
    /// `A⁻¹ M A⁻¹` with `A = S − μ W`, `S = Σ x x'`, `μ` the minimum, over `[λ, κ]`, carried over
    /// to the time constants by the delta method. `M` is the variance of the score
    /// `Σ r (x − r W η/η'Wη)`, `r = η' x`, a quadratic form of noise that neighbouring `k` share:
    /// the products of signal and noise from the sums at lags −1, 0 and 1 of the data, less what
    /// noise adds to these, and the products of noise with noise. It describes the scatter of the
    /// estimate about its own limit, which for least squares and for total least squares is not the
    /// truth. It does not include that bias.
    ///
    /// # Errors
    /// As [`DifferenceEquationEstimator::estimate`]; [`CostError::Singular`] also where no positive
    /// variance comes out.
    ///
    /// # Source
    /// Own derivation, docs, chapter "Theory", section 2.
    pub fn covariance(
        self,
        readings: &Readings,
        tau_s: [f64; 2],
        noise_std: [f64; 2],
    ) -> Result<[[f64; 2]; 2], CostError> {
        let period_s = readings.even_period_s().ok_or(CostError::UnevenSampling)?;
        let spread = self.spread()?;
        let [a, c] = tau_s.map(|t| (-period_s / t).exp());
        let lambda = (1.0 - c) / (1.0 - a);
        let eta = Vector3::new(lambda, -a * lambda, 1.0);
        // Sums over the record of x[k] x[k+l]', l = 0, 1, and how many there are.
        let (mut sums, mut counts) = ([Matrix3::zeros(); 2], [0.0; 2]);
        for run in runs(readings) {
            let run: Vec<Vector3<f64>> = run.collect();
            for lag in 0..2 {
                for (now, later) in run.iter().zip(run.iter().skip(lag)) {
                    sums[lag] += now * later.transpose();
                    counts[lag] += 1.0;
                }
            }
        }
        let noise = column_noise(noise_std);
        let below = (eta.transpose() * spread * eta)[0];
        let weighted = spread * eta / below;
        let least = (eta.transpose() * sums[0] * eta)[0] / below;
        let half_hessian = (sums[0] - spread * least).fixed_view::<2, 2>(0, 0).into_owned();
        // v_i = (e_i − p_i η)' x is what the residual multiplies in the score.
        let v: [Vector3<f64>; 2] = std::array::from_fn(|i| Vector3::ith(i, 1.0) - eta * weighted[i]);
        let form = |x: &Vector3<f64>, m: &Matrix3<f64>, y: &Vector3<f64>| (x.transpose() * m * y)[0];
        let mut score = Matrix2::zeros();
        for lag in [-1_i32, 0, 1] {
            let at = |m: &[Matrix3<f64>; 2]| match lag {
                0 => m[0],
                1 => m[1],
                _ => m[1].transpose(),
            };
            let (data, shared, count) = (at(&sums), at(&noise), counts[lag.unsigned_abs() as usize]);
            for i in 0..2 {
                for j in 0..2 {
                    let cross = form(&eta, &data, &eta) * form(&v[i], &shared, &v[j])
                        + form(&eta, &data, &v[j]) * form(&v[i], &shared, &eta)
                        + form(&v[i], &data, &eta) * form(&eta, &shared, &v[j])
                        + form(&v[i], &data, &v[j]) * form(&eta, &shared, &eta);
                    // The data's sums hold noise already: what it adds to the above is twice what
                    // noise times noise is.
                    let own = form(&eta, &shared, &eta) * form(&v[i], &shared, &v[j])
                        + form(&eta, &shared, &v[j]) * form(&v[i], &shared, &eta);
                    score[(i, j)] += cross - count * own;
                }
            }
        }
        let inverse = half_hessian.try_inverse().ok_or(CostError::Singular)?;
        // dτ/dp = τ²/(p Ts), a = −κ/λ, c = 1 − λ − κ.
        let [by_a, by_c] = [(tau_s[0], a), (tau_s[1], c)].map(|(tau, p)| tau * tau / (p * period_s));
        let chain = Matrix2::new(-by_a * a / lambda, -by_a / lambda, -by_c, -by_c);
        let out = chain * inverse * score * inverse * chain.transpose();
        if out.iter().all(|v| v.is_finite()) && out[(0, 0)] > 0.0 && out[(1, 1)] > 0.0 {
            Ok([[out[(0, 0)], out[(0, 1)]], [out[(1, 0)], out[(1, 1)]]])
        } else {
            Err(CostError::Singular)
        }
    }

    /// `W`.
    fn spread(self) -> Result<Matrix3<f64>, CostError> {
        match self {
            Self::LeastSquares => Ok(Matrix3::from_diagonal(&Vector3::z())),
            Self::TotalLeastSquares => Ok(Matrix3::identity()),
            Self::Generalised { noise_ratio } if noise_ratio.is_finite() && noise_ratio > 0.0 => {
                Ok(column_noise([1.0, noise_ratio])[0])
            }
            Self::Generalised { noise_ratio } => {
                Err(CostError::NotPositive { name: "noise ratio", value: noise_ratio })
            }
        }
    }
}

/// Time constants `[τ1, τ2]` (s) by least squares on the difference equation: a start that costs
/// almost nothing, not an estimate.
///
/// ```
#[doc = include_str!("example.txt")]
/// let tau_s = difference_equation_least_squares(&readings)?;
/// // Without noise, and with gas that is held between samples, the equation is exact.
/// for (got, want) in tau_s.iter().zip([0.0238, 0.1168]) {
///     assert!((got / want - 1.0).abs() < 1e-9, "{got}");
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`DifferenceEquationEstimator::estimate`].
pub fn difference_equation_least_squares(readings: &Readings) -> Result<[f64; 2], CostError> {
    DifferenceEquationEstimator::LeastSquares.estimate(readings)
}

/// The rows `[y1[k] − y2[k−1], y1[k−1] − y2[k−1], y2[k−1] − y2[k]]` of each segment.
fn runs(readings: &Readings) -> impl Iterator<Item = impl Iterator<Item = Vector3<f64>>> {
    readings.segments().iter().map(|s| {
        let pairs = s.y1().windows(2).zip(s.y2().windows(2));
        pairs.map(|(y1, y2)| Vector3::new(y1[1] - y2[0], y1[0] - y2[0], y2[0] - y2[1]))
    })
}

/// Covariance of the noise of a row with that of the same row, and with that of the next.
fn column_noise([s1, s2]: [f64; 2]) -> [Matrix3<f64>; 2] {
    // x[k] = T [y1[k], y1[k−1], y2[k], y2[k−1]]; the next row's second and fourth reading are this
    // one's first and third.
    let t = Matrix3x4::new(1.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0, -1.0, 1.0);
    let (v1, v2) = (s1 * s1, s2 * s2);
    let same = Matrix4::from_diagonal(&[v1, v1, v2, v2].into());
    let mut next = Matrix4::zeros();
    (next[(0, 1)], next[(2, 3)]) = (v1, v2);
    [t * same * t.transpose(), t * next * t.transpose()]
}

/// `[λ, κ]` of the direction `[λ, κ, 1]` that minimises `Σ (η' x)² / η' W η`, `W` positive
/// definite.
fn smallest_direction(columns: &[Vector3<f64>], spread: &Matrix3<f64>) -> Result<[f64; 2], CostError> {
    let weight = Mat::from_fn(3, 3, |i, j| spread[(i, j)]);
    let factor = weight.llt(Side::Lower).map_err(|_| CostError::Singular)?;
    // W = L L', ξ = L' η: the rows become L⁻¹ x.
    let lower = factor.L();
    let whitened: Vec<[f64; 3]> = columns
        .iter()
        .map(|x| {
            let first = x[0] / lower[(0, 0)];
            let second = (x[1] - lower[(1, 0)] * first) / lower[(1, 1)];
            [first, second, (x[2] - lower[(2, 0)] * first - lower[(2, 1)] * second) / lower[(2, 2)]]
        })
        .collect();
    let rows = Mat::from_fn(whitened.len(), 3, |i, j| whitened[i][j]);
    let svd = rows.thin_svd().map_err(|_| CostError::Singular)?;
    let v = svd.V();
    let last = v.ncols() - 1;
    let third = v[(2, last)] / lower[(2, 2)];
    let second = (v[(1, last)] - lower[(2, 1)] * third) / lower[(1, 1)];
    let first = (v[(0, last)] - lower[(1, 0)] * second - lower[(2, 0)] * third) / lower[(0, 0)];
    Ok([first / third, second / third])
}

/// The `[λ, κ]` for which `λ x0 + κ x1 + x2` has the least sum of squares over all rows `x`, by orthogonal factorisation of some
/// rows at a time below the triangle of those before: as exact as of all at once.
fn least_squares(mut rows: impl Iterator<Item = Vector3<f64>>) -> [f64; 2] {
    let mut kept: Vec<Vector3<f64>> = Vec::with_capacity(ROWS_AT_A_TIME + 3);
    loop {
        let before = kept.len();
        kept.extend(rows.by_ref().take(ROWS_AT_A_TIME));
        if kept.len() == before {
            break;
        }
        let stacked = Mat::from_fn(kept.len().max(3), 3, |i, j| kept.get(i).map_or(0.0, |row| row[j]));
        let factor = stacked.qr();
        let triangle = factor.thin_R();
        kept.clear();
        kept.extend((0..3).map(|i| Vector3::from_fn(|j, _| if j < i { 0.0 } else { triangle[(i, j)] })));
    }
    let [Some(first), Some(second)] = [kept.first(), kept.get(1)] else { return [f64::NAN; 2] };
    let kappa = -second[2] / second[1];
    [-(first[2] + first[1] * kappa) / first[0], kappa]
}
