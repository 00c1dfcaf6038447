//! Records of several that are not of one rig: which of them is of another, and what it says that the others do not.

use twinlag_model::{Contradicted, ModelError, ModelFit, Settings, Watch};

use crate::conclude::{is_explained, last_fit};
use crate::diagnose::searched;
use crate::joint::Disagreement;
use crate::moves::State;
use crate::rapid::change_along_the_record;
use crate::transfer::{EffectInChannel, LeftOut, Transfer, places};

/// One record and all others, each explained, which together are of more than one rig.
pub(crate) struct OddOne {
    /// The record: of two the second, though either may be of another rig.
    pub(crate) record: usize,
    /// Whether the record is known to be the odd one: not so of two.
    pub(crate) is_known: bool,
    /// This record alone, and the others.
    sides: [Side; 2],
}

/// What a record says alone, or all but it.
pub(crate) struct Side {
    /// Effects, noise aside.
    pub(crate) found: Vec<EffectInChannel>,
    has_noise: bool,
    /// Time constants that differ from those of the other side by more than chance.
    pub(crate) disagreements: Vec<Disagreement>,
}

impl OddOne {
    /// The one record without which the others are explained, if it is explained alone as well. One that is not may only show what the
    /// others are too short or too quiet for.
    pub(crate) fn find(
        state: &State<'_>,
        transfer: &Transfer,
        settings: &Settings,
        watch: Watch<'_>,
    ) -> Result<Option<Self>, ModelError> {
        // Two rigs together leave a residual that goes with the gas of each in another way, which looks like noise of any colour.
        let are_explained_by_more =
            |of: &LeftOut| of.are_others_explained == Some(true) && !of.are_others_explained_by_noise;
        let left_out = transfer.records.iter().enumerate().filter(|(_, of)| are_explained_by_more(of));
        let explained: Vec<usize> = left_out.map(|(record, _)| record).collect();
        let (record, is_known) = match (&explained[..], transfer.records.len()) {
            ([0, 1], 2) => (1, false),
            ([record], 3..) => (*record, true),
            _ => return Ok(None),
        };
        let all = &state.prepared.raw.0;
        let number = all.members()[record].number;
        let (alone, _) = searched(&all.of_member(number), settings, watch)?;
        if !is_explained(&alone, settings) {
            return Ok(None);
        }
        let (others, _) = searched(&all.without_member(number), settings, watch)?;
        // Time constants that change along a record take up what the others differ from each other.
        if change_along_the_record(&others).is_some() {
            return Ok(None);
        }
        let [of_alone, of_others] = [&alone, &others].map(|state| last_fit(state, &settings.policy).1);
        let probability = settings.policy.records_rejection_probability / 2.0;
        let side = |record: usize, state: &State<'_>, fits: [&ModelFit; 2]| Side {
            found: places(&state.current.model).collect(),
            has_noise: state.has_noise(),
            disagreements: (0..2).filter_map(|i| disagreement(i, record, fits, probability)).collect(),
        };
        // Of two records the other one is the first.
        let sides = [side(record, &alone, [&of_alone, &of_others]), side(0, &others, [&of_others, &of_alone])];
        Ok(Some(Self { record, is_known, sides }))
    }

    /// What a record says beside the others; `None` where that is not known of it.
    pub(crate) fn of(&self, record: usize) -> Option<&Side> {
        let [alone, others] = &self.sides;
        if record == self.record { Some(alone) } else { (!self.is_known).then_some(others) }
    }

    /// Whether it is seen in what they differ.
    pub(crate) fn differs(&self) -> bool {
        let [alone, others] = &self.sides;
        !alone.disagreements.is_empty() || alone.found != others.found
    }

    /// Takes out of the model of all records what neither this record nor the others need: it stands for what they differ.
    pub(crate) fn withdraw_what_neither_needs(&self, state: &mut State<'_>) {
        let is_needless = |state: &State<'_>, index: usize| {
            let effect = &state.current.model.effects[index];
            let place = (effect.identifier(), effect.channel());
            let needs = |side: &Side| if effect.is_noise() { side.has_noise } else { side.found.contains(&place) };
            !self.sides.iter().any(needs)
        };
        while let Some(index) = (0..state.taken.len()).find(|index| is_needless(state, *index)) {
            let withdrawal = state.withdrawal(index, 0.0);
            state.apply(withdrawal);
        }
    }
}

/// Time constant `i` of a record and of what it is beside, where both differ by more than chance does with this probability.
fn disagreement(i: usize, record: usize, fits: [&ModelFit; 2], probability: f64) -> Option<Disagreement> {
    let number = |fit: &ModelFit| Some((fit.time_constants[i].value_s?, fit.time_constants[i].standard_error_s?));
    let values = Contradicted::beyond_noise(record, number(fits[0])?, number(fits[1])?);
    (values.p_value < probability).then(|| Disagreement::of_time_constant(i, values))
}
