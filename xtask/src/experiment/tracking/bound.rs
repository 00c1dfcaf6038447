//! The Cramér-Rao bound of time constants along a record, for a gas that nobody knows.
//!
//! Readings of a first-order sensor that are a period apart tell the gas that held between them, `f[k] = y[k] + g Δy[k]`,
//! `g = 1/(1 − exp(−Ts/τ))`, `Δy[k] = y[k+1] − y[k]`, whatever it was before. An arbitrary gas drops out of the difference of both
//! sensors' inputs and out of nothing else: with it profiled out, the Fisher information is that of this difference, `F = J' Σ⁻¹ J`.
//! `J` is its derivative at the noise-free readings, `∂g/∂(ln τ) Δy`, and `Σ` its covariance for white noise, which is tridiagonal.
//!
//! The model is that of a shared change: `τ₁(t)` any natural cubic spline on so many even pieces, `τ₂(t)/τ₁(t)` a number. The spline
//! is one through values on knots, its second derivatives from the usual tridiagonal equations: neither basis, residual nor
//! derivative is the estimator's. A true change that is no such spline is missed by what the spline nearest to it, in the measure of
//! the information, misses.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// 95 % point of the evidence against the true instant of a change, `(1 − exp(−x/2))² = 0.95` (Hansen 2000).
const INSTANT_95: f64 = 7.352_277;

/// A record without noise, and what its noise would be.
pub(super) struct Bound {
    /// Time constants between samples, s.
    tau_s: [Vec<f64>; 2],
    period_s: f64,
    /// `Δy` of both channels, K.
    differences_k: [Vec<f64>; 2],
    /// Factor of `Σ`: its diagonal, and what is left of that.
    diagonal: Vec<f64>,
    left: Vec<f64>,
}

/// Mean squares along the record of what a spline does to `ln τ`, of both sensors.
pub(super) struct Spread {
    /// Variance at each sample.
    pub(super) variance: [Vec<f64>; 2],
    /// Systematic error there.
    pub(super) bias: [Vec<f64>; 2],
}

impl Bound {
    /// - `clean_c`: readings without noise, °C, `[n]` each
    /// - `tau_s`: time constants halfway between samples, s, `[n − 1]` each
    pub(super) fn new(clean_c: [&[f64]; 2], tau_s: [Vec<f64>; 2], period_s: f64, noise_std_k: f64) -> Self {
        let differences_k = clean_c.map(|y| y.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>());
        let gains = [0, 1].map(|i| tau_s[i].iter().map(|t| gain(period_s / t)).collect::<Vec<f64>>());
        let n = differences_k[0].len();
        let variance = noise_std_k * noise_std_k;
        let (mut diagonal, mut left) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for k in 0..n {
            let own: f64 = gains.iter().map(|g| (1.0 - g[k]).powi(2) + g[k] * g[k]).sum();
            let before: f64 = if k == 0 { 0.0 } else { gains.iter().map(|g| g[k - 1] * (1.0 - g[k])).sum() };
            let l = if k == 0 { 0.0 } else { variance * before / diagonal[k - 1] };
            left.push(l);
            diagonal.push((variance * own - l * l).sqrt());
        }
        Self { tau_s, period_s, differences_k, diagonal, left }
    }

    /// Instant halfway between two samples, as a share of the record.
    fn middle(&self, k: usize) -> f64 {
        (k as f64 + 0.5) / self.diagonal.len() as f64
    }

