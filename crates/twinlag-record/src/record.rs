//! Two temperatures over time, checked: what every estimator starts from.
//!
//! Nothing is resampled and nothing is filled: a missing temperature is NaN, and `segments` are the
//! runs of rows between missing ones and gaps.

use std::io::{Read, Write};
use std::ops::{Range, RangeInclusive};
use std::path::Path;
use std::sync::Arc;

use crate::beside::expect_agreement;
use crate::choose::{Chosen, SAMPLE_PERIODS_S, choose};
use crate::column::Column;
use crate::note::Note;
use crate::row_lines::RowLines;
use crate::sampling::{self, Bursts, Clock, Sampling, SamplingKind, bursts};
use crate::selection::{SamplingChoice, Selection};
use crate::table::{Table, shortened};
use crate::time_axis::{self, TimeAxis};
use crate::unit::Unit;
use crate::wording::plain;
use crate::write::{Decimals, write_csv};
use crate::{Place, RecordError};

/// Fewest samples in segments that make a record. Fewer do not even determine two time constants
/// and a noise level.
pub(crate) const MIN_SAMPLES: usize = 8;
/// Gaps that get a note each.
const MAX_LISTED_GAPS: usize = 5;
pub(crate) const ABSOLUTE_ZERO_C: f64 = -273.15;
/// What a temperature can be, °C: from absolute zero to what no thermocouple reaches; sentinels such as 9999 and 1e37 lie beyond.
pub const TEMPERATURE_RANGE_C: RangeInclusive<f64> = ABSOLUTE_ZERO_C..=5000.0;

/// Least change, K, of a channel that changes: a thousandth of what the best thermometers resolve.
const MIN_CHANGE_K: f64 = 1e-9;

/// Below this, in K, a reading calls for a question: colder than any gas but hydrogen and helium boils.
/// Chosen; a note depends on it and no number.
const COLD_K: f64 = 60.0;
/// How near to 273.15 K the median difference of two sensors must be for the same question. Sensors
/// of one gas differ by lags, whose median is small, and calibration, which is a few K. Chosen.
const NEAR_ICE_POINT_K: f64 = 10.0;

/// Vectors to make a record from; `[n]` each, missing temperatures NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Channels {
    /// Where they are from, for messages.
    pub source: String,
    /// Names of the two sensors.
    pub names: [String; 2],
    /// Strictly increasing. The first stamp becomes zero.
    pub time_s: Vec<f64>,
    /// First sensor.
    pub t1_c: Vec<f64>,
    /// Second sensor.
    pub t2_c: Vec<f64>,
    /// A trusted temperature, for scoring.
    pub reference_c: Option<Vec<f64>>,
}

/// Two temperatures over time. All vectors have one entry per row; built by its constructors alone,
/// which check it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Record {
    /// The file, or whatever the caller called it.
    pub source: String,
    /// Names of the two sensors, without units.
    pub channels: [String; 2],
    /// Strictly increasing, from 0, as stamped.
    pub time_s: Vec<f64>,
    /// First sensor; NaN where missing. What is made of the record may share it.
    pub t1_c: Arc<Vec<f64>>,
    /// Second sensor; NaN where missing. What is made of the record may share it.
    pub t2_c: Arc<Vec<f64>>,
    /// A trusted temperature, if one was chosen; NaN where missing.
    pub reference_c: Option<Vec<f64>>,
    /// A flow velocity or density in the unit of its column, if one was chosen; positive in every
    /// row that is used.
    pub flow: Option<Vec<f64>>,
    /// The speed of sensors that move, m/s, from a column of their position, if one was chosen; finite in every row that is used.
    pub speed_m_s: Option<Vec<f64>>,
    /// Rows in which T1 or T2 is missing.
    pub missing: usize,
    /// How the stamps lie in time.
    pub sampling: Sampling,
    /// Maximal runs of rows with both temperatures and no gap in time; at least two rows each, in
    /// order.
    pub segments: Vec<Range<usize>>,
    /// How the file was understood.
    pub notes: Vec<Note>,
    /// Line of each row, where the record was read from a file.
    lines: Option<RowLines>,
    /// First row of each record that was joined into this one; `[0]` if none was.
    pub(crate) starts: Vec<usize>,
}

