//! One column of a table: numbers, and whatever else its cells hold.

use crate::clock;
use crate::number::{self, Value};
use crate::sign::Decimal;
use crate::unit::Unit;

/// What the cells of a column are for the most part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Numbers.
    Number,
    /// Dates, times of day, or both.
    Stamp,
    /// Anything else.
    Text,
    /// Nothing at all: every cell is missing.
    Empty,
}

/// One column.
#[derive(Clone, Debug)]
pub struct Column {
    pub(crate) name: String,
    pub(crate) label: String,
    unit: Unit,
    pub(crate) kind: Kind,
    pub(crate) values: Vec<f64>,
    missing: usize,
    pub(crate) texts: Texts,
    /// Numbers too large for a double: as infinities they do not say what stood there.
    beyond: Texts,
}

impl Column {
    /// An empty column.
    ///
    /// - `name`: as in the header, with or without a unit
    /// - `unit`: the unit where it stands apart from the name; [`Unit::Unstated`] leaves it to the
    ///   name
    pub(crate) fn new(name: String, unit: Unit) -> Self {
        let (label, of_name) = Unit::split_header(&name);
        // A suffix such as `_C` may be part of the name; a unit that stands apart never is.
        let unit = if unit == Unit::Unstated { of_name } else { unit };
        let (values, texts, beyond) = (Vec::new(), Texts::default(), Texts::default());
        Self { name, label, unit, kind: Kind::Empty, values, missing: 0, texts, beyond }
    }

    /// Takes a value, which becomes that of the next row; `None` is a missing one.
    pub(crate) fn push_value(&mut self, value: Option<f64>) {
        self.missing += usize::from(value.is_none());
        self.values.push(value.unwrap_or(f64::NAN));
    }

    /// Takes the values of all rows; those that are not finite are missing.
    pub(crate) fn take_values(&mut self, mut values: Vec<f64>) {
        for value in values.iter_mut().filter(|value| !value.is_finite()) {
            *value = f64::NAN;
            self.missing += 1;
        }
        self.values = values;
    }

    /// Takes the text of a stamp, which becomes the value of row `row`, the next one.
    pub(crate) fn push_stamp(&mut self, row: usize, text: &str) {
        self.values.push(f64::NAN);
        self.texts.push(row, text);
    }

    /// The name as in the header; empty if there is none.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name without its unit: `T1` for `T1 [°C]` and for `T1_C`.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// The unit from the header or the unit row.
    pub fn unit(&self) -> &Unit {
        &self.unit
    }

    /// The unit of time in which its header says that it counts, behind its name or within it, as in `elapsedMillis`.
    pub(crate) fn stated_time_unit(&self) -> Option<Unit> {
        match self.unit {
            Unit::Time { .. } => Some(self.unit.clone()),
            Unit::Unstated => Unit::of_time_named(&self.name),
            _ => None,
        }
    }

    /// What the cells are for the most part.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// How many cells are missing.
    pub fn missing(&self) -> usize {
        self.missing
    }

    /// The numbers, one per row, in the file's unit; NaN where the cell is missing or is no number.
    pub(crate) fn raw(&self) -> &[f64] {
        &self.values
    }

    /// The text of a cell that is neither a number nor missing.
    pub(crate) fn text(&self, row: usize) -> Option<&str> {
        self.texts.get(row)
    }

    /// The text of a cell that is a number too large for a double.
    pub(crate) fn beyond(&self, row: usize) -> Option<&str> {
        self.beyond.get(row)
    }

    /// Takes a cell of text, which becomes the value of row `row`, the next one.
    pub(crate) fn push(&mut self, row: usize, cell: &str, decimal: Decimal) {
        let value = number::read(cell, decimal);
        self.values.push(if let Value::Number(number) = value { number } else { f64::NAN });
        match value {
            Value::Number(number) if number.is_infinite() => self.beyond.push(row, cell),
            Value::Number(_) => {}
            Value::Missing => self.missing += 1,
            Value::Other => self.texts.push(row, cell),
        }
    }

    /// Decides what kind of column it is, from all of its cells.
    pub(crate) fn judge(&mut self) {
        let texts = self.texts.len();
        let numbers = self.values.len() - self.missing - texts;
        let stamps = self.texts.iter().take(100).filter(|(_, text)| clock::parse(text).is_some()).count();
        self.kind = match numbers + texts {
            0 => Kind::Empty,
            _ if numbers >= texts => Kind::Number,
            _ if 2 * stamps > texts.min(100) => Kind::Stamp,
            _ => Kind::Text,
        };
    }
}

/// Texts of some rows, in one piece of memory: a column of a million stamps is one allocation, not
/// a million.
#[derive(Clone, Debug, Default)]
pub(crate) struct Texts {
    arena: String,
    /// Row, and where its text ends; it begins where the one before ends.
    places: Vec<(usize, usize)>,
}

impl Texts {
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    fn push(&mut self, row: usize, text: &str) {
        self.arena.push_str(text);
        self.places.push((row, self.arena.len()));
    }

    fn at(&self, index: usize) -> &str {
        let start = index.checked_sub(1).map_or(0, |before| self.places[before].1);
        &self.arena[start..self.places[index].1]
    }

    fn get(&self, row: usize) -> Option<&str> {
        self.places.binary_search_by_key(&row, |place| place.0).ok().map(|index| self.at(index))
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, &str)> {
        self.places.iter().enumerate().map(|(index, place)| (place.0, self.at(index)))
    }
}
