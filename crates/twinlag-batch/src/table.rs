//! The table of a batch: which columns it has, and its rows as delimited text.

use std::collections::BTreeSet;
use std::io::Write;

use crate::error::BatchError;
use crate::group::Unit;
use crate::journal::Answers;
use crate::row::{Cells, Verb, cells_of_parameter};

/// The columns of a table: those of its verb, then those of the parameters that were found, by name.
pub(crate) fn columns(
    units: &[Unit],
    answers: &mut impl Answers,
    verb: Verb,
) -> Result<Vec<(String, Cells)>, BatchError> {
    let mut columns = verb.columns();
    let mut others: BTreeSet<String> = BTreeSet::new();
    for unit in units {
        for row in answers.rows(unit)? {
            let of_verb = |name: &str| columns.iter().any(|(column, _)| column == name);
            others.extend(row.columns().filter(|name| !of_verb(name)).map(str::to_owned));
        }
    }
    columns.extend(others.into_iter().map(|name| {
        let cells = cells_of_parameter(&name);
        (name, cells)
    }));
    Ok(columns)
}

/// Writes the table of a batch as comma-separated text: a header, and the rows in the order of the units. A cell that a row does not
/// have is empty; numbers are the shortest that give the same value.
///
/// # Errors
/// [`BatchError::Table`], [`BatchError::Read`].
pub fn write_csv(units: &[Unit], answers: &mut impl Answers, verb: Verb, out: impl Write) -> Result<(), BatchError> {
    let wrong = |error: csv::Error| BatchError::Table { reason: error.to_string() };
    let columns = columns(units, answers, verb)?;
    let mut table = csv::Writer::from_writer(out);
    table.write_record(columns.iter().map(|(name, _)| name)).map_err(wrong)?;
    for unit in units {
        for row in answers.rows(unit)? {
            table
                .write_record(columns.iter().map(|(name, _)| row.in_words(name).unwrap_or_default().into_owned()))
                .map_err(wrong)?;
        }
    }
    table.flush().map_err(|error| BatchError::Table { reason: error.to_string() })
}
