//! Intervals by the bootstrap, which reports replicate by replicate and can be cancelled.

use std::sync::atomic::{AtomicUsize, Ordering};

use twinlag_estimate::{
    Bootstrap, Estimate, EstimateError, Estimator, IntervalBasis, Intervals, Outcome, Solved, Task, TauIntervals,
    WhitenedFit,
};

use super::Asked;
use crate::error::Error;
use crate::watch::Stop;

/// Intervals by the bootstrap around `solved`, which has a covariance; `None` where it was not
/// asked for or says nothing, the latter with a warning.
pub(super) fn intervals<const P: usize>(
    asked: &Asked<'_>,
    fit: &WhitenedFit<'_, P>,
    solved: &Solved<P>,
    is_rejected: bool,
    warnings: &mut Vec<String>,
) -> Result<Option<TauIntervals>, Error> {
    let Intervals::Bootstrap(bootstrap) = asked.options.intervals else { return Ok(None) };
    if is_rejected {
        warnings.push(
            "the bootstrap simulates records with the model, which this record contradicts, so \
                     it was not used for the intervals"
                .into(),
        );
        return Ok(None);
    }
    let estimator = asked.options.estimator;
    let watched = Watched { estimator, done: AtomicUsize::new(0), bootstrap, stop: asked.stop };
    let outcome = solved.outcome();
    let interval_95_s = bootstrap.intervals(&watched, &fit.task_of_replicates(), &outcome)?;
    let (Some(standard_error_s), Some(interval_95_s)) = (outcome.standard_error_s, interval_95_s) else {
        warnings.push(
            "more than a tenth of the simulated records have no answer, so the bootstrap gives \
                     no intervals; these are from standard errors"
                .into(),
        );
        return Ok(None);
    };
    Ok(Some(TauIntervals { standard_error_s, interval_95_s, basis: [IntervalBasis::Bootstrap; 2] }))
}

/// An estimator that counts what it is asked.
struct Watched<'a> {
    estimator: Estimator,
    done: AtomicUsize,
    bootstrap: Bootstrap,
    stop: &'a Stop<'a>,
}

impl Estimate for Watched<'_> {
    fn name(&self) -> String {
        Estimate::name(&self.estimator)
    }

    fn source(&self) -> &'static str {
        self.estimator.source()
    }

    fn assumes(&self) -> &'static str {
        self.estimator.assumes()
    }

    fn estimate(&self, task: &Task<'_>) -> Result<Outcome, EstimateError> {
        if self.stop.is_wanted() {
            return Err(EstimateError::Cancelled);
        }
        let outcome = self.estimator.estimate(task);
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.stop.say("simulated records of the bootstrap", done, self.bootstrap.replicates);
        outcome
    }
}
