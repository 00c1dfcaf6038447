//! Rows that come after those of a table, one line at a time, as a live pipe delivers them.

use serde::{Deserialize, Serialize};

use crate::cells::{is_idle, split};
use crate::choose::choose;
use crate::column::Kind;
use crate::form::Form;
use crate::number::{self, Value};
use crate::record::TEMPERATURE_RANGE_C;
use crate::selection::Selection;
use crate::sign::{Decimal, Delimiter};
use crate::table::{Table, Text, shortened};
use crate::time_axis::{self, TimeColumns, seconds};
use crate::unit::Unit;
use crate::wrap::CountingOn;
use crate::{Place, RecordError};

/// One row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time since the first row of the table, s, counted on where a counter of 16 or 32 bits begins anew; `None` where the time column
    /// holds no plain numbers, or there is none.
    pub time_s: Option<f64>,
    /// Both temperatures, °C; `None` for one that is missing.
    pub reading_c: [Option<f64>; 2],
}

/// Reads further lines in the way that the first ones were read. It can be kept, as JSON for example, while no lines come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RowReader {
    source: String,
    text: Text,
    width: usize,
    time: Option<Time>,
    channels: [Channel; 2],
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Time {
    index: usize,
    first: f64,
    unit_s: f64,
    counting: CountingOn,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Channel {
    index: usize,
    /// As the header has it.
    name: String,
    title: String,
    unit: Unit,
}

impl RowReader {
    /// For lines that come after those of `table`, of which `selection` chose the columns.
    ///
    /// ```
    /// use twinlag_record::{RowReader, Selection, Table};
    ///
    /// let start = "time_ms;T1_K;T2_K\n1000;293,15;293,15\n1010;294,15;293,40\n1020;294,65;293,65\n";
    /// let table = Table::read(start.as_bytes(), "logger")?;
    /// let mut rows = RowReader::after(&table, &Selection::default())?;
    /// // Semicolons, decimal commas, milliseconds and kelvin are those of the first lines.
    /// let row = rows.read("1030;295,15;---\n", 5)?.expect("not a comment");
    /// assert_eq!(row.time_s, Some(0.03));
    /// assert!((row.reading_c[0].expect("there is one") - 22.0).abs() < 1e-9); // 295.15 is not exact in binary
    /// assert_eq!(row.reading_c[1], None);
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    ///
    /// # Errors
    /// As [`crate::Record::from_table`] on columns that cannot be identified.
    pub fn after(table: &Table, selection: &Selection) -> Result<Self, RecordError> {
        let chosen = choose(table, selection, &mut Vec::new())?;
        let usual = || Text { delimiter: Delimiter::Comma, decimal: Decimal::Point, form: Form::default() };
        let text = table.text.clone().unwrap_or_else(usual);
        let column = |index: usize| &table.columns()[index];
        let time = match chosen.time {
            Some(TimeColumns::One(index)) if column(index).kind() == Kind::Number => {
                let unit_s = time_axis::unit_of(table, index, selection.time_unit.as_ref(), &mut Vec::new())?.1;
                let first = column(index).raw().first().copied().unwrap_or(0.0);
                Some(Time { index, first, unit_s, counting: CountingOn::behind(column(index).raw()) })
            }
            _ => None,
        };
        let channels = chosen.channels.map(|index| Channel {
            index,
            name: column(index).name().to_owned(),
            title: table.title(index),
            unit: column(index).unit().clone(),
        });
        let width = table.columns().len();
        Ok(Self { source: table.source().to_owned(), text, width, time, channels })
    }

    /// This reader for lines of another source, which errors name.
    #[must_use]
    pub fn of_source(self, source: impl Into<String>) -> Self {
        Self { source: source.into(), ..self }
    }

    /// The row of line `number`, from 1; `None` for a blank or a comment, and for the header of a logger that was started again.
    ///
    /// # Errors
    /// [`RecordError::CellCount`], [`RecordError::OpenQuote`], [`RecordError::NotANumber`],
    /// [`RecordError::OutOfRange`]: what the row says is not known then, those after it can still
    /// be read.
    pub fn read(&mut self, line: &str, number: usize) -> Result<Option<Row>, RecordError> {
        let line = line.trim_end_matches(['\n', '\r']);
        let (form, decimal) = (&self.text.form, self.text.decimal);
        let line = &*form.unwrap(line);
        if is_idle(line) {
            return Ok(None);
        }
        let file = || self.source.clone();
        let mut cells = Vec::with_capacity(self.width + 1);
        split(line, self.text.delimiter, &mut cells)
            .map_err(|_| RecordError::OpenQuote { file: file(), line: number })?;
        let found = cells.len();
        if found != self.width && !(found == self.width + 1 && form.may_follow(&cells[self.width])) {
            return Err(RecordError::CellCount { file: file(), line: number, expected: self.width, found });
        }
        let cell_of = |channel: &Channel| cells.get(channel.index).map_or("", AsRef::as_ref);
        let is_name = |channel: &Channel| !channel.name.is_empty() && cell_of(channel).trim() == channel.name.trim();
        if self.channels.iter().all(is_name) {
            return Ok(None);
        }
        let reading = |channel: &Channel| {
            let cell = cell_of(channel);
            let column = channel.title.clone();
            let value = match number::read(form.cell(cell, decimal), decimal) {
                Value::Missing => return Ok(None),
                Value::Number(value) => value,
                Value::Other => {
                    let cell = shortened(cell);
                    return Err(RecordError::NotANumber { file: file(), at: Place::Line(number), column, cell });
                }
            };
            match channel.unit.to_celsius(value) {
                Some(c) if TEMPERATURE_RANGE_C.contains(&c) => Ok(Some(c)),
                _ => {
                    let (at, unit) = (Place::Line(number), channel.unit.symbol());
                    Err(RecordError::OutOfRange { file: file(), at, column, value, cell: None, unit })
                }
            }
        };
        let reading_c = [reading(&self.channels[0])?, reading(&self.channels[1])?];
        let time_s = self.time.as_mut().and_then(|time| {
            match number::read(cells.get(time.index).map_or("", AsRef::as_ref), decimal) {
                Value::Number(value) => {
                    let value = time.counting.next(value);
                    Some(seconds(value - time.first, time.unit_s)).filter(|t| t.is_finite())
                }
                Value::Missing | Value::Other => None,
            }
        });
        Ok(Some(Row { time_s, reading_c }))
    }
}
