//! From a record to both time constants: noise levels, starts, fit, intervals, residual, verdict.

use twinlag_bias::{Compensated, Noise, Normalised, estimate_noise, plain_covariance};
use twinlag_cross_relation::{
    CrossRelation, Middle, Parameter, Readings, ResidualTest, Segment, Steps, Whitened, residual_tests,
};
use twinlag_optimise::{Budget, End, Fit, MultiStart, Problem, Variable};
use twinlag_record::{Record, SamplingKind};
use twinlag_sensor::Discretisation;

use crate::characterisation::{
    Characterisation, Difference, Estimate, FreeParameters, IntervalMethod, MadeBy, RecordSummary, Residual,
    SensorEstimate, Status,
};
use crate::error::Error;
use crate::objective::{EstimatorCost, Objective, Prior};
use crate::options::{Estimator, Hold, Known, Options};
use crate::profile::{Ridge, Z_975, ridge};
use crate::starts::starts;

/// A residual test below this p-value rejects the model: three tests, so one false alarm in a thousand records.
const REJECT: f64 = 1e-3 / 3.0;
/// A time constant whose logarithm has a larger standard error than this is not determined: its interval spans a factor of
/// seven.
const UNDETERMINED: f64 = 0.5;
/// A time constant longer than this share of the longest unbroken stretch is where fits run to when the record does not tell
/// two lags from none: the gas would have to be known to move at periods longer than the record.
const LONGEST_SHARE: f64 = 1.0 / 3.0;
/// The other hold must lower the sum of squares by this many times the residual's energy per degree of freedom.
const CLEARLY_BETTER: f64 = 10.0;
/// Share of a standard error that the choice of hold may cost without a word.
const NOTICEABLE: f64 = 0.5;

/// Both time constants of `record`, with intervals, noise levels and residual tests.
///
/// # Errors
/// [`Error`] if the question cannot be put: options that contradict each other, an estimator that cannot take the record's
/// sampling, too few samples to tell noise from signal. A fit that ran is never an error: its [`Status`] says what it is
/// worth.
pub fn characterise(record: &Record, options: &Options) -> Result<Characterisation, Error> {
    check(options)?;
    let readings = readings(record)?;
    let levels = Levels::of(&readings, options)?;
    if options.calibrates() {
        Question::<4>::new(record, &readings, options, levels).answer()
    } else {
        Question::<2>::new(record, &readings, options, levels).answer()
    }
}

/// The channels of a record, cut where samples are missing.
///
/// # Errors
/// [`Error::Cost`] for a record without usable samples, which its constructors do not let through.
pub fn readings(record: &Record) -> Result<Readings, Error> {
    let segments = record.segments.iter().map(|rows| {
        let steps = match record.sampling.kind {
            SamplingKind::Irregular => Steps::Uneven(record.steps_s(rows)),
            _ => Steps::Even(record.sampling.period_s),
        };
        Segment::new(record.t1_c[rows.clone()].to_vec(), record.t2_c[rows.clone()].to_vec(), steps)
    });
    Ok(Readings::new(segments.collect::<Result<_, _>>()?)?)
}

fn check(options: &Options) -> Result<(), Error> {
    if options.estimator != Estimator::Whitened && options.known.iter().any(|k| k.std.is_some()) {
        return Err(Error::WhitenedOnly {
            what: "a known value with an uncertainty (--known NAME=VALUE+-SD)",
            estimator: options.estimator.name().into(),
        });
    }
    if options.known(Parameter::Offset).is_some() && options.free_gain {
        return Err(Error::Option {
            option: "--known",
            expected: "no known offset beside a free gain: the two are one straight line".into(),
            got: "T2.offset_K".into(),
        });
    }
    if let Some([a, b]) = options.noise_std_k
        && !(a.is_finite() && b.is_finite() && a > 0.0 && b > 0.0)
    {
        return Err(Error::Option {
            option: "--noise",
            expected: "two positive numbers, S1,S2 in K".into(),
            got: format!("{a},{b}"),
        });
    }
    Ok(())
}

/// Noise levels and how well they are known.
#[derive(Clone, Copy, Debug)]
struct Levels {
    std_k: [f64; 2],
    given: bool,
    /// Relative standard deviation of the variances: 0 if given.
    uncertainty: f64,
}

