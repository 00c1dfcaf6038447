//! Whether what is found on some records of a rig holds on one that had no part in finding it.
//!
//! Each record is left out in turn: the loop runs on the others, and its model is carried to the record that was left out, where
//! nothing is fitted but what belongs to a record. An effect that does not lower the error there stands in for something else,
//! however well it fits. What was found as noise is no part of the model here: it lowers no error, it is taken for granted.
//!
//! Of a single record errors are those of its blocks, and show how far the model carries within it. Nothing is taken out for them: a
//! block may be hotter than all others, and what goes with temperature is then not tried on it but extrapolated to it.

use twinlag_model::{
    Effort, Fitted, Identifier, Model, ModelError, Observations, OneRecord, Policy, Settings, Watch, report,
};

use crate::conclude::{is_explained, to_the_end};
use crate::diagnose::searched;
use crate::diagnosis::BeforeAfter;
use crate::errors::Squares;
use crate::grade::Reason;
use crate::moves::State;
use crate::rapid::without_noise;
use crate::remark::Remark;

/// An effect with its channel, 0 or 1; `None` where it is of both, or relative.
pub type EffectInChannel = (Identifier, Option<usize>);

/// Errors of a record that had no part in finding the model and its effects, or of a block of one that had none in fitting it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LeftOut {
    /// Root mean square of the whitened residual.
    pub normalised_rms: BeforeAfter<f64>,
    /// Root mean square of the difference between the two inferred gas temperatures, K.
    pub input_difference_k: BeforeAfter<f64>,
    /// Effects that were found on the other records, or on the whole record of a block; noise aside.
    pub found: Vec<EffectInChannel>,
    /// Whether two lags and what was found on them explain the other records; `None` of a block.
    pub are_others_explained: Option<bool>,
    /// Whether a noise is in the model of the others: it may stand for differences between them. Of a block `false`.
    pub are_others_explained_by_noise: bool,
    /// Root mean square of the whitened residual with the effects of all records, noise aside, fitted to this record alone. What the error
    /// of the record when it is left out has beyond this differs between records. `None` if the model of all has no noise, and of a block.
    pub normalised_rms_by_itself: Option<f64>,
}

/// Errors on records, or blocks of one, that were left out, one at a time.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Transfer {
    /// Root mean square of the whitened residual, of all of them.
    pub normalised_rms: BeforeAfter<f64>,
    /// Root mean square of the difference between the two inferred gas temperatures, of all of them, K.
    pub input_difference_k: BeforeAfter<f64>,
    /// Errors of each, in their order.
    pub records: Vec<LeftOut>,
}

/// Standard deviations by which chance exceeds the mean once in a thousand.
const FAR_DEVIATIONS: f64 = 3.09;

/// What records that were left out say of the model of all.
#[derive(Clone, Debug)]
pub(crate) struct Across {
    /// Records, from 0, in which the model of the others leaves more than noise.
    pub(crate) unexplained: Vec<usize>,
    /// The record without which the others do not show what was found.
    rests_on: Option<usize>,
    /// Whether the records are known not to be of one rig.
    pub(crate) are_of_several_rigs: bool,
    /// Whether a noise is in the model of all: it may stand for what differs among them.
    has_noise: bool,
    /// Whether the records are two, each in a steady flow of its own: the other shows nothing of the flow of one that is left out.
    are_two_steady_flows: bool,
}

impl Across {
    /// - `model`: of all records
    pub(crate) fn new(
        transfer: &Transfer,
        model: &Model,
        records: &[Observations],
        are_of_several_rigs: bool,
        policy: &Policy,
    ) -> Self {
        let samples: Vec<usize> = records.iter().map(Observations::samples).collect();
        // The mean square of n numbers of unit variance has the standard deviation √(2/n).
        let chance = |samples: usize| (1.0 + FAR_DEVIATIONS * (2.0 / samples.max(1) as f64).sqrt()).sqrt();
        // Noise that a record has by itself is left over under any model. Chance and margin are shares of it.
        let own = |record: usize| transfer.records[record].normalised_rms_by_itself.unwrap_or(1.0).max(1.0);
        let most = |record: usize| own(record) * (chance(samples[record]) + policy.left_out_rms_margin);
        let errors = |record: usize| transfer.records[record].normalised_rms;
        let unexplained: Vec<usize> =
            (0..samples.len()).filter(|record| errors(*record).after > most(*record)).collect();
        // Two lags that leave more than noise in a record, and the model of the others does not: it holds there.
        let holds_on = |record: usize| errors(record).before > most(record) && !unexplained.contains(&record);
        let lacking = |place: EffectInChannel| {
            let lacks = |record: &usize| !transfer.records[*record].found.contains(&place);
            let lacking: Vec<usize> = (0..samples.len()).filter(lacks).collect();
            let [record] = lacking[..] else { return None };
            (0..samples.len()).all(|other| other == record || !holds_on(other)).then_some(record)
        };
        let rests_on = match unexplained[..] {
            [record] => Some(record),
            _ => places(model).find_map(lacking),
        };
        let are_two_steady_flows = match records {
            [one, other] => one.flow().zip(other.flow()).is_some_and(|(one, other)| one.is_another_than(other)),
            _ => false,
        };
        Self { unexplained, rests_on, are_of_several_rigs, has_noise: model.noise().is_some(), are_two_steady_flows }
    }

