//! The noise of both channels: given, or found from the data.
//!
//! Third differences give a first level, since sensors are low-pass. Once a fit is there, the
//! moments of the inferred inputs ([`NoiseMoments`]) say whether part of that was the signal after
//! all: a level that they put clearly lower is taken from them, the rest stays. They are no
//! substitute, because an effect that the model lacks is in them too, while third differences
//! hardly see it. Autoregressive noise is found from the moments alone.

mod at_rest;
mod coloured;

use twinlag_bias::{JointLevels, NoiseMoments, estimate_noise};
use twinlag_cross_relation::{Readings, inferred_inputs};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::task::{RunAtRest, Task};
use crate::vocabulary::{NoiseColour, NoiseKnowledge, NoiseSource};

use at_rest::LineScatter;
pub use at_rest::MIN_DEGREES_OF_FREEDOM_AT_REST;
use coloured::{MAX_AR1, coloured};

/// A level from the moments is taken where it lies this many standard errors below that of the
/// third differences. One: a signal among the third differences costs more than a level that is a
/// little low one time in six.
const LOWER_BY_STANDARD_ERRORS: f64 = 1.0;
/// Change of a level, relative, or of a coefficient, that counts as none: half the standard error
/// that a coefficient has in 2500 samples.
const SETTLED_CHANGE: f64 = 0.01;
/// A channel that shows no noise at all is given this share of its swing as a level, below the step
/// of a 16-bit converter whose range the swing fills (1.5e-5).
const NOISELESS_STD_PER_SWING: f64 = 1e-5;

/// Noise levels and how well they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct NoiseLevels {
    /// Standard deviations, K.
    pub std_k: [f64; 2],
    /// Where each comes from.
    pub source: [NoiseSource; 2],
    /// Whether they stand, whatever a fit says.
    pub given: bool,
    /// Covariance of the logarithms of the two variances: 0 if given.
    pub log_covariance: [[f64; 2]; 2],
    /// First-order autoregressive coefficients, 0 for white noise.
    pub ar1: [f64; 2],
    /// Step of each converter where it is coarser than the noise, K.
    pub coarse_step_k: [Option<f64>; 2],
    /// Third differences that are too large for noise, in each channel.
    pub outliers: [usize; 2],
    /// Those of them at which the other channel does nothing unusual.
    pub lone_outliers: [usize; 2],
    /// Energy of the residual in units of the levels as found, where these had to be scaled to it.
    pub energy_as_found: Option<f64>,
    /// No level is lower than this: the converter's own noise, or next to nothing.
    least_k: [f64; 2],
}

impl NoiseLevels {
    /// What `task` says of the noise, before any fit: levels that are given; those of runs in which
    /// the gas is at rest; a ratio, with the size of channel 1's third differences until a fit says
    /// better; third differences.
    ///
    /// # Errors
    /// [`EstimateError::Noise`] for too few samples where levels have to be found.
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_estimate::{NoiseLevels, NoiseKnowledge, NoiseSource, Task};
    ///
    /// let found = NoiseLevels::of(&Task::new(&readings))?;
    /// assert_eq!(found.source, [NoiseSource::ThirdDifferences; 2]);
    /// let error_k = found.standard_error_k()[0].expect("found");
    /// assert!((found.std_k[0] - 0.05).abs() < 4.0 * error_k);
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    pub fn of(task: &Task<'_>) -> Result<Self, EstimateError> {
        match task.noise {
            NoiseKnowledge::Known { std_k, ar1 } => Ok(Self::given(std_k, ar1)),
            NoiseKnowledge::Ratio(ratio) => Self::of_ratio(task.readings, ratio),
            NoiseKnowledge::Found(_) if task.at_rest.is_empty() => Self::from_differences(task.readings),
            NoiseKnowledge::Found(colour) => Ok(Self::from_differences(task.readings)?.at_rest(task.at_rest, colour)),
        }
    }

