//! The discrete Fourier transform of a real series, and back: `X[j] = Σ_k x[k] e^(−2πi jk/n)`,
//! `j = 0 … ⌊n/2⌋`, the other half of the spectrum being its complex conjugate. Neither direction
//! is scaled: there and back multiplies by `n`.

use std::fmt;
use std::sync::Arc;

use num_complex::Complex64;
use realfft::{ComplexToReal, RealToComplex};

use crate::store;

/// The transform of real series of one length into their spectra.
#[derive(Clone)]
pub struct Forward(Arc<dyn RealToComplex<f64>>);

impl Forward {
    /// The transform of series of `samples` values.
    pub fn of(samples: usize) -> Self {
        Self(store::forward(samples))
    }

    /// Values that go in.
    pub fn samples(&self) -> usize {
        self.0.len()
    }

    /// Values that come out, `⌊samples/2⌋ + 1`.
    pub fn bins(&self) -> usize {
        self.0.complex_len()
    }

    /// The spectrum `[bins]` of `values`, which are taken for zero beyond their end.
    ///
    /// # Panics
    /// If there are more values than [`Self::samples`].
    pub fn transform(&self, values: &[f64]) -> Vec<Complex64> {
        let mut input = vec![0.0; self.samples()];
        input[..values.len()].copy_from_slice(values);
        let mut spectrum = vec![Complex64::ZERO; self.bins()];
        self.transform_into(&mut input, &mut spectrum, &mut Vec::new());
        spectrum
    }

    /// The spectrum of `values` `[samples]`, which are overwritten, in `spectrum` `[bins]`.
    /// `scratch` grows as needed: called with what an earlier call has left there, this allocates
    /// nothing.
    ///
    /// # Panics
    /// If a length is another.
    pub fn transform_into(&self, values: &mut [f64], spectrum: &mut [Complex64], scratch: &mut Vec<Complex64>) {
        scratch.resize(self.0.get_scratch_len(), Complex64::ZERO);
        self.0.process_with_scratch(values, spectrum, scratch).expect("as many values and bins as the transform has");
    }
}

impl fmt::Debug for Forward {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Forward").field(&self.samples()).finish()
    }
}

/// The transform of spectra of real series of one length into these series, multiplied by their
/// length.
#[derive(Clone)]
pub struct Inverse(Arc<dyn ComplexToReal<f64>>);

impl Inverse {
    /// The transform into series of `samples` values.
    pub fn of(samples: usize) -> Self {
        Self(store::inverse(samples))
    }

    /// Values that come out.
    pub fn samples(&self) -> usize {
        self.0.len()
    }

    /// Values that go in, `⌊samples/2⌋ + 1`.
    pub fn bins(&self) -> usize {
        self.0.complex_len()
    }

    /// The series `[samples]` of `spectrum` `[bins]`, times the number of samples. The imaginary
    /// part that a real series cannot have, at zero frequency and at half the sampling frequency,
    /// is left out.
    ///
    /// # Panics
    /// If `spectrum` has another length than [`Self::bins`].
    pub fn transform(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        spectrum[0].im = 0.0;
        if self.samples().is_multiple_of(2) {
            let last = spectrum.len() - 1;
            spectrum[last].im = 0.0;
        }
        let mut values = vec![0.0; self.samples()];
        self.0.process(&mut spectrum, &mut values).expect("as many bins as the transform has, real where they must be");
        values
    }
}

impl fmt::Debug for Inverse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Inverse").field(&self.samples()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(n: usize) -> Vec<f64> {
        (0..n).map(|k| (1.3 * k as f64).sin() + 0.2 * (0.7 * (k * k) as f64).cos()).collect()
    }

    /// Lengths even, odd, prime and composite, against the sum itself; `n` terms of at most 1.2,
    /// each to `n` roundings of the angle.
    #[test]
    fn spectrum_is_the_sum_that_defines_it() {
        for n in [1, 2, 3, 4, 7, 12, 97, 100, 256, 1031] {
            let x = series(n);
            let got = Forward::of(n).transform(&x);
            assert_eq!(got.len(), n / 2 + 1);
            for (j, got) in got.iter().enumerate() {
                let term = |k: usize| x[k] * Complex64::cis(-std::f64::consts::TAU * ((j * k) % n) as f64 / n as f64);
                let want: Complex64 = (0..n).map(term).sum();
                let tol = 4.0 * n as f64 * f64::EPSILON;
                assert!((got - want).norm() < tol, "{n}, bin {j}: got {got}, want {want} ± {tol:e}");
            }
        }
    }

    #[test]
    fn there_and_back_multiplies_by_the_length() {
        for n in [1, 2, 5, 64, 105] {
            let x = series(n);
            let back = Inverse::of(n).transform(Forward::of(n).transform(&x));
            for (got, want) in back.iter().zip(&x) {
                let tol = 4.0 * (n as f64) * f64::EPSILON;
                assert!((got / n as f64 - want).abs() < tol, "{n}: got {}, want {want} ± {tol:e}", got / n as f64);
            }
        }
    }

    #[test]
    fn what_no_real_series_has_is_left_out() {
        let with_imaginary_ends = vec![Complex64::new(1.0, 9.0), Complex64::new(0.5, 0.5), Complex64::new(2.0, -9.0)];
        let without = vec![Complex64::new(1.0, 0.0), Complex64::new(0.5, 0.5), Complex64::new(2.0, 0.0)];
        let inverse = Inverse::of(4);
        assert_eq!(inverse.transform(with_imaginary_ends), inverse.transform(without));
    }

    /// Short of the length, and into buffers of the caller's: to the bit what the plain call gives.
    #[test]
    fn missing_values_are_zeros_and_buffers_may_be_used_again() {
        let plan = Forward::of(10);
        let mut padded = series(7);
        padded.resize(10, 0.0);
        let want = plan.transform(&padded);
        assert_eq!(plan.transform(&series(7)), want);
        let (mut spectrum, mut scratch) = (vec![Complex64::ZERO; plan.bins()], Vec::new());
        for _ in 0..2 {
            plan.transform_into(&mut padded.clone(), &mut spectrum, &mut scratch);
            assert_eq!(spectrum, want);
        }
    }
}