impl Levels {
    fn of(readings: &Readings, options: &Options) -> Result<Self, Error> {
        if let Some(std_k) = options.noise_std_k {
            return Ok(Self { std_k, given: true, uncertainty: 0.0 });
        }
        let found = estimate_noise(readings)?;
        let uncertainty = found.iter().map(|l| 2.0 * l.standard_error_k / l.std_k).fold(0.0, f64::max);
        // A channel without any noise at all: a hundred-thousandth of its swing stands in, far below any converter's step.
        let swing =
            readings.segments().iter().flat_map(|s| s.y1().iter().chain(s.y2())).fold(0.0_f64, |m, y| m.max(y.abs()));
        Ok(Self { std_k: found.map(|l| l.std_k.max(1e-5 * swing)), given: false, uncertainty })
    }
}

/// Where a fit of the whitened cost ended.
struct Fitted<'a> {
    whitened: Whitened<'a>,
    fit: Fit,
    starts: usize,
}

/// One record with one set of options, `P` parameters.
struct Question<'a, const P: usize> {
    record: &'a Record,
    readings: &'a Readings,
    options: &'a Options,
    levels: Levels,
    variables: Vec<Variable>,
    priors: Vec<Prior>,
    warnings: Vec<String>,
}

impl<'a, const P: usize> Question<'a, P> {
    fn new(record: &'a Record, readings: &'a Readings, options: &'a Options, levels: Levels) -> Self {
        let (step_s, span_s) = (readings.mean_step_s(), readings.longest_span_s());
        let swing =
            readings.segments().iter().flat_map(|s| s.y1().iter().chain(s.y2())).fold(0.0_f64, |m, y| m.max(y.abs()));
        let mean = readings.common_mean();
        let mut priors = Vec::new();
        let variables = (0..P).map(|i| {
            let parameter = Parameter::ALL[i];
            let name = Known::NAMES[i];
            let variable = match parameter {
                Parameter::Tau1 | Parameter::Tau2 => Variable::logarithmic(name, 0.2 * step_s, 10.0 * span_s),
                Parameter::Gain if options.free_gain => Variable::linear(name, 0.01, 0.2, 5.0),
                Parameter::Gain => Variable::linear(name, 0.01, 1.0, 1.0),
                Parameter::Offset => {
                    let variable = Variable::linear(name, levels.std_k[1], -10.0 * swing, 10.0 * swing);
                    // Held at 0 °C, where it is stated; the costs take it at the mean.
                    let gain = options.known(Parameter::Gain).map_or(1.0, |k| k.value);
                    if options.free_offset { variable } else { variable.held_at((gain - 1.0) * mean) }
                }
            };
            let Some(known) = options.known(parameter) else { return variable };
            let value = match parameter {
                Parameter::Offset => {
                    known.value + (options.known(Parameter::Gain).map_or(1.0, |k| k.value) - 1.0) * mean
                }
                _ => known.value,
            };
            match known.std {
                None => variable.held_at(value),
                Some(std) => {
                    priors.push(Prior { index: i, mean: value, std });
                    Variable {
                        lower: variable.lower.min(0.1 * value),
                        upper: variable.upper.max(10.0 * value),
                        ..variable
                    }
                }
            }
        });
        let variables = variables.collect();
        Self { record, readings, options, levels, variables, priors, warnings: Vec::new() }
    }

    fn free(&self) -> Vec<usize> {
        (0..P).filter(|&i| self.variables[i].lower < self.variables[i].upper).collect()
    }

    fn prior_std(&self) -> [f64; P] {
        let mut out = [f64::INFINITY; P];
        self.priors.iter().for_each(|p| out[p.index] = p.std);
        out
    }

