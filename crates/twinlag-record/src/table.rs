//! A table of cells as it stands in the file, read once; numbers are parsed, everything else is kept as text.

use std::borrow::Cow;
use std::fs;
use std::path::Path;

use crate::cells::{is_idle, lines, lines_from_end, split};
use crate::dialect::{Decimal, Delimiter, Evidence, Unclear};
use crate::layout::Layout;
use crate::note::Note;
use crate::number::{self, Value};
use crate::selection::ColumnRef;
use crate::unit::Unit;
use crate::{RecordError, clock, encoding};

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
    name: String,
    label: String,
    unit: Unit,
    kind: Kind,
    values: Vec<f64>,
    missing: usize,
    texts: Texts,
    /// Numbers too large for a double: as infinities they do not say what stood there.
    beyond: Texts,
}

impl Column {
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

    fn push(&mut self, row: usize, cell: &str, decimal: Decimal) {
        let value = number::read(cell, decimal);
        self.values.push(if let Value::Number(number) = value { number } else { f64::NAN });
        match value {
            Value::Number(number) if number.is_infinite() => self.beyond.push(row, cell),
            Value::Number(_) => {}
            Value::Missing => self.missing += 1,
            Value::Other => self.texts.push(row, cell),
        }
    }

    fn judge(&mut self) {
        let texts = self.texts.places.len();
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

/// Texts of some rows, in one piece of memory: a column of a million stamps is one allocation, not a million.
#[derive(Clone, Debug, Default)]
struct Texts {
    arena: String,
    /// Row, and where its text ends; it begins where the one before ends.
    places: Vec<(usize, usize)>,
}

impl Texts {
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

    fn iter(&self) -> impl Iterator<Item = (usize, &str)> {
        self.places.iter().enumerate().map(|(index, place)| (place.0, self.at(index)))
    }
}

/// Delimited text as loggers write it, taken apart: columns of numbers, of date-times, of text.
#[derive(Clone, Debug)]
pub struct Table {
    source: String,
    columns: Vec<Column>,
    /// Line of each row, from 1.
    row_lines: Vec<usize>,
    notes: Vec<Note>,
}

impl Table {
    /// Reads a file. Its path becomes the name in messages.
    ///
    /// # Errors
    /// [`RecordError::CannotRead`], [`RecordError::IsDirectory`], and those of [`Table::read`].
    pub fn from_path(path: impl AsRef<Path>) -> Result<Self, RecordError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        if path.is_dir() {
            return Err(RecordError::IsDirectory { file });
        }
        match fs::read(path) {
            Ok(bytes) => Self::read(&bytes, &file),
            Err(error) => Err(RecordError::CannotRead { file, reason: error.to_string() }),
        }
    }

    /// Takes text apart: encoding, delimiter, decimal sign, preamble, header, unit row and rows are found by looking.
    ///
    /// - `bytes`: the whole file; UTF-8, UTF-16 with byte-order mark, or Windows-1252
    /// - `source`: its name in messages
    ///
    /// Comment lines (`#`, `%`, `//`), blank lines, a header that comes again and a cut-off very last line are left out,
    /// the latter two with a note. A very last row that no line break follows is read, with a note. A cell that is not a
    /// number is no error here, only when its column is used.
    ///
    /// # Errors
    /// The variants of [`RecordError`] on binary, empty and one-column input, on ambiguous decimal signs, on open
    /// quotation marks, and on lines with too many or too few cells.
    pub fn read(bytes: &[u8], source: &str) -> Result<Self, RecordError> {
        let (text, encoding) = encoding::decode(bytes, source)?;
        let layout = Layout::find(&text, source)?;
        let decimal = sniff_decimal(&text, &layout, source)?;
        let Layout { delimiter, header_line, .. } = layout;
        let format = Note::Format { delimiter, decimal, encoding, header_line };
        let columns = (0..layout.width).map(|index| {
            let name = layout.names.get(index).cloned().unwrap_or_default();
            let (label, unit) = Unit::split_header(&name);
            let row_unit = layout.units[index].clone();
            // A suffix such as `_C` may be part of the name; the unit row is never.
            let unit = if row_unit == Unit::Unstated { unit } else { row_unit };
            let (values, texts, beyond) = (Vec::new(), Texts::default(), Texts::default());
            Column { name, label, unit, kind: Kind::Empty, values, missing: 0, texts, beyond }
        });
        let (columns, row_lines) = (columns.collect(), Vec::new());
        let mut table = Self { source: source.to_owned(), columns, row_lines, notes: vec![format] };
        table.fill(&text, &layout, decimal)?;
        for column in &mut table.columns {
            column.judge();
        }
        Ok(table)
    }

    fn fill(&mut self, text: &str, layout: &Layout, decimal: Decimal) -> Result<(), RecordError> {
        let file = || self.source.clone();
        let width = layout.width;
        let mut cells = Vec::new();
        let (mut repeated, mut first_repeated) = (0, 0);
        let mut rows = lines(text).skip(layout.first_line - 1).filter(|(_, line)| !is_idle(line)).peekable();
        while let Some((line, content)) = rows.next() {
            let is_last = rows.peek().is_none();
            // A header that comes again begins like no number does, so that good rows need no comparison.
            let odd = !content.trim_start().starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
            if odd && layout.head.iter().any(|head| head.trim() == content.trim()) {
                repeated += 1;
                if repeated == 1 {
                    first_repeated = line;
                }
                continue;
            }
            let open = split(content, layout.delimiter, &mut cells).is_err();
            if open && !is_last {
                return Err(RecordError::OpenQuote { file: file(), line });
            }
            let found = cells.len();
            let trailing = found == width + 1 && cells[width].is_empty();
            if open || (is_last && found < width) {
                self.notes.push(Note::CutLine { line, found, expected: width });
                continue;
            }
            if found != width && !trailing {
                let whole = |cell: &Cow<'_, str>| cell.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-');
                let commas = layout.delimiter == Delimiter::Comma && found > width && cells.iter().all(whole);
                return Err(if commas {
                    RecordError::DecimalCommaBetweenCommas { file: file(), line, expected: width, found }
                } else {
                    RecordError::CellCount { file: file(), line, expected: width, found }
                });
            }
            for (column, cell) in self.columns.iter_mut().zip(&cells) {
                column.push(self.row_lines.len(), cell, decimal);
            }
            self.row_lines.push(line);
            if is_last && lines_from_end(text).next() == Some(content) {
                self.notes.push(Note::NoFinalLineBreak { line });
            }
        }
        if repeated > 0 {
            self.notes.push(Note::RepeatedHeader { lines: repeated, first_line: first_repeated });
        }
        Ok(())
    }