    /// Whether the model is no cause of what the records show: those that had no part in finding it are not explained by it. One such
    /// record may be the only one that shows what is missing in the others, but a noise that all of them have is no such thing.
    pub(crate) fn is_refuted(&self) -> bool {
        self.unexplained.len() > usize::from(!self.has_noise)
    }

    /// What the numbers of the model rest on.
    pub(crate) fn reason(&self) -> Option<Reason> {
        if self.is_refuted() {
            return Some(Reason::DoesNotTransfer { records: self.unexplained.len() });
        }
        self.rests_on.map(|record| Reason::RestsOnRecord { record })
    }

    /// What to know of records that a model fits together and does not explain.
    pub(crate) fn remark(&self) -> Option<Remark> {
        let records = self.unexplained.len();
        let remark = if self.are_two_steady_flows { Remark::TwoSteadyFlows } else { Remark::NotOneRig { records } };
        Some(remark).filter(|_| self.is_refuted())
    }

    /// Whether it is not known that a record is of one rig with the others, even if all of them are explained together.
    pub(crate) fn is_doubtful(&self, record: usize) -> bool {
        self.unexplained.contains(&record) || self.rests_on == Some(record)
    }
}

/// Effects of a model with their channels, noise aside.
pub(crate) fn places(model: &Model) -> impl Iterator<Item = EffectInChannel> {
    model.effects.iter().filter(|effect| !effect.is_noise()).map(|effect| (effect.identifier(), effect.channel()))
}

/// What each record is when it is left out, with the model of the others.
pub(crate) fn transfer(state: &State<'_>, settings: &Settings, watch: Watch<'_>) -> Result<Transfer, ModelError> {
    let records = state.prepared.each_record();
    let without_noise_of_all = state.current.model.noise().map(|_| bare(state.current.clone(), state, state));
    let mut out = Errors::default();
    for (done, record) in records.iter().enumerate() {
        report(watch, "records left out", done, records.len())?;
        let others = state.prepared.raw.0.without_member(record.number);
        let (of_others, _) = searched(&others, settings, watch)?;
        let of = |fitted: &Fitted| on(record, &bare(to_the_end(fitted, &of_others), &of_others, state));
        let squares = [of(&of_others.base)?, of(&of_others.current)?];
        let rms_by_itself = without_noise_of_all.as_ref().map(|all| by_itself(record, all));
        out.add(squares, &of_others.current.model, Some(is_explained(&of_others, settings)), rms_by_itself);
    }
    Ok(out.transfer())
}

/// What the effects of `all` leave over in a record where they are fitted to it alone, as a root mean square of the whitened residual.
fn by_itself(record: &OneRecord, all: &Fitted) -> f64 {
    let own = all.model.fit(&all.theta, &record.observations, &record.everything, Effort::Compare);
    Squares::of(&own, &record.observations, |sample| record.tried.holds(sample)).roots()[0]
}

/// Errors of one record on each of its blocks in turn, with a model of the effects that all of it shows, fitted to the other blocks.
pub(crate) fn over_blocks(state: &State<'_>, watch: Watch<'_>) -> Result<Transfer, ModelError> {
    let current = without_noise(&state.current, &state.prepared);
    let blocks = state.prepared.each_block();
    let mut out = Errors::default();
    for (done, block) in blocks.iter().enumerate() {
        report(watch, "blocks left out", done, blocks.len())?;
        let of = |fitted: &Fitted| on(block, &of_the_others(block, &fitted.model, &fitted.theta));
        out.add([of(&state.base)?, of(&current)?], &current.model, None, None);
    }
    Ok(out.transfer())
}

/// Errors before and after, of what was left out, and of all of it together.
#[derive(Default)]
struct Errors {
    sums: [Squares; 2],
    each: Vec<LeftOut>,
}

