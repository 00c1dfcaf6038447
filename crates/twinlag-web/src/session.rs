//! Records that were dropped on the page, and what was answered of them.

use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use thiserror::Error;
use twinlag::record::{Decimals, Record, RecordError, Selection, Table, write_csv};
use twinlag::signal::{Rig, SignalError};
use twinlag::{
    CompensateOptions, Compensation, DiagnoseOptions, Diagnosis, Inspection, Keep, Kept, Options, Status, Watch,
    compensate_watched, diagnose_records_watched, diagnose_watched, inspect, joined,
};
use twinlag_files::{Choice, FileError, are_binary, contents_of_bytes, read_bytes};
use twinlag_pages::{Making, ReportError, diagnosis_report, gas_report};

/// The rig of the example: two thermocouples in the exhaust of an engine, the second of which sits in a sheath.
const EXAMPLE_RIG: &str = include_str!("example.json");

/// Why there is no answer.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SessionError {
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A record cannot be made of a table, or not written.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A verb refuses the record or the options.
    #[error(transparent)]
    Verb(#[from] twinlag::Error),
    /// An answer cannot be drawn.
    #[error(transparent)]
    Page(#[from] ReportError),
    /// A rig cannot be simulated.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// What is to be JSON is not.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// Something is asked before what it rests on.
    #[error("expected {expected} before this")]
    Order {
        /// What has to come first.
        expected: &'static str,
    },
}

/// A record of a file.
#[derive(Debug)]
struct Added {
    record: Record,
    /// How it was read.
    selection: Selection,
    choice: Choice,
    /// SHA-256 of the file, in hexadecimal digits.
    sha256: String,
}

/// Records of one rig, and what was answered of them. Options, selections and answers are JSON, in the form of the program.
#[derive(Debug, Default)]
pub struct Session {
    added: Vec<Added>,
    diagnosis: Option<Diagnosis>,
    gas: Option<Compensation>,
}

impl Session {
    /// A simulated record to try the page on, as CSV.
    ///
    /// # Errors
    /// None, unless the example is broken.
    pub fn example() -> Result<String, SessionError> {
        let rig: Rig = parsed(EXAMPLE_RIG)?;
        let simulated = rig.simulate()?;
        let [t1, t2] = simulated.channels.each_ref().map(|channel| format!("{channel}_C"));
        let columns: [(&str, &[f64]); 3] =
            [("time_s", &simulated.time_s), (&t1, &simulated.t1_c), (&t2, &simulated.t2_c)];
        let mut text = Vec::new();
        write_csv(&mut text, &columns, Decimals::Shortest)?;
        Ok(String::from_utf8_lossy(&text).into_owned())
    }

    /// The sheets or groups of channels of a file, as a JSON array of pairs: its name, and what it holds. None of text.
    ///
    /// - `name`: the file's
    ///
    /// # Errors
    /// [`SessionError::File`] of a file that cannot be read.
    pub fn groups(name: &str, bytes: Vec<u8>) -> Result<String, SessionError> {
        let groups = if are_binary(&bytes) { contents_of_bytes(bytes, name)?.groups } else { Vec::new() };
        let pairs: Vec<(&str, String)> = groups.iter().map(|group| (&*group.name, group.to_string())).collect();
        Ok(serde_json::to_string(&pairs)?)
    }

    /// Says what is in a file, and adds its record where it has one; returns the answer of `twinlag inspect`. An answer of earlier
    /// records is forgotten.
    ///
    /// - `name`: the file's
    /// - `selection`: [`Selection`] as JSON
    /// - `group`, `join`: as of [`Choice`]
    ///
    /// # Errors
    /// Files that are no table, and selections that are not as JSON has them.
    pub fn add(
        &mut self,
        name: &str,
        bytes: Vec<u8>,
        selection: &str,
        group: Option<String>,
        join: bool,
    ) -> Result<String, SessionError> {
        let selection: Selection = parsed(selection)?;
        let sha256 = base16ct::lower::encode_string(&Sha256::digest(&bytes));
        let choice = Choice { group, join, ..Choice::of(&selection) };
        let (inspection, record) = inspect(table(name, bytes, &choice)?, &selection);
        (self.diagnosis, self.gas) = (None, None);
        if let Ok(record) = record {
            self.added.push(Added { record, selection, choice, sha256 });
        }
        Ok(serde_json::to_string::<Inspection>(&inspection)?)
    }

    /// Finds the effects that two first-order lags lack; returns the answer of `twinlag diagnose`.
    ///
    /// - `options`: [`Options`] as JSON
    ///
    /// # Errors
    /// [`SessionError::Order`] without a record; those of [`diagnose_watched`].
    pub fn diagnose(&mut self, options: &str, watch: Watch<'_>) -> Result<String, SessionError> {
        let options = DiagnoseOptions { characterise: parsed::<Options>(options)?, ..DiagnoseOptions::default() };
        (self.diagnosis, self.gas) = (None, None);
        let answer = match &self.records()[..] {
            [] => return Err(SessionError::Order { expected: "a record" }),
            [one] => diagnose_watched(one, &options, watch)?,
            several => diagnose_records_watched(several, &options, watch)?,
        };
        let json = serde_json::to_string(&answer)?;
        self.diagnosis = Some(answer);
        Ok(json)
    }

    /// Reconstructs the gas temperature of the first record; returns the answer of `twinlag compensate`.
    ///
    /// - `model`: what [`Session::model`] gave of this or another session
    ///
    /// # Errors
    /// [`SessionError::Order`] without a record, [`SessionError::Json`] of what is no model; those of [`compensate_watched`].
    pub fn compensate(&mut self, model: &str, watch: Watch<'_>) -> Result<String, SessionError> {
        let options = CompensateOptions { model: Some(parsed(model)?), ..CompensateOptions::default() };
        let first = self.added.first().ok_or(SessionError::Order { expected: "a record" })?;
        let answer = compensate_watched(&first.record, &options, watch)?;
        let json = serde_json::to_string(&answer)?;
        self.gas = Some(answer);
        Ok(json)
    }

    /// The report of the diagnosis, one HTML file.
    ///
    /// - `made_at`: when, for a reader
    ///
    /// # Errors
    /// [`SessionError::Order`] without a diagnosis; [`SessionError::Page`].
    pub fn report(&self, made_at: &str) -> Result<String, SessionError> {
        let diagnosis = self.diagnosis()?;
        let page = match &self.records()[..] {
            [one] => diagnosis_report(one, diagnosis, &making(&self.added, made_at))?,
            several => diagnosis_report(&joined(several)?, diagnosis, &making(&self.added, made_at))?,
        };
        Ok(page)
    }

    /// The report of the gas temperature, one HTML file.
    ///
    /// - `made_at`: when, for a reader
    ///
    /// # Errors
    /// [`SessionError::Order`] without a gas temperature; [`SessionError::Page`].
    pub fn gas_report(&self, made_at: &str) -> Result<String, SessionError> {
        let gas = self.gas()?;
        let first = &self.added[..1];
        Ok(gas_report(&first[0].record, gas, &making(first, made_at))?)
    }

    /// The gas temperature as CSV, as `twinlag compensate` writes it, with the dates and times of the file of the first record; `None`
    /// where there is none to give.
    ///
    /// - `bytes`: that file, once more
    ///
    /// # Errors
    /// [`SessionError::Order`] before [`Session::compensate`]; [`SessionError::Verb`] of a file with other rows than the record, and
    /// those of [`Session::add`].
    pub fn gas_csv(&self, bytes: Vec<u8>) -> Result<Option<String>, SessionError> {
        let gas = self.gas()?;
        if gas.status != Status::Ok {
            return Ok(None);
        }
        let Added { record, selection, choice, .. } = &self.added[0];
        let kept = Kept::of(table(&record.source, bytes, choice)?, selection, Keep::Stamps, record)?;
        let mut text = Vec::new();
        gas.write_csv(&mut text, kept.as_ref())?;
        Ok(Some(String::from_utf8_lossy(&text).into_owned()))
    }

    /// The model that was found, as `twinlag diagnose --save` writes it.
    ///
    /// # Errors
    /// [`SessionError::Order`] without a diagnosis.
    pub fn model(&self) -> Result<String, SessionError> {
        Ok(serde_json::to_string_pretty(&self.diagnosis()?.model())?)
    }

    fn diagnosis(&self) -> Result<&Diagnosis, SessionError> {
        self.diagnosis.as_ref().ok_or(SessionError::Order { expected: "a diagnosis" })
    }

    fn gas(&self) -> Result<&Compensation, SessionError> {
        self.gas.as_ref().ok_or(SessionError::Order { expected: "a gas temperature" })
    }

    /// Copies for verbs that take several records in a row. Their readings are shared, not copied.
    fn records(&self) -> Vec<Record> {
        self.added.iter().map(|added| added.record.clone()).collect()
    }
}

/// What a page says of its making, from these files.
fn making(added: &[Added], made_at: &str) -> Making {
    let files = added.iter().map(|added| (added.record.source.clone(), added.sha256.clone()));
    Making { made_at: made_at.to_owned(), files: files.collect(), ..Making::default() }
}

fn parsed<T: DeserializeOwned>(json: &str) -> Result<T, SessionError> {
    // Through a value: the place of what is wrong in a text that the page has written is nothing to its reader.
    Ok(T::deserialize(serde_json::from_str::<serde_json::Value>(json)?)?)
}

/// The table of a file in memory, in whatever format it is.
fn table(name: &str, bytes: Vec<u8>, choice: &Choice) -> Result<Table, SessionError> {
    if !are_binary(&bytes) {
        return Ok(Table::from_reader(bytes.as_slice(), name)?);
    }
    Ok(read_bytes(bytes, choice, name)?)
}
