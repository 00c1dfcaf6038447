//! Which columns the caller wants, and how time is to be taken.

use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, de};

use crate::unit::Unit;

/// A column, by name or by number from 1.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected the name of a column, or its number from 1")]
pub enum ColumnRef {
    /// From 1, from the left. A column with exactly this name goes before.
    Number(usize),
    /// As in the header, with or without its unit.
    Name(String),
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
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
/// the reference is never guessed. Serialised it is a profile, by which other files are read in the same way.
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
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Selection {
    /// The time column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<ColumnRef>,
    /// The unit of a time column of numbers, [`Unit::Time`], which goes before the one in the header; of a clock with two parts, `10:30`, that
    /// of the first.
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "read_unit")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub time_unit: Option<Unit>,
    /// The first sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t1: Option<ColumnRef>,
    /// The second sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub t2: Option<ColumnRef>,
    /// A trusted temperature, if wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<ColumnRef>,
    /// A flow velocity or density, in any unit, if there is one: time constants may go with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flow: Option<ColumnRef>,
    /// The position of sensors that move, m, if there is one: a depth or a height. Time constants may go with their speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<ColumnRef>,
    /// Time from one row to the next; then no time column is used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
    /// How the stamps are to be understood.
    #[serde(skip_serializing_if = "is_auto")]
    pub sampling: SamplingChoice,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn is_auto(choice: &SamplingChoice) -> bool {
    *choice == SamplingChoice::Auto
}

fn read_unit<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Unit>, D::Error> {
    match Option::<String>::deserialize(deserializer)?.map(|text| Unit::parse(&text)) {
        Some(unit @ Unit::Time { .. }) => Ok(Some(unit)),
        None => Ok(None),
        Some(other) => Err(de::Error::custom(format!("expected a unit of time, as ms, found '{other}'"))),
    }
}

impl Selection {
    /// This selection, and where it says nothing what the other one says. A period or a time column goes before both of the other.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let is_timed = self.time.is_some() || self.period_s.is_some();
        // The unit is that of a column.
        let is_same_time = !is_timed || self.time == other.time;
        let time_unit = self.time_unit.or(other.time_unit.filter(|_| is_same_time));
        let (time, period_s) = if is_timed { (self.time, self.period_s) } else { (other.time, other.period_s) };
        let (flow, position) = if self.flow.is_some() || self.position.is_some() {
            (self.flow, self.position)
        } else {
            (other.flow, other.position)
        };
        let sampling = if is_auto(&self.sampling) { other.sampling } else { self.sampling };
        Self {
            time,
            time_unit,
            t1: self.t1.or(other.t1),
            t2: self.t2.or(other.t2),
            reference: self.reference.or(other.reference),
            flow,
            position,
            period_s,
            sampling,
        }
    }
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
    /// [`Selection::sampling`].
    Sampling,
}

impl Setting {
    /// All that name a column.
    pub const COLUMNS: [Self; 6] = [Self::Time, Self::T1, Self::T2, Self::Reference, Self::Flow, Self::Position];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_said_is_what_the_other_says() {
        let column = |name: &str| Some(ColumnRef::Name(name.into()));
        let profile = Selection {
            time: column("t"),
            t1: column("a"),
            t2: column("b"),
            flow: column("u"),
            ..Selection::default()
        };
        let in_ms = Selection { time_unit: Some(Unit::parse("ms")), ..profile.clone() };
        let other_time = Selection { time: column("elapsed"), ..Selection::default() };
        assert_eq!(Selection::default().or(in_ms.clone()).time_unit, in_ms.time_unit);
        assert_eq!((other_time.clone().or(in_ms).time_unit, other_time.time_unit), (None, None));
        let said = Selection { t2: column("c"), period_s: Some(0.5), position: column("z"), ..Selection::default() };
        let want = Selection { t1: column("a"), ..said.clone() };
        assert_eq!(said.or(profile.clone()), want);
        assert_eq!(Selection::default().or(profile.clone()), profile);
    }

    #[test]
    fn a_positive_number_is_a_column_number_and_all_else_a_name() {
        for (text, want) in
            [("3", ColumnRef::Number(3)), ("0", ColumnRef::Name("0".into())), ("T1", ColumnRef::Name("T1".into()))]
        {
            assert_eq!(text.parse(), Ok(want));
        }
    }
}
