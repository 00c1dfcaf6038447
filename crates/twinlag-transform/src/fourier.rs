//! The discrete Fourier transform of a real series, and back: `X[j] = Σ_k x[k] e^(−2πi jk/n)`,
//! `j = 0 … ⌊n/2⌋`, the other half of the spectrum being its complex conjugate. Neither direction
//! is scaled: there and back multiplies by `n`.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use crate::kept::Kept;

/// The transform of real series of one length into their spectra.
#[derive(Clone)]
pub struct Forward(Arc<dyn RealToComplex<f64>>);

impl Forward {
    /// The transform of series of `samples` values.
    pub fn of(samples: usize) -> Self {
        Self(forward(samples))
    }

    /// As [`Forward::of`], of a plan that is not kept: for series as long as a record, whose plan takes three times its memory.
    pub fn once(samples: usize) -> Self {
        Self(RealFftPlanner::new().plan_fft_forward(samples))
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
        Self(inverse(samples))
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

/// The plan to transform `samples` values. What panics while it plans leaves the store as it was: a
/// poisoned lock is no harm.
fn forward(samples: usize) -> Arc<dyn RealToComplex<f64>> {
    static KEPT: Mutex<Kept<dyn RealToComplex<f64>>> = Mutex::new(Kept(Vec::new()));
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.get(samples, || RealFftPlanner::new().plan_fft_forward(samples))
}

/// The plan back to `samples` values.
fn inverse(samples: usize) -> Arc<dyn ComplexToReal<f64>> {
    static KEPT: Mutex<Kept<dyn ComplexToReal<f64>>> = Mutex::new(Kept(Vec::new()));
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.get(samples, || RealFftPlanner::new().plan_fft_inverse(samples))
}
