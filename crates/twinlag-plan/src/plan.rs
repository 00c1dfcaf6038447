//! The answer: what a record is expected to give, as it is and changed; schema `twinlag.plan/1`.

use serde::{Deserialize, Serialize};
use twinlag::diagnosis::{Identifier, NEVER_TESTABLE};
use twinlag::model::Policy;
use twinlag::signal::{Rig, Signal};

use crate::advice::advice;
use crate::change::{Change, LONGEST_FACTOR};
use crate::error::PlanError;
use crate::expected::{Expected, MAX_SAMPLES};
use crate::rivals::{Rival, rivals};

/// Standard deviations of a deviance by which it has to exceed what decides, to count as clear: one record in forty is less.
const CLEAR_STANDARD_DEVIATIONS: f64 = 2.0;

/// What a plan is of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Source {
    /// A described rig.
    Rig,
    /// What a diagnosis found in a record, with the gas of that record.
    Diagnosis,
}

/// A number that a record is expected to determine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct PlannedNumber {
    /// Its name: `time_constant_s` of a sensor, `time_constant_difference_s`, or the parameter of an effect.
    pub name: String,
    /// The effect that has it; `None` of time constants and their difference.
    pub effect: Option<Identifier>,
    /// The channel; `None` of both.
    pub channel: Option<String>,
    /// The value that is assumed.
    pub value: f64,
    /// Its expected standard error; `None` where the record does not determine it.
    pub standard_error: Option<f64>,
    /// The standard error over that of the record as it is; `None` where either is not determined.
    pub over_now: Option<f64>,
    /// Unit of the number.
    pub unit: String,
}

/// An effect that might be taken for another one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct PlannedRival {
    /// The effect that the rig has.
    pub effect: Identifier,
    /// Its channel; `None` of both.
    pub channel: Option<String>,
    /// The effect in its place.
    pub rival: Identifier,
    /// The channel of that.
    pub rival_channel: Option<String>,
    /// Deviance to expect between both, everything fitted again, one factor of both levels of the noise among it.
    pub deviance: f64,
    /// No deviance is expected to be more: the one to expect if the levels of the noise are known.
    pub deviance_at_most: f64,
    /// Its standard deviation from record to record, `2 √deviance`.
    pub standard_deviation: f64,
    /// Whether 39 records of 40 distinguish both: the deviance is above what decides by two of its standard deviations.
    pub is_distinguished: bool,
}

/// What is expected of one record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct PlannedRecord {
    /// The change; `None` of the record as it is.
    pub change: Option<Change>,
    /// The change in words.
    pub description: String,
    /// Samples.
    pub samples: usize,
    /// Time from sample to sample, s.
    pub sample_period_s: f64,
    /// Standard errors.
    pub numbers: Vec<PlannedNumber>,
    /// Effects that might be taken for those of the rig.
    pub rivals: Vec<PlannedRival>,
}

/// Whether the record as it is determines both time constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum PlanStatus {
    /// It does.
    Ok,
    /// It does not.
    NotIdentifiable,
}

/// What the next record would have to be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Plan {
    /// `twinlag.plan/1`.
    pub schema: String,
    /// What it is of.
    pub source: Source,
    /// Names of the channels.
    pub channels: [String; 2],
    /// Whether the record as it is determines both time constants.
    pub status: PlanStatus,
    /// Standard deviation of the gas, K.
    #[serde(rename = "gas_std_K")]
    pub gas_std_k: f64,
    /// Standard deviations of the noise, K.
    #[serde(rename = "noise_std_K")]
    pub noise_std_k: [f64; 2],
    /// Deviance above which one effect is named rather than another.
    pub deciding_deviance: f64,
    /// The record as it is.
    pub as_it_is: PlannedRecord,
    /// Changed records.
    pub changed: Vec<PlannedRecord>,
    /// What to change, and by how much.
    pub advice: Vec<String>,
    /// What no change of the record reveals.
    pub not_testable: Vec<String>,
    /// What to know before relying on the numbers.
    pub remarks: Vec<String>,
}

impl Plan {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.plan/1";

    /// What records of `rig` are expected to determine, as it is and with each of a set of changes.
    ///
    /// # Errors
    /// As [`Expected::of`].
    pub fn of_rig(rig: &Rig) -> Result<Self, PlanError> {
        Self::of(rig, Source::Rig, Vec::new())
    }

