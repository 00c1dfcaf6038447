//! Time constants along a record: schema `twinlag.track/1`.

use std::io::Write;

use serde::{Deserialize, Serialize};
use twinlag_diagnose::{ChangePoint, Grade, Judgement, RatioTest};
use twinlag_record::RecordError;

use crate::answers::{Characterisation, Status};
use crate::kept::{Kept, write_graded};

/// One sensor's time constant along the record.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Along {
    /// Time constant, s; NaN where it is not given.
    pub tau_s: Vec<f64>,
    /// Lower ends of the pointwise 95 % band, s; NaN where it is not given.
    pub low_s: Vec<f64>,
    /// Upper ends of the pointwise 95 % band, s; NaN where it is not given.
    pub high_s: Vec<f64>,
}

/// Whether the ratio of the time constants stays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Ratio {
    /// Whether it does, as far as the record shows.
    pub stays: bool,
    /// The test.
    #[serde(flatten)]
    pub test: RatioTest,
}

/// How time constants change along a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Track {
    /// `twinlag.track/1`.
    pub schema: String,
    /// `ok`, `model-rejected` where something is left over (of windows, in more than
    /// chance explains) or the ratio changes, `not-identifiable` where the record determines time constants nowhere.
    pub status: Status,
    /// Whether the track may be used: no better than the fit that it is of; of windows the worst of those that are given.
    #[serde(default, flatten)]
    pub judgement: Judgement,
    /// `constant`, `smooth`, `step` or `windows`; `unknown` of a track that is not given.
    pub change: String,
    /// Coefficients of a smooth change.
    pub coefficients: Option<usize>,
    /// Instants, s. The series are not part of the JSON.
    #[serde(skip)]
    pub time_s: Vec<f64>,
    /// Both time constants.
    #[serde(skip)]
    pub sensors: [Along; 2],
    /// Whether the time constants at each instant may be used; those that may not are NaN, unless they were asked for.
    #[serde(skip)]
    pub grades: Vec<Grade>,
    /// Smallest and largest time constant of each sensor that are given, s.
    pub range_s: Option<[[f64; 2]; 2]>,
    /// The step that explains most, if a step was taken.
    pub step: Option<ChangePoint>,
    /// Whether the ratio stays; not of windows.
    pub ratio: Option<Ratio>,
    /// The fit that the track is of, with the means of the time constants over the record; of
    /// windows the fit of the whole record.
    #[serde(rename = "final")]
    pub last: Characterisation,
    /// What to know before using the numbers.
    pub warnings: Vec<String>,
}

impl Track {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.track/1";

    /// Writes both time constants with the ends of their 95 % bands as comma-separated text: `time_s`, `tau1_s`, `tau1_low_s`,
    /// `tau1_high_s`, the same of `tau2`, `grade`, and what is kept of the record's table.
    ///
    /// # Errors
    /// [`RecordError::LengthMismatch`] of an answer whose series differ in length; [`RecordError::CannotWrite`].
    pub fn write_csv(&self, out: &mut impl Write, kept: Option<&Kept>) -> Result<(), RecordError> {
        let [one, two] = &self.sensors;
        let columns: [(&str, &[f64]); 7] = [
            ("time_s", &self.time_s),
            ("tau1_s", &one.tau_s),
            ("tau1_low_s", &one.low_s),
            ("tau1_high_s", &one.high_s),
            ("tau2_s", &two.tau_s),
            ("tau2_low_s", &two.low_s),
            ("tau2_high_s", &two.high_s),
        ];
        let grade = |sample: usize| self.grades.get(sample).map_or(String::new(), ToString::to_string);
        write_graded(out, &columns, grade, kept)
    }
}
