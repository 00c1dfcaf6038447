//! The verdict: status and intervals, or in place of a number that the record does not determine,
//! the reason.

use twinlag_cross_relation::{ResidualTest, ScoreVariance};
use twinlag_diagnose::Reason;
use twinlag_estimate::{Estimator, Hold, Intervals, NoiseLevels, Ridge, Solved, TauIntervals, WhitenedFit};
use twinlag_optimise::{End, Fit};

use super::{Asked, bootstrap};
use crate::answers::{Characterisation, IntervalMethod, Status};
use crate::error::Error;

/// What the residual says of the model.
pub(super) struct Judged {
    pub(super) tests: Vec<ResidualTest>,
    /// Whether they reject the model.
    pub(super) is_rejected: bool,
    /// Whether the whitened estimate determines both time constants, for the estimators that cannot
    /// judge it themselves.
    pub(super) is_determined: bool,
    /// Whether the whitened estimate's residual is noise, for the other estimators.
    pub(super) whitened_is_accepted: bool,
}

/// An answer in the making.
pub(super) struct Conclusion<'q, 'a, const P: usize> {
    pub(super) asked: &'q Asked<'q>,
    /// The whitened fit, which the estimate may be.
    pub(super) fit: &'q WhitenedFit<'a, P>,
    /// Where the estimator that was asked for ended.
    pub(super) solved: Solved<P>,
    /// Its fit, or what stands for one in closed form.
    pub(super) best: Fit,
    pub(super) levels: NoiseLevels,
    pub(super) judged: Judged,
    pub(super) moved_by_hold: Option<[f64; 2]>,
    pub(super) warnings: Vec<String>,
    /// What speaks against what was given.
    pub(super) contradictions: Vec<Reason>,
}

/// The answer that `solved` is, `judged` by what it leaves.
pub(super) fn conclude<const P: usize>(
    asked: &Asked<'_>,
    fit: &WhitenedFit<'_, P>,
    solved: Solved<P>,
    judged: Judged,
    moved_by_hold: Option<[f64; 2]>,
    warnings: Vec<String>,
) -> Result<Characterisation, Error> {
    let best = solved.fit.clone().unwrap_or_else(|| Fit {
        optimiser: "closed-form".into(),
        start: Vec::new(),
        x: solved.theta.to_vec(),
        value: fit.whitened().evaluate(&solved.theta).value,
        end: solved.end.clone(),
        iterations: 0,
        evaluations: solved.evaluations,
    });
    // A cost that was given the ratio alone has found the size of the noise itself.
    let levels = match (asked.options.noise_ratio, solved.noise_std_k) {
        (Some(_), Some(std_k)) => fit.levels().profiled(std_k),
        _ => *fit.levels(),
    };
    Conclusion { asked, fit, solved, best, levels, judged, moved_by_hold, warnings, contradictions: Vec::new() }
        .answer()
}

impl<const P: usize> Conclusion<'_, '_, P> {
    fn answer(mut self) -> Result<Characterisation, Error> {
        let fit = self.fit;
        let theta = self.solved.theta;
        let mut vague = fit.vague(&theta, self.solved.covariance.as_ref());
        let mut answer = None;
        if let (true, true, Some(c)) = (self.solved.end.is_usable(), vague.is_empty(), self.solved.covariance) {
            // What the standard error takes to be determined the profile may not.
            let found = self.intervals(&c);
            vague = (0..2).filter(|&i| !fit.is_held(i) && fit.is_unbounded(i, found.interval_95_s[i])).collect();
            answer = Some((c, found));
        }
        let status = match &self.solved.end {
            End::OnBound(which) if which.iter().any(|&i| i >= 2) => Status::AtBound,
            End::OnBound(_) | End::Stalled(_) | End::LimitReached => Status::NotIdentifiable,
            _ if !self.judged.is_determined || answer.is_none() || !vague.is_empty() => Status::NotIdentifiable,
            _ if self.judged.is_rejected => Status::ModelRejected,
            _ => Status::Ok,
        };
        let mut out = self.skeleton(status);
        let mut used = None;
        if let (Status::Ok | Status::ModelRejected, Some((covariance, intervals))) = (status, answer) {
            self.report(&mut out, &covariance, intervals)?;
            used = Some(covariance);
        } else {
            let found = self.walk(&vague)?;
            self.explain(&mut out, found);
            if found.is_none() && matches!(self.solved.end, End::OnBound(_)) {
                out.status = Status::AtBound;
            }
        }
        self.contradict()?;
        self.judge(&mut out, used.as_ref());
        if !self.contradictions.is_empty() && out.status == Status::Ok {
            out.status = Status::ModelRejected;
        }
        if !self.asked.options.best_effort {
            out.withhold();
        }
        Ok(self.finish(out))
    }

    pub(super) fn is_whitened(&self) -> bool {
        self.asked.options.estimator == Estimator::Whitened
    }

    /// Intervals of both time constants around the estimate.
    fn intervals(&self, covariance: &[[f64; P]; P]) -> TauIntervals {
        if self.is_whitened() {
            self.fit.intervals(covariance, self.asked.options.intervals == Intervals::Profile)
        } else {
            TauIntervals::quadratic(&self.solved.theta, covariance)
        }
    }

    /// Estimates with their intervals.
    fn report(
        &mut self,
        out: &mut Characterisation,
        covariance: &[[f64; P]; P],
        mut intervals: TauIntervals,
    ) -> Result<(), Error> {
        let is_rejected = self.judged.is_rejected;
        out.interval_method = if self.is_whitened() && is_rejected {
            IntervalMethod::ResidualSpectrum
        } else {
            IntervalMethod::Information
        };
        let by_bootstrap = bootstrap::intervals(self.asked, self.fit, &self.solved, is_rejected, &mut self.warnings)?;
        if let Some(by_bootstrap) = by_bootstrap {
            intervals = by_bootstrap;
            out.interval_method = IntervalMethod::Bootstrap;
        }
        self.fill(out, covariance, &intervals);
        self.fill_calibration(out, covariance);
        self.fill_second_lags(out, covariance);
        self.hold_against_knowledge();
        Ok(())
    }

    /// What the record determines along the time constant that is on a bound, or the vaguer one,
    /// whatever the gas does between samples: where the model leaves more than noise, neither hold
    /// can be preferred.
    fn walk(&self, vague: &[usize]) -> Result<Option<(usize, Ridge)>, Error> {
        let on_bound: &[usize] = if let End::OnBound(which) = &self.solved.end { which } else { &[] };
        let index = on_bound.iter().chain(vague).copied().find(|&i| i < 2 && !self.fit.is_held(i));
        let Some(index) = index.filter(|_| self.is_whitened()) else { return Ok(None) };
        let middle = if self.judged.is_rejected { ScoreVariance::ResidualSpectrum } else { ScoreVariance::WhiteNoise };
        let found = self.fit.ridge(index, middle)?;
        if self.asked.options.hold != Hold::Auto {
            return Ok(found.map(|ridge| (index, ridge)));
        }
        let other = self.fit.with_hold(self.fit.other_hold())?.ridge(index, middle)?;
        let union = match (found, other) {
            (Some(a), Some(b)) => Some(a.with(&b)),
            (a, _) => a,
        };
        Ok(union.map(|ridge| (index, ridge)))
    }
}
