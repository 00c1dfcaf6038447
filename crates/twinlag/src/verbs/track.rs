//! Time constants along a record.

use std::ops::Range;

use statrs::distribution::{Binomial, DiscreteCDF};
use twinlag_cross_relation::Z_975;
use twinlag_diagnose::{Basis, Change, Circumstances, Settings, excess, track as follow};
use twinlag_estimate::MAX_LOG_STANDARD_ERROR;
use twinlag_record::{Channels, Record, SamplingChoice};

use crate::answers::{Along, FittedAnswer, Model, Ratio, Status, Track};
use crate::error::Error;
use crate::options::Options;
use crate::rows::{Rows, known_time_constants};
use crate::setting::Setting;
use crate::verbs::characterise;
use crate::watch::{UNWATCHED, Watch};

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

fn whole(record: &Record, options: &TrackOptions, watch: Watch<'_>) -> Result<Track, Error> {
    options.characterise.check()?;
    options.characterise.check_not_fitted("tracking")?;
    options.model.as_ref().map_or(Ok(()), |model| model.check(record))?;
    let effects = options.model.as_ref().map(Model::known_effects).unwrap_or_default();
    let Rows { observations, .. } = Rows::of(record)?;
    let settings = Settings {
        noise_std_k: options.characterise.noise_std_k,
        known: known_time_constants(&options.characterise),
        ..Settings::default()
    };
    let mut found = follow(&observations, &settings, &effects, watch)?;
    let is_left = found.fit.is_contradicted();
    let sensors = found.log_error.as_ref().map(|errors| [0, 1].map(|i| along(&found.tau_s[i], &errors[i])));
    let sensors = sensors.filter(is_any);
    let status = match (&sensors, is_left) {
        (None, _) => Status::NotIdentifiable,
        (Some(_), true) => Status::ModelRejected,
        (Some(_), false) => Status::Ok,
    };
    let policy = &settings.policy;
    let basis = Basis::of(excess(&found.fit, false), !settings.known.is_empty(), policy);
    let circumstances = Circumstances::new(basis, &settings.known, observations.span_s(), policy);
    let judgements = circumstances.judge(&mut found.fit);
    let fitted = FittedAnswer {
        record,
        fit: &found.fit,
        options: &options.characterise,
        is_noise_given: settings.noise_std_k.is_some(),
        is_total_delay: false,
        judgements,
    };
    let last = fitted.characterisation(status);
    let mut warnings = Vec::new();
    if is_left {
        warnings.push(
            "the residual is more than noise: the bands follow from its spectrum and cover no missing effect. A diagnosis \
             looks for one"
                .into(),
        );
    }
    let stays = found.ratio.p_value >= RATIO_CHANGES;
    if !stays {
        warnings.push(
            "the ratio of the time constants changes: the two sensors do not follow the same \
            flow"
                .into(),
        );
    }
    warnings.extend(sensors.as_ref().and_then(|sensors| undetermined(sensors, "instants")));
    let (change, coefficients) = match found.change {
        Change::Smooth(size) => ("smooth", Some(size)),
        Change::Step => ("step", None),
        _ => ("constant", None),
    };
    Ok(Track {
        schema: Track::SCHEMA.into(),
        status,
        change: change.into(),
        coefficients,
        range_s: sensors.as_ref().map(range),
        time_s: if sensors.is_some() { found.time_s } else { Vec::new() },
        sensors: sensors.unwrap_or_default(),
        step: found.step.filter(|_| found.change == Change::Step),
        ratio: Some(Ratio { stays, test: found.ratio }),
        last,
        warnings,
    })
}

/// A time constant with its band, whose logarithm is normal; NaN where it is not determined.
fn along(tau_s: &[f64], log_error: &[f64]) -> Along {
    let by = |sign: f64| {
        let pairs = tau_s.iter().zip(log_error);
        pairs
            .map(|(tau, e)| if *e <= MAX_LOG_STANDARD_ERROR { tau * (sign * Z_975 * e).exp() } else { f64::NAN })
            .collect()
    };
    Along { tau_s: by(0.0), low_s: by(-1.0), high_s: by(1.0) }
}

/// Whether both time constants are determined anywhere.
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
fn undetermined(sensors: &[Along; 2], what: &str) -> Option<String> {
    let pairs = || sensors[0].tau_s.iter().zip(&sensors[1].tau_s);
    let empty = pairs().filter(|(a, b)| a.is_nan() || b.is_nan()).count();
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
            expected: format!(
                "seconds from {least_s:.4} ({SHORTEST_WINDOW} samples) to {span_s:.4}, the record's length"
            ),
            got: window_s.to_string(),
            also: Vec::new(),
        });
    }
    let hop_s = window_s / OVERLAP;
    let count = ((span_s - window_s) / hop_s).floor() as usize + 1;
    let (mut time_s, mut sensors) = (Vec::new(), [Along::default(), Along::default()]);
    let (mut answered, mut rejected) = (0, 0);
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
        answered += usize::from(answer.is_some());
        rejected += usize::from(answer.as_ref().is_some_and(|a| a.status == Status::ModelRejected));
        time_s.push(from_s + 0.5 * window_s);
        for (i, along) in sensors.iter_mut().enumerate() {
            let sensor = answer.as_ref().map(|a| &a.sensors[i]);
            let [low, high] = sensor.and_then(|s| s.interval_95_s).unwrap_or([f64::NAN; 2]);
            along.tau_s.push(sensor.and_then(|s| s.time_constant_s).unwrap_or(f64::NAN));
            along.low_s.push(low);
            along.high_s.push(high);
        }
    }
    let mut warnings: Vec<String> = undetermined(&sensors, "windows").into_iter().collect();
    if rejected > 0 {
        warnings.push(format!(
            "in {rejected} of {answered} windows the residual is more than noise: their numbers are the best fit of a model \
             that they contradict. A diagnosis looks for what is missing"
        ));
    }
    let is_any = is_any(&sensors);
    let status = match (is_any, are_too_many(rejected, answered)) {
        (false, _) => Status::NotIdentifiable,
        (true, true) => Status::ModelRejected,
        (true, false) => Status::Ok,
    };
    if !is_any {
        (time_s, sensors) = Default::default();
    }
    Ok(Track {
        schema: Track::SCHEMA.into(),
        status,
        change: "windows".into(),
        coefficients: None,
        range_s: is_any.then(|| range(&sensors)),
        time_s,
        sensors,
        step: None,
        ratio: None,
        last,
        warnings,
    })
}
