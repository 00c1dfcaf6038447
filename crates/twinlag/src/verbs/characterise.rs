//! The question that a record is asked first: both time constants.
//!
//! [`characterise`] puts the question to an estimator of `twinlag-estimate` and judges the answer. The steps, and why in this
//! order, are in `answer`.

mod bootstrap;
mod conclude;
mod contradiction;
mod excerpt;
mod explain;
mod fill;
mod judge;
mod unseen;

use twinlag_cross_relation::{CostError, Parameter, Readings, ResidualTest, ScoreVariance, Segment, Steps};
use twinlag_diagnose::{Grade, Policy, Reason, Remark, is_single_tone};
use twinlag_estimate::{
    ENERGY_THAT_OUTWEIGHS_NOISE, EstimateError, Estimator, Hold, Intervals, NoiseColour, NoiseKnowledge, RunAtRest,
    Solved, Task, WhitenedFit,
};
use twinlag_optimise::{End, Fit};
use twinlag_record::{Record, SamplingKind};

use crate::answers::Characterisation;
use crate::error::Error;
use crate::options::Options;
use crate::quiet;
use crate::rows::observations;
use crate::setting::Setting;
use crate::watch::{Stop, UNWATCHED, Watch};
use conclude::Judged;
use excerpt::Excerpt;
use unseen::judge_across_missing;
pub(super) use unseen::judge_unseen;

/// Both time constants of `record`, with intervals, noise levels and residual tests.
///
/// ```
#[doc = include_str!("../example.txt")]
/// // The second channel of this record reads 2 K too hot, so its offset is fitted as well.
/// let answer = twinlag::characterise(&record, &Options::default().free("offset")?)?;
/// assert_eq!(answer.status, Status::Ok);
/// let offset = answer.free.offset_k.expect("fitted");
/// let error_k = offset.standard_error.expect("determined");
/// // Noise alone exceeds four standard errors once in 16 000 records.
/// assert!((offset.value - 2.0).abs() < 4.0 * error_k, "{} ± {error_k} K", offset.value);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error`] if the question cannot be put: options that contradict each other, an estimator that cannot take the record's
/// sampling, too few samples to distinguish noise from signal. A fit that ran is never an error: its
/// [`Status`](crate::Status) says what it is worth.
pub fn characterise(record: &Record, options: &Options) -> Result<Characterisation, Error> {
    characterise_watched(record, options, UNWATCHED)
}

/// [`characterise`], with `watch` called after each of its four steps and for every replicate of a bootstrap.
///
/// ```
#[doc = include_str!("../example.txt")]
/// use std::ops::ControlFlow;
/// use std::sync::atomic::{AtomicUsize, Ordering};
///
/// // Intervals from 500 simulated records, which somebody gives up when five are done.
/// let intervals = Intervals::Bootstrap(twinlag::estimate::Bootstrap { replicates: 500, seed: 1 });
/// let options = Options { intervals, ..Options::default() };
/// let mut calibrated = channels(1)?;
/// calibrated.t2_c.iter_mut().for_each(|c| *c -= 2.0);
/// let record = Record::from_channels(calibrated, SamplingChoice::Auto)?;
/// let most = AtomicUsize::new(0);
/// let watch = |_: &str, done, _| {
///     most.fetch_max(done, Ordering::Relaxed);
///     if done < 5 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
/// };
/// assert_eq!(twinlag::characterise_watched(&record, &options, &watch), Err(Error::Cancelled));
/// assert_eq!(most.into_inner(), 5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`characterise`]; [`Error::Cancelled`].
pub fn characterise_watched(record: &Record, options: &Options, watch: Watch<'_>) -> Result<Characterisation, Error> {
    options.check()?;
    let stop = Stop::new(watch);
    let mut answer = of_two_lags(record, options, &stop)?;
    let looked_at = match Excerpt::of_long(record, options)? {
        Some(excerpt) => excerpt,
        None => match observations(record) {
            Ok(all) => Excerpt { is_single_tone: is_single_tone(&all, &Policy::default()), observations: all },
            Err(_) => return Ok(answer),
        },
    };
    if looked_at.is_single_tone {
        answer.warnings.push(Remark::SingleTone.to_string());
        // Two lags alone are what was asked for, and under them both equations determine both numbers.
        let what = "right if nothing is missing: of a single tone two time constants absorb any effect".into();
        answer.rest_on(&Reason::Fault { what, grade: Grade::Conditional });
    } else {
        judge_across_missing(&mut answer, &looked_at.observations, options, &stop)?;
        judge_unseen(&mut answer, &looked_at.observations, options, &stop)?;
    }
    Ok(answer)
}

