//! Columns of numbers as comma-separated text with decimal points: what this crate, and everything
//! else, can read.

use std::borrow::Cow;
use std::io::{self, BufWriter, Write};

use crate::RecordError;

/// How numbers are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decimals {
    /// The fewest digits that give the same double again.
    #[default]
    Shortest,
    /// This many behind the point.
    Fixed(usize),
}

/// Writes a header and one row per entry. Cells that are not finite stay empty: they read as
/// missing.
///
/// - `columns`: name and values, `[n]` each
///
/// ```
/// use twinlag_record::{Decimals, write_csv};
///
/// let mut out = Vec::new();
/// let columns: [(&str, &[f64]); 2] = [("time_s", &[0.0, 0.5]), ("T1, bare", &[20.0625, f64::NAN])];
/// write_csv(&mut out, &columns, Decimals::Fixed(2))?;
/// // A name with a comma is quoted, and what is missing stays empty.
/// assert_eq!(String::from_utf8(out)?, "time_s,\"T1, bare\"\n0.00,20.06\n0.50,\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`RecordError::LengthMismatch`], [`RecordError::CannotWrite`].
pub fn write_csv(out: &mut impl Write, columns: &[(&str, &[f64])], decimals: Decimals) -> Result<(), RecordError> {
    write_csv_with_text(out, columns, &[], decimals)
}

/// A column of text: its name, and the cell of each row, counted from 0.
pub type TextColumn<'a> = (&'a str, Box<dyn Fn(usize) -> String + 'a>);

/// Writes as [`write_csv`] does, with columns of text behind those of numbers.
///
/// - `columns`: name and values, `[n]` each
/// - `text`: name and cells, which are asked for `0..n`
///
/// ```
/// use twinlag_record::{Decimals, TextColumn, write_csv_with_text};
///
/// let mut out = Vec::new();
/// let grade: TextColumn<'_> = ("grade", Box::new(|row| ["go", "no-go"][row].to_owned()));
/// write_csv_with_text(&mut out, &[("tau_s", &[0.1, f64::NAN])], &[grade], Decimals::Shortest)?;
/// assert_eq!(String::from_utf8(out)?, "tau_s,grade\n0.1,go\n,no-go\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`write_csv`].
pub fn write_csv_with_text(
    out: &mut impl Write,
    columns: &[(&str, &[f64])],
    text: &[TextColumn<'_>],
    decimals: Decimals,
) -> Result<(), RecordError> {
    let rows = columns.first().map_or(0, |column| column.1.len());
    for (name, values) in columns {
        if values.len() != rows {
            return Err(RecordError::LengthMismatch {
                file: "table to write".to_owned(),
                name: (*name).to_owned(),
                found: values.len(),
                like: columns[0].0.to_owned(),
                expected: rows,
            });
        }
    }
    write_rows(out, columns, text, rows, decimals)
        .map_err(|error| RecordError::CannotWrite { reason: error.to_string() })
}

fn write_rows(
    out: &mut impl Write,
    columns: &[(&str, &[f64])],
    text: &[TextColumn<'_>],
    rows: usize,
    decimals: Decimals,
) -> io::Result<()> {
    let mut out = BufWriter::new(out);
    for (at, name) in columns.iter().map(|column| column.0).chain(text.iter().map(|column| column.0)).enumerate() {
        write!(out, "{}{}", if at == 0 { "" } else { "," }, quoted(name))?;
    }
    writeln!(out)?;
    for row in 0..rows {
        for (at, (_, values)) in columns.iter().enumerate() {
            if at > 0 {
                out.write_all(b",")?;
            }
            match (values[row], decimals) {
                (value, _) if !value.is_finite() => {}
                (value, Decimals::Shortest) => write!(out, "{value}")?,
                (value, Decimals::Fixed(digits)) => write!(out, "{value:.digits$}")?,
            }
        }
        for (_, cell) in text {
            write!(out, ",{}", quoted(&cell(row)))?;
        }
        writeln!(out)?;
    }
    out.flush()
}

/// A cell of comma-separated text.
fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\"")).into()
    } else {
        text.into()
    }
}
