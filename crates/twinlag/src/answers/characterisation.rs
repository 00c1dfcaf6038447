//! The answer in the form that scripts read: schema `twinlag.characterisation/1`.

use serde::{Deserialize, Serialize};
use twinlag_cross_relation::ResidualTest;
use twinlag_diagnose::{Grade, Judgement, Reason};
use twinlag_estimate::{IntervalBasis, Known, NoiseSource};
use twinlag_optimise::{End, Fit};
use twinlag_record::{Record, Sampling, SamplingKind};

use crate::answers::{PlausibleTimeConstant, RecordAnswer, TransferAnswer};
use crate::options::Options;
use crate::setting::Setting;

/// Whether there is an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Status {
    /// Both time constants are determined, and the residual is consistent with noise.
    Ok,
    /// The best fit lies on a bound, so it is not an estimate.
    AtBound,
    /// The record does not determine the time constants apart;
    /// [`Characterisation::not_identifiable`] names what it does not.
    NotIdentifiable,
    /// The record contradicts the model, whose residual is not noise, or a time constant that was known beforehand.
    ModelRejected,
}

/// A number with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Standard error of the estimate; `None` if the interval has no single width.
    pub standard_error: Option<f64>,
    /// 95 % interval.
    pub interval_95: [f64; 2],
    /// Whether it may be used.
    #[serde(default, flatten)]
    pub judgement: Judgement,
}

/// Summary of the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RecordSummary {
    /// File or name.
    pub source: String,
    /// Rows.
    pub samples: usize,
    /// Time from sample to sample, s: the mean over unbroken stretches.
    pub sample_period_s: f64,
    /// Rows in which a channel is missing.
    pub missing: usize,
    /// Names of the channels.
    pub channels: [String; 2],
    /// Unbroken stretches.
    pub segments: usize,
    /// How the time stamps are spaced.
    pub sampling: Sampling,
}

impl RecordSummary {
    pub(crate) fn of(record: &Record) -> Self {
        let sample_period_s = match record.sampling.kind {
            SamplingKind::Irregular => {
                let steps = record.segments.iter().map(|rows| rows.len() - 1).sum::<usize>();
                record.observed_s() / steps as f64
            }
            _ => record.sampling.period_s,
        };
        Self {
            source: record.source.clone(),
            samples: record.len(),
            sample_period_s,
            missing: record.missing,
            channels: record.channels.clone(),
            segments: record.segments.len(),
            sampling: record.sampling,
        }
    }
}

/// What is found of one sensor; `None` where the record does not determine it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SensorEstimate {
    /// Name of the channel.
    pub channel: String,
    /// Time constant, s.
    pub time_constant_s: Option<f64>,
    /// Its standard error, s.
    pub standard_error_s: Option<f64>,
    /// Its 95 % interval, s.
    pub interval_95_s: Option<[f64; 2]>,
    /// How the interval was found.
    pub interval_basis: Option<IntervalBasis>,
    /// Time constant of its second lag, s, the smaller of the two; `None` where it was not asked.
    /// Without a value where none is seen or it is not determined: the interval then says how large
    /// it may be.
    pub second_time_constant_s: Option<SecondLag>,
    /// Noise standard deviation that was given or found, K.
    #[serde(rename = "noise_std_K")]
    pub noise_std_k: f64,
    /// Its standard error, K; `None` where it was given, or is not known.
    #[serde(rename = "noise_standard_error_K")]
    pub noise_standard_error_k: Option<f64>,
    /// First-order autoregressive coefficient of the noise; `None` where it was taken to be white.
    pub noise_ar1: Option<f64>,
    /// Where the noise level comes from; `None` where the fit does not say.
    pub noise_from: Option<NoiseSource>,
    /// Whether the time constant was given, not found.
    pub known: bool,
    /// Whether the time constant may be used; one that may not is not given.
    #[serde(default, flatten)]
    pub judgement: Judgement,
}

/// Estimate of a sensor's second lag.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SecondLag {
    /// The estimate, s; `None` if no second lag is detected, or if it is not determined.
    pub value: Option<f64>,
    /// Its standard error, s.
    pub standard_error: Option<f64>,
    /// 95 % interval, s; from 0 if no second lag is detected.
    pub interval_95: Option<[f64; 2]>,
    /// Whether the value was given, not estimated.
    pub known: bool,
    /// Whether it may be used.
    #[serde(default, flatten)]
    pub judgement: Judgement,
}