/// What the record says if nothing is missing beside two lags.
fn of_two_lags(record: &Record, options: &Options, stop: &Stop<'_>) -> Result<Characterisation, Error> {
    let readings = readings(record, options)?;
    check_sampling(&readings, options)?;
    let asked = Asked { record, options, stop };
    // Levels that are given need no rest.
    let quiet_s: &[[f64; 2]] = if options.noise_std_k.is_none() { &options.quiet_segments_s } else { &[] };
    let at_rest = quiet::runs(record, quiet_s)?;
    let task = asked.task(&readings, &at_rest);
    let answer = match task.parameters() {
        6 => answer::<6>(&asked, &task),
        4 => answer::<4>(&asked, &task),
        _ => answer::<2>(&asked, &task),
    };
    stop.check()?;
    stop.say(STEPS, 3, 4);
    answer
}

/// The channels of a record as the costs take them, cut where samples are missing.
///
/// The level taken off is the mean, or 0 °C where an offset is known or excluded: it is stated
/// there.
///
/// ```
#[doc = include_str!("../example.txt")]
/// use twinlag::cross_relation::CrossRelation;
///
/// // For a cost of one's own, or for one of this library at a point of one's choice.
/// let readings = twinlag::readings(&record, &Options::default())?;
/// assert_eq!((readings.len(), readings.even_period_s()), (record.len(), Some(record.sampling.period_s)));
/// let cost = CrossRelation::new(&readings, 500)?;
/// let offset_k = 2.0;
/// let [with, without] = [offset_k, 0.0].map(|offset_k| cost.evaluate(&[0.12, 0.45, 1.0, offset_k]).value);
/// // Both lags have unit gain at rest: the offset alone is 2² K² of the cost.
/// assert!((without - with - 4.0).abs() < 0.1, "{without} {with}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Cost`] for a record without usable samples, which its constructors do not let through.
pub fn readings(record: &Record, options: &Options) -> Result<Readings, Error> {
    let segments = record.segments.iter().map(|rows| {
        let steps = match record.sampling.kind {
            SamplingKind::Irregular => Steps::Uneven(record.steps_s(rows)),
            _ => Steps::Even(record.sampling.period_s),
        };
        Segment::new(record.t1_c[rows.clone()].to_vec(), record.t2_c[rows.clone()].to_vec(), steps)
    });
    let segments = segments.collect::<Result<_, _>>()?;
    let offset_is_stated = !options.free_offset || options.known(Parameter::Offset).is_some();
    Ok(if options.calibrates() && offset_is_stated {
        Readings::about(segments, 0.0)?
    } else {
        Readings::new(segments)?
    })
}

/// What takes evenly spaced samples.
fn check_sampling(readings: &Readings, options: &Options) -> Result<(), Error> {
    let wants = [
        (options.has_second_lag() != [false; 2], Setting::SecondOrder),
        (options.noise_colour == NoiseColour::Autoregressive, Setting::NoiseColour),
        (matches!(options.intervals, Intervals::Bootstrap(_)), Setting::Intervals),
    ];
    match wants.into_iter().find(|(is_asked, _)| *is_asked) {
        Some((_, setting)) if readings.even_period_s().is_none() => Err(Error::Setting {
            setting,
            expected: "a record with evenly spaced samples; if the stamps are only ragged, uniform sampling".into(),
            got: "uneven time stamps".into(),
            also: vec![Setting::Sampling],
        }),
        _ => Ok(()),
    }
}

/// One record with one set of options.
struct Asked<'a> {
    record: &'a Record,
    options: &'a Options,
    stop: &'a Stop<'a>,
}

/// What is reported of the steps: the fit, what the gas does between samples, what is left over, what may be hidden.
const STEPS: &str = "steps of the characterisation";