    /// The name that the caller gave.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// The columns, from the left.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.row_lines.len()
    }

    /// Line of a row in the file, from 1. Panics if there is no such row.
    pub fn line_of(&self, row: usize) -> usize {
        self.row_lines[row]
    }

    /// What was understood of the file so far.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// The numbers of a column, one per row, in its own unit; missing is NaN.
    ///
    /// - `index`: from 0. Panics if there is no such column.
    ///
    /// # Errors
    /// [`RecordError::TextColumn`] if it is text or date-times throughout, else [`RecordError::NotANumber`] for the
    /// first cell that is neither a number nor a word for a missing one.
    pub fn numbers(&self, index: usize) -> Result<&[f64], RecordError> {
        let column = &self.columns[index];
        let Some((row, cell)) = column.texts.iter().next() else {
            return Ok(&column.values);
        };
        let (file, line) = (self.source.clone(), self.row_lines[row]);
        let (name, cell) = (self.title(index), shortened(cell));
        Err(if column.kind == Kind::Number {
            RecordError::NotANumber { file, line, column: name, cell }
        } else {
            RecordError::TextColumn { file, line, column: name, cell }
        })
    }

    /// The index, from 0, of a column: by exact name, by name without unit, then both in any case; by number, unless a
    /// column has exactly that name.
    ///
    /// # Errors
    /// [`RecordError::UnknownColumn`], [`RecordError::AmbiguousName`].
    pub fn find(&self, wanted: &ColumnRef) -> Result<usize, RecordError> {
        let text = wanted.to_string();
        let by = |same: &dyn Fn(&Column) -> bool| -> Vec<usize> {
            (0..self.columns.len()).filter(|&index| same(&self.columns[index])).collect()
        };
        let lower = text.to_lowercase();
        let exact = by(&|column| !text.is_empty() && column.name == text);
        let found = match wanted {
            _ if !exact.is_empty() => exact,
            ColumnRef::Number(number) => {
                number.checked_sub(1).filter(|&i| i < self.columns.len()).into_iter().collect()
            }
            ColumnRef::Name(_) if text.is_empty() => Vec::new(),
            ColumnRef::Name(_) => {
                let label = by(&|column| column.label == text);
                let any_case =
                    |column: &Column| column.name.to_lowercase() == lower || column.label.to_lowercase() == lower;
                if label.is_empty() { by(&any_case) } else { label }
            }
        };
        match found[..] {
            [index] => Ok(index),
            [] => Err(RecordError::UnknownColumn { file: self.source.clone(), wanted: text, columns: self.listing() }),
            _ => {
                let numbers = found.iter().map(|index| index + 1).collect();
                Err(RecordError::AmbiguousName { file: self.source.clone(), wanted: text, numbers })
            }
        }
    }

    /// A column in messages: `2 'T1 [°C]'`, or `2` if it has no name.
    pub(crate) fn title(&self, index: usize) -> String {
        match self.columns[index].name.as_str() {
            "" => format!("{}", index + 1),
            name => format!("{} '{}'", index + 1, shortened(name)),
        }
    }

    /// All columns in messages.
    pub(crate) fn listing(&self) -> String {
        (0..self.columns.len()).map(|index| self.title(index)).collect::<Vec<_>>().join(", ")
    }
}

/// Enough of a cell to find it, however long it is.
pub(crate) fn shortened(text: &str) -> String {
    const LONGEST: usize = 60;
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    text.chars().take(LONGEST).chain("...".chars()).collect()
}

/// Looks at 500 rows, or at as many more as it takes to see a decimal sign.
fn sniff_decimal(text: &str, layout: &Layout, file: &str) -> Result<Decimal, RecordError> {
    let mut evidence = Evidence::default();
    let mut cells = Vec::new();
    let rows = lines(text).skip(layout.first_line - 1).filter(|(_, line)| !is_idle(line));
    for (row, (line, content)) in rows.enumerate() {
        if row >= 500 && evidence.is_enough() {
            break;
        }
        if split(content, layout.delimiter, &mut cells).is_ok() {
            evidence.add(line, &cells);
        }
    }
    let file = file.to_owned();
    evidence.verdict().map_err(|unclear| match unclear {
        Unclear::Thousands { line, cell } => RecordError::ThousandsOrDecimal { file, line, cell },
        Unclear::Mixed { comma: (comma_line, comma_cell), point: (point_line, point_cell) } => {
            RecordError::MixedDecimals { file, comma_line, comma_cell, point_line, point_cell }
        }
    })
}
