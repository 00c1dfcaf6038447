//! Answers as rows of a table.
//!
//! A row has only the cells that its answer has; the table has the columns of its verb, in the order of [`Verb::columns`], and after
//! them those of the effects' parameters, which depend on what was found.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use twinlag::diagnosis::{Grade, Judgement};
use twinlag::{
    Characterisation, Compensation, Diagnosis, EffectNumber, Estimated, NamedEffect, RecordAnswer, SensorEstimate,
    Status, TransferAnswer,
};

use crate::group::{Unit, name_of};

/// What is asked of each unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Verb {
    /// Both time constants of two lags.
    Characterise,
    /// What two lags lack.
    Diagnose,
    /// The gas temperature.
    Compensate,
}

/// What a unit answered.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Answer<'a> {
    /// Of [`Verb::Characterise`].
    Characterisation(&'a Characterisation),
    /// Of [`Verb::Diagnose`].
    Diagnosis(&'a Diagnosis),
    /// Of [`Verb::Compensate`].
    Compensation(&'a Compensation),
}

/// What the cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cells {
    Text,
    Count,
    Number,
    Truth,
}

/// Columns of every table: what was asked of, and how that ended.
const OF_ALL: [(&str, Cells); 18] = [
    ("level", Cells::Text),
    ("rig", Cells::Text),
    ("file", Cells::Text),
    ("exit_code", Cells::Count),
    ("status", Cells::Text),
    ("reason", Cells::Text),
    ("records", Cells::Count),
    ("channel_1", Cells::Text),
    ("channel_2", Cells::Text),
    ("samples", Cells::Count),
    ("sample_period_s", Cells::Number),
    ("missing", Cells::Count),
    ("noise1_std_K", Cells::Number),
    ("noise2_std_K", Cells::Number),
    ("chi2_per_dof", Cells::Number),
    ("agrees", Cells::Truth),
    ("left_out_rms_before", Cells::Number),
    ("left_out_rms_after", Cells::Number),
];

/// Time constants and their difference, with their unit; each has what [`Row::graded`] adds.
const GRADED: [Quantity<'static>; 3] = [("tau1", "_s"), ("tau2", "_s"), ("tau_difference", "_s")];

/// A number by the beginning of its columns' names, and the unit at their ends.
type Quantity<'a> = (&'a str, &'a str);

const OF_DIAGNOSIS: [(&str, Cells); 6] = [
    ("verdict", Cells::Text),
    ("effects", Cells::Text),
    ("chi2_per_dof_before", Cells::Number),
    ("chi2_per_dof_after", Cells::Number),
    ("reference_rmse_before_K", Cells::Number),
    ("reference_rmse_after_K", Cells::Number),
];

const OF_COMPENSATION: [(&str, Cells); 10] = [
    ("verdict", Cells::Text),
    ("effects", Cells::Text),
    ("gas_file", Cells::Text),
    ("gas_median_std_K", Cells::Number),
    ("gas_parameter_std_K", Cells::Number),
    ("gas_bandwidth_Hz", Cells::Number),
    ("gas_innovation_energy", Cells::Number),
    ("gas_reference_rmse_K", Cells::Number),
    ("gas_grade", Cells::Text),
    ("gas_because", Cells::Text),
];

/// How a file was understood.
const NOTES: (&str, Cells) = ("notes", Cells::Text);

impl Verb {
    /// The columns that a table of its answers always has, in order, with what they hold.
    pub(crate) fn columns(self) -> Vec<(String, Cells)> {
        let graded = GRADED.into_iter().flat_map(graded_columns);
        let own: &[_] = match self {
            Self::Characterise => &[],
            Self::Diagnose => &OF_DIAGNOSIS,
            Self::Compensate => &OF_COMPENSATION,
        };
        let named = |(name, cells): &(&str, Cells)| ((*name).to_owned(), *cells);
        OF_ALL.iter().map(named).chain(graded).chain(own.iter().map(named)).chain([named(&NOTES)]).collect()
    }
}

/// The columns of a number with its interval and its grade.
fn graded_columns((stem, unit): Quantity<'_>) -> [(String, Cells); 5] {
    [
        (format!("{stem}{unit}"), Cells::Number),
        (format!("{stem}_low{unit}"), Cells::Number),
        (format!("{stem}_high{unit}"), Cells::Number),
        (format!("{stem}_grade"), Cells::Text),
        (format!("{stem}_because"), Cells::Text),
    ]
}

/// What the cells of a column hold that no verb names: a parameter of an effect.
pub(crate) fn cells_of_parameter(name: &str) -> Cells {
    if name.ends_with("_grade") || name.ends_with("_because") { Cells::Text } else { Cells::Number }
}

/// A row: names of columns with their cells.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Row {
    cells: Map<String, Value>,
}

impl Row {
    /// The row of a file that has no answer.
    ///
    /// - `exit_code`: what the program would have ended with on it
    pub fn without_answer(unit: &Unit, file: &Path, exit_code: u8, reason: &str) -> Self {
        Self::of_file(unit, &name_of(file)).count("exit_code", exit_code.into()).text("reason", reason)
    }

    /// The row of a rig as a whole that has no answer.
    ///
    /// - `records`: how many of its records were read
    pub fn rig_without_answer(name: &str, records: usize, exit_code: u8, reason: &str) -> Self {
        let row = Self::of_rig(name, records);
        row.count("exit_code", exit_code.into()).text("reason", reason)
    }

    /// The row of a record of which nothing is said but with its rig.
    pub fn with_its_rig(unit: &Unit, file: &str, samples: usize, exit_code: u8) -> Self {
        Self::of_file(unit, file).count("exit_code", exit_code.into()).count("samples", samples)
    }

    /// The rows of an answer: one of a record; of a rig one for it and one for each of its records.
    ///
    /// - `exit_code`: what the program would have ended with
    pub fn of(unit: &Unit, exit_code: u8, answer: &Answer<'_>) -> Vec<Self> {
        let (last, records) = match answer {
            Answer::Characterisation(answer) => (*answer, &answer.records),
            Answer::Diagnosis(answer) => (&answer.last, &answer.records),
            Answer::Compensation(answer) => (&answer.last, &answer.last.records),
        };
        let row = match unit {
            Unit::Rig { name, .. } => Self::of_rig(name, records.len().max(1)),
            Unit::Record(file) | Unit::WithoutRig { file, .. } => Self::of_file(unit, &name_of(file)),
        };
        let row = row.count("exit_code", exit_code.into()).characterisation(last);
        let row = match answer {
            Answer::Characterisation(_) => row.free(last),
            Answer::Diagnosis(answer) => row.diagnosis(answer),
            Answer::Compensation(answer) => row.compensation(answer),
        };
        let of_record = |record: &RecordAnswer| Self::of_file(unit, &record.source).record(record, exit_code);
        std::iter::once(row).chain(records.iter().map(of_record)).collect()
    }

    /// Says where the gas temperature was written to.
    #[must_use]
    pub fn with_gas_file(self, path: &Path) -> Self {
        self.text("gas_file", &name_of(path))
    }

    /// A cell of text; `None` where it is empty.
    pub fn get_text(&self, column: &str) -> Option<&str> {
        self.cells.get(column)?.as_str()
    }

    /// A cell with a number; `None` where it is empty.
    pub fn get_number(&self, column: &str) -> Option<f64> {
        self.cells.get(column)?.as_f64()
    }

    /// What the program would have ended with.
    pub fn exit_code(&self) -> Option<u8> {
        self.cells.get("exit_code")?.as_u64()?.try_into().ok()
    }

    /// Whether it is of a file that was not read.
    pub(crate) fn is_unread(&self) -> bool {
        self.get("samples").is_none() && self.get_text("level") == Some("record")
    }

    pub(crate) fn get(&self, column: &str) -> Option<&Value> {
        self.cells.get(column)
    }

    pub(crate) fn columns(&self) -> impl Iterator<Item = &str> {
        self.cells.keys().map(String::as_str)
    }

    fn of_file(unit: &Unit, file: &str) -> Self {
        let row = Self::default().text("level", "record");
        let row = if let Unit::Rig { name, .. } = unit { row.text("rig", name) } else { row };
        row.text("file", file)
    }

    fn of_rig(name: &str, records: usize) -> Self {
        Self::default().text("level", "rig").text("rig", name).count("records", records)
    }

    fn text(mut self, column: &str, text: &str) -> Self {
        if !text.is_empty() {
            self.cells.insert(column.to_owned(), text.into());
        }
        self
    }

    fn count(mut self, column: &str, count: usize) -> Self {
        self.cells.insert(column.to_owned(), count.into());
        self
    }

    /// A number; one that is not finite gets no cell.
    fn number(mut self, column: &str, number: impl Into<Option<f64>>) -> Self {
        if let Some(number) = number.into().filter(|number| number.is_finite()) {
            self.cells.insert(column.to_owned(), number.into());
        }
        self
    }

    fn graded(
        self,
        quantity: Quantity<'_>,
        value: Option<f64>,
        interval: Option<[f64; 2]>,
        judgement: &Judgement,
    ) -> Self {
        let [column, low, high, grade, because] = graded_columns(quantity).map(|(name, _)| name);
        let row =
            self.number(&column, value).number(&low, interval.map(|i| i[0])).number(&high, interval.map(|i| i[1]));
        let why = if judgement.grade == Grade::Go { "" } else { &judgement.because };
        row.text(&grade, &judgement.grade.to_string()).text(&because, why)
    }

    fn characterisation(self, answer: &Characterisation) -> Self {
        let record = &answer.record;
        let reason = why_not_ok(answer);
        let notes = answer.notes.join("; ");
        let [one, two] = &answer.sensors;
        let difference = &answer.time_constant_difference_s;
        let tau = |row: Self, quantity: Quantity<'_>, sensor: &SensorEstimate| {
            row.graded(quantity, sensor.time_constant_s, sensor.interval_95_s, &sensor.judgement)
        };
        let row = self
            .text("status", &name(answer.status))
            .text("reason", &reason)
            .text("channel_1", &record.channels[0])
            .text("channel_2", &record.channels[1])
            .count("samples", record.samples)
            .number("sample_period_s", record.sample_period_s)
            .count("missing", record.missing)
            .number("noise1_std_K", one.noise_std_k)
            .number("noise2_std_K", two.noise_std_k)
            .number("chi2_per_dof", answer.residual.chi2_per_dof)
            .text("notes", &notes);
        let row = row.left_out(answer.transfer);
        let row = tau(tau(row, GRADED[0], one), GRADED[1], two);
        row.graded(GRADED[2], difference.value, difference.interval_95_s, &difference.judgement)
    }

    /// What is left on records, or blocks, that had no part in the fit.
    fn left_out(self, transfer: Option<TransferAnswer>) -> Self {
        let rms = transfer.map(|transfer| transfer.error.held_out_normalised_rms);
        self.number("left_out_rms_before", rms.map(|rms| rms.before))
            .number("left_out_rms_after", rms.map(|rms| rms.after))
    }

    /// Calibration that was fitted with two lags.
    fn free(self, answer: &Characterisation) -> Self {
        let free = |row: Self, quantity: Quantity<'_>, number: &Option<Estimated>| match number {
            Some(found) => row.graded(quantity, Some(found.value), Some(found.interval_95), &found.judgement),
            None => row,
        };
        let row = free(self, ("calibration_gain", ""), &answer.free.gain);
        free(row, ("calibration_offset", "_K"), &answer.free.offset_k)
    }

    fn diagnosis(self, answer: &Diagnosis) -> Self {
        let error = &answer.error;
        let row = self
            .text("verdict", &name(answer.verdict))
            .number("chi2_per_dof_before", error.budget.chi2_per_dof.before)
            .number("chi2_per_dof_after", error.budget.chi2_per_dof.after)
            .number("reference_rmse_before_K", error.reference_rmse_k.map(|e| e.before))
            .number("reference_rmse_after_K", error.reference_rmse_k.map(|e| e.after));
        let row = row.left_out(answer.transfer);
        row.effects(&answer.effects, &answer.last)
    }

    fn compensation(self, answer: &Compensation) -> Self {
        let verdict = answer.verdict.map(name).unwrap_or_default();
        let because = if answer.judgement.grade == Grade::Go { "" } else { &answer.judgement.because };
        let row = self
            .text("verdict", &verdict)
            .text("gas_grade", &answer.judgement.grade.to_string())
            .text("gas_because", because)
            .effects(&answer.effects, &answer.last);
        let Some(gas) = &answer.gas else { return row };
        row.number("gas_median_std_K", gas.median_std_k)
            .number("gas_parameter_std_K", gas.parameter_std_k)
            .number("gas_bandwidth_Hz", gas.bandwidth_hz)
            .number("gas_innovation_energy", gas.innovation_energy)
            .number("gas_reference_rmse_K", gas.reference.as_ref().map(|against| against.rmse_k))
    }

    /// The effects in words, and a number for each of their parameters.
    fn effects(self, effects: &[NamedEffect], last: &Characterisation) -> Self {
        let place = |channel: &Option<String>| {
            let sensor = last.sensors.iter().position(|sensor| Some(&sensor.channel) == channel.as_ref());
            sensor.map_or(String::new(), |sensor| (sensor + 1).to_string())
        };
        let in_words = |found: &NamedEffect| match &found.channel {
            Some(channel) => format!("{} in {channel}", found.effect),
            None => found.effect.to_string(),
        };
        let named: Vec<String> = effects.iter().map(in_words).collect();
        let parameters = effects.iter().flat_map(|found| {
            let effect = found.effect.to_string().replace('-', "_") + &place(&found.fitted_in);
            found.parameters.iter().map(move |number| (stem_and_unit(&effect, number), number))
        });
        parameters.fold(self.text("effects", &named.join("; ")), |row, ((stem, unit), number)| {
            row.graded((&stem, &unit), number.value, number.interval_95, &number.judgement)
        })
    }

    fn record(self, record: &RecordAnswer, exit_code: u8) -> Self {
        let error = record.error.held_out_normalised_rms;
        let mut row = self
            .count("exit_code", exit_code.into())
            .count("samples", record.samples)
            .number("noise1_std_K", record.noise_std_k[0])
            .number("noise2_std_K", record.noise_std_k[1])
            .number("left_out_rms_before", error.before)
            .number("left_out_rms_after", error.after);
        if let Some(agrees) = record.agrees {
            row.cells.insert("agrees".to_owned(), agrees.into());
        }
        row
    }
}

/// The beginning of the columns of a parameter, which is its effect, the number of its channel and its name; and its unit.
fn stem_and_unit(effect: &str, number: &EffectNumber) -> (String, String) {
    let unit = match number.unit.as_str() {
        "" | "1" => String::new(),
        unit => format!("_{}", unit.replace('/', "_per_")),
    };
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    (format!("{effect}_{}", number.name).chars().map(plain).collect(), unit.chars().map(plain).collect())
}

/// Why an answer is not `ok`, and what else is to be said of it; empty of one that is.
fn why_not_ok(answer: &Characterisation) -> String {
    let first = match answer.status {
        Status::Ok => return String::new(),
        Status::AtBound => "the best fit lies on a bound".to_owned(),
        Status::NotIdentifiable => format!("the record does not determine {}", answer.not_identifiable.join(", ")),
        _ => "the residual is more than noise".to_owned(),
    };
    [first].iter().chain(&answer.warnings).map(String::as_str).collect::<Vec<_>>().join("; ")
}

/// The name that an answer has in JSON.
fn name(of: impl Serialize) -> String {
    serde_json::to_value(of).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}
