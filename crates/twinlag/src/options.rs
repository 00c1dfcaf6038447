//! What is asked of a record: by which estimator, with what known beforehand.

mod check;

use serde::{Deserialize, Serialize};
use twinlag_cross_relation::Parameter;
use twinlag_estimate::{Estimator, Hold, Intervals, Known, NoiseColour};
use twinlag_optimise::Optimiser;

use crate::error::Error;
use crate::setting::Setting;

/// Everything that a characterisation depends on besides the record.
///
/// ```
/// use twinlag::{Estimator, Options};
///
/// // As a settings file has it: what is left out has its default, and what is misspelt is refused.
/// let options: Options = toml::from_str("estimator = \"cross-relation\"\nnoise_std_k = [0.1, 0.2]")?;
/// let noise_std_k = Some([0.1, 0.2]);
/// assert_eq!(options, Options { estimator: Estimator::CrossRelation, noise_std_k, ..Options::default() });
/// assert!(toml::from_str::<Options>("noise = [0.1, 0.2]").is_err());
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    /// Stretches `[from, to]` in which the gas is at rest, s from the start of the record: noise
    /// levels are taken from there.
    pub quiet_segments_s: Vec<[f64; 2]>,
    /// What noise is taken to be like where its levels are found.
    pub noise_colour: NoiseColour,
    /// Whether the relative gain of channel 2 is fitted.
    pub free_gain: bool,
    /// Whether the relative offset of channel 2 is fitted.
    pub free_offset: bool,
    /// Which sensors have a second lag that is fitted.
    pub second_order: [bool; 2],
    /// What is known beforehand; in a settings file either as text, `"T1=0.5s+-20%"`, or as fields.
    pub known: Vec<Known>,
    /// Samples left out at the start of each unbroken stretch by the published family; by default
    /// ten times the longest time constant of the whitened estimate.
    pub discard: Option<usize>,
    /// What intervals are made of.
    pub intervals: Intervals,
    /// Whether numbers are given that may not be used ([`Grade::NoGo`](crate::diagnosis::Grade::NoGo)).
    pub best_effort: bool,
}

impl Options {
    /// Parses a list such as `gain,offset` into [`Options::free_gain`] and
    /// [`Options::free_offset`].
    ///
    /// # Errors
    /// [`Error::Setting`] for any other name.
    pub fn free(mut self, list: &str) -> Result<Self, Error> {
        for name in list.split(',').map(str::trim).filter(|n| !n.is_empty()) {
            match name {
                "gain" => self.free_gain = true,
                "offset" => self.free_offset = true,
                _ => {
                    let expected = "gain, offset or gain,offset".into();
                    let setting = Setting::Free;
                    return Err(Error::Setting { setting, expected, got: name.into(), also: Vec::new() });
                }
            }
        }
        Ok(self)
    }

    /// Parses `T1`, `T2` or `T1,T2` into [`Options::second_order`].
    ///
    /// ```
    /// let options = twinlag::Options::default().free("gain, offset")?.second_order("T2")?;
    /// assert!(options.free_gain && options.free_offset);
    /// assert_eq!(options.second_order, [false, true]);
    /// # Ok::<(), twinlag::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Setting`] for any other name.
    pub fn second_order(mut self, list: &str) -> Result<Self, Error> {
        for name in list.split(',').map(str::trim).filter(|n| !n.is_empty()) {
            match name {
                "T1" => self.second_order[0] = true,
                "T2" => self.second_order[1] = true,
                _ => {
                    let expected = "T1, T2 or T1,T2".into();
                    let setting = Setting::SecondOrder;
                    return Err(Error::Setting { setting, expected, got: name.into(), also: Vec::new() });
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

    /// A settings file may hold known values as text; written out they are fields, and both are one.
    #[test]
    fn known_values_make_the_round_trip_through_a_settings_file() {
        let text: Options = toml::from_str("known = [\"T1=500ms+-20%\", \"T2.gain=0.99\"]").expect("well formed");
        let want = ["T1.time_constant_s=0.5+-0.1", "T2.gain=0.99"].map(|text| text.parse().expect("well formed"));
        assert_eq!(text.known, want);
        let written = toml::to_string(&text).expect("plain numbers");
        assert!(written.contains("parameter = \"tau1\"") && written.contains("value = 0.5"), "{written}");
        assert_eq!(toml::from_str::<Options>(&written), Ok(text));
        for (bad, want) in [
            ("[\"T1=0.5K\"]", "expected a time in s, ms, us or min"),
            ("[{ parameter = \"tau1\", value = -1.0 }]", "expected a positive time constant, got \"-1\""),
        ] {
            let error = toml::from_str::<Options>(&format!("known = {bad}")).expect_err("refused").to_string();
            assert!(error.contains(want), "found {error}, expected {want}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        assert!(Options::default().free("gain,slope").is_err());
        assert!(Options::default().second_order("T1,T3").is_err());
    }
}
