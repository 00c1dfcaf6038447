//! Answers as rows of a table.
//!
//! A row has only the cells that its answer has; the table has the columns of its verb, in the order of [`Verb::columns`], and after
//! them those of the effects' parameters, which depend on what was found.

use std::borrow::Cow;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use twinlag::diagnosis::{Grade, Judgement};
use twinlag::{
    Characterisation, Compensation, Diagnosis, EffectNumber, Estimated, NamedEffect, RecordAnswer, SensorEstimate,
    Status, TransferAnswer,
};

use crate::group::{Unit, name_of};
use crate::outcome::Outcome;

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

/// The first columns of every table, by which it is known: what the row is of, and how the question ended.
const FIRST: [(&str, Cells); 4] =
    [("level", Cells::Text), ("rig", Cells::Text), ("file", Cells::Text), ("exit_code", Cells::Count)];

/// The columns of every table behind the first ones: the status of the answer, the record, its noise, and what is left over.
const OF_ALL: [(&str, Cells); 14] = [
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

/// A number by the beginning of its columns' names, and the unit at their ends.
type Quantity<'a> = (&'a str, &'a str);

/// Both time constants.
pub(crate) const TAU: [Quantity<'static>; 2] = [("tau1", "_s"), ("tau2", "_s")];
/// The difference of the time constants.
const TAU_DIFFERENCE: Quantity<'static> = ("tau_difference", "_s");

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
        let quantities = TAU.into_iter().chain([TAU_DIFFERENCE]);
        let graded = quantities.flat_map(|quantity| graded_columns(quantity).into_iter().zip(GRADED));
        let own: &[_] = match self {
            Self::Characterise => &[],
            Self::Diagnose => &OF_DIAGNOSIS,
            Self::Compensate => &OF_COMPENSATION,
        };
        let named = |(name, cells): &(&str, Cells)| ((*name).to_owned(), *cells);
        let of_all = FIRST.iter().chain(&OF_ALL).map(named);
        of_all.chain(graded).chain(own.iter().map(named)).chain([named(&NOTES)]).collect()
    }
}

/// The names of the first columns of every table.
pub(crate) fn first_columns() -> [&'static str; 4] {
    FIRST.map(|(name, _)| name)
}

/// The columns of a number: itself, both ends of its interval, its grade, and why that is not `go`.
pub(crate) fn graded_columns((stem, unit): Quantity<'_>) -> [String; 5] {
    [
        format!("{stem}{unit}"),
        format!("{stem}_low{unit}"),
        format!("{stem}_high{unit}"),
        format!("{stem}_grade"),
        format!("{stem}_because"),
    ]
}

