//! Time constants along a record.

use std::ops::Range;

use statrs::distribution::{Binomial, DiscreteCDF};
use twinlag_cross_relation::Z_975;
use twinlag_diagnose::{
    Basis, Change, Circumstances, Grade, Identifier, Judgement, Reason, Remark, TimeConstant, excess, is_single_tone,
    track as follow,
};
use twinlag_estimate::MAX_LOG_STANDARD_ERROR;
use twinlag_record::{Channels, Record, SamplingChoice};

use crate::answers::{Along, Characterisation, FittedAnswer, Model, Ratio, Status, Track};
use crate::error::Error;
use crate::options::Options;
use crate::rows::{Rows, settings_of};
use crate::setting::Setting;
use crate::verbs::characterise::judge_unseen;
use crate::verbs::{characterise, following_both};
use crate::watch::{Stop, UNWATCHED, Watch};

/// Below this chance the ratio does not stay.
const RATIO_CHANGES: f64 = 1e-3;
/// Windows of a sliding estimate that overlap.
const OVERLAP: f64 = 4.0;
/// Probability that one window of a correct model is rejected.
const REJECTED_WINDOW_PROBABILITY: f64 = 1e-3;
/// Probability of as many rejected windows, below which the model is rejected: wrong in one record of a hundred.
const REJECTED_WINDOWS_P_VALUE: f64 = 0.01;
/// Fewest samples of a window.
const SHORTEST_WINDOW: usize = 200;

/// What tracking may assume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackOptions {
    /// Noise, known time constants, and how windows are characterised.
    pub characterise: Options,
    /// A model that was found in another record; its effects stay fixed.
    pub model: Option<Model>,
    /// Length of a sliding window, s: the published way, each window characterised by itself;
    /// `None` for the whole record at once.
    pub window_s: Option<f64>,
}

/// Both time constants along `record`.
///
/// # Errors
/// As [`crate::diagnose()`] and [`crate::characterise_with`]; [`Error::Setting`] for a window that
/// is too short or longer than the record.
///
/// ```
#[doc = include_str!("../example.txt")]
/// // What the sensors are like apart from that: here, one of them reads too hot.
/// let model = twinlag::diagnose(&record, &DiagnoseOptions::default())?.model();
/// let options = TrackOptions { model: Some(model), ..TrackOptions::default() };
/// let answer = twinlag::track(&record, &options)?;
/// assert_eq!(answer.change, "constant");
/// assert_eq!(answer.sensors[0].tau_s.len(), record.len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn track(record: &Record, options: &TrackOptions) -> Result<Track, Error> {
    track_watched(record, options, UNWATCHED)
}

/// [`track`], with `watch` called as it goes on.
///
/// ```
#[doc = include_str!("../example.txt")]
/// use std::ops::ControlFlow;
/// use std::sync::atomic::{AtomicUsize, Ordering};
///
/// // Windows of 10 s of a record of 20 s, a quarter of a window apart, the first of them from 0 s
/// // on.
/// let characterise = Options::default().free("offset")?;
/// let options = TrackOptions { characterise, window_s: Some(10.0), ..TrackOptions::default() };
/// let windows = AtomicUsize::new(0);
/// let watch = |_: &str, _, _| {
///     windows.fetch_add(1, Ordering::Relaxed);
///     ControlFlow::Continue(())
/// };
/// let answer = twinlag::track_watched(&record, &options, &watch)?;
/// assert_eq!((answer.time_s, windows.into_inner()), (vec![5.0, 7.5, 10.0, 12.5], 4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`track`]; [`Error::Cancelled`].
pub fn track_watched(record: &Record, options: &TrackOptions, watch: Watch<'_>) -> Result<Track, Error> {
    match options.window_s {
        Some(window_s) => windows(record, options, window_s, watch),
        None => whole(record, options, watch),
    }
}

/// What a track rests on with a model, whose effects on the time constants are what is followed.
fn of_model(record: &Record, options: &TrackOptions) -> Vec<Reason> {
    let Some(model) = &options.model else { return Vec::new() };
    let effects = model.effects.iter().map(|e| e.effect);
    let followed: Vec<Identifier> = effects.filter(|e| e.about().changes_time_constants).collect();
    model.reasons(record, &followed)
}

