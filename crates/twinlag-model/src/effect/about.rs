//! What is known of a kind of effect before any record.

use super::{Context, Shared, described_by};
use crate::effect::KnownEffect;
use crate::error::ModelError;

/// What is known of a kind of effect before any record, as data: the search asks nothing else of it.
///
/// Made by [`About::new`] and the functions that follow it, in a `static`.
#[derive(Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
#[non_exhaustive]
pub struct About {
    /// The name that scripts use.
    pub name: &'static str,
    /// What the effect is, in one sentence.
    pub explanation: &'static str,
    /// What can be done about it at the rig.
    pub advice: &'static str,
    /// What part of it two sensors alone cannot reveal.
    pub unseen: &'static str,
    /// Names of effects that look like it where it is small, or where the gas says little.
    pub imitates: &'static [&'static str],
    /// Names of effects that cannot be in one model with it, since the readings do not distinguish them.
    pub excludes: &'static [&'static str],
    /// How often it occurs: of effects that explain a record equally well, the one with the smallest rank comes first.
    pub rank: u8,
    /// Whether it is seen in the data before any model and masked: it has no candidates.
    pub is_defect: bool,
    /// Whether it is a model of noise, fitted by the likelihood of the residual and not by its energy.
    pub is_noise: bool,
    /// Whether it turns phases at frequencies where the gas may have no power. The whitened residual can then gain from
    /// noise of both channels that happens to cancel, and the likelihood of the readings is asked as well.
    pub turns_phases: bool,
    /// Whether it is a disagreement at rest, which depends least on the rest of the model.
    pub is_static: bool,
    /// Whether it can stand in for a disagreement at rest, and so comes after one that explains as much.
    pub imitates_static: bool,
    /// Whether all of it lies at one frequency, where it is judged without weights over frequency; it may be there once
    /// for each channel.
    pub is_narrow: bool,
    /// Whether it makes the time constants change along the record.
    pub changes_time_constants: bool,
    /// Whether it depends on the gas temperature, of which its candidates then need an estimate.
    pub follows_gas: bool,
    /// Whether a filter can undo it sample by sample, as readings come.
    pub is_streamable: bool,
    /// Whether both sensors are first-order lags of the gas with it as without it.
    pub leaves_lags: bool,
    /// Whether it biases the gas temperature where both sensors have it, which no reading shows: `unseen` says what stays hidden.
    pub biases_gas_if_shared: bool,
    /// Whether it is one channel's relative to the other, so that the gas temperature can be that of either.
    pub is_relative: bool,
    /// Every form in which it may be added to a model of a record.
    pub candidates: fn(&Context) -> Vec<Shared>,
    /// The effect with the parameters that it was found with in another record.
    pub restore: fn(&KnownEffect, &Context) -> Result<Option<Shared>, ModelError>,
}

impl About {
    /// An effect of the mean, seen at all frequencies, that imitates none and excludes none.
    ///
    /// - `name`: as scripts use it, in kebab case
    /// - `rank`: how often it occurs, 0 for the most frequent; effects of this library have 0 to 15
    pub const fn new(name: &'static str, rank: u8, candidates: fn(&Context) -> Vec<Shared>) -> Self {
        Self {
            name,
            explanation: "",
            advice: "",
            unseen: "",
            imitates: &[],
            excludes: &[],
            rank,
            is_defect: false,
            is_noise: false,
            turns_phases: false,
            is_static: false,
            imitates_static: false,
            is_narrow: false,
            changes_time_constants: false,
            follows_gas: false,
            is_streamable: false,
            leaves_lags: false,
            biases_gas_if_shared: false,
            is_relative: false,
            candidates,
            restore: |known, context| Ok(described_by(known, (known.effect.about().candidates)(context))),
        }
    }

    /// A defect of the data, masked before any model.
    pub(crate) const fn defect(name: &'static str, rank: u8) -> Self {
        let mut out = Self::new(name, rank, |_| Vec::new());
        out.is_defect = true;
        out
    }

    /// In words: what it is, what can be done about it, and what part of it two sensors alone cannot reveal.
    #[must_use]
    pub const fn in_words(mut self, explanation: &'static str, advice: &'static str, unseen: &'static str) -> Self {
        (self.explanation, self.advice, self.unseen) = (explanation, advice, unseen);
        self
    }

    /// It looks like these effects, by name, where it is small, or where the gas says little.
    #[must_use]
    pub const fn imitating(mut self, imitates: &'static [&'static str]) -> Self {
        self.imitates = imitates;
        self
    }

    /// These effects, by name, cannot be in one model with it.
    #[must_use]
    pub const fn excluding(mut self, excludes: &'static [&'static str]) -> Self {
        self.excludes = excludes;
        self
    }

    /// A model of noise.
    #[must_use]
    pub const fn of_noise(mut self) -> Self {
        self.is_noise = true;
        self
    }

    /// It turns phases where the gas may have no power.
    #[must_use]
    pub const fn turning_phases(mut self) -> Self {
        self.turns_phases = true;
        self
    }

    /// A disagreement at rest.
    #[must_use]
    pub const fn at_rest(mut self) -> Self {
        self.is_static = true;
        self
    }

    /// It can stand in for a disagreement at rest.
    #[must_use]
    pub const fn imitating_rest(mut self) -> Self {
        self.imitates_static = true;
        self
    }

    /// All of it lies at one frequency.
    #[must_use]
    pub const fn at_one_frequency(mut self) -> Self {
        self.is_narrow = true;
        self
    }

    /// It makes the time constants change along the record.
    #[must_use]
    pub const fn changing_time_constants(mut self) -> Self {
        self.changes_time_constants = true;
        self
    }

    /// It depends on the gas temperature.
    #[must_use]
    pub const fn following_gas(mut self) -> Self {
        self.follows_gas = true;
        self
    }

    /// A filter can undo it as readings come.
    #[must_use]
    pub const fn streamable(mut self) -> Self {
        self.is_streamable = true;
        self
    }

    /// Both sensors are first-order lags of the gas with it as without it: it adds to what they read.
    #[must_use]
    pub const fn leaving_lags(mut self) -> Self {
        self.leaves_lags = true;
        self
    }

    /// It biases the gas temperature where both sensors have it, which no reading shows.
    #[must_use]
    pub const fn biasing_gas_if_shared(mut self) -> Self {
        self.biases_gas_if_shared = true;
        self
    }

    /// It is one channel's relative to the other, so that the gas temperature can be that of either.
    #[must_use]
    pub const fn relative(mut self) -> Self {
        self.is_relative = true;
        self
    }

    /// How it is made from parameters of another record, where its candidates depend on more than the record at hand.
    #[must_use]
    pub const fn restored_by(
        mut self,
        restore: fn(&KnownEffect, &Context) -> Result<Option<Shared>, ModelError>,
    ) -> Self {
        self.restore = restore;
        self
    }
}
