//! Options that contradict each other, or cannot be.

use twinlag_cross_relation::Parameter;
use twinlag_estimate::{Bootstrap, Estimator, Intervals, Known, NoiseColour};

use crate::error::Error;
use crate::options::Options;
use crate::setting::Setting;

impl Options {
    /// Whether they go together.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.check_noise()?;
        self.check_estimator()?;
        self.check_intervals()?;
        self.check_known()?;
        self.check_time_constants()
    }

    /// Refuses to leave out what was asked to be fitted: `what` takes calibration and second lags
    /// from a model.
    pub(crate) fn check_not_fitted(&self, what: &str) -> Result<(), Error> {
        let (setting, got) = if self.free_gain || self.free_offset {
            (Setting::Free, "gain or offset")
        } else if self.second_order != [false; 2] {
            (Setting::SecondOrder, "a second lag")
        } else {
            return Ok(());
        };
        let expected = format!("no such request, because {what} takes its effects from the model of a diagnosis");
        Err(Error::Setting { setting, expected, got: got.into(), also: vec![Setting::Model] })
    }

    /// Whether what is said of the noise goes together.
    fn check_noise(&self) -> Result<(), Error> {
        let is_sound = |s: f64| s.is_finite() && s > 0.0;
        if let Some([a, b]) = self.noise_std_k
            && !(is_sound(a) && is_sound(b))
        {
            return wrong(Setting::Noise, "two positive numbers, S1,S2 in K", format!("{a},{b}"), &[]);
        }
        if let Some(ratio) = self.noise_ratio {
            if !is_sound(ratio) {
                return wrong(Setting::NoiseRatio, "a positive number, S2/S1", ratio.to_string(), &[]);
            }
            if self.noise_std_k.is_some() || !self.quiet_segments_s.is_empty() {
                let expected = "no noise levels and no quiet segment beside it: levels have a ratio already";
                let also = [Setting::Noise, Setting::QuietSegment];
                return wrong(Setting::NoiseRatio, expected, ratio.to_string(), &also);
            }
        }
        if self.noise_colour == NoiseColour::Autoregressive
            && (self.noise_std_k.is_some() || self.noise_ratio.is_some())
        {
            let expected =
                "white where the levels of the noise or their ratio are given: colour and levels are found together";
            let also = [Setting::Noise, Setting::NoiseRatio];
            return wrong(Setting::NoiseColour, expected, "autoregressive".into(), &also);
        }
        for &[from_s, to_s] in &self.quiet_segments_s {
            if !(from_s.is_finite() && to_s.is_finite() && from_s < to_s) {
                let expected = "FROM..TO in seconds, FROM the smaller";
                return wrong(Setting::QuietSegment, expected, format!("{from_s}..{to_s}"), &[]);
            }
        }
        Ok(())
    }

    /// Whether the estimator can be asked this.
    fn check_estimator(&self) -> Result<(), Error> {
        let estimator = || self.estimator.name().to_owned();
        if self.estimator.is_closed_form() {
            let asked = [
                (self.free_gain || self.free_offset, Setting::Free),
                (self.has_second_lag() != [false; 2], Setting::SecondOrder),
                (!self.known.is_empty(), Setting::Known),
            ];
            if let Some((_, setting)) = asked.into_iter().find(|(is_asked, _)| *is_asked) {
                return Err(Error::NotInClosedForm { setting, estimator: estimator() });
            }
        }
        if self.estimator == Estimator::Whitened {
            return Ok(());
        }
        if self.intervals == Intervals::Profile {
            let (what, setting) = ("a profile of the cost", Setting::Intervals);
            return Err(Error::WhitenedOnly { what, setting, estimator: estimator() });
        }
        if self.known.iter().any(|k| k.std.is_some()) {
            let (what, setting) = ("a known value with an uncertainty", Setting::Known);
            return Err(Error::WhitenedOnly { what, setting, estimator: estimator() });
        }
        Ok(())
    }

    fn check_intervals(&self) -> Result<(), Error> {
        let Intervals::Bootstrap(bootstrap) = self.intervals else { return Ok(()) };
        if bootstrap.replicates < Bootstrap::MIN_REPLICATES {
            let expected = format!("at least {}", Bootstrap::MIN_REPLICATES);
            return wrong(Setting::Replicates, &expected, bootstrap.replicates.to_string(), &[]);
        }
        if self.calibrates() || !self.known.is_empty() {
            let expected = "auto or profile where a calibration is fitted or a value is known, which the bootstrap does not simulate";
            return wrong(Setting::Intervals, expected, "bootstrap".into(), &[Setting::Free, Setting::Known]);
        }
        Ok(())
    }

    /// Whether each parameter is known once, and not fitted besides.
    fn check_known(&self) -> Result<(), Error> {
        for (i, known) in self.known.iter().enumerate() {
            let got = known.to_string();
            if self.known[..i].iter().any(|k| k.parameter == known.parameter) {
                return wrong(Setting::Known, "each parameter once", got, &[]);
            }
            let freed_by = match known.parameter {
                Parameter::Gain => self.free_gain.then_some(Setting::Free),
                Parameter::Offset => self.free_offset.then_some(Setting::Free),
                Parameter::SecondTau1 => self.second_order[0].then_some(Setting::SecondOrder),
                Parameter::SecondTau2 => self.second_order[1].then_some(Setting::SecondOrder),
                Parameter::Tau1 | Parameter::Tau2 => None,
            };
            if let (None, Some(freed_by)) = (known.std, freed_by) {
                let expected = "a standard deviation (NAME=VALUE+-SD) for what is to be fitted, or not both";
                return wrong(Setting::Known, expected, got, &[freed_by]);
            }
        }
        Ok(())
    }

    /// Whether one is left to find, and second ones are the smaller ones.
    fn check_time_constants(&self) -> Result<(), Error> {
        let is_held = |p| self.known(p).is_some_and(|k| k.std.is_none());
        if is_held(Parameter::Tau1) && is_held(Parameter::Tau2) {
            let expected = "at least one time constant to find: leave one out, or give it a standard deviation";
            let got = format!("{} and {}", Known::NAMES[0], Known::NAMES[1]);
            return wrong(Setting::Known, expected, got, &[]);
        }
        for (first, second) in [(Parameter::Tau1, Parameter::SecondTau1), (Parameter::Tau2, Parameter::SecondTau2)] {
            if let (Some(first), Some(second)) = (self.known(first), self.known(second))
                && second.value > first.value
            {
                let expected = format!("a second time constant that is the smaller one, at most {}", first.value);
                return wrong(Setting::Known, &expected, second.value.to_string(), &[]);
            }
        }
        Ok(())
    }
}

fn wrong(setting: Setting, expected: &str, got: String, also: &[Setting]) -> Result<(), Error> {
    Err(Error::Setting { setting, expected: expected.into(), got, also: also.to_vec() })
}
