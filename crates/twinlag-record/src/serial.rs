//! What a serial monitor, and a line for Arduino's plotter, wrap around the cells of each line:
//! `12:00:00.042 -> 20.1,21.3`, `[2026-01-31 12:00:00.042] 20.1 21.3`, `T1:20.1,T2:21.3`, `12:00:00.042 -> T1: 20.1 °C, T2: 21.3 °C`.
//!
//! A line is unwrapped to `20.1,21.3,12:00:00.042`: the cells without their names, and the time of arrival behind them, so that a
//! time of the logger itself, if there is one, comes first.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::cells::{is_idle, lines, lines_from_end, split};
use crate::clock;
use crate::dialect::{Look, look, sniff_delimiter};
use crate::sign::Delimiter;
use crate::unit::Unit;

/// Lines that are looked at.
const MAX_LINES: usize = 400;
/// The share of them that must be wrapped: a log has messages in between.
const MIN_SHARE: f64 = 0.9;
/// What the time of arrival is called, which no line does.
const STAMP_NAME: &str = "clock";

/// What stands around the cells of each line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Wrapping {
    is_stamped: bool,
    /// The names before the numbers, in order; empty where there are none.
    labels: Vec<String>,
    units: Vec<Unit>,
    delimiter: Delimiter,
    /// Cells of a line without names; 0 where lines have names.
    cells: usize,
}

impl Wrapping {
    /// What most lines at the end of a text are wrapped in, if they are.
    pub(crate) fn find(text: &str) -> Option<Self> {
        let mut sample: Vec<&str> = lines_from_end(text).filter(|line| !is_idle(line)).take(MAX_LINES).collect();
        if sample.len() > 2 {
            // The very last line may be cut off.
            sample.remove(0);
        }
        let most = |count: usize| count as f64 >= MIN_SHARE * sample.len() as f64 && count > 0;
        let is_stamped = most(sample.iter().filter(|line| stamped(line).is_some()).count());
        let payload: Vec<&str> =
            sample.iter().map(|line| stamped(line).filter(|_| is_stamped).map_or(*line, |(_, rest)| rest)).collect();
        let pairs: Vec<_> = payload.iter().map(|line| labelled(line)).collect();
        // The longest row: a sensor that failed may leave its name out for a while.
        let longest = pairs.iter().max_by_key(|pairs| pairs.len()).map_or(&[][..], Vec::as_slice);
        let labels: Vec<String> = longest.iter().map(|pair| pair.label.to_owned()).collect();
        let is_labelled = most(pairs.iter().filter(|pairs| is_of(pairs, &labels)).count());
        if !is_stamped && !is_labelled {
            return None;
        }
        if !is_labelled {
            let (delimiter, cells) =
                sniff_delimiter(&payload).map_or((Delimiter::Comma, 0), |found| (found.delimiter, found.cells));
            return Some(Self { is_stamped, labels: Vec::new(), units: Vec::new(), delimiter, cells });
        }
        let units = longest.iter().map(|pair| pair.unit.clone()).collect();
        Some(Self { is_stamped, labels, units, delimiter: Delimiter::Semicolon, cells: 0 })
    }

    pub(crate) fn is_stamped(&self) -> bool {
        self.is_stamped
    }

    /// The names and units of the columns, where each line has them.
    pub(crate) fn columns(&self) -> Option<(Vec<String>, Vec<Unit>)> {
        let stamp = self.is_stamped.then(|| (STAMP_NAME.to_owned(), Unit::Unstated));
        let columns = self.labels.iter().cloned().zip(self.units.iter().cloned()).chain(stamp);
        (!self.labels.is_empty()).then(|| columns.unzip())
    }

    /// A text with its lines unwrapped, each where it was. Text with as many cells as a row may be its header.
    pub(crate) fn unwrap_text(&self, text: &str) -> String {
        lines(text).map(|(_, line)| self.unwrapped(line, true)).collect::<Vec<_>>().join("\n")
    }

