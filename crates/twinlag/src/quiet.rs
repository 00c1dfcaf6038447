//! Stretches of a record in which the gas is at rest.

use twinlag_estimate::{MIN_DEGREES_OF_FREEDOM_AT_REST, RunAtRest};
use twinlag_record::Record;

use crate::error::Error;

/// The unbroken runs of `record` that lie in the stretches `quiet_s`, each `[from, to]` in seconds
/// from the start.
///
/// # Errors
/// [`Error::QuietSegment`] for a stretch without enough samples for a noise level.
pub(crate) fn runs<'a>(record: &'a Record, quiet_s: &[[f64; 2]]) -> Result<Vec<RunAtRest<'a>>, Error> {
    let mut runs = Vec::new();
    for [from_s, to_s] in quiet_s {
        let mut degrees_of_freedom = 0;
        for rows in &record.segments {
            let times = &record.time_s[rows.clone()];
            let (from, to) = (times.partition_point(|t| t < from_s), times.partition_point(|t| t <= to_s));
            if from < to {
                let readings = [&record.t1_c, &record.t2_c].map(|y| &y[rows.clone()][from..to]);
                degrees_of_freedom += (to - from).saturating_sub(2);
                runs.push(RunAtRest { time_s: &times[from..to], readings });
            }
        }
        if degrees_of_freedom < MIN_DEGREES_OF_FREEDOM_AT_REST {
            return Err(Error::QuietSegment {
                from_s: *from_s,
                to_s: *to_s,
                last_s: record.time_s.last().copied().unwrap_or(0.0),
                needed: MIN_DEGREES_OF_FREEDOM_AT_REST + 2,
            });
        }
    }
    Ok(runs)
}
