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
///
/// ```
/// let taper = twinlag_transform::hann(8);
/// // 0.038 at both ends; squares of sines over a whole period have the mean 1/2, to rounding.
/// assert!(taper[0] < 0.04 && (taper[0] - taper[7]).abs() < 1e-15);
/// assert!((taper.iter().sum::<f64>() - 4.0).abs() < 1e-14);
/// ```
pub fn hann(samples: usize) -> Vec<f64> {
    (0..samples).map(|k| hann_at((k as f64 + 0.5) / samples as f64)).collect()
}

/// Hann's window for `samples` values, one step inside its zeros: `sin²(π (k + 1)/(n + 1))`.
pub fn hann_between(samples: usize) -> Vec<f64> {
    (1..=samples).map(|k| hann_at(k as f64 / (samples + 1) as f64)).collect()
}

/// The Fourier transform of pieces of one length under a taper.
///
/// ```
/// use twinlag_transform::{Tapered, hann};
///
/// // A tone half-way between two bins leaks into all others.
/// let tone: Vec<f64> = (0..256).map(|k| (std::f64::consts::TAU * 20.5 * f64::from(k) / 256.0).cos()).collect();
/// let power_at_60 = |taper: Vec<f64>| {
///     let tapered = Tapered::new(taper);
///     tapered.transform(tone.iter().copied())[60].norm_sqr() / tapered.energy()
/// };
/// // Hann's window divides what leaks 39.5 bins away by its square less 1, 1559, in amplitude.
/// assert!(power_at_60(hann(256)) < 1e-4 * power_at_60(vec![1.0; 256]));
/// ```
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
    ///
    /// ```
    /// let tapered = twinlag_transform::Tapered::new(twinlag_transform::hann(4));
    /// let pieces: Vec<&[i32]> = tapered.halves(&[0, 1, 2, 3, 4, 5, 6, 7, 8]).collect();
    /// assert_eq!(pieces, [[0, 1, 2, 3], [2, 3, 4, 5], [4, 5, 6, 7]]); // 8 would begin a piece that is not full
    /// ```
    pub fn halves<'a, T>(&self, values: &'a [T]) -> impl Iterator<Item = &'a [T]> + use<'a, T> {
        let length = self.taper.len();
        values.windows(length).step_by(length / 2)
    }
}