/// What is known of the rows besides their numbers, for messages.
struct Origin<'a> {
    file: &'a str,
    /// The columns of time, T1, T2 and the reference.
    table: Option<(&'a Table, &'a Chosen)>,
    columns: [String; 3],
    units: [Unit; 3],
}

impl Origin<'_> {
    fn place(&self, row: usize) -> Place {
        self.table.map_or(Place::Sample(row + 1), |(table, _)| table.place_of(row))
    }

    /// A stamp as the file has it.
    fn stamp(&self, row: usize, time_s: f64) -> String {
        let cell = |index: usize| {
            let (table, _) = self.table?;
            let column = &table.columns()[index];
            let number = column.raw().get(row).copied().unwrap_or(time_s);
            Some(column.text(row).map_or_else(|| plain(number), str::to_owned))
        };
        let time = match self.table.and_then(|(_, chosen)| chosen.time) {
            Some(time_axis::TimeColumns::One(index)) => cell(index),
            Some(time_axis::TimeColumns::DateAndTime { date, time }) => {
                cell(date).zip(cell(time)).map(|(date, time)| format!("{date} {time}"))
            }
            None => None,
        };
        time.unwrap_or_else(|| format!("{} s", plain(time_s)))
    }
}

impl Record {
    /// Reads a file: [`Table::from_path`], then [`Record::from_table`].
    ///
    /// # Errors
    /// Those of [`Table::from_path`] and of [`Record::from_table`].
    pub fn read(path: impl AsRef<Path>, selection: &Selection) -> Result<Self, RecordError> {
        Self::from_owned(Table::from_path(path)?, selection)
    }

    /// Reads text as it comes: [`Table::from_reader`], then [`Record::from_table`].
    ///
    /// - `source`: its name in messages
    ///
    /// # Errors
    /// Those of [`Table::from_reader`] and of [`Record::from_table`].
    pub fn from_reader(reader: impl Read, source: &str, selection: &Selection) -> Result<Self, RecordError> {
        Self::from_owned(Table::from_reader(reader, source)?, selection)
    }

    /// Takes time and two temperatures from a table; converts them to s and °C, and checks them.
    ///
    /// # Errors
    /// Every variant of [`RecordError`] on columns that cannot be identified or used, times that do
    /// not increase, and temperatures that cannot be: out of range, missing throughout, constant,
    /// identical, or fewer than 8 usable.
    pub fn from_table(table: &Table, selection: &Selection) -> Result<Self, RecordError> {
        Self::from_owned(table.clone(), selection)
    }

    /// As [`Self::from_table`], without a second copy of what the table holds.
    ///
    /// # Errors
    /// Those of [`Record::from_table`].
    pub fn from_owned(mut table: Table, selection: &Selection) -> Result<Self, RecordError> {
        let mut notes = Vec::new();
        let chosen = choose(&table, selection, &mut notes)?;
        let period_s = selection.period_s.or(table.period_s()).unwrap_or(1.0);
        if selection.time.is_none() {
            expect_agreement(&table, &chosen, selection.time_unit.as_ref(), period_s, &mut notes)?;
        }
        let (time_s, clock) = match (chosen.time, selection.period_s) {
            (Some(columns), _) => {
                let TimeAxis { time_s, clock } =
                    time_axis::read(&mut table, columns, selection.time_unit.as_ref(), &mut notes)?;
                (time_s, Some(clock))
            }
            (None, given) => {
                notes.push(Note::PeriodGiven { period_s, is_of_file: given.is_none() });
                let time_s = (0..table.rows()).map(|row| row as f64 * period_s).collect();
                // Row numbers times a period show no clock.
                (time_s, None)
            }
        };
        // Clocks beside the time have shown what they can.
        table.keep_values_of(&chosen.columns());
        let mut temperatures = Vec::new();
        let indices = chosen.channels.into_iter().chain(chosen.reference);
        for index in indices.clone() {
            let is_wanted_again = indices.clone().filter(|other| *other == index).count() > 1;
            temperatures.push(celsius(&mut table, index, is_wanted_again, &mut notes)?);
        }
        let table = &table;
        let last = chosen.channels[1];
        let of = |at: usize| indices.clone().nth(at).unwrap_or(last);
        let origin = Origin {
            file: table.source(),
            table: Some((table, &chosen)),
            columns: [0, 1, 2].map(|at| table.title(of(at))),
            units: [0, 1, 2].map(|at| table.columns()[of(at)].unit().clone()),
        };
        let reference_c = if chosen.reference.is_some() { temperatures.pop() } else { None };
        let (t2_c, t1_c) = (temperatures.pop().unwrap_or_default(), temperatures.pop().unwrap_or_default());
        let channels = Channels {
            source: table.source().to_owned(),
            names: names(table, chosen.channels),
            time_s,
            t1_c,
            t2_c,
            reference_c,
        };
        let mut all = table.notes().to_vec();
        all.append(&mut notes);
        let record = Self::build(channels, selection.sampling, clock, all, &origin)?;
        let at = |row: usize| table.place_of(row);
        match (chosen.flow, chosen.position) {
            (Some(_), Some(_)) => Err(RecordError::FlowAndPosition { file: record.source }),
            (Some(index), None) => record.flowing(table.numbers(index)?.to_vec(), &table.title(index), at),
            (None, Some(index)) => record.moving(table.numbers(index)?, &table.title(index)),
            (None, None) => Ok(record),
        }
    }

