//! The exact cost: the two inferred gas temperatures compared where noise puts them, not where
//! filters smear it.
//!
//! `u = f1 − f2` is noise alone at the true parameters, a moving average of known covariance
//! `V(θ)`. The cost is `u' V(θ)⁻¹ u` *without* a log-determinant: the gas temperature is a free
//! nuisance, so the scale of `u` carries no information. This is the functional maximum likelihood
//! of the errors-in-variables problem; only the *ratio* of the noise levels moves its minimum. No
//! initial state, no samples to discard.

use std::sync::Arc;

use num_dual::DualSVec64;
use twinlag_sensor::Discretisation;

use crate::banded;
use crate::compressed::Compressed;
use crate::error::CostError;
use crate::inverse::{has_inverse, is_one_step, row};
use crate::noise_model::{HoldAndNoise, check_autoregression, check_noise};
use crate::parameters::{CostValue, Pair};
use crate::readings::{Readings, Segment, Steps};
use crate::sandwich::inverse;
use crate::spectral::{self, Sums};
use crate::transform::Transformed;

/// Readings up to which the bins of a record are kept: beyond, the banded form takes less memory than they and no more time.
pub(crate) const MAX_KEPT_BINS: usize = 1 << 19;

/// How the whitening is computed. The first two give the same numbers to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Sine transform, once; then a sum over bins. Even sampling, zero-order hold or bilinear rule,
    /// first-order sensors, white noise.
    Spectral,
    /// Banded Cholesky factorisation at every evaluation. Any sampling, hold, order and noise.
    Banded,
    /// The spectral form with its bins gathered into bands: about a hundred terms for records of
    /// any length, at a known error ([`Whitened::shift_bound`]). For what the spectral form takes.
    Compressed,
}

/// Sum of squares of the exactly whitened disagreement of two sensors.
#[derive(Clone, Debug)]
pub struct Whitened<'a> {
    readings: &'a Readings,
    model: HoldAndNoise,
    /// Present where bins are kept: one entry for each segment.
    transformed: Option<Arc<Vec<Transformed>>>,
    /// Present once they were asked for.
    bands: Option<Arc<Vec<Compressed>>>,
    /// Whether the bands take the place of the bins.
    is_compressed: bool,
}

impl<'a> Whitened<'a> {
    /// The cost on `readings` for white noise of `noise_std` `[s1, s2]` (K), in the fastest exact
    /// form there is for them.
    ///
    /// # Errors
    /// [`CostError::NotPositive`] for a noise level, [`CostError::NoDifferenceEquation`],
    /// [`CostError::HoldNeedsEvenSampling`], or [`CostError::TooShort`] if no segment is as long as
    /// the inverse is wide.
    pub fn new(readings: &'a Readings, hold: Discretisation, noise_std: [f64; 2]) -> Result<Self, CostError> {
        let even = readings.segments().iter().all(|s| matches!(s.steps(), Steps::Even(_)));
        let is_short = readings.len() <= MAX_KEPT_BINS;
        let form =
            if even && hold != Discretisation::FirstOrderHold && is_short { Form::Spectral } else { Form::Banded };
        Self::with_form(readings, hold, noise_std, form)
    }