/// What the cells of [`graded_columns`] are.
const GRADED: [Cells; 5] = [Cells::Number, Cells::Number, Cells::Number, Cells::Text, Cells::Text];

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
    pub fn without_answer(unit: &Unit, file: &Path, outcome: Outcome, reason: &str) -> Self {
        Self::of_file(unit, &name_of(file)).ended(outcome).text("reason", reason)
    }

    /// The row of a rig as a whole that has no answer.
    ///
    /// - `records`: how many of its records were read
    pub fn rig_without_answer(name: &str, records: usize, outcome: Outcome, reason: &str) -> Self {
        Self::of_rig(name, records).ended(outcome).text("reason", reason)
    }

    /// The row of a record that was read and is answered for only as part of its rig.
    pub fn with_its_rig(unit: &Unit, file: &str, samples: usize, outcome: Outcome) -> Self {
        Self::of_file(unit, file).ended(outcome).count("samples", samples)
    }

    /// The rows of an answer: one of a record; of a rig one for it and one for each of its records.
    pub fn of(unit: &Unit, outcome: Outcome, answer: &Answer<'_>) -> Vec<Self> {
        let (last, records) = match answer {
            Answer::Characterisation(answer) => (*answer, &answer.records),
            Answer::Diagnosis(answer) => (&answer.last, &answer.records),
            Answer::Compensation(answer) => (&answer.last, &answer.last.records),
        };
        let row = match unit {
            Unit::Rig { name, .. } => Self::of_rig(name, records.len().max(1)),
            Unit::Record(file) | Unit::WithoutRig { file, .. } => Self::of_file(unit, &name_of(file)),
        };
        let row = row.ended(outcome).characterisation(last);
        let row = match answer {
            Answer::Characterisation(_) => row.free(last),
            Answer::Diagnosis(answer) => row.diagnosis(answer),
            Answer::Compensation(answer) => row.compensation(answer),
        };
        let of_record = |record: &RecordAnswer| Self::of_file(unit, &record.source).ended(outcome).record(record);
        std::iter::once(row).chain(records.iter().map(of_record)).collect()
    }

    /// Says where the gas temperature was written to.
    #[must_use]
    pub fn with_gas_file(self, path: &Path) -> Self {
        self.text("gas_file", &name_of(path))
    }

    /// The name of the file that it is of; `None` of a rig.
    pub fn file(&self) -> Option<&str> {
        self.get_text("file")
    }

    /// The name of the file that the gas temperature was written to.
    pub fn gas_file(&self) -> Option<&str> {
        self.get_text("gas_file")
    }

    /// How the question ended; `None` where the row does not say so.
    pub fn outcome(&self) -> Option<Outcome> {
        let exit_code = self.cells.get("exit_code")?.as_u64()?.try_into().ok()?;
        Some(Outcome::of_exit_code(exit_code))
    }

    /// The name of the file or of the rig that it is of.
    pub(crate) fn name(&self) -> &str {
        self.file().or(self.get_text("rig")).unwrap_or_default()
    }

    /// The effects that were found, in words.
    pub(crate) fn effect_names(&self) -> impl Iterator<Item = &str> {
        self.get("effects").into_iter().flat_map(texts)
    }

    /// Whether it is of a rig as a whole.
    pub(crate) fn is_of_rig(&self) -> bool {
        self.get_text("level") == Some("rig")
    }

    /// Whether it is of a file that was not read.
    pub(crate) fn is_unread(&self) -> bool {
        self.get("samples").is_none() && !self.is_of_rig()
    }

    /// A cell of text; `None` where it is empty.
    pub(crate) fn get_text(&self, column: &str) -> Option<&str> {
        self.cells.get(column)?.as_str()
    }

    /// A cell with a number; `None` where it is empty.
    pub(crate) fn get_number(&self, column: &str) -> Option<f64> {
        self.cells.get(column)?.as_f64()
    }

    /// A cell as text, as the table has it; `None` where it is empty.
    pub(crate) fn in_words(&self, column: &str) -> Option<Cow<'_, str>> {
        Some(match self.cells.get(column)? {
            Value::String(text) => text.into(),
            several @ Value::Array(_) => texts(several).collect::<Vec<_>>().join("; ").into(),
            value => value.to_string().into(),
        })
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

    fn ended(self, outcome: Outcome) -> Self {
        self.count("exit_code", outcome.exit_code().into())
    }

    fn text(mut self, column: &str, text: &str) -> Self {
        if !text.is_empty() {
            self.cells.insert(column.to_owned(), text.into());
        }
        self
    }

    /// Several texts in one cell.
    fn texts(mut self, column: &str, texts: Vec<String>) -> Self {
        if !texts.is_empty() {
            self.cells.insert(column.to_owned(), texts.into());
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
        let [column, low, high, grade, because] = graded_columns(quantity);
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
        let row = tau(tau(row, TAU[0], one), TAU[1], two);
        row.graded(TAU_DIFFERENCE, difference.value, difference.interval_95_s, &difference.judgement)
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
        let parameters = effects.iter().flat_map(|found| {
            let effect = found.effect.to_string().replace('-', "_") + &place(&found.fitted_in);
            found.parameters.iter().map(move |number| (stem_and_unit(&effect, number), number))
        });
        parameters.fold(self.texts("effects", effects.iter().map(in_words).collect()), |row, ((stem, unit), number)| {
            row.graded((&stem, &unit), number.value, number.interval_95, &number.judgement)
        })
    }

    fn record(self, record: &RecordAnswer) -> Self {
        let error = record.error.held_out_normalised_rms;
        let mut row = self
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

/// The name of an enum's value in JSON.
fn name(of: impl Serialize) -> String {
    serde_json::to_value(of).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

/// The texts of a cell with several.
fn texts(cell: &Value) -> impl Iterator<Item = &str> {
    cell.as_array().into_iter().flatten().filter_map(Value::as_str)
}

#[cfg(test)]
mod tests {
    use super::Row;

    /// As text, the effects are joined by what the name of a channel may hold as well.
    #[test]
    fn an_effect_is_one_whatever_its_channel_is_called() {
        let row = Row::default().texts("effects", ["delay in a; b", "drift"].map(str::to_owned).to_vec());
        let read: Row = serde_json::from_str(&serde_json::to_string(&row).expect("JSON")).expect("a row");
        assert_eq!(read.effect_names().collect::<Vec<_>>(), ["delay in a; b", "drift"]);
        assert_eq!(read.in_words("effects").as_deref(), Some("delay in a; b; drift"));
    }
}
