//! What is known of a parameter beforehand, and how it is written: `T1=0.5s+-20%`.
//!
//! A known value has a name, a number and, if it is not exact, a standard deviation. Numbers may
//! have a unit; the deviation may be a per cent of the value. Every mistake has a message of its
//! own, so that whoever mistypes need not guess which part was wrong.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use twinlag_cross_relation::Parameter;

use crate::error::EstimateError;

/// Something known of a parameter beforehand.
///
/// As text it is `NAME=VALUE` or `NAME=VALUE+-SD`. `NAME` is one of [`Known::NAMES`] or
/// [`Known::SHORT_NAMES`]. A time constant may have a unit (`s`, `ms`, `us`, `min`; without one it
/// is in s), an offset may have `K`, a gain has none. `SD`, the standard deviation, is in the
/// unit of the value unless it has its own, or a per cent of the value; `±` and `+/-` stand for
/// `+-`, and blanks are allowed.
///
/// ```
/// use twinlag_estimate::Known;
///
/// let known: Known = "T1 = 500 ms ± 20 %".parse()?;
/// assert_eq!((known.value, known.std), (0.5, Some(0.1)));
/// // It prints in the long form, which reads back the same to the bit.
/// assert_eq!(known.to_string(), "T1.time_constant_s=0.5+-0.1");
/// assert_eq!(known.to_string().parse(), Ok(known));
///
/// let error = "T1=0.5K".parse::<Known>().expect_err("not a time");
/// assert!(error.to_string().contains("expected a time in s, ms, us or min, got \"0.5K\""));
/// # Ok::<(), twinlag_estimate::EstimateError>(())
/// ```
///
/// A settings file may hold either that text or the three fields.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "Written")]
pub struct Known {
    /// Which one.
    pub parameter: Parameter,
    /// Its value: s for time constants, 1 for the gain, K at 0 °C for the offset.
    pub value: f64,
    /// Standard deviation of that knowledge; `None` holds the parameter at the value.
    pub std: Option<f64>,
}

/// How a known value may stand in a settings file.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
enum Written {
    Text(String),
    Fields { parameter: Parameter, value: f64, std: Option<f64> },
}

impl TryFrom<Written> for Known {
    type Error = EstimateError;

    fn try_from(written: Written) -> Result<Self, EstimateError> {
        match written {
            Written::Text(text) => text.parse(),
            Written::Fields { parameter, value, std } => Self { parameter, value, std }.checked(),
        }
    }
}

/// What a number may be followed by, and what it is then worth: parts of the unit, so that 500 ms
/// is the double nearest to 0.5 s.
type Units = &'static [(&'static str, Scale)];

#[derive(Clone, Copy)]
enum Scale {
    Times(f64),
    Over(f64),
}

const TIME_UNITS: Units = &[
    ("", Scale::Times(1.0)),
    ("s", Scale::Times(1.0)),
    ("ms", Scale::Over(1e3)),
    ("us", Scale::Over(1e6)),
    // The micro sign and the Greek letter.
    ("\u{b5}s", Scale::Over(1e6)),
    ("\u{3bc}s", Scale::Over(1e6)),
    ("min", Scale::Times(60.0)),
];
const OFFSET_UNITS: Units = &[("", Scale::Times(1.0)), ("K", Scale::Times(1.0))];
const GAIN_UNITS: Units = &[("", Scale::Times(1.0))];

impl Known {
    /// Names in texts, in the order of [`Parameter::ALL`].
    pub const NAMES: [&'static str; 6] = [
        "T1.time_constant_s",
        "T2.time_constant_s",
        "T2.gain",
        "T2.offset_K",
        "T1.second_time_constant_s",
        "T2.second_time_constant_s",
    ];
    /// Short names in texts, in the order of [`Parameter::ALL`].
    pub const SHORT_NAMES: [&'static str; 6] = ["T1", "T2", "gain", "offset", "T1.second", "T2.second"];

    /// The name of its parameter, one of [`Known::NAMES`].
    pub fn name(&self) -> &'static str {
        Self::NAMES[Parameter::ALL.iter().position(|p| *p == self.parameter).unwrap_or(0)]
    }