    /// This record without the lines of its rows: they are those of no single file.
    pub(crate) fn without_lines(self) -> Self {
        Self { lines: None, ..self }
    }

    /// Makes a record of vectors, checked in the same way as a file.
    ///
    /// ```
    /// use twinlag_record::{Channels, Record, SamplingChoice};
    ///
    /// let mut t1_c: Vec<f64> = (0..20).map(|k| 20.0 + (0.5 * f64::from(k)).sin()).collect();
    /// t1_c[12] = f64::NAN; // a reading that is missing
    /// let channels = Channels {
    ///     source: "a test bench".into(),
    ///     names: ["bare".into(), "sheathed".into()],
    ///     time_s: (0..20).map(|k| 0.25 * f64::from(k)).collect(),
    ///     t2_c: (0..20).map(|k| 20.0 + (0.5 * f64::from(k) - 1.0).sin()).collect(),
    ///     t1_c,
    ///     reference_c: None,
    /// };
    /// let record = Record::from_channels(channels, SamplingChoice::Auto)?;
    /// assert_eq!((record.sampling.period_s, record.missing), (0.25, 1)); // a quarter is exact in binary
    /// assert_eq!(record.segments, [0..12, 13..20]);
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    ///
    /// # Errors
    /// [`RecordError::LengthMismatch`], [`RecordError::MissingTime`],
    /// [`RecordError::TimeNotIncreasing`], [`RecordError::OutOfRange`], [`RecordError::NoValues`],
    /// [`RecordError::TooShort`], [`RecordError::Constant`], [`RecordError::Identical`], [`RecordError::NoPeriod`],
    /// [`RecordError::Bursts`].
    pub fn from_channels(channels: Channels, sampling: SamplingChoice) -> Result<Self, RecordError> {
        let file = channels.source.clone();
        let names = [&channels.names[0], &channels.names[1], "reference"].map(str::to_owned);
        let rows = channels.time_s.len();
        let reference = channels.reference_c.as_ref().map_or(rows, Vec::len);
        for (name, found) in names.iter().zip([channels.t1_c.len(), channels.t2_c.len(), reference]) {
            if found != rows {
                let (name, like) = (name.clone(), "time_s".to_owned());
                return Err(RecordError::LengthMismatch { file, name, found, like, expected: rows });
            }
        }
        let units = [Unit::Celsius, Unit::Celsius, Unit::Celsius];
        let origin = Origin { file: &file, table: None, columns: names, units };
        let clock = Clock { unit_s: 1.0, first: channels.time_s.first().copied().unwrap_or(0.0) };
        Self::build(channels, sampling, Some(clock), Vec::new(), &origin)
    }

