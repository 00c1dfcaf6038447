//! What the header of a known program says of the rows under it, so that it need not be guessed.

use std::borrow::Cow;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::number;
use crate::serial::Wrapping;
use crate::sign::Decimal;

/// A program, or an instrument, whose files are known by their first lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Program {
    /// Sea-Bird's data processing: `.cnv`.
    SeaBird,
    /// LabVIEW's measurement file: `.lvm`.
    LabView,
    /// A serial monitor, which puts a time before each line, or a line for the serial plotter of Arduino, with a name before each
    /// number.
    Serial,
}

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SeaBird => "a Sea-Bird .cnv file",
            Self::LabView => "a LabVIEW measurement file",
            Self::Serial => "the log of a serial monitor or plotter",
        })
    }
}

/// How the lines of a file are written, beyond the sign between its cells.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Form {
    pub(crate) program: Option<Program>,
    /// The decimal sign, where the header names it.
    pub(crate) decimal: Option<Decimal>,
    /// The number that stands for a missing one.
    pub(crate) missing: Option<f64>,
    /// Number of rows, where the header names it.
    pub(crate) rows: Option<usize>,
    /// From row to row, where the header names it.
    pub(crate) period_s: Option<f64>,
    /// Whether a comment may stand behind the last cell.
    pub(crate) has_comments: bool,
    /// Cells, and characters of each, of lines in which numbers that are wide enough touch each other.
    pub(crate) fixed: Option<FixedWidth>,
    /// What stands around the cells of each line.
    pub(crate) wrapping: Option<Wrapping>,
}

/// Cells that all take the same number of characters, the number on the right of each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FixedWidth {
    pub(crate) cells: usize,
    pub(crate) characters: usize,
}

impl FixedWidth {
    /// A line with a blank between any two cells, whether there was one or not.
    fn parted<'a>(&self, line: &'a str) -> Cow<'a, str> {
        let whole = line.trim_end();
        let is_fixed = whole.is_ascii() && whole.len() == self.cells * self.characters;
        if !is_fixed || whole.split_ascii_whitespace().count() == self.cells {
            return Cow::Borrowed(line);
        }
        let cell = |index: usize| &whole[index * self.characters..(index + 1) * self.characters];
        Cow::Owned((0..self.cells).map(cell).collect::<Vec<_>>().join(" "))
    }
}

impl Form {
    /// Whether each line has a time of arrival, which stands behind its cells.
    pub(crate) fn is_stamped(&self) -> bool {
        self.wrapping.as_ref().is_some_and(Wrapping::is_stamped)
    }

    /// A line of cells that are parted, without what stands around them.
    pub(crate) fn unwrap<'a>(&self, line: &'a str) -> Cow<'a, str> {
        match (&self.wrapping, &self.fixed) {
            (Some(wrapping), _) => wrapping.unwrap(line),
            (None, Some(fixed)) => fixed.parted(line),
            (None, None) => Cow::Borrowed(line),
        }
    }

    /// Whether this cell may stand behind those of the columns.
    pub(crate) fn may_follow(&self, cell: &str) -> bool {
        cell.is_empty() || self.has_comments
    }

    /// A cell; an empty one in place of the number that stands for a missing one.
    pub(crate) fn cell<'a>(&self, cell: &'a str, decimal: Decimal) -> &'a str {
        if self.missing.is_some() && number::parse(cell, decimal) == self.missing { "" } else { cell }
    }

    /// A number, if it does not stand for a missing one.
    pub(crate) fn present(&self, value: f64) -> Option<f64> {
        Some(value).filter(|value| Some(*value) != self.missing)
    }
}
