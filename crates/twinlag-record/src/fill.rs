//! Rows into columns, line by line and in one pass: what the look at the first lines found holds for all of them, or the line is
//! refused.

use std::borrow::Cow;

use crate::RecordError;
use crate::cells::{is_idle, split};
use crate::column::Column;
use crate::form::Program;
use crate::lab_view;
use crate::layout::Layout;
use crate::note::Note;
use crate::row_lines::RowLines;
use crate::sign::{Decimal, Delimiter};

/// Takes the lines of a file, in parts of any length.
pub(crate) struct Filling<'a> {
    pub(crate) source: &'a str,
    pub(crate) layout: &'a Layout,
    pub(crate) decimal: Decimal,
    pub(crate) columns: Vec<Column>,
    pub(crate) lines: RowLines,
    pub(crate) notes: Vec<Note>,
    /// Lines that were seen.
    seen: usize,
    /// The last line that may be a row, which may be the last of all, and its number.
    held: Option<(usize, String)>,
    /// Headers that came again.
    repeated: LeftOut,
    /// Lines of a serial log that are no rows.
    messages: LeftOut,
    /// Lines of a serial log that lack a part.
    cut: LeftOut,
    /// The numbers of a row.
    row: Vec<f64>,
}

/// Lines that are left out.
#[derive(Default)]
struct LeftOut {
    lines: usize,
    /// The first of them, from 1.
    first_line: usize,
}

impl LeftOut {
    fn add(&mut self, line: usize) {
        if self.lines == 0 {
            self.first_line = line;
        }
        self.lines += 1;
    }
}

impl<'a> Filling<'a> {
    pub(crate) fn new(source: &'a str, layout: &'a Layout, decimal: Decimal) -> Self {
        let column = |index: usize| {
            Column::new(layout.names.get(index).cloned().unwrap_or_default(), layout.units[index].clone())
        };
        Self {
            source,
            layout,
            decimal,
            columns: (0..layout.width).map(column).collect(),
            lines: RowLines::default(),
            notes: Vec::new(),
            seen: 0,
            held: None,
            repeated: LeftOut::default(),
            messages: LeftOut::default(),
            cut: LeftOut::default(),
            row: vec![0.0; layout.width],
        }
    }

    /// Lines that were seen.
    pub(crate) fn seen(&self) -> usize {
        self.seen
    }

    /// Takes whole lines, of which each ends with `end`, except perhaps the very last one of the file.
    ///
    /// # Errors
    /// [`RecordError::OpenQuote`], [`RecordError::CellCount`], [`RecordError::DecimalCommaBetweenCommas`].
    pub(crate) fn take(&mut self, text: &str, end: u8) -> Result<(), RecordError> {
        let held = self.held.take();
        let mut before = held.as_ref().map(|(number, line)| (*number, line.as_str()));
        let mut rest = text;
        while !rest.is_empty() {
            let at = memchr::memchr(end, rest.as_bytes());
            let (line, after) = at.map_or((rest, ""), |at| (&rest[..at], &rest[at + 1..]));
            rest = after;
            self.seen += 1;
            let line = line.trim_end_matches('\r');
            if self.seen < self.layout.first_line || is_idle(line) {
                continue;
            }
            if let Some((number, line)) = before.replace((self.seen, line)) {
                self.row(number, line, false)?;
            }
        }
        self.held = before.map(|(number, line)| (number, line.to_owned()));
        Ok(())
    }

    /// Takes the last line.
    ///
    /// - `is_open`: whether no line break follows the last line of the file
    ///
    /// # Errors
    /// As [`Self::take`].
    pub(crate) fn end(&mut self, is_open: bool) -> Result<(), RecordError> {
        if let Some((line, content)) = self.held.take() {
            let before = self.lines.len();
            self.row(line, &content, true)?;
            if is_open && line == self.seen && self.lines.len() > before {
                self.notes.push(Note::NoFinalLineBreak { line });
            }
        }
        let LeftOut { lines, first_line } = self.repeated;
        if lines > 0 {
            self.notes.push(Note::RepeatedHeader { lines, first_line });
        }
        let LeftOut { lines, first_line } = self.messages;
        if lines > 0 {
            self.notes.push(Note::Messages { lines, first_line });
        }
        let LeftOut { lines, first_line } = self.cut;
        if lines > 0 {
            self.notes.push(Note::CutRows { lines, first_line });
        }
        Ok(())
    }