    /// The cells of a line under the header, and behind them its time of arrival; empty of a message. A line that is not wrapped stays
    /// as it is.
    pub(crate) fn unwrap<'a>(&self, line: &'a str) -> Cow<'a, str> {
        self.unwrapped(line, false)
    }

    /// Whether a line is text and no header: what a sketch says as it starts, or of an error.
    fn is_message(&self, payload: &str, may_be_header: bool) -> bool {
        let mut cells = Vec::new();
        self.cells > 0
            && is_text(payload, self.delimiter)
            && split(payload, self.delimiter, &mut cells).is_ok()
            && !(may_be_header && cells.len() == self.cells)
    }

    fn unwrapped<'a>(&self, line: &'a str, may_be_header: bool) -> Cow<'a, str> {
        let wrapped = stamped(line).filter(|_| self.is_stamped);
        if self.is_stamped && wrapped.is_none() {
            return Cow::Borrowed(line);
        }
        let (stamp, payload) = wrapped.map_or((None, line), |(stamp, payload)| (Some(stamp), payload));
        let pairs = if self.labels.is_empty() { Vec::new() } else { labelled(payload) };
        let is_row = is_of(&pairs, &self.labels);
        if !self.labels.is_empty() && !is_row {
            return Cow::Borrowed(payload);
        }
        let sign = char::from(self.delimiter.byte());
        let mut cells = if is_row {
            let value = |label: &String| pairs.iter().find(|pair| pair.label == label).map_or("", |pair| pair.value);
            self.labels.iter().map(value).collect::<Vec<_>>().join(&sign.to_string())
        } else if payload.trim().is_empty() || self.is_message(payload, may_be_header) {
            return Cow::Borrowed("");
        } else {
            payload.trim_end().to_owned()
        };
        if let Some(stamp) = stamp {
            cells.push(sign);
            cells.push_str(if is_row || !is_text(payload, self.delimiter) { stamp } else { STAMP_NAME });
        }
        Cow::Owned(cells)
    }
}

/// Whether no cell is a number or a time: names, or a message.
fn is_text(line: &str, delimiter: Delimiter) -> bool {
    let mut cells = Vec::new();
    split(line, delimiter, &mut cells).is_ok() && cells.iter().all(|cell| look(cell) == Look::Text)
}

/// The time before an arrow or in brackets, and what follows.
fn stamped(line: &str) -> Option<(&str, &str)> {
    let line = line.trim_start();
    let (stamp, rest) = match line.strip_prefix('[') {
        Some(line) => line.split_once(']')?,
        None => line.split_once("->")?,
    };
    let stamp = stamp.trim();
    clock::parse(stamp).filter(|stamp| stamp.time_ns.is_some()).map(|_| (stamp, rest.trim_start()))
}

/// A number with a name before it.
#[derive(Debug, PartialEq)]
struct Pair<'a> {
    label: &'a str,
    value: &'a str,
    unit: Unit,
}

