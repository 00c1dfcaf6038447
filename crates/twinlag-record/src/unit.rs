//! Units in column headers: `T1 [°C]`, `T1 (degC)`, `T1 / K`, `T1 °C`, `T_K`, `temp_F`,
//! `time [ms]`, `t_min`.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::description::is_description;
use crate::words::{apart, words};

/// The unit of a column.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Unit {
    /// The header names none.
    Unstated,
    /// Degree Celsius.
    Celsius,
    /// Kelvin.
    Kelvin,
    /// Degree Fahrenheit.
    Fahrenheit,
    /// A unit of time, in seconds.
    Time {
        /// As written in messages.
        symbol: &'static str,
        /// Its length.
        seconds: f64,
    },
    /// Any other, as written.
    Other(String),
}

/// As text that [`Unit::parse`] reads.
impl Serialize for Unit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(match self {
            Self::Unstated => "",
            Self::Other(text) => text,
            known => known.symbol(),
        })
    }
}

impl<'de> Deserialize<'de> for Unit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(|text| Self::parse(&text))
    }
}

impl Unit {
    /// Reads a unit that stands alone, as `°C` or `[ms]`; the empty text is [`Unit::Unstated`].
    pub fn parse(text: &str) -> Self {
        let text = text.trim().trim_start_matches(['[', '(', '{']).trim_end_matches([']', ')', '}']).trim();
        if text.is_empty() {
            Self::Unstated
        } else {
            Self::explained(text).unwrap_or_else(|| Self::Other(text.to_owned()))
        }
    }

    /// A known unit, perhaps with a word about it.
    fn explained(text: &str) -> Option<Self> {
        // `seconds since 1970-01-01`: the differences do not depend on since when.
        if let Some((unit, _)) = text.split_once(" since ") {
            return Self::known(unit.trim()).filter(|unit| matches!(unit, Self::Time { .. }));
        }
        // `ITS-90, deg C`: the scale of temperature, and the unit.
        let unit = text.rsplit_once(',').map_or(text, |(_, unit)| unit.trim());
        Self::known(unit)
    }

    /// The unit of time that is the name of a column, as `ms`, or the only one among its words, as in `elapsedMillis`, `time.ms` and
    /// `milliseconds since boot`.
    pub(crate) fn of_time_named(name: &str) -> Option<Self> {
        let of_time = |text: &str| Self::known(text).filter(Self::is_time);
        if let Some(unit) = of_time(name.trim()) {
            return Some(unit);
        }
        // Single letters stand for much, and a day or a minute may be that of a date.
        let says = |word: &String| word.len() > 1 && !PARTS_OF_DATES.contains(&&**word);
        let spaced = apart(name);
        let mut units = words(&spaced).filter(says).filter_map(|word| of_time(&word));
        let unit = units.next()?;
        units.all(|other| other == unit).then_some(unit)
    }

    fn known(text: &str) -> Option<Self> {
        let time = |symbol, seconds| Some(Self::Time { symbol, seconds });
        // Case tells nothing but `mS` and `MS`, which no logger writes for a time.
        let lower = text.to_lowercase();
        match lower.as_str() {
            "s" | "sec" | "secs" | "second" | "seconds" | "sek" | "sekunde" | "sekunden" | "secondes" | "segundos" => {
                return time("s", 1.0);
            }
            "ms" | "msec" | "msecs" | "msek" | "millisec" | "millisecs" | "millisecond" | "milliseconds" | "millis"
            | "millisekunden" => return time("ms", 1e-3),
            "us" | "µs" | "μs" | "usec" | "usecs" | "microsec" | "microsecs" | "microsecond" | "microseconds"
            | "micros" | "mikrosekunden" => return time("us", 1e-6),
            "ns" | "nsec" | "nsecs" | "nanosecond" | "nanoseconds" | "nanos" => return time("ns", 1e-9),
            "min" | "mins" | "minute" | "minutes" | "minuten" | "minutos" => return time("min", 60.0),
            "h" | "hr" | "hrs" | "hour" | "hours" | "std" | "stunden" | "heures" | "horas" => return time("h", 3600.0),
            "d" | "day" | "days" | "tage" => return time("d", 86_400.0),
            _ => {}
        }
        // `º` is the ordinal sign, `˚` a ring above, and U+FFFD what a wrong encoding left of `°`; all are met in
        // real files.
        let bare: String = lower.chars().filter(|c| !c.is_whitespace() && !"°º˚\u{FFFD}._*'".contains(*c)).collect();
        let degrees = ["degrees", "degree", "deg", "grad"].into_iter().find_map(|degrees| bare.strip_prefix(degrees));
        match degrees.unwrap_or(&bare) {
            "c" | "oc" | "℃" | "celsius" | "centigrade" => Some(Self::Celsius),
            "k" | "kelvin" => Some(Self::Kelvin),
            "f" | "℉" | "fahrenheit" => Some(Self::Fahrenheit),
            _ => None,
        }
    }