/// Probability beyond which the other hold takes the place of the one that was tried first: a likelihood ratio of 150, the
/// fifth power of `e`. Below it a short second lag and a hold look alike, and the choice would change with what else is fitted;
/// the interval covers both.
const CLEAR_PROBABILITY: f64 = 0.9933;

/// Puts the question to the estimators, in steps of which each needs the one before.
fn answer<'a, const P: usize>(asked: &Asked<'_>, task: &Task<'a>) -> Result<Characterisation, Error> {
    let mut warnings = asked.needless();
    // The whitened estimate comes first, whichever is asked: the others begin at it, and what it
    // leaves says whether the model is right.
    asked.stop.say(STEPS, 0, 4);
    let mut fit = WhitenedFit::<'a, P>::find(task)?;
    asked.stop.say(STEPS, 1, 4);
    warnings.extend(outweighed(&fit));
    // What the gas does between samples must be settled before the residual is judged: a wrong hold
    // leaves more than noise.
    let moved_by_hold = asked.settle_hold(&mut fit)?;
    // Levels that took the signal for noise are no measure for the residual, and must go before it
    // is held against them.
    if fit.lower_levels_to_residual() {
        warnings.push(
            "the signal changes between samples as noise does, so the noise levels are scaled \
                     to the residual and their ratio is a guess; give both levels if you know them"
                .into(),
        );
    }
    // Only now is it known whether errors are those of noise or those of the residual, and all
    // intervals rest on which.
    let theta = fit.theta();
    asked.stop.say(STEPS, 2, 4);
    let tests = asked.tests(&fit, &theta)?;
    let is_rejected = fit.is_rejected_by(&tests);
    let middle = if is_rejected { ScoreVariance::ResidualSpectrum } else { ScoreVariance::WhiteNoise };
    let covariance = fit.covariance(middle);
    if covariance.is_some() {
        fit.bound_unseen_lags(middle)?;
    }
    if asked.options.estimator == Estimator::Whitened {
        let solved = fit.solved(covariance);
        let judged = Judged { tests, is_rejected, is_determined: true, whitened_is_accepted: false };
        return conclude::conclude(asked, &fit, solved, judged, moved_by_hold, warnings);
    }
    // What the whitened estimate cannot determine, the others only seem to determine.
    let is_determined = fit.fit().end.is_usable() && fit.vague(&theta, covariance.as_ref()).is_empty();
    let solved = asked.solve_beside(&fit, &mut warnings)?;
    let tests = asked.tests(&fit, &solved.theta)?;
    let rejects = fit.is_rejected_by(&tests);
    let judged = Judged { tests, is_rejected: rejects, is_determined, whitened_is_accepted: !is_rejected };
    conclude::conclude(asked, &fit, solved, judged, None, warnings)
}

/// What to say where knowledge was weighed against a residual that is louder than noise.
fn outweighed<const P: usize>(fit: &WhitenedFit<'_, P>) -> Option<String> {
    let energy = fit.energy();
    let is_louder = !fit.knowledge().is_empty() && energy > ENERGY_THAT_OUTWEIGHS_NOISE;
    is_louder.then(|| {
        format!(
            "the residual has {energy:.3} times the energy that sensor noise explains; the known values were weighed against \
             the residual"
        )
    })
}