/// Whether there is a pair at least, and each is of these names, in their order.
fn is_of(pairs: &[Pair<'_>], labels: &[String]) -> bool {
    let mut rest = labels.iter();
    !pairs.is_empty() && pairs.iter().all(|pair| rest.any(|label| label == pair.label))
}

/// The pairs of a line that consists of pairs, with or without units: `T1:20.1,T2:21.3`, `T1 = 20.1 °C  T2 = 21.3 °C`; none of any
/// other.
fn labelled(line: &str) -> Vec<Pair<'_>> {
    let is_sign = |c: char| c == ',' || c == ';' || c == '|' || c.is_whitespace();
    let mut pairs: Vec<Pair<'_>> = Vec::new();
    let mut rest = line.trim();
    while !rest.is_empty() {
        let Some((before, after)) = rest.split_once([':', '=']) else {
            // Behind the last number its unit may stand.
            return match (pairs.last_mut(), Unit::parse(rest)) {
                (Some(pair), unit @ (Unit::Celsius | Unit::Kelvin | Unit::Fahrenheit | Unit::Time { .. })) => {
                    pair.unit = unit;
                    pairs
                }
                _ => Vec::new(),
            };
        };
        let mut label = before.trim_matches(is_sign);
        if let (Some(pair), Some((word, behind))) = (pairs.last_mut(), label.split_once(is_sign))
            && let unit @ (Unit::Celsius | Unit::Kelvin | Unit::Fahrenheit | Unit::Time { .. }) = Unit::parse(word)
        {
            pair.unit = unit;
            label = behind.trim_matches(is_sign);
        }
        let after = after.trim_start();
        let end = after.find(is_sign).unwrap_or(after.len());
        let (value, behind) = after.split_at(end);
        let is_value = matches!(look(value), Look::Number | Look::Missing) && !value.is_empty();
        if !is_value
            || !label.contains(char::is_alphabetic)
            || label.contains('"')
            || pairs.iter().any(|pair| pair.label == label)
        {
            return Vec::new();
        }
        pairs.push(Pair { label, value, unit: Unit::Unstated });
        rest = behind.trim_start_matches(is_sign);
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unwrapped(line: &str) -> Option<String> {
        let text = format!("{line}\n").repeat(5);
        Wrapping::find(&text).map(|wrapping| wrapping.unwrap(line).into_owned())
    }

    #[test]
    fn cells_come_first_and_the_time_of_arrival_last() {
        let cases = [
            ("12:00:00.042 -> 20.1,21.3", "20.1,21.3,12:00:00.042"),
            ("12:00:00.042 -> 20.1 21.3", "20.1 21.3 12:00:00.042"),
            ("12:00:00.042 -> 20.1\t21.3", "20.1\t21.3\t12:00:00.042"),
            ("[2026-01-31 12:00:00.042] 20.1;21.3", "20.1;21.3;2026-01-31 12:00:00.042"),
            ("T1:20.1,T2:21.3", "20.1;21.3"),
            ("T1: 20.1, T2: nan", "20.1;nan"),
            ("T1=20.1 °C  T2=21.3 °C", "20.1;21.3"),
            ("t_ms:42 inlet air:20.1 outlet air:21.3", "42;20.1;21.3"),
            ("12:00:00.042 -> T1:20.1,T2:21.3", "20.1;21.3;12:00:00.042"),
        ];
        for (line, want) in cases {
            assert_eq!(unwrapped(line).as_deref(), Some(want), "{line}");
        }
    }

    #[test]
    fn other_lines_are_not_wrapped() {
        for line in ["0,20.1,21.3", "12:00:00,20.1,21.3", "2026-01-31T12:00:00;20,1;21,3", "20.1 -> 21.3", "a:b,c:d"] {
            assert_eq!(unwrapped(line), None, "{line}");
        }
    }

    /// A sensor that failed is missing; a name that no other line has is no row.
    #[test]
    fn rows_are_told_by_their_names() {
        let text = "boot ok\n".to_owned() + &"T1:20.1,T2:21.3\n".repeat(30);
        let wrapping = Wrapping::find(&text).expect("names before numbers");
        assert_eq!(wrapping.unwrap("T2:21.4"), ";21.4");
        assert_eq!(wrapping.unwrap("T3:21.4"), "T3:21.4");
        assert_eq!(wrapping.unwrap("sensor lost"), "sensor lost");
        assert_eq!(wrapping.columns().expect("named").0, ["T1", "T2"]);
    }

    #[test]
    fn units_behind_numbers_are_those_of_their_columns() {
        let pairs = labelled("A: 20.1 C, B: 294.4 K");
        assert_eq!(pairs.iter().map(|pair| pair.unit.clone()).collect::<Vec<_>>(), [Unit::Celsius, Unit::Kelvin]);
        assert_eq!(pairs.iter().map(|pair| pair.label).collect::<Vec<_>>(), ["A", "B"]);
    }
}
