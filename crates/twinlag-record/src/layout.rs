//! Where in a file the header, the unit row and the rows of numbers are.
//!
//! The rows are known by the kinds of their cells (sampled from the end of the file, where there is
//! no preamble); the header is the nearest line above them that has their number of cells and no
//! number in it.

use std::borrow::Cow;

use crate::RecordError;
use crate::cells::{is_idle, lines, lines_from_end, split, uncommented};
use crate::dialect::{Look, look, sniff_delimiter};
use crate::form::{Form, Program};
use crate::serial::Wrapping;
use crate::sign::Delimiter;
use crate::unit::Unit;
use crate::{lab_view, sea_bird};

/// The layout of a file.
#[derive(Debug)]
pub(crate) struct Layout {
    pub(crate) delimiter: Delimiter,
    /// Names as written, one per column; empty without a header.
    pub(crate) names: Vec<String>,
    pub(crate) header_line: Option<usize>,
    /// From the unit row; [`Unit::Unstated`] where it is silent.
    pub(crate) units: Vec<Unit>,
    /// Number of columns.
    pub(crate) width: usize,
    /// First line of the rows, from 1.
    pub(crate) first_line: usize,
    /// Lines above the rows that are no comments: one of these may come again after a file roll.
    pub(crate) head: Vec<String>,
    pub(crate) form: Form,
}

/// Words under the names that say how a value was made, not its unit (Campbell's third and fourth
/// header lines).
const PROCESSING: [&str; 12] = ["avg", "smp", "min", "max", "std", "tot", "ts", "rn", "mean", "raw", "-", "--"];

impl Layout {
    /// Finds the layout: that which the header of a known program states, else what the lines look like.
    ///
    /// # Errors
    /// [`RecordError::BadHeader`], and those of [`Self::of_lines`].
    pub(crate) fn find(text: &str, file: &str) -> Result<Self, RecordError> {
        if let Some(layout) = sea_bird::layout(text, file).or_else(|| lab_view::layout(text, file)) {
            return layout;
        }
        let Some(wrapping) = Wrapping::find(text) else { return Self::of_lines(text, file) };
        let mut layout = Self::of_lines(&wrapping.unwrap_text(text), file)?;
        if let Some((names, units)) = wrapping.columns().filter(|(names, _)| names.len() == layout.width) {
            (layout.names, layout.units) = (names, units);
        }
        layout.form = Form { program: Some(Program::Serial), wrapping: Some(wrapping), ..Form::default() };
        Ok(layout)
    }

