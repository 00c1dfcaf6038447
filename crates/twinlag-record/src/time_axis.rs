//! From a column (or two) to seconds since the first sample.

use crate::RecordError;
use crate::clock::{self, DAY_NS, Day, Stamp};
use crate::column::Kind;
use crate::names::is_index;
use crate::note::Note;
use crate::sampling::{self, Clock};
use crate::scale::{self, Counter, Reading};
use crate::table::Table;
use crate::unit::Unit;
use crate::wording::plain;

/// How late a line may arrive that a logger sends, s: a tenth of a second where a computer is busy.
const MAX_DELAY_S: f64 = 0.1;

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
/// - `unit`: the unit of a column of numbers, where the caller chose one
///
/// # Errors
/// [`RecordError::NotATimeUnit`], [`RecordError::TimeUnitUnclear`], [`RecordError::NotATime`], [`RecordError::AmbiguousDate`],
/// [`RecordError::MissingTime`], and those of [`Table::numbers`].
pub(crate) fn read(
    table: &mut Table,
    columns: TimeColumns,
    unit: Option<&Unit>,
    notes: &mut Vec<Note>,
) -> Result<TimeAxis, RecordError> {
    match columns {
        TimeColumns::One(index) if table.columns()[index].kind() != Kind::Stamp => numeric(table, index, unit, notes),
        TimeColumns::One(index) => {
            let stamps = stamps(table, index)?;
            Ok(TimeAxis { time_s: elapsed(table, index, &stamps, notes)?, clock: Clock::SECONDS })
        }
        TimeColumns::DateAndTime { date, time } => {
            let (dates, mut stamps) = (stamps(table, date)?, stamps(table, time)?);
            for (stamp, date) in stamps.iter_mut().zip(&dates) {
                stamp.day = date.day;
            }
            notes.push(Note::DateAndTime { date: table.title(date), time: table.title(time) });
            Ok(TimeAxis { time_s: elapsed(table, date, &stamps, notes)?, clock: Clock::SECONDS })
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
    let unit_s = unit_s(table, index, chosen, notes)?;
    let first = table.numbers(index)?.first().copied().unwrap_or(0.0);
    let time_s = if first == 0.0 && unit_s == 1.0 {
        // The column itself; messages find its numbers in the record.
        table.take_values(index)
    } else {
        table.numbers(index)?.iter().map(|value| seconds(value - first, unit_s)).collect()
    };
    Ok(TimeAxis { time_s, clock: Clock { unit_s, first } })
}

/// The unit of a column of numbers: the one that the caller chose, else that of the header, else what stamps beside it show, else what
/// its size and its step show.
///
/// # Errors
/// [`RecordError::NotATimeUnit`], [`RecordError::TimeUnitUnclear`].
pub(crate) fn unit_s(
    table: &Table,
    index: usize,
    chosen: Option<&Unit>,
    notes: &mut Vec<Note>,
) -> Result<f64, RecordError> {
    let column = || table.title(index);
    let to = |symbol: &str| (symbol != "s").then_some("s");
    let stated = table.columns()[index].unit();
    let named = Unit::of_time_named(table.columns()[index].name()).filter(|_| *stated == Unit::Unstated);
    let named = named.map(|(symbol, seconds)| Unit::Time { symbol, seconds });
    let unit = chosen.or(named.as_ref()).unwrap_or(stated);
    if *unit == Unit::Unstated
        && let Some((stamps, Counter { symbol: unit, seconds, name, step_s })) = shown_by_stamps(table, index)
    {
        notes.push(Note::TimeByStamps { column: column(), stamps: table.title(stamps), unit, name, step_s });
        return Ok(seconds);
    }
    match unit {
        Unit::Time { symbol, seconds } if chosen.is_some() => {
            notes.push(Note::TimeUnitChosen { column: column(), unit: symbol, to: to(symbol) });
            Ok(*seconds)
        }
        Unit::Time { symbol, seconds } => {
            if to(symbol).is_some() {
                notes.push(Note::Unit { column: column(), unit: (*symbol).to_owned(), stated: true, to: to(symbol) });
            }
            Ok(*seconds)
        }
        Unit::Unstated => match scale::judge(table.columns()[index].raw()) {
            Reading::Recognised(Counter { symbol, seconds, name, step_s }) => {
                notes.push(Note::TimeRecognised { column: column(), unit: symbol, name, step_s });
                Ok(seconds)
            }
            Reading::Unclear { step } => {
                Err(RecordError::TimeUnitUnclear { file: table.source().to_owned(), column: column(), step })
            }
            reading => {
                notes.push(Note::Unit { column: column(), unit: "s".to_owned(), stated: false, to: None });
                if let Reading::Question(Counter { symbol, name, step_s, .. }) = reading {
                    notes.push(Note::TimeQuestion { column: column(), unit: symbol, name, step_s });
                }
                Ok(1.0)
            }
        },
        unit => {
            Err(RecordError::NotATimeUnit { file: table.source().to_owned(), column: column(), unit: unit.to_string() })
        }
    }
}

/// What a column counts by the stamps beside it, and the column of these; `None` where they do not show it.
fn shown_by_stamps(table: &Table, index: usize) -> Option<(usize, Counter)> {
    let is_stamp = |other: &usize| table.columns()[*other].kind() == Kind::Stamp;
    let mut stamps = (0..table.columns().len()).filter(is_stamp);
    stamps.find_map(|stamps| Some((stamps, counter_beside(table, index, stamps)?)))
}

/// The unit in which a column counts what passes by the stamps of another one. `None` if it names a unit, is not whole, does not rise, or
/// rises otherwise. Numbers may be missing.
pub(crate) fn counter_beside(table: &Table, index: usize, stamps: usize) -> Option<Counter> {
    let column = &table.columns()[index];
    let counts = || column.raw().iter().enumerate().filter(|(_, value)| value.is_finite());
    let is_count = column.kind() == Kind::Number
        && *column.unit() == Unit::Unstated
        && !is_index(column)
        && counts().all(|(_, value)| value.fract() == 0.0);
    let (first, last) = counts().next().zip(counts().next_back()).filter(|_| is_count)?;
    let steps: Vec<f64> = counts().zip(counts().skip(1)).map(|((_, one), (_, next))| next - one).collect();
    if steps.is_empty() || steps.iter().any(|step| *step <= 0.0) {
        return None;
    }
    let passed_s = elapsed(table, stamps, &self::stamps(table, stamps).ok()?, &mut Vec::new()).ok()?;
    let resolution_s = if passed_s.iter().all(|time_s| time_s.fract() == 0.0) { 1.0 } else { MAX_DELAY_S };
    scale::counter_of(last.1 - first.1, sampling::median(&steps), passed_s[last.0] - passed_s[first.0], resolution_s)
}

/// Divided, where the unit is a part of a second: 7 ms is then the double nearest to 0.007.
pub(crate) fn seconds(value: f64, unit_s: f64) -> f64 {
    if unit_s < 1.0 { value / (1.0 / unit_s).round() } else { value * unit_s }
}

fn stamps(table: &Table, index: usize) -> Result<Vec<Stamp>, RecordError> {
    let column = &table.columns()[index];
    (0..table.rows())
        .map(|row| match column.text(row) {
            Some(cell) => clock::parse(cell).ok_or_else(|| not_a_time(table, index, row, "a date-time or time of day")),
            // The numbers of a column that is not used are gone by now.
            None if column.raw().get(row).is_none_or(|value| value.is_nan()) => {
                let (file, at) = (table.source().to_owned(), table.place_of(row));
                Err(RecordError::MissingTime { file, at, column: table.title(index) })
            }
            None => Err(not_a_time(table, index, row, "a date-time or time of day as in the other rows")),
        })
        .collect()
}

fn not_a_time(table: &Table, index: usize, row: usize, expected: &'static str) -> RecordError {
    let column = &table.columns()[index];
    let cell = column.text(row).map_or_else(|| plain(column.raw()[row]), str::to_owned);
    let (file, at) = (table.source().to_owned(), table.place_of(row));
    RecordError::NotATime { file, at, column: table.title(index), cell, expected }
}

/// Which of two open numbers is the day.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    DayFirst,
    MonthFirst,
    /// All dates are the same one: whatever it is, it drops out of the differences.
    OneDay,
}

fn elapsed(table: &Table, index: usize, stamps: &[Stamp], notes: &mut Vec<Note>) -> Result<Vec<f64>, RecordError> {
    let order = order(table, index, stamps)?;
    let Some(&first) = stamps.first() else { return Ok(Vec::new()) };
    let mut nanos = Vec::with_capacity(stamps.len());
    let (mut days_on, mut before_ns) = (0, i64::MIN);
    for (row, stamp) in stamps.iter().enumerate() {
        let alike = stamp.day.is_some() == first.day.is_some()
            && stamp.time_ns.is_some() == first.time_ns.is_some()
            && stamp.offset_s.is_some() == first.offset_s.is_some();
        if !alike {
            return Err(not_a_time(table, index, row, "date, time and zone written as in the first row"));
        }
        let mut time_ns = stamp.time_ns.unwrap_or(0);
        let day = match stamp.day {
            Some(Day::Sure(day)) => clock::day_number(day),
            Some(Day::Open([a, b], year)) => {
                let (day, month) = if order == Order::MonthFirst { (b, a) } else { (a, b) };
                let open = jiff::civil::Date::new(year, month, day);
                // One day that is no date in the order tried is one day all the same.
                match open {
                    Ok(date) => clock::day_number(date),
                    Err(_) if order == Order::OneDay => 0,
                    Err(_) => return Err(not_a_time(table, index, row, "a date in the order of the other rows")),
                }
            }
            None => {
                // Back by more than half a day: past midnight. By less: a mistake, found when the
                // order is checked.
                time_ns += days_on * DAY_NS;
                if before_ns != i64::MIN && time_ns < before_ns - DAY_NS / 2 {
                    days_on += 1;
                    time_ns += DAY_NS;
                }
                before_ns = time_ns;
                0
            }
        };
        nanos.push(
            i128::from(day) * i128::from(DAY_NS) + i128::from(time_ns)
                - i128::from(stamp.offset_s.unwrap_or(0)) * 1_000_000_000,
        );
    }
    if days_on > 0 {
        notes.push(Note::Midnight { times: days_on as usize });
    }
    let first = nanos[0];
    Ok(nanos.iter().map(|ns| (ns - first) as f64 / 1e9).collect())
}

fn order(table: &Table, index: usize, stamps: &[Stamp]) -> Result<Order, RecordError> {
    let mut open = stamps.iter().enumerate().filter_map(|(row, stamp)| match stamp.day {
        Some(Day::Open(numbers, year)) => Some((row, numbers, year)),
        _ => None,
    });
    let Some((first_row, first, first_year)) = open.next() else { return Ok(Order::OneDay) };
    let (mut day_first, mut month_first, mut one_day) = (first[0] > 12, first[1] > 12, true);
    for (_, numbers, year) in open {
        day_first |= numbers[0] > 12;
        month_first |= numbers[1] > 12;
        one_day &= numbers == first && year == first_year;
    }
    match (day_first, month_first) {
        _ if one_day && stamps.iter().all(|stamp| matches!(stamp.day, Some(Day::Open(..)))) => Ok(Order::OneDay),
        (true, false) => Ok(Order::DayFirst),
        (false, true) => Ok(Order::MonthFirst),
        _ => {
            let cell = table.columns()[index].text(first_row).unwrap_or("").to_owned();
            let (file, at) = (table.source().to_owned(), table.place_of(first_row));
            Err(RecordError::AmbiguousDate { file, at, column: table.title(index), cell })
        }
    }
}
