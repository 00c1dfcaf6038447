//! Why a record could not be had: every message says where, what was expected, what came, and what
//! to do.

use std::fmt;

use thiserror::Error;

use crate::form::Program;
use crate::selection::Setting;
use crate::wording::{Counted, brief, enumerated, plain, three};

/// Where in the input something is: a line of a file, or a sample of a vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of the file, from 1, comments and preamble counted.
    Line(usize),
    /// Sample of a vector that never was in a file, from 1.
    Sample(usize),
}

impl Place {
    /// The number of the line or the sample, from 1.
    pub fn number(self) -> usize {
        match self {
            Self::Line(number) | Self::Sample(number) => number,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Sample(sample) => write!(f, "sample {sample}"),
        }
    }
}

/// The columns that may be the sensors, as `2 'T1'`. Its `Display` says why nothing could be guessed.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidates {
    /// The one that the caller chose.
    pub chosen: Option<String>,
    /// Whether columns have names at all.
    pub are_named: bool,
    /// Those with the name or the unit of a temperature; without names, those whose numbers may be temperatures.
    pub found: Vec<String>,
    /// Those of them that may be of the surroundings.
    pub surroundings: Vec<String>,
    /// What may be meant: settings, and numbers of columns.
    pub example: Vec<(Setting, usize)>,
}

impl fmt::Display for Candidates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(chosen) = &self.chosen {
            write!(f, "beside column {chosen}, ")?;
        }
        let list = enumerated(self.found.len(), |index| self.found[index].clone());
        match self.found.len() {
            0 if !self.are_named => write!(f, "no column without a name may be a sensor")?,
            1 if !self.are_named => write!(f, "only column {list}, without a name, may be a sensor")?,
            count if !self.are_named => write!(f, "{count} columns without names may be sensors ({list})")?,
            0 => write!(f, "no column has the name or the unit of a temperature")?,
            1 => write!(f, "only column {list} has the name or the unit of a temperature")?,
            count => write!(f, "{count} columns have the name or the unit of a temperature ({list})")?,
        }
        match &self.surroundings[..] {
            [] => Ok(()),
            some => write!(f, ", and {} may be that of the surroundings", some.join(", ")),
        }
    }
}

