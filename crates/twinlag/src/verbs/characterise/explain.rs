//! The words of an answer: why a number is missing, and what to do about a model that is rejected.

use twinlag_cross_relation::TestName;
use twinlag_estimate::{Known, NoiseColour, REJECTION_P_VALUE, Ridge, spans_too_much};
use twinlag_optimise::End;

use super::conclude::Conclusion;
use crate::answers::{Characterisation, Difference, IntervalMethod, is_on_bound_of_time_constant};
use crate::setting::Setting;

impl<const P: usize> Conclusion<'_, '_, P> {
    /// What the record determines where it does not determine both time constants.
    pub(super) fn explain(&mut self, out: &mut Characterisation, found: Option<(usize, Ridge)>) {
        let held: Vec<bool> = (0..P).map(|i| self.fit.is_held(i)).collect();
        let is_free = |i: usize| !held[i];
        for i in 0..2 {
            if out.sensors[i].known {
                out.sensors[i].time_constant_s = Some(self.best.x[i]);
            }
        }
        let asked = [4, 5].map(|i| i < P && (is_free(i) || self.fit.unseen()[i - 4].is_some()));
        let unknown = |i: usize| if i < 4 { i < 2 && is_free(i) } else { asked[i - 4] };
        out.not_identifiable =
            (0..Known::NAMES.len()).filter(|&i| unknown(i)).map(|i| Known::NAMES[i].to_owned()).collect();
        if !self.judged.is_determined {
            self.warnings.push(
                "the whitened estimate finds that this record determines nothing; a number from \
                     this estimator would be due to chance"
                    .into(),
            );
            out.not_identifiable.push("time_constant_difference_s".into());
            return;
        }
        self.explain_end(out);
        let Some((index, ridge)) = found else {
            out.not_identifiable.push("time_constant_difference_s".into());
            if !self.asked.options.estimator.is_closed_form() {
                self.warnings.push(
                    "nothing about the time constants is determined, not even their difference: the sensors may be alike, \
                     or the gas may hardly have moved"
                        .into(),
                );
            }
            return;
        };
        if self.judged.is_rejected && !self.asked.options.best_effort {
            out.not_identifiable.push("time_constant_difference_s".into());
            self.warnings.push(
                "the model leaves more than noise beside time constants that are not determined: what is missing may go with \
                 any of them, so the record does not limit their difference either"
                    .into(),
            );
            return;
        }
        out.interval_method = IntervalMethod::Profile;
        let (value, [low, high]) = ridge.difference;
        // The interval is that of the walk, which knows the bound; the value is where the fit ran into it.
        let value = Some(value).filter(|_| !is_on_bound_of_time_constant(&self.best.end));
        out.time_constant_difference_s =
            Difference { value, interval_95_s: Some([low, high]), ..Difference::default() };
        if low <= 0.0 && high >= 0.0 {
            out.time_constant_difference_s.value = None;
            out.not_identifiable.push("time_constant_difference_s".into());
            self.warnings
                .push("nothing about the time constants is determined, not even which sensor is the slower one".into());
            return;
        }
        let other = 1 - index;
        let [low, high] = ridge.other;
        // With a residual that is noise, a time constant that stays put whatever the other does is
        // determined all the same.
        if !self.judged.is_rejected && is_free(other) && low > 0.0 && !spans_too_much([low, high]) {
            let sensor = &mut out.sensors[other];
            sensor.time_constant_s = Some(self.best.x[other]);
            sensor.interval_95_s = Some(ridge.other);
            out.not_identifiable.retain(|name| name != Known::NAMES[other]);
        } else {
            let what = if value.is_some() { "it determines their difference" } else { "it limits their difference" };
            self.warnings.push(format!(
                "this record does not determine the time constants themselves; {what}, over every time constant that it \
                 allows"
            ));
        }
    }

    /// Why the fit is no estimate, as far as its end says.
    fn explain_end(&mut self, out: &mut Characterisation) {
        match &self.best.end {
            End::OnBound(which) => {
                for &i in which {
                    let (variable, x) = (&self.fit.variables()[i], self.best.x[i]);
                    let is_time = !matches!(i, 2 | 3);
                    let meaning = match (is_time, x < (variable.lower * variable.upper).sqrt()) {
                        (true, true) => "the sensor seems faster than the sampling can show: sample faster",
                        (true, false) => "the record seems too short for so slow a sensor",
                        (false, _) => "the two channels do not belong together",
                    };
                    self.warnings.push(format!(
                        "the best fit lies on a bound of {}, {x:.3e}, so it is not an estimate: {meaning}",
                        variable.name
                    ));
                }
                out.not_identifiable
                    .extend([2, 3].iter().filter(|i| which.contains(i)).map(|&i| Known::NAMES[i].into()));
            }
            End::Stalled(why) if self.asked.options.estimator.is_closed_form() => {
                self.warnings.push(format!("{why}: there may be too much noise for this estimator"));
            }
            End::Stalled(why) => {
                self.warnings.push(format!("the optimiser stopped at a point that is not a minimum: {why}"));
            }
            End::LimitReached => self.warnings.push("the optimiser ran out of evaluations before it converged".into()),
            _ => self.warnings.push(
                "time constants that differ by large factors fit the record about equally well, or \
                     the best ones are long compared with the record, so none is reported"
                    .into(),
            ),
        }
    }

