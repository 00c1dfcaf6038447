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
        let row = self.covariance * reads;
        let variance = reads.dot(&row) + noise_variance;
        let gain = row / variance;
        let innovation = value - reads.dot(&self.state);
        self.state += gain * innovation;
        self.covariance -= gain * row.transpose();
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        Update { gain, innovation, variance }
    }
}
