//! A table of columns that a program has in memory: of a binary format, a data frame, a logger that
//! is read directly.
//!
//! From here on nothing knows that it was no text: the choice of columns, units and sampling is
//! that of files.

use jiff::Timestamp;

use crate::RecordError;
use crate::column::{Column, Kind};
use crate::names;
use crate::note::Note;
use crate::sign::Decimal;
use crate::table::{Places, Table, check_columns};
use crate::unit::Unit;

/// A column with its name, its unit and one value for each row.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedColumn {
    name: String,
    unit: String,
    values: Values,
}

#[derive(Clone, Debug, PartialEq)]
enum Values {
    Numbers(Vec<f64>),
    /// Nanoseconds since 1970-01-01, UTC.
    Instants(Vec<Option<i64>>),
    Texts(Vec<String>),
}

impl NamedColumn {
    /// Numbers. NaN and infinities are missing, as the words `NaN` and `inf` are in text.
    ///
    /// - `name`: with or without its unit, as in the header of a file: `T1`, `T1 [°C]`
    pub fn numbers(name: impl Into<String>, values: impl Into<Vec<f64>>) -> Self {
        Self::new(name.into(), Values::Numbers(values.into()))
    }

    /// Instants in nanoseconds since 1970-01-01, UTC, as data frames keep them; `None` where one is
    /// missing.
    ///
    /// - `name`: as of [`NamedColumn::numbers`]
    pub fn instants_ns(name: impl Into<String>, values: impl Into<Vec<Option<i64>>>) -> Self {
        Self::new(name.into(), Values::Instants(values.into()))
    }

    /// Cells of text, read as those of a file with decimal points: numbers, dates and times of day,
    /// words for missing ones.
    ///
    /// - `name`: as of [`NamedColumn::numbers`]
    pub fn texts(name: impl Into<String>, values: impl Into<Vec<String>>) -> Self {
        Self::new(name.into(), Values::Texts(values.into()))
    }

    /// Sets the unit where it stands apart from the name, as `°C`, `K`, `ms`. It goes before one in
    /// the name; an empty one leaves it to the name.
    #[must_use]
    pub fn with_unit(self, unit: impl Into<String>) -> Self {
        Self { unit: unit.into(), ..self }
    }

    /// Whether name and unit are those of a temperature, whatever the values are.
    ///
    /// ```
    /// use twinlag_record::NamedColumn;
    ///
    /// assert!(NamedColumn::numbers("inlet [K]", []).is_called_temperature());
    /// assert!(NamedColumn::numbers("Temp2", []).is_called_temperature());
    /// assert!(!NamedColumn::numbers("Temp2", []).with_unit("mV").is_called_temperature());
    /// ```
    pub fn is_called_temperature(&self) -> bool {
        names::is_called_temperature(&self.head())
    }

    /// Whether name and unit are those of a time, whatever the values are.
    pub fn is_called_time(&self) -> bool {
        names::is_time(&self.head())
    }

    /// The unit of a time in seconds, stated or within the name; `None` if there is none.
    pub fn time_unit_s(&self) -> Option<f64> {
        match self.head().stated_time_unit() {
            Some(Unit::Time { seconds, .. }) => Some(seconds),
            _ => None,
        }
    }

    /// Its head as a column of numbers without values.
    fn head(&self) -> Column {
        let mut column = Column::new(self.name.clone(), Unit::parse(&self.unit));
        column.kind = Kind::Number;
        column
    }

    fn new(name: String, values: Values) -> Self {
        Self { name, unit: String::new(), values }
    }

    fn len(&self) -> usize {
        match &self.values {
            Values::Numbers(values) => values.len(),
            Values::Instants(values) => values.len(),
            Values::Texts(values) => values.len(),
        }
    }

    fn into_column(self) -> Column {
        let mut column = Column::new(self.name, Unit::parse(&self.unit));
        match self.values {
            Values::Numbers(values) => column.take_values(values),
            Values::Instants(values) => {
                for (row, value) in values.into_iter().enumerate() {
                    match value.and_then(|ns| Timestamp::from_nanosecond(ns.into()).ok()) {
                        Some(instant) => column.push_stamp(row, &instant.to_string()),
                        None => column.push_value(None),
                    }
                }
            }
            Values::Texts(values) => {
                for (row, cell) in values.iter().enumerate() {
                    column.push(row, cell.trim(), Decimal::Point);
                }
            }
        }
        column.judge();
        column
    }
}

impl Table {
    /// A table of columns in memory, for [`Record::from_table`](crate::Record::from_table), which
    /// chooses columns, converts units and judges the sampling as it does with files.
    ///
    /// - `source`: its name in messages, in which rows count from 1 as samples
    /// - `columns`: of one length, in any order
    ///
    /// ```
    /// use twinlag_record::{NamedColumn, Record, Selection, Table};
    ///
    /// let second = |k: u32| f64::from(k);
    /// let table = Table::from_columns(
    ///     "engine.mf4",
    ///     [
    ///         NamedColumn::numbers("t", (0..9).map(|k| 2.0 * second(k)).collect::<Vec<_>>()).with_unit("ms"),
    ///         NamedColumn::numbers("T fine", (0..9).map(|k| 293.15 + second(k)).collect::<Vec<_>>()).with_unit("K"),
    ///         NamedColumn::numbers("T coarse", (0..9).map(|k| 20.0 + 0.5 * second(k)).collect::<Vec<_>>()),
    ///     ],
    /// )?;
    /// let record = Record::from_table(&table, &Selection::default())?;
    /// assert_eq!(record.channels, ["T fine", "T coarse"]);
    /// assert_eq!(record.time_s[1], 0.002);
    /// // 273.15 K is no double: the conversion is off by as much as doubles near 300 K lie apart.
    /// assert!((record.t1_c[2] - 22.0).abs() < 300.0 * f64::EPSILON);
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    ///
    /// # Errors
    /// [`RecordError::Empty`] if there is no column or no row, [`RecordError::LengthMismatch`] if
    /// columns differ in length, [`RecordError::TooManyColumns`].
    pub fn from_columns(
        source: impl Into<String>,
        columns: impl IntoIterator<Item = NamedColumn>,
    ) -> Result<Self, RecordError> {
        let file = source.into();
        let columns: Vec<_> = columns.into_iter().collect();
        let title = |index: usize| match columns[index].name.as_str() {
            "" => format!("column {}", index + 1),
            name => format!("column {} '{name}'", index + 1),
        };
        check_columns(columns.len(), &file)?;
        let rows = columns.first().map_or(0, NamedColumn::len);
        if let Some(odd) = columns.iter().position(|column| column.len() != rows) {
            let (name, like, found) = (title(odd), title(0), columns[odd].len());
            return Err(RecordError::LengthMismatch { file, name, found, like, expected: rows });
        }
        if rows == 0 {
            return Err(RecordError::Empty { file });
        }
        let columns = columns.into_iter().map(NamedColumn::into_column).collect();
        Ok(Self { source: file, columns, places: Places::Samples(rows), notes: Vec::new(), text: None })
    }

    /// Adds a note to those of the table, behind the others: of how its columns were read, for
    /// example.
    #[must_use]
    pub fn with_note(mut self, note: Note) -> Self {
        self.notes.push(note);
        self
    }
}
