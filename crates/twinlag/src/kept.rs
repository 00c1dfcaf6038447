//! Columns of a table that go to an output as they are.

use std::collections::HashSet;
use std::io::Write;

use twinlag_record::{
    ColumnRef, Decimals, Kind, Record, RecordError, Selection, Table, TextColumn, write_csv_with_text,
};

use crate::error::Error;
use crate::rows::rows_of_samples;

/// Which columns of a table are kept.
#[derive(Clone, Copy, Debug)]
pub enum Keep<'a> {
    /// Dates and times of day.
    Stamps,
    /// These, and dates and times of day.
    Named(&'a [ColumnRef]),
    /// Every column but those of time and of both sensors, and dates and times of day.
    All,
}

/// Columns of the table of a record, by the samples of an answer: its dates and times of day, and others that are asked for.
///
/// ```
/// use twinlag::{Keep, Kept};
/// use twinlag::record::{Record, Selection, Table};
///
/// let text: String = (0..60).map(|k| format!("2026-05-01 10:00:{k:02},2{}.5,2{}.1,run {k}\n", k % 7, k % 5)).collect();
/// let table = || Table::read(format!("when,T1 (C),T2 (C),note\n{text}").as_bytes(), "run.csv");
/// let record = Record::from_table(&table()?, &Selection::default())?;
/// let kept = Kept::of(table()?, &Selection::default(), Keep::Named(&["note".parse()?]), &record)?.expect("there are stamps");
/// let columns = kept.columns(60);
/// assert_eq!((columns[0].0, (columns[0].1)(7)), ("when", "2026-05-01 10:00:07".to_owned()));
/// assert_eq!((columns[1].0, (columns[1].1)(7)), ("note", "run 7".to_owned()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Kept {
    table: Table,
    columns: Vec<usize>,
    /// The row of each sample.
    rows: Vec<Option<usize>>,
}

impl Kept {
    /// Keeps columns of `table`, which `record` is of; `None` where there is nothing to keep.
    ///
    /// # Errors
    /// [`Error::Record`] of columns that the table does not have, and of a table with other rows than the record.
    pub fn of(table: Table, selection: &Selection, keep: Keep<'_>, record: &Record) -> Result<Option<Self>, Error> {
        if table.rows() != record.len() {
            return Err(Error::Record(RecordError::LengthMismatch {
                file: table.source().to_owned(),
                name: "each column".to_owned(),
                found: table.rows(),
                like: "the record".to_owned(),
                expected: record.len(),
            }));
        }
        let selection = table.resolved(selection)?;
        let is_stamp = |index: &usize| table.columns()[*index].kind() == Kind::Stamp;
        let mut columns: Vec<usize> = (0..table.columns().len()).filter(is_stamp).collect();
        match keep {
            Keep::Stamps => {}
            Keep::Named(names) => {
                let named: Vec<usize> = names.iter().map(|name| table.find(name)).collect::<Result<_, _>>()?;
                columns.extend(named);
            }
            Keep::All => {
                let read = [&selection.time, &selection.t1, &selection.t2].into_iter().flatten();
                let read: Vec<usize> = read.map(|column| table.find(column)).collect::<Result<_, _>>()?;
                columns.extend((0..table.columns().len()).filter(|index| !read.contains(index)));
            }
        }
        let mut seen = HashSet::new();
        columns.retain(|column| seen.insert(*column));
        Ok((!columns.is_empty()).then(|| Self { columns, rows: rows_of_samples(record), table }))
    }

    /// The columns for an answer of so many samples. Cells are empty where the table lacks the sample; all are empty if the answer has
    /// other instants than the record, as their number shows.
    pub fn columns(&self, samples: usize) -> Vec<TextColumn<'_>> {
        let row_of =
            move |sample: usize| self.rows.get(sample).copied().flatten().filter(|_| samples == self.rows.len());
        let cell = move |column: usize, sample: usize| {
            row_of(sample).map_or(String::new(), |row| self.table.cell(column, row))
        };
        let named = |column: &usize| -> TextColumn<'_> {
            let column = *column;
            (self.table.columns()[column].name(), Box::new(move |sample| cell(column, sample)))
        };
        self.columns.iter().map(named).collect()
    }
}

/// Writes numbers as comma-separated text, behind them the grade of each sample and what is kept of the record's table.
pub(crate) fn write_graded(
    out: &mut impl Write,
    numbers: &[(&str, &[f64])],
    grade: impl Fn(usize) -> String,
    kept: Option<&Kept>,
) -> Result<(), RecordError> {
    let samples = numbers.first().map_or(0, |column| column.1.len());
    let grade: TextColumn<'_> = ("grade", Box::new(grade));
    let kept = kept.map(|kept| kept.columns(samples)).unwrap_or_default();
    let text: Vec<TextColumn<'_>> = std::iter::once(grade).chain(kept).collect();
    write_csv_with_text(out, numbers, &text, Decimals::Shortest)
}
