//! A model that was found in one record, to be used on others: schema `twinlag.model/1`.

use serde::{Deserialize, Serialize};
use twinlag_diagnose::{Found, Identifier, KnownEffect, Value};
use twinlag_record::Record;

use crate::answers::{EffectNumber, MadeBy, NamedEffect};
use crate::error::Error;
use crate::options::Options;

/// A model that was found in one record, to be used on others of the same rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// What made it.
    pub made_by: MadeBy,
}

/// An effect of a [`Model`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ModelEffect {
    /// Its identifier.
    pub effect: Identifier,
    /// Name of its channel; `None` where it is of both.
    pub channel: Option<String>,
    /// Its parameters.
    pub parameters: Vec<Value>,
}

impl ModelEffect {
    /// An effect as the loop found it.
    pub(crate) fn found(found: &Found, channels: &[String; 2]) -> Self {
        let channel = found.fitted_in.map(|i| channels[i].clone());
        Self { effect: found.effect, channel, parameters: found.parameters.clone() }
    }

    /// An effect with the numbers that an answer gives of it.
    pub(crate) fn given(effect: &NamedEffect) -> Self {
        let values = effect.parameters.iter().filter_map(|p| {
            let EffectNumber { name, value, standard_error, interval_95, unit, .. } = p.clone();
            Some(Value { name, value: value?, standard_error, interval_95, unit })
        });
        Self { effect: effect.effect, channel: effect.fitted_in.clone(), parameters: values.collect() }
    }
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
            made_by: MadeBy::with(&Options::default()),
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
            parameters: e.parameters.iter().map(|p| (p.name.clone(), p.value)).collect(),
        });
        known.collect()
    }
}