impl Errors {
    /// - `model`: that of the others
    /// - `are_others_explained`, `normalised_rms_by_itself`: as of [`LeftOut`]
    fn add(
        &mut self,
        squares: [Squares; 2],
        model: &Model,
        are_others_explained: Option<bool>,
        normalised_rms_by_itself: Option<f64>,
    ) {
        for (sum, squares) in self.sums.iter_mut().zip(squares) {
            *sum = sum.and(squares);
        }
        let [normalised_rms, input_difference_k] = before_and_after(squares);
        let found = places(model).collect();
        self.each.push(LeftOut {
            normalised_rms,
            input_difference_k,
            found,
            are_others_explained,
            are_others_explained_by_noise: model.noise().is_some(),
            normalised_rms_by_itself,
        });
    }

    fn transfer(self) -> Transfer {
        let [normalised_rms, input_difference_k] = before_and_after(self.sums);
        Transfer { normalised_rms, input_difference_k, records: self.each }
    }
}

/// A model fitted to all records or blocks but one.
fn of_the_others(record: &OneRecord, model: &Model, theta: &[f64]) -> Fitted {
    let (others, selection) = &record.others;
    model.fit(theta, others, selection, Effort::Compare)
}

fn before_and_after([before, after]: [Squares; 2]) -> [BeforeAfter<f64>; 2] {
    let ([r0, k0], [r1, k1]) = (before.roots(), after.roots());
    [BeforeAfter { before: r0, after: r1 }, BeforeAfter { before: k0, after: k1 }]
}

/// A model of the others without what was found as noise, under the levels of all records: errors compare under the same ones alone.
fn bare(fitted: Fitted, of_others: &State<'_>, all: &State<'_>) -> Fitted {
    let is_bare = fitted.model.noise().is_none();
    let fitted = if is_bare { fitted } else { without_noise(&fitted, &of_others.prepared) };
    Fitted { model: fitted.model.with_noise(all.prepared.levels.std_k), ..fitted }
}

/// Errors of a model of the others on a record.
fn on(record: &OneRecord, fitted: &Fitted) -> Result<Squares, ModelError> {
    let carried = record.carried(fitted)?;
    Ok(Squares::of(&carried, &record.observations, |sample| record.tried.holds(sample)))
}

/// Takes out effects that do not help on records which had no part in fitting them, the worst first.
pub(crate) fn withdraw_what_does_not_transfer(state: &mut State<'_>, watch: Watch<'_>) -> Result<(), ModelError> {
    while let Some((index, gain)) = least_gain(state, watch)?.filter(|(_, gain)| *gain <= 0.0) {
        let withdrawal = state.withdrawal(index, gain);
        state.apply(withdrawal);
    }
    state.compare_again()
}

/// Takes out all effects, noise aside, where the models of the others lower no error of the records that were left out: nothing speaks for
/// them then but the fit that found them. For records that are not explained together. Each withdrawal has the gain of all of
/// these effects: they are judged together.
pub(crate) fn withdraw_what_lowers_no_error(state: &mut State<'_>, transfer: &Transfer) {
    let BeforeAfter { before, after } = transfer.normalised_rms;
    if after.is_nan() || after < before {
        return;
    }
    let gain = (before.powi(2) - after.powi(2)) * state.prepared.observations.samples() as f64;
    while let Some(index) = state.current.model.effects.iter().rposition(|effect| !effect.is_noise()) {
        let withdrawal = state.withdrawal(index, gain);
        state.apply(withdrawal);
    }
}

/// The effect, noise aside, that saves the least deviance on records which had no part in fitting it, and this deviance.
fn least_gain(state: &State<'_>, watch: Watch<'_>) -> Result<Option<(usize, f64)>, ModelError> {
    let current = without_noise(&state.current, &state.prepared);
    // Their places among all of them.
    let effects: Vec<usize> =
        (0..state.taken.len()).filter(|index| !state.current.model.effects[*index].is_noise()).collect();
    if effects.is_empty() {
        return Ok(None);
    }
    let mut gains = vec![0.0; effects.len()];
    let records = state.prepared.each_record();
    for (done, record) in records.iter().enumerate() {
        report(watch, "effects on records left out", done, records.len())?;
        let of_others = |model: &Model, theta: &[f64]| on(record, &of_the_others(record, model, theta));
        let with = of_others(&current.model, &current.theta)?;
        for (index, gain) in gains.iter_mut().enumerate() {
            let (model, theta) = current.without(index);
            *gain += with.gain(of_others(&model, &theta)?);
        }
    }
    Ok(effects.into_iter().zip(gains).min_by(|a, b| a.1.total_cmp(&b.1)))
}
