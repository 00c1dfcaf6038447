//! A table of cells as it stands in the file, read once; numbers are parsed, everything else is
//! kept as text.

use std::borrow::Cow;
use std::fs;
use std::path::Path;

use crate::cells::{is_idle, lines, lines_from_end, split};
use crate::column::{Column, Kind};
use crate::dialect::{Evidence, Unclear};
use crate::layout::Layout;
use crate::note::Note;
use crate::selection::ColumnRef;
use crate::sign::{Decimal, Delimiter};
use crate::{Place, RecordError, encoding};

/// Delimited text as loggers write it, taken apart: columns of numbers, of date-times, of text.
#[derive(Clone, Debug)]
pub struct Table {
    pub(crate) source: String,
    pub(crate) columns: Vec<Column>,
    pub(crate) places: Places,
    pub(crate) notes: Vec<Note>,
}

/// Where the rows of a table are from.
#[derive(Clone, Debug)]
pub(crate) enum Places {
    /// Line of each row in the file, from 1.
    Lines(Vec<usize>),
    /// That many rows of columns that never were in a file.
    Samples(usize),
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

    /// Takes text apart: encoding, delimiter, decimal sign, preamble, header, unit row and rows are
    /// found by looking.
    ///
    /// - `bytes`: the whole file; UTF-8, UTF-16 with byte-order mark, or Windows-1252
    /// - `source`: its name in messages
    ///
    /// Comment lines (`#`, `%`, `//`), blank lines, a header that comes again and a cut-off very
    /// last line are left out, the latter two with a note. A very last row that no line break
    /// follows is read, with a note. A cell that is not a number is no error here, only when its
    /// column is used.
    ///
    /// # Errors
    /// The variants of [`RecordError`] on binary, empty and one-column input, on ambiguous decimal
    /// signs, on open quotation marks, and on lines with too many or too few cells.
    pub fn read(bytes: &[u8], source: &str) -> Result<Self, RecordError> {
        let (text, encoding) = encoding::decode(bytes, source)?;
        let layout = Layout::find(&text, source)?;
        let decimal = sniff_decimal(&text, &layout, source)?;
        let Layout { delimiter, header_line, .. } = layout;
        let format = Note::Format { delimiter, decimal, encoding, header_line };
        let columns = (0..layout.width).map(|index| {
            Column::new(layout.names.get(index).cloned().unwrap_or_default(), layout.units[index].clone())
        });
        let (columns, places) = (columns.collect(), Places::Lines(Vec::new()));
        let mut table = Self { source: source.to_owned(), columns, places, notes: vec![format] };
        table.fill(&text, &layout, decimal)?;
        for column in &mut table.columns {
            column.judge();
        }
        Ok(table)
    }

    fn fill(&mut self, text: &str, layout: &Layout, decimal: Decimal) -> Result<(), RecordError> {
        let file = || self.source.clone();
        let width = layout.width;
        let (mut cells, mut row_lines) = (Vec::new(), Vec::new());
        let (mut repeated, mut first_repeated) = (0, 0);
        let mut rows = lines(text).skip(layout.first_line - 1).filter(|(_, line)| !is_idle(line)).peekable();
        while let Some((line, content)) = rows.next() {
            let is_last = rows.peek().is_none();
            // A header that comes again begins like no number does, so that good rows need no
            // comparison.
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
                column.push(row_lines.len(), cell, decimal);
            }
            row_lines.push(line);
            if is_last && lines_from_end(text).next() == Some(content) {
                self.notes.push(Note::NoFinalLineBreak { line });
            }
        }
        if repeated > 0 {
            self.notes.push(Note::RepeatedHeader { lines: repeated, first_line: first_repeated });
        }
        self.places = Places::Lines(row_lines);
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
        match &self.places {
            Places::Lines(lines) => lines.len(),
            Places::Samples(rows) => *rows,
        }
    }

    /// Where a row is from: its line in the file, or its number from 1 if the table never was a
    /// file.
    ///
    /// - `row`: from 0. Panics if a file has no such row.
    pub fn place_of(&self, row: usize) -> Place {
        match &self.places {
            Places::Lines(lines) => Place::Line(lines[row]),
            Places::Samples(_) => Place::Sample(row + 1),
        }
    }

    /// Line of each row in the file, from 1, if there is a file.
    pub(crate) fn lines(&self) -> Option<&[usize]> {
        match &self.places {
            Places::Lines(lines) => Some(lines),
            Places::Samples(_) => None,
        }
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
    /// [`RecordError::TextColumn`] if it is text or date-times throughout, else
    /// [`RecordError::NotANumber`] for the first cell that is neither a number nor a word for a
    /// missing one.
    pub fn numbers(&self, index: usize) -> Result<&[f64], RecordError> {
        let column = &self.columns[index];
        let Some((row, cell)) = column.texts.iter().next() else {
            return Ok(&column.values);
        };
        let (file, at) = (self.source.clone(), self.place_of(row));
        let (name, cell) = (self.title(index), shortened(cell));
        Err(if column.kind == Kind::Number {
            RecordError::NotANumber { file, at, column: name, cell }
        } else {
            RecordError::TextColumn { file, at, column: name, cell }
        })
    }

    /// The index, from 0, of a column: by exact name, by name without unit, then both in any case;
    /// by number, unless a column has exactly that name.
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
    const MAX_CHARACTERS: usize = 60;
    if text.chars().count() <= MAX_CHARACTERS {
        return text.to_owned();
    }
    text.chars().take(MAX_CHARACTERS).chain("...".chars()).collect()
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
