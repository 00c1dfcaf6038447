//! A table of cells as it stands in the file, read once; numbers are parsed, everything else is
//! kept as text.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use encoding_rs::Encoding;
use serde::{Deserialize, Serialize};

use crate::cells::{is_idle, line_end, lines, split};
use crate::column::{Column, Kind};
use crate::dialect::{Evidence, Unclear};
use crate::fill::Filling;
use crate::form::Form;
use crate::layout::Layout;
use crate::note::Note;
use crate::parts::Parts;
use crate::row_lines::RowLines;
use crate::selection::ColumnRef;
use crate::sign::{Decimal, Delimiter};
use crate::wording::enumerated;
use crate::{Place, RecordError, encoding, gzip};

/// Longest line that is read, in bytes. What has no line breaks would otherwise fill the memory.
pub const MAX_LINE_BYTES: usize = 1 << 20;
/// Most columns that are read; chosen: beyond what any logger writes, and no more than a page can list.
const MAX_COLUMNS: usize = 10_000;

/// Delimited text as loggers write it, taken apart: columns of numbers, of date-times, of text.
#[derive(Clone, Debug)]
pub struct Table {
    pub(crate) source: String,
    pub(crate) columns: Vec<Column>,
    pub(crate) places: Places,
    pub(crate) notes: Vec<Note>,
    pub(crate) text: Option<Text>,
}

/// How the lines of a file of text are taken apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Text {
    pub(crate) delimiter: Delimiter,
    pub(crate) decimal: Decimal,
    pub(crate) form: Form,
}