    /// Splits a header into the name and its unit. Where a known unit is not set off by brackets it
    /// must follow `_`, `/`, `,`, ` in ` or a blank. What stands in brackets is a unit, known or
    /// not, unless it is the size, the type or the place of a sensor: that belongs to the name.
    ///
    /// ```
    /// use twinlag_record::Unit;
    ///
    /// assert_eq!(Unit::split_header("T1 [°F]"), ("T1".to_owned(), Unit::Fahrenheit));
    /// assert_eq!(Unit::split_header("gas_K"), ("gas".to_owned(), Unit::Kelvin));
    /// assert_eq!(Unit::split_header("T2 deg C"), ("T2".to_owned(), Unit::Celsius));
    /// assert_eq!(Unit::split_header("inlet"), ("inlet".to_owned(), Unit::Unstated));
    /// assert_eq!(Unit::split_header("wire (0.5 mm)"), ("wire (0.5 mm)".to_owned(), Unit::Unstated));
    /// assert_eq!(Unit::split_header("T1 (type K) [°C]"), ("T1 (type K)".to_owned(), Unit::Celsius));
    /// ```
    pub fn split_header(header: &str) -> (String, Self) {
        let header = header.trim();
        for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
            if let Some(start) = header.rfind(open).filter(|&start| start > 0 && header.ends_with(close)) {
                let (before, bracket) = header.split_at(start);
                let inside = &bracket[1..bracket.len() - 1];
                let unit = Self::parse(inside);
                if is_description(inside) || (unit == Self::Kelvin && is_type_next(before)) {
                    return match Self::split_header(before) {
                        (_, Self::Unstated) => (header.to_owned(), Self::Unstated),
                        (name, unit) => (format!("{name} {bracket}"), unit),
                    };
                }
                let name = before.trim().trim_end_matches(['_', '/', ',']).to_owned();
                return if unit == Self::Unstated { Self::split_bare(&name) } else { (name, unit) };
            }
        }
        Self::split_enclosed(header).unwrap_or_else(|| Self::split_bare(header))
    }

    /// A known unit in brackets, with a word behind: `Gas T (C) fine`.
    fn split_enclosed(header: &str) -> Option<(String, Self)> {
        [('[', ']'), ('(', ')'), ('{', '}')].into_iter().find_map(|(open, close)| {
            let (before, rest) = header.split_once(open)?;
            let (inside, after) = rest.split_once(close)?;
            let unit = Self::known(inside.trim()).filter(|_| !before.trim().is_empty() && !is_type_next(before))?;
            Some((format!("{} {}", before.trim(), after.trim()), unit))
        })
    }

    /// A header without brackets, or of which they are no unit.
    fn split_bare(header: &str) -> (String, Self) {
        for separator in ["_", "/", ",", " in ", " "] {
            let Some((name, unit)) = header.rsplit_once(separator) else { continue };
            let (name, unit) = (name.trim(), unit.trim());
            // `T1 deg C` has its unit in two words.
            let (name, unit) = match name.rsplit_once([' ', '_']) {
                Some((before, "deg" | "Deg" | "°")) => (before.trim(), unit),
                _ => (name, unit),
            };
            // The day of `time of day` is no unit.
            let is_part_of_date = separator == " " && PARTS_OF_DATES.contains(&&*unit.to_lowercase());
            if name.is_empty() || unit.is_empty() || is_type_next(name) || is_part_of_date {
                continue;
            }
            if let Some(known) = Self::known(unit) {
                return (name.to_owned(), known);
            }
            if ["mV", "uV", "µV", "V", "mA", "Ohm", "ohm", "Ω"].contains(&unit) {
                return (name.to_owned(), Self::Other(unit.to_owned()));
            }
        }
        // A column that is called by its unit. In the singular it may be a part of a date.
        let is_plural = |word: &&str| word.len() > 3 && word.ends_with('s');
        let unit =
            Some(header).filter(is_plural).and_then(Self::known).filter(|unit| matches!(unit, Self::Time { .. }));
        (header.to_owned(), unit.unwrap_or(Self::Unstated))
    }

    /// Whether it is a unit of time.
    pub(crate) fn is_time(&self) -> bool {
        matches!(self, Self::Time { .. })
    }

    /// Whether it is a unit of temperature.
    pub fn is_temperature(&self) -> bool {
        matches!(self, Self::Celsius | Self::Kelvin | Self::Fahrenheit)
    }

    /// A temperature in °C; `None` if this is no unit of temperature. An unstated unit is taken to
    /// be °C.
    pub fn to_celsius(&self, value: f64) -> Option<f64> {
        match self {
            Self::Celsius | Self::Unstated => Some(value),
            Self::Kelvin => Some(value - 273.15),
            Self::Fahrenheit => Some((value - 32.0) / 1.8),
            _ => None,
        }
    }

    pub(crate) fn symbol(&self) -> &'static str {
        match self {
            Self::Unstated | Self::Celsius => "°C",
            Self::Kelvin => "K",
            Self::Fahrenheit => "°F",
            Self::Time { symbol, .. } => symbol,
            Self::Other(_) => "",
        }
    }
}