    /// A time constant and a gain are positive, a deviation too.
    fn checked(self) -> Result<Self, EstimateError> {
        let is_positive = |v: f64| v.is_finite() && v > 0.0;
        let expected = match self.parameter {
            Parameter::Offset if self.value.is_finite() => None,
            Parameter::Offset => Some("a finite offset in K"),
            _ if is_positive(self.value) => None,
            Parameter::Gain => Some("a positive gain"),
            _ => Some("a positive time constant"),
        };
        let wrong = |expected: &str, got: f64| EstimateError::BadKnown {
            text: self.to_string(),
            expected: expected.to_owned(),
            got: got.to_string(),
        };
        match (expected, self.std) {
            (Some(expected), _) => Err(wrong(expected, self.value)),
            (None, Some(std)) if !is_positive(std) => {
                Err(wrong("a positive standard deviation (an exact value has none)", std))
            }
            _ => Ok(self),
        }
    }
}

impl fmt::Display for Known {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.name(), self.value)?;
        self.std.map_or(Ok(()), |std| write!(f, "+-{std}"))
    }
}

impl FromStr for Known {
    type Err = EstimateError;

    fn from_str(text: &str) -> Result<Self, EstimateError> {
        let wrong = |expected: String, got: &str| EstimateError::BadKnown {
            text: text.to_owned(),
            expected,
            got: got.trim().to_owned(),
        };
        let (name, rest) = text.split_once('=').ok_or_else(|| wrong("a name, =, and a value".to_owned(), text))?;
        let is_name = |names: [&str; 6]| names.iter().position(|known| known.eq_ignore_ascii_case(name.trim()));
        let index = is_name(Self::SHORT_NAMES).or_else(|| is_name(Self::NAMES)).ok_or_else(|| {
            let names = |names: [&str; 6]| names.join(", ");
            wrong(format!("one of the names {}, or in full {}", names(Self::SHORT_NAMES), names(Self::NAMES)), name)
        })?;
        let parameter = Parameter::ALL[index];
        let number = |text: &str| quantity(text, parameter).map_err(|expected| wrong(expected, text));
        let (value_text, std_text) = split_deviation(rest);
        let (value, value_scale) = number(value_text)?;
        let std = match std_text.map(|text| (text, text.trim().strip_suffix('%'))) {
            None => None,
            Some((text, Some(share))) => {
                let share: f64 = share
                    .trim()
                    .parse()
                    .map_err(|_| wrong("a number of per cent, as 20%, for the standard deviation".to_owned(), text))?;
                if value == 0.0 {
                    return Err(wrong("a standard deviation in K: a share of 0 is 0".to_owned(), text));
                }
                Some(value.abs() * share / 100.0)
            }
            Some((text, None)) => {
                let (std, scale) = number(text).map_err(|_| {
                    wrong(format!("a standard deviation, in per cent or as {}", described(parameter)), text)
                })?;
                // Without a unit of its own it is in that of the value.
                Some(if scale.is_none() { value_scale.map_or(std, |scale| scale.of(std)) } else { std })
            }
        };
        let known = Self { parameter, value, std };
        // In the words of what was typed.
        known.checked().map_err(|error| match error {
            EstimateError::BadKnown { expected, got, .. } => {
                EstimateError::BadKnown { text: text.to_owned(), expected, got }
            }
            other => other,
        })
    }
}

impl Scale {
    fn of(self, value: f64) -> f64 {
        match self {
            Self::Times(factor) => value * factor,
            Self::Over(divisor) => value / divisor,
        }
    }
}

/// The value, and the deviation where there is one.
fn split_deviation(text: &str) -> (&str, Option<&str>) {
    let split = ["+-", "+/-", "±"].into_iter().find_map(|sign| text.split_once(sign));
    split.map_or((text, None), |(value, std)| (value, Some(std)))
}

/// What a number of this parameter may look like, in a message.
fn described(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::Gain => "a number without a unit",
        Parameter::Offset => "a temperature difference in K",
        _ => "a time in s, ms, us or min",
    }
}

