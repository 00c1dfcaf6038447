//! The one record among several that is of another rig.

use twinlag_model::{Contradicted, ModelError, ModelFit, Settings, Watch};

use crate::conclude::{is_explained, last_fit};
use crate::diagnose::searched;
use crate::joint::Disagreement;
use crate::moves::State;
use crate::transfer::{LeftOut, Transfer};

/// Fewest records of which one can be the odd one.
const FEWEST_TO_HAVE_AN_ODD_ONE: usize = 3;

/// A record of another rig than the others.
pub(crate) struct OddOne {
    pub(crate) record: usize,
    /// Time constants that differ from those of the others by more than chance.
    pub(crate) disagreements: Vec<Disagreement>,
}

impl OddOne {
    /// The one record without which the others are explained, if it is explained alone as well. One that is not may only show what the
    /// others are too short or too quiet for. `None` of two records, either of which may be it.
    pub(crate) fn find(
        state: &State<'_>,
        transfer: &Transfer,
        settings: &Settings,
        watch: Watch<'_>,
    ) -> Result<Option<Self>, ModelError> {
        if transfer.records.len() < FEWEST_TO_HAVE_AN_ODD_ONE {
            return Ok(None);
        }
        // Two rigs together leave a residual that goes with the gas of each in another way, which looks like noise of any colour.
        let are_explained_by_more =
            |of: &LeftOut| of.are_others_explained == Some(true) && !of.are_others_explained_by_noise;
        let left_out = transfer.records.iter().enumerate().filter(|(_, of)| are_explained_by_more(of));
        let explained: Vec<usize> = left_out.map(|(record, _)| record).collect();
        let &[record] = &explained[..] else { return Ok(None) };
        let all = &state.prepared.raw.0;
        let number = all.members()[record].number;
        let (alone, _) = searched(&all.of_member(number), settings, watch)?;
        if !is_explained(&alone, settings) {
            return Ok(None);
        }
        let (others, _) = searched(&all.without_member(number), settings, watch)?;
        let [alone, others] = [alone, others].map(|state| last_fit(&state, &settings.policy).1);
        let probability = settings.policy.records_rejection_probability / 2.0;
        let disagreements = (0..2).filter_map(|i| differ(i, record, [&alone, &others], probability)).collect();
        Ok(Some(Self { record, disagreements }))
    }
}

/// Time constant `i` of one record and of all others, where both differ by more than chance does with this probability.
fn differ(i: usize, record: usize, fits: [&ModelFit; 2], probability: f64) -> Option<Disagreement> {
    let number = |fit: &ModelFit| Some((fit.time_constants[i].value_s?, fit.time_constants[i].standard_error_s?));
    let values = Contradicted::beyond_noise(record, number(fits[0])?, number(fits[1])?);
    (values.p_value < probability).then(|| Disagreement::of_time_constant(i, values))
}
