//! What a reader should know of how a record was understood: nothing is guessed, converted or left
//! out in silence.

use std::fmt;

use crate::Place;
use crate::form::Program;
use crate::sampling::{Sampling, SamplingKind};
use crate::sign::{Decimal, Delimiter};
use crate::wording::{Counted, brief, three};

/// Stamps closer to even spacing than this part of the period are called uniform without further
/// numbers.
const EXACT_PERIODS: f64 = 1e-6;

/// One remark on how a file was understood. Its `Display` is a sentence for people.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Note {
    /// What kind of text it is.
    Format {
        /// Between the cells.
        delimiter: Delimiter,
        /// Decimal sign.
        decimal: Decimal,
        /// Name of the character encoding.
        encoding: &'static str,
        /// Line of the column names, from 1; `None` if there are none.
        header_line: Option<usize>,
        /// The program that wrote it, where its header says so.
        program: Option<Program>,
    },
    /// The file was compressed by gzip.
    Decompressed,
    /// How columns were read that did not come as text: format, version, group.
    Read {
        /// A phrase such as `read as an MDF file, version 4.10`.
        how: String,
    },
    /// A column was chosen from its name or place, not by the caller.
    Guessed {
        /// `time`, `T1` or `T2`.
        role: &'static str,
        /// The column, as `2 'T1 [°C]'`.
        column: String,
    },
    /// Date and time of day stood in two columns.
    DateAndTime {
        /// The column of the dates.
        date: String,
        /// The column of the times of day.
        time: String,
    },
    /// Time of day passed midnight and was continued on the next day.
    Midnight {
        /// How often.
        times: usize,
    },
    /// The unit of a column and what was done about it.
    Unit {
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// `false`: the header names none and this one was assumed.
        stated: bool,
        /// The unit that it was converted to, if another one.
        to: Option<&'static str>,
    },
    /// A column that is in K by its header reads as no gas does: the K may be a type of thermocouple.
    ColdKelvin {
        /// The column.
        column: String,
        /// Its median reading.
        reading_k: f64,
    },
    /// Two sensors differ by the distance of the two scales.
    IcePointApart {
        /// The column that reads more.
        upper: String,
        /// The column that reads less.
        lower: String,
        /// The median difference.
        apart_k: f64,
    },
    /// The unit of the time column is that which the caller chose.
    TimeUnitChosen {
        /// The column.
        column: String,
        /// Its unit.
        unit: &'static str,
        /// The unit that it was converted to, if another one.
        to: Option<&'static str>,
    },
    /// A time column without a unit is of the size and the step of a usual clock, and was read as
    /// that.
    TimeRecognised {
        /// The column.
        column: String,
        /// Its unit.
        unit: &'static str,
        /// What it counts.
        name: &'static str,
        /// From row to row.
        step_s: f64,
    },
    /// A time column without a unit counts what passes by the clock of another column.
    TimeByClock {
        /// The column.
        column: String,
        /// The other column: of stamps, or of a counter with its unit.
        clock: String,
        /// Its unit.
        unit: &'static str,
        /// What it counts.
        name: &'static str,
        /// From row to row.
        step_s: f64,
    },
    /// Another clock of the file shows another time, and not by a factor of units.
    ClocksDiffer {
        /// The column that was taken as the time.
        column: String,
        /// What passes by it from the first row to the last, s.
        passed_s: f64,
        /// The other column.
        other: String,
        /// What passes by that, s.
        other_s: f64,
    },
    /// Which of day and month comes first in dates was found from how closely rows follow each other.
    DateOrder {
        /// The column.
        column: String,
        /// Whether it is the day.
        is_day_first: bool,
    },
    /// A counter begins anew at a power of two, and was counted on.
    Wrapped {
        /// The column.
        column: String,
        /// The power.
        bits: u32,
        /// How often it begins anew.
        times: usize,
    },
    /// The rows of a record take another time by the period than by a column that shows one.
    PeriodDiffers {
        /// The period that was taken, s.
        period_s: f64,
        /// The time that it makes of all rows, s.
        passed_s: f64,
        /// The column.
        other: String,
        /// The time that it shows, s.
        other_s: f64,
    },
    /// Time was counted from the row number and a period.
    PeriodGiven {
        /// The period.
        period_s: f64,
        /// Whether the file states it; the caller gave it otherwise.
        is_of_file: bool,
    },
    /// The very last line was cut off and left out.
    CutLine {
        /// The line.
        line: usize,
        /// How many cells it had.
        found: usize,
        /// How many it should have had.
        expected: usize,
    },
    /// The very last line is a whole row, but no line break follows: what wrote it may have been
    /// stopped in mid-number.
    NoFinalLineBreak {
        /// The line.
        line: usize,
    },
    /// The header came again, as after a change of file.
    RepeatedHeader {
        /// How many lines were left out for it.
        lines: usize,
        /// The first of them.
        first_line: usize,
    },
    /// Lines between the rows of a serial log that hold no row: what a sketch says as it starts, or of an error.
    Messages {
        /// How many lines were left out.
        lines: usize,
        /// The first of them.
        first_line: usize,
    },
    /// Lines of a serial log with fewer cells than a row: nothing of them is taken but the time of arrival.
    CutRows {
        /// How many lines lack a part.
        lines: usize,
        /// The first of them.
        first_line: usize,
    },
    /// Rows with a missing temperature: NaN in the record, in no segment.
    Masked {
        /// Rows with either missing.
        rows: usize,
        /// Rows with T1 missing.
        t1: usize,
        /// Rows with T2 missing.
        t2: usize,
    },
    /// A column may be the velocity of the gas, and is not used.
    FlowUnused {
        /// The column.
        column: String,
        /// Its number, from 1.
        number: usize,
    },
    /// Rows in which the flow or the position is missing and both temperatures are there.
    FlowMissing {
        /// The column.
        column: String,
        /// Rows that take the flow from the straight line between the readings before and after.
        bridged: usize,
        /// Rows too far from these: in no segment.
        unused: usize,
    },
    /// A step in time that ends a segment.
    Gap {
        /// The row after the gap.
        at: Place,
        /// Time before the gap.
        from_s: f64,
        /// From the last row before to the first row after.
        length_s: f64,
    },
    /// Gaps beyond those listed one by one.
    FurtherGaps {
        /// How many.
        count: usize,
        /// Together.
        length_s: f64,
    },
    /// Complete rows that stand alone between gaps or masked rows and so belong to no segment.
    LoneRows {
        /// How many.
        rows: usize,
    },
    /// How the stamps lie in time and what is made of them.
    Sampling {
        /// The estimate.
        sampling: Sampling,
        /// Whether the caller chose it.
        chosen: bool,
    },
}

