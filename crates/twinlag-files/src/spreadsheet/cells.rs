//! The cells of a sheet by rows, and what a cell is.

use std::ops::Range;

use calamine::{Cell, Data, DataType as _, ExcelDateTime};
use jiff::civil::{Date, DateTime, date};
use jiff::tz::TimeZone;

/// Serial days of this century are doubles 0.6 µs apart; what they were written from is nearest on
/// this grid.
const GRID_NS: i64 = 10_000;
const DAY_NS: i64 = 86_400_000_000_000;

/// The filled cells of a sheet, row by row; empty rows are not there.
#[derive(Debug, Default)]
pub(super) struct Sheet {
    cells: Vec<Cell<Data>>,
    rows: Vec<Range<usize>>,
}

impl Sheet {
    pub(super) fn of(mut cells: Vec<Cell<Data>>) -> Self {
        cells.retain(|cell| !is_blank(cell.get_value()));
        if !cells.is_sorted_by_key(Cell::get_position) {
            cells.sort_by_key(Cell::get_position);
        }
        let mut rows: Vec<Range<usize>> = Vec::new();
        for (index, cell) in cells.iter().enumerate() {
            match rows.last_mut() {
                Some(row) if cells[row.start].get_position().0 == cell.get_position().0 => row.end = index + 1,
                _ => rows.push(index..index + 1),
            }
        }
        Self { cells, rows }
    }

    /// Number of rows that are not empty.
    pub(super) fn rows(&self) -> usize {
        self.rows.len()
    }

    /// The cells of a row, from the left.
    pub(super) fn row(&self, row: usize) -> &[Cell<Data>] {
        &self.cells[self.rows[row].clone()]
    }

    /// The number of a row in the sheet, from 1.
    pub(super) fn number(&self, row: usize) -> u32 {
        self.row(row)[0].get_position().0 + 1
    }
}

fn is_blank(value: &Data) -> bool {
    match value {
        Data::Empty => true,
        Data::String(text) => text.trim().is_empty(),
        _ => false,
    }
}

/// A cell, as far as a table needs it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Missing,
    Number(f64),
    /// Civil time in nanoseconds since 1970-01-01.
    Instant(i64),
    /// Time of day or duration in nanoseconds.
    Time(i64),
    Text(String),
}

impl Value {
    pub(super) fn of(data: &Data) -> Self {
        match data {
            Data::Empty | Data::Error(_) => Self::Missing,
            Data::Int(value) => Self::Number(*value as f64),
            Data::Float(value) => Self::Number(*value),
            Data::Bool(value) => Self::Number(f64::from(u8::from(*value))),
            Data::DateTime(serial) => of_serial(serial),
            Data::DateTimeIso(text) => of_iso(text),
            Data::DurationIso(text) => of_duration(text),
            Data::String(text) => Self::Text(text.trim().to_owned()),
        }
    }
}

/// Whether a cell may be one of a row of data: text only if it is a number.
pub(super) fn is_data(data: &Data) -> bool {
    match data {
        Data::String(text) => text.trim().parse::<f64>().is_ok_and(f64::is_finite),
        other => !other.is_empty() && !other.is_error(),
    }
}

fn of_serial(serial: &ExcelDateTime) -> Value {
    let days = serial.as_f64();
    let ns = |days: f64| ((days * (DAY_NS / GRID_NS) as f64).round() as i64).saturating_mul(GRID_NS);
    if !(0.0..1e7).contains(&days) {
        return Value::Number(days);
    }
    // Less than a day is a time of day, whatever its format.
    if !serial.is_datetime() || (0.0..1.0).contains(&days) {
        return Value::Time(ns(days));
    }
    // The day depends on the epoch, of which there are two.
    let (year, month, day, ..) = serial.to_ymd_hms_milli();
    match Date::new(year as i16, month as i8, day as i8) {
        Ok(day) => {
            let since_1970 = day.duration_since(date(1970, 1, 1)).as_hours() / 24;
            // Nanoseconds since 1970 end in 2262; what lies beyond is no date of a measurement.
            let midnight_ns = since_1970.checked_mul(DAY_NS);
            let instant_ns = midnight_ns.and_then(|midnight_ns| midnight_ns.checked_add(ns(days.fract())));
            instant_ns.map_or(Value::Number(days), Value::Instant)
        }
        Err(_) => Value::Number(days),
    }
}

fn of_iso(text: &str) -> Value {
    let civil = text.parse::<DateTime>().ok().or_else(|| text.parse::<Date>().ok().map(|day| day.at(0, 0, 0, 0)));
    let instant = civil.and_then(|civil| civil.to_zoned(TimeZone::UTC).ok()).map(|at| at.timestamp().as_nanosecond());
    match instant.and_then(|ns| i64::try_from(ns).ok()) {
        Some(ns) => Value::Instant(ns),
        None => Value::Text(text.to_owned()),
    }
}

fn of_duration(text: &str) -> Value {
    match text.parse::<jiff::SignedDuration>().ok().and_then(|time| i64::try_from(time.as_nanos()).ok()) {
        Some(ns) => Value::Time(ns),
        None => Value::Text(text.to_owned()),
    }
}
