//! The closed loop on several records of one rig.

use twinlag_diagnose::Masked;
use twinlag_record::Record;

use crate::answers::{Diagnosis, ErrorBeforeAfter};
use crate::error::Error;
use crate::reference::Reference;
use crate::rows::RowOfSample;
use crate::verbs::diagnose::{DiagnoseOptions, answer, settings};
use crate::verbs::several::Several;
use crate::watch::{UNWATCHED, Watch};

/// Finds what two first-order lags leave over in several records of one rig, and which effects account for it in all of them:
/// [`Diagnosis::records`] says what each record has for itself and whether it agrees, [`Diagnosis::transfer`] what the model is
/// worth on a record that had no part in finding it.
///
/// # Errors
/// As [`crate::diagnose`]; [`Error::Model`] for less than two; [`Error::OtherChannels`] for records of other
/// sensors than the first; [`Error::InRecord`] for one that cannot be used.
///
/// ```
#[doc = include_str!("../example.txt")]
/// # let tuesday = record.clone();
/// let answer = twinlag::diagnose_records(&[record, tuesday], &DiagnoseOptions::default())?;
/// assert_eq!(answer.records.len(), 2);
/// let rms = answer.transfer.expect("of several records").error.held_out_normalised_rms;
/// assert!(rms.after < rms.before);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn diagnose_records(records: &[Record], options: &DiagnoseOptions) -> Result<Diagnosis, Error> {
    diagnose_records_watched(records, options, UNWATCHED)
}

/// [`diagnose_records`], with `watch` called as it goes on.
///
/// # Errors
/// As [`diagnose_records`]; [`Error::Cancelled`].
pub fn diagnose_records_watched(
    records: &[Record],
    options: &DiagnoseOptions,
    watch: Watch<'_>,
) -> Result<Diagnosis, Error> {
    options.characterise.check()?;
    let (several, core) = Several::of(records, &settings(options), watch)?;
    let of_sample = RowOfSample::joined(records, &several.rows);
    let reference = Reference::of(&several.joined, &of_sample);
    let reference_rmse_k = reference.and_then(|reference| reference.before_and_after(&core));
    let error = ErrorBeforeAfter { budget: core.error, reference_rmse_k };
    let mut out = answer(&several.joined, options, core, error, |_| ());
    let masked: Vec<Masked> = out.effects.iter_mut().flat_map(|effect| std::mem::take(&mut effect.masked)).collect();
    out.records = several.answers(&out.last, &masked);
    out.transfer = Some(several.transfer());
    Ok(out)
}
