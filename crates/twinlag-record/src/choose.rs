//! Which columns are time, T1 and T2: those that the caller names, else a guess from names and
//! units. A guess is noted. If a header can be read in two ways, nothing is guessed.

use std::ops::RangeInclusive;

use crate::RecordError;
use crate::beside::{counter_beside, stamps_rise};
use crate::clock;
use crate::column::{Column, Kind};
use crate::error::Candidates;
use crate::names::{
    OTHER_QUANTITIES, SURROUNDINGS, TEMPERATURE, counts_rows, first_word, has, is_apart, is_called_temperature,
    is_counter, is_index, is_time, is_velocity,
};
use crate::note::Note;
use crate::selection::{ColumnRef, Selection, Setting};
use crate::table::Table;
use crate::time_axis::{TimeColumns, unit_of};
use crate::unit::Unit;

/// The chosen columns, from 0.
#[derive(Debug, PartialEq)]
pub(crate) struct Chosen {
    /// `None`: counted from the period.
    pub(crate) time: Option<TimeColumns>,
    pub(crate) channels: [usize; 2],
    pub(crate) reference: Option<usize>,
    pub(crate) flow: Option<usize>,
    pub(crate) position: Option<usize>,
}

impl Chosen {
    /// All of them.
    pub(crate) fn columns(&self) -> Vec<usize> {
        let time = match self.time {
            Some(TimeColumns::One(index)) => vec![index],
            Some(TimeColumns::DateAndTime { date, time }) => vec![date, time],
            None => Vec::new(),
        };
        time.into_iter().chain(self.channels).chain(self.reference).chain(self.flow).chain(self.position).collect()
    }
}

/// Periods from row to row that may be given, in seconds: no logger is faster than a nanosecond or slower than a year. What is beyond is
/// a slip of the exponent.
pub const SAMPLE_PERIODS_S: RangeInclusive<f64> = 1e-9..=366.0 * 86_400.0;

/// Longest unit of time after which a column may be called and be the time: those of longer ones, as `h`, `d` and `min`, stand
/// for other quantities as well.
const LONGEST_NAMING_UNIT_S: f64 = 1.0;

/// Makes the choice, and notes what was guessed.
///
/// # Errors
/// Those of [`Table::find`]; [`RecordError::TimeAndPeriod`], [`RecordError::BadPeriod`],
/// [`RecordError::NoTime`], [`RecordError::ChannelsUnclear`], [`RecordError::SameColumn`],
/// [`RecordError::NoValues`], [`RecordError::NotATemperature`].
pub(crate) fn choose(table: &Table, selection: &Selection, notes: &mut Vec<Note>) -> Result<Chosen, RecordError> {
    let find = |wanted: &Option<_>| wanted.as_ref().map(|wanted| table.find(wanted)).transpose();
    let (named_time, named) = (find(&selection.time)?, [find(&selection.t1)?, find(&selection.t2)?]);
    let (reference, flow, position) = (find(&selection.reference)?, find(&selection.flow)?, find(&selection.position)?);
    let taken: Vec<usize> = [named_time, named[0], named[1], reference, flow, position].into_iter().flatten().collect();
    if let Some((_, &twice)) = taken.iter().enumerate().find(|(at, index)| taken[..*at].contains(index)) {
        return Err(RecordError::SameColumn { file: table.source().to_owned(), column: table.title(twice) });
    }
    if let Some(period_s) = selection.period_s {
        let file = table.source().to_owned();
        if let Some(time) = named_time {
            return Err(RecordError::TimeAndPeriod { file, column: table.title(time), period_s });
        }
        if !SAMPLE_PERIODS_S.contains(&period_s) {
            return Err(RecordError::BadPeriod { file, period_s });
        }
    }
    let guessed_time = match named_time {
        Some(_) => None,
        None => guess_time(table, &taken),
    };
    // A logger's own clock is better than the time at which its lines arrived, if it has a number in each row.
    let clock = named_time.or(guessed_time).and_then(|stamps| own_clock(table, stamps, &taken));
    let whole = clock.filter(|&clock| table.columns()[clock].missing() == 0);
    let guessed_time = guessed_time.map(|time| whole.unwrap_or(time));
    // Even where a period is given the time column is told, so that it is not taken for a
    // temperature.
    let time = named_time.or(guessed_time).map(|index| with_partner(table, index, &taken));
    let channels = match named {
        [Some(t1), Some(t2)] => [t1, t2],
        _ => guess_channels(table, named, time, [reference, flow, position, clock], notes)?,
    };
    if flow.is_none() && position.is_none() {
        let is_free = |(index, column): &(usize, &Column)| {
            let is_taken = channels.contains(index) || reference == Some(*index);
            !is_taken && column.kind == Kind::Number && is_velocity(column)
        };
        let unused = table.columns().iter().enumerate().find(is_free);
        notes.extend(unused.map(|(index, _)| Note::FlowUnused { column: table.title(index), number: index + 1 }));
    }
    if selection.period_s.is_some() {
        return Ok(Chosen { time: None, channels, reference, flow, position });
    }
    let Some(time) = time else {
        if table.period_s().is_some() {
            return Ok(Chosen { time: None, channels, reference, flow, position });
        }
        return Err(RecordError::NoTime { file: table.source().to_owned(), columns: table.listing() });
    };
    if let Some(index) = guessed_time {
        notes.insert(0, Note::Guessed { role: "time", column: table.title(index) });
    }
    Ok(Chosen { time: Some(time), channels, reference, flow, position })
}