    /// Creates the cost as [`Whitened::new`] does, in a form of the caller's choice.
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
        if !has_inverse(hold) {
            return Err(CostError::NoDifferenceEquation);
        }
        let needed = if hold == Discretisation::FirstOrderHold { 3 } else { 2 };
        if needed > 2 && readings.segments().iter().any(|s| matches!(s.steps(), Steps::Uneven(_))) {
            return Err(CostError::HoldNeedsEvenSampling);
        }
        if readings.segments().iter().all(|s| s.len() < needed) {
            return Err(CostError::TooShort { samples: readings.len(), needed });
        }
        let transformed: Option<Arc<Vec<Transformed>>> = match form {
            Form::Banded => None,
            Form::Spectral | Form::Compressed if needed > 2 => return Err(CostError::NoSpectralForm),
            Form::Compressed if readings.len() > MAX_KEPT_BINS && readings.even_period_s().is_some() => None,
            Form::Spectral | Form::Compressed => {
                Some(Arc::new(Transformed::all(readings.segments()).ok_or(CostError::NoSpectralForm)?))
            }
        };
        let model = HoldAndNoise::white(hold, noise_std);
        let out = Self { readings, model, transformed, bands: None, is_compressed: false };
        Ok(if form == Form::Compressed { out.compressed(false) } else { out })
    }

    /// This cost with its bins gathered into bands, if it is in the spectral form or its readings are many; unchanged
    /// otherwise.
    ///
    /// Of more than half a million readings the bins are those of pieces of 131 072 samples, and are not kept: that takes one
    /// whitened residual in so many away, and what it moves the minimum by is seen in the gradient of the cost without
    /// compression.
    ///
    /// - `calibration`: whether gain and offset will be asked for (`P` 4), which takes more than
    ///   twice as many sums; without it such questions are answered by the full sum
    #[must_use]
    pub fn compressed(mut self, calibration: bool) -> Self {
        let is_possible = self.model.is_white() && (self.transformed.is_some() || self.is_gathered_in_pieces());
        let serves = |all: &Arc<Vec<Compressed>>| all.iter().all(|bands| bands.has_calibration() || !calibration);
        if is_possible && !self.bands.as_ref().is_some_and(serves) {
            let series = if calibration { 5 } else { 3 };
            let all = match &self.transformed {
                Some(all) => Some(Compressed::of_all(all, series)),
                None => Compressed::of_pieces(self.readings.segments(), series),
            };
            self.bands = all.map(Arc::new);
        }
        self.is_compressed = is_possible && self.bands.is_some();
        self
    }

    /// Whether compression takes the bins of pieces, which are not kept.
    pub fn is_gathered_in_pieces(&self) -> bool {
        let is_one_step = matches!(self.model.hold, Discretisation::ZeroOrderHold | Discretisation::Bilinear);
        let is_even = self.readings.even_period_s().is_some();
        let is_long = self.readings.len() > MAX_KEPT_BINS;
        is_one_step && is_even && is_long && self.model.is_white() && self.transformed.is_none()
    }

    /// This cost without compression.
    #[must_use]
    pub fn exact(mut self) -> Self {
        self.is_compressed = false;
        self
    }

    /// How evaluations at first order are computed.
    pub fn form(&self) -> Form {
        match &self.transformed {
            _ if self.is_compressed => Form::Compressed,
            Some(_) => Form::Spectral,
            None => Form::Banded,
        }
    }

    /// This cost for other noise levels, without transforming again.
    ///
    /// # Errors
    /// [`CostError::NotPositive`].
    pub fn with_noise(mut self, noise_std: [f64; 2]) -> Result<Self, CostError> {
        check_noise(noise_std)?;
        self.model.noise_std = noise_std;
        Ok(self)
    }

    /// This cost, with white noise, for another hold, without transforming again where both take the same transforms;
    /// [`Self::with_autoregression`] comes after it.
    ///
    /// # Errors
    /// As [`Whitened::new`].
    pub fn with_hold(mut self, hold: Discretisation) -> Result<Self, CostError> {
        let is_one_step = |hold| matches!(hold, Discretisation::ZeroOrderHold | Discretisation::Bilinear);
        if self.model.is_white() && (hold == self.model.hold || (is_one_step(hold) && is_one_step(self.model.hold))) {
            (self.model.hold, self.is_compressed) = (hold, false);
            return Ok(self);
        }
        Self::new(self.readings, hold, self.model.noise_std)
    }

    /// This cost for autoregressive noise of each channel, `n[k] = φ1 n[k−1] + φ2 n[k−2] + e[k]`
    /// with white `e`, of order 0 (empty: white), 1 or 2. The noise levels remain standard
    /// deviations of `n`.
    ///
    /// Exact, in the banded form: the equation is multiplied by the whitening filters of both
    /// channels. This costs as many samples as they are long and assumes nothing about the noise
    /// before the record.
    ///
    /// # Errors
    /// [`CostError::Autoregression`] for an order above 2 or noise that is not stationary,
    /// [`CostError::HoldNeedsEvenSampling`] for uneven steps.
    pub fn with_autoregression(mut self, autoregression: [Vec<f64>; 2]) -> Result<Self, CostError> {
        check_autoregression(&autoregression)?;
        if self.readings.segments().iter().any(|s| matches!(s.steps(), Steps::Uneven(_))) {
            return Err(CostError::HoldNeedsEvenSampling);
        }
        self.model.autoregression = autoregression;
        self.is_compressed = false;
        Ok(self)
    }

    /// Coefficients of the noise's autoregression for each channel, empty where it is white.
    pub fn autoregression(&self) -> &[Vec<f64>; 2] {
        &self.model.autoregression
    }

    /// Noise standard deviations `[s1, s2]`, K.
    pub fn noise_std(&self) -> [f64; 2] {
        self.model.noise_std
    }

    /// What the gas is taken to do between samples.
    pub fn hold(&self) -> Discretisation {
        self.model.hold
    }

    /// The channels.
    pub fn readings(&self) -> &'a Readings {
        self.readings
    }

    /// Number of whitened residuals at `theta`: for each segment of `n` samples `n − 1` for
    /// first-order sensors (zero-order hold, bilinear rule), `n − 2` with the first-order hold,
    /// fewer by one or two with second lags or autoregressive noise.
    pub fn terms<const P: usize>(&self, theta: &[f64; P]) -> usize {
        let row = row(&self.model, &Pair::<DualSVec64<P>>::variables(theta), self.readings.mean_step_s());
        let width = row.data[0].as_slice().len();
        self.readings.segments().iter().map(|s| (s.len() + 1).saturating_sub(width)).sum()
    }

    /// Sum of squares `Σ r²` with its exact gradient and its Gauss-Newton Hessian `2 Σ ∂r ∂r'` at
    /// `theta` (the first `P` of [`crate::Parameter::ALL`], `P` 2 or 4).
    ///
    /// Value and gradient are the same in both forms. The Gauss-Newton matrices belong to different
    /// square roots of `V⁻¹` and differ by terms of the size of the residual.
    ///
    /// Infinite for second lags on uneven steps, which have no inverse here.
    ///
    /// With known noise levels the sum is chi-square distributed with about [`Whitened::terms`]
    /// less `P` degrees of freedom at the minimum.
    pub fn evaluate<const P: usize>(&self, theta: &[f64; P]) -> CostValue<P> {
        let pair = Pair::variables(theta);
        if self.has_no_inverse(&pair) {
            return CostValue { value: f64::INFINITY, gradient: [0.0; P], hessian: [[0.0; P]; P] };
        }
        let mut sums = Sums::ZERO;
        match (&self.transformed, &self.bands) {
            (_, Some(all)) if self.is_compressed_at(&pair) => {
                for compressed in all.iter() {
                    compressed.accumulate(&self.model, &pair, &mut sums);
                }
            }
            (Some(segments), _) if is_one_step(&self.model, &pair) => {
                for segment in segments.iter() {
                    spectral::accumulate(segment, &self.model, &pair, &mut sums);
                }
            }
            _ => {
                for segment in self.readings.segments() {
                    banded::sweep(segment, &self.model, &pair, |r, dr| sums.add(r, dr));
                }
            }
        }
        CostValue {
            value: sums.squares,
            gradient: sums.gradient.map(|g| 2.0 * g),
            hessian: std::array::from_fn(|i| std::array::from_fn(|j| 2.0 * sums.normal[i.min(j)][i.max(j)])),
        }
    }

    /// The whitened residual in order of time, one vector for each segment: white, of unit
    /// variance, if model and noise levels are right.
    ///
    /// ```
    #[doc = include_str!("example.txt")]
    /// let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, [0.1, 0.2])?;
    /// let wrong = [0.03, 0.1];
    /// let residual = cost.residual(&wrong);
    /// assert_eq!(residual[0].len(), cost.terms(&wrong));
    /// // Its sum of squares is the cost: two ways to one number, each of some thousand roundings.
    /// let sum: f64 = residual[0].iter().map(|r| r * r).sum();
    /// assert!((sum / cost.evaluate(&wrong).value - 1.0).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn residual<const P: usize>(&self, theta: &[f64; P]) -> Vec<Vec<f64>> {
        let pair: Pair<DualSVec64<P>> = Pair::variables(theta);
        if self.has_no_inverse(&pair) {
            return Vec::new();
        }
        let of = |segment: &Segment| {
            let mut out = Vec::with_capacity(segment.len());
            banded::sweep(segment, &self.model, &pair, |r, _: &[f64; 0]| out.push(r));
            out
        };
        self.readings.segments().iter().map(of).collect()
    }

    /// The whitened residual in order of time with its derivatives `[∂r/∂θ_i]`, one vector for each
    /// segment.
    pub fn jacobian<const P: usize>(&self, theta: &[f64; P]) -> Vec<Vec<(f64, [f64; P])>> {
        let pair: Pair<DualSVec64<P>> = Pair::variables(theta);
        if self.has_no_inverse(&pair) {
            return Vec::new();
        }
        let of = |segment: &Segment| {
            let mut out = Vec::with_capacity(segment.len());
            banded::sweep(segment, &self.model, &pair, |r, dr| out.push((r, *dr)));
            out
        };
        self.readings.segments().iter().map(of).collect()
    }

    /// The whitened residual per frequency, from slow to fast, one vector for each segment; `None`
    /// in the banded form.
    ///
    /// Bin `j` (from 0) of a segment with `n` bins lies at `(j + 1)/(2 (n + 1) Ts)` Hz.
    pub fn spectrum<const P: usize>(&self, theta: &[f64; P]) -> Option<Vec<Vec<f64>>> {
        let pair: Pair<DualSVec64<P>> = Pair::variables(theta);
        let segments = self.transformed.as_ref().filter(|_| is_one_step(&self.model, &pair))?;
        Some(segments.iter().map(|s| spectral::residuals(s, &self.model, &pair)).collect())
    }

    /// Whether the steps are uneven and the inverse looks further than one of them.
    pub(crate) fn has_no_inverse<D>(&self, pair: &Pair<D>) -> bool {
        !is_one_step(&self.model, pair)
            && self.readings.segments().iter().any(|s| matches!(s.steps(), Steps::Uneven(_)))
    }

    fn is_compressed_at<const P: usize>(&self, pair: &Pair<DualSVec64<P>>) -> bool {
        let serves = |c: &Compressed| P == 2 || c.has_calibration();
        self.is_compressed
            && is_one_step(&self.model, pair)
            && self.bands.as_ref().is_some_and(|all| all.iter().all(serves))
    }

    /// How far compression can have moved each of the `free` parameters from the minimum of the
    /// full sum, at most, in standard errors (those of the information at `theta`); zeros where
    /// nothing is compressed.
    ///
    /// `|A⁻¹ δ| / √A⁻¹_ii`, worst signs, with `A` half the Hessian and `δ` the bound on what
    /// interpolation changes of half the gradient. Where the information is singular it is
    /// infinite.
    pub fn shift_bound<const P: usize>(&self, theta: &[f64; P], free: &[usize]) -> [f64; P] {
        let pair: Pair<DualSVec64<P>> = Pair::variables(theta);
        let mut out = [0.0; P];
        let (Some(all), true) = (&self.bands, self.is_compressed_at(&pair)) else { return out };
        let mut gradient = [0.0; P];
        for compressed in all.iter() {
            compressed.gradient_error(&self.model, &pair, &mut gradient);
        }
        let half = self.evaluate(theta).hessian.map(|row| row.map(|h| 0.5 * h));
        let covariance = inverse(&half, free);
        for &i in free {
            out[i] = covariance.map_or(f64::INFINITY, |c| {
                free.iter().map(|&j| (c[i][j] * gradient[j]).abs()).sum::<f64>() / c[i][i].sqrt()
            });
        }
        out
    }

    pub(crate) fn model(&self) -> &HoldAndNoise {
        &self.model
    }
}
