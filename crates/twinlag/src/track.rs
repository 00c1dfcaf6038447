//! Time constants along a record: schema `twinlag.track/1`.

use std::ops::{ControlFlow, Range};

use serde::{Deserialize, Serialize};
use twinlag_diagnose::{Change, Settings, track as core};
use twinlag_record::{Channels, Record, SamplingChoice};

use crate::characterisation::{Characterisation, FreeParameters, Status};
use crate::characterise::characterise;
use crate::diagnose::{
    DiagnoseWatch, Model, check_channels, check_numbers, known, known_effects, observations, of_fit,
};
use crate::error::Error;
use crate::options::Options;
use twinlag_estimate::Z_975;

/// Below this chance the ratio does not stay.
const RATIO_CHANGES: f64 = 1e-3;
/// Windows of a sliding estimate that overlap.
const OVERLAP: f64 = 4.0;
/// Fewest samples of a window.
const SHORTEST_WINDOW: usize = 200;

/// What tracking may assume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackOptions {
    /// Noise, known time constants, and how windows are characterised.
    pub characterise: Options,
    /// A model that was found in another record; its effects stay fixed.
    pub model: Option<Model>,
    /// Length of a sliding window, s, if each window is to be characterised separately, as in
    /// published work; `None` for the whole record at once.
    pub window_s: Option<f64>,
}

/// One sensor's time constant along the record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Along {
    /// Time constant, s; NaN if a window does not determine it.
    pub tau_s: Vec<f64>,
    /// End of the pointwise 95 % band, s; NaN if a window does not determine it.
    pub low_s: Vec<f64>,
    /// End of the pointwise 95 % band, s; NaN if a window does not determine it.
    pub high_s: Vec<f64>,
}

/// A step of both time constants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepFound {
    /// When, s.
    pub at_s: f64,
    /// 95 % interval, s.
    pub interval_95_s: [f64; 2],
    /// Time constants after over those before.
    pub factor: f64,
    /// Reduction of `−2 ln L` compared with constant time constants.
    pub evidence: f64,
}

/// Test of whether the ratio of the time constants stays constant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// Whether no change of the ratio is detected.
    pub stays: bool,
    /// Reduction of `−2 ln L` by a changing ratio.
    pub statistic: f64,
    /// Number of coefficients of the changing ratio.
    pub degrees_of_freedom: usize,
    /// Probability of such a reduction if the ratio is constant.
    pub p_value: f64,
}

/// How time constants change along a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// `twinlag.track/1`.
    pub schema: String,
    /// `ok`, `model-rejected` where something is left over, `not-identifiable` where the record does not determine time constants.
    pub status: Status,
    /// `constant`, `smooth`, `step` or `windows`.
    pub change: String,
    /// Coefficients of a smooth change.
    pub coefficients: Option<usize>,
    /// Instants, s. The series are not part of the JSON.
    #[serde(skip)]
    pub time_s: Vec<f64>,
    /// Both time constants.
    #[serde(skip)]
    pub sensors: [Along; 2],
    /// Smallest and largest time constant of each sensor, s.
    pub range_s: Option<[[f64; 2]; 2]>,
    /// The step, if the change is a step.
    pub step: Option<StepFound>,
    /// Test of a constant ratio; `None` for windows.
    pub ratio: Option<Ratio>,
    /// The fit, with time constants that are means over the record; for windows, the fit to the
    /// whole record.
    #[serde(rename = "final")]
    pub last: Characterisation,
    /// What to know before using the numbers.
    pub warnings: Vec<String>,
}

impl Track {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.track/1";
}

/// Follows both time constants along `record`.
///
/// # Errors
/// As [`crate::diagnose()`] and [`crate::characterise_with`]; [`Error::Option`] for a window that is too short or longer than the record.
pub fn track(record: &Record, options: &TrackOptions, watch: DiagnoseWatch<'_>) -> Result<Track, Error> {
    match options.window_s {
        Some(window_s) => windows(record, options, window_s, watch),
        None => whole(record, options, watch),
    }
}

