//! Which delimiter and which decimal sign a file uses. The delimiter is the one whose cells are
//! most alike from line to line and most often numbers or times; the decimal sign is what the cells
//! show. A file that shows both, or from which it cannot be determined, is refused.

use std::borrow::Cow;

use crate::cells::split;
use crate::clock;
use crate::number;
use crate::sign::{Decimal, Delimiter};

/// What a cell looks like while the decimal sign is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Look {
    Number,
    Stamp,
    Missing,
    Text,
}

pub(crate) fn look(cell: &str) -> Look {
    if number::is_missing(cell) {
        Look::Missing
    } else if number::parse(cell, Decimal::Point).is_some() || number::parse(cell, Decimal::Comma).is_some() {
        Look::Number
    } else if clock::parse(cell).is_some() {
        Look::Stamp
    } else {
        Look::Text
    }
}

/// A delimiter and how many cells it most often gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Split {
    pub(crate) delimiter: Delimiter,
    pub(crate) cells: usize,
    alike: f64,
    valid: f64,
}

/// The delimiter of the sampled lines; `None` if none gives two cells.
pub(crate) fn sniff_delimiter(sample: &[&str]) -> Option<Split> {
    let splits: Vec<_> = Delimiter::ALL.iter().filter_map(|&delimiter| judge(sample, delimiter)).collect();
    let score = |split: &Split| split.alike * split.valid;
    // `max_by` keeps the last of equals, so the order is reversed.
    let marked = splits.iter().rev().filter(|split| split.delimiter != Delimiter::Blank);
    let marked = marked.max_by(|a, b| score(a).total_cmp(&score(b))).copied();
    let blank = splits.iter().find(|split| split.delimiter == Delimiter::Blank).copied();
    // Blanks stand inside cells (texts, date-times) too: they separate only if no other delimiter
    // makes sense.
    match (marked, blank) {
        (Some(marked), Some(blank)) => {
            let flawless = blank.valid == 1.0 && marked.valid < 1.0 && blank.alike >= 0.8 * marked.alike;
            Some(if flawless || (score(&marked) < 0.2 && score(&blank) > score(&marked)) { blank } else { marked })
        }
        (marked, blank) => marked.or(blank),
    }
}

fn judge(sample: &[&str], delimiter: Delimiter) -> Option<Split> {
    let mut counts = std::collections::BTreeMap::<usize, usize>::new();
    let mut cells = Vec::new();
    for line in sample {
        if split(line, delimiter, &mut cells).is_ok() && cells.len() > 1 {
            *counts.entry(cells.len()).or_default() += 1;
        }
    }
    let (&most, &times) = counts.iter().max_by_key(|&(_, &times)| times)?;
    let (mut valid, mut filled) = (0_u32, 0_u32);
    for line in sample {
        if split(line, delimiter, &mut cells).is_ok() && cells.len() == most {
            for cell in cells.iter().filter(|cell| !cell.is_empty()) {
                filled += 1;
                valid += u32::from(look(cell) != Look::Text);
            }
        }
    }
    let alike = times as f64 / sample.len() as f64;
    Some(Split { delimiter, cells: most, alike, valid: f64::from(valid) / f64::from(filled.max(1)) })
}

/// Why no decimal sign could be determined; cells with their lines.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Unclear {
    Thousands { line: usize, cell: String },
    Mixed { comma: (usize, String), point: (usize, String) },
}

/// What the cells of the rows say about the decimal sign, gathered row by row.
#[derive(Debug, Default)]
pub(crate) struct Evidence {
    comma: Option<(usize, String)>,
    point: Option<(usize, String)>,
    /// A cell with a comma that cannot part thousands, as `20,5` or `0,125`.
    sure: bool,
    /// Per column: number cells, those with a comma, those with more than one digit before it.
    columns: Vec<[usize; 3]>,
}

impl Evidence {
    pub(crate) fn is_enough(&self) -> bool {
        self.point.is_some() || self.sure
    }

