//! Which columns the caller wants, and how time is to be taken.

use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;

use crate::unit::Unit;

/// A column, by name or by number from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ColumnRef {
    /// As in the header, with or without its unit.
    Name(String),
    /// From 1, from the left. A column with exactly this name goes before.
    Number(usize),
}

impl FromStr for ColumnRef {
    type Err = Infallible;

    /// A positive whole number is a column number, everything else a name.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        let text = text.trim();
        Ok(match text.parse() {
            Ok(number) if number > 0 => Self::Number(number),
            _ => Self::Name(text.to_owned()),
        })
    }
}

impl fmt::Display for ColumnRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => write!(f, "{name}"),
            Self::Number(number) => write!(f, "{number}"),
        }
    }
}

/// How the stamps are to be understood.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SamplingChoice {
    /// Judge by the stamps.
    #[default]
    Auto,
    /// Samples are evenly spaced, whatever the stamps' small print says.
    Uniform,
    /// Each step is as long as its stamps say.
    AsStamped,
}

/// What to read from a table. What is `None` is guessed from the header, and the guess is noted;
/// the reference is never guessed.
///
/// ```
/// use twinlag_record::{ColumnRef, Record, Selection, Table};
///
/// let text = "\
/// t (s),inlet,bare,sheathed
/// 0,20,20,20
/// 1,25,22,21
/// 2,25,24,22
/// 3,20,22,22
/// 4,22,21,21.5
/// 5,24,23,22
/// 6,21,22.5,22
/// 7,20,21,21.5
/// ";
/// let table = Table::read(text.as_bytes(), "three.csv")?;
/// // A column by its name, and one by its place, from 1.
/// let selection = Selection {
///     t1: Some("bare".parse().expect("any text names a column")),
///     t2: Some(ColumnRef::Number(4)),
///     reference: Some(ColumnRef::Name("inlet".into())),
///     ..Selection::default()
/// };
/// let record = Record::from_table(&table, &selection)?;
/// assert_eq!(record.channels, ["bare", "sheathed"]);
/// assert_eq!(record.reference_c.expect("it was chosen")[..3], [20.0, 25.0, 25.0]);
/// # Ok::<(), twinlag_record::RecordError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// The time column.
    pub time: Option<ColumnRef>,
    /// The unit of a time column of numbers, [`Unit::Time`]; it goes before the one in the header.
    pub time_unit: Option<Unit>,
    /// The first sensor.
    pub t1: Option<ColumnRef>,
    /// The second sensor.
    pub t2: Option<ColumnRef>,
    /// A trusted temperature, if wanted.
    pub reference: Option<ColumnRef>,
    /// A flow velocity or density, in any unit, if there is one: time constants may go with it.
    pub flow: Option<ColumnRef>,
    /// The position of sensors that move, m, if there is one: a depth or a height. Time constants may go with their speed.
    pub position: Option<ColumnRef>,
    /// Time from one row to the next; then no time column is used.
    pub period_s: Option<f64>,
    /// How the stamps are to be understood.
    pub sampling: SamplingChoice,
}

/// One of the things that a [`Selection`] sets and a message may ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Setting {
    /// [`Selection::time`].
    Time,
    /// [`Selection::time_unit`].
    TimeUnit,
    /// [`Selection::t1`].
    T1,
    /// [`Selection::t2`].
    T2,
    /// [`Selection::reference`].
    Reference,
    /// [`Selection::flow`].
    Flow,
    /// [`Selection::position`].
    Position,
    /// [`Selection::period_s`].
    Period,
}

impl Setting {
    /// All that name a column.
    pub const COLUMNS: [Self; 6] = [Self::Time, Self::T1, Self::T2, Self::Reference, Self::Flow, Self::Position];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_positive_number_is_a_column_number_and_all_else_a_name() {
        for (text, want) in
            [("3", ColumnRef::Number(3)), ("0", ColumnRef::Name("0".into())), ("T1", ColumnRef::Name("T1".into()))]
        {
            assert_eq!(text.parse(), Ok(want));
        }
    }
}
