//! A model that was found in one record, to be used on others: schema `twinlag.model/1`.

use serde::{Deserialize, Serialize};
use twinlag_compensate::GasParts;
use twinlag_diagnose::{Diagnosis, Found, Grade, Identifier, Judgement, KnownEffect, Reason, Value, Verdict};
use twinlag_record::Record;

use crate::answers::{Characterisation, EffectNumber, FoundIn, GasSpectrum, MadeBy, NamedEffect};
use crate::error::Error;
use crate::options::Options;

/// A model that was found in one record, to be used on others of the same rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Model {
    /// `twinlag.model/1`.
    pub schema: String,
    /// Names of the channels.
    pub channels: [String; 2],
    /// Time constants, s; `None` where the record did not determine them.
    pub time_constants_s: [Option<f64>; 2],
    /// Noise of the channels, K; `None` in a model that is of no record.
    #[serde(rename = "noise_std_K")]
    pub noise_std_k: Option<[f64; 2]>,
    /// The effects.
    pub effects: Vec<ModelEffect>,
    /// What the diagnosis said of its record; `None` in a model that is of no record, and in files of earlier versions.
    #[serde(default)]
    pub verdict: Option<Verdict>,
    /// Energy that it leaves over beside that of the noise, as a share of it, where it counts as complete.
    #[serde(default)]
    pub explained_to: Option<f64>,
    /// Whether its time constants may be used; `None` as in [`Self::verdict`].
    #[serde(default)]
    pub time_constant_grades: Option<[Judgement; 2]>,
    /// The data that it was found in; `None` as in [`Self::verdict`].
    #[serde(default)]
    pub found_in: Option<FoundIn>,
    /// What the gas of a record was like, where one was compensated: with it the search for what the gas is like in another
    /// record begins, and ends there if nothing else explains more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gas: Option<GasParts>,
    /// The spectrum of the gas as the record of a diagnosis shows it; `None` as in [`Self::verdict`], and where that record has
    /// none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gas_spectrum: Option<GasSpectrum>,
    /// What made it.
    pub made_by: MadeBy,
}

/// An effect of a [`Model`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ModelEffect {
    /// Its identifier.
    pub effect: Identifier,
    /// Name of its channel; `None` where it is of both.
    pub channel: Option<String>,
    /// Its parameters.
    pub parameters: Vec<ModelNumber>,
    /// Effects that explained the record as well, the effect itself among them where it may be in the other channel; none in files of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alternatives: Vec<Identifier>,
}

/// A number of an effect of a [`Model`]: there also where it may not be used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ModelNumber {
    /// The number.
    #[serde(flatten)]
    pub value: Value,
    /// Whether it may be used; `None` in files of earlier versions.
    #[serde(default)]
    pub grade: Option<Grade>,
    /// Why.
    #[serde(default)]
    pub because: String,
}

impl ModelNumber {
    fn of(value: Value, judgement: &Judgement) -> Self {
        Self { value, grade: Some(judgement.grade), because: judgement.because.clone() }
    }
}

impl ModelEffect {
    /// An effect as the loop found it.
    pub(crate) fn found(found: &Found, channels: &[String; 2]) -> Self {
        let channel = found.fitted_in.map(|i| channels[i].clone());
        let numbers = found.parameters.iter().zip(&found.judgements);
        let parameters = numbers.map(|(value, judgement)| ModelNumber::of(value.clone(), judgement)).collect();
        let alternatives = alternatives(found.effect, &found.alternatives, found.channel == found.fitted_in);
        Self { effect: found.effect, channel, parameters, alternatives }
    }

    /// An effect with the numbers that an answer gives of it.
    pub(crate) fn given(effect: &NamedEffect) -> Self {
        let values = effect.parameters.iter().filter_map(|p| {
            let EffectNumber { name, value, standard_error, interval_95, unit, judgement } = p.clone();
            Some(ModelNumber::of(Value { name, value: value?, standard_error, interval_95, unit }, &judgement))
        });
        let alternatives = alternatives(effect.effect, &effect.alternatives, effect.channel == effect.fitted_in);
        Self { effect: effect.effect, channel: effect.fitted_in.clone(), parameters: values.collect(), alternatives }
    }
}

