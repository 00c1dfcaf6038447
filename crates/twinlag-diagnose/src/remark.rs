//! What to know before using the numbers of a diagnosis, in words.

use std::fmt;

use serde::{Deserialize, Serialize};
use twinlag_model::Identifier;

use crate::grade::{counted_records, rounded};

/// Something to know before using the numbers of a diagnosis. Its [`Display`](fmt::Display) is a
/// sentence for the reader.
///
/// ```
/// use twinlag_diagnose::{Identifier, Remark};
///
/// let remark = Remark::Widened { effects: vec![Identifier::DELAY, Identifier::SECOND_ORDER] };
/// assert!(remark.to_string().contains("(delay, second-order)"));
/// // The name that scripts use.
/// assert_eq!(serde_json::to_value(&remark)?["remark"], "widened");
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "remark", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Remark {
    /// An effect took the place of one that looks like it.
    Replaced {
        /// The effect that was taken up first.
        before: Identifier,
        /// The effect in its place.
        after: Identifier,
    },
    /// An effect moved to the other channel.
    OtherChannel {
        /// The effect.
        effect: Identifier,
    },
    /// An effect was taken out again.
    Needless {
        /// The effect.
        effect: Identifier,
    },
    /// Noise levels were lowered to what is left over.
    NoiseLowered,
    /// Intervals of the time constants were widened for effects that explain the record as well.
    Widened {
        /// The effects that put the time constants elsewhere.
        effects: Vec<Identifier>,
    },
    /// Time constants and a delay cannot be distinguished.
    LagAlone,
    /// The gas is a single tone.
    SingleTone,
    /// The record contradicts what was given beforehand.
    Contradicted {
        /// What was given, as `T1 = 0.5 s`.
        what: String,
        /// What the record gives instead, as `T1 = 0.4 s`.
        instead: String,
        /// By how many standard deviations both differ.
        deviations: f64,
    },
    /// Either effects are there, or what was given beforehand is wrong.
    EffectsOrGiven {
        /// What was given, as `T1 = 0.5 s`.
        what: String,
        /// What the record gives without these effects, as `T1 = 0.4 s`.
        instead: String,
        /// The effects.
        effects: Vec<Identifier>,
    },
    /// An effect was taken out since it does not help on records that had no part in finding it.
    DoesNotTransfer {
        /// The effect.
        effect: Identifier,
    },
    /// Of several records that were left out, in turn, the model of the others leaves more than noise.
    NotOneRig {
        /// How many records these are.
        records: usize,
    },
    /// The records are two, each in a steady flow of its own.
    TwoSteadyFlows,
    /// What was taken for noise goes with the gas.
    ModelErrorAsNoise,
    /// Something changes faster than a model of the whole record can follow.
    VariesTooFast {
        /// The effect.
        effect: Identifier,
        /// Ends of the stretch that showed it, s.
        ends_s: [f64; 2],
    },
    /// The search looked at pieces of the record first.
    SearchedInPieces {
        /// Samples of the pieces.
        samples: usize,
        /// Samples of the record.
        all: usize,
        /// Whether what may still be missing was screened against all of them: not so where the pieces left more than noise.
        #[serde(default = "yes")]
        is_screened: bool,
    },
    /// Something is missing, and intervals do not know how far it moves the numbers.
    BiasUnknown {
        /// Whether a time constant was known beforehand.
        #[serde(default)]
        is_one_known: bool,
    },
}

impl Remark {
    /// A time constant with its standard error, where it has one, for the reader: two digits of the error.
    ///
    /// ```
    /// use twinlag_diagnose::Remark;
    ///
    /// assert_eq!(Remark::time_constant("T1", 0.398_21, Some(0.001_23)), "T1 = 0.3982 ± 0.0012 s");
    /// ```
    pub fn time_constant(name: &str, value_s: f64, error_s: Option<f64>) -> String {
        match error_s.filter(|error_s| *error_s > 0.0 && error_s.is_finite()) {
            Some(error_s) => {
                let decimals = (1.0 - error_s.log10().floor()).clamp(0.0, 9.0) as usize;
                format!("{name} = {value_s:.decimals$} ± {error_s:.decimals$} s")
            }
            None => format!("{name} = {value_s:.3e} s"),
        }
    }

    /// The place of the remark among several: 0 comes first. Those that forbid a use of the numbers come before those that
    /// limit it, and these before those that only say how they came about.
    pub fn importance(&self) -> u8 {
        match self {
            Self::SingleTone => 0,
            Self::Contradicted { .. } => 1,
            Self::LagAlone | Self::NotOneRig { .. } | Self::TwoSteadyFlows => 2,
            Self::EffectsOrGiven { .. } => 3,
            Self::BiasUnknown { .. } => 4,
            Self::VariesTooFast { .. } => 5,
            Self::ModelErrorAsNoise => 6,
            Self::Widened { .. } => 7,
            Self::NoiseLowered => 8,
            Self::Replaced { .. } => 9,
            Self::OtherChannel { .. } => 10,
            Self::Needless { .. } => 11,
            Self::DoesNotTransfer { .. } => 12,
            Self::SearchedInPieces { .. } => 13,
        }
    }
}

fn yes() -> bool {
    true
}