    /// The disagreement of both inputs, whitened: what `of(sensor, k)` is of `Δy`.
    fn whitened(&self, of: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.diagonal.len());
        let mut before = 0.0;
        for k in 0..self.diagonal.len() {
            let u = of(0, k) * self.differences_k[0][k] - of(1, k) * self.differences_k[1][k];
            before = (u - self.left[k] * before) / self.diagonal[k];
            out.push(before);
        }
        out
    }

    /// Whitened derivative by changes of both `ln τ`.
    fn column(&self, change: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        self.whitened(|i, k| gain_slope(self.period_s / self.tau_s[i][k]) * change(i, k))
    }

    /// The bound of `ln τ` at the samples with a spline of `size` pieces, and its systematic error; of a constant for none. None where the record does not
    /// tell so many.
    pub(super) fn spread(&self, size: usize) -> Option<Spread> {
        let shapes: Vec<Natural> = (0..=size).map(|j| Natural::through_one(j, size)).collect();
        // By τ₁'s values on knots, then by ln τ₂/τ₁.
        let relative = |shape: &Natural, k: usize| shape.at(self.middle(k)) / self.tau_s[0][k];
        let mut columns: Vec<Vec<f64>> = shapes.iter().map(|shape| self.column(|_, k| relative(shape, k))).collect();
        columns.push(self.column(|i, _| i as f64));
        let (inverse, nearest) = solve(&columns, &self.column(|_, _| 1.0))?;
        let p = columns.len();
        let n = self.diagonal.len();
        let mut out = Spread { variance: Default::default(), bias: Default::default() };
        for sample in 0..=n {
            let share = sample as f64 / n as f64;
            // The time constant at a sample: the mean of those around it.
            let [before, after] = [sample.saturating_sub(1), sample.min(n - 1)].map(|k| self.tau_s[0][k]);
            let mut slope: Vec<f64> = shapes.iter().map(|s| s.at(share) / (0.5 * (before + after))).collect();
            slope.push(0.0);
            for i in 0..2 {
                slope[p - 1] = i as f64;
                let variance: f64 =
                    (0..p).map(|a| slope[a] * (0..p).map(|b| inverse[(a, b)] * slope[b]).sum::<f64>()).sum();
                out.variance[i].push(variance);
                out.bias[i].push(slope.iter().zip(&nearest).map(|(s, c)| s * c).sum::<f64>() - 1.0);
            }
        }
        Some(out)
    }

    /// By how much a step by `factor` after `at` samples may be moved either way, samples, mean of both, until the evidence that is to
    /// be expected against it reaches the 95 % point: time
    /// constants and factor free.
    pub(super) fn step_resolution(&self, at: f64, factor: f64) -> f64 {
        let after = |k: usize, at: f64| (k as f64 + 1.0 - at).clamp(0.0, 1.0);
        let columns = [self.column(|_, _| 1.0), self.column(|i, _| i as f64), self.column(|_, k| after(k, at))];
        let evidence = |by: f64| {
            let missed = self.whitened(|i, k| {
                let [moved, true_s] = [at + by, at].map(|at| factor.powf(after(k, at)));
                let tau_s = self.tau_s[i][k];
                gain(self.period_s / (tau_s * moved / true_s)) - gain(self.period_s / tau_s)
            });
            let nearest = solve(&columns, &missed).map_or_else(Vec::new, |s| s.1);
            let left = (0..missed.len()).map(|k| {
                let explained: f64 = columns.iter().zip(&nearest).map(|(c, x)| c[k] * x).sum();
                (missed[k] - explained).powi(2)
            });
            left.sum::<f64>()
        };
        let reach = |sign: f64| {
            let mut last = 0.0;
            for samples in 1..self.diagonal.len() / 4 {
                let now = evidence(sign * samples as f64);
                if now > INSTANT_95 {
                    return samples as f64 - (now - INSTANT_95) / (now - last);
                }
                last = now;
            }
            self.diagonal.len() as f64 / 4.0
        };
        0.5 * (reach(1.0) + reach(-1.0))
    }
}

/// Inverse of the products of `columns`, and the combination of them that is nearest to `wanted`.
fn solve(columns: &[Vec<f64>], wanted: &[f64]) -> Option<(Mat<f64>, Vec<f64>)> {
    let p = columns.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let scale: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt()).collect();
    let information = Mat::from_fn(p, p, |a, b| dot(&columns[a], &columns[b]) / (scale[a] * scale[b]));
    let factor = information.llt(Side::Lower).ok()?;
    let solved = factor.solve(Mat::<f64>::identity(p, p));
    let inverse = Mat::from_fn(p, p, |a, b| solved[(a, b)] / (scale[a] * scale[b]));
    let slope: Vec<f64> = columns.iter().map(|c| dot(c, wanted)).collect();
    let nearest = (0..p).map(|a| (0..p).map(|b| inverse[(a, b)] * slope[b]).sum()).collect();
    Some((inverse, nearest))
}

/// `1/(1 − exp(−s))`.
fn gain(s: f64) -> f64 {
    -1.0 / (-s).exp_m1()
}

/// Its derivative by `ln τ`, `s = Ts/τ`: `s exp(−s)/(1 − exp(−s))²`.
fn gain_slope(s: f64) -> f64 {
    s * (-s).exp() * gain(s).powi(2)
}

/// A natural cubic spline over `[0, 1]` on even pieces.
struct Natural {
    values: Vec<f64>,
    /// Second derivatives on the knots, in units of pieces.
    curvatures: Vec<f64>,
}

