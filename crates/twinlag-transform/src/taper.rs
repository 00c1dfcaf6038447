//! Tapers, which keep what is strong at one frequency from leaking into all others.

use num_complex::Complex64;

use crate::fourier::Forward;

/// Hann's window, 1 in the middle and 0 at both ends.
///
/// - `place`: where in the record, 0 at its start and 1 at its end
fn hann_at(place: f64) -> f64 {
    (std::f64::consts::PI * place).sin().powi(2)
}

/// Hann's window for `samples` values, each in the middle of its own period: `sin²(π (k + ½)/n)`.
pub fn hann(samples: usize) -> Vec<f64> {
    (0..samples).map(|k| hann_at((k as f64 + 0.5) / samples as f64)).collect()
}

/// Hann's window for `samples` values, one step inside its zeros: `sin²(π (k + 1)/(n + 1))`.
pub fn hann_between(samples: usize) -> Vec<f64> {
    (1..=samples).map(|k| hann_at(k as f64 / (samples + 1) as f64)).collect()
}

/// The Fourier transform of pieces of one length under a taper.
#[derive(Clone, Debug)]
pub struct Tapered {
    taper: Vec<f64>,
    plan: Forward,
}

impl Tapered {
    /// Under `taper`, whose length is that of the pieces.
    pub fn new(taper: Vec<f64>) -> Self {
        let plan = Forward::of(taper.len());
        Self { taper, plan }
    }

    /// The taper.
    pub fn taper(&self) -> &[f64] {
        &self.taper
    }

    /// `Σ_k w[k]²`: the power of white noise of unit variance in each bin.
    pub fn energy(&self) -> f64 {
        self.taper.iter().map(|w| w * w).sum()
    }

    /// The spectrum of the `values` `[taper]` under the taper.
    pub fn transform(&self, values: impl IntoIterator<Item = f64>) -> Vec<Complex64> {
        let tapered: Vec<f64> = values.into_iter().zip(&self.taper).map(|(v, w)| v * w).collect();
        self.plan.transform(&tapered)
    }

    /// The pieces of `values`, each from the middle of the one before it on (Welch 1967); a rest
    /// that is shorter is left out.
    pub fn halves<'a, T>(&self, values: &'a [T]) -> impl Iterator<Item = &'a [T]> + use<'a, T> {
        let length = self.taper.len();
        values.windows(length).step_by(length / 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed forms: `Σ w = n/2` and `Σ w² = 3n/8`; between the zeros, of `n + 1`. Each of `n`
    /// additions to a sum of up to `n/2` rounds by `ε/2` of it, and each term by a few `ε`.
    #[test]
    fn hann_has_the_mean_and_the_energy_of_its_closed_form() {
        for n in [5, 8, 257] {
            let tol = (0.25 * n as f64 + 4.0) * n as f64 * f64::EPSILON;
            for (window, length) in [(hann(n), n), (hann_between(n), n + 1)] {
                let (sum, length) = (window.iter().sum::<f64>(), length as f64);
                assert!((sum - 0.5 * length).abs() < tol, "{n}: sum {sum}");
                let energy = Tapered::new(window).energy();
                assert!((energy - 0.375 * length).abs() < tol, "{n}: energy {energy}");
            }
        }
    }

    #[test]
    fn pieces_overlap_by_half() {
        let tapered = Tapered::new(hann(4));
        let values = [0, 1, 2, 3, 4, 5, 6, 7, 8];
        let pieces: Vec<&[i32]> = tapered.halves(&values).collect();
        assert_eq!(pieces, [&[0, 1, 2, 3][..], &[2, 3, 4, 5], &[4, 5, 6, 7]]);
    }

    /// A constant under Hann's taper: half the length at zero frequency, a quarter beside it,
    /// nothing beyond.
    #[test]
    fn a_constant_leaks_into_the_next_bin_alone() {
        let n = 16;
        let spectrum = Tapered::new(hann(n)).transform(std::iter::repeat_n(1.0, n));
        let power: Vec<f64> = spectrum.iter().map(|x| x.norm()).collect();
        let tol = n as f64 * f64::EPSILON;
        assert!((power[0] - 8.0).abs() < tol && (power[1] - 4.0).abs() < tol, "{power:?}");
        assert!(power[2..].iter().all(|p| *p < tol), "{power:?}");
    }
}