impl Note {
    /// Writes a note on clocks.
    fn write_clock(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Midnight { times: 1 } => write!(f, "time of day passed midnight once and was continued"),
            Self::Midnight { times } => write!(f, "time of day passed midnight {times} times and was continued"),
            Self::ClocksDiffer { column, passed_s, other, other_s } => {
                let [passed_s, other_s] = [passed_s, other_s].map(|s| three(*s));
                write!(
                    f,
                    "from the first row to the last {passed_s} s pass by column {column}, which is the time, and {other_s} s by "
                )?;
                write!(f, "column {other}")
            }
            Self::DateOrder { column, is_day_first } => {
                let first = if *is_day_first { "day" } else { "month" };
                write!(f, "dates of column {column} have the {first} first, since rows follow each other closely then")
            }
            Self::Wrapped { column, bits, times } => {
                let times = Counted(*times, "time");
                write!(f, "column {column} is a counter of {bits} bits, which begins anew {times} and was counted on")
            }
            _ => Ok(()),
        }
    }

    /// What was made of units; nothing for any other note.
    fn write_units(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unit { column, unit, stated, to } => {
                let how = if *stated { "is in" } else { "names no unit and was taken to be in" };
                write!(f, "column {column} {how} {unit}")?;
                to.map_or(Ok(()), |to| write!(f, ", converted to {to}"))
            }
            Self::ColdKelvin { column, reading_k } => {
                write!(
                    f,
                    "column {column} is in K by its header and reads {} K: if K is the type of the ",
                    three(*reading_k)
                )?;
                write!(f, "thermocouple and the readings are in °C, say so in the header, as 'T1 [°C]'")
            }
            Self::IcePointApart { upper, lower, apart_k } => {
                write!(f, "column {upper} reads {} K more than column {lower}, about 273.15 K: ", three(*apart_k))?;
                write!(f, "if one of them is in K and the other in °C, say so in the header, as 'T1 [K]'")
            }
            Self::TimeUnitChosen { column, unit, to } => {
                write!(f, "column {column} was taken to be in {unit}, as chosen")?;
                to.map_or(Ok(()), |to| write!(f, ", converted to {to}"))
            }
            Self::TimeRecognised { column, unit, name, step_s } => {
                write!(f, "column {column} names no unit; its numbers are of the size and the step of {name}, ")?;
                write!(f, "{} s from row to row, and were converted from {unit} to s. ", three(*step_s))?;
                write!(f, "If that is wrong, choose its unit, or write it in the header, as 'time [s]'")
            }
            Self::TimeByClock { column, clock, name, step_s, .. } => {
                write!(f, "column {column} names no unit; by the clock of column {clock} it counts {name}, ")?;
                write!(f, "{} s from row to row. ", three(*step_s))?;
                write!(f, "If that is wrong, choose its unit, or another column as the time")
            }
            _ => Ok(()),
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Format { delimiter, decimal, encoding, header_line, program } => {
                write!(f, "read as ")?;
                program.map_or(Ok(()), |program| write!(f, "{program}: "))?;
                write!(f, "{delimiter}-separated {encoding} text with decimal {decimal}, ")?;
                match header_line {
                    Some(line) => write!(f, "column names on line {line}"),
                    None => write!(f, "without column names"),
                }
            }
            Self::Decompressed => write!(f, "decompressed from gzip"),
            Self::Read { how } => write!(f, "{how}"),
            Self::Guessed { role, column } => write!(f, "{role} guessed to be column {column}"),
            Self::DateAndTime { date, time } => write!(f, "time put together from columns {date} and {time}"),
            Self::Midnight { .. } | Self::DateOrder { .. } | Self::Wrapped { .. } | Self::ClocksDiffer { .. } => {
                self.write_clock(f)
            }
            Self::PeriodGiven { period_s, is_of_file } => {
                let by = if *is_of_file { "as its header says" } else { "as given" };
                write!(f, "time counted from the row number, {period_s} s per row {by}; no time column was used")
            }
            Self::PeriodDiffers { period_s, passed_s, other, other_s } => {
                let [passed, other_s] = [*passed_s, *other_s].map(brief);
                write!(
                    f,
                    "the rows take {passed} s at the period of {period_s} s, which was taken, and {other_s} s by column {other}"
                )
            }
            Self::CutLine { line, found, expected } => {
                write!(f, "last line {line} is cut off ({found} of {expected} cells) and was left out")
            }
            Self::NoFinalLineBreak { line } => {
                write!(
                    f,
                    "the file does not end with a line break, so the last number, on line {line}, may be cut off; "
                )?;
                write!(f, "it was read as it stands")
            }
            Self::RepeatedHeader { lines: 1, first_line } => {
                write!(f, "the header comes again: 1 line left out, line {first_line}")
            }
            Self::RepeatedHeader { lines, first_line } => {
                write!(f, "the header comes again: {lines} lines left out, the first is line {first_line}")
            }
            Self::Messages { lines: 1, first_line } => {
                write!(f, "1 line without a row of numbers left out, line {first_line}")
            }
            Self::Messages { lines, first_line } => {
                write!(f, "{lines} lines without a row of numbers left out, the first is line {first_line}")
            }
            Self::CutRows { lines: 1, first_line } => {
                write!(f, "1 line lacks a part, line {first_line}: its readings were taken as missing")
            }
            Self::CutRows { lines, first_line } => {
                write!(
                    f,
                    "{lines} lines lack a part, the first is line {first_line}: their readings were taken as missing"
                )
            }
            Self::Masked { rows, t1, t2 } => {
                let rows = Counted(*rows, "row");
                write!(f, "{rows} masked for a missing temperature (T1 in {t1}, T2 in {t2}); none was filled")
            }
            Self::FlowUnused { column, .. } => {
                write!(
                    f,
                    "column {column} is not used; if it is the velocity of the gas, choose it as the flow: time constants may go with it"
                )
            }
            Self::FlowMissing { column, bridged, unused } => {
                let missing = Counted(bridged + unused, "row");
                write!(
                    f,
                    "column {column} is missing in {missing}: {bridged} taken from the straight line between readings, {unused} not used"
                )
            }
            Self::Gap { at, from_s, length_s } => {
                write!(
                    f,
                    "gap of {length_s:.6} s before {at}, from {from_s:.6} s on; the record is cut there, not filled"
                )
            }
            Self::FurtherGaps { count: 1, length_s } => write!(f, "1 further gap, of {length_s:.6} s"),
            Self::FurtherGaps { count, length_s } => {
                write!(f, "{count} further gaps, together {length_s:.6} s")
            }
            Self::LoneRows { rows: 1 } => write!(f, "1 row stands alone between gaps or masked rows and is not used"),
            Self::LoneRows { rows } => {
                write!(f, "{rows} rows stand alone between gaps or masked rows and are not used")
            }
            Self::Sampling { sampling, chosen } => write_sampling(f, sampling, *chosen),
            of_units => of_units.write_units(f),
        }
    }
}

