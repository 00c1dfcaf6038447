//! What a piece of a term's motion shows under Hann's taper, exactly, in closed form.
//!
//! A term's autocovariance is a sum of exponentials `Re Σ c e^(λ|t|)`. Of `n` samples, `Ts` apart, with the taper
//! `w[k] = sin²(π (k + ½)/n)` scaled to unit energy, the mean of the periodogram at `ω` is
//! `Ts Re Σ c (2 F(λ Ts − iω Ts) − 1)`, `F(x) = Σ_m a[m] e^(x m)`, `a` the taper's autocorrelation. The taper is a sum of
//! three exponentials, and so `F` is a sum of geometric series: with `θ = 2π/n`, `t_q = e^(x + iqθ)`, `D_q = 1/(1 − t_q)`
//! and `E = e^(n x)`,
//!
//! ```text
//! F = 2/(3n) (n Σ_q b_q D_q − (1 − E) (Σ_q b_q t_q D_q² + iκ (D_1 − D_−1)))
//! b = (¼, 1, ¼)        κ = 1/(2 sin ½θ) − 1/(4 sin θ)
//! ```

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use crate::prior::Term;

/// Least `|1 − 1/(2Q)²|`, at which both exponentials of a resonance, which cancel, are kept apart: qualities within 5e-7 of
/// critical damping are taken as that far away. Rounding is below 1e-7 with it.
const MIN_FROM_CRITICAL: f64 = 1e-6;
/// Least decay of an exponential over a piece: what lasts for twenty pieces shows as what lasts for ever, but for
/// [`MIN_DECAY`]`/2π` of a bin, by which it is wider. Rounding is below 1e-6 with it: half turns are known within 1e-16, which is
/// 3e-11 of `0.05/16384`, and slopes go with the third power of that.
const MIN_DECAY: f64 = 0.05;
/// Decay over a piece after which nothing is left, `e^−40`.
const NOTHING_LEFT: f64 = 40.0;

/// One exponential `c e^(λ|t|)` of an autocovariance, with derivatives with respect to the term's numbers.
struct Exponential {
    /// `c`, K².
    variance: Complex64,
    /// `λ`, 1/s.
    rate: Complex64,
    variance_by: [Complex64; 3],
    rate_by: [Complex64; 3],
}

/// The exponentials of `term`.
fn exponentials(term: &Term) -> Vec<Exponential> {
    let nothing = Complex64::default();
    match *term {
        Term::Rough { std_k, corner_hz } => {
            let (variance, rate) = (Complex64::from(std_k * std_k), Complex64::from(-TAU * corner_hz));
            let variance_by = [2.0 * variance / std_k, nothing, nothing];
            vec![Exponential { variance, rate, variance_by, rate_by: [nothing, rate / corner_hz, nothing] }]
        }
        Term::Resonance { std_k, frequency_hz, quality } => {
            let all = TAU * frequency_hz;
            // With h = 1/(2Q), h² − 1.
            let square = (0.5 / quality).powi(2) - 1.0;
            let square = if square.abs() < MIN_FROM_CRITICAL { MIN_FROM_CRITICAL.copysign(square) } else { square };
            let (half, root) = ((1.0 + square).sqrt(), Complex64::from(square).sqrt());
            let half_by = -half / quality;
            let of = |sign: f64| {
                let root = sign * root;
                let variance = 0.5 * std_k * std_k * (1.0 + half / root);
                let rate = all * (root - half);
                // d√(h² − 1)/dh = h/√(h² − 1), and of h/√(h² − 1) it is −1/√(h² − 1)³.
                let variance_by_quality = -0.5 * std_k * std_k * half_by / (root * root * root);
                Exponential {
                    variance,
                    rate,
                    variance_by: [2.0 * variance / std_k, nothing, variance_by_quality],
                    rate_by: [nothing, rate / frequency_hz, all * half_by * (half / root - 1.0)],
                }
            };
            vec![of(1.0), of(-1.0)]
        }
    }
}

/// A frequency at which a periodogram of samples `Ts` apart is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    frequency_hz: f64,
    /// Half of the width over which the mean is taken there; a line in it is at least as wide.
    half_hz: f64,
    /// Cosine and sine of `π f Ts`.
    half_turn: Complex64,
}

impl Place {
    pub(crate) fn new(frequency_hz: f64, half_hz: f64, period_s: f64) -> Self {
        Self { frequency_hz, half_hz, half_turn: Complex64::cis(PI * frequency_hz * period_s) }
    }
}