    fn answer(mut self) -> Result<Characterisation, Error> {
        let mut best = self.fit_whitened(self.options.hold.first(), None)?;
        let mut energy = self.energy(&best);
        if !self.priors.is_empty() && energy > 1.5 {
            // What is known beforehand must weigh against the residual that there is, not against sensor noise alone.
            let louder = self.levels.std_k.map(|s| s * energy.sqrt());
            best = self.fit_whitened_with(self.options.hold.first(), louder, None)?;
            self.warnings.push(format!(
                "the residual has {energy:.3} times the energy that sensor noise explains; the known values were weighed \
                 against the residual"
            ));
        }
        let hold_sensitivity = self.try_other_hold(&mut best)?;
        let theta: [f64; P] = std::array::from_fn(|i| best.fit.x[i]);
        energy = self.energy(&best);
        let expected_spread = (2.0 / best.whitened.terms() as f64 + self.levels.uncertainty.powi(2)).sqrt();
        if !self.levels.given && energy < 1.0 - 4.0 * expected_spread {
            // Only the ratio matters to the fit; a signal that moves between samples makes third differences too large.
            let quieter = best.whitened.noise_std().map(|s| s * energy.sqrt());
            best.whitened = best.whitened.with_noise(quieter)?;
            self.levels.std_k = quieter;
            self.warnings.push(
                "the signal moves between samples as noise would: the noise levels are scaled to the residual, and their \
                 ratio is a guess; give --noise S1,S2 if you know them"
                    .into(),
            );
        }
        if self.options.estimator == Estimator::Whitened {
            let tests = self.tests(&best, &theta);
            let middle =
                if rejected(&tests, self.levels.given) { Middle::ResidualSpectrum } else { Middle::WhiteNoise };
            let covariance = best.whitened.covariance(&theta, &self.free(), &self.prior_std(), middle);
            return self.conclude(best, theta, covariance, tests, hold_sensitivity);
        }
        self.answer_published(best)
    }

    /// The estimators built on the published cost, started from the whitened fit.
    fn answer_published(mut self, mut whitened: Fitted<'a>) -> Result<Characterisation, Error> {
        let std_k = self.levels.std_k;
        let longest = self.readings.segments().iter().map(Segment::len).max().unwrap_or(0);
        let settled = (5.0 * whitened.fit.x[0].max(whitened.fit.x[1]) / self.readings.mean_step_s()).ceil() as usize;
        let discard = self.options.discard.unwrap_or(settled.min(longest / 2));
        if discard >= longest {
            return Err(Error::DiscardsAll { discard, longest });
        }
        let published = CrossRelation::new(self.readings, discard)?;
        let noise = || -> Result<[Noise; 2], Error> { Ok([Noise::white(std_k[0])?, Noise::white(std_k[1])?]) };
        let cost = match self.options.estimator {
            Estimator::BiasCompensated => EstimatorCost::Compensated(Compensated::new(published, noise()?)),
            Estimator::Normalised => EstimatorCost::Normalised(Normalised::new(published, noise()?)),
            _ => {
                self.warnings.push(
                    "the plain cross-relation cost is biased to long time constants by noise; its intervals say how the \
                     estimate scatters, not how far it is off"
                        .into(),
                );
                EstimatorCost::CrossRelation(published)
            }
        };
        // These costs have lower minima far out, where the filters' unknown initial state still shows after what was
        // discarded. Of several minima the one next to a consistent estimate is the one that is consistent itself.
        let mut all = self.minimise_from(&cost, std::slice::from_ref(&whitened.fit.x))?;
        if !all.best().end.is_usable() {
            all = self.minimise(&cost)?;
        }
        whitened.fit = all.best().clone();
        whitened.starts = all.fits().len();
        let theta: [f64; P] = std::array::from_fn(|i| whitened.fit.x[i]);
        let free = self.free();
        let covariance = match &cost {
            EstimatorCost::Compensated(c) => c.covariance(&theta, &free, std_k),
            EstimatorCost::Normalised(c) => c.covariance(&theta, &free, std_k),
            EstimatorCost::CrossRelation(c) => plain_covariance(c, &theta, &free, std_k),
            EstimatorCost::Whitened(_) => None,
        };
        let tests = self.tests(&whitened, &theta);
        self.warnings.push(format!("the first {discard} samples of each unbroken stretch were discarded"));
        self.conclude(whitened, theta, covariance, tests, None)
    }