/// Parts of a date or of a time of day, which are units of time as well.
const PARTS_OF_DATES: [&str; 5] = ["second", "minute", "hour", "day", "sekunde"];

/// Whether the letter that follows is a type of thermocouple: `TC1 type K`, in which K is no kelvin.
fn is_type_next(before: &str) -> bool {
    let word = before.trim_end().rsplit(|c: char| !c.is_alphanumeric()).next().unwrap_or("");
    ["type", "typ"].iter().any(|known| word.eq_ignore_ascii_case(known))
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unstated => write!(f, "no unit"),
            Self::Other(text) => write!(f, "{text}"),
            _ => write!(f, "{}", self.symbol()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_give_name_and_unit() {
        let ms = Unit::Time { symbol: "ms", seconds: 1e-3 };
        let minute = Unit::Time { symbol: "min", seconds: 60.0 };
        let second = Unit::Time { symbol: "s", seconds: 1.0 };
        let cases = [
            ("T1 [°C]", "T1", Unit::Celsius),
            ("T1 (degC)", "T1", Unit::Celsius),
            ("T1 Deg C", "T1", Unit::Celsius),
            ("T1 deg C", "T1", Unit::Celsius),
            ("T1 °C", "T1", Unit::Celsius),
            ("T1 / K", "T1", Unit::Kelvin),
            ("T1 in °C", "T1", Unit::Celsius),
            ("T_K", "T", Unit::Kelvin),
            ("T1_gpctd_C", "T1_gpctd", Unit::Celsius),
            ("temp_F", "temp", Unit::Fahrenheit),
            ("T1 [\u{FFFD}C]", "T1", Unit::Celsius),
            ("time [ms]", "time", ms.clone()),
            ("t_min", "t", minute),
            ("time_s", "time", second.clone()),
            ("TC1_mV", "TC1", Unit::Other("mV".to_owned())),
            ("T1 [counts]", "T1", Unit::Other("counts".to_owned())),
            ("T1", "T1", Unit::Unstated),
            ("T1_Avg", "T1_Avg", Unit::Unstated),
            ("Thin wire (0.5 mm)", "Thin wire (0.5 mm)", Unit::Unstated),
            ("Thin (0.5 mm) [K]", "Thin (0.5 mm)", Unit::Kelvin),
            ("Thin [°C] (0.5 mm)", "Thin (0.5 mm)", Unit::Celsius),
            ("T1 (type K)", "T1 (type K)", Unit::Unstated),
            ("TC1 [K-type]", "TC1 [K-type]", Unit::Unstated),
            ("TC1 type K", "TC1 type K", Unit::Unstated),
            ("TC1 Typ (K)", "TC1 Typ (K)", Unit::Unstated),
            ("Temp 1 (deg C)", "Temp 1", Unit::Celsius),
            ("Gas T (C) fine", "Gas T fine", Unit::Celsius),
            ("T090C [ITS-90, deg C]", "T090C", Unit::Celsius),
            ("T1 [degree_Celsius]", "T1", Unit::Celsius),
            ("T1 [degreesC]", "T1", Unit::Celsius),
            ("T1 [˚C]", "T1", Unit::Celsius),
            ("T1 [Grad Celsius]", "T1", Unit::Celsius),
            ("T1 [oC]", "T1", Unit::Celsius),
            ("T1 [degree_Fahrenheit]", "T1", Unit::Fahrenheit),
            ("depth [mm]", "depth", Unit::Other("mm".to_owned())),
            ("time [seconds since 2020-01-01]", "time", second),
            ("millis()", "millis", ms.clone()),
            ("day", "day", Unit::Unstated),
        ];
        for (header, name, unit) in cases {
            assert_eq!(Unit::split_header(header), (name.to_owned(), unit), "{header}");
        }
    }

    /// Fixed points of the scales: ice point 273.15 K = 32 °F = 0 °C, steam point 212 °F = 100 °C.
    #[test]
    fn fixed_points_of_the_scales_agree() {
        assert_eq!(Unit::Kelvin.to_celsius(273.15), Some(0.0));
        assert_eq!(Unit::Fahrenheit.to_celsius(32.0), Some(0.0));
        assert_eq!(Unit::Fahrenheit.to_celsius(212.0), Some(100.0));
        assert_eq!(Unit::Other("mV".to_owned()).to_celsius(1.0), None);
    }
}