    /// Finds the layout from what the lines look like.
    ///
    /// # Errors
    /// [`RecordError::Empty`], [`RecordError::NoData`], [`RecordError::OneColumn`],
    /// [`RecordError::CellCount`], [`RecordError::DecimalCommaBetweenCommas`],
    /// [`RecordError::WholeNumbersWithoutHeader`].
    fn of_lines(text: &str, file: &str) -> Result<Self, RecordError> {
        let file = || file.to_owned();
        let all: Vec<_> = lines_from_end(text).filter(|line| !is_idle(line)).take(401).collect();
        if all.is_empty() {
            return Err(RecordError::Empty { file: file() });
        }
        // The very last line may be cut off; of a short file the upper half may be preamble.
        let take = if all.len() > 400 { 400 } else { (all.len() / 2).max(8).min(all.len()) };
        let sample = if all.len() > 2 { &all[1..take.max(2)] } else { &all[..] };
        let Some(found) = sniff_delimiter(sample) else {
            return Err(RecordError::OneColumn { file: file(), line: first_number(text) });
        };
        let (delimiter, cells) = (found.delimiter, found.cells);
        let columns = Columns::of(sample, delimiter, cells);

        let mut head: Vec<(usize, &str, Vec<Cow<'_, str>>)> = Vec::new();
        let (mut comments, mut row) = (Vec::new(), Vec::new());
        let (mut first_line, mut open_quote) = (None, None);
        for (number, line) in lines(text) {
            if let Some(comment) = uncommented(line) {
                comments.push((number, comment));
            } else if !line.trim().is_empty() {
                // A line with an open quote is no row; if it stands among the rows, it is refused
                // there.
                let is_open = split(line, delimiter, &mut row).is_err();
                if !is_open && columns.fits(&row) {
                    first_line = Some(number);
                    break;
                }
                open_quote = open_quote.or(is_open.then_some(number));
                head.push((number, line, row.clone()));
            }
        }
        let Some(mut first_line) = first_line else {
            return Err(RecordError::NoData { file: file(), lines: last_line(text) });
        };

        // Names may go over several lines where a spreadsheet wrote them.
        if let Some(line) = open_quote {
            return Err(RecordError::OpenQuote { file: file(), line });
        }
        let counts = |cells: &[Cow<'_, str>]| columns.width_under(cells);
        let bottom = head.iter().rposition(|(_, _, cells)| counts(cells).is_some() && is_text_row(cells));
        let top = bottom.map(|bottom| {
            // Unit and processing rows are peeled off from below, as long as a row of names stands
            // above them.
            let mut top = bottom;
            while top > 0
                && counts(&head[top - 1].2).is_some()
                && is_text_row(&head[top - 1].2)
                && is_unit_row(&head[top].2, &head[top - 1].2)
            {
                top -= 1;
            }
            top
        });
        let (mut names, mut units, mut width, mut header_line) = (Vec::new(), Vec::new(), cells, None);
        if let (Some(top), Some(bottom)) = (top, bottom) {
            let cells = &head[top].2;
            width = counts(cells).unwrap_or(width);
            names = merged(cells, delimiter);
            header_line = Some(head[top].0);
            // What is between the header and the first good row is rows too: they are judged as
            // such.
            first_line = head.get(bottom + 1).map_or(first_line, |line| line.0);
            for (_, _, cells) in &head[top + 1..=bottom] {
                if units.is_empty() {
                    units = units_of(cells);
                }
            }
            head.truncate(bottom + 1);
        } else if let Some(cells) = comments.last().and_then(|(_, line)| commented_names(line, delimiter, &columns)) {
            header_line = comments.last().map(|comment| comment.0);
            width = columns.width_under(&cells).unwrap_or(width);
            names = merged(&cells, delimiter);
        } else {
            if let Some((_, _, row)) = head.last() {
                let row: Vec<_> = merged(row, delimiter);
                let looks: Vec<_> = row.iter().map(|cell| look(cell)).collect();
                if delimiter != Delimiter::Blank && row.len() > 1 && looks.iter().all(|look| *look == Look::Text) {
                    return Err(wrong_count(file(), first_line, row.len(), cells, &columns));
                }
            }
            if columns.last_empty {
                width -= 1;
            }
            if delimiter == Delimiter::Comma && width >= 4 && width.is_multiple_of(2) && columns.whole {
                return Err(RecordError::WholeNumbersWithoutHeader { file: file(), line: first_line, found: width });
            }
        }
        if top.is_none() {
            // Rows that do not fit but are no preamble either belong to the rows, to be refused
            // there.
            let is_row = |row: &[Cow<'_, str>]| {
                let numbers = row.iter().filter(|cell| matches!(look(cell), Look::Number | Look::Stamp)).count();
                let texts = row.iter().filter(|cell| look(cell) == Look::Text).count();
                numbers > 0 && (row.len() == cells || (row.len() > 1 && texts == 0))
            };
            let kept = head.iter().rposition(|(_, _, row)| !is_row(row)).map_or(0, |last| last + 1);
            first_line = head.get(kept).map_or(first_line, |line| line.0);
            head.truncate(kept);
        }
        if width < 2 {
            return Err(RecordError::OneColumn { file: file(), line: first_line });
        }
        names.truncate(width);
        if !names.is_empty() {
            names.resize(width, String::new());
        }
        units.resize(width, Unit::Unstated);
        let head = head.iter().map(|(_, line, _)| (*line).to_owned()).collect();
        Ok(Self { delimiter, names, header_line, units, width, first_line, head, form: Form::default() })
    }
}

/// Number of the first line that is a number or a time and nothing else; of the first that is not
/// blank or a comment, if there is none.
fn first_number(text: &str) -> usize {
    let used = || lines(text).filter(|(_, line)| !is_idle(line));
    let is_value = |line: &str| matches!(look(line.trim().trim_matches('"').trim()), Look::Number | Look::Stamp);
    used().find(|(_, line)| is_value(line)).or_else(|| used().next()).map_or(0, |line| line.0)
}

/// Number of the last line that is not blank or a comment.
fn last_line(text: &str) -> usize {
    lines(text).filter(|(_, line)| !is_idle(line)).last().map_or(0, |line| line.0)
}

fn wrong_count(file: String, line: usize, expected: usize, found: usize, columns: &Columns) -> RecordError {
    if columns.delimiter == Delimiter::Comma && columns.whole && expected < found && found <= 2 * expected {
        RecordError::DecimalCommaBetweenCommas { file, line, expected, found }
    } else {
        RecordError::CellCount { file, line, expected, found }
    }
}

fn is_processing(cell: &str) -> bool {
    PROCESSING.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// The units of a row below the names. `min` is a minimum beside another word of processing, else it is minutes.
fn units_of(cells: &[Cow<'_, str>]) -> Vec<Unit> {
    let is_minute = |cell: &str| cell.eq_ignore_ascii_case("min");
    let is_word = |cell: &str| is_processing(cell) && cell.chars().any(char::is_alphabetic);
    let is_of_processing = cells.iter().any(|cell| is_word(cell) && !is_minute(cell));
    let is_unit = |cell: &str| !is_processing(cell) || (is_minute(cell) && !is_of_processing);
    cells.iter().map(|cell| if is_unit(cell) { Unit::parse(cell) } else { Unit::Unstated }).collect()
}

/// Whether cells are units or words of processing, below those of `above`: all of them, or one of a temperature among cells of which some
/// are equal, as names are not. Campbell's loggers write any word there: `Volts`, `Deg C`.
fn is_unit_row(cells: &[Cow<'_, str>], above: &[Cow<'_, str>]) -> bool {
    let is_temperature =
        |cell: &Cow<'_, str>| matches!(Unit::parse(cell), Unit::Celsius | Unit::Kelvin | Unit::Fahrenheit);
    cells.iter().all(|cell| is_unit_cell(cell))
        || (cells.iter().any(is_temperature) && !are_all_different(cells) && are_all_different(above))
}

fn are_all_different(cells: &[Cow<'_, str>]) -> bool {
    let mut words: Vec<&str> = cells.iter().map(|cell| cell.trim()).filter(|word| !word.is_empty()).collect();
    words.sort_unstable();
    words.windows(2).all(|pair| pair[0] != pair[1])
}

fn is_unit_cell(cell: &str) -> bool {
    let bracketed = cell.starts_with(['[', '(']) && cell.ends_with([']', ')']);
    // A date or time format under the name of the time column is a kind of unit.
    let format = cell.contains("hh:mm") || cell.contains("HH:MM") || cell.contains("yyyy") || cell.contains("YYYY");
    cell.is_empty() || bracketed || format || is_processing(cell) || !matches!(Unit::parse(cell), Unit::Other(_)) || {
        ["%", "V", "mV", "A", "mA", "bar", "mbar", "hPa", "kPa", "Pa", "dbar", "m", "m/s", "Ohm"].contains(&cell)
    }
}

/// Whether the cells may be names: mostly text, the first of them too (a broken row still begins
/// with its time).
fn is_text_row(cells: &[Cow<'_, str>]) -> bool {
    let looks: Vec<_> = cells.iter().map(|cell| look(cell)).filter(|look| *look != Look::Missing).collect();
    let texts = looks.iter().filter(|look| **look == Look::Text).count();
    2 * texts > looks.len() && looks.first() == Some(&Look::Text) && !looks.contains(&Look::Stamp)
}

fn commented_names<'a>(line: &'a str, delimiter: Delimiter, columns: &Columns) -> Option<Vec<Cow<'a, str>>> {
    let mut cells = Vec::new();
    split(line, delimiter, &mut cells).ok()?;
    (columns.width_under(&cells).is_some() && is_text_row(&cells)).then_some(cells)
}

/// Names without a trailing empty cell; where blanks separate, a bracketed unit belongs to the name
/// before it.
fn merged(cells: &[Cow<'_, str>], delimiter: Delimiter) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for cell in cells {
        match names.last_mut() {
            Some(name) if delimiter == Delimiter::Blank && cell.starts_with(['[', '(']) => {
                name.push(' ');
                name.push_str(cell);
            }
            _ => names.push(cell.to_string()),
        }
    }
    if names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    names
}

/// What the columns of the sampled rows hold for the most part.
struct Columns {
    delimiter: Delimiter,
    looks: Vec<Look>,
    /// Whether every cell is a whole number.
    whole: bool,
    /// Whether nothing stands behind the last delimiter; a word for a missing value would be
    /// something.
    last_empty: bool,
}

impl Columns {
    fn of(sample: &[&str], delimiter: Delimiter, cells: usize) -> Self {
        let mut counts = vec![[0_usize; 3]; cells];
        let (mut row, mut whole, mut last_empty) = (Vec::new(), true, true);
        for line in sample {
            if split(line, delimiter, &mut row).is_err() || row.len() != cells {
                continue;
            }
            last_empty &= row.last().is_some_and(|cell| cell.is_empty());
            for (cell, counts) in row.iter().zip(&mut counts) {
                match look(cell) {
                    Look::Number => counts[0] += 1,
                    Look::Stamp => counts[1] += 1,
                    Look::Text => counts[2] += 1,
                    Look::Missing => {}
                }
                let digits = cell.trim_start_matches(['-', '+']);
                whole &= look(cell) == Look::Text || digits.bytes().all(|byte| byte.is_ascii_digit());
            }
        }
        let looks = counts.iter().map(|&[numbers, stamps, texts]| match numbers + stamps + texts {
            0 => Look::Missing,
            _ if texts > numbers + stamps => Look::Text,
            _ if stamps > numbers => Look::Stamp,
            _ => Look::Number,
        });
        Self { delimiter, looks: looks.collect(), whole, last_empty }
    }

    /// Whether the cells are those of a row of measurements.
    fn fits(&self, cells: &[Cow<'_, str>]) -> bool {
        let mut some = false;
        let same = |(cell, want): (&Cow<'_, str>, &Look)| {
            let got = look(cell);
            some |= matches!(got, Look::Number | Look::Stamp);
            got == Look::Missing || *want == Look::Text || got == *want
        };
        cells.len() == self.looks.len() && cells.iter().zip(&self.looks).all(same) && some
    }

    /// The number of columns under these header cells, if they can be the header.
    fn width_under(&self, cells: &[Cow<'_, str>]) -> Option<usize> {
        let names = merged(cells, self.delimiter).len();
        let width = self.looks.len();
        if names == width || cells.len() == width {
            // A trailing delimiter under the names and the rows alike.
            let trailing = names + 1 == width && self.last_empty;
            Some(if trailing { names } else { width })
        } else {
            (names + 1 == width && self.last_empty).then_some(names)
        }
    }
}
