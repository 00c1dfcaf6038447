//! What is reported of a fit: status, intervals, and in place of a number that the record does not tell, the reason.

use twinlag_cross_relation::{Middle, ResidualTest};
use twinlag_optimise::End;
use twinlag_sensor::Discretisation;

use crate::characterisation::{
    Characterisation, Difference, Estimate, FreeParameters, IntervalMethod, MadeBy, RecordSummary, Residual,
    SensorEstimate, Status,
};
use crate::error::Error;
use crate::objective::{EstimatorCost, Objective};
use crate::options::{Estimator, Hold, Known};
use crate::profile::{Ridge, Z_975, ridge};
use crate::question::{Fitted, Question, REJECT};

/// A time constant whose logarithm has a larger standard error than this is not determined: its interval spans a factor of
/// seven.
const UNDETERMINED: f64 = 0.5;
/// A time constant longer than this share of the record, and only known to [`LOOSE`], is where fits run to when the record does
/// not tell two lags from none.
const LONGEST_SHARE: f64 = 1.0 / 3.0;
/// Standard error of the logarithm of a time constant that is long beside the record, above which it is not believed.
const LOOSE: f64 = 0.1;
/// Share of a standard error that the choice of hold may cost without a word.
const NOTICEABLE: f64 = 0.5;

/// Standard deviations from a known value beyond which the record contradicts it.
const FAR: f64 = 3.0;

impl<'a, const P: usize> Question<'a, P> {
    pub(crate) fn conclude(
        mut self,
        best: &Fitted<'a>,
        theta: [f64; P],
        covariance: Option<[[f64; P]; P]>,
        tests: Vec<ResidualTest>,
        hold_sensitivity: Option<[f64; 2]>,
    ) -> Result<Characterisation, Error> {
        let is_rejected = self.rejected(&tests);
        let whitened_estimate = self.options.estimator == Estimator::Whitened;
        let is_free = |i: usize| !self.is_held(i);
        let vague = self.vague(&theta, covariance.as_ref());
        let on_bound = match &best.fit.end {
            End::OnBound(which) => which.clone(),
            _ => Vec::new(),
        };
        let status = match &best.fit.end {
            End::OnBound(which) if which.iter().any(|&i| i >= 2) => Status::AtBound,
            End::OnBound(_) | End::Stalled(_) | End::LimitReached => Status::NotIdentifiable,
            _ if !self.is_determined || covariance.is_none() || !vague.is_empty() => Status::NotIdentifiable,
            _ if is_rejected => Status::ModelRejected,
            _ => Status::Ok,
        };
        let mut out = self.skeleton(best, tests, status, hold_sensitivity);
        match status {
            Status::Ok | Status::ModelRejected => {
                let c = covariance.expect("without a covariance the status is another");
                self.fill(&mut out, &theta, &c, hold_sensitivity);
                self.hold_against_knowledge(&theta);
                out.interval_method = if whitened_estimate && is_rejected {
                    IntervalMethod::ResidualSpectrum
                } else {
                    IntervalMethod::Information
                };
            }
            _ => {
                let middle = if is_rejected { Middle::ResidualSpectrum } else { Middle::WhiteNoise };
                // Walk along the time constant that is on a bound, or the vaguer one.
                let index = on_bound.iter().chain(&vague).copied().find(|&i| i < 2 && is_free(i));
                let found = match index {
                    Some(index) if whitened_estimate => self.ridge(best, index, middle)?.map(|r| (index, r)),
                    _ => None,
                };
                self.explain(&mut out, best, found, is_rejected);
                if found.is_none() && matches!(best.fit.end, End::OnBound(_)) {
                    out.status = Status::AtBound;
                }
            }
        }
        if is_rejected {
            self.advise(&mut out);
        }
        for (channel, outliers) in self.record.channels.iter().zip(self.levels.outliers) {
            if outliers > 0 {
                out.warnings.push(format!(
                    "{channel}: {outliers} third differences are too large for noise and were left out of its level: spikes, \
                     dropouts or sharp steps of the gas"
                ));
            }
        }
        out.warnings.splice(0..0, self.warnings);
        Ok(out)
    }

