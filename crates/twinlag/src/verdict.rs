//! What is reported of a fit: status, intervals, and in place of a number that the record does not
//! determine, the reason.

use std::sync::atomic::{AtomicUsize, Ordering};

use twinlag_cross_relation::{Parameter, ResidualTest, ScoreVariance};
use twinlag_estimate::parts::{EstimatorCost, Intervals, Minimum, Objective, Ridge, ridge};
use twinlag_estimate::{
    Bootstrap, Estimate, EstimateError, Estimator, Hold, IntervalBasis, Intervals as Wanted, Known, NoiseColour,
    Outcome, Task, Z_975,
};
use twinlag_optimise::End;
use twinlag_sensor::Discretisation;

use crate::characterisation::{
    Characterisation, Difference, Estimate as Number, FreeParameters, IntervalMethod, MadeBy, RecordSummary, Residual,
    SecondLag, SensorEstimate, Status,
};
use crate::error::Error;
use crate::question::{Fitted, Question, REJECT, Watch};

/// A time constant whose logarithm has a larger standard error than this is not determined: its interval spans a factor of
/// seven.
const UNDETERMINED: f64 = 0.5;
/// Fits end at a time constant longer than this share of the record, and only known to [`LOOSE`], if
/// the record does not distinguish two lags from none.
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
        let mut vague = self.vague(&theta, covariance.as_ref());
        let mut intervals = None;
        if let (true, true, Some(c)) = (best.fit.end.is_usable(), vague.is_empty(), &covariance) {
            // What the standard error takes to be determined the profile may not.
            let found = self.intervals(best, theta, c);
            vague = (0..2).filter(|&i| is_free(i) && self.is_unbounded(i, found.interval_95_s[i])).collect();
            intervals = Some(found);
        }
        let on_bound = match &best.fit.end {
            End::OnBound(which) => which.clone(),
            _ => Vec::new(),
        };
        let answer = covariance.zip(intervals);
        let status = match &best.fit.end {
            End::OnBound(which) if which.iter().any(|&i| i >= 2) => Status::AtBound,
            End::OnBound(_) | End::Stalled(_) | End::LimitReached => Status::NotIdentifiable,
            _ if !self.is_determined || answer.is_none() || !vague.is_empty() => Status::NotIdentifiable,
            _ if is_rejected => Status::ModelRejected,
            _ => Status::Ok,
        };
        let mut out = self.skeleton(best, tests, status, hold_sensitivity);
        match status {
            Status::Ok | Status::ModelRejected => {
                let (c, mut intervals) = answer.expect("without a covariance the status is another");
                out.interval_method = if whitened_estimate && is_rejected {
                    IntervalMethod::ResidualSpectrum
                } else {
                    IntervalMethod::Information
                };
                if let Some(by_bootstrap) = self.bootstrap(best, theta, &c, is_rejected)? {
                    intervals = by_bootstrap;
                    out.interval_method = IntervalMethod::Bootstrap;
                }
                self.fill(&mut out, &theta, &c, &intervals, hold_sensitivity);
                self.fill_second_lags(&mut out, best, theta, &c);
                self.hold_against_knowledge(&theta);
            }
            _ => {
                let middle = if is_rejected { ScoreVariance::ResidualSpectrum } else { ScoreVariance::WhiteNoise };
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
        Ok(self.finish(out, is_rejected))
    }

    /// What an estimator in closed form found, in the whitened estimate's light.
    pub(crate) fn conclude_outcome(
        mut self,
        best: &Fitted<'a>,
        outcome: &Outcome,
        tests: Vec<ResidualTest>,
    ) -> Result<Characterisation, Error> {
        let is_rejected = self.rejected(&tests);
        let status = match outcome.interval_95_s {
            Some(_) if self.is_determined && is_rejected => Status::ModelRejected,
            Some(_) if self.is_determined => Status::Ok,
            _ => Status::NotIdentifiable,
        };
        let mut out = self.skeleton(best, tests, status, None);
        let (true, Some(standard_error_s), Some(interval_95_s)) =
            (status != Status::NotIdentifiable, outcome.standard_error_s, outcome.interval_95_s)
        else {
            self.explain(&mut out, best, None, is_rejected);
            return Ok(self.finish(out, is_rejected));
        };
        let mut found = Intervals { standard_error_s, interval_95_s, basis: outcome.interval_basis };
        out.interval_method = IntervalMethod::Information;
        let Outcome { tau_s, .. } = *outcome;
        if let Some(by_bootstrap) = self.bootstrap_of(best, outcome, standard_error_s, is_rejected)? {
            found = by_bootstrap;
            out.interval_method = IntervalMethod::Bootstrap;
        }
        for (i, sensor) in out.sensors.iter_mut().enumerate() {
            sensor.time_constant_s = Some(tau_s[i]);
            sensor.standard_error_s = Some(found.standard_error_s[i]);
            sensor.interval_95_s = Some(found.interval_95_s[i]);
            sensor.interval_basis = Some(found.basis[i]);
        }
        // How the two errors go together is not known, so the difference has no interval.
        out.time_constant_difference_s = Difference { value: Some(tau_s[1] - tau_s[0]), interval_95_s: None };
        Ok(self.finish(out, is_rejected))
    }

    /// Advice and warnings.
    fn finish(self, mut out: Characterisation, is_rejected: bool) -> Characterisation {
        if is_rejected {
            self.advise(&mut out);
        }
        for (channel, outliers) in self.record.channels.iter().zip(self.levels.outliers) {
            if outliers > 0 {
                out.warnings.push(format!(
                    "{channel}: {outliers} third differences are too large for noise and were left out of its \
                     level: spikes, \
                     dropouts or sharp steps of the gas"
                ));
            }
        }
        out.warnings.splice(0..0, self.warnings);
        out
    }

    /// Intervals of both time constants around the fit.
    fn intervals(&self, best: &Fitted<'a>, theta: [f64; P], covariance: &[[f64; P]; P]) -> Intervals {
        if self.options.estimator != Estimator::Whitened {
            return Intervals::quadratic(&theta, covariance);
        }
        self.minimum(best, theta, covariance, &self.free()).intervals(self.options.intervals == Wanted::Profile)
    }

    fn minimum<'m>(
        &'m self,
        best: &'m Fitted<'a>,
        theta: [f64; P],
        covariance: &'m [[f64; P]; P],
        free: &'m [usize],
    ) -> Minimum<'m, 'a, P> {
        Minimum {
            whitened: &best.whitened,
            theta,
            free,
            covariance,
            variables: &self.variables,
            priors: &self.priors,
            minimiser: &self.options.optimiser,
        }
    }

    /// Intervals by the bootstrap, where it was asked for and says anything.
    fn bootstrap(
        &mut self,
        best: &Fitted<'a>,
        theta: [f64; P],
        covariance: &[[f64; P]; P],
        is_rejected: bool,
    ) -> Result<Option<Intervals>, Error> {
        let second = |i: usize| theta.get(i).copied().filter(|t| *t > 0.0);
        let outcome = Outcome {
            tau_s: [theta[0], theta[1]],
            second_tau_s: [second(4), second(5)],
            standard_error_s: None,
            interval_95_s: None,
            interval_basis: [IntervalBasis::StandardError; 2],
            noise_std_k: Some(self.levels.std_k),
            noise_ar1: self.levels.ar1,
            end: best.fit.end.clone(),
            evaluations: best.fit.evaluations,
        };
        self.bootstrap_of(best, &outcome, [0, 1].map(|i| covariance[i][i].sqrt()), is_rejected)
    }

    fn bootstrap_of(
        &mut self,
        best: &Fitted<'a>,
        outcome: &Outcome,
        standard_error_s: [f64; 2],
        is_rejected: bool,
    ) -> Result<Option<Intervals>, Error> {
        let Wanted::Bootstrap(bootstrap) = self.options.intervals else { return Ok(None) };
        if is_rejected {
            self.warnings.push(
                "the bootstrap simulates records with the model, which this record contradicts, so it was not \
                 used for the intervals"
                    .into(),
            );
            return Ok(None);
        }
        let task = self.task(best.whitened.hold(), self.noise_knowledge());
        let watched =
            Watched { estimator: self.options.estimator, done: AtomicUsize::new(0), bootstrap, watch: self.watch };
        let Some(interval_95_s) = bootstrap.intervals(&watched, &task, outcome)? else {
            self.warnings.push(
                "more than a tenth of the simulated records have no answer, so the bootstrap gives no \
                 intervals; these are from standard errors"
                    .into(),
            );
            return Ok(None);
        };
        Ok(Some(Intervals { standard_error_s, interval_95_s, basis: [IntervalBasis::Bootstrap; 2] }))
    }

    /// The free time constants that the record does not determine, given their covariance if there is one.
    pub(crate) fn vague(&self, theta: &[f64; P], covariance: Option<&[[f64; P]; P]>) -> Vec<usize> {
        (0..2).filter(|&i| !self.is_held(i) && self.is_vague(i, theta, covariance)).collect()
    }

    /// Whether an interval runs to a bound of its time constant, or spans more than one of [`UNDETERMINED`] does.
    fn is_unbounded(&self, i: usize, [low, high]: [f64; 2]) -> bool {
        let variable = &self.variables[i];
        low <= variable.lower || high >= variable.upper || (high / low).ln() > 2.0 * Z_975 * UNDETERMINED
    }

    fn is_vague(&self, i: usize, theta: &[f64; P], covariance: Option<&[[f64; P]; P]>) -> bool {
        let longest_s = LONGEST_SHARE * self.readings.span_s();
        covariance.is_none_or(|c| {
            let log_error = c[i][i].sqrt() / theta[i];
            log_error > UNDETERMINED || (log_error > LOOSE && theta[i] > longest_s)
        })
    }

    /// What the record determines along time constant `index`, whatever the gas does between
    /// samples: where the model leaves more than noise, neither hold can be preferred.
    fn ridge(&self, best: &Fitted<'a>, index: usize, middle: ScoreVariance) -> Result<Option<Ridge>, Error> {
        let along = |fitted: &Fitted<'a>| -> Result<Option<Ridge>, EstimateError> {
            let cost = EstimatorCost::Whitened(fitted.whitened.clone());
            let objective = Objective::<P> { cost: &cost, priors: &self.priors };
            ridge::<P>(
                &objective,
                &fitted.whitened,
                &self.variables,
                &fitted.fit.x,
                index,
                middle,
                &self.options.optimiser,
            )
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
        let is_coloured = self.options.noise_colour == NoiseColour::Autoregressive;
        let second = |i: usize| {
            let known = self.options.known(Parameter::ALL[4 + i]).filter(|k| k.std.is_none()).map(|k| k.value);
            let lag = SecondLag { value: known, standard_error: None, interval_95: None, known: known.is_some() };
            self.options.has_second_lag()[i].then_some(lag)
        };
        let sensor = |i: usize| SensorEstimate {
            channel: self.record.channels[i].clone(),
            time_constant_s: None,
            standard_error_s: None,
            interval_95_s: None,
            interval_basis: None,
            second_time_constant_s: second(i),
            noise_std_k: self.levels.std_k[i],
            noise_standard_error_k: self.levels.standard_error_k()[i],
            noise_ar1: is_coloured.then_some(self.levels.ar1[i]),
            noise_from: self.levels.source[i],
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
        intervals: &Intervals,
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
            sensor.standard_error_s = Some(noise.hypot(from_hold[i]));
            // Both ends, in logarithms, as so many standard errors of noise: the hold's joins each.
            let widened = intervals.interval_95_s[i].map(|end| {
                let log = (end / theta[i]).ln();
                theta[i] * log.hypot(Z_975 * from_hold[i] / theta[i]).copysign(log).exp()
            });
            sensor.interval_95_s = Some(widened);
            sensor.interval_basis = Some(intervals.basis[i]);
            if from_hold[i].abs() > NOTICEABLE * noise {
                self.warnings.push(format!(
                    "{}: the assumption about the gas between samples changes the time constant by {:.2} %, \
                     which is part of the interval; sample faster",
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
        if P > 2 {
            let estimate = |value: f64, variance: f64| {
                let error = variance.sqrt();
                Number {
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

    /// Second lags: as found, or how large they may be.
    fn fill_second_lags(
        &mut self,
        out: &mut Characterisation,
        best: &Fitted<'a>,
        theta: [f64; P],
        covariance: &[[f64; P]; P],
    ) {
        for sensor in 0..2 {
            let (i, name) = (4 + sensor, Known::NAMES[4 + sensor]);
            let Some(mut lag) = out.sensors[sensor].second_time_constant_s.filter(|lag| !lag.known) else { continue };
            let channel = out.sensors[sensor].channel.clone();
            if let Some(unseen) = self.unseen[sensor] {
                out.not_identifiable.push(name.into());
                let allowed = match unseen.at_most_s {
                    Some(limit_s) => {
                        lag.interval_95 = Some([0.0, limit_s]);
                        format!("the record allows at most {limit_s:.3e} s")
                    }
                    None => "as far as the record shows, it may be as large as the first one".into(),
                };
                self.warnings.push(format!(
                    "{channel}: no second lag is detected; {allowed}. The time constants are those without \
                     it, and their intervals cover any second lag that is allowed; leave {} out of \
                     --second-order, or give --known \
                     {name}=...",
                    ["T1", "T2"][sensor]
                ));
            } else if self.is_vague(i, &theta, Some(covariance)) {
                out.not_identifiable.push(name.into());
                if self.options.estimator == Estimator::Whitened {
                    let free = self.free();
                    lag.interval_95 = Some(self.minimum(best, theta, covariance, &free).interval(i, true).0);
                }
                self.warnings.push(format!(
                    "{channel}: the record needs a second lag but does not determine its size; a data-sheet \
                     value may help, as \
                     --known {name}=..."
                ));
            } else {
                let error = covariance[i][i].sqrt();
                let factor = (Z_975 * error / theta[i]).exp();
                lag.value = Some(theta[i]);
                lag.standard_error = Some(error);
                lag.interval_95 = Some(if self.options.estimator == Estimator::Whitened {
                    let free = self.free();
                    let always = self.options.intervals == Wanted::Profile;
                    self.minimum(best, theta, covariance, &free).interval(i, always).0
                } else {
                    [theta[i] / factor, theta[i] * factor]
                });
            }
            out.sensors[sensor].second_time_constant_s = Some(lag);
        }
        for unseen in self.unseen.iter().flatten() {
            widen(out, &theta, &unseen.moves);
        }
    }

    /// A fit that leaves what was known beforehand far behind is worth a word.
    fn hold_against_knowledge(&mut self, theta: &[f64; P]) {
        for prior in &self.priors {
            let away = (theta[prior.index] - prior.mean) / prior.std;
            if away.abs() > FAR {
                self.warnings.push(format!(
                    "the record contradicts the known value of {}: the estimate lies {:.1} of its standard \
                     deviations away",
                    Known::NAMES[prior.index],
                    away.abs()
                ));
            }
        }
    }

    /// Explains what a record determines if it does not determine both time constants.
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
        let asked = [4, 5].map(|i| i < P && (is_free(i) || self.unseen[i - 4].is_some()));
        let unknown = |i: usize| if i < 4 { i < 2 && is_free(i) } else { asked[i - 4] };
        out.not_identifiable =
            (0..Known::NAMES.len()).filter(|&i| unknown(i)).map(|i| Known::NAMES[i].to_owned()).collect();
        if !self.is_determined {
            self.warnings.push(
                "the whitened estimate finds that this record determines nothing; a number from this \
                 estimator would be due to chance"
                    .into(),
            );
            out.not_identifiable.push("time_constant_difference_s".into());
            return;
        }
        match &best.fit.end {
            End::OnBound(which) => {
                for &i in which {
                    let (variable, x) = (&self.variables[i], best.fit.x[i]);
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
            End::Stalled(why) if self.options.estimator.is_closed_form() => {
                self.warnings.push(format!("{why}: there may be too much noise for this estimator"));
            }
            End::Stalled(why) => self.warnings.push(format!(
                "the optimiser stopped at a point that is not a \
                minimum: {why}"
            )),
            End::LimitReached => self.warnings.push(
                "the optimiser ran out of evaluations before it \
                converged"
                    .into(),
            ),
            _ => self.warnings.push(
                "time constants that differ by large factors fit the record about equally well, or the best \
                 ones are long compared with the record, so none is reported"
                    .into(),
            ),
        }
        let Some((index, ridge)) = found else {
            out.not_identifiable.push("time_constant_difference_s".into());
            if !self.options.estimator.is_closed_form() {
                self.warnings.push(
                    "nothing about the time constants is determined, not even their difference: the sensors \
                     may be alike, \
                     or the gas may hardly have moved"
                        .into(),
                );
            }
            return;
        };
        out.interval_method = IntervalMethod::Profile;
        let (value, [low, high]) = ridge.difference;
        out.time_constant_difference_s = Difference { value: Some(value), interval_95_s: Some([low, high]) };
        if low <= 0.0 && high >= 0.0 {
            out.not_identifiable.push("time_constant_difference_s".into());
            self.warnings.push(
                "nothing about the time constants is determined, not even which sensor is the slower \
                    one"
                .into(),
            );
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
                "this record does not determine the time constants themselves; it determines their \
                 difference, over every time constant that it allows"
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
            let (noise, levels) = if self.options.noise_std_k.is_some() {
                ("the given noise", "the noise levels given")
            } else {
                ("the noise of the quiet segment", "the gas temperature seems not to be steady there: the levels")
            };
            out.warnings.push(format!(
                "the residual is white, but its energy is {energy:.3} of what {noise} explains: {levels} are \
                 about {:.2} \
                 times what the record shows",
                energy.sqrt().recip()
            ));
            return;
        }
        if self.whitened_is_accepted {
            out.warnings.push(format!(
                "with this estimate the residual is not noise (tests that fail: {}), but with the whitened \
                 one it is, so the estimator is at fault and not the model",
                failed.join(", ")
            ));
            return;
        }
        let coarse: Vec<String> = (0..2)
            .filter_map(|i| Some((i, self.levels.coarse_step_k[i]?)))
            .map(|(i, step)| format!("{} is quantised in steps of {step:.3} K", self.record.channels[i]))
            .collect();
        let is_white_assumed = self.options.noise_colour == NoiseColour::White && self.options.noise_std_k.is_none();
        let may_be_coloured =
            failed.contains(&"whiteness") && is_white_assumed && self.readings.even_period_s().is_some();
        let colour = if may_be_coloured {
            "the noise is not white: try --noise-colour autoregressive"
        } else {
            "the noise is not of the kind assumed"
        };
        let model = if self.unseen == [None; 2] && self.options.has_second_lag() != [false; 2] {
            "lags of this order"
        } else {
            "two first-order lags"
        };
        let hint = if !coarse.is_empty() {
            format!("{}, coarser than its noise, which alone may explain the residual", coarse.join(", "))
        } else if self.levels.energy_as_found.is_some() {
            "the samples are far apart for these sensors: sample faster".into()
        } else if self.levels.outliers != [0, 0] && failed.contains(&"total-energy") {
            "some samples are too far off for noise (see below): correct or empty these cells first".into()
        } else if failed.contains(&"calibration") {
            let colour = if may_be_coloured {
                ", and if it does not help --noise-colour \
                autoregressive"
            } else {
                ""
            };
            format!("gain and offset of the second channel would explain it better: try --free gain,offset{colour}")
        } else if self.options.calibrates() {
            format!("an effect that {model} lack is at work, or {colour}")
        } else {
            format!(
                "try --free gain,offset first: thermometers rarely agree at rest; otherwise an effect that \
                 {model} lack is at \
                 work, or {colour}"
            )
        };
        out.warnings.push(format!(
            "{model} do not explain this record (tests that fail: {}), so the fitted time constants need not \
             be those of the sensors; {hint}",
            failed.join(", ")
        ));
    }
}

/// Widens intervals to what they would be around the parameters that each of `moves` makes of `here`, too.
fn widen<const P: usize>(out: &mut Characterisation, here: &[f64; P], moves: &[f64; P]) {
    for (i, sensor) in out.sensors.iter_mut().enumerate() {
        let union = |[low, high]: [f64; 2], factor: f64| [low.min(low * factor), high.max(high * factor)];
        if let Some(interval) = &mut sensor.interval_95_s {
            let wider = union(*interval, moves[i]);
            if wider != *interval {
                (*interval, sensor.interval_basis) = (wider, Some(IntervalBasis::Profile));
            }
        }
        if let Some(SecondLag { value: Some(_), interval_95: Some(interval), .. }) = &mut sensor.second_time_constant_s
        {
            *interval = union(*interval, moves[4 + i]);
        }
    }
    let moved = (moves[1] - 1.0) * here[1] - (moves[0] - 1.0) * here[0];
    if let Some([low, high]) = &mut out.time_constant_difference_s.interval_95_s {
        (*low, *high) = (low.min(*low + moved), high.max(*high + moved));
    }
}

/// An estimator that counts what it is asked.
struct Watched<'a> {
    estimator: Estimator,
    done: AtomicUsize,
    bootstrap: Bootstrap,
    watch: Watch<'a>,
}

impl Estimate for Watched<'_> {
    fn name(&self) -> String {
        Estimate::name(&self.estimator)
    }

    fn source(&self) -> &'static str {
        self.estimator.source()
    }

    fn assumes(&self) -> &'static str {
        self.estimator.assumes()
    }

    fn estimate(&self, task: &Task<'_>) -> Result<Outcome, EstimateError> {
        let outcome = self.estimator.estimate(task);
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.watch)(done, self.bootstrap.replicates);
        outcome
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
