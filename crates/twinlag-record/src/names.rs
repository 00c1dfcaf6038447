//! What the name of a column says of it: words for time, row numbers, temperatures, and what is no
//! sensor.

use crate::column::{Column, Kind};
use crate::unit::Unit;
use crate::words::{apart, words};

const TIME: [&str; 27] = [
    "time",
    "zeit",
    "zeitpunkt",
    "timestamp",
    "datetime",
    "date",
    "datum",
    "elapsed",
    "uhrzeit",
    "zeitstempel",
    "uptime",
    "seconds",
    "sec",
    "clock",
    "datumzeit",
    "systime",
    "millis",
    "epoch",
    "laufzeit",
    "messzeit",
    "duration",
    "dauer",
    "tiempo",
    "tempo",
    "時刻",
    "時間",
    "日時",
];
const INDEX: [&str; 14] = [
    "sample", "samples", "no", "nr", "number", "record", "rn", "count", "counter", "index", "scan", "row", "id",
    "messung",
];
pub(crate) const TEMPERATURE: [&str; 21] = [
    "t",
    "tc",
    "temp",
    "temperature",
    "temperatur",
    "thermocouple",
    "thermo",
    "te",
    "thermoelement",
    "pt",
    "rtd",
    "ntc",
    "sensor",
    "probe",
    "ch",
    "channel",
    "kanal",
    "fühler",
    "tcouple",
    "therm",
    "温度",
];
/// Never T1 or T2, whatever else is there: set points, references and uncertainties.
const APART: [&str; 20] = [
    "ref",
    "tref",
    "reference",
    "referenz",
    "true",
    "truth",
    "ttrue",
    "set",
    "setpoint",
    "sp",
    "tset",
    "soll",
    "sollwert",
    "target",
    "setpt",
    "std",
    "stddev",
    "sd",
    "sigma",
    "uncertainty",
];
/// Never T1 or T2: temperatures that are computed, of Sea-Bird's names those of potential temperature, `potemp090C`.
const COMPUTED: [&str; 7] = ["potemp", "potential", "dew", "dewpoint", "taupunkt", "windchill", "heatindex"];
/// What is said of the readings of another column, `temp_qc`, and is no quantity of its own.
const QUALITY: [&str; 5] = ["qc", "qf", "flag", "flags", "quality"];
/// Never T1 or T2, unless there are two of them: `Gas T fine`, `Gas T coarse`.
const GAS: [&str; 2] = ["gas", "tgas"];
/// Perhaps a sensor, perhaps its surroundings: only the caller knows.
pub(crate) const SURROUNDINGS: [&str; 18] = [
    "chamber", "ambient", "room", "bath", "oven", "furnace", "block", "housing", "case", "board", "cjc", "junction",
    "internal", "panel", "ptemp", "raum", "kammer", "ofen",
];

/// Other quantities that are often written without their unit.
pub(crate) const OTHER_QUANTITIES: [&str; 40] = [
    "pressure",
    "depth",
    "altitude",
    "height",
    "flow",
    "velocity",
    "speed",
    "humidity",
    "rh",
    "rpm",
    "voltage",
    "volt",
    "volts",
    "vbat",
    "battery",
    "current",
    "power",
    "level",
    "angle",
    "position",
    "torque",
    "load",
    "force",
    "mass",
    "weight",
    "lat",
    "latitude",
    "lon",
    "longitude",
    "salinity",
    "conductivity",
    "density",
    "oxygen",
    "light",
    "resistance",
    "strain",
    "status",
    "state",
    "flag",
    "error",
];

/// Beyond all temperatures, in °C as in °F.
const NO_TEMPERATURE: f64 = 10_000.0;

/// Words for a velocity.
const VELOCITY: [&str; 8] =
    ["flow", "velocity", "speed", "airspeed", "windspeed", "wind", "geschwindigkeit", "windgeschwindigkeit"];
/// Words that make another quantity of a word for a velocity.
const NO_VELOCITY: [&str; 4] = ["direction", "dir", "richtung", "status"];
/// Units of a velocity, in lower case. A knot is no `kn` here, which a kilonewton is as well.
const VELOCITY_UNITS: [&str; 8] = ["m/s", "m s-1", "cm/s", "km/h", "mph", "kt", "knots", "ft/s"];

