//! Gas temperature and time constants, reading by reading.

mod state;

use std::fmt;

use serde::{Deserialize, Serialize};
use twinlag_compensate::{AnyTracker, Prior, Rig, learn, tracker};
use twinlag_cross_relation::Z_975;
use twinlag_diagnose::{Grade, Identifier};
use twinlag_estimate::spans_too_much;
use twinlag_record::{Record, SamplingKind};

use crate::answers::{Characterisation, Model, Status};
use crate::error::Error;
use crate::options::Options;
use crate::verbs::with_model::with_model;

pub use state::LiveState;

/// By how much time constants are taken to change in [`CHANGE_OVER`] time constants of the slower
/// sensor, where nothing is said.
const CHANGE: f64 = 0.1;
const CHANGE_OVER: f64 = 10.0;
/// Samples of a gap that a single row is believed to come after. One that is farther off may be wrong.
const LONGEST_GAP: f64 = 100_000.0;
/// Samples by which a row may come late, after those that were read later, and is no clock that was set back.
const MOST_LATE: f64 = 100.0;
/// Chance that the time constants are beyond the range in view, above which that is said.
const LIKELY: f64 = 0.05;
/// Rows over which it is watched whether readings are what the start led to expect, and by how many
/// standard deviations of such a mean they may differ before bands are widened.
const WATCHED: f64 = 100.0;
const CLEARLY: f64 = 4.0;

/// What live tracking may assume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LiveOptions {
    /// Noise, known time constants, and how the start is characterised.
    pub characterise: Options,
    /// A model that was found in another record; its effects stay fixed.
    pub model: Option<Model>,
    /// By how much the time constants may change in a second, as a share: the standard deviation,
    /// which grows as the root of time. Where nothing is said, a tenth in ten time constants of the
    /// slower sensor.
    pub change_per_root_s: Option<f64>,
}

/// Gas temperature and time constants at an instant, from the readings up to it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LiveAnswer {
    /// The instant, s.
    pub time_s: f64,
    /// The gas temperature, °C.
    pub gas_c: f64,
    /// Its standard deviation, K.
    pub gas_std_k: f64,
    /// Both time constants, s; `None` while the readings of late do not determine them, and while they may have left the range that is
    /// tracked.
    pub tau_s: [Option<f64>; 2],
    /// Ends of their 95 % bands, s; `None` where the time constant is.
    pub tau_95_s: [Option<[f64; 2]>; 2],
    /// Whether the time constants may have left the range that is tracked.
    pub is_beyond: bool,
    /// What the bands were multiplied by, since readings of late are farther from what was expected
    /// of them than noise takes them: the gas is not what it was in the start.
    pub widened_by: f64,
    /// Whether there was a long pause before this row, or the clock was set.
    pub is_resumed: bool,
}

/// Tracks both sensors, reading by reading, after a start.
pub struct Live {
    /// Characterisation of the start.
    pub start: Characterisation,
    learned: Learned,
    tracker: Box<dyn AnyTracker>,
    progress: Progress,
}

/// What the start said, which no later row changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    rig: Rig,
    prior: Prior,
    period_s: f64,
    change_per_root_s: f64,
    gain: f64,
    offset_k: f64,
    tau_s: [f64; 2],
    log_variance: [f64; 2],
}

/// How far the rows have come, and how well they fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Progress {
    last_s: Option<f64>,
    /// Of a row that was left out, since it was far from the last one.
    elsewhere_s: Option<f64>,
    /// Mean square of late of what is new in a reading, over its variance.
    energy: f64,
}

impl fmt::Debug for Live {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { start, learned, progress, .. } = self;
        let mut out = f.debug_struct("Live");
        out.field("start", start).field("learned", learned).field("progress", progress).finish_non_exhaustive()
    }
}