    fn fit_whitened(&self, hold: Discretisation, from: Option<&[f64]>) -> Result<Fitted<'a>, Error> {
        self.fit_whitened_with(hold, self.levels.std_k, from)
    }

    fn fit_whitened_with(
        &self,
        hold: Discretisation,
        noise_std: [f64; 2],
        from: Option<&[f64]>,
    ) -> Result<Fitted<'a>, Error> {
        let cost = EstimatorCost::Whitened(Whitened::new(self.readings, hold, noise_std)?);
        let all = match from {
            // Close to where another hold ended: no need to search again.
            Some(x) => self.minimise_from(&cost, &[x.to_vec()])?,
            None => self.minimise(&cost)?,
        };
        let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
        Ok(Fitted { whitened, fit: all.best().clone(), starts: all.fits().len() })
    }

    fn minimise(&self, cost: &EstimatorCost<'a>) -> Result<MultiStart, Error> {
        let objective = Objective::<P> { cost, priors: &self.priors };
        self.minimise_from(cost, &starts(&objective, self.readings, &self.variables))
    }

    fn minimise_from(&self, cost: &EstimatorCost<'a>, from: &[Vec<f64>]) -> Result<MultiStart, Error> {
        let objective = Objective::<P> { cost, priors: &self.priors };
        let problem = Problem::new(&objective, self.variables.clone())?;
        Ok(MultiStart::run(&problem, &self.options.optimiser, from, &Budget::default())?)
    }

    /// Sum of squares over degrees of freedom, priors left out, in units of the levels that the question started with.
    fn energy(&self, fitted: &Fitted<'_>) -> f64 {
        let theta: [f64; P] = std::array::from_fn(|i| fitted.fit.x[i]);
        let assumed = fitted.whitened.noise_std()[0] / self.levels.std_k[0];
        let dof = fitted.whitened.terms().saturating_sub(self.free().len()).max(1);
        fitted.whitened.evaluate(&theta).value * assumed * assumed / dof as f64
    }

    /// Fits with the other hold too; takes it if it may and the record is clearly better explained. Returns how far the time
    /// constants move.
    fn try_other_hold(&mut self, best: &mut Fitted<'a>) -> Result<Option<[f64; 2]>, Error> {
        if self.options.estimator != Estimator::Whitened || self.readings.even_period_s().is_none() {
            return Ok(None);
        }
        let other = match self.options.hold {
            Hold::FirstOrderHold => Discretisation::ZeroOrderHold,
            _ => Discretisation::FirstOrderHold,
        };
        let fitted = self.fit_whitened_with(other, best.whitened.noise_std(), Some(&best.fit.x))?;
        let moved = [0, 1].map(|i| fitted.fit.x[i] / best.fit.x[i] - 1.0);
        let usable = fitted.fit.end.is_usable() && best.fit.end.is_usable();
        let needed = CLEARLY_BETTER * self.energy(best).max(1.0);
        if self.options.hold == Hold::Auto && fitted.fit.end.is_usable() && fitted.fit.value + needed < best.fit.value {
            self.warnings.push(
                "straight lines between samples explain the record clearly better than steps: the first-order hold was used"
                    .into(),
            );
            *best = Fitted { starts: best.starts, ..fitted };
        }
        Ok(usable.then_some(moved))
    }

    fn tests(&self, fitted: &Fitted<'_>, theta: &[f64; P]) -> Vec<ResidualTest> {
        // Levels that were rescaled for the priors' sake are not what the record is tested against.
        let scale = fitted.whitened.noise_std()[0] / self.levels.std_k[0];
        let residual: Vec<Vec<f64>> = fitted
            .whitened
            .residual(theta)
            .into_iter()
            .map(|segment| segment.into_iter().map(|r| r * scale).collect())
            .collect();
        residual_tests(&residual, self.free().len(), self.levels.uncertainty)
    }

    fn conclude(
        mut self,
        best: Fitted<'a>,
        theta: [f64; P],
        covariance: Option<[[f64; P]; P]>,
        tests: Vec<ResidualTest>,
        hold_sensitivity: Option<[f64; 2]>,
    ) -> Result<Characterisation, Error> {
        let is_rejected = rejected(&tests, self.levels.given);
        let whitened_estimate = self.options.estimator == Estimator::Whitened;
        let log_error = |i: usize, c: &[[f64; P]; P]| c[i][i].sqrt() / theta[i];
        let is_free = |i: usize| self.variables[i].lower < self.variables[i].upper;
        let longest_s = LONGEST_SHARE * self.readings.longest_span_s();
        let is_vague = |i: usize| match &covariance {
            Some(c) => log_error(i, c) > UNDETERMINED || theta[i] > longest_s,
            None => true,
        };
        let vague: Vec<usize> = (0..2).filter(|&i| is_free(i) && is_vague(i)).collect();
        let on_bound = match &best.fit.end {
            End::OnBound(which) => which.clone(),
            _ => Vec::new(),
        };
        let status = match &best.fit.end {
            End::OnBound(which) if which.iter().any(|&i| i >= 2) => Status::AtBound,
            End::OnBound(_) | End::Stalled(_) | End::LimitReached => Status::NotIdentifiable,
            _ if !vague.is_empty() => Status::NotIdentifiable,
            _ if is_rejected => Status::ModelRejected,
            _ => Status::Ok,
        };
        let mut out = self.skeleton(&best, tests, is_rejected, status, hold_sensitivity);
        match status {
            Status::Ok | Status::ModelRejected => {
                let c = covariance.expect("without a covariance both time constants are vague");
                self.fill(&mut out, &theta, &c, hold_sensitivity);
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
                    Some(index) if whitened_estimate => self.ridge(&best, index, middle)?.map(|r| (index, r)),
                    _ => None,
                };
                self.explain(&mut out, &best, found, is_rejected);
                if found.is_none() && matches!(best.fit.end, End::OnBound(_)) {
                    out.status = Status::AtBound;
                }
            }
        }
        if is_rejected {
            self.advise(&mut out);
        }
        out.warnings.splice(0..0, self.warnings);
        Ok(out)
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
        is_rejected: bool,
        status: Status,
        hold_sensitivity: Option<[f64; 2]>,
    ) -> Characterisation {
        let sensor = |i: usize| SensorEstimate {
            channel: self.record.channels[i].clone(),
            time_constant_s: None,
            standard_error_s: None,
            interval_95_s: None,
            noise_std_k: self.levels.std_k[i],
            known: self.variables[i].lower == self.variables[i].upper,
        };
        let chi2_per_dof = tests.iter().find(|t| t.test == "total-energy").map(|t| t.statistic);
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
                white: tests.iter().all(|t| t.test != "whiteness" || t.p_value >= REJECT) && !is_rejected,
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
            let (gain, offset, mean) = (theta[2], theta[3], self.readings.common_mean());
            if self.options.free_gain {
                out.free.gain = Some(estimate(gain, covariance[2][2]));
            }
            if self.options.free_offset {
                // The costs have it at the mean of the record: o(0 °C) = o − (g − 1) m.
                let at_zero = covariance[3][3] - 2.0 * mean * covariance[2][3] + mean * mean * covariance[2][2];
                out.free.offset_k = Some(estimate(offset - (gain - 1.0) * mean, at_zero));
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
        let is_free = |i: usize| self.variables[i].lower < self.variables[i].upper;
        for i in 0..2 {
            if out.sensors[i].known {
                out.sensors[i].time_constant_s = Some(best.fit.x[i]);
            }
        }
        out.not_identifiable = (0..2).filter(|&i| is_free(i)).map(|i| Known::NAMES[i].to_owned()).collect();
        match &best.fit.end {
            End::OnBound(which) => {
                let names: Vec<_> = which.iter().map(|&i| self.variables[i].name.as_str()).collect();
                self.warnings.push(format!(
                    "the best fit lies on a bound of {}: its point is no estimate and is not reported as one",
                    names.join(", ")
                ));
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
            self.warnings.push("not even the difference of the time constants is determined".into());
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
        let hint = if self.options.calibrates() {
            "an effect that two first-order lags lack is at work, or the noise is not what was assumed"
        } else {
            "try --free gain,offset first: thermometers rarely agree at rest; otherwise an effect that two first-order lags \
             lack is at work, or the noise is not what was assumed"
        };
        out.warnings.push(format!(
            "the residual is not noise (energy {:.3} times what noise explains): two first-order lags do not explain this \
             record, and a time constant found with them need not be that of a sensor; {hint}",
            out.residual.chi2_per_dof.unwrap_or(0.0)
        ));
    }
}

/// Whether the tests reject the model. Where the levels are from the data, too little energy is no objection.
fn rejected(tests: &[ResidualTest], given: bool) -> bool {
    tests.iter().any(|t| t.p_value < REJECT && (given || t.test != "total-energy" || t.statistic > 1.0))
}

fn hold_name(hold: Discretisation) -> &'static str {
    match hold {
        Discretisation::ZeroOrderHold => "zero-order-hold",
        Discretisation::FirstOrderHold => "first-order-hold",
        Discretisation::Bilinear => "bilinear",
        _ => "band-limited",
    }
}
