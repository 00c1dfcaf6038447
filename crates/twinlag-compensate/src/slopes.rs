//! Exact derivatives of a term's autocovariance and spectral density with respect to its numbers.
//!
//! A resonance has, with `α = 2π f₀ |t|`, `h = 1/(2Q)` and `x = (1 − h²) α²`, the autocovariance `r
//! = σ² e^(−hα) (C + h α S)`, `C(x) = cos √x`, `S(x) = sin √x/√x` (hyperbolic where `x < 0`). From
//! `S + 2x S' = C` and `C' = −S/2` follows, exactly and at any damping,
//!
//! ```text
//! ∂r/∂f₀ = −σ² e^(−hα) α² S/f₀        ∂r/∂Q = 2 σ² e^(−hα) h α³ S'/Q
//! ```

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::prior::Term;

/// A term, and how fast each of its numbers changes in some direction, in the order in which it has
/// them: the standard deviation, the frequency, the quality.
pub(crate) type Direction = (Term, [f64; 3]);

/// Below this size of `x` the power series of `S'` is used, above it `(C − S)/(2x)`, which loses
/// `ε/x` to cancellation: 2e-15 at the limit, where the first term that is left out of the series
/// is below 1e-17.
const SERIES_BELOW: f64 = 0.1;

/// `S'(x)`: `Σ −k (−x)^(k−1)/(2k + 1)!`.
fn slope_series(x: f64) -> f64 {
    // 1/3!, 2/5!, 3/7!, …
    const COEFFICIENTS: [f64; 6] =
        [1.0 / 6.0, 1.0 / 60.0, 1.0 / 1680.0, 1.0 / 90_720.0, 1.0 / 7_983_360.0, 1.0 / 1_037_836_800.0];
    -COEFFICIENTS.iter().rev().fold(0.0, |sum, c| c - x * sum)
}

/// Adds to `out` how fast the autocovariance changes in `direction`, at multiples of `period_s`.
pub(crate) fn add_autocovariance_slope(&(term, by): &Direction, period_s: f64, out: &mut [f64]) {
    match term {
        Term::Rough { std_k, corner_hz } => {
            let rate = TAU * corner_hz * period_s;
            let mut decay = std_k * std_k;
            for (m, sum) in out.iter_mut().enumerate() {
                *sum += decay * (2.0 * by[0] / std_k - m as f64 * rate * by[1] / corner_hz);
                decay *= (-rate).exp();
            }
        }
        Term::Resonance { std_k, frequency_hz, quality } => {
            let (half, step) = (0.5 / quality, TAU * frequency_hz * period_s);
            let square = 1.0 - half * half;
            let eta = square.abs().sqrt();
            // Both exponentials by products: complex conjugates, or a slow and a fast one.
            let is_complex = square > 0.0;
            let turn = if is_complex {
                [Complex64::new(-half, eta) * step; 2]
            } else {
                [-1.0 / (eta + half), -(eta + half)].map(|rate| Complex64::new(rate * step, 0.0))
            };
            let factor = turn.map(Complex64::exp);
            let mut now = [Complex64::new(std_k * std_k, 0.0); 2];
            for (m, sum) in out.iter_mut().enumerate() {
                let angle = m as f64 * step;
                let x = square * angle * angle;
                // σ² e^(−hα) times C, S and S'.
                let (cosine, sine) = if is_complex {
                    (now[0].re, now[0].im)
                } else {
                    (0.5 * (now[0].re + now[1].re), 0.5 * (now[0].re - now[1].re))
                };
                let envelope = std_k * std_k * (-half * angle).exp();
                let (s, slope) = if x.abs() < SERIES_BELOW {
                    let slope = slope_series(x);
                    // S = C − 2x S'.
                    (cosine - 2.0 * x * slope * envelope, slope * envelope)
                } else {
                    let s = sine / (eta * angle);
                    (s, (cosine - s) / (2.0 * x))
                };
                let value = cosine + half * angle * s;
                *sum += 2.0 * value * by[0] / std_k - angle * angle * s * by[1] / frequency_hz
                    + 2.0 * half * angle.powi(3) * slope * by[2] / quality;
                (0..2).for_each(|i| now[i] *= factor[i]);
            }
        }
    }
}

