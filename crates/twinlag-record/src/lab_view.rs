//! LabVIEW's measurement files, `.lvm`: a header of the file and one of the measurement, each up to `***End_of_Header***`, then a
//! line of names and the rows.
//!
//! The first header names the separator and the decimal sign and says whether each row has a time (`X_Columns`), the second has the
//! unit of each channel (`Y_Unit_Label`) and the step of time (`Delta_X`). A comment may stand behind the last number of a row.
//! Source: National Instruments, *Specification for the LabVIEW Measurement File (.lvm)*.

use crate::RecordError;
use crate::cells::lines;
use crate::form::{Form, Program};
use crate::layout::Layout;
use crate::sign::{Decimal, Delimiter};
use crate::unit::Unit;

const END: &str = "***End_of_Header***";

/// What stands in the headers.
#[derive(Default)]
struct Headers<'a> {
    separator: Option<&'a str>,
    decimal: Option<&'a str>,
    x_columns: Option<&'a str>,
    x_dimensions: Vec<&'a str>,
    y_units: Vec<&'a str>,
    starts: Vec<&'a str>,
    steps: Vec<&'a str>,
}

/// The layout, if the file is of this kind.
///
/// # Errors
/// [`RecordError::BadHeader`] where a header has no end, names a separator that there is none of, or channels that were not sampled at
/// the same times.
pub(crate) fn layout(text: &str, file: &str) -> Option<Result<Layout, RecordError>> {
    let (_, first) = lines(text).next()?;
    first.trim_start().starts_with("LabVIEW Measurement").then(|| read(text, file))
}

/// Whether a line among the rows begins the header of another measurement.
pub(crate) fn begins_another(line: &str) -> bool {
    line.starts_with("Channels") && !line.trim_end().ends_with("Comment")
}

fn read(text: &str, file: &str) -> Result<Layout, RecordError> {
    let wrong = |line: usize, expected: &'static str, found: &str| RecordError::BadHeader {
        file: file.to_owned(),
        program: Program::LabView,
        line,
        expected,
        found: found.to_owned(),
    };
    let mut headers = Headers::default();
    let (mut ends, mut last_line, mut separator) = (0, 1, '\t');
    let mut names = None;
    for (number, line) in lines(text) {
        last_line = number;
        if ends == 2 {
            names = Some((number, line));
            break;
        }
        if line.trim_start().starts_with(END) {
            ends += 1;
            continue;
        }
        let mut cells = line.split(separator).map(str::trim);
        let key = cells.next().unwrap_or_default();
        match key {
            // Before the separator is known it may be either: the line itself shows it.
            "Separator" | "Separator,Comma" => {
                headers.separator = Some(line.trim());
                separator = if line.contains("Comma") { ',' } else { '\t' };
            }
            "Decimal_Separator" => headers.decimal = cells.next(),
            "X_Columns" => headers.x_columns = cells.next(),
            "X_Dimension" => headers.x_dimensions = cells.collect(),
            "Y_Unit_Label" => headers.y_units = cells.collect(),
            "X0" => headers.starts = cells.collect(),
            "Delta_X" => headers.steps = cells.collect(),
            _ => {}
        }
    }
    let Some((line, names)) = names else {
        return Err(wrong(last_line, "'***End_of_Header***' twice, then the names", "the end of the file"));
    };
    let delimiter = match separator {
        ',' => Delimiter::Comma,
        _ => Delimiter::Tab,
    };
    let decimal = if headers.decimal == Some(",") { Decimal::Comma } else { Decimal::Point };
    let mut names: Vec<String> = names.split(separator).map(|name| name.trim().to_owned()).collect();
    while names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    let has_comments = names.last().is_some_and(|name| name == "Comment");
    if has_comments {
        names.pop();
    }
    let alike = |cells: &[&str]| cells.iter().filter(|cell| !cell.is_empty()).all(|cell| Some(cell) == cells.first());
    let is_multi = headers.x_columns == Some("Multi");
    if !alike(&headers.steps) || (is_multi && !alike(&headers.starts)) {
        return Err(wrong(
            line,
            "channels with the same X0 and Delta_X: resample them to one time in LabVIEW",
            "several",
        ));
    }
    let x_unit = match headers.x_dimensions.first() {
        Some(&"Time") | None => Unit::parse("s"),
        Some(other) => Unit::Other((*other).to_owned()),
    };
    let channel_of =
        |column: usize| if is_multi { (column % 2 == 1).then_some(column / 2) } else { column.checked_sub(1) };
    let unit_of = |column: usize| match channel_of(column) {
        Some(channel) => Unit::parse(headers.y_units.get(channel).copied().unwrap_or_default()),
        None => x_unit.clone(),
    };
    let units: Vec<Unit> = (0..names.len()).map(unit_of).collect();
    let step = headers.steps.first().and_then(|step| crate::number::parse(step, decimal));
    let form = Form {
        program: Some(Program::LabView),
        decimal: Some(decimal),
        period_s: step.filter(|step| headers.x_columns == Some("No") && *step > 0.0),
        has_comments,
        ..Form::default()
    };
    let width = names.len();
    let (header_line, first_line) = (Some(line), line + 1);
    Ok(Layout { delimiter, names, header_line, units, width, first_line, head: Vec::new(), form })
}