    fn build(
        channels: Channels,
        choice: SamplingChoice,
        clock: Option<Clock>,
        mut notes: Vec<Note>,
        origin: &Origin<'_>,
    ) -> Result<Self, RecordError> {
        let Channels { source, names, mut time_s, t1_c, t2_c, reference_c } = channels;
        let file = || source.clone();
        let rows = time_s.len();
        check_time(&time_s, origin)?;
        check_range(&t1_c, 0, origin)?;
        check_range(&t2_c, 1, origin)?;
        if let Some(reference_c) = &reference_c {
            check_range(reference_c, 2, origin)?;
        }
        for (values, column) in [(&t1_c, &origin.columns[0]), (&t2_c, &origin.columns[1])] {
            if rows > 0 && values.iter().all(|value| value.is_nan()) {
                return Err(RecordError::NoValues { file: file(), column: column.clone() });
            }
        }
        let count = |values: &[f64]| values.iter().filter(|value| value.is_nan()).count();
        let is_whole = |row: usize| !t1_c[row].is_nan() && !t2_c[row].is_nan();
        let missing = (0..rows).filter(|&row| !is_whole(row)).count();
        if missing > 0 {
            notes.push(Note::Masked { rows: missing, t1: count(&t1_c), t2: count(&t2_c) });
        }
        let too_short = |usable| RecordError::TooShort { file: file(), usable, rows, missing, least: MIN_SAMPLES };
        if rows - missing < MIN_SAMPLES {
            return Err(too_short(rows - missing));
        }
        let first = time_s[0];
        if first != 0.0 {
            for t in &mut time_s {
                *t -= first;
            }
        }
        let sampling = sampling::judge(&time_s, clock, choice);
        if !SAMPLE_PERIODS_S.contains(&sampling.period_s) {
            return Err(RecordError::NoPeriod { file: file(), period_s: sampling.period_s });
        }
        let runs: Vec<_> = sampling::runs(&time_s, sampling.gap_s()).collect();
        if let Some(Bursts { rows, period_s }) = bursts(&time_s, &runs).filter(|_| choice == SamplingChoice::Auto) {
            return Err(RecordError::Bursts { file: file(), rows, period_s });
        }
        note_gaps(&time_s, &runs, origin, &mut notes);
        let segments = whole_parts(&runs, is_whole, &mut notes);
        let usable = segments.iter().map(Range::len).sum();
        if usable < MIN_SAMPLES {
            return Err(too_short(usable));
        }
        for (values, column) in [(&t1_c, &origin.columns[0]), (&t2_c, &origin.columns[1])] {
            let mut used = segments.iter().cloned().flatten().map(|row| values[row]);
            let first_c = used.next();
            if let Some(value_c) = first_c.filter(|first_c| used.all(|c| (c - first_c).abs() < MIN_CHANGE_K)) {
                return Err(RecordError::Constant { file: file(), column: column.clone(), value_c });
            }
        }
        if segments.iter().cloned().flatten().all(|row| t1_c[row] == t2_c[row]) {
            let [first, second, _] = origin.columns.clone();
            return Err(RecordError::Identical { file: file(), first, second });
        }
        note_kelvins([&t1_c, &t2_c], origin, &mut notes);
        notes.push(Note::Sampling { sampling, chosen: choice != SamplingChoice::Auto });
        Ok(Self {
            source,
            channels: names,
            time_s,
            t1_c: Arc::new(t1_c),
            t2_c: Arc::new(t2_c),
            reference_c,
            flow: None,
            speed_m_s: None,
            missing,
            sampling,
            segments,
            notes,
            lines: origin.table.and_then(|(table, _)| table.lines()).cloned(),
            starts: vec![0],
        })
    }

    /// Where a row is: its line in the file, or its number where the record never was in one.
    ///
    /// - `row`: from 0. Panics if the record has no such row.
    pub fn place_of(&self, row: usize) -> Place {
        self.lines.as_ref().map_or(Place::Sample(row + 1), |lines| Place::Line(lines.of(row)))
    }

    /// Number of rows, missing ones counted.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Time from the first row to the last, s; of records that were joined, the sum over these.
    pub fn length_s(&self) -> f64 {
        let ends = self.starts.iter().skip(1).copied().chain([self.len()]);
        self.starts.iter().zip(ends).map(|(&start, end)| self.span_s(&(start..end))).sum()
    }

