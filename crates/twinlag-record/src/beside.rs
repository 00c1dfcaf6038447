//! Clocks beside a column of time: what they show of its unit, and where they contradict it.

use crate::RecordError;
use crate::choose::Chosen;
use crate::column::{Column, Kind};
use crate::names::{OTHER_QUANTITIES, has, is_called_temperature, is_index, is_time_by_name, is_velocity};
use crate::note::Note;
use crate::sampling;
use crate::scale::{self, Counter, MAX_CLOCK_ERROR};
use crate::stamps::{self, elapsed, settle_short};
use crate::table::Table;
use crate::time_axis::{TimeColumns, of_stamps, unit_of};
use crate::unit::Unit;
use crate::wrap::counted_on;

/// How late a line may arrive that a logger sends, s: a tenth of a second where a computer is busy.
const MAX_DELAY_S: f64 = 0.1;
/// The fewest rows from one beginning of a counter to the next; chosen, below the 655 rows of 100 ms in 16 bits.
const MIN_ROWS_OF_TURN: usize = 50;

/// The time of each row by a column whose unit is known, s.
struct Shown {
    time_s: Vec<f64>,
    /// How far it may be off.
    resolution_s: f64,
}

impl Shown {
    /// `None` of a column that shows no time, one that lacks it in some rows, and one that does not pass.
    fn by(table: &Table, index: usize) -> Option<Self> {
        let column = &table.columns()[index];
        let time_s = match column.kind() {
            Kind::Stamp => {
                let mut stamps = stamps::of_column(table, index).ok()?;
                settle_short(table, index, &mut stamps, None).ok()?;
                if stamps.iter().any(|stamp| stamp.time_ns.is_none()) {
                    return None;
                }
                elapsed(table, index, &stamps, &mut Vec::new()).ok()?
            }
            Kind::Number if is_clock(column) => {
                let Some(Unit::Time { seconds, .. }) = column.stated_time_unit() else { return None };
                let raw = column.raw();
                if !raw.windows(2).all(|pair| pair[1] >= pair[0]) || raw.last().is_none_or(|last| last.is_infinite()) {
                    return None;
                }
                raw.iter().map(|value| value * seconds).collect()
            }
            _ => return None,
        };
        let steps = || time_s.windows(2).map(|pair| pair[1] - pair[0]);
        let resolution_s = steps().filter(|step_s| *step_s > 0.0).fold(f64::INFINITY, f64::min).max(MAX_DELAY_S);
        (steps().all(|step_s| step_s >= 0.0) && time_s.first() < time_s.last()).then_some(Self { time_s, resolution_s })
    }

    /// From one row to another, s.
    fn between(&self, first: usize, last: usize) -> f64 {
        self.time_s[last] - self.time_s[first]
    }
}

/// Whether a column of numbers is called a time, as `elapsed_s`, `ms` and `days since start`: a duration of something, as `exposure_ms`, is no
/// clock, nor is `U_m_s`.
fn is_clock(column: &Column) -> bool {
    let name = column.name();
    let is_called = is_time_by_name(column) || Unit::parse(name).is_time() || name.contains(" since ");
    is_called && !is_called_temperature(column) && !is_index(column) && !is_velocity(column)
}

/// Whether the stamps of a column are there in each row, and rise from one to the next.
pub(crate) fn stamps_rise(table: &Table, index: usize) -> bool {
    Shown::by(table, index).is_some_and(|shown| shown.time_s.windows(2).all(|pair| pair[1] > pair[0]))
}

/// What a column counts by a clock beside it, and the column of that; `None` where none shows it.
pub(crate) fn shown_beside(table: &Table, index: usize) -> Option<(usize, Counter)> {
    let mut others = (0..table.columns().len()).filter(|other| *other != index);
    others.find_map(|other| Some((other, counter_beside(table, index, other)?)))
}

/// The unit in which a column counts what passes by the clock of another one. `None` of a column that names a unit or another quantity, of
/// one that falls or counts rows, and where none of the units fits. Numbers may be missing.
pub(crate) fn counter_beside(table: &Table, index: usize, clock: usize) -> Option<Counter> {
    let column = &table.columns()[index];
    let is_stated = *column.unit() != Unit::Unstated || column.stated_time_unit().is_some();
    let is_other =
        is_called_temperature(column) || is_index(column) || has(column, &OTHER_QUANTITIES) || is_velocity(column);
    if column.kind() != Kind::Number || is_stated || is_other || falls_often(column.raw()) {
        return None;
    }
    let rows: Vec<usize> = (0..column.raw().len()).filter(|row| column.raw()[*row].is_finite()).collect();
    let values: Vec<f64> = rows.iter().map(|row| column.raw()[*row]).collect();
    let values = counted_on(&values);
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() || steps.iter().any(|step| *step <= 0.0) {
        return None;
    }
    let shown = Shown::by(table, clock)?;
    let (first, last) = (*rows.first()?, *rows.last()?);
    let rise = values.last()? - values.first()?;
    let are_whole = values.iter().all(|value| value.fract() == 0.0);
    scale::counter_of(rise, sampling::median(&steps), are_whole, shown.between(first, last), shown.resolution_s)
}

