//! One kind of work on many cases, on all processors.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::watch::Stop;

/// The work on each of `cases`, in their order whatever the number of threads; `None` for those
/// that were not begun when the watch asked to stop.
pub(crate) fn in_parallel<Case: Sync, Result: Send>(
    cases: &[Case],
    task: &str,
    stop: &Stop<'_>,
    work: impl Fn(&Case) -> Option<Result> + Sync,
) -> Vec<Option<Result>> {
    let done = AtomicUsize::new(0);
    let reported = |case: &Case| {
        if stop.is_wanted() {
            return None;
        }
        let result = work(case);
        stop.say(task, done.fetch_add(1, Ordering::Relaxed) + 1, cases.len());
        result
    };
    cases.par_iter().map(reported).collect()
}