/// How fast the two-sided spectral density at `frequency_hz` changes in `direction`, K²/Hz.
#[inline]
pub(crate) fn density_slope(&(term, by): &Direction, frequency_hz: f64) -> f64 {
    let relative = match term {
        Term::Rough { std_k, corner_hz } => {
            let square = corner_hz * corner_hz + frequency_hz * frequency_hz;
            2.0 * by[0] / std_k + by[1] * (1.0 / corner_hz - 2.0 * corner_hz / square)
        }
        Term::Resonance { std_k, frequency_hz: f0, quality } => {
            let (square, width) = (frequency_hz * frequency_hz, f0 / quality);
            let away = square - f0 * f0;
            let all = away * away + square * width * width;
            let by_frequency = 3.0 / f0 - (2.0 * square * width / quality - 4.0 * f0 * away) / all;
            let by_quality = (2.0 * square * width * width / all - 1.0) / quality;
            2.0 * by[0] / std_k + by[1] * by_frequency + by[2] * by_quality
        }
    };
    term.density_k2_per_hz(frequency_hz) * relative
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 1e-5;

    fn numbers(term: &Term) -> Vec<f64> {
        match *term {
            Term::Rough { std_k, corner_hz } => vec![std_k, corner_hz],
            Term::Resonance { std_k, frequency_hz, quality } => vec![std_k, frequency_hz, quality],
        }
    }

    fn moved(term: &Term, a: usize, factor: f64) -> Term {
        let mut numbers = numbers(term);
        numbers[a] *= factor;
        match term {
            Term::Rough { .. } => Term::Rough { std_k: numbers[0], corner_hz: numbers[1] },
            Term::Resonance { .. } => {
                Term::Resonance { std_k: numbers[0], frequency_hz: numbers[1], quality: numbers[2] }
            }
        }
    }

    fn terms() -> Vec<Term> {
        let resonance = |quality| Term::Resonance { std_k: 3.0, frequency_hz: 5.0, quality };
        let mut out = vec![Term::Rough { std_k: 3.0, corner_hz: 2.0 }];
        out.extend([0.02, 0.3, 0.499_999_9, 0.5, 0.500_000_1, 0.6, 2.0, 50.0].map(resonance));
        out
    }

    /// Central differences with a relative step of 1e-5 are off by a sixth of the third derivative
    /// times its square, which after `α` radians is `α³ 1e-10/6` of the variance, and by rounding,
    /// 1e-16/1e-5 of it: with `α` up to 63 (2 s at 5 Hz) 4e-6 and 1e-11. Near critical damping,
    /// where the autocovariance itself is computed with a cancellation of up to `ε/η² ≈ 1e-9`, the
    /// differences are off by 1e-9/1e-5.
    #[test]
    fn slopes_of_autocovariances_are_differences() {
        for term in terms() {
            for a in 0..numbers(&term).len() {
                let (mut by, mut got) = ([0.0; 3], vec![0.0; 400]);
                by[a] = 1.0;
                add_autocovariance_slope(&(term, by), 0.005, &mut got);
                for (m, got) in got.iter().enumerate() {
                    let at = |factor| moved(&term, a, factor).autocovariance_k2(m as f64 * 0.005);
                    let value = numbers(&term)[a];
                    let want = (at(1.0 + STEP) - at(1.0 - STEP)) / (2.0 * STEP * value);
                    let tol = 9.0 / value * if numbers(&term)[1] == 5.0 { 1e-4 } else { 1e-6 };
                    assert!((got - want).abs() < tol, "{term:?}, number {a} at {m}: {got:e}, want {want:e} ± {tol:e}");
                }
            }
        }
    }

    /// The third logarithmic derivative of a density is at most `(2Q)³` of it, so differences are
    /// off by `8 Q³ 1e-10/6`, which is 2e-5 at the narrowest line.
    #[test]
    fn slopes_of_densities_are_differences() {
        for term in terms() {
            for a in 0..numbers(&term).len() {
                let mut by = [0.0; 3];
                by[a] = 1.0;
                for hz in [0.0, 0.1, 2.0, 4.9, 5.0, 5.2, 40.0] {
                    let at = |factor| moved(&term, a, factor).density_k2_per_hz(hz);
                    let value = numbers(&term)[a];
                    let want = (at(1.0 + STEP) - at(1.0 - STEP)) / (2.0 * STEP * value);
                    let got = density_slope(&(term, by), hz);
                    let tol = 1e-4 * at(1.0) / value;
                    assert!((got - want).abs() <= tol, "{term:?}, number {a} at {hz} Hz: {got:e}, want {want:e}");
                }
            }
        }
    }
}