    /// As [`Self::of_rig`].
    ///
    /// - `remarks`: what is known of the rig beforehand
    pub(crate) fn of(rig: &Rig, source: Source, mut remarks: Vec<String>) -> Result<Self, PlanError> {
        let channels = rig.sensors().each_ref().map(|sensor| sensor.channel.clone());
        let policy = Policy::default();
        let expected = Expected::of(rig)?;
        let base_rivals = rivals(&expected);
        let now = Now { expected: &expected, rivals: &base_rivals, channels: &channels, policy: &policy };
        let as_it_is = now.record(None, rig, &expected, &base_rivals);
        remarks.extend(now.remarks(rig));
        let mut changed = Vec::new();
        for group in changes(rig, &expected) {
            let mut best: Option<PlannedRecord> = None;
            for change in group {
                match now.changed(change, rig) {
                    Ok(record) => {
                        let worst = |r: &PlannedRecord| r.largest_relative_error();
                        if best.as_ref().is_none_or(|known| worst(&record) < worst(known)) {
                            best = Some(record);
                        }
                    }
                    Err(error) => remarks.push(format!("{} was not tried: {error}", change.in_words(&channels))),
                }
            }
            changed.extend(best);
        }
        let is_determined = as_it_is.numbers.iter().take(2).all(|n| n.standard_error.is_some());
        let mut out = Self {
            schema: Self::SCHEMA.into(),
            source,
            status: if is_determined { PlanStatus::Ok } else { PlanStatus::NotIdentifiable },
            gas_std_k: expected.gas_std_k,
            noise_std_k: expected.fitted.model.noise_std_k(),
            deciding_deviance: policy.tie_deviance,
            as_it_is,
            changed,
            advice: Vec::new(),
            not_testable: NEVER_TESTABLE.map(str::to_owned).to_vec(),
            remarks,
            channels,
        };
        out.advice = advice(&out);
        Ok(out)
    }
}

impl PlannedRival {
    /// The effect that the rig has, with its channel.
    pub fn effect_in_words(&self) -> String {
        in_words(self.effect, self.channel.as_deref())
    }

    /// The effect in its place, with its channel.
    pub fn rival_in_words(&self) -> String {
        in_words(self.rival, self.rival_channel.as_deref())
    }
}

fn in_words(effect: Identifier, channel: Option<&str>) -> String {
    channel.map_or_else(|| effect.to_string(), |channel| format!("{effect} of {channel}"))
}

impl PlannedRecord {
    /// The larger of the relative standard errors of both time constants; infinite where one is not determined.
    pub(crate) fn largest_relative_error(&self) -> f64 {
        let relative = |n: &PlannedNumber| n.standard_error.map_or(f64::INFINITY, |error| error / n.value);
        self.numbers.iter().take(2).map(relative).fold(0.0, f64::max)
    }
}

/// Changes that are tried; of each group the best is kept.
fn changes(rig: &Rig, expected: &Expected) -> Vec<Vec<Change>> {
    let tau_s = rig.sensors().each_ref().map(|sensor| sensor.time_constant_s);
    let faster = usize::from(tau_s[1] < tau_s[0]);
    let pair = |of_faster: f64, of_slower: f64| {
        let factors = if faster == 0 { [of_faster, of_slower] } else { [of_slower, of_faster] };
        vec![Change::Pair { factors }]
    };
    let around = |tau_s: f64| Change::GasAround { frequency_hz: 1.0 / (std::f64::consts::TAU * tau_s) };
    let mut out = vec![
        vec![Change::Rate { factor: 2.0 }],
        vec![Change::Rate { factor: 0.5 }],
        vec![Change::Length { factor: 2.0 }],
        vec![Change::Length { factor: LONGEST_FACTOR }],
    ];
    if !matches!(rig.gas().signal, Signal::Series(_)) {
        out.push(vec![Change::Excitation { factor: 2.0 }]);
    }
    if expected.gas_std_k > 0.0 {
        out.push(vec![around(tau_s[1 - faster]), around((tau_s[0] * tau_s[1]).sqrt()), around(tau_s[faster])]);
    }
    out.extend([pair(0.5, 1.0), pair(1.0, 2.0), pair(0.5, 0.5)]);
    out.push(vec![Change::QuietSegment]);
    out
}

/// The record as it is, which changed ones are compared with.
struct Now<'a> {
    expected: &'a Expected,
    rivals: &'a [Rival],
    channels: &'a [String; 2],
    policy: &'a Policy,
}