    /// Advice and warnings.
    pub(super) fn finish(self, mut out: Characterisation) -> Characterisation {
        if self.judged.is_rejected {
            self.advise(&mut out);
        }
        for (channel, outliers) in self.asked.record.channels.iter().zip(self.levels.outliers) {
            if outliers > 0 {
                out.warnings.push(format!(
                    "{channel}: {outliers} third differences, each of four neighbouring readings, are too large for noise and \
                     were left out of its level: spikes, dropouts or sharp steps of the gas. A diagnosis looks for spikes"
                ));
            }
        }
        out.warnings.splice(0..0, self.warnings);
        out
    }

    /// What to do about a rejected model.
    fn advise(&self, out: &mut Characterisation) {
        let failed: Vec<TestName> =
            out.residual.tests.iter().filter(|t| t.p_value < REJECTION_P_VALUE).map(|t| t.test).collect();
        let names = failed.iter().map(|test| test.name()).collect::<Vec<_>>().join(", ");
        if self.levels.given && failed == [TestName::TotalEnergy] {
            let energy = out.residual.chi2_per_dof.unwrap_or(1.0);
            let (noise, levels) = if self.asked.options.noise_std_k.is_some() {
                ("the given noise", "the noise levels given")
            } else {
                ("the noise of the quiet segment", "the gas temperature seems not to be steady there: the levels")
            };
            out.warnings.push(format!(
                "the residual is white, but its energy is {energy:.3} of what {noise} explains: {levels} are about {:.2} \
                 times what the record shows",
                energy.sqrt().recip()
            ));
            return;
        }
        if self.judged.whitened_is_accepted {
            out.warnings.push(format!(
                "with this estimate the residual is not noise (tests that fail: {names}), but with the \
                     whitened one it is, so the estimator is at fault and not the model"
            ));
            return;
        }
        let (coarse, small) = self.coarse_steps(out);
        let is_white_assumed =
            self.asked.options.noise_colour == NoiseColour::White && self.asked.options.noise_std_k.is_none();
        let may_be_coloured =
            failed.contains(&TestName::Whiteness) && is_white_assumed && self.fit.readings().even_period_s().is_some();
        let colour = if may_be_coloured {
            "the noise is not white: try autoregressive noise"
        } else {
            "the noise is not of the kind assumed"
        };
        let model = if *self.fit.unseen() == [None; 2] && self.asked.options.has_second_lag() != [false; 2] {
            "lags of this order"
        } else {
            "two first-order lags"
        };
        let is_unhelpful = !coarse.is_empty() || self.levels.energy_as_found.is_some();
        if !is_unhelpful && (failed.contains(&TestName::Calibration) || !self.asked.options.calibrates()) {
            out.advice.push(Setting::Free);
        }
        if !is_unhelpful && may_be_coloured {
            out.advice.push(Setting::NoiseColour);
        }
        let hint = if !coarse.is_empty() {
            format!("{}, coarser than its noise, which alone may explain the residual", coarse.join(", "))
        } else if self.levels.energy_as_found.is_some() {
            "the samples are far apart for these sensors: sample faster".into()
        } else if self.outliers_are_alone() && failed.contains(&TestName::TotalEnergy) {
            "some samples are too far off for noise, and the other channel does nothing unusual there (the warning on third \
             differences counts them): correct or empty these cells first"
                .into()
        } else if failed.contains(&TestName::Calibration) {
            let colour = if may_be_coloured { ", and if it does not help autoregressive noise" } else { "" };
            format!("gain and offset of the second channel would explain it better: try to fit them{colour}")
        } else if self.asked.options.calibrates() {
            format!("an effect that {model} lack is at work, or {colour}")
        } else {
            format!(
                "try to fit gain and offset first: thermometers rarely agree at rest; otherwise an effect that {model} lack is at \
                 work, or {colour}"
            )
        };
        out.warnings.push(format!(
            "{model} do not explain this record (tests that fail: {names}), so the fitted time \
                     constants need not be those of the sensors; {hint}"
        ));
        out.warnings.extend(small.into_iter().map(|step| {
            format!(
                "{step}, coarser than its noise, which is too little to explain the residual: it is a fact of the data"
            )
        }));
    }

    /// Steps of the converters that are coarser than the noise, in words: those whose rounding may be what the residual has
    /// beyond noise, and those that are too small for it. The noise level of such a channel holds the `q²/12` of its steps
    /// already; that rounding errors hang together adds at most as much again.
    fn coarse_steps(&self, out: &Characterisation) -> (Vec<String>, Vec<String>) {
        // Levels that were scaled to the residual have the energy of it in units of those before.
        let scaled = self.levels.energy_as_found.unwrap_or(1.0);
        let excess = self.levels.energy_as_found.or(out.residual.chi2_per_dof).unwrap_or(1.0) - 1.0;
        let (mut coarse, mut small) = (Vec::new(), Vec::new());
        for (i, step_k) in self.levels.coarse_step_k.iter().enumerate() {
            let Some(step_k) = step_k else { continue };
            let is_enough = excess <= step_k * step_k / 12.0 / self.levels.std_k[i].powi(2) * scaled;
            let text = format!("{} is quantised in steps of {step_k:.3} K", self.asked.record.channels[i]);
            if is_enough { coarse.push(text) } else { small.push(text) }
        }
        (coarse, small)
    }

    /// Whether most of the third differences that are too large for noise have nothing to do with the other channel.
    fn outliers_are_alone(&self) -> bool {
        let [all, alone] = [self.levels.outliers, self.levels.lone_outliers].map(|counts| counts.iter().sum::<usize>());
        2 * alone > all
    }
}