impl Natural {
    /// The one that is 1 on knot `j` and 0 on all others of `pieces`; a constant 1 for none.
    fn through_one(j: usize, pieces: usize) -> Self {
        let values: Vec<f64> = (0..=pieces).map(|k| f64::from(u8::from(k == j))).collect();
        let mut curvatures = vec![0.0; pieces + 1];
        // m[k−1] + 4 m[k] + m[k+1] = 6 (v[k−1] − 2 v[k] + v[k+1]): forth and back.
        let (mut upper, mut right) = (vec![0.0; pieces + 1], vec![0.0; pieces + 1]);
        for k in 1..pieces {
            let pivot = 4.0 - upper[k - 1];
            upper[k] = 1.0 / pivot;
            right[k] = (6.0 * (values[k - 1] - 2.0 * values[k] + values[k + 1]) - right[k - 1]) / pivot;
        }
        for k in (1..pieces).rev() {
            curvatures[k] = right[k] - upper[k] * curvatures[k + 1];
        }
        Self { values, curvatures }
    }

    fn at(&self, share: f64) -> f64 {
        let pieces = self.values.len() - 1;
        if pieces == 0 {
            return self.values[0];
        }
        let x = share.clamp(0.0, 1.0) * pieces as f64;
        let k = (x as usize).min(pieces - 1);
        let d = x - k as f64;
        let c = 1.0 - d;
        let bent = |c: f64| (c * c * c - c) / 6.0;
        c * self.values[k] + d * self.values[k + 1] + bent(c) * self.curvatures[k] + bent(d) * self.curvatures[k + 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A natural spline through values of a straight line is that line, to rounding.
    #[test]
    fn splines_hold_straight_lines() {
        let shapes: Vec<Natural> = (0..=5).map(|j| Natural::through_one(j, 5)).collect();
        for k in 0..=20 {
            let share = f64::from(k) / 20.0;
            let got: f64 = shapes.iter().zip([0.0, 0.2, 0.4, 0.6, 0.8, 1.0]).map(|(s, v)| v * s.at(share)).sum();
            assert!((got - share).abs() < 1e-14, "got {got}, want {share}");
        }
    }

    /// One sine for both sensors, constant time constants: the information per frequency, `2 · N/2 · A² |∂u|²/S`, is known in closed form;
    /// ends and the leakage of a finite record count as about one period in 250.
    #[test]
    fn a_tone_in_a_steady_flow_has_the_bound_of_the_spectrum() {
        let (n, period_s, noise_std_k) = (20_000_usize, 0.002, 0.3);
        let tau_s = [0.0238_f64, 0.1168];
        let omega = std::f64::consts::TAU * 6.25;
        // The steady answer of the held model, y = Re(H exp(jωt)): b/(z − a), for both sensors.
        let w = omega * period_s;
        let response = tau_s.map(|tau_s| {
            let a = (-period_s / tau_s).exp();
            let (re, im) = (w.cos() - a, w.sin());
            let m = (1.0 - a) / (re * re + im * im);
            [m * re, -m * im]
        });
        let clean: Vec<Vec<f64>> = response
            .iter()
            .map(|[re, im]| (0..n).map(|k| re * (w * k as f64).cos() - im * (w * k as f64).sin()).collect())
            .collect();
        let steady = tau_s.map(|t| vec![t; n - 1]);
        let bound = Bound::new([&clean[0], &clean[1]], steady, period_s, noise_std_k);
        let got = bound.spread(0).expect("it tells both").variance.map(|v| v[n / 2]);
        // Whitened slopes at the tone, complex: ∂g (z − 1) H / √S with S = s² Σ |1 + g (z − 1)|².
        let gains = tau_s.map(|t| gain(period_s / t));
        let [zr, zi] = [w.cos() - 1.0, w.sin()];
        let spectrum: f64 = gains.iter().map(|g| (1.0 + g * zr).powi(2) + (g * zi).powi(2)).sum::<f64>();
        let level = noise_std_k * spectrum.sqrt();
        let slope = |i: usize| {
            let [re, im] = response[i];
            let by = gain_slope(period_s / tau_s[i]) / level * [1.0, -1.0][i];
            [by * (zr * re - zi * im), by * (zr * im + zi * re)]
        };
        let (d1, d2) = (slope(0), slope(1));
        let half = 0.5 * n as f64;
        let inner = |a: [f64; 2], b: [f64; 2]| half * (a[0] * b[0] + a[1] * b[1]);
        let (f11, f12, f22) = (inner(d1, d1), inner(d1, d2), inner(d2, d2));
        let determinant = f11 * f22 - f12 * f12;
        for (got, want) in got.into_iter().zip([f22 / determinant, f11 / determinant]) {
            assert!((got / want - 1.0).abs() < 4e-3, "got {got:e}, want {want:e}");
        }
    }
}
