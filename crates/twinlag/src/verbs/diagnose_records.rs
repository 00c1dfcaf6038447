//! The closed loop on several records of one rig.

use twinlag_diagnose::{JointDiagnosis, Masked, ModelError, Observations, diagnose_records as close_the_loop};
use twinlag_record::Record;

use crate::answers::{Diagnosis, ErrorBeforeAfter, LeftOutUnit, RecordAnswer, TransferAnswer};
use crate::error::Error;
use crate::reference::Reference;
use crate::rows::{RowOfSample, Rows};
use crate::verbs::diagnose::{DiagnoseOptions, answer, settings};
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
    let first = records.first().map(|record| record.channels.clone());
    if let Some(other) = records.iter().find(|record| Some(&record.channels) != first.as_ref()) {
        let (expected, found) = (first.unwrap_or_default(), other.channels.clone());
        return Err(Error::OtherChannels { file: other.source.clone(), expected, found });
    }
    let rows_of = |record: &Record| {
        Rows::of(record).map_err(|error| Error::InRecord { file: record.source.clone(), error: Box::new(error) })
    };
    let rows: Vec<Rows> = records.iter().map(rows_of).collect::<Result<_, _>>()?;
    let observations: Vec<Observations> = rows.iter().map(|rows| rows.observations.clone()).collect();
    let joint = close_the_loop(&observations, &settings(options), watch)?;
    let joined = in_a_row(records, &observations)?;
    let JointDiagnosis { diagnosis: core, records: of_records, transfer, .. } = joint;
    let of_sample = RowOfSample::joined(records, &rows);
    let reference = Reference::of(&joined, &of_sample);
    let reference_rmse_k = reference.and_then(|reference| reference.before_and_after(&core));
    let error = ErrorBeforeAfter { budget: core.error, reference_rmse_k };
    let mut out = answer(&joined, options, core, error, |_| ());
    let masked = masked(&out, &rows, records);
    for effect in &mut out.effects {
        effect.masked.clear();
    }
    let each = of_records.iter().zip(records).zip(masked);
    out.records = each
        .map(|((found, record), masked)| RecordAnswer::of(found, &record.source, &record.channels, masked))
        .collect();
    out.transfer = Some(TransferAnswer::of(&transfer, LeftOutUnit::Record));
    Ok(out)
}

/// The rows of several records, one record after the other as the model of [`diagnose_records`] has them: what pictures of its
/// answer are drawn with.
///
/// # Errors
/// As [`diagnose_records`].
pub fn joined(records: &[Record]) -> Result<Record, Error> {
    let observations =
        records.iter().map(|record| Ok(Rows::of(record)?.observations)).collect::<Result<Vec<_>, Error>>()?;
    in_a_row(records, &observations)
}

fn in_a_row(records: &[Record], observations: &[Observations]) -> Result<Record, Error> {
    let members = Observations::joined(observations)?.members();
    let later_s = members.iter().zip(observations).map(|(member, own)| member.ends_s[0] - own.ends_s()[0]);
    let each: Vec<(&Record, f64)> = records.iter().zip(later_s).collect();
    Record::joined(&each).ok_or(Error::Model(ModelError::TooFewRecords { records: 0 }))
}

/// Readings of each record that are left out, by their lines.
fn masked(answer: &Diagnosis, rows: &[Rows], records: &[Record]) -> Vec<Vec<Masked>> {
    let mut first = 0;
    let of_record = |(rows, record): (&Rows, &Record)| {
        let samples = first..first + rows.observations.samples();
        first = samples.end;
        let all = answer.effects.iter().flat_map(|effect| &effect.masked).filter(|m| samples.contains(&m.rows[0]));
        let mut own: Vec<Masked> = all.copied().collect();
        for masked in &mut own {
            masked.rows = masked.rows.map(|sample| sample - samples.start);
            rows.place(masked, record);
        }
        own
    };
    rows.iter().zip(records).map(of_record).collect()
}