/// Whether it is the velocity of something by its name and its unit: `U [m/s]`, `velocity_m_s`, `wind speed`, but not `fan speed [rpm]`.
pub(crate) fn is_velocity(column: &Column) -> bool {
    // Of `U_m_s` the last letter reads as a unit of time.
    let has_velocity_unit = match column.unit() {
        Unit::Other(unit) => VELOCITY_UNITS.contains(&unit.to_lowercase().as_str()),
        _ => column.name().to_lowercase().ends_with("_m_s"),
    };
    let is_called = || has(column, &VELOCITY) && !has(column, &NO_VELOCITY) && !is_called_temperature(column);
    has_velocity_unit || (*column.unit() == Unit::Unstated && is_called())
}

/// Whether a word of the name is in the list, with or without a number behind it.
pub(crate) fn has(column: &Column, list: &[&str]) -> bool {
    words(column.label()).any(|word| {
        let bare = word.trim_end_matches(|c: char| c.is_ascii_digit());
        list.contains(&word.as_str()) || list.contains(&bare)
    })
}

/// Whether its numbers go 0, 1, 2 or 1, 2, 3 from row to row, as the index of a data frame does; a clock of one sample a second does so
/// too.
pub(crate) fn counts_rows(column: &Column) -> bool {
    let raw = column.raw();
    column.kind() == Kind::Number
        && raw.first().is_some_and(|first| [0.0, 1.0].contains(first))
        && raw.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

/// Whether no temperature goes as its numbers do: they rise by one from row to row, or most of them are beyond all temperatures.
pub(crate) fn is_counter(column: &Column) -> bool {
    let raw = column.raw();
    let rises_by_one = raw.len() > 1 && raw.windows(2).all(|pair| pair[1] - pair[0] == 1.0);
    let beyond = raw.iter().filter(|value| **value > NO_TEMPERATURE).count();
    rises_by_one || 2 * beyond > raw.len()
}

pub(crate) fn is_index(column: &Column) -> bool {
    has(column, &INDEX) && !column.unit().is_temperature() && !matches!(column.unit(), Unit::Time { .. })
}

/// Whether a word of the name is one for time.
pub(crate) fn is_time_by_name(column: &Column) -> bool {
    has(column, &TIME) || column.label() == "t" || is_written_together(column)
}

pub(crate) fn is_time(column: &Column) -> bool {
    let named = is_time_by_name(column);
    match column.kind() {
        Kind::Stamp => true,
        Kind::Number => {
            !column.unit().is_temperature()
                && !has(column, &["constant"])
                && (named || matches!(column.unit(), Unit::Time { .. }) && may_be_time(column.label()))
        }
        _ => false,
    }
}

/// Whether a word of time is set apart by a capital alone, as in `elapsedHours`, in a column of no other unit.
fn is_written_together(column: &Column) -> bool {
    !matches!(column.unit(), Unit::Other(_)) && words(&apart(column.label())).any(|word| TIME.contains(&&*word))
}

/// Whether a name goes with a unit of time: not `T_min`, which is the least temperature, but `Temps [s]`, which is French.
fn may_be_time(label: &str) -> bool {
    !label.starts_with('T') || label.eq_ignore_ascii_case("temps")
}

/// Whether name and unit, whatever the cells hold, are those of a temperature.
pub(crate) fn is_called_temperature(column: &Column) -> bool {
    !has(column, &QUALITY)
        && (column.unit().is_temperature() || (*column.unit() == Unit::Unstated && has(column, &TEMPERATURE)))
}

/// Whether it is no sensor by its name: a reference, a setpoint, a computed temperature, the one column of the gas.
pub(crate) fn is_apart(column: &Column, columns: &[Column]) -> bool {
    let of_gas = |column: &&Column| is_called_temperature(column) && has(column, &GAS) && !has(column, &APART);
    has(column, &APART) || is_computed(column) || (has(column, &GAS) && columns.iter().filter(of_gas).count() < 2)
}

/// Whether a word of the name begins with letters of the list, and goes on with a number if at all.
fn is_computed(column: &Column) -> bool {
    let letters = |word: &str| word.chars().take_while(|c| c.is_alphabetic()).collect::<String>();
    words(column.label()).any(|word| COMPUTED.contains(&letters(&word).as_str()))
}

pub(crate) fn first_word(column: &Column) -> String {
    words(column.label()).next().unwrap_or_default()
}