/// Why a record could not be read, built or written. `file` is the name that the caller gave to the
/// source.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum RecordError {
    #[error("{file}: cannot be read: {reason}; check the path and its permissions")]
    CannotRead { file: String, reason: String },
    #[error("{file}: the gzip file is cut off: it ends within its compressed data; copy or download it again")]
    CutGzip { file: String },
    #[error("{file}: the gzip file is damaged ({reason}); copy or download it again")]
    DamagedGzip { file: String, reason: String },
    #[error("{file}: is a directory, expected a file; name one file in it")]
    IsDirectory { file: String },
    #[error(
        "{file}: is not text (a zero byte at offset {offset}), expected delimited text; export the measurement as CSV, \
         or, if it is UTF-16, save it with a byte-order mark"
    )]
    Binary { file: String, offset: usize },
    #[error("{file}: line {line}: is not in UTF-8, as the lines before it are; save the file in one encoding")]
    EncodingChanges { file: String, line: usize },
    #[error("{file}: is empty, expected a header and rows of time and two temperatures")]
    Empty { file: String },
    #[error(
        "{file}: has no row of numbers in its {counted}, expected rows under the header; was the logger started?",
        counted = Counted(*lines, "line")
    )]
    NoData { file: String, lines: usize },
    #[error("{file}: line {line} is longer than {most} bytes; expected rows of text, each ended by a line break")]
    LongLine { file: String, line: usize, most: usize },
    #[error("{file}: has {found} columns, expected at most {most}; keep the time and the temperatures alone")]
    TooManyColumns { file: String, found: usize, most: usize },
    #[error(
        "{file}: line {line}: found one column, expected two temperatures and a time, separated by comma, semicolon, \
         tab, pipe or blanks; put both channels side by side in one file"
    )]
    OneColumn { file: String, line: usize },
    #[error(
        "{file}: line {line}: {found} comma-separated whole numbers under {expected} column names: the comma seems to be \
         both separator and decimal sign, which cannot be distinguished; export with semicolons or with decimal points"
    )]
    DecimalCommaBetweenCommas { file: String, line: usize, expected: usize, found: usize },
    #[error(
        "{file}: line {line}: {found} comma-separated whole numbers and no header: this may be {found} columns or, with \
         a decimal comma, {half}; export with semicolons or decimal points, or add a header", half = found / 2
    )]
    WholeNumbersWithoutHeader { file: String, line: usize, found: usize },
    #[error(
        "{file}: line {line}: '{cell}' may be a thousands separator or a decimal comma, and no other cell shows which; \
         export without thousands separators and with decimal points"
    )]
    ThousandsOrDecimal { file: String, line: usize, cell: String },
    #[error(
        "{file}: decimal comma ('{comma_cell}', line {comma_line}) and decimal point ('{point_cell}', line {point_line}) \
         in one file, expected one of them; export with decimal points and without thousands separators"
    )]
    MixedDecimals { file: String, comma_line: usize, comma_cell: String, point_line: usize, point_cell: String },
    #[error(
        "{file}: line {line}: expected {expected} cells as in the header, found {found}; mend or remove the line \
         (a decimal comma or an unquoted separator in a text adds cells)"
    )]
    CellCount { file: String, line: usize, expected: usize, found: usize },
    #[error("{file}: line {line}: taken for {program}, expected {expected}, found {found}")]
    BadHeader { file: String, program: Program, line: usize, expected: &'static str, found: String },
    #[error(
        "{file}: line {line}: the header of another measurement begins, expected one measurement in a file; let LabVIEW write one \
         header only, or save each measurement to a file of its own"
    )]
    SecondMeasurement { file: String, line: usize },
    #[error(
        "{file}: expected {declared} rows, as its header declares, and found {found}: the file is cut off; copy it again, or mend the \
         number in the header"
    )]
    FewerRows { file: String, declared: usize, found: usize },
    #[error(
        "{file}: line {line}: a quotation mark is opened and not closed in this line; close it or remove it, and put each name of a \
         column on one line"
    )]
    OpenQuote { file: String, line: usize },
    #[error(
        "{file}: {at}, column {column}: expected a number or a word for a missing one (empty, NaN, NA, null, ---, \
         OL, OPEN, Over, overload, inf), found '{cell}'; mend the cell or empty it"
    )]
    NotANumber { file: String, at: Place, column: String, cell: String },
    #[error(
        "{file}: {at}, column {column}: expected numbers, found mostly text (first '{cell}'); \
         choose another column, by name or number"
    )]
    TextColumn { file: String, at: Place, column: String, cell: String },
    #[error("{file}: no column '{wanted}'; the columns are {columns}; choose by name or number")]
    UnknownColumn { file: String, wanted: String, columns: String },
    #[error(
        "{file}: {at}, column {column}: expected a positive flow velocity or density, found {value}; use no flow, or mend the cell \
         or empty it"
    )]
    BadFlow { file: String, at: Place, column: String, value: f64 },
    #[error(
        "{file}: column {column} leaves {rows} of use, expected at least {least}; use no flow or position, or mend the column",
        rows = Counted(*usable, "row")
    )]
    FewFlows { file: String, column: String, usable: usize, least: usize },
    #[error("{file}: column {column}: expected a position that changes, found the same throughout; use no position")]
    ConstantPosition { file: String, column: String },
    #[error(
        "{file}: a flow or a position is given twice, expected one of them once: time constants go with one velocity"
    )]
    FlowAndPosition { file: String },
    #[error("{file}: columns {numbers:?} are all called '{wanted}'; choose by number, for example {first}", first = numbers[0])]
    AmbiguousName { file: String, wanted: String, numbers: Vec<usize> },
    #[error(
        "{file}: column {column} would be used twice; time, both sensors, reference and flow must be different columns \
         (a sensor cannot be its own reference)"
    )]
    SameColumn { file: String, column: String },
    #[error(
        "{file}: which columns are the two sensors is not clear: {candidates}; choose both, by name or number{shown}; the \
         columns are {columns}",
        shown = example_of_columns(&candidates.example)
    )]
    ChannelsUnclear { file: String, candidates: Box<Candidates>, columns: String },
    #[error(
        "{file}: no column is recognisably the time; choose it, by name or number, or, if there is none, give the \
         sample period in seconds; the columns are {columns}"
    )]
    NoTime { file: String, columns: String },
    #[error(
        "{file}: the sample period must be positive, from a nanosecond to a year, got {shown} s; give the time from row to \
         row in seconds",
        shown = plain(*period_s)
    )]
    BadPeriod { file: String, period_s: f64 },
    #[error(
        "{file}: rows are {period} s apart, and no logger is faster than a nanosecond or slower than a year; is the unit of time right?",
        period = plain(*period_s)
    )]
    NoPeriod { file: String, period_s: f64 },
    #[error(
        "{file}: rows come in bursts of {rows}, as if a logger had sent what it had kept and these were times of arrival; give the sample period, \
         {period} s on average, or say that stamps are right as they stand",
        period = three(*period_s)
    )]
    Bursts { file: String, rows: usize, period_s: f64 },
    #[error("{file}: both a time column ({column}) and a sample period ({period_s} s) were given; give one of them")]
    TimeAndPeriod { file: String, column: String, period_s: f64 },
    #[error("{file}: {at}, column {column}: expected {expected}, found '{cell}'; mend or remove the line")]
    NotATime { file: String, at: Place, column: String, cell: String, expected: &'static str },
    #[error(
        "{file}: {at}, column {column}: '{cell}' may be day/month or month/day, and no date in the file shows \
         which; write dates as YYYY-MM-DD"
    )]
    AmbiguousDate { file: String, at: Place, column: String, cell: String },
    #[error(
        "{file}: column {column}: '{cell}' may be hours and minutes or minutes and seconds; choose the unit of its first part, h or min, \
         or write it in the header, for example 'time (mm:ss)'"
    )]
    ClockUnclear { file: String, column: String, cell: String },
    #[error("{file}: column {column} holds times of a clock, which need no unit; leave the unit of time out")]
    NeedsNoUnit { file: String, column: String },
    #[error(
        "{file}: columns {one} and {other} contradict each other: from the first row to the last {one_s} s pass by the one and {other_s} s by \
         the other; choose the right one as the time",
        one_s = three(*one_s), other_s = three(*other_s)
    )]
    TimesDisagree { file: String, one: String, one_s: f64, other: String, other_s: f64 },
    #[error("{file}: {at}, column {column}: the time is missing or not finite; mend or remove the row")]
    MissingTime { file: String, at: Place, column: String },
    #[error(
        "{file}: {at}: time must increase from row to row, but '{now}' follows '{before}'; sort the rows and remove \
         repeated ones; of a log that begins anew here, make two records; if several samples share one coarse stamp, give the sample period in seconds"
    )]
    TimeNotIncreasing { file: String, at: Place, before: String, now: String },
    #[error(
        "{file}: column {column} is in '{unit}', expected a temperature in °C, K or °F; convert it, or correct the unit \
         in the header, for example 'T1 [°C]'"
    )]
    NotATemperature { file: String, column: String, unit: String },
    #[error(
        "{file}: column {column} is in '{unit}', expected a time in s, ms, us, ns, min, h or d, or date-times; convert it, or \
         correct the unit in the header, for example 'time [s]'"
    )]
    NotATimeUnit { file: String, column: String, unit: String },
    #[error(
        "{file}: column {column} names no unit of time, and its steps of {shown} do not show which it is: they may be seconds, another \
         unit, or rows; choose the unit, or write it in the header, for example 'time [ms]'; for a count of rows give the sample period",
        shown = brief(*step)
    )]
    TimeUnitUnclear { file: String, column: String, step: f64 },
    #[error(
        "{file}: {at}, column {column}: {shown} {unit} is not between absolute zero and 5000 °C; is the unit right, is \
         the thermocouple open? Empty the cells that are not measurements",
        shown = cell.as_ref().map_or_else(|| plain(*value), |cell| format!("'{cell}'"))
    )]
    OutOfRange { file: String, at: Place, column: String, value: f64, cell: Option<String>, unit: &'static str },
    #[error(
        "{file}: column {column} has no value in any row; is the sensor connected? Choose another column, or mend the \
         connection and record again"
    )]
    NoValues { file: String, column: String },
    #[error("{file}: columns {first} and {second} are the same in every sample; choose two different sensors")]
    Identical { file: String, first: String, second: String },
    #[error(
        "{file}: column {column} is {shown} °C in every sample, so it contains no information about its sensor; \
         is it connected, is it a setpoint? Choose another column", shown = plain(*value_c)
    )]
    Constant { file: String, column: String, value_c: f64 },
    #[error(
        "{file}: {samples} of {counted} ({missing} with a missing temperature), expected at least {least}; usable are rows \
         with both temperatures, next to another such row without a gap: {advice}",
        advice = remedy(*missing, *rows),
        samples = Counted(*usable, "usable sample"), counted = Counted(*rows, "row")
    )]
    TooShort { file: String, usable: usize, rows: usize, missing: usize, least: usize },
    #[error(
        "{file}: {name} has {samples}, expected {expected} as in {like}; give vectors of one length",
        samples = Counted(*found, "sample")
    )]
    LengthMismatch { file: String, name: String, found: usize, like: String, expected: usize },
    #[error("cannot write the table: {reason}; check the disk and the permissions")]
    CannotWrite { reason: String },
}

