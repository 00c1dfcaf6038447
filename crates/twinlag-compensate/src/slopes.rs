//! Exact derivatives of a term's spectral density with respect to its numbers.

use crate::prior::Term;

/// The two-sided spectral density of `term` at `frequency_hz`, K²/Hz, and its derivatives with respect to the term's numbers
/// in the order in which it has them: the standard deviation, the frequency, the quality.
#[inline]
pub(crate) fn density_with_slopes(term: &Term, frequency_hz: f64) -> [f64; 4] {
    let density = term.density_k2_per_hz(frequency_hz);
    let relative = match *term {
        Term::Rough { std_k, corner_hz } => {
            let square = corner_hz * corner_hz + frequency_hz * frequency_hz;
            [2.0 / std_k, 1.0 / corner_hz - 2.0 * corner_hz / square, 0.0]
        }
        Term::Resonance { std_k, frequency_hz: f0, quality } => {
            let (square, width) = (frequency_hz * frequency_hz, f0 / quality);
            let away = square - f0 * f0;
            let all = away * away + square * width * width;
            let by_frequency = 3.0 / f0 - (2.0 * square * width / quality - 4.0 * f0 * away) / all;
            let by_quality = (2.0 * square * width * width / all - 1.0) / quality;
            [2.0 / std_k, by_frequency, by_quality]
        }
    };
    [density, density * relative[0], density * relative[1], density * relative[2]]
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

    /// The third logarithmic derivative of a density is at most `(2Q)³` of it, so differences are
    /// off by `8 Q³ 1e-10/6`, which is 2e-5 at the narrowest line.
    #[test]
    fn slopes_of_densities_are_differences() {
        for term in terms() {
            for a in 0..numbers(&term).len() {
                for hz in [0.0, 0.1, 2.0, 4.9, 5.0, 5.2, 40.0] {
                    let at = |factor| moved(&term, a, factor).density_k2_per_hz(hz);
                    let value = numbers(&term)[a];
                    let want = (at(1.0 + STEP) - at(1.0 - STEP)) / (2.0 * STEP * value);
                    let got = density_with_slopes(&term, hz)[1 + a];
                    let tol = 1e-4 * at(1.0) / value;
                    assert!((got - want).abs() <= tol, "{term:?}, number {a} at {hz} Hz: {got:e}, want {want:e}");
                }
            }
        }
    }
}