impl Table {
    /// The selection with what it leaves open: the columns that are guessed, and the unit of time that no header states. Each column is
    /// named as in the header, or numbered where its name is empty or that of another column too.
    ///
    /// # Errors
    /// As [`crate::Record::from_table`] on columns that cannot be identified.
    pub fn resolved(&self, selection: &Selection) -> Result<Selection, RecordError> {
        let chosen = choose(self, selection, &mut Vec::new())?;
        let columns = self.columns();
        let column = |index: usize| {
            let name = columns[index].name();
            let is_unique = columns.iter().filter(|column| column.name() == name).count() == 1;
            if name.is_empty() || !is_unique { ColumnRef::Number(index + 1) } else { ColumnRef::Name(name.to_owned()) }
        };
        let time = chosen.time.map(|time| match time {
            TimeColumns::One(index) | TimeColumns::DateAndTime { date: index, .. } => column(index),
        });
        // The unit that is nowhere written in the file.
        let time_unit = match chosen.time {
            Some(TimeColumns::One(index))
                if columns[index].kind() == Kind::Number && columns[index].stated_time_unit().is_none() =>
            {
                let unit = unit_of(self, index, selection.time_unit.as_ref(), &mut Vec::new());
                unit.ok().map(|(symbol, seconds)| Unit::Time { symbol, seconds })
            }
            _ => None,
        };
        let [t1, t2] = chosen.channels.map(|index| Some(column(index)));
        let reference = chosen.reference.map(column);
        Ok(Selection {
            time,
            time_unit: selection.time_unit.clone().or(time_unit),
            t1,
            t2,
            reference,
            flow: chosen.flow.map(column),
            position: chosen.position.map(column),
            ..selection.clone()
        })
    }
}

fn guess_time(table: &Table, taken: &[usize]) -> Option<usize> {
    let columns = table.columns();
    let free = |index: &usize| !taken.contains(index);
    let length_s = |column: &Column| match column.stated_time_unit() {
        Some(Unit::Time { seconds, .. }) if column.kind() == Kind::Number => seconds,
        _ => f64::INFINITY,
    };
    // A date has parts that are called so as well, which begin anew.
    let are_parts = columns.iter().filter(|column| length_s(column).is_finite()).count() > 1;
    let is_called_by_unit = |column: &Column| {
        let is_since = column.name().contains(" since ") && length_s(column).is_finite();
        let is_called = (length_s(column) <= LONGEST_NAMING_UNIT_S || is_since) && !is_called_temperature(column);
        // What is nothing but milliseconds is the time also where a row is amiss, which is refused with its place.
        let is_alone = !are_parts && length_s(column) < LONGEST_NAMING_UNIT_S && Unit::parse(column.name()).is_time();
        is_called && (is_alone || rises(column))
    };
    let open = || (0..columns.len()).filter(free);
    let named = open().find(|&index| is_time(&columns[index]));
    named.or_else(|| open().find(|&index| is_called_by_unit(&columns[index]))).or_else(|| {
        // Without any name: the first column, if it rises from row to row and does not count the rows.
        let first = columns.first().filter(|first| free(&0) && first.name().is_empty())?;
        (rises(first) && *first.unit() == Unit::Unstated && !counts_rows(first)).then_some(0)
    })
}

/// The time that a logger counts beside a column of stamps: in any unit where the header names none, and where it does if these do not rise
/// from row to row.
fn own_clock(table: &Table, stamps: usize, taken: &[usize]) -> Option<usize> {
    let columns = table.columns();
    if columns[stamps].kind() != Kind::Stamp {
        return None;
    }
    let others = || (0..columns.len()).filter(|index| *index != stamps && !taken.contains(index));
    let may_be = |index: usize| columns[index].name().is_empty() || is_time(&columns[index]);
    let counter = others().find(|&index| may_be(index) && counter_beside(table, index, stamps).is_some());
    counter.or_else(|| {
        let mut clocks = others().filter(|&index| is_time(&columns[index]) && rises(&columns[index]));
        clocks.find(|&index| columns[index].stated_time_unit().is_some() && !stamps_rise(table, stamps))
    })
}