    /// The free time constants that the record does not determine, given their covariance if there is one.
    pub(crate) fn vague(&self, theta: &[f64; P], covariance: Option<&[[f64; P]; P]>) -> Vec<usize> {
        let longest_s = LONGEST_SHARE * self.readings.span_s();
        let is_vague = |i: usize| match covariance {
            Some(c) => {
                let log_error = c[i][i].sqrt() / theta[i];
                log_error > UNDETERMINED || (log_error > LOOSE && theta[i] > longest_s)
            }
            None => true,
        };
        (0..2).filter(|&i| !self.is_held(i) && is_vague(i)).collect()
    }

    /// What the record tells along time constant `index`, whatever the gas does between samples: where the model leaves
    /// more than noise, neither hold can be preferred.
    fn ridge(&self, best: &Fitted<'a>, index: usize, middle: Middle) -> Result<Option<Ridge>, Error> {
        let along = |fitted: &Fitted<'a>| -> Result<Option<Ridge>, Error> {
            let cost = EstimatorCost::Whitened(fitted.whitened.clone());
            let objective = Objective::<P> { cost: &cost, priors: &self.priors };
            ridge::<P>(&objective, &fitted.whitened, &self.variables, &fitted.fit.x, index, middle, self.options)
        };
        let found = along(best)?;
        if self.options.hold != Hold::Auto || self.readings.even_period_s().is_none() {
            return Ok(found);
        }
        let other = match best.whitened.hold() {
            Discretisation::ZeroOrderHold => Discretisation::FirstOrderHold,
            _ => Discretisation::ZeroOrderHold,
        };
        let other = self.fit_whitened_with(other, best.whitened.noise_std(), Some(&best.fit.x))?;
        Ok(match (found, along(&other)?) {
            (Some(a), Some(b)) => Some(a.with(&b)),
            (a, _) => a,
        })
    }

    /// Everything but the estimates.
    fn skeleton(
        &self,
        best: &Fitted<'_>,
        tests: Vec<ResidualTest>,
        status: Status,
        hold_sensitivity: Option<[f64; 2]>,
    ) -> Characterisation {
        let sensor = |i: usize| SensorEstimate {
            channel: self.record.channels[i].clone(),
            time_constant_s: None,
            standard_error_s: None,
            interval_95_s: None,
            noise_std_k: self.levels.std_k[i],
            known: self.is_held(i),
        };
        let total = tests.iter().find(|t| t.test == "total-energy").map(|t| t.statistic);
        let chi2_per_dof = self.levels.energy_as_found.or(total);
        Characterisation {
            schema: Characterisation::SCHEMA.into(),
            record: RecordSummary {
                source: self.record.source.clone(),
                samples: self.record.len(),
                sample_period_s: self.readings.mean_step_s(),
                missing: self.record.missing,
                channels: self.record.channels.clone(),
                segments: self.record.segments.len(),
                sampling: self.record.sampling,
            },
            estimator: self.options.estimator.name().into(),
            optimiser: best.fit.optimiser.clone(),
            hold: hold_name(best.whitened.hold()).into(),
            hold_sensitivity,
            sensors: [sensor(0), sensor(1)],
            time_constant_difference_s: Difference { value: None, interval_95_s: None },
            free: FreeParameters::default(),
            residual: Residual {
                chi2_per_dof,
                white: tests.iter().all(|t| t.test != "whiteness" || t.p_value >= REJECT),
                tests,
            },
            interval_method: IntervalMethod::None,
            status,
            not_identifiable: Vec::new(),
            warnings: Vec::new(),
            fit: best.fit.clone(),
            starts: best.starts,
            notes: self.record.notes.iter().map(ToString::to_string).collect(),
            made_by: MadeBy {
                program: "twinlag".into(),
                version: env!("CARGO_PKG_VERSION").into(),
                options: self.options.clone(),
            },
        }
    }

    /// Estimates and intervals of a fit that is one.
    fn fill(
        &mut self,
        out: &mut Characterisation,
        theta: &[f64; P],
        covariance: &[[f64; P]; P],
        hold_sensitivity: Option<[f64; 2]>,
    ) {
        // The two holds bracket what the gas does between samples: half their difference counts as a standard error.
        let from_hold: [f64; 2] = hold_sensitivity.map_or([0.0; 2], |m| [0.5 * m[0] * theta[0], 0.5 * m[1] * theta[1]]);
        for i in 0..2 {
            let sensor = &mut out.sensors[i];
            sensor.time_constant_s = Some(theta[i]);
            if sensor.known {
                continue;
            }
            let noise = covariance[i][i].sqrt();
            let error = noise.hypot(from_hold[i]);
            let factor = (Z_975 * error / theta[i]).exp();
            sensor.standard_error_s = Some(error);
            sensor.interval_95_s = Some([theta[i] / factor, theta[i] * factor]);
            if from_hold[i].abs() > NOTICEABLE * noise {
                self.warnings.push(format!(
                    "{}: what the gas does between samples moves the time constant by {:.2} %, which is part of the \
                     interval: sample faster",
                    sensor.channel,
                    100.0 * hold_sensitivity.map_or(0.0, |m| m[i]).abs()
                ));
            }
        }
        let difference = theta[1] - theta[0];
        let variance = covariance[0][0] + covariance[1][1] - 2.0 * covariance[0][1];
        let width = Z_975 * (variance + (from_hold[1] - from_hold[0]).powi(2)).sqrt();
        out.time_constant_difference_s =
            Difference { value: Some(difference), interval_95_s: Some([difference - width, difference + width]) };
        if P == 4 {
            let estimate = |value: f64, variance: f64| {
                let error = variance.sqrt();
                Estimate {
                    value,
                    standard_error: Some(error),
                    interval_95: [value - Z_975 * error, value + Z_975 * error],
                }
            };
            let (gain, offset, level) = (theta[2], theta[3], self.readings.level());
            if !self.is_held(2) {
                out.free.gain = Some(estimate(gain, covariance[2][2]));
            }
            if !self.is_held(3) {
                // The costs have it at the level m of the readings: o(0 °C) = o − (g − 1) m.
                let at_zero = covariance[3][3] - 2.0 * level * covariance[2][3] + level * level * covariance[2][2];
                out.free.offset_k = Some(estimate(offset - (gain - 1.0) * level, at_zero));
            }
        }
    }

    /// A fit that leaves what was known beforehand far behind is worth a word.
    fn hold_against_knowledge(&mut self, theta: &[f64; P]) {
        for prior in &self.priors {
            let away = (theta[prior.index] - prior.mean) / prior.std;
            if away.abs() > FAR {
                self.warnings.push(format!(
                    "the record contradicts what was known of {}: it lies {:.1} standard deviations of that knowledge away",
                    Known::NAMES[prior.index],
                    away.abs()
                ));
            }
        }
    }

    /// What a record tells that does not tell both time constants.
    fn explain(
        &mut self,
        out: &mut Characterisation,
        best: &Fitted<'_>,
        found: Option<(usize, Ridge)>,
        is_rejected: bool,
    ) {
        let held: Vec<bool> = (0..P).map(|i| self.is_held(i)).collect();
        let is_free = |i: usize| !held[i];
        for i in 0..2 {
            if out.sensors[i].known {
                out.sensors[i].time_constant_s = Some(best.fit.x[i]);
            }
        }
        out.not_identifiable = (0..2).filter(|&i| is_free(i)).map(|i| Known::NAMES[i].to_owned()).collect();
        if !self.is_determined {
            self.warnings.push(
                "the whitened estimate finds nothing determined here; a number from this estimator would be chance"
                    .into(),
            );
            out.not_identifiable.push("time_constant_difference_s".into());
            return;
        }
        match &best.fit.end {
            End::OnBound(which) => {
                for &i in which {
                    let (variable, x) = (&self.variables[i], best.fit.x[i]);
                    let meaning = match (i < 2, x < (variable.lower * variable.upper).sqrt()) {
                        (true, true) => "the sensor seems faster than the sampling can show: sample faster",
                        (true, false) => "the record seems too short for so slow a sensor",
                        (false, _) => "the two channels do not belong together",
                    };
                    self.warnings.push(format!(
                        "the best fit lies on a bound of {}, {x:.3e}, and is no estimate: {meaning}",
                        variable.name
                    ));
                }
                out.not_identifiable.extend(which.iter().filter(|&&i| i >= 2).map(|&i| Known::NAMES[i].to_owned()));
            }
            End::Stalled(why) => self.warnings.push(format!("the optimiser stopped at no minimum: {why}")),
            End::LimitReached => self.warnings.push("the optimiser ran out of evaluations before it converged".into()),
            _ => self.warnings.push(
                "the record fits time constants that differ by large factors about equally well, or best such as are long \
                 beside the record itself: none is reported"
                    .into(),
            ),
        }
        let Some((index, ridge)) = found else {
            out.not_identifiable.push("time_constant_difference_s".into());
            self.warnings.push(
                "nothing about the time constants is determined, not even their difference: the sensors may be alike, or \
                 the gas may hardly have moved"
                    .into(),
            );
            return;
        };
        out.interval_method = IntervalMethod::Profile;
        let (value, [low, high]) = ridge.difference;
        out.time_constant_difference_s = Difference { value: Some(value), interval_95_s: Some([low, high]) };
        if low <= 0.0 && high >= 0.0 {
            out.not_identifiable.push("time_constant_difference_s".into());
            self.warnings
                .push("nothing about the time constants is determined, not even which sensor is the slower one".into());
            return;
        }
        let other = 1 - index;
        let [low, high] = ridge.other;
        // With a residual that is noise, a time constant that stays put whatever the other does is determined all the same.
        if !is_rejected && is_free(other) && low > 0.0 && (high / low).ln() < 2.0 * Z_975 * UNDETERMINED {
            let sensor = &mut out.sensors[other];
            sensor.time_constant_s = Some(best.fit.x[other]);
            sensor.interval_95_s = Some(ridge.other);
            out.not_identifiable.retain(|name| name != Known::NAMES[other]);
        } else {
            self.warnings.push(
                "the absolute time constants are not identifiable from this record; their difference is, over every \
                 time constant that the record allows"
                    .into(),
            );
        }
    }

    /// What to do about a rejected model.
    fn advise(&self, out: &mut Characterisation) {
        let failed: Vec<&str> =
            out.residual.tests.iter().filter(|t| t.p_value < REJECT).map(|t| t.test.as_str()).collect();
        if self.levels.given && failed == ["total-energy"] {
            let energy = out.residual.chi2_per_dof.unwrap_or(1.0);
            out.warnings.push(format!(
                "the residual is white, but its energy is {energy:.3} of what the given noise explains: the noise levels \
                 given are about {:.2} times what the record shows",
                energy.sqrt().recip()
            ));
            return;
        }
        let coarse: Vec<String> = (0..2)
            .filter_map(|i| Some((i, self.levels.coarse_step_k[i]?)))
            .map(|(i, step)| format!("{} is quantised in steps of {step:.3} K", self.record.channels[i]))
            .collect();
        let hint = if !coarse.is_empty() {
            format!("{}, coarser than its noise: that alone may be what is left", coarse.join(", "))
        } else if self.levels.energy_as_found.is_some() {
            "the samples are far apart for these sensors: sample faster".into()
        } else if self.levels.outliers != [0, 0] && failed.contains(&"total-energy") {
            "samples that no noise explains are among them (see below): mend or empty these cells first".into()
        } else if failed.contains(&"calibration") {
            "gain and offset of the second channel would explain it better: try --free gain,offset".into()
        } else if self.options.calibrates() {
            "an effect that two first-order lags lack is at work, or the noise is not white".into()
        } else {
            "try --free gain,offset first: thermometers rarely agree at rest; otherwise an effect that two first-order lags \
             lack is at work, or the noise is not white"
                .into()
        };
        out.warnings.push(format!(
            "two first-order lags do not explain this record (tests that fail: {}), and a time constant found with them \
             need not be that of a sensor; {hint}",
            failed.join(", ")
        ));
    }
}

fn hold_name(hold: Discretisation) -> &'static str {
    match hold {
        Discretisation::ZeroOrderHold => "zero-order-hold",
        Discretisation::FirstOrderHold => "first-order-hold",
        Discretisation::Bilinear => "bilinear",
        _ => "band-limited",
    }
}
