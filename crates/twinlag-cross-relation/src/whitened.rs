//! The exact cost: the two inferred gas temperatures compared where noise puts them, not where filters smear it.
//!
//! `u = f1 − f2` is noise alone at the true parameters, a moving average of known covariance `V(θ)`. The cost is
//! `u' V(θ)⁻¹ u` *without* a log-determinant: the gas temperature is a free nuisance, so the scale of `u` carries no
//! information. This is the functional maximum likelihood of the errors-in-variables problem; only the *ratio* of the noise
//! levels moves its minimum. No initial state, no samples to discard.

use num_dual::DualSVec64;
use twinlag_sensor::Discretisation;

use crate::banded;
use crate::error::CostError;
use crate::inverse::width;
use crate::parameters::{CostValue, Pair, parts};
use crate::readings::{Readings, Steps};
use crate::spectral::{Sums, Transformed};

/// How the whitening is computed. Both give the same numbers to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Sine transform, once; then a sum over bins. Even sampling, zero-order hold or bilinear rule.
    Spectral,
    /// Banded Cholesky factorisation at every evaluation. Any sampling and hold.
    Banded,
}

/// Sum of squares of the exactly whitened disagreement of two sensors.
#[derive(Clone, Debug)]
pub struct Whitened<'a> {
    readings: &'a Readings,
    hold: Discretisation,
    noise_std: [f64; 2],
    /// Present in the spectral form: one entry for each segment.
    transformed: Option<Vec<Transformed>>,
    terms: usize,
}

impl<'a> Whitened<'a> {
    /// The cost on `readings` for white noise of `noise_std` `[s1, s2]` (K), in the fastest form there is for them.
    ///
    /// # Errors
    /// [`CostError::NotPositive`] for a noise level, [`CostError::NoDifferenceEquation`],
    /// [`CostError::HoldNeedsEvenSampling`], or [`CostError::TooShort`] if no segment is as long as the inverse is wide.
    pub fn new(readings: &'a Readings, hold: Discretisation, noise_std: [f64; 2]) -> Result<Self, CostError> {
        let even = readings.segments().iter().all(|s| matches!(s.steps(), Steps::Even(_)));
        let form = if even && width(hold) == Some(2) { Form::Spectral } else { Form::Banded };
        Self::with_form(readings, hold, noise_std, form)
    }

    /// As [`Whitened::new`], in a form of the caller's choice.
    ///
    /// # Errors
    /// As [`Whitened::new`], and [`CostError::NoSpectralForm`].
    pub fn with_form(
        readings: &'a Readings,
        hold: Discretisation,
        noise_std: [f64; 2],
        form: Form,
    ) -> Result<Self, CostError> {
        check_noise(noise_std)?;
        let width = width(hold).ok_or(CostError::NoDifferenceEquation)?;
        if width > 2 && readings.segments().iter().any(|s| matches!(s.steps(), Steps::Uneven(_))) {
            return Err(CostError::HoldNeedsEvenSampling);
        }
        let terms = readings.segments().iter().map(|s| (s.len() + 1).saturating_sub(width)).sum();
        if terms == 0 {
            return Err(CostError::TooShort { samples: readings.len(), needed: width });
        }
        let transformed = match form {
            Form::Banded => None,
            Form::Spectral if width > 2 => return Err(CostError::NoSpectralForm),
            Form::Spectral => {
                let each = readings.segments().iter().map(Transformed::new).collect::<Option<_>>();
                Some(each.ok_or(CostError::NoSpectralForm)?)
            }
        };
        Ok(Self { readings, hold, noise_std, transformed, terms })
    }

    /// The same cost for other noise levels, without transforming again.
    ///
    /// # Errors
    /// [`CostError::NotPositive`].
    pub fn with_noise(mut self, noise_std: [f64; 2]) -> Result<Self, CostError> {
        check_noise(noise_std)?;
        self.noise_std = noise_std;
        Ok(self)
    }

    /// Noise standard deviations `[s1, s2]`, K.
    pub fn noise_std(&self) -> [f64; 2] {
        self.noise_std
    }

    /// What the gas is taken to do between samples.
    pub fn hold(&self) -> Discretisation {
        self.hold
    }

    /// The channels.
    pub fn readings(&self) -> &'a Readings {
        self.readings
    }

    /// Number of whitened residuals: for each segment of `n` samples `n − 1` (zero-order hold, bilinear) or `n − 2`.
    pub fn terms(&self) -> usize {
        self.terms
    }

    /// Sum of squares `Σ r²` with its exact gradient and its Gauss-Newton Hessian `2 Σ ∂r ∂r'` at `theta` (the first `P` of
    /// [`crate::Parameter::ALL`], `P` 2 or 4).
    ///
    /// Value and gradient are the same in both forms. The Gauss-Newton matrices belong to different square roots of `V⁻¹` and
    /// differ by terms of the size of the residual.
    ///
    /// With known noise levels the sum is chi-square distributed with about [`Whitened::terms`] less `P` degrees of
    /// freedom at the minimum.
    pub fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        let pair = Pair::variables(theta);
        let mut sums = Sums::ZERO;
        if let Some(segments) = &self.transformed {
            for segment in segments {
                segment.accumulate(self.hold, self.noise_std, &pair, &mut sums);
            }
        } else {
            for segment in self.readings.segments() {
                banded::sweep(segment, self.hold, self.noise_std, &pair, |residual| {
                    let (r, dr) = parts(residual);
                    sums.add(r, &dr);
                });
            }
        }
        CostValue {
            value: sums.squares,
            gradient: sums.gradient.map(|g| 2.0 * g),
            hessian: std::array::from_fn(|i| std::array::from_fn(|j| 2.0 * sums.normal[i.min(j)][i.max(j)])),
        }
    }

    /// The whitened residual in order of time, one vector for each segment: white, of unit variance, if model and noise
    /// levels are right.
    pub fn residual<const P: usize>(&self, theta: &[f64; P]) -> Vec<Vec<f64>> {
        self.jacobian(theta).into_iter().map(|s| s.into_iter().map(|(r, _)| r).collect()).collect()
    }

    /// The whitened residual in order of time with its derivatives `[∂r/∂θ_i]`, one vector for each segment.
    pub fn jacobian<const P: usize>(&self, theta: &[f64; P]) -> Vec<Vec<(f64, [f64; P])>> {
        let pair: Pair<DualSVec64<P>> = Pair::variables(theta);
        let of = |segment| {
            let mut out = Vec::new();
            banded::sweep(segment, self.hold, self.noise_std, &pair, |residual| out.push(parts(residual)));
            out
        };
        self.readings.segments().iter().map(of).collect()
    }

    /// The whitened residual per frequency, from slow to fast, one vector for each segment; `None` in the banded form.
    ///
    /// Bin `j` (from 0) of a segment with `n` bins lies at `(j + 1)/(2 (n + 1) Ts)` Hz.
    pub fn spectrum<const P: usize>(&self, theta: &[f64; P]) -> Option<Vec<Vec<f64>>> {
        let pair: Pair<DualSVec64<P>> = Pair::variables(theta);
        let segments = self.transformed.as_ref()?;
        Some(segments.iter().map(|s| s.residuals(self.hold, self.noise_std, &pair)).collect())
    }
}

fn check_noise(noise_std: [f64; 2]) -> Result<(), CostError> {
    match noise_std.iter().find(|s| !(s.is_finite() && **s > 0.0)) {
        Some(&value) => Err(CostError::NotPositive { name: "noise standard deviation", value }),
        None => Ok(()),
    }
}