impl Live {
    /// Characterises `record`, the start, and learns from it what the gas is like: what comes after
    /// is taken to go on so.
    ///
    /// # Errors
    /// As [`crate::characterise_with`]; [`Error::LiveEffect`] for a model with an effect that a
    /// stream cannot undo, [`Error::LiveStart`] where the start does not determine both time
    /// constants, or they may not be used and [`Options::best_effort`] does not ask for them all the same, or is not
    /// evenly spaced.
    ///
    /// ```
    #[doc = include_str!("../example.txt")]
    /// let model = twinlag::diagnose(&record, &DiagnoseOptions::default())?.model();
    /// let mut live = Live::start(&record, &LiveOptions { model: Some(model), ..LiveOptions::default() })?;
    /// for k in 0..record.len() {
    ///     let row = [Some(record.t1_c[k]), Some(record.t2_c[k])];
    ///     let now = live.push(Some(record.time_s[k]), row).expect("later than the row before");
    ///     assert!(now.gas_std_k > 0.0);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn start(record: &Record, options: &LiveOptions) -> Result<Self, Error> {
        options.characterise.check_not_fitted("live tracking")?;
        if record.sampling.kind == SamplingKind::Irregular {
            return Err(Error::LiveStart { why: "rows that are evenly spaced in time".into() });
        }
        let model = options.model.as_ref().map(streamable).transpose()?;
        let (mut start, fit) = with_model(record, model.as_ref(), &options.characterise)?;
        let tau_s = [0, 1].map(|i| fit.time_constants[i].value_s);
        let (Some(extended), [Some(tau1_s), Some(tau2_s)]) = (&fit.extended, tau_s) else {
            return Err(Error::LiveStart {
                why: "rows that determine both time constants: wait for more rows, or give a known time constant"
                    .into(),
            });
        };
        let tau_s = [tau1_s, tau2_s];
        let withheld = start.sensors.iter().find(|s| s.judgement.grade == Grade::NoGo);
        if let Some(sensor) = withheld.filter(|_| !options.characterise.best_effort) {
            let (channel, because) = (&sensor.channel, &sensor.judgement.because);
            return Err(Error::LiveStart {
                why: format!(
                    "rows whose time constants may be used, and that of {channel} may not: {because}. A diagnosis of these rows \
                     looks for what is missing, and its model can be used here; or give a known time constant"
                ),
            });
        }
        let (readings, rig) = extended.rig(extended.parameters())?;
        let [gain, offset_k] = extended.calibration(extended.parameters());
        let prior = learn(&readings, &rig)?.prior;
        let change_per_root_s = options.change_per_root_s.unwrap_or(CHANGE / (CHANGE_OVER * tau1_s.max(tau2_s)).sqrt());
        if start.status == Status::ModelRejected {
            start.warnings.push(
                "the start contradicts the model, so the errors of gas temperature and time constants may exceed their bands. A \
                 diagnosis of the start looks for what is missing, and its model can be used here"
                    .into(),
            );
        }
        let period_s = record.sampling.period_s;
        let tracker =
            tracker(&rig, &prior, period_s, change_per_root_s).ok_or(Error::LiveEffect { effect: "delay" })?;
        let log_variance = [0, 1].map(|i| {
            let error_s = fit.time_constants[i].standard_error_s.unwrap_or(0.0);
            (error_s / tau_s[i]).powi(2)
        });
        let learned = Learned { rig, prior, period_s, change_per_root_s, gain, offset_k, tau_s, log_variance };
        Ok(Self { start, learned, tracker, progress: Progress { last_s: None, elsewhere_s: None, energy: 1.0 } })
    }

    /// What is known once a row is read: both readings, °C, `None` for one that is missing, at
    /// `time_s`; a sample after the last one where that is not said. `None` for a row that is left out, since it is not later
    /// than the last one. Samples that are missing in a gap are gone through as such.
    ///
    /// A row that is 100 000 samples later, or more than 100 earlier, is left out as well, unless the next one goes on from it:
    /// there was a pause, or the clock was set. Where it was set back, which does not show how long that took, all that the rows
    /// before said of gas and time constants is forgotten.
    ///
    /// ```
    #[doc = include_str!("../example.txt")]
    /// let mut calibrated = channels(1)?;
    /// calibrated.t2_c.iter_mut().for_each(|c| *c -= 2.0);
    /// let start = Record::from_channels(calibrated, SamplingChoice::Auto)?;
    /// let mut live = Live::start(&start, &LiveOptions::default())?;
    ///
    /// // Rows go on as they come: without a stamp they are a sample apart.
    /// let both = live.push(None, [Some(300.0), Some(300.0)]).expect("the first row");
    /// let one = live.push(None, [Some(300.0), None]).expect("a row with a reading");
    /// assert!((one.time_s - both.time_s - start.sampling.period_s).abs() < 1e-12); // rounding
    /// // A row that is not later than the last one is left out.
    /// assert_eq!(live.push(Some(both.time_s), [Some(300.0), Some(300.0)]), None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn push(&mut self, time_s: Option<f64>, reading_c: [Option<f64>; 2]) -> Option<LiveAnswer> {
        let next_s = self.progress.last_s.map_or(0.0, |last_s| last_s + self.learned.period_s);
        let time_s = time_s.filter(|t| t.is_finite()).unwrap_or(next_s);
        let is_resumed = self.come_to(time_s)?;
        let [first, second] = reading_c.map(|c| c.filter(|c| c.is_finite()));
        let now = self.tracker.push([first, second.map(|c| (c - self.learned.offset_k) / self.learned.gain)]);
        let count = reading_c.iter().flatten().filter(|c| c.is_finite()).count();
        if count > 0 {
            self.progress.energy += (now.normalised_innovation_squared / count as f64 - self.progress.energy) / WATCHED;
        }
        // Of two readings a sample half a chi-square of two degrees, whose variance is 1.
        let excess = self.progress.energy - 1.0 > CLEARLY / (2.0 * WATCHED).sqrt();
        let widened_by = if excess { self.progress.energy.sqrt() } else { 1.0 };
        let is_beyond = now.chance_beyond > LIKELY;
        let factor = now.log_factor.exp();
        let tau_s = self.learned.tau_s.map(|tau_s| tau_s * factor);
        let tau_95_s = [0, 1].map(|i| {
            let half = widened_by * Z_975 * (now.log_variance + self.learned.log_variance[i]).sqrt();
            Some([-half, half].map(|by| tau_s[i] * by.exp())).filter(|band| !is_beyond && !spans_too_much(*band))
        });
        Some(LiveAnswer {
            time_s,
            gas_c: now.gas_c,
            gas_std_k: widened_by * now.variance_k2.sqrt(),
            tau_s: [0, 1].map(|i| tau_95_s[i].map(|_| tau_s[i])),
            tau_95_s,
            is_beyond,
            widened_by,
            is_resumed,
        })
    }

    /// Goes through what is missing between the last row and `time_s`, and says whether that was a long pause or another clock;
    /// `None` where a row at `time_s` is to be left out.
    fn come_to(&mut self, time_s: f64) -> Option<bool> {
        let steps_from = |from_s: f64| ((time_s - from_s) / self.learned.period_s).round();
        let is_next = |steps: f64| (1.0..=LONGEST_GAP).contains(&steps);
        let steps = self.progress.last_s.map_or(1.0, steps_from);
        let is_resumed = !is_next(steps);
        if is_resumed {
            let is_late = (-MOST_LATE..1.0).contains(&steps);
            if is_late || !self.progress.elsewhere_s.is_some_and(|from_s| is_next(steps_from(from_s))) {
                self.progress.elsewhere_s = Some(time_s).filter(|_| !is_late);
                return None;
            }
        }
        self.tracker.skip(if steps > 0.0 { steps as u64 - 1 } else { u64::MAX });
        (self.progress.last_s, self.progress.elsewhere_s) = (Some(time_s), None);
        Some(is_resumed)
    }
}

/// The effects of a model that a stream can undo.
fn streamable(model: &Model) -> Result<Model, Error> {
    // What masks readings belongs to a record; what changes the time constants is what is followed.
    let is_of_the_record = |effect: Identifier| effect.about().is_defect || effect.about().changes_time_constants;
    let mut model = model.clone();
    model.effects.retain(|e| !is_of_the_record(e.effect));
    let is_curved = |name: &str| name.starts_with("curvature");
    for e in &model.effects {
        if !e.effect.about().is_streamable || e.parameters.iter().any(|p| is_curved(&p.value.name)) {
            return Err(Error::LiveEffect { effect: e.effect.name() });
        }
    }
    Ok(model)
}