/// Whether the numbers of a column rise from row to row.
fn rises(column: &Column) -> bool {
    column.kind() == Kind::Number && column.raw().windows(2).all(|pair| pair[1] > pair[0])
}

/// A date without time of day belongs to a time of day without date beside it.
fn with_partner(table: &Table, index: usize, taken: &[usize]) -> TimeColumns {
    let parts = |index: usize| {
        let column = table.columns().get(index).filter(|column| column.kind() == Kind::Stamp)?;
        let stamp = clock::parse((0..table.rows()).find_map(|row| column.text(row))?)?;
        Some((stamp.day.is_some(), stamp.time_ns.is_some()))
    };
    let neighbours = [Some(index + 1), index.checked_sub(1)];
    let mut others = neighbours.into_iter().flatten().filter(|other| !taken.contains(other));
    match parts(index) {
        Some((true, false)) => match others.find(|&other| parts(other) == Some((false, true))) {
            Some(time) => TimeColumns::DateAndTime { date: index, time },
            None => TimeColumns::One(index),
        },
        Some((false, true)) => match others.find(|&other| parts(other) == Some((true, false))) {
            Some(date) => TimeColumns::DateAndTime { date, time: index },
            None => TimeColumns::One(index),
        },
        _ => TimeColumns::One(index),
    }
}

fn guess_channels(
    table: &Table,
    named: [Option<usize>; 2],
    time: Option<TimeColumns>,
    apart: [Option<usize>; 4],
    notes: &mut Vec<Note>,
) -> Result<[usize; 2], RecordError> {
    let columns = table.columns();
    let is_free = |index: usize| {
        let of_time = match time {
            Some(TimeColumns::One(time)) => time == index,
            Some(TimeColumns::DateAndTime { date, time }) => date == index || time == index,
            None => false,
        };
        !of_time && !apart.contains(&Some(index)) && !named.contains(&Some(index))
    };
    let free: Vec<usize> = (0..columns.len()).filter(|&index| is_free(index)).collect();
    let candidates = candidates(columns, &free, &[Kind::Number]);
    let pair = clear_pair(columns, named, &candidates).or_else(|| only_pair(columns, named, &free, &[Kind::Number]));
    let Some(channels) = pair else {
        return Err(unclear(table, named, apart[0], &free, &candidates));
    };
    for (role, (was, index)) in ["T1", "T2"].into_iter().zip(named.into_iter().zip(channels)) {
        if was.is_none() {
            notes.push(Note::Guessed { role, column: table.title(index) });
        }
    }
    Ok(channels)
}

/// The columns that may be sensors by their names and units.
fn candidates(columns: &[Column], free: &[usize], kinds: &[Kind]) -> Vec<usize> {
    let has_names = columns.iter().any(|column| !column.name().is_empty());
    let may_be = |column: &Column| {
        let named = is_called_temperature(column) && !is_apart(column, columns) && !is_index(column);
        kinds.contains(&column.kind()) && if has_names { named } else { !is_counter(column) }
    };
    free.iter().copied().filter(|&index| may_be(&columns[index])).collect()
}

/// Two columns beside the time that nothing calls anything but sensors, in a file in which nothing
/// is called a temperature: `Time,Thin,Thick`.
fn only_pair(columns: &[Column], named: [Option<usize>; 2], free: &[usize], kinds: &[Kind]) -> Option<[usize; 2]> {
    let is_data = |index: &&usize| kinds.contains(&columns[**index].kind()) && !is_index(&columns[**index]);
    let is_open = |index: usize| {
        let column = &columns[index];
        let is_other = has(column, &OTHER_QUANTITIES) || has(column, &SURROUNDINGS) || is_apart(column, columns);
        *column.unit() == Unit::Unstated && !is_other
    };
    let no_temperature = named == [None; 2] && !free.iter().any(|&index| is_called_temperature(&columns[index]));
    match free.iter().filter(is_data).collect::<Vec<_>>()[..] {
        [&t1, &t2] if no_temperature && is_open(t1) && is_open(t2) => Some([t1, t2]),
        _ => None,
    }
}