    /// Time that the unbroken stretches span together, s: without gaps, and without what lies between records that were joined.
    pub fn observed_s(&self) -> f64 {
        self.segments.iter().map(|rows| self.span_s(rows)).sum()
    }

    fn span_s(&self, rows: &Range<usize>) -> f64 {
        let time_s = &self.time_s[rows.clone()];
        time_s.first().zip(time_s.last()).map_or(0.0, |(first, last)| last - first)
    }

    /// Whether there are no rows; a checked record has some.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Steps between the rows of a segment, `[n − 1]`: the period throughout if sampling is even,
    /// else as stamped.
    ///
    /// - `segment`: rows, one of `segments` or a part of one. Panics beyond the record.
    pub fn steps_s(&self, segment: &Range<usize>) -> Vec<f64> {
        match self.sampling.kind {
            SamplingKind::Irregular => self.time_s[segment.clone()].windows(2).map(|pair| pair[1] - pair[0]).collect(),
            _ => vec![self.sampling.period_s; segment.len().saturating_sub(1)],
        }
    }

    /// Writes the record as `time_s,T1,T2[,Tref]`, missing temperatures as empty cells. With
    /// [`Decimals::Shortest`] it reads back the same to the bit (select `Tref` as reference).
    ///
    /// # Errors
    /// [`RecordError::CannotWrite`].
    pub fn write_csv(&self, out: &mut impl Write, decimals: Decimals) -> Result<(), RecordError> {
        let mut columns = vec![("time_s", &self.time_s[..]), ("T1", &self.t1_c[..]), ("T2", &self.t2_c[..])];
        columns.extend(self.reference_c.as_ref().map(|values| ("Tref", &values[..])));
        write_csv(out, &columns, decimals)
    }
}

/// Names without units, unless that makes them one.
fn names(table: &Table, channels: [usize; 2]) -> [String; 2] {
    let [a, b] = channels.map(|index| &table.columns()[index]);
    let pick = |of: fn(&Column) -> &str| {
        let pair = [of(a), of(b)];
        (pair[0] != pair[1] && !pair.contains(&"")).then(|| pair.map(str::to_owned))
    };
    pick(Column::label).or_else(|| pick(Column::name)).unwrap_or_else(|| ["T1", "T2"].map(str::to_owned))
}

/// The temperatures of a column, which are moved out of the table where they are in °C and nobody wants them again: their numbers
/// are in the record then, for messages.
fn celsius(
    table: &mut Table,
    index: usize,
    is_wanted_again: bool,
    notes: &mut Vec<Note>,
) -> Result<Vec<f64>, RecordError> {
    table.numbers(index)?;
    let unit = table.columns()[index].unit();
    let column = table.title(index);
    if unit.to_celsius(0.0).is_none() {
        return Err(RecordError::NotATemperature { file: table.source().to_owned(), column, unit: unit.to_string() });
    }
    let to = matches!(unit, Unit::Kelvin | Unit::Fahrenheit).then_some("°C");
    notes.push(Note::Unit { column, unit: unit.symbol().to_owned(), stated: *unit != Unit::Unstated, to });
    if to.is_none() && !is_wanted_again {
        return Ok(table.take_values(index));
    }
    Ok(table.numbers(index)?.iter().map(|&value| unit.to_celsius(value).unwrap_or(f64::NAN)).collect())
}

fn check_time(time_s: &[f64], origin: &Origin<'_>) -> Result<(), RecordError> {
    if let Some(row) = time_s.iter().position(|t| !t.is_finite()) {
        let (file, column) = (origin.file.to_owned(), "time".to_owned());
        return Err(RecordError::MissingTime { file, at: origin.place(row), column });
    }
    match time_s.windows(2).position(|pair| pair[1] <= pair[0]) {
        None => Ok(()),
        Some(row) => Err(RecordError::TimeNotIncreasing {
            file: origin.file.to_owned(),
            at: origin.place(row + 1),
            before: origin.stamp(row, time_s[row]),
            now: origin.stamp(row + 1, time_s[row + 1]),
        }),
    }
}

