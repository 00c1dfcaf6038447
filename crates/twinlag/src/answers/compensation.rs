//! The gas temperature of a record: schema `twinlag.compensation/1`.

use std::io::Write;

use serde::{Deserialize, Serialize};
use twinlag_compensate::{Form, Prior, Rig};
use twinlag_diagnose::{Judgement, Verdict};
use twinlag_record::{Record, RecordError};

use crate::answers::diagnosis::explained;
use crate::answers::{Characterisation, FoundIn, Model, NamedEffect, Status};
use crate::bands::GasFault;
use crate::kept::{Kept, write_graded};
use crate::reference::AgainstReference;

/// How good a gas temperature is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Quality {
    /// Median of its standard deviation, K.
    #[serde(rename = "median_std_K")]
    pub median_std_k: f64,
    /// Median of the part of it that is due to the model's parameters, K, which at no instant is more
    /// than the whole.
    #[serde(rename = "parameter_std_K")]
    pub parameter_std_k: f64,
    /// Highest frequency of which the readings say more than the prior, Hz: above it the answer is
    /// what the gas is like, not what it did. `None` if they do so at no frequency.
    #[serde(rename = "bandwidth_Hz")]
    pub bandwidth_hz: Option<f64>,
    /// Mean square of readings less what earlier ones led to expect, over its variance: 1 where
    /// model and prior are right.
    pub innovation_energy: f64,
    /// What the bands were multiplied by where the innovation energy is too large.
    pub widened_by: f64,
    /// What in the gas temperature shows that the model is wrong.
    #[serde(default)]
    pub faults: Vec<GasFault>,
    /// What the gas is like, learned from the readings.
    pub prior: Prior,
    /// Errors against the reference; `None` without one.
    pub reference: Option<AgainstReference>,
}

/// The gas temperature of a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Compensation {
    /// `twinlag.compensation/1`.
    pub schema: String,
    /// `ok`, or `not-identifiable` where the record does not determine the time constants: there
    /// is no gas temperature then.
    pub status: Status,
    /// Which readings the answer for an instant rests on.
    pub form: Form,
    /// How good the gas temperature is; `None` if it may not be used.
    pub gas: Option<Quality>,
    /// Whether the gas temperature may be used: no better than the model that it follows from.
    #[serde(default, flatten)]
    pub judgement: Judgement,
    /// Instants, s: those of the record, and those that are missing in an even grid. The series are
    /// not part of the JSON.
    #[serde(skip)]
    pub time_s: Vec<f64>,
    /// The gas temperature, °C.
    #[serde(skip)]
    pub gas_c: Vec<f64>,
    /// Standard deviation of the gas temperature, K: noise, prior and the uncertainty of the
    /// model's parameters.
    #[serde(skip)]
    pub gas_std_k: Vec<f64>,
    /// What the diagnosis said; `None` if the model was given.
    pub verdict: Option<Verdict>,
    /// The effects in the model.
    #[serde(serialize_with = "explained")]
    #[cfg_attr(feature = "schema", schemars(with = "Vec<crate::answers::diagnosis::Explained<'static>>"))]
    pub effects: Vec<NamedEffect>,
    /// The model.
    #[serde(rename = "final")]
    pub last: Characterisation,
    /// What to know before using the numbers.
    pub warnings: Vec<String>,
    /// The rig, for pictures.
    #[serde(skip)]
    pub rig: Option<Rig>,
    /// The model, to be saved.
    #[serde(skip)]
    pub(crate) used: Option<Model>,
}

impl Compensation {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.compensation/1";

    /// The model that this rests on, with what the gas is like: to compensate other records of the same rig, which begins with
    /// that. `None` where there is no gas temperature, and of an answer that was read from JSON.
    ///
    /// - `record`: the one that was compensated
    ///
    /// ```
    #[doc = include_str!("../example.txt")]
    /// let model = twinlag::compensate(&record, &CompensateOptions::default())?.model(&record).expect("determined");
    /// assert!(model.gas.is_some());
    /// let later = Record::from_channels(channels(2)?, SamplingChoice::Auto)?;
    /// let answer = twinlag::compensate(&later, &CompensateOptions { model: Some(model), ..Default::default() })?;
    /// let against = answer.gas.expect("determined").reference.expect("there is one");
    /// assert!(against.rmse_k < 0.5 * against.raw_rmse_k);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn model(&self, record: &Record) -> Option<Model> {
        let mut model = self.used.clone()?;
        // A model that was given is of the record that it was found in.
        if self.verdict.is_some() {
            model.found_in = Some(FoundIn::of(record));
        }
        Some(model)
    }

    /// Writes the gas temperature as comma-separated text: `time_s`, `gas_C`, `gas_std_K`, `grade`, and what is kept of the record's
    /// table.
    ///
    /// # Errors
    /// [`RecordError::LengthMismatch`] of an answer whose series differ in length; [`RecordError::CannotWrite`].
    pub fn write_csv(&self, out: &mut impl Write, kept: Option<&Kept>) -> Result<(), RecordError> {
        let columns: [(&str, &[f64]); 3] =
            [("time_s", &self.time_s), ("gas_C", &self.gas_c), ("gas_std_K", &self.gas_std_k)];
        write_graded(out, &columns, |_| self.judgement.grade.to_string(), kept)
    }
}