fn whole(record: &Record, options: &TrackOptions, watch: Watch<'_>) -> Result<Track, Error> {
    options.characterise.check()?;
    options.characterise.check_not_fitted("tracking")?;
    options.model.as_ref().map_or(Ok(()), |model| model.check(record))?;
    let effects = options.model.as_ref().map(Model::known_effects).unwrap_or_default();
    let Rows { observations, .. } = Rows::of(record)?;
    let settings = settings_of(&options.characterise);
    // Before there is anything as long as the record.
    let is_single_tone = is_single_tone(&observations, &settings.policy);
    let mut found = follow(&observations, &settings, &effects, watch)?;
    let is_left = found.fit.is_contradicted();
    let stays = found.ratio.p_value >= RATIO_CHANGES;
    let policy = &settings.policy;
    let mut basis = Basis::of(excess(&found.fit, false), !settings.known.is_empty(), policy);
    let reasons = of_model(record, options);
    basis.reasons.extend(reasons.iter().cloned());
    if found.log_error.is_some() && !stays {
        basis.reasons.insert(0, Reason::RatioChanges { p_value: found.ratio.p_value });
    }
    if is_single_tone {
        basis.reasons.push(Reason::SingleTone);
    }
    let circumstances = Circumstances::new(basis, &settings.known, observations.span_s(), policy);
    let narrow = found.fit.time_constants;
    let mut judgements = circumstances.judge(&mut found.fit);
    judgements.withhold_from_valley(&mut found.fit, false);
    let widened_by = widening(&narrow, &found.fit.time_constants);
    let bands = found.log_error.take().map(|log_error| {
        let [one, two] = std::mem::take(&mut found.tau_s);
        let [of_one, of_two] = log_error;
        [(one, of_one), (two, of_two)]
    });
    let is_determined = bands.as_ref().is_some_and(|bands| bands.iter().all(|(tau_s, e)| is_given_anywhere(tau_s, e)));
    let sensors = bands.map(|bands| bands.map(|(tau_s, log_error)| along(tau_s, log_error, widened_by)));
    let sensors = sensors.filter(is_any);
    let numbers = following_both(&record.channels, judgements.time_constants.each_ref());
    let mut judgement = Judgement::of(&circumstances.whole_basis().reasons).and_following(numbers);
    if !is_determined || (sensors.is_none() && judgement.grade != Grade::NoGo) {
        judgement = Judgement::of(&[Reason::NotDetermined]);
    }
    let status = match (is_determined && !is_single_tone, is_left || !stays) {
        (false, _) => Status::NotIdentifiable,
        (true, true) => Status::ModelRejected,
        (true, false) => Status::Ok,
    };
    let is_given = options.characterise.best_effort || judgement.grade != Grade::NoGo;
    let tone = is_single_tone.then(|| Remark::SingleTone.to_string());
    let mut warnings: Vec<String> = tone.into_iter().collect();
    warnings.extend(left_over(is_left && is_given, status == Status::ModelRejected && !is_given));
    let mut sensors = sensors.filter(|_| is_given);
    warnings.extend(sensors.as_ref().and_then(|sensors| undetermined(sensors, 0, "instants")));
    let mut grades = vec![judgement.grade; sensors.as_ref().map_or(0, |s| s[0].tau_s.len())];
    let most_s = policy.longest_given_share * observations.span_s();
    if let Some(sensors) = &mut sensors {
        let is_held = |i: usize| settings.known.iter().any(|k| k.sensor == i && k.std_s.is_none());
        let estimated = (0..2).zip(sensors).filter(|(i, _)| !is_held(*i)).map(|(_, along)| along);
        warnings.extend(keep_short(estimated, &mut grades, most_s, options.characterise.best_effort));
    }
    let fitted = FittedAnswer {
        record,
        fit: &found.fit,
        options: &options.characterise,
        is_noise_given: settings.noise_std_k.is_some(),
        is_total_delay: false,
        judgements,
    };
    let mut last = fitted.characterisation(status);
    last.model_remarks = reasons.iter().filter_map(Reason::caution).collect();
    let (change, coefficients) = if sensors.is_some() { name_of(found.change) } else { ("unknown", None) };
    // Time constants that stay are those of two lags, which may hide what these may.
    if change == "constant" && effects.is_empty() {
        judge_unseen(&mut last, &observations, &options.characterise, &Stop::new(watch))?;
        let constant = last.sensors.each_ref().map(|sensor| &sensor.judgement);
        judgement = judgement.and_following(following_both(&record.channels, constant));
        grades.iter_mut().for_each(|grade| *grade = (*grade).max(judgement.grade));
    }
    Ok(Track {
        schema: Track::SCHEMA.into(),
        status,
        judgement,
        change: change.into(),
        coefficients,
        range_s: sensors.as_ref().map(range),
        time_s: if sensors.is_some() { found.time_s } else { Vec::new() },
        step: found.step.filter(|_| change == "step"),
        sensors: sensors.unwrap_or_default(),
        grades,
        ratio: Some(Ratio { stays, test: found.ratio }),
        last,
        warnings,
    })
}