impl RecordError {
    /// What of a [`Selection`](crate::Selection) to set or to leave out so that the record can be
    /// read; empty where that mends nothing. Messages are in words; whoever has options of other
    /// names can add those to them.
    ///
    /// ```
    /// use twinlag_record::{Record, Selection, Setting, Table};
    ///
    /// let table = Table::read(b"T1,T2\n20,20\n21,20.5\n", "no-time.csv")?;
    /// let error = Record::from_table(&table, &Selection::default()).expect_err("no time");
    /// assert_eq!(error.settings(), [Setting::Time, Setting::Period]);
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    pub fn settings(&self) -> &'static [Setting] {
        match self {
            Self::TextColumn { .. }
            | Self::UnknownColumn { .. }
            | Self::AmbiguousName { .. }
            | Self::SameColumn { .. } => &Setting::COLUMNS,
            Self::BadFlow { .. } => &[Setting::Flow],
            Self::ConstantPosition { .. } => &[Setting::Position],
            Self::FewFlows { .. } | Self::FlowAndPosition { .. } => &[Setting::Flow, Setting::Position],
            Self::ChannelsUnclear { .. } => &[Setting::T1, Setting::T2],
            Self::NotATimeUnit { .. }
            | Self::NoPeriod { .. }
            | Self::ClockUnclear { .. }
            | Self::NeedsNoUnit { .. } => &[Setting::TimeUnit],
            Self::TimesDisagree { .. } => &[Setting::Time],
            Self::Bursts { .. } => &[Setting::Period, Setting::Sampling],
            Self::TimeUnitUnclear { .. } => &[Setting::TimeUnit, Setting::Period],
            Self::NoTime { .. } | Self::TimeAndPeriod { .. } => &[Setting::Time, Setting::Period],
            Self::BadPeriod { .. } | Self::TimeNotIncreasing { .. } => &[Setting::Period],
            _ => &[],
        }
    }
}