    fn row(&mut self, line: usize, content: &str, is_last: bool) -> Result<(), RecordError> {
        let form = &self.layout.form;
        let content = &*form.unwrap(content);
        if is_idle(content) {
            self.messages.add(line);
            return Ok(());
        }
        if self.decimal == Decimal::Point && plain_numbers(content.as_bytes(), self.layout.delimiter, &mut self.row) {
            self.columns.iter_mut().zip(&self.row).for_each(|(column, value)| column.push_value(form.present(*value)));
            self.lines.push(line);
            return Ok(());
        }
        // A header that comes again begins like no number does, so that good rows need no comparison.
        let odd = !content.trim_start().starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        if odd && self.layout.head.iter().any(|head| head.trim() == content.trim()) {
            self.repeated.add(line);
            return Ok(());
        }
        let (file, width) = (|| self.source.to_owned(), self.layout.width);
        let mut cells: Vec<Cow<'_, str>> = Vec::with_capacity(width + 1);
        let open = split(content, self.layout.delimiter, &mut cells).is_err();
        if open && !is_last {
            return Err(RecordError::OpenQuote { file: file(), line });
        }
        let found = cells.len();
        let trailing = found == width + 1 && form.may_follow(&cells[width]);
        if open || (is_last && found < width) {
            self.notes.push(Note::CutLine { line, found, expected: width });
            return Ok(());
        }
        if form.program == Some(Program::LabView) && lab_view::begins_another(content) {
            return Err(RecordError::SecondMeasurement { file: file(), line });
        }
        if found < width && form.program == Some(Program::Serial) && form.is_stamped() {
            // What is left of a number may be taken for one: nothing but the time of arrival is.
            cells = std::iter::repeat_n(Cow::Borrowed(""), width - 1).chain(cells.pop()).collect();
            self.cut.add(line);
        } else if found != width && !trailing {
            let whole = |cell: &Cow<'_, str>| cell.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-');
            let commas = self.layout.delimiter == Delimiter::Comma && found > width && cells.iter().all(whole);
            return Err(if commas {
                RecordError::DecimalCommaBetweenCommas { file: file(), line, expected: width, found }
            } else {
                RecordError::CellCount { file: file(), line, expected: width, found }
            });
        }
        let row = self.lines.len();
        for (column, cell) in self.columns.iter_mut().zip(&cells) {
            column.push(row, form.cell(cell, self.decimal), self.decimal);
        }
        self.lines.push(line);
        Ok(())
    }
}

/// The cells of a line that holds as many numbers with decimal points as `row` and nothing else; `false` for any other line, of which
/// `row` then says nothing.
fn plain_numbers(line: &[u8], delimiter: Delimiter, row: &mut [f64]) -> bool {
    if delimiter == Delimiter::Blank {
        return false;
    }
    let blanks = |at: usize| line[at..].iter().take_while(|byte| **byte == b' ').count();
    let Some(last) = row.len().checked_sub(1) else { return false };
    let mut at = 0;
    for (index, value) in row.iter_mut().enumerate() {
        at += blanks(at);
        if !line.get(at).is_some_and(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.')) {
            return false;
        }
        let Ok((number, length)) = fast_float2::parse_partial::<f64, _>(&line[at..]) else { return false };
        // Words for infinity are missing values, and numbers beyond a double are kept as they stand.
        if !number.is_finite() {
            return false;
        }
        *value = number;
        at += length;
        at += blanks(at);
        match line.get(at) {
            None => return index == last,
            Some(byte) if *byte == delimiter.byte() => at += 1,
            Some(_) => return false,
        }
    }
    // Nothing but blanks behind a delimiter at the end of the line.
    at + blanks(at) == line.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::{self, Value};

    /// Oracle: the cells, split and read one by one.
    #[test]
    fn plain_rows_are_what_their_cells_say() {
        let cells = [
            "0",
            "-1.5",
            "+20",
            ".5",
            "5.",
            "-0",
            "1e5",
            "1E-3",
            "1e+2",
            "1e",
            "1e400",
            "-1e400",
            "1e-400",
            "inf",
            "-inf",
            "+nan",
            "nan",
            "",
            "-",
            "---",
            "+",
            ".",
            "1.2.3",
            "0x1F",
            "1_000",
            "20.1C",
            "12345678901234567890.5",
            "0.1",
            " 7 ",
            "1 2",
            "\t3",
            "\"4\"",
            "1,5",
            "9007199254740993",
            "2.2250738585072011e-308",
            "--1",
            "+-1",
            "1e5.5",
            "infinity",
            "5e-324",
        ];
        for delimiter in [Delimiter::Comma, Delimiter::Semicolon, Delimiter::Tab, Delimiter::Pipe] {
            for (first, second) in cells.iter().flat_map(|a| cells.iter().map(move |b| (a, b))) {
                let sign = char::from(delimiter.byte());
                for line in [format!("{first}{sign}{second}"), format!("{first}{sign}{second}{sign}")] {
                    let mut row = [0.0; 2];
                    if !plain_numbers(line.as_bytes(), delimiter, &mut row) {
                        continue;
                    }
                    let mut parts = Vec::new();
                    split(&line, delimiter, &mut parts).expect("no open quotes");
                    assert!(parts.len() == 2 || (parts.len() == 3 && parts[2].is_empty()), "{line:?}");
                    for (value, cell) in row.iter().zip(&parts) {
                        let want = number::read(cell, Decimal::Point);
                        let got = Value::Number(*value);
                        assert!(
                            got == want && value.is_sign_negative() == cell.starts_with('-'),
                            "{line:?}: {got:?}, {want:?}"
                        );
                    }
                }
            }
        }
        let mut row = [0.0; 3];
        assert!(plain_numbers(b"0.001, 20.5,-3e2", Delimiter::Comma, &mut row));
        assert_eq!(row, [0.001, 20.5, -300.0]);
    }
}
