//! From a column of dates and times of day to seconds since its first row.

use crate::RecordError;
use crate::clock::{self, Day, Stamp};
use crate::note::Note;
use crate::table::Table;
use crate::unit::Unit;
use crate::wording::plain;

const DAY_NS: i128 = clock::DAY_NS as i128;

/// How many times as long the longest step has to be in the other order of day and month; chosen: a day is a thirtieth of a month.
const CLOSER: i128 = 10;

/// The stamps of all rows.
///
/// # Errors
/// [`RecordError::NotATime`], [`RecordError::MissingTime`].
pub(crate) fn of_column(table: &Table, index: usize) -> Result<Vec<Stamp>, RecordError> {
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

/// Seconds since the first row, of the stamps of a column.
///
/// # Errors
/// [`RecordError::NotATime`], [`RecordError::AmbiguousDate`].
pub(crate) fn elapsed(
    table: &Table,
    index: usize,
    stamps: &[Stamp],
    notes: &mut Vec<Note>,
) -> Result<Vec<f64>, RecordError> {
    let order = order(table, index, stamps, notes)?;
    let Some(&first) = stamps.first() else { return Ok(Vec::new()) };
    let is_alike = |stamp: &Stamp| {
        stamp.day.is_some() == first.day.is_some()
            && stamp.time_ns.is_some() == first.time_ns.is_some()
            && stamp.offset_s.is_some() == first.offset_s.is_some()
    };
    if let Some(row) = stamps.iter().position(|stamp| !is_alike(stamp)) {
        return Err(not_a_time(table, index, row, "date, time and zone written as in the first row"));
    }
    let instants = Instants::of(stamps, order)
        .map_err(|row| not_a_time(table, index, row, "a date in the order of the other rows"))?;
    if instants.midnights > 0 {
        notes.push(Note::Midnight { times: instants.midnights });
    }
    let first = instants.nanos[0];
    Ok(instants.nanos.iter().map(|ns| (ns - first) as f64 / 1e9).collect())
}

/// Stamps that are alike, as instants.
struct Instants {
    /// Since 1970, or since midnight before the first row.
    nanos: Vec<i128>,
    /// How often a time of day goes past midnight.
    midnights: usize,
}

impl Instants {
    /// The error is the row of a date that does not exist in this order.
    fn of(stamps: &[Stamp], order: Order) -> Result<Self, usize> {
        let mut instants = Self { nanos: Vec::with_capacity(stamps.len()), midnights: 0 };
        let mut before_ns: Option<i128> = None;
        for (row, stamp) in stamps.iter().enumerate() {
            let mut time_ns = i128::from(stamp.time_ns.unwrap_or(0));
            let day = if let Some(day) = stamp.day {
                day_in(day, order).ok_or(row)?
            } else {
                // Back by more than half a day: past midnight. By less: a mistake, found when the order is checked.
                time_ns += instants.midnights as i128 * DAY_NS;
                if before_ns.is_some_and(|before_ns| time_ns < before_ns - DAY_NS / 2) {
                    instants.midnights += 1;
                    time_ns += DAY_NS;
                }
                before_ns = Some(time_ns);
                0
            };
            let offset_ns = i128::from(stamp.offset_s.unwrap_or(0)) * 1_000_000_000;
            instants.nanos.push(i128::from(day) * DAY_NS + time_ns - offset_ns);
        }
        Ok(instants)
    }

    /// The longest step; `None` where stamps do not rise.
    fn longest_step_ns(&self) -> Option<i128> {
        let steps = self.nanos.windows(2).map(|pair| pair[1] - pair[0]);
        steps.clone().all(|step| step > 0).then(|| steps.max().unwrap_or(0))
    }
}

/// Days since 1970; `None` of what is no date in this order.
fn day_in(day: Day, order: Order) -> Option<i64> {
    match day {
        Day::Sure(day) => Some(clock::day_number(day)),
        Day::Open([a, b], year) => {
            let (day, month) = if order == Order::MonthFirst { (b, a) } else { (a, b) };
            // One day that is no date in the order tried is one day all the same.
            let open = jiff::civil::Date::new(year, month, day).ok().map(clock::day_number);
            open.or((order == Order::OneDay).then_some(0))
        }
    }
}

/// Where no date shows its order by itself, that in which rows follow each other closely.
fn order(table: &Table, index: usize, stamps: &[Stamp], notes: &mut Vec<Note>) -> Result<Order, RecordError> {
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
        (false, false) if let Some(order) = closer_order(stamps) => {
            notes.push(Note::DateOrder { column: table.title(index), is_day_first: order == Order::DayFirst });
            Ok(order)
        }
        _ => {
            let cell = table.columns()[index].text(first_row).unwrap_or("").to_owned();
            let (file, at) = (table.source().to_owned(), table.place_of(first_row));
            Err(RecordError::AmbiguousDate { file, at, column: table.title(index), cell })
        }
    }
}

/// The order of dates in which the longest step from row to row is a tenth or less of that in the other order, or in which alone rows
/// follow each other.
fn closer_order(stamps: &[Stamp]) -> Option<Order> {
    let longest = |order| Instants::of(stamps, order).ok().and_then(|instants| instants.longest_step_ns());
    match (longest(Order::DayFirst), longest(Order::MonthFirst)) {
        (Some(day), Some(month)) if CLOSER * day <= month => Some(Order::DayFirst),
        (Some(day), Some(month)) if CLOSER * month <= day => Some(Order::MonthFirst),
        (Some(_), None) => Some(Order::DayFirst),
        (None, Some(_)) => Some(Order::MonthFirst),
        _ => None,
    }
}

/// Decides of clocks with two parts, `10:30`, whether these are hours and minutes or minutes and seconds: by the unit of the first part
/// that the caller chose, by the header, or since other rows have three parts.
///
/// # Errors
/// [`RecordError::ClockUnclear`], [`RecordError::NeedsNoUnit`].
pub(crate) fn settle_short(
    table: &Table,
    index: usize,
    stamps: &mut [Stamp],
    chosen: Option<&Unit>,
) -> Result<(), RecordError> {
    let of_column = || (table.source().to_owned(), table.title(index));
    let needs_no_unit = || {
        let (file, column) = of_column();
        Err(RecordError::NeedsNoUnit { file, column })
    };
    let Some(first) = stamps.iter().position(|stamp| stamp.is_short && stamp.day.is_none()) else {
        return if chosen.is_none() { Ok(()) } else { needs_no_unit() };
    };
    let name = table.columns()[index].name().to_lowercase();
    let are_all_short = stamps.iter().all(|stamp| stamp.is_short);
    let rises = |stamps: &[Stamp]| {
        Instants::of(stamps, Order::OneDay).is_ok_and(|instants| instants.longest_step_ns().is_some())
    };
    let are_minutes = match chosen {
        Some(Unit::Time { symbol: "min", .. }) => true,
        Some(Unit::Time { symbol: "h", .. }) => false,
        Some(_) => return needs_no_unit(),
        None if name.contains("mm:ss") && !name.contains("h:mm") => true,
        None if name.contains("hh:mm") && !name.contains("mm:ss") => false,
        None if !are_all_short => !rises(stamps),
        None => {
            let (file, column) = of_column();
            let cell = table.columns()[index].text(first).unwrap_or("").to_owned();
            return Err(RecordError::ClockUnclear { file, column, cell });
        }
    };
    if are_minutes {
        stamps.iter_mut().filter(|stamp| stamp.is_short).for_each(Stamp::take_as_minutes);
    }
    Ok(())
}