/// What explains a record as well as `effect` where it was fitted.
///
/// - `is_of_one`: whether the other channel is excluded
fn alternatives(effect: Identifier, others: &[Identifier], is_of_one: bool) -> Vec<Identifier> {
    others.iter().copied().chain((!is_of_one).then_some(effect)).collect()
}

impl Model {
    /// The schema's name and number.
    pub const SCHEMA: &'static str = "twinlag.model/1";

    /// The model of two first-order lags, without an effect.
    ///
    /// ```
    #[doc = include_str!("../example.txt")]
    /// // A model is of its channels: on a record of others it is refused.
    /// let model = Model::of_two_lags(["inlet".into(), "outlet".into()]);
    /// let error = twinlag::characterise_with(&record, &model, &Options::default()).expect_err("of other channels");
    /// assert_eq!(error.settings(), [Setting::Channels]);
    /// assert!(error.to_string().contains("inlet") && error.to_string().contains(&record.channels[0]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of_two_lags(channels: [String; 2]) -> Self {
        Self {
            schema: Self::SCHEMA.into(),
            channels,
            time_constants_s: [None; 2],
            noise_std_k: None,
            effects: Vec::new(),
            verdict: None,
            explained_to: None,
            time_constant_grades: None,
            found_in: None,
            gas: None,
            gas_spectrum: None,
            made_by: MadeBy::with(&Options::default()),
        }
    }

    /// What a diagnosis found, and the last of its models.
    pub(crate) fn found(core: &Diagnosis, last: &Characterisation, found_in: Option<FoundIn>) -> Self {
        let of_last = Self::of(last);
        let taus = of_last.time_constants_s;
        Self {
            time_constants_s: [0, 1].map(|i| taus[i].or(core.last.time_constants[i].value_s)),
            effects: core
                .effects
                .iter()
                .filter(|found| found.is_in_the_model && !found.is_of_each_record)
                .map(|found| ModelEffect::found(found, &of_last.channels))
                .collect(),
            verdict: Some(core.verdict),
            explained_to: core.explained_to,
            found_in,
            gas_spectrum: GasSpectrum::of(&core.last.trace.gas_c),
            ..of_last
        }
    }

    /// The time constants and the noise of `last`.
    pub(crate) fn of(last: &Characterisation) -> Self {
        Self {
            time_constants_s: [0, 1].map(|i| last.sensors[i].time_constant_s),
            noise_std_k: Some([0, 1].map(|i| last.sensors[i].noise_std_k)),
            time_constant_grades: Some([0, 1].map(|i| last.sensors[i].judgement.clone())),
            made_by: last.made_by.clone(),
            ..Self::of_two_lags(last.record.channels.clone())
        }
    }

    /// Whether it is of the channels of `record`, and its numbers are such.
    pub(crate) fn check(&self, record: &Record) -> Result<(), Error> {
        if self.channels != record.channels {
            let (model, record) = (self.channels.clone(), record.channels.clone());
            return Err(Error::ModelChannels { model, record });
        }
        let noise =
            (1..).zip(self.noise_std_k.iter().flatten()).map(|(i, k)| (format!("a noise of channel {i} of"), *k));
        let tau = (1..)
            .zip(&self.time_constants_s)
            .filter_map(|(i, s)| Some((format!("a time constant of sensor {i} of"), (*s)?)));
        match noise.chain(tau).find(|(_, got)| !got.is_finite() || *got <= 0.0) {
            Some((what, got)) => Err(Error::ModelNumber { what, got }),
            None => Ok(()),
        }
    }

    /// The effects by the places of their channels.
    pub(crate) fn known_effects(&self) -> Vec<KnownEffect> {
        let place = |name: &String| self.channels.iter().position(|c| c == name);
        let known = self.effects.iter().map(|e| KnownEffect {
            effect: e.effect,
            channel: e.channel.as_ref().and_then(place),
            parameters: e.parameters.iter().map(|p| (p.value.name.clone(), p.value.value)).collect(),
        });
        known.collect()
    }

    /// Whether it was found in `record`.
    pub(crate) fn is_of(&self, record: &Record) -> bool {
        self.found_in.as_ref().is_some_and(|data| data.is(record))
    }

    /// What numbers rest on that are found in `record` with this model, the gravest first.
    ///
    /// - `fitted_again`: effects that are not held at its numbers
    pub(crate) fn reasons(&self, record: &Record, fitted_again: &[Identifier]) -> Vec<Reason> {
        let mut out: Vec<Reason> = self.incomplete().into_iter().collect();
        let held: Vec<&ModelEffect> =
            self.effects.iter().filter(|e| e.is_of_the_rig() && !fitted_again.contains(&e.effect)).collect();
        let source = self.found_in.as_ref().map(|data| data.source.clone());
        if held.is_empty() {
            let of_its_own = || self.of_its_time_constants();
            out.extend(if self.is_of(record) { of_its_own() } else { Some(Reason::NothingInModel { source }) });
            return out;
        }
        let no_go: Vec<String> =
            numbers(&held).filter(|(_, p)| p.grade == Some(Grade::NoGo)).map(|(e, p)| p.of_effect(e)).collect();
        if !no_go.is_empty() {
            out.push(Reason::ModelNoGo { what: no_go.join(", ") });
        }
        let times =
            numbers(&held).filter(|(_, p)| p.value.unit == "s").map(|(_, p)| (&p.value.name, p.value.value.abs()));
        let shortest = times.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(name, time_s)| (name.replace('_', " "), time_s));
        let shortest = shortest.as_ref().map(|(name, time_s)| (name.as_str(), *time_s));
        let outside = self.found_in.as_ref().map_or_else(Vec::new, |data| data.outside(record, shortest));
        if !outside.is_empty() {
            out.push(Reason::OutsideRange { what: outside.join(", ") });
        }
        out.push(Reason::HeldAtModel { source });
        // One of them says enough.
        let conditional = numbers(&held).find(|(_, p)| p.grade == Some(Grade::Conditional));
        out.extend(conditional.map(|(effect, p)| Reason::Follows {
            from: format!("the {} in the model", p.of_effect(effect)),
            grade: Grade::Conditional,
            because: p.because.clone(),
        }));
        out
    }

    /// What its own record left open of its time constants: the same record does not settle it when it is fitted again.
    fn of_its_time_constants(&self) -> Option<Reason> {
        let worst = self.time_constant_grades.iter().flatten().max_by_key(|judgement| judgement.grade)?;
        let Judgement { grade, because, .. } = worst.clone();
        (grade != Grade::Go).then(|| Reason::Follows { from: "the time constants in the model".into(), grade, because })
    }

    /// Why it may lack something, where that is so.
    fn incomplete(&self) -> Option<Reason> {
        let source = || self.found_in.as_ref().map_or("unknown".into(), |data| data.source.clone());
        match self.verdict {
            Some(Verdict::Adequate | Verdict::Explained) => None,
            Some(verdict) => Some(Reason::ModelNotExplained { verdict, source: source() }),
            // A model of no record has no noise.
            None => self.noise_std_k.map(|_| Reason::ModelUnjudged),
        }
    }
}

impl ModelEffect {
    /// Whether it may be held at its numbers in another record: defects of the data and a line in the spectrum belong to one.
    fn is_of_the_rig(&self) -> bool {
        let about = self.effect.about();
        !(about.is_defect || about.is_narrow)
    }
}

impl ModelNumber {
    /// Its name, with that of its effect.
    fn of_effect(&self, effect: Identifier) -> String {
        format!("{} of {effect}", self.value.name.replace('_', " "))
    }
}

/// All numbers of these effects.
fn numbers<'a>(effects: &'a [&ModelEffect]) -> impl Iterator<Item = (Identifier, &'a ModelNumber)> {
    effects.iter().flat_map(|e| e.parameters.iter().map(|p| (e.effect, p)))
}
