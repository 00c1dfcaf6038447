//! What is asked of a record: by which estimator, with what known beforehand.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use twinlag_cross_relation::Parameter;
use twinlag_optimise::Optimiser;
use twinlag_sensor::Discretisation;

use crate::error::Error;
use crate::estimate::Bootstrap;
use crate::levels::NoiseColour;

/// The estimators, by the names that scripts use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Estimator {
    /// Exactly whitened difference of the inferred gas temperatures: the default.
    #[default]
    Whitened,
    /// The published cross-relation cost. Noise biases it to long time constants.
    CrossRelation,
    /// The published cost with the noise taken out of its expectation; needs the noise levels.
    BiasCompensated,
    /// The published cost over what noise adds to it; needs only the ratio of the noise levels.
    Normalised,
    /// The compensated cost in units of the noise's own standard deviation; needs the noise levels.
    Hybrid,
    /// Least squares on the difference equation. Noise biases it; which way depends on which sensor comes first.
    DifferenceEquationLs,
    /// Total least squares on it. Biased too, since its columns share their noise.
    DifferenceEquationTls,
    /// Generalised total least squares on it; needs only the ratio of the noise levels.
    DifferenceEquationGtls,
}

impl Estimator {
    /// All of them, the default first.
    pub const ALL: [Self; 8] = [
        Self::Whitened,
        Self::CrossRelation,
        Self::BiasCompensated,
        Self::Normalised,
        Self::Hybrid,
        Self::DifferenceEquationLs,
        Self::DifferenceEquationTls,
        Self::DifferenceEquationGtls,
    ];

    /// Whether it is one of those on the difference equation: solved in closed form, for sensors of first order, and with nothing
    /// else to find.
    pub fn is_closed_form(self) -> bool {
        matches!(self, Self::DifferenceEquationLs | Self::DifferenceEquationTls | Self::DifferenceEquationGtls)
    }

    /// The name that scripts use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whitened => "whitened",
            Self::CrossRelation => "cross-relation",
            Self::BiasCompensated => "bias-compensated",
            Self::Normalised => "normalised",
            Self::Hybrid => "hybrid",
            Self::DifferenceEquationLs => "difference-equation-ls",
            Self::DifferenceEquationTls => "difference-equation-tls",
            Self::DifferenceEquationGtls => "difference-equation-gtls",
        }
    }
}

impl fmt::Display for Estimator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Estimator {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|e| e.name() == text).ok_or_else(|| Error::Option {
            option: "--estimator",
            expected: format!("one of {}", Self::ALL.map(Self::name).join(", ")),
            got: text.into(),
        })
    }
}

/// What the gas is taken to do between samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// Constant, unless the record is much better explained by straight lines.
    #[default]
    Auto,
    /// Constant until the next sample.
    ZeroOrderHold,
    /// A straight line from sample to sample.
    FirstOrderHold,
    /// The trapezoidal rule.
    Bilinear,
}

impl Hold {
    /// The discretisation to begin with.
    pub(crate) fn first(self) -> Discretisation {
        match self {
            Self::Auto | Self::ZeroOrderHold => Discretisation::ZeroOrderHold,
            Self::FirstOrderHold => Discretisation::FirstOrderHold,
            Self::Bilinear => Discretisation::Bilinear,
        }
    }
}

impl FromStr for Hold {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "auto" => Ok(Self::Auto),
            "zero-order-hold" => Ok(Self::ZeroOrderHold),
            "first-order-hold" => Ok(Self::FirstOrderHold),
            "bilinear" => Ok(Self::Bilinear),
            _ => Err(Error::Option {
                option: "--hold",
                expected: "auto, zero-order-hold, first-order-hold or bilinear".into(),
                got: text.into(),
            }),
        }
    }
}

/// What 95 % intervals are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Intervals {
    /// Standard errors, with noise multiplied by noise and the uncertainty of found levels in them; the profile of the cost
    /// where that has another shape.
    #[default]
    Auto,
    /// The profile of the whitened cost.
    Profile,
    /// The same estimator on simulated records.
    Bootstrap(Bootstrap),
}

/// Something known of a parameter beforehand: `T1.time_constant_s=0.5`, or `T1.time_constant_s=0.5+-0.05`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// Which one.
    pub parameter: Parameter,
    /// Its value: s for time constants, 1 for the gain, K at 0 °C for the offset.
    pub value: f64,
    /// Standard deviation of that knowledge; `None` holds the parameter at the value.
    pub std: Option<f64>,
}

impl Known {
    /// Names that [`Known::from_str`] takes, in the order of [`Parameter::ALL`].
    pub const NAMES: [&'static str; 6] = [
        "T1.time_constant_s",
        "T2.time_constant_s",
        "T2.gain",
        "T2.offset_K",
        "T1.second_time_constant_s",
        "T2.second_time_constant_s",
    ];
}

impl FromStr for Known {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = || Error::Option {
            option: "--known",
            expected: format!(
                "NAME=VALUE or NAME=VALUE+-SD, VALUE and SD positive (an offset may be negative), NAME one of {}",
                Self::NAMES.join(", ")
            ),
            got: text.into(),
        };
        let (name, value) = text.split_once('=').ok_or_else(wrong)?;
        let index = Self::NAMES.iter().position(|n| *n == name.trim()).ok_or_else(wrong)?;
        let (value, std) = match value.split_once("+-").or_else(|| value.split_once('±')) {
            Some((value, std)) => (value, Some(std.trim().parse::<f64>().map_err(|_| wrong())?)),
            None => (value, None),
        };
        let value: f64 = value.trim().parse().map_err(|_| wrong())?;
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let sound = if index == 3 { value.is_finite() } else { positive(value) } && std.is_none_or(positive);
        if sound { Ok(Self { parameter: Parameter::ALL[index], value, std }) } else { Err(wrong()) }
    }
}

