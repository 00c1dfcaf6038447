//! Kalman's filter with readings taken one at a time.

use nalgebra::{SMatrix, SVector};

use crate::system::{Step, around};

/// What is known of the state: its mean and covariance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Belief<const D: usize> {
    pub(crate) state: SVector<f64, D>,
    pub(crate) covariance: SMatrix<f64, D, D>,
}

/// What one reading did.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Update<const D: usize> {
    pub(crate) gain: SVector<f64, D>,
    /// The reading less what was expected of it, and the variance of that.
    pub(crate) innovation: f64,
    pub(crate) variance: f64,
}

impl<const D: usize> Belief<D> {
    #[inline(never)]
    pub(crate) fn predict(&mut self, step: &Step<D>) {
        self.state = step.transition * self.state;
        self.covariance = around(&step.transition, &self.covariance) + step.added;
    }

    /// A reading `value` of `reads · z` with white noise of `noise_variance`.
    #[inline(never)]
    pub(crate) fn update(&mut self, reads: &SVector<f64, D>, value: f64, noise_variance: f64) -> Update<D> {
        let row = along(&self.covariance, reads);
        let variance = reads.dot(&row) + noise_variance;
        let gain = row / variance;
        let innovation = value - reads.dot(&self.state);
        self.state += gain * innovation;
        // Symmetric to the last digit, whatever it was before.
        for j in 0..D {
            for i in j..D {
                let both = 0.5 * (self.covariance[(i, j)] + self.covariance[(j, i)]);
                let left = both - row[i] * gain[j];
                self.covariance[(i, j)] = left;
                self.covariance[(j, i)] = left;
            }
        }
        Update { gain, innovation, variance }
    }
}

/// `a x` of an `x` most of which is zero.
#[inline(never)]
pub(crate) fn along<const D: usize>(a: &SMatrix<f64, D, D>, x: &SVector<f64, D>) -> SVector<f64, D> {
    let mut out = SVector::<f64, D>::zeros();
    for (column, share) in a.as_slice().chunks_exact(D).zip(x.iter()).filter(|(_, share)| **share != 0.0) {
        out.iter_mut().zip(column).for_each(|(sum, value)| *sum += share * value);
    }
    out
}
