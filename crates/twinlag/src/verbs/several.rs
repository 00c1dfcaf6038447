//! Several records of one rig as the loop takes them, and what it says of them.

use twinlag_diagnose::{
    Diagnosis, Masked, ModelError, Observations, OfRecord, Settings, Transfer, diagnose_records as close_the_loop,
};
use twinlag_record::Record;

use crate::answers::{Characterisation, LeftOutUnit, RecordAnswer, TransferAnswer};
use crate::error::Error;
use crate::rows::{Rows, check_flow};
use crate::watch::Watch;

/// Several records, and what a joint diagnosis says of each.
pub(super) struct Several<'a> {
    pub(super) records: &'a [Record],
    /// Rows of each.
    pub(super) rows: Vec<Rows>,
    /// The records in a row.
    pub(super) joined: Record,
    of_records: Vec<OfRecord>,
    transfer: Transfer,
}

impl<'a> Several<'a> {
    /// With what the diagnosis says of all of them together.
    pub(super) fn of(records: &'a [Record], settings: &Settings, watch: Watch<'_>) -> Result<(Self, Diagnosis), Error> {
        let first = records.first().map(|record| record.channels.clone());
        if let Some(other) = records.iter().find(|record| Some(&record.channels) != first.as_ref()) {
            let (expected, found) = (first.unwrap_or_default(), other.channels.clone());
            return Err(Error::OtherChannels { file: other.source.clone(), expected, found });
        }
        let rows: Vec<Rows> = records.iter().map(rows).collect::<Result<_, _>>()?;
        let observations: Vec<Observations> = rows.iter().map(|rows| rows.observations.clone()).collect();
        // Without effects to find a flow is not used.
        if !settings.effects.is_empty() {
            let joined = Observations::joined(&observations).map_err(|error| in_files(error, records))?;
            check_flow(&joined, records)?;
        }
        let joint = close_the_loop(&observations, settings, watch).map_err(|error| in_files(error, records))?;
        let joined = in_a_row(records, &observations)?;
        let of_all = Self { records, rows, joined, of_records: joint.records, transfer: joint.transfer };
        Ok((of_all, joint.diagnosis))
    }

    /// Readings of all of them.
    pub(super) fn observations(&self) -> Result<Observations, Error> {
        let each: Vec<Observations> = self.rows.iter().map(|rows| rows.observations.clone()).collect();
        Ok(Observations::joined(&each)?)
    }

    /// What is said of each.
    ///
    /// - `shared`: what all have together
    /// - `masked`: readings that are left out, by their samples through all records
    pub(super) fn answers(&self, shared: &Characterisation, masked: &[Masked]) -> Vec<RecordAnswer> {
        let each = self.of_records.iter().zip(self.records).zip(self.masked(masked));
        each.map(|((found, record), masked)| RecordAnswer::of(found, &record.source, shared, masked)).collect()
    }

    pub(super) fn transfer(&self) -> TransferAnswer {
        TransferAnswer::of(&self.transfer, LeftOutUnit::Record)
    }

    /// Those of `masked` readings that are of each record, by their lines in its file.
    fn masked(&self, masked: &[Masked]) -> Vec<Vec<Masked>> {
        let mut first = 0;
        let of_record = |(rows, record): (&Rows, &Record)| {
            let samples = first..first + rows.observations.samples();
            first = samples.end;
            let mut own: Vec<Masked> = masked.iter().filter(|m| samples.contains(&m.rows[0])).copied().collect();
            for masked in &mut own {
                masked.rows = masked.rows.map(|sample| sample - samples.start);
                rows.place(masked, record);
            }
            own
        };
        self.rows.iter().zip(self.records).map(of_record).collect()
    }
}

/// An error of several records with the names of their files.
fn in_files(error: ModelError, records: &[Record]) -> Error {
    match error {
        ModelError::OtherPeriod { record, period_s, first_s } => {
            let [first_file, file] = [0, record].map(|i| records[i].source.clone());
            Error::OtherPeriod { file, first_file, first_s, period_s }
        }
        error => error.into(),
    }
}

/// Rows of one of several records.
fn rows(record: &Record) -> Result<Rows, Error> {
    Rows::of(record).map_err(|error| Error::InRecord { file: record.source.clone(), error: Box::new(error) })
}

/// The rows of several records, one record after the other as the models of [`diagnose_records`](crate::diagnose_records()) and
/// [`characterise_records`](crate::characterise_records()) have them: what pictures of their answers are drawn with.
///
/// # Errors
/// As [`diagnose_records`](crate::diagnose_records()).
pub fn joined(records: &[Record]) -> Result<Record, Error> {
    let observations =
        records.iter().map(|record| Ok(rows(record)?.observations)).collect::<Result<Vec<_>, Error>>()?;
    in_a_row(records, &observations)
}

fn in_a_row(records: &[Record], observations: &[Observations]) -> Result<Record, Error> {
    let members = Observations::joined(observations)?.members();
    let later_s = members.iter().zip(observations).map(|(member, own)| member.ends_s[0] - own.ends_s()[0]);
    let each: Vec<(&Record, f64)> = records.iter().zip(later_s).collect();
    Record::joined(&each).ok_or(Error::Model(ModelError::TooFewRecords { records: 0 }))
}