/// A number in s, K or 1, and the scale of its unit if it has one.
///
/// # Errors
/// What was expected.
fn quantity(text: &str, parameter: Parameter) -> Result<(f64, Option<Scale>), String> {
    let text = text.trim();
    let unit_from = text
        .rfind(|c: char| !c.is_alphabetic() && c != '%')
        .map_or(0, |at| at + text[at..].chars().next().map_or(0, char::len_utf8));
    let (number, unit) = (text[..unit_from].trim(), &text[unit_from..]);
    let units = match parameter {
        Parameter::Gain => GAIN_UNITS,
        Parameter::Offset => OFFSET_UNITS,
        _ => TIME_UNITS,
    };
    let expected = || described(parameter).to_owned();
    let with_point = || {
        if number.contains(',') {
            format!("{} with a decimal point, no comma", described(parameter))
        } else {
            expected()
        }
    };
    let value: f64 = number.parse().map_err(|_| with_point())?;
    let (_, scale) = units.iter().find(|(symbol, _)| *symbol == unit).ok_or_else(expected)?;
    Ok((scale.of(value), (!unit.is_empty()).then_some(*scale)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Parameter, f64, Option<f64>) {
        let known: Known = text.parse().expect("well formed");
        (known.parameter, known.value, known.std)
    }

    fn refusal(text: &str) -> String {
        text.parse::<Known>().expect_err("not well formed").to_string()
    }

    #[test]
    fn knowledge_is_read_with_and_without_uncertainty() {
        assert_eq!(read("T1.time_constant_s=0.5+-0.05"), (Parameter::Tau1, 0.5, Some(0.05)));
        assert_eq!(read("T2.offset_K=-1.5"), (Parameter::Offset, -1.5, None));
    }

    /// Each way of writing has the value that stands beside it. The oracle of those with a unit is the
    /// double nearest to the decimal number in s.
    #[test]
    fn one_value_may_be_written_in_many_ways() {
        for text in ["T1=0.5+-0.1", "T1=0.5s+-20%", " t1 = 500 ms ± 20 % ", "T1=500ms+-100", "T1=0.5+/-100ms"] {
            assert_eq!(read(text), (Parameter::Tau1, 0.5, Some(0.1)), "{text}");
        }
        for (text, parameter, value) in [
            ("T2=70us", Parameter::Tau2, 7e-5),
            ("T2=70µs", Parameter::Tau2, 7e-5),
            ("T2=1.5min", Parameter::Tau2, 90.0),
            ("T2=2e-3s", Parameter::Tau2, 0.002),
            ("gain=0.99", Parameter::Gain, 0.99),
            ("offset=-0.2K", Parameter::Offset, -0.2),
            ("T1.second=40ms", Parameter::SecondTau1, 0.04),
            ("T2.second_time_constant_s=0.04", Parameter::SecondTau2, 0.04),
        ] {
            assert_eq!(read(text), (parameter, value, None), "{text}");
        }
        assert_eq!(read("offset=-2K+-50%"), (Parameter::Offset, -2.0, Some(1.0)));
    }

    /// The text of a value reads back as that value, to the bit: doubles print in the fewest digits
    /// that give them again.
    #[test]
    fn what_is_printed_reads_back_the_same() {
        for text in ["T1=0.1s+-33.3%", "T2.gain=0.987", "T2.offset_K=-1e-7+-1e-9", "T2.second=1e-5min"] {
            let known: Known = text.parse().expect("well formed");
            assert_eq!(known.to_string().parse(), Ok(known), "{text}");
        }
    }

    #[test]
    fn each_mistake_is_named_with_what_was_expected_and_what_came() {
        for (text, want) in [
            ("T1", "expected a name, =, and a value, got \"T1\""),
            ("T3=1", "expected one of the names T1, T2, gain, offset"),
            ("T1.tau=1", "T2.second_time_constant_s, got \"T1.tau\""),
            ("T1=", "expected a time in s, ms, us or min, got \"\""),
            ("T1=fast", "expected a time in s, ms, us or min, got \"fast\""),
            ("T1=0.5K", "expected a time in s, ms, us or min, got \"0.5K\""),
            ("T1=50%", "expected a time in s, ms, us or min, got \"50%\""),
            ("T1=0,5s", "with a decimal point, no comma, got \"0,5s\""),
            ("T2.gain=1s", "expected a number without a unit, got \"1s\""),
            ("offset=1s", "expected a temperature difference in K, got \"1s\""),
            ("T1=-1", "expected a positive time constant, got \"-1\""),
            ("T1=nan", "expected a time in s, ms, us or min, got \"nan\""),
            ("gain=0", "expected a positive gain, got \"0\""),
            ("T1=1+-", "expected a standard deviation, in per cent or as a time in s, ms, us or min, got \"\""),
            ("T1=1+-0", "expected a positive standard deviation (an exact value has none), got \"0\""),
            ("T1=1+--5%", "expected a positive standard deviation (an exact value has none), got \"-0.05\""),
            ("T1=1+-many%", "expected a number of per cent, as 20%, for the standard deviation, got \"many%\""),
            ("offset=0+-20%", "expected a standard deviation in K: a share of 0 is 0, got \"20%\""),
        ] {
            let message = refusal(text);
            assert!(message.contains(want) && message.contains(text), "{text}: found {message}, expected {want}");
            assert!(message.contains("NAME=VALUE+-SD, for example T1=0.5s+-20%"), "{message}");
        }
    }
}
