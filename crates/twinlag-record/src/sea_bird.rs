//! Sea-Bird's `.cnv` files: lines of `*` and `#` up to `*END*`, then numbers in columns of eleven characters.
//!
//! Names and units stand in `# name 2 = t090C: Temperature [ITS-90, deg C]`, the number for a missing value in `# bad_flag`, the
//! time from scan to scan in `# interval = seconds: 0.0416667`. Source: Sea-Bird Scientific, *SBE Data Processing* manual, section
//! *Converted data file (.cnv) format*.

use crate::RecordError;
use crate::cells::lines;
use crate::form::{FixedWidth, Form, Program};
use crate::layout::Layout;
use crate::sign::{Decimal, Delimiter};
use crate::unit::Unit;

const COLUMN_CHARACTERS: usize = 11;

/// The layout, if the file is of this kind.
///
/// # Errors
/// [`RecordError::BadHeader`] where the header has no end or names no columns, or the rows are in binary.
pub(crate) fn layout(text: &str, file: &str) -> Option<Result<Layout, RecordError>> {
    let first = lines(text).map(|(_, line)| line.trim()).find(|line| !line.is_empty())?;
    let is_cnv = first.starts_with("* Sea-Bird") || (first.starts_with('*') && text.contains("\n# nquan ="));
    is_cnv.then(|| read(text, file))
}

/// What a cast with rows in binary is refused with; `None` of a file that is no cast.
///
/// - `before`: what stands before the first byte that is no text
pub(crate) fn binary(before: &[u8], file: &str) -> Option<RecordError> {
    layout(&String::from_utf8_lossy(before), file)?.err()
}

fn read(text: &str, file: &str) -> Result<Layout, RecordError> {
    let wrong = |line: usize, expected: &'static str, found: &str| RecordError::BadHeader {
        file: file.to_owned(),
        program: Program::SeaBird,
        line,
        expected,
        found: found.to_owned(),
    };
    let mut names = Vec::new();
    let mut form = Form { program: Some(Program::SeaBird), decimal: Some(Decimal::Point), ..Form::default() };
    let (mut last_line, mut header_line) = (1, None);
    for (number, line) in lines(text) {
        last_line = number;
        if line.trim() == "*END*" {
            if names.is_empty() {
                return Err(wrong(number, "the columns, as '# name 0 = timeS: Time, Elapsed [seconds]'", "none"));
            }
            let (names, units): (Vec<String>, Vec<Unit>) = names.into_iter().unzip();
            let width = names.len();
            form.fixed = Some(FixedWidth { cells: width, characters: COLUMN_CHARACTERS });
            let delimiter = Delimiter::Blank;
            let first_line = number + 1;
            return Ok(Layout { delimiter, names, header_line, units, width, first_line, head: Vec::new(), form });
        }
        let Some((key, value)) = line.strip_prefix('#').and_then(|line| line.split_once('=')) else { continue };
        let (key, value) = (key.trim(), value.trim());
        match key {
            "bad_flag" => form.missing = value.parse().ok(),
            "nvalues" => form.rows = value.parse().ok(),
            "interval" => form.period_s = period_s(value),
            "file_type" if value != "ascii" => {
                return Err(wrong(number, "'file_type = ascii': convert the cast with its ASCII output", value));
            }
            _ => {
                if let Some(index) = key.strip_prefix("name ") {
                    if index.trim().parse() != Ok(names.len()) {
                        return Err(wrong(number, "the columns in order, from 0", key));
                    }
                    header_line.get_or_insert(number);
                    names.push(column(value));
                }
            }
        }
    }
    Err(wrong(last_line, "'*END*' under the header", "the end of the file"))
}

/// Name and unit of a column such as `t190C: Temperature, 2 [ITS-90, deg C]`. Stamps in days are coarser than the scans that they
/// are of, so that they count as no time.
fn column(value: &str) -> (String, Unit) {
    let (name, about) = value.split_once(':').unwrap_or((value, ""));
    let unit = about.split_once('[').and_then(|(_, rest)| rest.split_once(']')).map_or("", |(unit, _)| unit);
    (name.trim().to_owned(), Unit::parse(if about.contains("Julian Days") { "julian days" } else { unit }))
}

/// Of `seconds: 0.0416667`; none of `decibars: 1`, which parts by pressure.
fn period_s(value: &str) -> Option<f64> {
    let (unit, step) = value.split_once(':')?;
    let Unit::Time { seconds, .. } = Unit::parse(unit) else { return None };
    step.trim().parse().ok().map(|step: f64| step * seconds).filter(|period_s| *period_s > 0.0)
}