impl Asked<'_> {
    /// The question as estimators take it. Levels that are given come first, then those of a rest,
    /// then a ratio.
    fn task<'t>(&'t self, readings: &'t Readings, at_rest: &'t [RunAtRest<'t>]) -> Task<'t> {
        let options = self.options;
        let noise = match (options.noise_std_k, options.noise_ratio) {
            (Some(std_k), _) => NoiseKnowledge::Known { std_k, ar1: [0.0; 2] },
            (None, Some(ratio)) => NoiseKnowledge::Ratio(ratio),
            (None, None) => NoiseKnowledge::Found(options.noise_colour),
        };
        Task {
            hold: options.hold.first(),
            noise,
            at_rest,
            minimiser: &options.optimiser,
            discard: options.discard,
            free_gain: options.free_gain,
            free_offset: options.free_offset,
            second_order: options.second_order,
            known: &options.known,
            ..Task::new(readings)
        }
    }

    /// Options that were given and have nothing to do.
    fn needless(&self) -> Vec<String> {
        let options = self.options;
        let mut out = Vec::new();
        if options.discard.is_some() && options.estimator == Estimator::Whitened {
            out.push("the whitened estimator discards no samples: the number to discard was not needed".into());
        }
        if options.noise_std_k.is_some() && !options.quiet_segments_s.is_empty() {
            out.push("the noise levels are given: the quiet segment was not needed".into());
        }
        out
    }

    /// The tests of what parameters `theta` leave; of the calibration too where `theta` is a
    /// whitened minimum.
    fn tests<const P: usize>(&self, fit: &WhitenedFit<'_, P>, theta: &[f64; P]) -> Result<Vec<ResidualTest>, Error> {
        let is_minimum = self.options.estimator == Estimator::Whitened && fit.fit().end.is_usable();
        Ok(fit.residual_tests(theta, is_minimum)?)
    }

    /// How much each time constant would move with the other hold, relative: of even samples straight lines or none, of uneven ones what
    /// stands for straight lines. Where the hold of even samples is to be found, and the other one is clearly the more probable, `fit` is the
    /// estimate with that.
    fn settle_hold<const P: usize>(&self, fit: &mut WhitenedFit<'_, P>) -> Result<Option<[f64; 2]>, Error> {
        if self.options.estimator != Estimator::Whitened {
            return Ok(None);
        }
        let is_even = fit.readings().even_period_s().is_some();
        if !is_even && let Some(moved) = fit.moved_by_straight_lines()? {
            return Ok(fit.fit().end.is_usable().then_some(moved));
        }
        let hold = fit.other_hold();
        let other = fit.with_hold(hold)?;
        let is_usable = other.fit().end.is_usable();
        let both_usable = is_usable && fit.fit().end.is_usable();
        let mut moved = [0, 1].map(|i| other.theta()[i] / fit.theta()[i] - 1.0);
        let is_more_probable = other.probability_beside(fit) > CLEAR_PROBABILITY;
        let alone_is_accepted = || -> Result<bool, Error> {
            let rejected =
                |fit: &WhitenedFit<'_, P>| Ok::<_, Error>(fit.is_rejected_by(&self.tests(fit, &fit.theta())?));
            Ok(rejected(fit)? && !rejected(&other)?)
        };
        // Of uneven steps the other one stands for a straight line, and is no answer.
        let may_change = self.options.hold == Hold::Auto && is_even;
        if may_change && is_usable && (is_more_probable || alone_is_accepted()?) {
            *fit = WhitenedFit::find(&Task { hold, ..fit.task().clone() })?;
            moved = moved.map(|moved| (1.0 + moved).recip() - 1.0);
        }
        Ok(both_usable.then_some(moved))
    }

    /// Where the estimator that was asked for ends, beside the whitened `fit`.
    fn solve_beside<const P: usize>(
        &self,
        fit: &WhitenedFit<'_, P>,
        warnings: &mut Vec<String>,
    ) -> Result<Solved<P>, Error> {
        let estimator = self.options.estimator;
        if estimator.is_closed_form() && self.options.discard.is_some() {
            warnings.push("estimators in closed form discard no samples: the number to discard was not needed".into());
        }
        let solved = match estimator.solve(fit.task(), Some(fit)) {
            Err(EstimateError::Cost(CostError::Singular)) if estimator.is_closed_form() => {
                let why = "the difference equation has no solution with two positive time constants";
                let end = End::Stalled(why.into());
                let mut solved = fit.solved(None);
                solved.fit = solved.fit.map(|fit| Fit { optimiser: "closed-form".into(), end: end.clone(), ..fit });
                solved.end = end;
                return Ok(solved);
            }
            solved => solved?,
        };
        let biased = match estimator {
            Estimator::CrossRelation => "the plain cross-relation cost is biased towards long time constants by noise",
            Estimator::DifferenceEquationLs => {
                "noise biases least squares on the difference equation, in a direction that depends \
                     on which sensor is called T1"
            }
            Estimator::DifferenceEquationTls => "noise biases total least squares on the difference equation",
            _ => "",
        };
        if !biased.is_empty() {
            warnings.push(format!("{biased}; its intervals cover the scatter of the estimate, not its bias"));
        }
        if !estimator.is_closed_form() {
            let discarded = solved.discarded;
            warnings.push(format!("the first {discarded} samples of each unbroken stretch were discarded"));
        }
        Ok(solved)
    }
}
