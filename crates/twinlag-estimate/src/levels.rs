//! The noise of both channels: given, or found from the data.
//!
//! Third differences give a first level, since sensors are low-pass. Once a fit is there, the moments of the inferred inputs
//! ([`NoiseMoments`]) say whether part of that was the signal after all: a level that they put clearly lower is taken from
//! them, the rest stays. They are no substitute, because an effect that the model lacks is in them too, while third
//! differences hardly see it. Autoregressive noise is found from the moments alone.

use nalgebra::Matrix2;
use twinlag_bias::{JointLevels, NoiseLevel, NoiseMoments, estimate_noise};
use twinlag_cross_relation::{Readings, inferred_inputs};
use twinlag_optimise::{Budget, Cost, Minimiser, Optimiser, Problem, Variable};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::vocabulary::{NoiseColour, NoiseSource};

/// A converter whose own noise `q/√12` is this share of the level is coarse: its errors are not white.
const COARSE: f64 = 0.7;
/// A level from the moments must lie this many standard errors below the third differences' to be taken. One: a signal among the
/// third differences costs more than a level that is a little low one time in six.
const CLEARLY_LOWER: f64 = 1.0;
/// Largest autoregressive coefficient that is looked for.
const MOST_COLOURED: f64 = 0.97;
/// Degrees of freedom, samples less two, that a stretch at rest must have: its level is then good to a quarter.
pub const MIN_DEGREES_OF_FREEDOM_AT_REST: usize = 8;
/// Step of a coefficient in differences.
const AR1_STEP: f64 = 0.01;
/// Change of a level, relative, or of a coefficient, below which it has settled.
const SETTLED: f64 = 0.01;
/// Rounds of weights and coefficients.
const ROUNDS: usize = 3;

/// Noise levels and how well they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    pub std_k: [f64; 2],
    /// Where each level comes from.
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
    /// Energy of the residual in units of the levels as found, where these had to be scaled to it.
    pub energy_as_found: Option<f64>,
    /// No level is lower than this: the converter's own noise, or next to nothing.
    least_k: [f64; 2],
}

impl Levels {
    pub fn given(std_k: [f64; 2], ar1: [f64; 2]) -> Self {
        Self {
            std_k,
            source: [NoiseSource::Given; 2],
            given: true,
            log_covariance: [[0.0; 2]; 2],
            ar1,
            coarse_step_k: [None; 2],
            outliers: [0; 2],
            energy_as_found: None,
            least_k: [0.0; 2],
        }
    }

    /// Levels of which only the ratio is known: the residual sets the size after the fit.
    pub fn of_ratio(readings: &Readings, ratio: f64) -> Result<Self, EstimateError> {
        let found = Self::from_differences(readings)?;
        Ok(Self {
            source: [NoiseSource::Residual; 2],
            ..Self::given([found.std_k[0], ratio * found.std_k[0]], [0.0; 2])
        })
    }

