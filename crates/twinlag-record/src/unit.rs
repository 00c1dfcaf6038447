//! Units in column headers: `T1 [°C]`, `T1 (degC)`, `T1 / K`, `T1 °C`, `T_K`, `temp_F`,
//! `time [ms]`, `t_min`.

use std::fmt;

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

impl Unit {
    /// Reads a unit that stands alone, as `°C` or `[ms]`; the empty text is [`Unit::Unstated`].
    pub fn parse(text: &str) -> Self {
        let text = text.trim().trim_start_matches(['[', '(', '{']).trim_end_matches([']', ')', '}']).trim();
        if text.is_empty() { Self::Unstated } else { Self::known(text).unwrap_or_else(|| Self::Other(text.to_owned())) }
    }

    fn known(text: &str) -> Option<Self> {
        let time = |symbol, seconds| Some(Self::Time { symbol, seconds });
        // Case tells nothing but `mS` and `MS`, which no logger writes for a time.
        let lower = text.to_lowercase();
        match lower.as_str() {
            "s" | "sec" | "secs" | "second" | "seconds" | "sek" | "sekunden" => return time("s", 1.0),
            "ms" | "msec" | "millisecond" | "milliseconds" => return time("ms", 1e-3),
            "us" | "µs" | "μs" | "usec" | "microseconds" => return time("us", 1e-6),
            "min" | "mins" | "minute" | "minutes" | "minuten" => return time("min", 60.0),
            "h" | "hr" | "hrs" | "hour" | "hours" | "std" | "stunden" => return time("h", 3600.0),
            "d" | "day" | "days" | "tage" => return time("d", 86_400.0),
            _ => {}
        }
        // `º` is the ordinal sign and U+FFFD what a wrong encoding left of `°`; both are met in
        // real files.
        let bare: String = lower.chars().filter(|c| !c.is_whitespace() && !"°º\u{FFFD}._*'".contains(*c)).collect();
        match bare.strip_prefix("degrees").or_else(|| bare.strip_prefix("deg")).unwrap_or(&bare) {
            "c" | "℃" | "celsius" | "centigrade" => Some(Self::Celsius),
            "k" | "kelvin" => Some(Self::Kelvin),
            "f" | "℉" | "fahrenheit" => Some(Self::Fahrenheit),
            _ => None,
        }
    }

    /// Splits a header into the name and its unit. Where a known unit is not set off by brackets it
    /// must follow `_`, `/`, `,`, ` in ` or a blank; brackets always hold a unit, known or not.
    ///
    /// ```
    /// use twinlag_record::Unit;
    ///
    /// assert_eq!(Unit::split_header("T1 [°F]"), ("T1".to_owned(), Unit::Fahrenheit));
    /// assert_eq!(Unit::split_header("gas_K"), ("gas".to_owned(), Unit::Kelvin));
    /// assert_eq!(Unit::split_header("T2 deg C"), ("T2".to_owned(), Unit::Celsius));
    /// assert_eq!(Unit::split_header("inlet"), ("inlet".to_owned(), Unit::Unstated));
    /// ```
    pub fn split_header(header: &str) -> (String, Self) {
        let header = header.trim();
        for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
            if let Some(start) = header.rfind(open).filter(|&start| start > 0 && header.ends_with(close)) {
                return (
                    header[..start].trim().trim_end_matches(['_', '/', ',']).to_owned(),
                    Self::parse(&header[start..]),
                );
            }
        }
        for separator in ["_", "/", ",", " in ", " "] {
            let Some((name, unit)) = header.rsplit_once(separator) else { continue };
            let (name, unit) = (name.trim(), unit.trim());
            // `T1 deg C` has its unit in two words.
            let (name, unit) = match name.rsplit_once([' ', '_']) {
                Some((before, "deg" | "Deg" | "°")) => (before.trim(), unit),
                _ => (name, unit),
            };
            if name.is_empty() || unit.is_empty() {
                continue;
            }
            if let Some(known) = Self::known(unit) {
                return (name.to_owned(), known);
            }
            if ["mV", "uV", "µV", "V", "mA", "Ohm", "ohm", "Ω"].contains(&unit) {
                return (name.to_owned(), Self::Other(unit.to_owned()));
            }
        }
        (header.to_owned(), Self::Unstated)
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
            ("time [ms]", "time", ms),
            ("t_min", "t", minute),
            ("time_s", "time", second),
            ("TC1_mV", "TC1", Unit::Other("mV".to_owned())),
            ("T1 [counts]", "T1", Unit::Other("counts".to_owned())),
            ("T1", "T1", Unit::Unstated),
            ("T1_Avg", "T1_Avg", Unit::Unstated),
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
