//! Columns of a file that go to an output as they are: its dates and times of day, and what `--keep` names.

use std::collections::HashSet;
use std::path::Path;

use twinlag::record::{ColumnRef, Kind, Record, Table};
use twinlag::rows_of_samples;

use crate::console::Console;
use crate::failure::Failure;
use crate::profile::Profile;
use crate::read::table_watched;

/// The word for all columns that are not read as time or temperature.
const ALL: &str = "all";

/// Columns of the file of a record, by the samples of an answer.
pub(crate) struct Kept {
    table: Table,
    columns: Vec<usize>,
    /// The row of each sample.
    rows: Vec<Option<usize>>,
}

impl Kept {
    /// Refuses names of columns that the file does not have, before any work.
    pub(crate) fn check(
        file: &Path,
        profile: &Profile,
        named: &[ColumnRef],
        record: &Record,
        console: Console,
    ) -> Result<(), Failure> {
        if named.is_empty() { Ok(()) } else { Self::of(file, profile, named, record, console).map(drop) }
    }

    /// Reads the file once more; `None` where there is nothing to keep, as of what came from a pipe.
    ///
    /// - `named`: the columns to keep beside dates and times, or `all`
    pub(crate) fn of(
        file: &Path,
        profile: &Profile,
        named: &[ColumnRef],
        record: &Record,
        console: Console,
    ) -> Result<Option<Self>, Failure> {
        if !file.metadata().is_ok_and(|about| about.is_file()) {
            return match named {
                [] => Ok(None),
                _ => Err(Failure::Usage(format!("--keep: {} is no file, and cannot be read twice", file.display()))),
            };
        }
        let table = table_watched(file, &profile.choice(), console)?;
        if table.rows() != record.len() {
            return Err(Failure::File(format!("{}: it has changed while it was read", file.display())));
        }
        let selection = table.resolved(&profile.selection)?;
        let is_stamp = |index: &usize| table.columns()[*index].kind() == Kind::Stamp;
        let mut columns: Vec<usize> = (0..table.columns().len()).filter(is_stamp).collect();
        for name in named {
            if name.to_string() == ALL {
                let read = [&selection.time, &selection.t1, &selection.t2].into_iter().flatten();
                let read: Vec<usize> = read.map(|column| table.find(column)).collect::<Result<_, _>>()?;
                columns.extend((0..table.columns().len()).filter(|index| !read.contains(index)));
            } else {
                columns.push(table.find(name)?);
            }
        }
        let mut seen = HashSet::new();
        columns.retain(|column| seen.insert(*column));
        if columns.is_empty() {
            return Ok(None);
        }
        Ok(Some(Self { columns, rows: rows_of_samples(record), table }))
    }

    /// Their names, each after a comma.
    pub(crate) fn header(&self) -> String {
        let names = self.columns.iter().map(|column| quoted(self.table.columns()[*column].name()));
        names.fold(String::new(), |header, name| header + "," + &name)
    }

    /// Their cells, each after a comma; empty of a sample that is missing in the file, and where the answer has other instants.
    pub(crate) fn cells(&self, sample: usize, samples: usize) -> String {
        let row = self.rows.get(sample).copied().flatten().filter(|_| samples == self.rows.len());
        let cell = |column: &usize| row.map_or(String::new(), |row| quoted(&self.table.cell(*column, row)));
        self.columns.iter().map(cell).fold(String::new(), |cells, cell| cells + "," + &cell)
    }
}

/// A cell of comma-separated text.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// The name and the cells of the last column, with the kept ones after it.
pub(crate) fn with_kept<'a>(
    name: &str,
    cells: impl ExactSizeIterator<Item = String> + 'a,
    kept: Option<&'a Kept>,
) -> (String, impl Iterator<Item = String> + 'a) {
    let header = name.to_owned() + &kept.map_or(String::new(), Kept::header);
    let samples = cells.len();
    let cells = cells
        .enumerate()
        .map(move |(sample, cell)| cell + &kept.map_or(String::new(), |kept| kept.cells(sample, samples)));
    (header, cells)
}