/// Relative calibration of channel 2 against channel 1: `y2 = gain · y1 + offset` at rest. `None`
/// where not fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FreeParameters {
    /// Gain of channel 2 relative to channel 1.
    pub gain: Option<Estimated>,
    /// Offset of channel 2 relative to channel 1 at 0 °C, K.
    #[serde(rename = "offset_K")]
    pub offset_k: Option<Estimated>,
}

/// `time_constant_difference_s` of the schema.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Difference {
    /// `τ2 − τ1`, s; `None` where it is not determined, and where the best fit lies on a bound.
    pub value: Option<f64>,
    /// Its 95 % interval, s. Without a value it says how large the difference may be.
    pub interval_95_s: Option<[f64; 2]>,
    /// Whether it is the total delay of channel 2, `τ2 − τ1` and a delay together, of which the record does not determine
    /// the parts.
    #[serde(default)]
    pub includes_delay: bool,
    /// Whether it may be used; one that may not is not given.
    #[serde(default, flatten)]
    pub judgement: Judgement,
}

/// The residual of the fit, and its tests.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Residual {
    /// Energy of the whitened residual per degree of freedom: 1 where only noise of the stated
    /// level is left. `None` if there are no degrees of freedom, or if the levels were made to fit
    /// since only their ratio was given.
    pub chi2_per_dof: Option<f64>,
    /// Whether the autocorrelations of the residual are those of white noise.
    pub white: bool,
    /// The tests.
    pub tests: Vec<ResidualTest>,
}

/// How the intervals were found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum IntervalMethod {
    /// Noise of the stated levels, the noise-noise term and what found levels are uncertain by
    /// included.
    Information,
    /// From the spectrum of the residual itself, which includes model error.
    ResidualSpectrum,
    /// From every value of the undetermined time constant that the record allows.
    Profile,
    /// Estimates of this estimator on simulated records.
    Bootstrap,
    /// There are no intervals.
    None,
}

/// What made this answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct MadeBy {
    /// `twinlag`.
    pub program: String,
    /// Its version.
    pub version: String,
    /// The options that were given.
    pub options: Options,
}

impl MadeBy {
    /// This version, asked so.
    pub(crate) fn with(options: &Options) -> Self {
        let version = env!("CARGO_PKG_VERSION").into();
        Self { program: "twinlag".into(), version, options: options.clone() }
    }
}

/// Both time constants of a record, with everything needed to judge and repeat them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Characterisation {
    /// `twinlag.characterisation/1`.
    pub schema: String,
    /// Summary of the record.
    pub record: RecordSummary,
    /// Name of the estimator.
    pub estimator: String,
    /// Name of the optimiser.
    pub optimiser: String,
    /// How the gas was assumed to move between samples.
    pub hold: String,
    /// How much each time constant moves, relative, if the gas is taken to do the other thing between samples: with uneven samples, to go
    /// in straight lines; `None` where this was not tried.
    pub hold_sensitivity: Option<[f64; 2]>,
    /// Sensors 1 and 2.
    pub sensors: [SensorEstimate; 2],
    /// The difference, which a record determines best.
    pub time_constant_difference_s: Difference,
    /// Relative calibration, where fitted.
    pub free: FreeParameters,
    /// What the fit leaves over, and its tests.
    pub residual: Residual,
    /// How the intervals were found; [`SensorEstimate::interval_basis`] has the shape of each.
    pub interval_method: IntervalMethod,
    /// Whether there is an answer.
    pub status: Status,
    /// What this record does not determine.
    pub not_identifiable: Vec<String>,
    /// What speaks against the use of the model that was given, if one was: it did not explain its own record, holds numbers
    /// that are no-go, or was found in other data than these.
    #[serde(default)]
    pub model_remarks: Vec<String>,
    /// Each record, where there are several of one rig.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub records: Vec<RecordAnswer>,
    /// Errors of records that had no part in the fit, each left out in turn, where there are several: with two lags alone, so before
    /// and after are the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<TransferAnswer>,
    /// The time constants beside what was expected of them, where that was asked ([`Plausibility`](crate::Plausibility)).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plausibility: Vec<PlausibleTimeConstant>,
    /// What to know before using the numbers.
    pub warnings: Vec<String>,
    /// Settings that may help where there is no answer, the most likely first.
    #[serde(default)]
    pub advice: Vec<Setting>,
    /// How the best fit ended. Its point is where it ended, not an estimate, unless the status says
    /// so.
    pub fit: Fit,
    /// Number of starts; `None` where the fit does not say.
    pub starts: Option<usize>,
    /// How the file was understood.
    pub notes: Vec<String>,
    /// What made this answer.
    pub made_by: MadeBy,
}

