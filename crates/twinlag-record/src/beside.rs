//! Clocks beside a column of time: what they show of its unit, and where they contradict it.

use crate::RecordError;
use crate::choose::Chosen;
use crate::column::Kind;
use crate::names::{is_called_temperature, is_index, is_velocity};
use crate::sampling;
use crate::scale::{self, Counter, MAX_CLOCK_ERROR};
use crate::stamps::{self, elapsed, settle_short};
use crate::table::Table;
use crate::time_axis::{TimeColumns, of_stamps, unit_of};
use crate::unit::Unit;
use crate::wrap::unwrapped;

/// How late a line may arrive that a logger sends, s: a tenth of a second where a computer is busy.
const MAX_DELAY_S: f64 = 0.1;

/// The time of each row by a column whose unit is known, s; not a number where the column is empty.
struct Shown {
    time_s: Vec<f64>,
    /// How far it may be off.
    resolution_s: f64,
}

impl Shown {
    /// `None` of a column that shows no time, or one that does not pass.
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
            Kind::Number if !is_called_temperature(column) && !is_index(column) && !is_velocity(column) => {
                let Some(Unit::Time { seconds, .. }) = column.stated_time_unit() else { return None };
                column.raw().iter().map(|value| value * seconds).collect()
            }
            _ => return None,
        };
        let rises = time_s.windows(2).all(|pair| pair[1] >= pair[0]);
        let resolution_s = if time_s.iter().all(|time_s| time_s.fract() == 0.0) { 1.0 } else { MAX_DELAY_S };
        (rises && time_s.first() < time_s.last()).then_some(Self { time_s, resolution_s })
    }

    /// From one row to another, s.
    fn between(&self, first: usize, last: usize) -> f64 {
        self.time_s[last] - self.time_s[first]
    }
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

/// The unit in which a column counts what passes by the clock of another one. `None` if it names a unit, does not rise, rises otherwise, or
/// counts rows. Numbers may be missing.
pub(crate) fn counter_beside(table: &Table, index: usize, clock: usize) -> Option<Counter> {
    let column = &table.columns()[index];
    let is_other = *column.unit() != Unit::Unstated || column.stated_time_unit().is_some();
    if column.kind() != Kind::Number || is_other || is_called_temperature(column) || is_index(column) {
        return None;
    }
    let rows: Vec<usize> = (0..column.raw().len()).filter(|row| column.raw()[*row].is_finite()).collect();
    let values: Vec<f64> = rows.iter().map(|row| column.raw()[*row]).collect();
    let values = unwrapped(&values).map_or(values, |(values, _)| values);
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

/// Refuses a time that was guessed where a clock beside it shows another one.
///
/// - `unit`: the unit that the caller chose
///
/// # Errors
/// [`RecordError::TimesDisagree`], and those of reading the time.
pub(crate) fn expect_agreement(table: &Table, chosen: &Chosen, unit: Option<&Unit>) -> Result<(), RecordError> {
    let Some(time) = chosen.time else { return Ok(()) };
    let taken = chosen.columns();
    let others: Vec<usize> = (0..table.columns().len()).filter(|index| !taken.contains(index)).collect();
    let clocks: Vec<(usize, Shown)> =
        others.into_iter().filter_map(|index| Some((index, Shown::by(table, index)?))).collect();
    if clocks.is_empty() {
        return Ok(());
    }
    let index = match time {
        TimeColumns::One(index) => index,
        TimeColumns::DateAndTime { time, .. } => time,
    };
    let passed_s = match time {
        TimeColumns::One(index) if table.columns()[index].kind() != Kind::Stamp => {
            let (values, unit_s) = (table.numbers(index)?, unit_of(table, index, unit, &mut Vec::new())?.1);
            let values = unwrapped(values).map_or_else(|| values.to_vec(), |(values, _)| values);
            values.first().zip(values.last()).map_or(0.0, |(first, last)| (last - first) * unit_s)
        }
        time => of_stamps(table, time, unit, &mut Vec::new())?.last().copied().unwrap_or(0.0),
    };
    for (other, shown) in clocks {
        let other_s = shown.between(0, table.rows() - 1);
        let tolerance_s = MAX_CLOCK_ERROR * passed_s.max(other_s) + 2.0 * shown.resolution_s;
        if (passed_s - other_s).abs() > tolerance_s {
            let [one, other] = [index, other].map(|index| table.title(index));
            return Err(RecordError::TimesDisagree {
                file: table.source().to_owned(),
                one,
                one_s: passed_s,
                other,
                other_s,
            });
        }
    }
    Ok(())
}