/// Adds to `out` at each of `places` what a piece of `samples`, `period_s` apart, of `term` shows, K²/Hz, and its derivatives
/// with respect to the term's numbers.
pub(crate) fn add_shown(term: &Term, samples: usize, period_s: f64, places: &[Place], out: &mut [[f64; 4]]) {
    let n = samples as f64;
    let taper = Taper::new(n);
    for of in exponentials(term) {
        let line_hz = of.rate.im.abs() / TAU;
        let half_turn = Complex64::cis(0.5 * of.rate.im * period_s);
        let own = -of.rate.re * period_s * n;
        for (place, out) in places.iter().zip(out.iter_mut()) {
            let is_here = (place.frequency_hz - line_hz).abs() <= place.half_hz;
            let least = if is_here { TAU * place.half_hz * n * period_s } else { 0.0 }.max(MIN_DECAY);
            let decay = own.max(least);
            let turns = (line_hz.copysign(of.rate.im) - place.frequency_hz) * period_s * n;
            let [shown, slope] = taper.shown(decay, turns, half_turn * place.half_turn.conj());
            let (shown, slope) = (2.0 * shown - 1.0, 2.0 * of.variance * period_s * slope);
            out[0] += period_s * (of.variance * shown).re;
            for i in 0..3 {
                let by_rate = if own > least { of.rate_by[i] } else { Complex64::new(0.0, of.rate_by[i].im) };
                out[1 + i] += period_s * (of.variance_by[i] * shown + slope * by_rate).re;
            }
        }
    }
}

/// Hann's taper of `n` samples.
struct Taper {
    n: f64,
    /// `iκ`.
    ends: Complex64,
    /// Half of the turns `−θ`, 0 and `θ`.
    half_turns: [Complex64; 3],
}

impl Taper {
    fn new(n: f64) -> Self {
        let theta = TAU / n;
        let ends = Complex64::new(0.0, 0.5 / (0.5 * theta).sin() - 0.25 / theta.sin());
        Self { n, ends, half_turns: [-0.5, 0.0, 0.5].map(|q| Complex64::cis(q * theta)) }
    }

    /// `F` and its derivative at `x = (−decay + 2πi turns)/n`, of which half the angle is given as a turn as well.
    fn shown(&self, decay: f64, turns: f64, half_turn: Complex64) -> [Complex64; 2] {
        let n = self.n;
        // 1 − e^(a + ib) = −(e^a − 1) + 2 e^a sin²(b/2) − 2i e^a sin(b/2) cos(b/2), in which nothing cancels.
        let less = (-decay / n).exp_m1();
        let one_less = |half: Complex64, less: f64| {
            Complex64::new(2.0 * half.im * half.im * (1.0 + less) - less, -2.0 * half.im * half.re * (1.0 + less))
        };
        let past = if decay > NOTHING_LEFT {
            Complex64::from(1.0)
        } else {
            one_less(Complex64::cis(PI * turns), (-decay).exp_m1())
        };
        // t_q, D_q and t_q D_q², which is the derivative of D_q.
        let [before, at, after] = self.half_turns.map(|own| {
            let less = one_less(half_turn * own, less);
            let sum = less.conj() / less.norm_sqr();
            [1.0 - less, sum, (1.0 - less) * sum * sum]
        });
        let of = |part: [Complex64; 3]| part[1] + 0.25 * (part[0] + part[2]);
        let sums = of([before[1], at[1], after[1]]);
        let slopes = of([before[2], at[2], after[2]]);
        let curvatures = of([before, at, after].map(|[t, sum, slope]| slope * (1.0 + t) * sum));
        let ends = slopes + self.ends * (after[1] - before[1]);
        let ends_slope = curvatures + self.ends * (after[2] - before[2]);
        let scale = 2.0 / (3.0 * n);
        let value = n * sums - past * ends;
        let slope = n * slopes - past * ends_slope + n * (1.0 - past) * ends;
        [scale * value, scale * slope]
    }
}

#[cfg(test)]
mod tests {
    use twinlag_transform::hann;

    use super::*;

    const SAMPLES: usize = 240;
    const PERIOD_S: f64 = 0.005;