impl Now<'_> {
    fn changed(&self, change: Change, rig: &Rig) -> Result<PlannedRecord, PlanError> {
        if change == Change::QuietSegment {
            let known: Vec<Rival> = self.rivals.iter().map(Rival::with_known_noise).collect();
            return Ok(self.record(Some(change), rig, self.expected, &known));
        }
        let rig = change.of(rig, self.expected.gas_std_k)?;
        let expected = Expected::of(&rig)?;
        let has_same_effects = expected.fitted.theta.len() == self.expected.fitted.theta.len();
        let rivals =
            self.rivals.iter().filter(|_| has_same_effects).map(|rival| rival.on(&expected)).collect::<Vec<_>>();
        Ok(self.record(Some(change), &rig, &expected, &rivals))
    }

    fn record(&self, change: Option<Change>, rig: &Rig, expected: &Expected, rivals: &[Rival]) -> PlannedRecord {
        let record = rig.record();
        PlannedRecord {
            description: change.map_or_else(|| "as it is".into(), |change| change.in_words(self.channels)),
            change,
            samples: record.samples,
            sample_period_s: record.sample_period_s,
            numbers: self.numbers(expected),
            rivals: rivals.iter().map(|rival| self.rival(rival, expected)).collect(),
        }
    }

    fn channel(&self, place: Option<usize>) -> Option<String> {
        place.map(|i| self.channels[i].clone())
    }

    fn numbers(&self, expected: &Expected) -> Vec<PlannedNumber> {
        let model = &expected.fitted.model;
        let theta = &expected.fitted.theta;
        let number = |name: &str, effect, channel, sum: &[(usize, f64)], unit: &str| {
            let value: f64 = sum.iter().map(|(i, weight)| weight * theta[*i]).sum();
            // The difference may be determined where neither time constant is.
            let error_in = |expected: &Expected| match sum {
                [(parameter, _)] => expected.standard_error(*parameter),
                _ => expected.error_of(sum),
            };
            let (standard_error, now) = (error_in(expected), error_in(self.expected));
            PlannedNumber {
                name: name.into(),
                effect,
                channel: self.channel(channel),
                value,
                standard_error,
                over_now: standard_error.zip(now).map(|(error, now)| error / now),
                unit: unit.into(),
            }
        };
        let tau = |i: usize| number("time_constant_s", None, Some(i), &[(i, 1.0)], "s");
        let mut out =
            vec![tau(0), tau(1), number("time_constant_difference_s", None, None, &[(0, -1.0), (1, 1.0)], "s")];
        for (index, effect) in model.effects.iter().enumerate().filter(|(_, effect)| !effect.is_noise()) {
            if let Some(main) = effect.main() {
                let parameter = &effect.parameters()[main];
                let sum = [(model.range(index).start + main, 1.0)];
                out.push(number(parameter.name, Some(effect.identifier()), effect.channel(), &sum, parameter.unit));
            }
        }
        out
    }

    fn rival(&self, rival: &Rival, expected: &Expected) -> PlannedRival {
        let effect = &expected.fitted.model.effects[rival.index];
        let deviance = rival.deviance;
        let standard_deviation = 2.0 * deviance.sqrt();
        PlannedRival {
            effect: effect.identifier(),
            channel: self.channel(effect.channel()),
            rival: rival.effect,
            rival_channel: self.channel(rival.channel),
            deviance,
            deviance_at_most: rival.deviance_known_noise,
            standard_deviation,
            is_distinguished: deviance - CLEAR_STANDARD_DEVIATIONS * standard_deviation > self.policy.tie_deviance,
        }
    }

    /// What the plan does not have of the rig.
    fn remarks(&self, rig: &Rig) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        for effect in &self.expected.missing {
            out.push(format!(
                "{effect} is in the rig, and no model of this record has it: the plan takes it to be absent"
            ));
        }
        for sensor in rig.sensors() {
            let faults = [
                ("spikes", sensor.spikes.is_some()),
                ("mains pick-up", !sensor.mains.is_empty()),
                ("hysteresis", sensor.hysteresis.is_some()),
                ("a clock slip", sensor.clock_slip.is_some()),
                ("a sensor that is replaced", sensor.replaced.is_some()),
                ("an intermittent contact", sensor.intermittent_contact.is_some()),
            ];
            for (what, _) in faults.into_iter().filter(|(_, is_there)| *is_there) {
                out.push(format!(
                    "{}: {what} is not in the model, so the plan is only that of what else is there",
                    sensor.channel
                ));
            }
        }
        let samples = rig.record().samples;
        if samples > MAX_SAMPLES {
            out.push(format!(
                "the first {MAX_SAMPLES} of {samples} samples are simulated, and the rest is taken to be like them"
            ));
        }
        if self.expected.fitted.model.noise().is_some() {
            out.push("coloured noise counts as known: that it has to be found as well is not in the numbers".into());
        }
        out
    }
}