    pub(crate) fn add(&mut self, line: usize, cells: &[Cow<'_, str>]) {
        self.columns.resize(self.columns.len().max(cells.len()), [0; 3]);
        for (cell, counts) in cells.iter().zip(&mut self.columns) {
            let (commas, points) = (cell.matches(',').count(), cell.matches('.').count());
            let digits = cell.trim_start_matches(['+', '-']);
            let is_number = cell.bytes().all(|b| b.is_ascii_digit() || b",.+-eE".contains(&b))
                && digits.starts_with(|c: char| c.is_ascii_digit() || c == '.' || c == ',')
                && (commas < 2 || digits.split(',').skip(1).all(|group| group.len() >= 3))
                && points < 2;
            if !is_number {
                continue;
            }
            counts[0] += 1;
            if points > 0 {
                self.point.get_or_insert_with(|| (line, cell.to_string()));
            }
            if commas > 0 {
                self.comma.get_or_insert_with(|| (line, cell.to_string()));
                let (head, tail) = digits.split_once(',').unwrap_or((digits, ""));
                counts[1] += 1;
                counts[2] += usize::from(head.len() > 1);
                let parts_thousands = tail.split(',').all(|group| group.len() == 3) && (1..=3).contains(&head.len());
                self.sure |= commas == 1 && (!parts_thousands || head.starts_with('0'));
            }
        }
    }

    pub(crate) fn verdict(self) -> Result<Decimal, Unclear> {
        match (self.comma, self.point) {
            (None, _) => Ok(Decimal::Point),
            (Some(comma), Some(point)) => Err(Unclear::Mixed { comma, point }),
            (Some(comma), None) => {
                // Fixed decimals have a comma in every cell; with parted thousands, whole numbers
                // below 1000 have none.
                let fixed = self.columns.iter().any(|&[all, commas, long]| all == commas && long > 0);
                if self.sure || fixed {
                    Ok(Decimal::Comma)
                } else {
                    Err(Unclear::Thousands { line: comma.0, cell: comma.1 })
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_delimiter_is_told_from_the_lines() {
        let cases = [
            ("0,20.1,21.2", Delimiter::Comma, 3),
            ("0, 20.1, 21.2", Delimiter::Comma, 3),
            ("0;20,1;21,2", Delimiter::Semicolon, 3),
            ("0\t20,1\t21,2", Delimiter::Tab, 3),
            ("0|20.1|21.2", Delimiter::Pipe, 3),
            ("0  20.1   21.2", Delimiter::Blank, 3),
            ("0 20,1 21,2", Delimiter::Blank, 3),
            ("2026-01-31 10:00:00;20,1;21,2;OK", Delimiter::Semicolon, 4),
            ("2026-01-31 10:00:00,20.1,21.2,door open", Delimiter::Comma, 4),
            ("2026-01-31 10:00:00\t20.1\t21.2", Delimiter::Tab, 3),
            ("31.01.2026 10:00:00;20,1;21,2", Delimiter::Semicolon, 3),
        ];
        for (line, delimiter, cells) in cases {
            let got = sniff_delimiter(&[line; 5]).expect("a delimiter");
            assert_eq!((got.delimiter, got.cells), (delimiter, cells), "{line}");
        }
        assert_eq!(sniff_delimiter(&["20.1"; 5]), None);
    }

    #[test]
    fn the_decimal_sign_is_told_or_refused() {
        let decimal = |rows: &[&[&str]]| {
            let mut evidence = Evidence::default();
            for (line, row) in rows.iter().enumerate() {
                evidence.add(line + 1, &row.iter().map(|&cell| Cow::Borrowed(cell)).collect::<Vec<_>>());
            }
            evidence.verdict()
        };
        assert_eq!(decimal(&[&["0", "20,5"]]), Ok(Decimal::Comma));
        assert_eq!(decimal(&[&["0", "20.5"]]), Ok(Decimal::Point));
        assert_eq!(decimal(&[&["0", "20"]]), Ok(Decimal::Point));
        assert_eq!(decimal(&[&["0,000", "1,234"]]), Ok(Decimal::Comma));
        // Three fixed decimals, 1 mK: as parted thousands it would be more than any thermocouple
        // stands.
        assert_eq!(decimal(&[&["0", "20,125"], &["1", "20,250"]]), Ok(Decimal::Comma));
        assert_eq!(decimal(&[&["0", "1,234"]]), Err(Unclear::Thousands { line: 1, cell: "1,234".to_owned() }));
        let mixed = Unclear::Mixed { comma: (2, "20,5".to_owned()), point: (1, "0.5".to_owned()) };
        assert_eq!(decimal(&[&["0.5", "20"], &["1.5", "20,5"]]), Err(mixed));
        assert!(decimal(&[&["0", "1.234,5"]]).is_err());
    }
}