    /// These levels with those, and if so asked the coefficients, of runs of samples in which the gas is at rest: scatter about
    /// a straight line in each. At least [`MIN_DEGREES_OF_FREEDOM_AT_REST`] of them are needed for a level.
    pub fn at_rest(mut self, runs: &[RunAtRest<'_>], colour: NoiseColour) -> Self {
        for i in 0..2 {
            let mut sums = LineScatter::default();
            runs.iter().for_each(|run| sums.add(run.time_s, run.readings[i]));
            let phi = match colour {
                NoiseColour::White => 0.0,
                NoiseColour::Autoregressive => sums.lag_one().clamp(-MOST_COLOURED, MOST_COLOURED),
            };
            self.std_k[i] = sums.std().max(self.least_k[i]);
            self.ar1[i] = phi;
            self.log_covariance[i][i] = 2.0 / sums.degrees_of_freedom * (1.0 + phi * phi) / (1.0 - phi * phi);
        }
        self.outliers = [0; 2];
        self.source = [NoiseSource::QuietSegment; 2];
        self.given = true;
        self
    }

    /// Standard errors, K; `None` where a level was given, is a bound, or is what the residual happened to have.
    pub fn standard_error_k(&self) -> [Option<f64>; 2] {
        [0, 1].map(|i| {
            let is_known = self.log_covariance[i][i] > 0.0 && self.energy_as_found.is_none();
            is_known.then(|| 0.5 * self.log_covariance[i][i].sqrt() * self.std_k[i])
        })
    }

    /// These levels, all of them `factor` times as large, since that is what the residual has in
    /// `terms` degrees of freedom.
    pub fn scaled_to_residual(mut self, factor: f64, terms: f64) -> Self {
        self.std_k = self.std_k.map(|s| s * factor);
        self.source = [NoiseSource::Residual; 2];
        self.log_covariance = [[2.0 / terms; 2]; 2];
        self
    }

    /// From third differences.
    pub fn from_differences(readings: &Readings) -> Result<Self, EstimateError> {
        let found = estimate_noise(readings)?;
        let coarse = |l: &NoiseLevel| l.quantisation_step_k.filter(|q| q / 12.0_f64.sqrt() > COARSE * l.std_k);
        // A channel without any noise at all: a hundred-thousandth of its swing stands in, far below any converter's step.
        let nothing = 1e-5 * readings.swing();
        let std_k = found.map(|l| l.std_k.max(nothing));
        let log_variance = |i: usize| (2.0 * found[i].standard_error_k / std_k[i]).powi(2);
        Ok(Self {
            std_k,
            source: [NoiseSource::ThirdDifferences; 2],
            given: false,
            log_covariance: [[log_variance(0), 0.0], [0.0, log_variance(1)]],
            ar1: [0.0; 2],
            coarse_step_k: [coarse(&found[0]), coarse(&found[1])],
            outliers: found.map(|l| l.outliers),
            energy_as_found: None,
            least_k: found.map(|l| l.quantisation_step_k.map_or(nothing, |q| (q / 12.0_f64.sqrt()).max(nothing))),
        })
    }

    /// Relative standard deviation that the uncertainty of the levels gives the energy of a residual in which the channels' noises
    /// have `shares`.
    pub fn energy_uncertainty(&self, shares: [f64; 2]) -> f64 {
        let variance: f64 =
            (0..2).map(|i| (0..2).map(|j| shares[i] * self.log_covariance[i][j] * shares[j]).sum::<f64>()).sum();
        variance.max(0.0).sqrt()
    }

    /// Whether another round of levels and fit would change nothing: for white noise the levels are the same, for coloured noise
    /// levels and coefficients are to a hundredth.
    pub fn agrees_with(&self, other: &Self, colour: NoiseColour) -> bool {
        let is_close = (0..2).all(|i| {
            (self.std_k[i] / other.std_k[i] - 1.0).abs() < SETTLED && (self.ar1[i] - other.ar1[i]).abs() < SETTLED
        });
        self == other || (colour == NoiseColour::Autoregressive && is_close)
    }

    /// Levels in the light of a fit at `theta`. `first` are those of the third differences. Unchanged where the levels were
    /// given, and where there are no moments: uneven sampling, short stretches.
    pub fn refined<const P: usize>(
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
            if self.std_k[i] - joint.std_k[i] > CLEARLY_LOWER * error_k[i].hypot(own_error_k) {
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

/// An unbroken run of samples in which the gas is at rest.
#[derive(Clone, Copy, Debug)]
pub struct RunAtRest<'a> {
    /// When they were taken, s, `[n]`.
    pub time_s: &'a [f64],
    /// Both channels, °C, `[n]` each.
    pub readings: [&'a [f64]; 2],
}

/// Sums of squares about a straight line, and of products of neighbours.
#[derive(Default)]
struct LineScatter {
    squares: f64,
    products: f64,
    degrees_of_freedom: f64,
}

impl LineScatter {
    fn add(&mut self, times: &[f64], y: &[f64]) {
        let n = times.len() as f64;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
        let (t0, y0) = (mean(times), mean(y));
        let moment: f64 = times.iter().map(|t| (t - t0) * (t - t0)).sum();
        let slope = if moment > 0.0 {
            times.iter().zip(y).map(|(t, y)| (t - t0) * (y - y0)).sum::<f64>() / moment
        } else {
            0.0
        };
        let left: Vec<f64> = times.iter().zip(y).map(|(t, y)| y - y0 - slope * (t - t0)).collect();
        self.squares += left.iter().map(|r| r * r).sum::<f64>();
        self.products += left.windows(2).map(|w| w[0] * w[1]).sum::<f64>();
        self.degrees_of_freedom += (n - 2.0).max(0.0);
    }

    fn std(&self) -> f64 {
        (self.squares / self.degrees_of_freedom).sqrt()
    }

    fn lag_one(&self) -> f64 {
        if self.squares > 0.0 { self.products / self.squares } else { 0.0 }
    }
}

/// The misfit of the moments as a function of both coefficients.
struct Misfit<'a> {
    moments: &'a NoiseMoments,
    std_k: [f64; 2],
    weighing_ar1: [f64; 2],
}

impl Cost for Misfit<'_> {
    fn value(&self, x: &[f64]) -> f64 {
        let levels = self.moments.levels_weighed(self.std_k, self.weighing_ar1, [x[0], x[1]]);
        levels.map_or(f64::INFINITY, |l| l.misfit)
    }
}

/// Autoregressive noise as the moments show it.
struct Coloured {
    levels: JointLevels,
    ar1: [f64; 2],
    /// How the logarithms of both variances shift for either principal standard error of the coefficients.
    by_ar1: [[f64; 2]; 2],
}

/// Levels and coefficients of autoregressive noise.
fn coloured(moments: &NoiseMoments, start_std_k: [f64; 2]) -> Option<Coloured> {
    let (mut levels, mut ar1) = (moments.levels(start_std_k, [0.0; 2])?, [0.0; 2]);
    let simplex = Optimiser::NelderMead { spread_tolerance: 1e-7, edge: 0.3 };
    for _ in 0..ROUNDS {
        let misfit = Misfit { moments, std_k: levels.std_k, weighing_ar1: ar1 };
        let variable = |name: &str| Variable::linear(name, 1.0, -MOST_COLOURED, MOST_COLOURED);
        let problem = Problem::new(&misfit, vec![variable("T1.ar1"), variable("T2.ar1")]).ok()?;
        let fit = simplex.minimise(&problem, &ar1, &Budget::default()).ok()?;
        ar1 = [fit.x[0], fit.x[1]];
        levels = moments.levels(levels.std_k, ar1)?;
    }
    Some(Coloured { by_ar1: by_ar1(moments, &levels, ar1).unwrap_or([[0.0; 2]; 2]), levels, ar1 })
}

/// `∂ln s²/∂φ` times the Cholesky factor of the coefficients' covariance, which is the inverse of half the misfit's Hessian; by
/// differences.
fn by_ar1(moments: &NoiseMoments, levels: &JointLevels, ar1: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let at =
        |d1: f64, d2: f64| moments.levels_weighed(levels.std_k, ar1, [ar1[0] + d1 * AR1_STEP, ar1[1] + d2 * AR1_STEP]);
    let (up, down) = ([at(1.0, 0.0)?, at(0.0, 1.0)?], [at(-1.0, 0.0)?, at(0.0, -1.0)?]);
    let here = at(0.0, 0.0)?.misfit;
    let own = |k: usize| (up[k].misfit - 2.0 * here + down[k].misfit) / (2.0 * AR1_STEP * AR1_STEP);
    let mixed = (at(1.0, 1.0)?.misfit - at(1.0, -1.0)?.misfit - at(-1.0, 1.0)?.misfit + at(-1.0, -1.0)?.misfit)
        / (8.0 * AR1_STEP * AR1_STEP);
    let covariance = Matrix2::new(own(0), mixed, mixed, own(1)).cholesky()?.inverse();
    let factor = covariance.cholesky()?.l();
    let slope = |i: usize, k: usize| 2.0 * (up[k].std_k[i] / down[k].std_k[i]).ln() / (2.0 * AR1_STEP);
    Some([0, 1].map(|column| [0, 1].map(|i| (0..2).map(|k| slope(i, k) * factor[(k, column)]).sum())))
}