/// Whether numbers fall more often than those of a counter that begins anew.
fn falls_often(values: &[f64]) -> bool {
    let falls = values.windows(2).filter(|pair| pair[1] < pair[0]).count();
    falls > 1 + values.len() / MIN_ROWS_OF_TURN
}

/// Refuses a guessed time that a clock beside it contradicts by the ratio of two units, and notes where they differ otherwise. Of rows counted
/// by a period it notes alone.
///
/// - `unit`: the unit that the caller chose
/// - `period_s`: that of rows without a time
///
/// # Errors
/// [`RecordError::TimesDisagree`], and those of reading the time.
pub(crate) fn expect_agreement(
    table: &Table,
    chosen: &Chosen,
    unit: Option<&Unit>,
    period_s: f64,
    notes: &mut Vec<Note>,
) -> Result<(), RecordError> {
    let taken = chosen.columns();
    let others = (0..table.columns().len()).filter(|index| !taken.contains(index));
    let clocks: Vec<(usize, Shown)> = others.filter_map(|index| Some((index, Shown::by(table, index)?))).collect();
    if clocks.is_empty() {
        return Ok(());
    }
    let Some(time) = chosen.time else {
        let passed_s = (table.rows() - 1) as f64 * period_s;
        let shown_s =
            clocks.iter().map(|(index, shown)| (*index, shown.between(0, table.rows() - 1), shown.resolution_s));
        let other = shown_s.filter(|(_, shown_s, resolution_s)| !agree(passed_s, *shown_s, *resolution_s));
        notes.extend(other.map(|(index, shown_s, _)| Note::PeriodDiffers {
            period_s,
            passed_s,
            other: table.title(index),
            other_s: shown_s,
        }));
        return Ok(());
    };
    let index = match time {
        TimeColumns::One(index) => index,
        TimeColumns::DateAndTime { time, .. } => time,
    };
    let passed_s = match time {
        TimeColumns::One(index) if table.columns()[index].kind() != Kind::Stamp => {
            let (values, unit_s) = (counted_on(table.numbers(index)?), unit_of(table, index, unit, &mut Vec::new())?.1);
            // Where it does not rise, its place says more.
            if !values.windows(2).all(|pair| pair[1] > pair[0]) {
                return Ok(());
            }
            values.first().zip(values.last()).map_or(0.0, |(first, last)| (last - first) * unit_s)
        }
        time => of_stamps(table, time, unit, &mut Vec::new())?.last().copied().unwrap_or(0.0),
    };
    for (other, shown) in clocks {
        let other_s = shown.between(0, table.rows() - 1);
        if agree(passed_s, other_s, shown.resolution_s) {
            continue;
        }
        let [one, other] = [index, other].map(|index| table.title(index));
        if is_ratio_of_units(passed_s / other_s) {
            let file = table.source().to_owned();
            return Err(RecordError::TimesDisagree { file, one, one_s: passed_s, other, other_s });
        }
        notes.push(Note::ClocksDiffer { column: one, passed_s, other, other_s });
    }
    Ok(())
}

/// Whether two clocks show the same time to have passed, s.
fn agree(passed_s: f64, other_s: f64, resolution_s: f64) -> bool {
    (passed_s - other_s).abs() <= MAX_CLOCK_ERROR * passed_s.max(other_s) + 2.0 * resolution_s
}

/// Whether two clocks differ as if one were read in the unit of the other.
fn is_ratio_of_units(ratio: f64) -> bool {
    const UNITS_S: [f64; 7] = [1e-9, 1e-6, 1e-3, 1.0, 60.0, 3600.0, 86_400.0];
    let mut ratios = UNITS_S.iter().flat_map(|one| UNITS_S.map(|other| one / other)).filter(|units| *units != 1.0);
    ratios.any(|units| (ratio / units - 1.0).abs() <= MAX_CLOCK_ERROR)
}