/// Why T1 and T2 are not clear. What would have been clear but for one fault is refused for that
/// fault.
fn unclear(
    table: &Table,
    named: [Option<usize>; 2],
    reference: Option<usize>,
    free: &[usize],
    candidates: &[usize],
) -> RecordError {
    let (file, columns) = (table.source().to_owned(), table.columns());
    let kinds = [Kind::Number, Kind::Empty];
    let with_empty = clear_pair(columns, named, &self::candidates(columns, free, &kinds))
        .or_else(|| only_pair(columns, named, free, &kinds));
    let mut pair = with_empty.into_iter().flatten();
    if let Some(empty) = pair.find(|&index| columns[index].kind() == Kind::Empty) {
        return RecordError::NoValues { file, column: table.title(empty) };
    }
    if let Some(index) = reference.filter(|&index| ["t1", "t2"].contains(&first_word(&columns[index]).as_str())) {
        return RecordError::SameColumn { file, column: table.title(index) };
    }
    if let Some(index) = foreign_unit(columns, named, free).filter(|_| candidates.is_empty()) {
        let unit = columns[index].unit().to_string();
        return RecordError::NotATemperature { file, column: table.title(index), unit };
    }
    let is_doubtful = |index: &usize| has(&columns[*index], &SURROUNDINGS);
    let titles = |which: &dyn Fn(&usize) -> bool| -> Vec<String> {
        candidates.iter().filter(|index| which(index)).map(|&index| table.title(index)).collect()
    };
    // The likelier ones first: sensors by name and unit, then any other numbers.
    let numbers = || free.iter().filter(|&&index| columns[index].kind() == Kind::Number && !is_index(&columns[index]));
    let sure = candidates.iter().filter(|index| !is_doubtful(index));
    let rest = numbers()
        .filter(|index| !candidates.contains(index) && !is_apart(&columns[**index], columns))
        .filter(|index| *columns[**index].unit() == Unit::Unstated);
    let mut likely = sure.chain(rest).chain(candidates.iter().filter(|index| is_doubtful(index)));
    let mut example = Vec::new();
    for (setting, _) in [Setting::T1, Setting::T2].into_iter().zip(named).filter(|(_, named)| named.is_none()) {
        example.extend(likely.next().map(|index| (setting, index + 1)));
    }
    let chosen = named.into_iter().flatten().next().map(|index| table.title(index));
    let are_named = columns.iter().any(|column| !column.name().is_empty());
    let why = Candidates { chosen, are_named, found: titles(&|_| true), surroundings: titles(&is_doubtful), example };
    RecordError::ChannelsUnclear { file, candidates: Box::new(why), columns: table.listing() }
}

/// T1 and T2, if there is one way only to take them from the candidates.
fn clear_pair(columns: &[Column], named: [Option<usize>; 2], candidates: &[usize]) -> Option<[usize; 2]> {
    let literal =
        |want: &str| match *candidates.iter().filter(|&&i| first_word(&columns[i]) == want).collect::<Vec<_>>() {
            [&index] => Some(index),
            _ => None,
        };
    let doubtful = candidates.iter().any(|&index| has(&columns[index], &SURROUNDINGS));
    match (named, candidates) {
        ([Some(t1), None], &[t2]) if !doubtful => Some([t1, t2]),
        ([None, Some(t2)], &[t1]) if !doubtful => Some([t1, t2]),
        ([Some(t1), None], _) => literal("t2").map(|t2| [t1, t2]),
        ([None, Some(t2)], _) => literal("t1").map(|t1| [t1, t2]),
        ([None, None], list) => match (literal("t1"), literal("t2"), list) {
            (Some(t1), Some(t2), _) => Some([t1, t2]),
            (_, _, &[t1, t2]) if !doubtful => Some([t1, t2]),
            _ => None,
        },
        _ => None,
    }
}

/// The first column that is a sensor by its name and none by its unit, as `T1 [mV]`; without such a
/// name the first with such a unit, unless a column without unit leaves it open which ones are
/// meant.
fn foreign_unit(columns: &[Column], named: [Option<usize>; 2], free: &[usize]) -> Option<usize> {
    let is_foreign = |index: &usize| matches!(columns[*index].unit(), Unit::Other(_));
    let numbers: Vec<usize> = free
        .iter()
        .copied()
        .filter(|&index| {
            let column = &columns[index];
            column.kind() == Kind::Number && !is_apart(column, columns) && !is_index(column)
        })
        .collect();
    let mut foreign = numbers.iter().copied().filter(is_foreign);
    let is_open = numbers.iter().any(|&index| *columns[index].unit() == Unit::Unstated);
    let called = foreign.clone().find(|&index| has(&columns[index], &TEMPERATURE));
    let chosen = named.into_iter().flatten().find(is_foreign);
    chosen.or(called).or_else(|| foreign.next().filter(|_| !is_open))
}