/// Where the rows of a table are from.
#[derive(Clone, Debug)]
pub(crate) enum Places {
    /// Line of each row in the file, from 1.
    Lines(RowLines),
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
        match File::open(path) {
            Ok(opened) => Self::from_reader(opened, &file),
            Err(error) => Err(RecordError::CannotRead { file, reason: error.to_string() }),
        }
    }

    /// Takes text apart: encoding, delimiter, decimal sign, preamble, header, unit row and rows are
    /// found by looking.
    ///
    /// - `bytes`: the whole file; UTF-8, UTF-16 with byte-order mark, Shift_JIS or Windows-1252
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
        let look = Look::at(&text, source)?;
        let mut filling = Filling::new(source, &look.layout, look.decimal);
        let end = line_end(&text) as u8;
        filling.take(&text, end)?;
        filling.end(!text.as_bytes().ends_with(&[end]))?;
        Ok(Self::of(filling, encoding))
    }

    /// Reads text as it comes, without keeping it: what is found by looking is found in the first
    /// 4 MiB, and must hold for all lines after them. What is compressed by gzip is decompressed. Otherwise as [`Table::read`].
    ///
    /// ```
    /// let text = "time,T1,T2\n".to_owned() + &(0..9).map(|k| format!("{k},20.5,21\n")).collect::<String>();
    /// let table = twinlag_record::Table::from_reader(text.as_bytes(), "a pipe")?;
    /// assert_eq!((table.rows(), table.columns()[1].name()), (9, "T1"));
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    ///
    /// - `source`: its name in messages
    ///
    /// # Errors
    /// [`RecordError::CannotRead`], [`RecordError::EncodingChanges`], [`RecordError::FewerRows`], and those of [`Table::read`].
    pub fn from_reader(reader: impl Read, source: &str) -> Result<Self, RecordError> {
        let (reader, is_compressed) = gzip::decompressed(reader).map_err(|error| gzip::failure(source, &error))?;
        let mut parts = Parts::new(reader, source);
        let first = parts.first()?;
        let Some(first) = first else {
            return Self::read(&parts.all()?, source)?.noting_compression(is_compressed).whole();
        };
        let look = Look::at(&first, source)?;
        let mut filling = Filling::new(source, &look.layout, look.decimal);
        filling.take(&first, b'\n')?;
        drop(first);
        while let Some(part) = parts.next(filling.seen())? {
            filling.take(&part, b'\n')?;
        }
        filling.end(parts.is_open())?;
        Self::of(filling, parts.encoding()).noting_compression(is_compressed).whole()
    }

    /// The table, if it has as many rows as the header of the file declares.
    fn whole(self) -> Result<Self, RecordError> {
        let declared = self.text.as_ref().and_then(|text| text.form.rows).unwrap_or(0);
        if self.rows() < declared {
            return Err(RecordError::FewerRows { file: self.source.clone(), declared, found: self.rows() });
        }
        Ok(self)
    }

    fn noting_compression(mut self, is_compressed: bool) -> Self {
        if is_compressed {
            self.notes.insert(0, Note::Decompressed);
        }
        self
    }

    fn of(filling: Filling<'_>, encoding: &'static Encoding) -> Self {
        let Filling { source, layout, decimal, mut columns, lines, mut notes, .. } = filling;
        let Layout { delimiter, header_line, ref form, .. } = *layout;
        notes.insert(
            0,
            Note::Format { delimiter, decimal, encoding: encoding.name(), header_line, program: form.program },
        );
        columns.iter_mut().for_each(Column::judge);
        let text = Some(Text { delimiter, decimal, form: form.clone() });
        Self { source: source.to_owned(), columns, places: Places::Lines(lines), notes, text }
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
            Places::Lines(lines) => Place::Line(lines.of(row)),
            Places::Samples(_) => Place::Sample(row + 1),
        }
    }

    /// Line of each row in the file, from 1, if there is a file.
    pub(crate) fn lines(&self) -> Option<&RowLines> {
        match &self.places {
            Places::Lines(lines) => Some(lines),
            Places::Samples(_) => None,
        }
    }

    /// Lets go of the numbers of all columns but these.
    pub(crate) fn keep_values_of(&mut self, columns: &[usize]) {
        let rest = self.columns.iter_mut().enumerate().filter(|(index, _)| !columns.contains(index));
        rest.for_each(|(_, column)| column.values = Vec::new());
    }

    /// Moves the numbers of a column out of the table.
    pub(crate) fn take_values(&mut self, index: usize) -> Vec<f64> {
        let mut values = std::mem::take(&mut self.columns[index].values);
        values.shrink_to_fit();
        values
    }

    /// Time from row to row, where the file states it.
    pub(crate) fn period_s(&self) -> Option<f64> {
        self.text.as_ref().and_then(|text| text.form.period_s)
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

    /// A cell as text, a number in the shortest form that reads back the same; empty where it is missing.
    ///
    /// - `index`, `row`: from 0. Panics if there is no such column or row.
    ///
    /// ```
    /// use twinlag_record::Table;
    ///
    /// let table = Table::read(b"when;T1;rpm\n2026-01-31 12:00;20,50;1500\n2026-01-31 12:01;20,75;\n", "run.csv")?;
    /// assert_eq!([table.cell(0, 1), table.cell(1, 1), table.cell(2, 1)], ["2026-01-31 12:01", "20.75", ""]);
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    pub fn cell(&self, index: usize, row: usize) -> String {
        let column = &self.columns[index];
        let number = || Some(column.values[row]).filter(|value| value.is_finite()).map(|value| value.to_string());
        column.text(row).map(str::to_owned).or_else(number).unwrap_or_default()
    }

    /// What stands in all rows of a column, if that is the same from the first to the last: a serial number, a name.
    ///
    /// - `index`: from 0. Panics if there is no such column.
    ///
    /// ```
    /// use twinlag_record::Table;
    ///
    /// let table = Table::read(b"time,T1,serial\n0,20.1,TC-7\n1,20.2,TC-7\n", "run.csv")?;
    /// assert_eq!(table.constant(2), Some("TC-7".to_owned()));
    /// assert_eq!(table.constant(1), None);
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    pub fn constant(&self, index: usize) -> Option<String> {
        let column = &self.columns[index];
        let mut texts = column.texts.iter().map(|(_, text)| text);
        if let Some(first) = texts.next() {
            let is_in_all_rows = column.texts.len() == self.rows() && texts.all(|text| text == first);
            return is_in_all_rows.then(|| first.to_owned());
        }
        let first = column.values.first().filter(|value| value.is_finite())?;
        column.values.iter().all(|value| value == first).then(|| first.to_string())
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

    /// The columns in messages.
    pub(crate) fn listing(&self) -> String {
        enumerated(self.columns.len(), |index| self.title(index))
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

/// What is found by looking at the lines of a file, or at the first of them.
struct Look {
    layout: Layout,
    decimal: Decimal,
}

impl Look {
    fn at(text: &str, source: &str) -> Result<Self, RecordError> {
        let too_long = lines(text).find(|(_, line)| line.len() > MAX_LINE_BYTES);
        if let Some((line, _)) = too_long {
            return Err(RecordError::LongLine { file: source.to_owned(), line, most: MAX_LINE_BYTES });
        }
        let layout = Layout::find(text, source)?;
        check_columns(layout.width, source)?;
        let decimal = layout.form.decimal.map_or_else(|| sniff_decimal(text, &layout, source), Ok)?;
        Ok(Self { layout, decimal })
    }
}

/// That no more columns are there than are read.
pub(crate) fn check_columns(found: usize, source: &str) -> Result<(), RecordError> {
    if found > MAX_COLUMNS {
        return Err(RecordError::TooManyColumns { file: source.to_owned(), found, most: MAX_COLUMNS });
    }
    Ok(())
}

/// Looks at 500 rows, or at as many more as it takes to see a decimal sign.
fn sniff_decimal(text: &str, layout: &Layout, file: &str) -> Result<Decimal, RecordError> {
    let mut evidence = Evidence::default();
    let rows = lines(text).skip(layout.first_line - 1).filter(|(_, line)| !is_idle(line));
    for (row, (line, content)) in rows.enumerate() {
        if row >= 500 && evidence.is_enough() {
            break;
        }
        let mut cells = Vec::new();
        let content = layout.form.unwrap(content);
        if split(&content, layout.delimiter, &mut cells).is_ok() {
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