impl RecordError {
    /// The name of the file and the line in it that the message is about, from 1; `None` where it is about no line.
    ///
    /// ```
    /// use twinlag_record::Table;
    ///
    /// let error = Table::read(b"time,T1,T2\n0,20,20\n1,21\n2,22,21\n", "run.csv").expect_err("a cell is missing");
    /// assert_eq!(error.line(), Some(("run.csv", 3)));
    /// ```
    pub fn line(&self) -> Option<(&str, usize)> {
        match self {
            Self::EncodingChanges { file, line }
            | Self::OneColumn { file, line }
            | Self::DecimalCommaBetweenCommas { file, line, .. }
            | Self::WholeNumbersWithoutHeader { file, line, .. }
            | Self::ThousandsOrDecimal { file, line, .. }
            | Self::MixedDecimals { file, comma_line: line, .. }
            | Self::CellCount { file, line, .. }
            | Self::BadHeader { file, line, .. }
            | Self::SecondMeasurement { file, line }
            | Self::OpenQuote { file, line } => Some((file, *line)),
            Self::NotANumber { file, at, .. }
            | Self::TextColumn { file, at, .. }
            | Self::BadFlow { file, at, .. }
            | Self::NotATime { file, at, .. }
            | Self::AmbiguousDate { file, at, .. }
            | Self::MissingTime { file, at, .. }
            | Self::TimeNotIncreasing { file, at, .. }
            | Self::OutOfRange { file, at, .. } => match at {
                Place::Line(line) => Some((file, *line)),
                Place::Sample(_) => None,
            },
            _ => None,
        }
    }
}

fn example_of_columns(example: &[(Setting, usize)]) -> String {
    match example {
        [(_, first), (_, second)] => format!(", for example {first} and {second}"),
        [(_, other)] => format!(", for example {other}"),
        _ => String::new(),
    }
}

/// What to do about too few rows with both temperatures.
fn remedy(missing: usize, rows: usize) -> &'static str {
    if 2 * missing > rows {
        "where a logger reads one channel after the other, write both into one row, the second interpolated to the time of the first"
    } else {
        "record for longer"
    }
}