    /// The definition: the sum over all pairs of samples.
    fn by_definition(term: &Term, hz: f64) -> f64 {
        let taper = hann(SAMPLES);
        let energy: f64 = taper.iter().map(|w| w * w).sum();
        let lag = |m: usize| -> f64 { (0..SAMPLES - m).map(|k| taper[k] * taper[k + m]).sum::<f64>() / energy };
        let at = |m: usize| lag(m) * term.autocovariance_k2(m as f64 * PERIOD_S);
        let turned = |m: usize| (TAU * hz * m as f64 * PERIOD_S).cos();
        PERIOD_S * (at(0) + 2.0 * (1..SAMPLES).map(|m| at(m) * turned(m)).sum::<f64>())
    }

    fn shown(term: &Term, hz: f64) -> [f64; 4] {
        let mut out = [[0.0; 4]];
        add_shown(term, SAMPLES, PERIOD_S, &[Place::new(hz, 0.0, PERIOD_S)], &mut out);
        out[0]
    }

    fn terms() -> Vec<Term> {
        let resonance = |quality| Term::Resonance { std_k: 3.0, frequency_hz: 5.0, quality };
        let mut out = vec![Term::Rough { std_k: 3.0, corner_hz: 2.0 }, Term::Rough { std_k: 3.0, corner_hz: 0.05 }];
        out.extend([0.02, 0.3, 0.499_999_9, 0.5, 0.500_000_1, 0.6, 2.0, 50.0, 300.0].map(resonance));
        out
    }

    /// Sums of 240 products are off by some 1e-14 of the power at rest, `σ² T`; near critical damping the quality is off by 5e-7,
    /// and the definition's exponentials cancel as well.
    #[test]
    fn it_is_the_sum_over_all_pairs() {
        for term in terms() {
            for hz in [0.83, 2.0, 4.17, 5.0, 5.2, 40.0, 99.0] {
                let (got, want) = (shown(&term, hz)[0], by_definition(&term, hz));
                let is_critical = matches!(term, Term::Resonance { quality, .. } if (quality - 0.5).abs() < 1e-4);
                let tol = if is_critical { 2e-6 * want } else { 1e-12 * 9.0 * SAMPLES as f64 * PERIOD_S };
                assert!((got - want).abs() < tol, "{term:?} at {hz} Hz: {got:e}, want {want:e} ± {tol:e}");
            }
        }
    }

    /// Central differences over 1e-5 are off by the third derivative, up to `(2Q)³` of the value at a line and no more than the
    /// bin is wide, times 1e-10/6, and by rounding, 1e-10 of the cancelling exponentials over 1e-5. Near critical damping, where
    /// the quality is off by 5e-7, steps over 1e-5 are off by a tenth.
    #[test]
    fn slopes_are_differences() {
        for term in terms() {
            for number in 0..if matches!(term, Term::Rough { .. }) { 2 } else { 3 } {
                for hz in [0.83, 2.0, 4.17, 5.0, 5.2, 40.0] {
                    let at = |factor: f64| match term {
                        Term::Rough { std_k, corner_hz } => {
                            let [a, b] = [0, 1].map(|i| if i == number { factor } else { 1.0 });
                            shown(&Term::Rough { std_k: a * std_k, corner_hz: b * corner_hz }, hz)
                        }
                        Term::Resonance { std_k, frequency_hz, quality } => {
                            let [a, b, c] = [0, 1, 2].map(|i| if i == number { factor } else { 1.0 });
                            let (std_k, frequency_hz, quality) = (a * std_k, b * frequency_hz, c * quality);
                            shown(&Term::Resonance { std_k, frequency_hz, quality }, hz)
                        }
                    };
                    let value = match term {
                        Term::Rough { std_k, corner_hz } => [std_k, corner_hz, 0.0],
                        Term::Resonance { std_k, frequency_hz, quality } => [std_k, frequency_hz, quality],
                    }[number];
                    let (got, want) =
                        (shown(&term, hz)[1 + number], (at(1.0 + 1e-5)[0] - at(1.0 - 1e-5)[0]) / (2e-5 * value));
                    let is_critical = number == 2 && (value - 0.5).abs() < 1e-4;
                    let tol = (if is_critical { 0.1 } else { 1e-4 } * at(1.0)[0] + 1e-8) / value;
                    assert!(
                        (got - want).abs() < tol,
                        "{term:?}, number {number} at {hz}: {got:e}, want {want:e} ± {tol:e}"
                    );
                }
            }
        }
    }
}