    /// Levels that stand, `[s1, s2]` in K, with autoregressive coefficients.
    pub fn given(std_k: [f64; 2], ar1: [f64; 2]) -> Self {
        Self {
            std_k,
            source: [NoiseSource::Given; 2],
            given: true,
            log_covariance: [[0.0; 2]; 2],
            ar1,
            coarse_step_k: [None; 2],
            outliers: [0; 2],
            lone_outliers: [0; 2],
            energy_as_found: None,
            least_k: [0.0; 2],
        }
    }

    /// Levels of which only the ratio is known: the residual sets the size after the fit.
    fn of_ratio(readings: &Readings, ratio: f64) -> Result<Self, EstimateError> {
        let found = Self::from_differences(readings)?;
        Ok(Self {
            source: [NoiseSource::Residual; 2],
            ..Self::given([found.std_k[0], ratio * found.std_k[0]], [0.0; 2])
        })
    }

    /// These levels with those, and if so asked the coefficients, of runs of samples in which the
    /// gas is at rest: scatter about a straight line in each. At least
    /// [`MIN_DEGREES_OF_FREEDOM_AT_REST`] of them are needed for a level.
    fn at_rest(mut self, runs: &[RunAtRest<'_>], colour: NoiseColour) -> Self {
        for i in 0..2 {
            let mut sums = LineScatter::default();
            runs.iter().for_each(|run| sums.add(run.time_s, run.readings[i]));
            let phi = match colour {
                NoiseColour::White => 0.0,
                NoiseColour::Autoregressive => sums.lag_one().clamp(-MAX_AR1, MAX_AR1),
            };
            self.std_k[i] = sums.std().max(self.least_k[i]);
            self.ar1[i] = phi;
            self.log_covariance[i][i] = 2.0 / sums.degrees_of_freedom * (1.0 + phi * phi) / (1.0 - phi * phi);
        }
        (self.outliers, self.lone_outliers) = ([0; 2], [0; 2]);
        self.source = [NoiseSource::QuietSegment; 2];
        self.given = true;
        self
    }

    /// Standard errors, K; `None` where a level was given, is a bound, or is what the residual
    /// happened to have.
    pub fn standard_error_k(&self) -> [Option<f64>; 2] {
        [0, 1].map(|i| {
            let is_known = self.log_covariance[i][i] > 0.0 && self.energy_as_found.is_none();
            is_known.then(|| 0.5 * self.log_covariance[i][i].sqrt() * self.std_k[i])
        })
    }

    /// These levels, both of them `factor` times as large, since that is what the residual has in
    /// `terms` degrees of freedom.
    pub(crate) fn scaled_to_residual(mut self, factor: f64, terms: f64) -> Self {
        self.std_k = self.std_k.map(|s| s * factor);
        self.source = [NoiseSource::Residual; 2];
        self.log_covariance = [[2.0 / terms; 2]; 2];
        self
    }

    /// Levels of the third differences, no lower than the noise of the converter itself.
    ///
    /// # Errors
    /// [`EstimateError::Noise`] without at least 8 runs of four neighbouring samples.
    pub fn from_differences(readings: &Readings) -> Result<Self, EstimateError> {
        let found = estimate_noise(readings)?;
        let nothing = NOISELESS_STD_PER_SWING * readings.swing();
        let std_k = found.map(|l| l.std_k.max(nothing));
        let log_variance = |i: usize| (2.0 * found[i].standard_error_k / std_k[i]).powi(2);
        Ok(Self {
            std_k,
            source: [NoiseSource::ThirdDifferences; 2],
            given: false,
            log_covariance: [[log_variance(0), 0.0], [0.0, log_variance(1)]],
            ar1: [0.0; 2],
            coarse_step_k: found.map(|l| l.coarse_step_k()),
            outliers: found.map(|l| l.outliers),
            lone_outliers: found.map(|l| l.lone_outliers),
            energy_as_found: None,
            least_k: found.map(|l| l.quantisation_step_k.map_or(nothing, |q| (q / 12.0_f64.sqrt()).max(nothing))),
        })
    }

    /// Relative standard deviation that the uncertainty of the levels gives the energy of a
    /// residual in which the channels' noises have `shares`.
    pub(crate) fn energy_uncertainty(&self, shares: [f64; 2]) -> f64 {
        let variance: f64 =
            (0..2).map(|i| (0..2).map(|j| shares[i] * self.log_covariance[i][j] * shares[j]).sum::<f64>()).sum();
        variance.max(0.0).sqrt()
    }

    /// Whether another round of levels and fit would change nothing: for white noise the levels are
    /// the same, for coloured noise levels and coefficients are to a hundredth.
    pub(crate) fn agrees_with(&self, other: &Self, colour: NoiseColour) -> bool {
        let is_close = (0..2).all(|i| {
            (self.std_k[i] / other.std_k[i] - 1.0).abs() < SETTLED_CHANGE
                && (self.ar1[i] - other.ar1[i]).abs() < SETTLED_CHANGE
        });
        self == other || (colour == NoiseColour::Autoregressive && is_close)
    }

    /// Levels that are the residual's own, whose energy was `energy` in units of the levels as they
    /// were found. Only their ratio is known then, and how well is not.
    pub(crate) fn of_residual(mut self, std_k: [f64; 2], energy: f64) -> Self {
        self.std_k = std_k;
        self.source = [NoiseSource::Residual; 2];
        self.energy_as_found = Some(energy);
        self
    }

    /// Levels that a cost has profiled itself: how well it knows them is not known.
    #[must_use]
    pub fn profiled(mut self, std_k: [f64; 2]) -> Self {
        if std_k != self.std_k {
            (self.std_k, self.log_covariance) = (std_k, [[0.0; 2]; 2]);
        }
        self
    }

    /// Whether the residual's size is the only one there is: a ratio was given, or the levels were
    /// taken from the residual.
    pub fn are_of_the_residual(&self) -> bool {
        self.source[0] == NoiseSource::Residual
    }

    /// Levels in the light of a fit at `theta`. `first` are those of the third differences.
    /// Unchanged where the levels were given, and where there are no moments: uneven sampling,
    /// short stretches.
    pub(crate) fn refined<const P: usize>(
        first: &Self,
        readings: &Readings,
        hold: Discretisation,
        theta: &[f64; P],
        colour: NoiseColour,
    ) -> Self {
        let moments = inferred_inputs(readings, hold, theta).ok().and_then(|inputs| NoiseMoments::new(&inputs));
        let (false, Some(moments)) = (first.given, moments) else { return *first };
        match colour {
            NoiseColour::White => {
                moments.levels(first.std_k, [0.0; 2]).map_or(*first, |joint| first.lowered_to(&joint))
            }
            NoiseColour::Autoregressive => coloured(&moments, first.std_k).map_or(*first, |found| {
                let mut out = Self { ar1: found.ar1, ..*first };
                (0..2).for_each(|i| out.take(&found.levels, i));
                found.by_ar1.iter().for_each(|shift| {
                    (0..2).for_each(|i| (0..2).for_each(|j| out.log_covariance[i][j] += shift[i] * shift[j]));
                });
                out
            }),
        }
    }

    fn lowered_to(&self, joint: &JointLevels) -> Self {
        let mut out = *self;
        let error_k = joint.standard_error_k();
        for i in 0..2 {
            let own_error_k = 0.5 * self.log_covariance[i][i].sqrt() * self.std_k[i];
            if self.std_k[i] - joint.std_k[i] > LOWER_BY_STANDARD_ERRORS * error_k[i].hypot(own_error_k) {
                out.take(joint, i);
            }
        }
        out
    }

    /// Channel `i` as `joint` has it.
    fn take(&mut self, joint: &JointLevels, i: usize) {
        let variance = |k: usize| joint.std_k[k] * joint.std_k[k];
        self.std_k[i] = joint.std_k[i].max(self.least_k[i]);
        self.source[i] = NoiseSource::InferredInputs;
        // A level that is held is known to be small, not how small.
        let relative = if joint.is_held[i] { 0.0 } else { joint.covariance_k4[i][i] / (variance(i) * variance(i)) };
        self.log_covariance[i][i] = relative;
        (self.log_covariance[i][1 - i], self.log_covariance[1 - i][i]) = (0.0, 0.0);
    }
}