fn write_sampling(f: &mut fmt::Formatter<'_>, sampling: &Sampling, chosen: bool) -> fmt::Result {
    let Sampling { period_s, jitter_s, largest_departure_s, stamp_resolution_s, kind } = sampling;
    let what = match kind {
        SamplingKind::Uniform => "uniform",
        SamplingKind::Rounded => "even with rounded stamps, taken as evenly spaced",
        SamplingKind::Irregular => "irregular, steps used as stamped",
    };
    let who = if chosen { " (as chosen)" } else { "" };
    let period = if *kind == SamplingKind::Irregular { "median step" } else { "period" };
    write!(f, "sampling {what}{who}: {period} {} s", brief(*period_s))?;
    if *largest_departure_s >= EXACT_PERIODS * period_s {
        let [rms, most] = [jitter_s, largest_departure_s].map(|s| three(*s));
        write!(f, ", stamps depart from even spacing by {rms} s rms and {most} s at most")?;
        if largest_departure_s > period_s && *kind != SamplingKind::Irregular {
            write!(f, " (more than a period: the clock wanders)")?;
        }
        if let Some(resolution_s) = stamp_resolution_s {
            write!(f, ", stamp resolution {} s", brief(*resolution_s))?;
        }
    }
    write!(f, "; nothing was resampled")
}
