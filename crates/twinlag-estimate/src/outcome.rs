//! What an estimator returns.

use serde::{Deserialize, Serialize};
use twinlag_optimise::{End, Evaluations, Fit};

use crate::intervals::TauIntervals;
use crate::vocabulary::IntervalBasis;

/// What an estimator returns. A fit that ran always returns one, however it ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Both time constants, s; of a second-order sensor the larger one.
    pub tau_s: [f64; 2],
    /// Second time constants where they were asked for and are seen, s.
    pub second_tau_s: [Option<f64>; 2],
    /// Standard errors of both time constants, s, the uncertainty of found noise levels included.
    /// `None` where the fit is no minimum.
    pub standard_error_s: Option<[f64; 2]>,
    /// 95 % intervals, s.
    pub interval_95_s: Option<[[f64; 2]; 2]>,
    /// What the intervals rest on.
    pub interval_basis: [IntervalBasis; 2],
    /// Noise levels that the estimate rests on, K; `None` where nothing needed them. Levels that
    /// were not given have the size of the residual.
    pub noise_std_k: Option<[f64; 2]>,
    /// First-order autoregressive coefficients of the noise, 0 for white noise.
    pub noise_ar1: [f64; 2],
    /// How the fit ended.
    pub end: End,
    /// What the cost was asked in all, starts included; zero for estimators in closed form.
    pub evaluations: Evaluations,
}

/// Where an estimator of `P` parameters ended, for whoever wants more of it than an [`Outcome`].
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Solved<const P: usize> {
    /// The parameters, in the order of [`twinlag_cross_relation::Parameter::ALL`].
    pub theta: [f64; P],
    /// Their covariance, zero for what is held; `None` where the end is no minimum, or was not
    /// wanted.
    pub covariance: Option<[[f64; P]; P]>,
    /// Noise levels that the estimate rests on, K.
    pub noise_std_k: Option<[f64; 2]>,
    /// First-order autoregressive coefficients of the noise.
    pub noise_ar1: [f64; 2],
    /// How it ended.
    pub end: End,
    /// The fit that the estimate is; `None` in closed form.
    pub fit: Option<Fit>,
    /// Number of its starts; 0 in closed form.
    pub starts: usize,
    /// What costs were asked in all, on the way to it as well.
    pub evaluations: Evaluations,
    /// Samples that were left out at the start of each unbroken stretch.
    pub discarded: usize,
}

impl<const P: usize> Solved<P> {
    /// The outcome, with intervals that are quadratic in the logarithm.
    pub fn outcome(&self) -> Outcome {
        let is_usable = self.end.is_usable();
        let intervals = self.covariance.filter(|_| is_usable).map(|c| TauIntervals::quadratic(&self.theta, &c));
        self.outcome_with(intervals)
    }

    /// The outcome with these intervals.
    pub(crate) fn outcome_with(&self, intervals: Option<TauIntervals>) -> Outcome {
        let second = |i: usize| self.theta.get(i).copied().filter(|t| *t > 0.0);
        Outcome {
            tau_s: [self.theta[0], self.theta[1]],
            second_tau_s: [second(4), second(5)],
            standard_error_s: intervals.map(|i| i.standard_error_s),
            interval_95_s: intervals.map(|i| i.interval_95_s),
            interval_basis: intervals.map_or([IntervalBasis::StandardError; 2], |i| i.basis),
            noise_std_k: self.noise_std_k,
            noise_ar1: self.noise_ar1,
            end: self.end.clone(),
            evaluations: self.evaluations,
        }
    }
}