/// Everything that a characterisation depends on besides the record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// How to estimate.
    pub estimator: Estimator,
    /// How to minimise.
    pub optimiser: Optimiser,
    /// What the gas does between samples.
    pub hold: Hold,
    /// Noise standard deviations of the two channels, K; found from the data if left out.
    pub noise_std_k: Option<[f64; 2]>,
    /// Ratio `s2/s1` of the noise levels where only that is known.
    pub noise_ratio: Option<f64>,
    /// Stretches `[from, to]` in which the gas is at rest, s from the start of the record: noise levels are taken from there.
    pub quiet_segments_s: Vec<[f64; 2]>,
    /// What noise is taken to be like where its levels are found.
    pub noise_colour: NoiseColour,
    /// Whether the relative gain of channel 2 is fitted.
    pub free_gain: bool,
    /// Whether the relative offset of channel 2 is fitted.
    pub free_offset: bool,
    /// Which sensors have a second lag that is fitted.
    pub second_order: [bool; 2],
    /// What is known beforehand.
    pub known: Vec<Known>,
    /// Samples left out at the start of each unbroken stretch by the published family; by default ten times the
    /// longest time constant of the whitened estimate.
    pub discard: Option<usize>,
    /// What intervals are made of.
    pub intervals: Intervals,
}

impl Options {
    /// Refuses to leave out what was asked to be fitted: `what` takes calibration and second lags from a model.
    pub(crate) fn check_not_fitted(&self, what: &str) -> Result<(), Error> {
        let (option, got) = if self.free_gain || self.free_offset {
            ("--free", "gain or offset")
        } else if self.second_order != [false; 2] {
            ("--second-order", "a second lag")
        } else {
            return Ok(());
        };
        let expected = format!(
            "nothing: {what} takes what is to be undone from a model (`twinlag diagnose --save`, then --model)"
        );
        Err(Error::Option { option, expected, got: got.into() })
    }

    /// Parses a list such as `gain,offset` into [`Options::free_gain`] and [`Options::free_offset`].
    ///
    /// # Errors
    /// [`Error::Option`] for any other name.
    pub fn free(mut self, list: &str) -> Result<Self, Error> {
        for name in list.split(',').map(str::trim).filter(|n| !n.is_empty()) {
            match name {
                "gain" => self.free_gain = true,
                "offset" => self.free_offset = true,
                _ => {
                    let expected = "gain, offset or gain,offset".into();
                    return Err(Error::Option { option: "--free", expected, got: name.into() });
                }
            }
        }
        Ok(self)
    }

    /// Parses `T1`, `T2` or `T1,T2` into [`Options::second_order`].
    ///
    /// # Errors
    /// [`Error::Option`] for any other name.
    pub fn second_order(mut self, list: &str) -> Result<Self, Error> {
        for name in list.split(',').map(str::trim).filter(|n| !n.is_empty()) {
            match name {
                "T1" => self.second_order[0] = true,
                "T2" => self.second_order[1] = true,
                _ => {
                    let expected = "T1, T2 or T1,T2".into();
                    return Err(Error::Option { option: "--second-order", expected, got: name.into() });
                }
            }
        }
        Ok(self)
    }

    /// Which sensors have a second lag: one that is fitted, or known.
    pub(crate) fn has_second_lag(&self) -> [bool; 2] {
        let known = |p| self.known(p).is_some();
        [self.second_order[0] || known(Parameter::SecondTau1), self.second_order[1] || known(Parameter::SecondTau2)]
    }

    pub(crate) fn known(&self, parameter: Parameter) -> Option<&Known> {
        self.known.iter().find(|k| k.parameter == parameter)
    }

    /// Whether gain or offset play a part.
    pub(crate) fn calibrates(&self) -> bool {
        self.free_gain
            || self.free_offset
            || self.known.iter().any(|k| matches!(k.parameter, Parameter::Gain | Parameter::Offset))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knowledge_is_read_with_and_without_uncertainty() {
        let known: Known = "T1.time_constant_s=0.5+-0.05".parse().expect("well formed");
        assert_eq!(known, Known { parameter: Parameter::Tau1, value: 0.5, std: Some(0.05) });
        let known: Known = "T2.offset_K=-1.5".parse().expect("well formed");
        assert_eq!(known, Known { parameter: Parameter::Offset, value: -1.5, std: None });
    }

    #[test]
    fn nonsense_is_refused_with_what_was_expected() {
        for text in ["T1.tau=1", "T1.time_constant_s", "T1.time_constant_s=-1", "T2.gain=1+-0", "T2.gain=one"] {
            let message = text.parse::<Known>().expect_err("not well formed").to_string();
            assert!(message.contains("T1.time_constant_s") && message.contains(text), "{message}");
        }
        let message = "least-squares".parse::<Estimator>().expect_err("unknown").to_string();
        assert!(message.contains("whitened") && message.contains("normalised"), "{message}");
        assert!(Options::default().free("gain,slope").is_err());
        assert!(Options::default().second_order("T1,T3").is_err());
    }
}
