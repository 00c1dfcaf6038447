//! What is in a table of readings, and how it would be read.

use serde::Serialize;
use twinlag_record::{Column, Kind, Record, Sampling, Selection, Table};

/// What is in a table, what would be taken as time and as sensors, and why it cannot be read if it cannot.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Inspection {
    /// `twinlag.inspection/1`.
    pub schema: &'static str,
    /// The file.
    pub file: String,
    /// Rows of the table.
    pub rows: usize,
    /// Columns of the table, from the left.
    pub columns: Vec<InspectedColumn>,
    /// How the file would be read; `null` where it is not clear which columns are meant.
    pub selection: Option<Selection>,
    /// What the record would be; `null` where the file cannot be read as it is.
    pub record: Option<InspectedRecord>,
    /// Why the file cannot be read as it is; `null` where it can.
    pub problem: Option<String>,
    /// What was taken for what, and what was left out.
    pub notes: Vec<String>,
}

/// What is in a column.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct InspectedColumn {
    /// Its number, from 1.
    pub number: usize,
    /// Its name, as in the header.
    pub name: String,
    /// Its unit; empty if none is stated.
    pub unit: String,
    /// `numbers`, `dates or times`, `text` or `empty`.
    pub kind: &'static str,
    /// Cells without a value.
    pub missing: usize,
    /// The smallest of its numbers; `null` where it has none.
    pub minimum: Option<f64>,
    /// The largest of its numbers; `null` where it has none.
    pub maximum: Option<f64>,
    /// `time`, `T1`, `T2`, `reference`, `flow` or `position`.
    pub taken_as: Option<&'static str>,
}

/// What the record would be.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct InspectedRecord {
    /// Number of samples.
    pub samples: usize,
    /// From the first to the last sample, s.
    pub length_s: f64,
    /// How the stamps lie in time.
    pub sampling: Sampling,
    /// Rows in which a reading is missing.
    pub missing: usize,
    /// Stretches without a gap.
    pub stretches: usize,
}

impl Inspection {
    pub(crate) fn of(table: &Table, selection: Option<Selection>) -> Self {
        let roles = selection.as_ref().map_or_else(Vec::new, |selection| roles(table, selection));
        let about = |(index, column): (usize, &Column)| {
            let values = table.numbers(index).unwrap_or_default();
            let known = || values.iter().copied().filter(|value| value.is_finite());
            InspectedColumn {
                number: index + 1,
                name: column.name().to_owned(),
                unit: column.unit().to_string(),
                kind: match column.kind() {
                    Kind::Number => "numbers",
                    Kind::Stamp => "dates or times",
                    Kind::Empty => "empty",
                    _ => "text",
                },
                missing: column.missing(),
                minimum: known().reduce(f64::min),
                maximum: known().reduce(f64::max),
                taken_as: roles.iter().find(|(_, taken)| *taken == index).map(|(role, _)| *role),
            }
        };
        Self {
            schema: "twinlag.inspection/1",
            file: table.source().to_owned(),
            rows: table.rows(),
            columns: table.columns().iter().enumerate().map(about).collect(),
            selection,
            record: None,
            problem: None,
            notes: table.notes().iter().map(ToString::to_string).collect(),
        }
    }
}

impl InspectedRecord {
    pub(crate) fn of(record: &Record) -> Self {
        Self {
            samples: record.len(),
            length_s: record.length_s(),
            sampling: record.sampling,
            missing: record.missing,
            stretches: record.segments.len(),
        }
    }
}

/// What columns are taken as, each with the place of its column.
fn roles(table: &Table, selection: &Selection) -> Vec<(&'static str, usize)> {
    let Selection { time, t1, t2, reference, flow, position, .. } = selection;
    let wanted =
        [("time", time), ("T1", t1), ("T2", t2), ("reference", reference), ("flow", flow), ("position", position)];
    wanted.into_iter().filter_map(|(role, column)| Some((role, table.find(column.as_ref()?).ok()?))).collect()
}