/// The name of a change, and its coefficients where it is smooth.
fn name_of(change: Change) -> (&'static str, Option<usize>) {
    match change {
        Change::Smooth(size) => ("smooth", Some(size)),
        Change::Step => ("step", None),
        _ => ("constant", None),
    }
}

/// What to know of a track of a model that is contradicted.
///
/// - `is_bounded`: whether bands are given in spite of what is left over
/// - `is_withheld`: whether nothing is given because of it
fn left_over(is_bounded: bool, is_withheld: bool) -> Vec<String> {
    let bounded = "the residual is more than noise: the bands follow from its spectrum and cover no missing effect. A diagnosis \
                   looks for one";
    let withheld = "time constants along this record are not given, since it contradicts that both change by one factor and \
                    nothing else does. A diagnosis looks for what else there is, and its model can be used here";
    let said = [(is_bounded, bounded), (is_withheld, withheld)];
    said.into_iter().filter(|(is_so, _)| *is_so).map(|(_, text)| text.to_owned()).collect()
}

/// By how much the intervals of both time constants had to be widened: the larger factor, since they change together.
fn widening(narrow: &[TimeConstant; 2], wide: &[TimeConstant; 2]) -> f64 {
    let length =
        |of: &TimeConstant| of.interval_95_s.filter(|[low, _]| *low > 0.0).map(|[low, high]| (high / low).ln());
    let factors = narrow.iter().zip(wide).filter_map(|(narrow, wide)| Some(length(wide)? / length(narrow)?));
    factors.filter(|factor| factor.is_finite()).fold(1.0, f64::max)
}

/// Whether a time constant is determined at any instant, its band not widened.
fn is_given_anywhere(tau_s: &[f64], log_error: &[f64]) -> bool {
    tau_s.iter().zip(log_error).any(|(tau_s, e)| *e <= MAX_LOG_STANDARD_ERROR && tau_s.is_finite())
}

/// A time constant with its band, whose logarithm is normal, widened by a factor; NaN where it is not determined.
fn along(mut tau_s: Vec<f64>, mut log_error: Vec<f64>, widened_by: f64) -> Along {
    let mut low_s = Vec::with_capacity(tau_s.len());
    // The upper end comes in the place of the error: all of them are as long as the record.
    for (tau_s, error) in tau_s.iter_mut().zip(&mut log_error) {
        let (at, e) = (*tau_s, widened_by * *error);
        let by = |sign: f64| if e <= MAX_LOG_STANDARD_ERROR { at * (sign * Z_975 * e).exp() } else { f64::NAN };
        low_s.push(by(-1.0));
        (*tau_s, *error) = (by(0.0), by(1.0));
    }
    Along { tau_s, low_s, high_s: log_error }
}