fn whole(record: &Record, options: &TrackOptions, watch: DiagnoseWatch<'_>) -> Result<Track, Error> {
    options.characterise.check_not_fitted("track")?;
    let effects = match &options.model {
        Some(model) => {
            check_channels(record, model)?;
            check_numbers(model)?;
            known_effects(model)
        }
        None => Vec::new(),
    };
    let base = characterise(record, &options.characterise)?;
    let (observations, _) = observations(record)?;
    let settings = Settings {
        noise_std_k: options.characterise.noise_std_k,
        known: known(&options.characterise),
        ..Settings::default()
    };
    let found = core(&observations, &settings, &effects, &|task, done, of| {
        watch(task, done, of);
        ControlFlow::Continue(())
    })?;
    let is_left = found.fit.is_contradicted();
    let status = match (&found.log_error, is_left) {
        (None, _) => Status::NotIdentifiable,
        (Some(_), true) => Status::ModelRejected,
        (Some(_), false) => Status::Ok,
    };
    let free = FreeParameters { gain: None, offset_k: None };
    let last = of_fit(&base, &found.fit, status, free, &options.characterise);
    let mut warnings = Vec::new();
    if is_left {
        warnings.push(
            "the residual is more than noise: the bands follow from its spectrum and cover no missing effect. \
             `twinlag diagnose` looks for one"
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
    let sensors = found.log_error.as_ref().map(|errors| {
        [0, 1].map(|i| {
            let by = |sign: f64| {
                found.tau_s[i].iter().zip(&errors[i]).map(|(tau, e)| tau * (sign * Z_975 * e).exp()).collect()
            };
            Along { tau_s: found.tau_s[i].clone(), low_s: by(-1.0), high_s: by(1.0) }
        })
    });
    let (change, coefficients) = match found.change {
        Change::Smooth(size) => ("smooth", Some(size)),
        Change::Step => ("step", None),
        _ => ("constant", None),
    };
    let step = found.step.filter(|_| found.change == Change::Step);
    Ok(Track {
        schema: Track::SCHEMA.into(),
        status,
        change: change.into(),
        coefficients,
        range_s: sensors.as_ref().map(range),
        time_s: if sensors.is_some() { found.time_s } else { Vec::new() },
        sensors: sensors.unwrap_or_default(),
        step: step.map(|s| StepFound {
            at_s: s.at_s,
            interval_95_s: s.interval_95_s,
            factor: s.factor,
            evidence: s.evidence,
        }),
        ratio: Some(Ratio {
            stays,
            statistic: found.ratio.statistic,
            degrees_of_freedom: found.ratio.degrees_of_freedom,
            p_value: found.ratio.p_value,
        }),
        last,
        warnings,
    })
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
fn windows(record: &Record, options: &TrackOptions, window_s: f64, watch: DiagnoseWatch<'_>) -> Result<Track, Error> {
    let last = characterise(record, &options.characterise)?;
    let span_s = record.time_s.last().copied().unwrap_or(0.0) - record.time_s.first().copied().unwrap_or(0.0);
    let least_s = SHORTEST_WINDOW as f64 * record.sampling.period_s;
    if !(window_s >= least_s && window_s <= span_s) {
        return Err(Error::Option {
            option: "--window",
            expected: format!(
                "seconds from {least_s:.4} ({SHORTEST_WINDOW} samples) to {span_s:.4}, the record's length"
            ),
            got: window_s.to_string(),
        });
    }
    let hop_s = window_s / OVERLAP;
    let count = ((span_s - window_s) / hop_s).floor() as usize + 1;
    let (mut time_s, mut sensors, mut rejected) = (Vec::new(), [Along::default(), Along::default()], 0);
    for k in 0..count {
        watch("windows", k, count);
        let from_s = record.time_s[0] + k as f64 * hop_s;
        let rows =
            record.time_s.partition_point(|t| *t < from_s)..record.time_s.partition_point(|t| *t <= from_s + window_s);
        let Ok(answer) = part(record, rows).and_then(|part| characterise(&part, &options.characterise)) else {
            continue;
        };
        rejected += usize::from(answer.status == Status::ModelRejected);
        time_s.push(from_s + 0.5 * window_s);
        for (along, sensor) in sensors.iter_mut().zip(&answer.sensors) {
            let [low, high] = sensor.interval_95_s.unwrap_or([f64::NAN; 2]);
            along.tau_s.push(sensor.time_constant_s.unwrap_or(f64::NAN));
            along.low_s.push(low);
            along.high_s.push(high);
        }
    }
    let mut warnings = Vec::new();
    let empty = sensors[0].tau_s.iter().filter(|t| !t.is_finite()).count();
    if empty > 0 {
        warnings.push(format!("{empty} of {} windows do not determine both time constants", time_s.len()));
    }
    if rejected > 0 {
        warnings.push(format!("in {rejected} of {} windows the residual is more than noise", time_s.len()));
    }
    let is_any = sensors.iter().all(|s| s.tau_s.iter().any(|t| t.is_finite()));
    Ok(Track {
        schema: Track::SCHEMA.into(),
        status: if is_any { Status::Ok } else { Status::NotIdentifiable },
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
