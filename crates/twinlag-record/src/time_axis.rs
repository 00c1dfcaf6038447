//! From a column (or two) to seconds since the first sample.

use crate::RecordError;
use crate::beside::shown_beside;
use crate::column::Kind;
use crate::note::Note;
use crate::sampling::Clock;
use crate::scale::{self, Counter, Reading};
use crate::stamps::{self, elapsed, settle_short};
use crate::table::Table;
use crate::unit::Unit;
use crate::wrap::{counted_on, unwrapped};

/// Seconds since the first row, and the clock that the stamps were printed from.
pub(crate) struct TimeAxis {
    pub(crate) time_s: Vec<f64>,
    pub(crate) clock: Clock,
}

/// Where time comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TimeColumns {
    One(usize),
    DateAndTime { date: usize, time: usize },
}

/// Reads the time of every row; not yet checked to increase.
///
/// - `unit`: the unit of a column of numbers, or of the first part of a clock with two parts, where the caller chose one
///
/// # Errors
/// [`RecordError::NotATimeUnit`], [`RecordError::TimeUnitUnclear`], [`RecordError::NotATime`], [`RecordError::AmbiguousDate`],
/// [`RecordError::ClockUnclear`], [`RecordError::NeedsNoUnit`], [`RecordError::MissingTime`], and those of [`Table::numbers`].
pub(crate) fn read(
    table: &mut Table,
    columns: TimeColumns,
    unit: Option<&Unit>,
    notes: &mut Vec<Note>,
) -> Result<TimeAxis, RecordError> {
    match columns {
        TimeColumns::One(index) if table.columns()[index].kind() != Kind::Stamp => numeric(table, index, unit, notes),
        columns => Ok(TimeAxis { time_s: of_stamps(table, columns, unit, notes)?, clock: Clock::SECONDS }),
    }
}

/// Seconds since the first row, by columns of stamps.
///
/// # Errors
/// Those of [`read`].
pub(crate) fn of_stamps(
    table: &Table,
    columns: TimeColumns,
    unit: Option<&Unit>,
    notes: &mut Vec<Note>,
) -> Result<Vec<f64>, RecordError> {
    match columns {
        TimeColumns::One(index) => {
            let mut stamps = stamps::of_column(table, index)?;
            settle_short(table, index, &mut stamps, unit)?;
            elapsed(table, index, &stamps, notes)
        }
        TimeColumns::DateAndTime { date, time } => {
            if unit.is_some() {
                return Err(RecordError::NeedsNoUnit { file: table.source().to_owned(), column: table.title(time) });
            }
            let (dates, mut stamps) = (stamps::of_column(table, date)?, stamps::of_column(table, time)?);
            for (stamp, date) in stamps.iter_mut().zip(&dates) {
                stamp.day = date.day;
            }
            notes.push(Note::DateAndTime { date: table.title(date), time: table.title(time) });
            elapsed(table, date, &stamps, notes)
        }
    }
}

fn numeric(
    table: &mut Table,
    index: usize,
    chosen: Option<&Unit>,
    notes: &mut Vec<Note>,
) -> Result<TimeAxis, RecordError> {
    let values = table.numbers(index)?;
    if let Some(row) = values.iter().position(|value| !value.is_finite()) {
        let (file, at) = (table.source().to_owned(), table.place_of(row));
        return Err(RecordError::MissingTime { file, at, column: table.title(index) });
    }
    let unit_s = unit_of(table, index, chosen, notes)?.1;
    let values = table.numbers(index)?;
    let first = values.first().copied().unwrap_or(0.0);
    let since_first = |values: &[f64]| values.iter().map(|value| seconds(value - first, unit_s)).collect();
    let time_s = if let Some((values, wrapped)) = unwrapped(values) {
        notes.push(Note::Wrapped { column: table.title(index), bits: wrapped.bits, times: wrapped.times });
        since_first(&values)
    } else if first == 0.0 && unit_s == 1.0 {
        // The column itself; messages find its numbers in the record.
        table.take_values(index)
    } else {
        since_first(values)
    };
    Ok(TimeAxis { time_s, clock: Clock { unit_s, first } })
}

/// The unit of a column of numbers, with its length in seconds: the one that the caller chose, else that of the header, else what a clock
/// beside it shows, else what its size and its step show.
///
/// # Errors
/// [`RecordError::NotATimeUnit`], [`RecordError::TimeUnitUnclear`].
pub(crate) fn unit_of(
    table: &Table,
    index: usize,
    chosen: Option<&Unit>,
    notes: &mut Vec<Note>,
) -> Result<(&'static str, f64), RecordError> {
    let column = || table.title(index);
    let to = |symbol: &str| (symbol != "s").then_some("s");
    let stated = table.columns()[index].stated_time_unit();
    match chosen.or(stated.as_ref()).unwrap_or(table.columns()[index].unit()) {
        Unit::Time { symbol, seconds } if chosen.is_some() => {
            notes.push(Note::TimeUnitChosen { column: column(), unit: symbol, to: to(symbol) });
            Ok((symbol, *seconds))
        }
        Unit::Time { symbol, seconds } => {
            if to(symbol).is_some() {
                notes.push(Note::Unit { column: column(), unit: (*symbol).to_owned(), stated: true, to: to(symbol) });
            }
            Ok((symbol, *seconds))
        }
        Unit::Unstated => {
            if let Some((other, Counter { symbol, seconds, name, step_s })) = shown_beside(table, index) {
                let clock = table.title(other);
                notes.push(Note::TimeByClock { column: column(), clock, unit: symbol, name, step_s });
                return Ok((symbol, seconds));
            }
            match scale::judge(&counted_on(table.columns()[index].raw())) {
                Reading::Recognised(Counter { symbol, seconds, name, step_s }) => {
                    notes.push(Note::TimeRecognised { column: column(), unit: symbol, name, step_s });
                    Ok((symbol, seconds))
                }
                Reading::Unclear { step } => {
                    Err(RecordError::TimeUnitUnclear { file: table.source().to_owned(), column: column(), step })
                }
                Reading::Seconds => {
                    notes.push(Note::Unit { column: column(), unit: "s".to_owned(), stated: false, to: None });
                    Ok(("s", 1.0))
                }
            }
        }
        unit => {
            Err(RecordError::NotATimeUnit { file: table.source().to_owned(), column: column(), unit: unit.to_string() })
        }
    }
}

/// Divided, where the unit is a part of a second: 7 ms is then the double nearest to 0.007.
pub(crate) fn seconds(value: f64, unit_s: f64) -> f64 {
    if unit_s < 1.0 { value / (1.0 / unit_s).round() } else { value * unit_s }
}