/// Takes out what is longer than `most_s`, or grades it where it was asked for all the same, and says so.
fn keep_short<'a>(
    estimated: impl Iterator<Item = &'a mut Along>,
    grades: &mut [Grade],
    most_s: f64,
    best_effort: bool,
) -> Option<String> {
    let mut is_long = vec![false; grades.len()];
    for along in estimated {
        for k in (0..grades.len()).filter(|&k| along.tau_s[k] > most_s).collect::<Vec<_>>() {
            is_long[k] = true;
            if best_effort {
                grades[k] = Grade::NoGo;
            } else {
                [along.tau_s[k], along.low_s[k], along.high_s[k]] = [f64::NAN; 3];
            }
        }
    }
    let count = is_long.iter().filter(|is_long| **is_long).count();
    (count > 0).then(|| {
        let given = if best_effort { "do not use it" } else { "it is not given" };
        format!(
            "at {count} of {} instants a time constant is longer than {most_s:.3} s, the longest that a record of this length \
             can show: {given}",
            grades.len()
        )
    })
}

/// Whether both time constants are given anywhere.
fn is_any(sensors: &[Along; 2]) -> bool {
    sensors.iter().all(|s| s.tau_s.iter().any(|t| t.is_finite()))
}

/// Whether `rejected` of `answered` windows are more than chance rejects of a correct model, as many of them counted as do not
/// overlap.
fn are_too_many(rejected: usize, answered: usize) -> bool {
    let apart = |windows: usize| (windows as f64 / OVERLAP).ceil();
    let (rejected, answered) = (apart(rejected), apart(answered));
    let Ok(by_chance) = Binomial::new(REJECTED_WINDOW_PROBABILITY, answered as u64) else { return false };
    rejected > 0.0 && by_chance.sf(rejected as u64 - 1) < REJECTED_WINDOWS_P_VALUE
}

/// Says at how many places a time constant is not determined; `None` if at none.
///
/// - `withheld`: places at which one is determined, and left out for another reason
fn undetermined(sensors: &[Along; 2], withheld: usize, what: &str) -> Option<String> {
    let pairs = || sensors[0].tau_s.iter().zip(&sensors[1].tau_s);
    let empty = pairs().filter(|(a, b)| a.is_nan() || b.is_nan()).count().saturating_sub(withheld);
    (empty > 0)
        .then(|| format!("at {empty} of {} {what} the readings do not determine both time constants", pairs().count()))
}

fn range(sensors: &[Along; 2]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| {
        let known = sensors[i].tau_s.iter().copied().filter(|t| t.is_finite());
        known.fold([f64::INFINITY, 0.0], |[low, high], t| [low.min(t), high.max(t)])
    })
}

/// Some rows of a record.
fn part(record: &Record, rows: Range<usize>) -> Result<Record, Error> {
    let channels = Channels {
        source: record.source.clone(),
        names: record.channels.clone(),
        time_s: record.time_s[rows.clone()].to_vec(),
        t1_c: record.t1_c[rows.clone()].to_vec(),
        t2_c: record.t2_c[rows].to_vec(),
        reference_c: None,
    };
    Ok(Record::from_channels(channels, SamplingChoice::Auto)?)
}

/// Each window by itself, a quarter of a window apart, at its middle.
fn windows(record: &Record, options: &TrackOptions, window_s: f64, watch: Watch<'_>) -> Result<Track, Error> {
    let last = characterise(record, &options.characterise)?;
    let span_s = record.time_s.last().copied().unwrap_or(0.0) - record.time_s.first().copied().unwrap_or(0.0);
    let least_s = SHORTEST_WINDOW as f64 * record.sampling.period_s;
    if !(window_s >= least_s && window_s <= span_s) {
        return Err(Error::Setting {
            setting: Setting::Window,
            expected: if least_s > span_s {
                format!(
                    "a record of at least {least_s:.4} s ({SHORTEST_WINDOW} sample periods) for any window; this one has {span_s:.4} s"
                )
            } else {
                format!("seconds from {least_s:.4} ({SHORTEST_WINDOW} samples) to {span_s:.4}, the record's length")
            },
            got: window_s.to_string(),
            also: Vec::new(),
        });
    }
    let mut out = Windows::default();
    let hop_s = window_s / OVERLAP;
    let count = ((span_s - window_s) / hop_s).floor() as usize + 1;
    for k in 0..count {
        if watch("windows", k, count).is_break() {
            return Err(Error::Cancelled);
        }
        let from_s = record.time_s[0] + k as f64 * hop_s;
        let rows =
            record.time_s.partition_point(|t| *t < from_s)..record.time_s.partition_point(|t| *t <= from_s + window_s);
        let answer = match part(record, rows).and_then(|part| characterise(&part, &options.characterise)) {
            Ok(answer) => Some(answer),
            // Of too few samples, or of a sensor that is dead, there is nothing to say.
            Err(Error::Record(_) | Error::Cost(_) | Error::Noise(_) | Error::Estimate(_)) => None,
            Err(error) => return Err(error),
        };
        out.push(from_s + 0.5 * window_s, answer.as_ref());
    }
    let mut track = out.track(last);
    if options.model.is_some() {
        track.warnings.push("the model is not used: windows are characterised as two first-order lags".into());
    }
    Ok(track)
}

