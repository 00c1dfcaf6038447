//! One trait for every estimator: from two channels to two time constants with their intervals.
//!
//! For studies and comparisons: [`Estimator`] holds the family by name, and an estimator of your
//! own takes part by implementing [`Estimate`]. It only estimates, without checking whether the
//! model is right. To analyse a record use [`crate::characterise()`], which tests the residual,
//! says what is not determined, and finds the hold.

use serde::{Deserialize, Serialize};
use twinlag_cross_relation::{Parameter, Readings};
use twinlag_optimise::{End, Evaluations, Minimiser, Optimiser, Variable};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::vocabulary::{Estimator, IntervalBasis, NoiseKnowledge};
use crate::{assumptions, difference, published, whitened};

/// The input of an estimator.
pub struct Task<'a> {
    /// The two channels.
    pub readings: &'a Readings,
    /// What the gas does between samples.
    pub hold: Discretisation,
    /// What is known about the noise.
    pub noise: NoiseKnowledge,
    /// How costs are minimised.
    pub minimiser: &'a dyn Minimiser,
    /// Time constants to start from, s; the estimator finds its own where there are none.
    pub starts_s: Vec<[f64; 2]>,
    /// Samples left out at the start of each unbroken stretch by the published family; by default ten times the longest time
    /// constant of the whitened estimate, or of the start.
    pub discard: Option<usize>,
    /// The sensors whose second lag is fitted too.
    pub second_order: [bool; 2],
    /// Whether standard errors and intervals are wanted.
    pub intervals: bool,
}

impl<'a> Task<'a> {
    /// `readings` with nothing known, held gas, the default optimiser.
    pub fn new(readings: &'a Readings) -> Self {
        const DEFAULT: Optimiser = Optimiser::LevenbergMarquardt { step_tolerance: 1e-9 };
        Self {
            readings,
            hold: Discretisation::ZeroOrderHold,
            noise: NoiseKnowledge::default(),
            minimiser: &DEFAULT,
            starts_s: Vec::new(),
            discard: None,
            second_order: [false; 2],
            intervals: true,
        }
    }

    /// The variables of a cost with `P` parameters.
    pub(crate) fn variables<const P: usize>(&self) -> Vec<Variable> {
        let (step_s, span_s) = (self.readings.mean_step_s(), self.readings.span_s());
        let held = |name: &str, value: f64| Variable::linear(name, 1.0, value, value);
        let tau = |name: &str, lower: f64, upper: f64| Variable::logarithmic(name, lower * step_s, upper * span_s);
        (0..P)
            .map(|i| match Parameter::ALL[i] {
                Parameter::Tau1 => tau("τ1", 0.2, 10.0),
                Parameter::Tau2 => tau("τ2", 0.2, 10.0),
                Parameter::Gain => held("gain", 1.0),
                Parameter::Offset => held("offset", 0.0),
                Parameter::SecondTau1 if self.second_order[0] => tau("second τ1", 0.05, 1.0),
                Parameter::SecondTau2 if self.second_order[1] => tau("second τ2", 0.05, 1.0),
                Parameter::SecondTau1 | Parameter::SecondTau2 => held("second τ", 0.0),
            })
            .collect()
    }

    /// The given starts as points of `P` parameters; a second lag begins at a fifth of the first.
    pub(crate) fn starts<const P: usize>(&self) -> Vec<Vec<f64>> {
        let second = |i: usize, tau_s: f64| if self.second_order[i] { 0.2 * tau_s } else { 0.0 };
        let point = |t: &[f64; 2]| [t[0], t[1], 1.0, 0.0, second(0, t[0]), second(1, t[1])][..P].to_vec();
        self.starts_s.iter().map(point).collect()
    }
}

/// What an estimator returns. A fit that ran always returns one, however it ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Both time constants, s; of a second-order sensor the larger one.
    pub tau_s: [f64; 2],
    /// Second time constants where they were asked for, s.
    pub second_tau_s: [Option<f64>; 2],
    /// Standard errors of both time constants, s, the uncertainty of found noise levels included. `None` where the fit is no
    /// minimum.
    pub standard_error_s: Option<[f64; 2]>,
    /// 95 % intervals, s.
    pub interval_95_s: Option<[[f64; 2]; 2]>,
    /// How the intervals were found.
    pub interval_basis: [IntervalBasis; 2],
    /// Noise levels that were given or found, K; `None` where nothing needed them.
    pub noise_std_k: Option<[f64; 2]>,
    /// First-order autoregressive coefficients of the noise, 0 for white noise.
    pub noise_ar1: [f64; 2],
    /// How the fit ended.
    pub end: End,
    /// What the cost was asked in all, starts included; zero for estimators in closed form.
    pub evaluations: Evaluations,
}

/// An estimator of two time constants. Implement it to bring one of your own.
pub trait Estimate: Send + Sync {
    /// The name that reports carry.
    fn name(&self) -> String;

    /// Where it comes from.
    fn source(&self) -> &'static str;

    /// What has to hold for it to be consistent.
    fn assumes(&self) -> &'static str;

    /// Both time constants of `task`.
    ///
    /// # Errors
    /// [`EstimateError`] where the question cannot be put: uneven sampling, too few samples, an order it cannot take; `CostError::Singular`
    /// inside it where a closed form has no solution. A fit that ran is never an error.
    fn estimate(&self, task: &Task<'_>) -> Result<Outcome, EstimateError>;
}

impl Estimate for Estimator {
    fn name(&self) -> String {
        (*self).name().into()
    }

    fn source(&self) -> &'static str {
        assumptions::source(*self)
    }

    fn assumes(&self) -> &'static str {
        assumptions::assumes(*self)
    }

    fn estimate(&self, task: &Task<'_>) -> Result<Outcome, EstimateError> {
        let is_second_order = task.second_order != [false; 2];
        if is_second_order && task.readings.even_period_s().is_none() {
            return Err(EstimateError::Unexpected {
                what: "second-order sensors",
                expected: "evenly spaced samples".into(),
                got: "uneven ones".into(),
            });
        }
        match self {
            Self::Whitened if is_second_order => whitened::estimate::<6>(task),
            Self::Whitened => whitened::estimate::<2>(task),
            Self::CrossRelation | Self::BiasCompensated | Self::Normalised | Self::Hybrid => {
                if is_second_order {
                    published::estimate::<6>(*self, task)
                } else {
                    published::estimate::<2>(*self, task)
                }
            }
            Self::DifferenceEquationLs | Self::DifferenceEquationTls | Self::DifferenceEquationGtls => {
                difference::estimate(*self, task)
            }
        }
    }
}