/// A number with as many decimals as `size` has with three digits.
pub(crate) fn to_digits_of(size: f64, number: f64) -> String {
    let decimals = (2.0 - size.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{number:.decimals$}")
}

fn effects_or_given(f: &mut fmt::Formatter<'_>, what: &str, instead: &str, effects: &[Identifier]) -> fmt::Result {
    let names: Vec<&str> = effects.iter().map(|effect| effect.name()).collect();
    write!(
        f,
        "the record is explained about as well without {}, and without {what}, as given, by {instead}: either that is wrong, or the \
         effect is there. Check the value, its unit, and which channel is which",
        names.join(" and ")
    )
}

/// What it means for whoever wants to use the numbers, and what to do.
impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SingleTone => f.write_str(
                "the gas is a single tone. Its amplitude and phase are two equations for two time \
                 constants, which absorb any missing effect without a trace: use no number of this record, and take one in \
                 which the gas changes at more than one rate",
            ),
            Self::Contradicted { what, instead, deviations } => write!(
                f,
                "the record contradicts {what}, as given, by {} standard deviations: without it, it gives {instead}. Check the \
                 value, its unit, and which channel is which",
                rounded(*deviations)
            ),
            Self::EffectsOrGiven { what, instead, effects } => effects_or_given(f, what, instead, effects),
            Self::LagAlone => f.write_str(
                "this record does not distinguish time constants from a delay: use the difference alone, which is the total \
                 delay of channel 2, τ2 − τ1 + delay, and the size of the delay only if you know that it is one. A known time \
                 constant, or a gas that changes faster, separates them",
            ),
            Self::BiasUnknown { is_one_known } => {
                let known = if *is_one_known { "" } else { "give a time constant that is known, or " };
                write!(
                    f,
                    "the intervals cover noise and the residual, but not the bias from the missing effect, so the truth may lie \
                     far outside: {known}remove the cause at the rig, before you use the numbers"
                )
            }
            Self::ModelErrorAsNoise => f.write_str(
                "the residual is coherent with the gas temperature, so it is model error and not noise. \
                 Its spectrum weights the fit and sets the intervals; look for its cause at the rig",
            ),
            Self::Widened { effects } => {
                let names: Vec<&str> = effects.iter().map(|e| e.name()).collect();
                write!(
                    f,
                    "the intervals of the time constants also cover the alternatives ({}), which give different values. An \
                     alternative that cannot be at the rig is best left out of another diagnosis: the intervals may become \
                     shorter",
                    names.join(", ")
                )
            }
            Self::NoiseLowered => f.write_str(
                "the noise levels come from the residual, because the fastest changes of the readings \
                 are larger and belong to the gas. Give the noise of the instruments if it is known: where the levels are too low, \
                 so are the intervals",
            ),
            Self::Replaced { before, after } => {
                write!(f, "{after} took the place of {before}, because it explains more: look for {after} at the rig")
            }
            Self::OtherChannel { effect } => write!(
                f,
                "{effect} was first placed in the other channel, but explains more in this one: if the rig says otherwise, \
                 believe the rig"
            ),
            Self::VariesTooFast { effect, ends_s: [from_s, to_s] } => write!(
                f,
                "{effect} goes up and down too often along this record for a model of all of it. Cut the record into parts no longer than \
                 {} s, as the one from {} s on in which it was found, and diagnose these",
                to_digits_of(to_s - from_s, to_s - from_s),
                to_digits_of(to_s - from_s, *from_s)
            ),
            Self::SearchedInPieces { samples, all, is_screened } => {
                let then = if *is_screened {
                    "what else may be missing was screened against all of it"
                } else {
                    "since these samples show more than any effect explains, nothing else was searched for in the others"
                };
                write!(
                    f,
                    "effects were searched for in {samples} of {all} samples, spread over the record; what was found was fitted \
                     to all of it, and {then}"
                )
            }
            Self::DoesNotTransfer { effect } => write!(
                f,
                "{effect} explained a part of these records and was removed, because it does not help on a record that had no part in \
                 finding it: it stands in for something that changes from record to record"
            ),
            Self::NotOneRig { records } => write!(
                f,
                "the model fits these records together, but the model of the others leaves more than noise in {}, left out in turn: it makes up for something that changes from record to record, and is no cause. Diagnose each record alone, \
                 and together those that were taken without a change of the rig",
                counted_records(*records)
            ),
            Self::TwoSteadyFlows => f.write_str(
                "two records in steady flows do not show that time constants go with the flow: where one of them is left out, the other \
                 shows nothing of it. Diagnose three or more together, each in another flow",
            ),
            Self::Needless { effect } => write!(
                f,
                "{effect} was added first and later removed, because other effects explain the record without it: there is no \
                 need to look for it"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn remarks_are_running_text() {
        let (before, after) = (Identifier::DRIFT, Identifier::CALIBRATION);
        let all = [
            Remark::Replaced { before, after },
            Remark::OtherChannel { effect: before },
            Remark::Needless { effect: before },
            Remark::DoesNotTransfer { effect: before },
            Remark::NoiseLowered,
            Remark::Widened { effects: vec![before, after] },
            Remark::LagAlone,
            Remark::SingleTone,
            Remark::Contradicted { what: "T1 = 0.8 s".into(), instead: "T1 = 0.4 s".into(), deviations: 9.7 },
            Remark::EffectsOrGiven {
                what: "T1 = 0.8 s".into(),
                instead: "T1 = 0.4 s".into(),
                effects: vec![before, after],
            },
            Remark::ModelErrorAsNoise,
            Remark::BiasUnknown { is_one_known: false },
            Remark::VariesTooFast { effect: Identifier::VARYING_TIME_CONSTANT, ends_s: [480.0, 504.6] },
            Remark::SearchedInPieces { samples: 24_576, all: 1_000_000, is_screened: true },
        ];
        let importance: BTreeSet<u8> = all.iter().map(Remark::importance).collect();
        assert_eq!(importance.len(), all.len(), "no two remarks have one place");
        for remark in all {
            let text = remark.to_string();
            assert!(!text.contains("  ") && !text.ends_with('.'), "{text}");
            let json = serde_json::to_string(&remark).expect("plain data");
            assert_eq!(serde_json::from_str::<Remark>(&json).expect("as it was written"), remark);
        }
    }
}