/// What windows answer, one after another.
#[derive(Default)]
struct Windows {
    time_s: Vec<f64>,
    sensors: [Along; 2],
    grades: Vec<Grade>,
    /// The judgement of each time constant, with what it is of and whether it is given.
    judged: Vec<(String, Judgement, bool)>,
    answered: usize,
    rejected: usize,
    /// Windows that are rejected and lack a time constant for that reason.
    withheld: usize,
}

impl Windows {
    /// Adds the answer of the window around `time_s`; `None` of one that has none.
    fn push(&mut self, time_s: f64, answer: Option<&Characterisation>) {
        let is_rejected = answer.is_some_and(|a| a.status == Status::ModelRejected);
        let is_empty = answer.is_some_and(|a| a.sensors.iter().any(|s| s.time_constant_s.is_none()));
        self.answered += usize::from(answer.is_some());
        self.rejected += usize::from(is_rejected);
        self.withheld += usize::from(is_rejected && is_empty);
        self.time_s.push(time_s);
        let mut grade = None;
        for (i, along) in self.sensors.iter_mut().enumerate() {
            let sensor = answer.map(|a| &a.sensors[i]);
            let [low, high] = sensor.and_then(|s| s.interval_95_s).unwrap_or([f64::NAN; 2]);
            let tau_s = sensor.and_then(|s| s.time_constant_s);
            along.tau_s.push(tau_s.unwrap_or(f64::NAN));
            along.low_s.push(low);
            along.high_s.push(high);
            if let Some(sensor) = sensor {
                let name = format!("the time constant of {} around {time_s:.2} s", sensor.channel);
                self.judged.push((name, sensor.judgement.clone(), tau_s.is_some()));
                grade = grade.max(tau_s.map(|_| sensor.judgement.grade));
            }
        }
        self.grades.push(grade.unwrap_or(Grade::NoGo));
    }

    fn track(mut self, last: Characterisation) -> Track {
        let is_any = is_any(&self.sensors);
        let judged = self.judged.iter().filter(|(_, _, is_given)| *is_given || !is_any);
        let judgement = match self.answered {
            0 => Judgement::of(&[Reason::NotDetermined]),
            _ => Judgement::following(judged.map(|(name, judgement, _)| (name.as_str(), judgement))),
        };
        let (answered, rejected, withheld) = (self.answered, self.rejected, self.withheld);
        let mut warnings: Vec<String> = undetermined(&self.sensors, withheld, "windows").into_iter().collect();
        if rejected > 0 {
            let numbers = match withheld {
                0 => "their numbers are the best fit of a model that they contradict".into(),
                _ => format!("{withheld} of them have a time constant that is not given"),
            };
            warnings.push(format!(
                "in {rejected} of {answered} windows the residual is more than noise: {numbers}. A diagnosis looks for what is \
                 missing"
            ));
        }
        let status = match (is_any, are_too_many(rejected, answered)) {
            (_, true) => Status::ModelRejected,
            (false, false) => Status::NotIdentifiable,
            (true, false) => Status::Ok,
        };
        if !is_any {
            (self.time_s, self.sensors, self.grades) = Default::default();
        }
        Track {
            schema: Track::SCHEMA.into(),
            status,
            judgement,
            change: "windows".into(),
            coefficients: None,
            range_s: is_any.then(|| range(&self.sensors)),
            time_s: self.time_s,
            sensors: self.sensors,
            grades: self.grades,
            step: None,
            ratio: None,
            last,
            warnings,
        }
    }
}