/// Whether a fit ended on a bound of a time constant, so that neither it nor the difference is an estimate.
pub(crate) fn is_on_bound_of_time_constant(end: &End) -> bool {
    matches!(end, End::OnBound(which) if which.iter().any(|&i| i < 2))
}

impl Characterisation {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.characterisation/1";

    /// Puts down one more reason for all numbers that were found.
    pub(crate) fn rest_on(&mut self, reason: &Reason) {
        let rest = |judgement: &mut Judgement| *judgement = std::mem::take(judgement).and(reason);
        for sensor in &mut self.sensors {
            if !sensor.known {
                rest(&mut sensor.judgement);
            }
            if let Some(lag) = sensor.second_time_constant_s.as_mut().filter(|lag| !lag.known) {
                rest(&mut lag.judgement);
            }
        }
        rest(&mut self.time_constant_difference_s.judgement);
        for free in [&mut self.free.gain, &mut self.free.offset_k].into_iter().flatten() {
            rest(&mut free.judgement);
        }
    }

    /// Says that the time constants are not determined, whatever the fit made of them.
    pub(crate) fn leave_undetermined(&mut self) {
        self.status = Status::NotIdentifiable;
        for (sensor, name) in self.sensors.iter().zip(Known::NAMES) {
            if !sensor.known && !self.not_identifiable.iter().any(|known| known == name) {
                self.not_identifiable.push(name.to_owned());
            }
        }
    }

    /// Takes out what may not be used. Where a time constant goes, the answer is not `ok`.
    pub(crate) fn withhold(&mut self) {
        let named = self.sensors.iter().zip(Known::NAMES);
        let withheld: Vec<String> = named
            .filter(|(sensor, _)| sensor.judgement.grade == Grade::NoGo)
            .map(|(_, name)| name.to_owned())
            .collect();
        if self.status == Status::Ok && !withheld.is_empty() {
            self.status = Status::NotIdentifiable;
            self.not_identifiable.extend(withheld);
        }
        for sensor in self.sensors.iter_mut().filter(|s| s.judgement.grade == Grade::NoGo) {
            (sensor.time_constant_s, sensor.standard_error_s, sensor.interval_95_s) = (None, None, None);
            sensor.interval_basis = None;
        }
        let lags = self.sensors.iter_mut().filter_map(|s| s.second_time_constant_s.as_mut());
        for lag in lags.filter(|lag| lag.judgement.grade == Grade::NoGo) {
            (lag.value, lag.standard_error) = (None, None);
        }
        let difference = &mut self.time_constant_difference_s;
        if difference.judgement.grade == Grade::NoGo && difference.value.take().is_some() {
            difference.interval_95_s = None;
        }
        let is_given = |e: &Estimated| e.judgement.grade != Grade::NoGo;
        self.free.gain = self.free.gain.take().filter(is_given);
        self.free.offset_k = self.free.offset_k.take().filter(is_given);
    }

    /// Grades of what is asked of every record: both time constants and their difference.
    pub fn grades(&self) -> [Grade; 3] {
        let [one, two] = &self.sensors;
        [one.judgement.grade, two.judgement.grade, self.time_constant_difference_s.judgement.grade]
    }

    /// Takes the difference out where the best fit lies on a bound of a time constant.
    pub(crate) fn drop_difference_on_bound(&mut self) {
        if is_on_bound_of_time_constant(&self.fit.end) {
            self.time_constant_difference_s =
                Difference { judgement: Judgement::of(&[Reason::NotDetermined]), ..Difference::default() };
            self.not_identifiable.push("time_constant_difference_s".into());
            self.warnings.push(
                "the best fit lies on a bound of a time constant, so neither it nor the difference of the time constants \
                 is an estimate"
                    .into(),
            );
        }
    }
}