fn check_range(values_c: &[f64], column: usize, origin: &Origin<'_>) -> Result<(), RecordError> {
    let is_outside = |value: &f64| !value.is_nan() && !TEMPERATURE_RANGE_C.contains(value);
    let Some(row) = values_c.iter().position(is_outside) else { return Ok(()) };
    let cells = origin.table.and_then(|(table, chosen)| {
        let indices = [Some(chosen.channels[0]), Some(chosen.channels[1]), chosen.reference];
        indices[column].map(|index| &table.columns()[index])
    });
    Err(RecordError::OutOfRange {
        file: origin.file.to_owned(),
        at: origin.place(row),
        column: origin.columns[column].clone(),
        value: cells.and_then(|cells| cells.raw().get(row).copied()).unwrap_or(values_c[row]),
        cell: cells.and_then(|cells| cells.beyond(row)).map(shortened),
        unit: origin.units[column].symbol(),
    })
}

fn note_gaps(time_s: &[f64], runs: &[Range<usize>], origin: &Origin<'_>, notes: &mut Vec<Note>) {
    let gaps = runs.iter().skip(1).map(|run| (run.start, time_s[run.start] - time_s[run.start - 1]));
    for (row, length_s) in gaps.clone().take(MAX_LISTED_GAPS) {
        notes.push(Note::Gap { at: origin.place(row), from_s: time_s[row - 1], length_s });
    }
    let count = gaps.len().saturating_sub(MAX_LISTED_GAPS);
    if count > 0 {
        notes.push(Note::FurtherGaps { count, length_s: gaps.skip(MAX_LISTED_GAPS).map(|gap| gap.1).sum() });
    }
}

/// Questions about a K in a header, or one that is missing there. A reading of 20 that is in K is
/// one of −253 °C, and two sensors of one gas are not 273 K apart.
fn note_kelvins(values_c: [&[f64]; 2], origin: &Origin<'_>, notes: &mut Vec<Note>) {
    for (i, values_c) in values_c.into_iter().enumerate() {
        let cold = || median(values_c.iter().copied()).map(|c| c - ABSOLUTE_ZERO_C).filter(|k| *k < COLD_K);
        if let Some(reading_k) = Some(&origin.units[i]).filter(|unit| **unit == Unit::Kelvin).and_then(|_| cold()) {
            notes.push(Note::ColdKelvin { column: origin.columns[i].clone(), reading_k });
        }
    }
    // The median of most records is settled by counting: where less than half of the differences reach a limit, it does not.
    let limit_k = -ABSOLUTE_ZERO_C - NEAR_ICE_POINT_K;
    let apart = || values_c[0].iter().zip(values_c[1]).map(|(a, b)| a - b).filter(|apart_k| !apart_k.is_nan());
    let [all, above, below] = apart().fold([0_usize; 3], |[all, above, below], apart_k| {
        [all + 1, above + usize::from(apart_k >= limit_k), below + usize::from(apart_k <= -limit_k)]
    });
    if 2 * above < all && 2 * below < all {
        return;
    }
    let Some(apart_k) = median(apart()) else { return };
    if (apart_k.abs() + ABSOLUTE_ZERO_C).abs() < NEAR_ICE_POINT_K {
        let [first, second, _] = origin.columns.clone();
        let (upper, lower) = if apart_k > 0.0 { (first, second) } else { (second, first) };
        notes.push(Note::IcePointApart { upper, lower, apart_k: apart_k.abs() });
    }
}

/// Of those that are there.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Maximal parts of `runs` whose rows are all whole, of two rows or more; single rows are noted.
pub(crate) fn whole_parts(
    runs: &[Range<usize>],
    is_whole: impl Fn(usize) -> bool,
    notes: &mut Vec<Note>,
) -> Vec<Range<usize>> {
    let mut parts = Vec::new();
    for run in runs {
        let mut start = None;
        for row in run.clone() {
            match (is_whole(row), start) {
                (true, None) => start = Some(row),
                (false, Some(first)) => {
                    parts.push(first..row);
                    start = None;
                }
                _ => {}
            }
        }
        parts.extend(start.map(|first| first..run.end));
    }
    let lone = parts.iter().filter(|part: &&Range<usize>| part.len() < 2).count();
    if lone > 0 {
        notes.push(Note::LoneRows { rows: lone });
    }
    parts.retain(|part| part.len() > 1);
    parts
}
