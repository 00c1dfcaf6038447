//! What a candidate must stand beside being the best: blocks that its fit has not seen, and a second opinion.

use std::collections::VecDeque;

use twinlag_model::{Fitted, dense, held_out_gain};
use twinlag_optimise::Scale;

use crate::candidates::{Candidate, Search};
use crate::rank::{Score, rank, threshold, ties};
use crate::second_opinion::is_confirmed;

impl Search<'_> {
    /// The first of the ranked candidates that is accepted, with those that explain the record as
    /// well; `None` where none is.
    pub(crate) fn accepted(&self, current: &Fitted, all: &[Candidate]) -> Option<(Candidate, Vec<Candidate>)> {
        let scores: Vec<Score> = all.iter().map(|c| c.score(current, self.policy)).collect();
        let with_shorter = all.iter().filter(|candidate| candidate.shortened.is_some()).count();
        let considered = self.candidates(&current.model).len() + with_shorter;
        let mut order = VecDeque::from(rank(&scores, considered, self.policy));
        while let Some(index) = order.pop_front() {
            let mut first = self.resized(current, all[index].clone());
            if !first.effect.is_noise() {
                first.held_out_nats =
                    held_out_gain(self.observations, self.selection, current, &first.fitted, self.policy);
            }
            if first.held_out_nats > 0.0
                && self.has_size(&first.fitted, current.model.effects.len())
                && is_confirmed(&first, current, self.observations, self.policy)
            {
                let others: Vec<Score> = order.iter().map(|i| scores[*i]).collect();
                let tied = ties(&first.score(current, self.policy), &others, self.policy);
                let tied = tied.into_iter().map(|i| all[order[i]].clone()).collect();
                return Some(self.by_likelihood(current, first, tied, all));
            }
        }
        None
    }

    /// Whether effect `index`, if it puts a factor into both inverses, has a size of its own.
    ///
    /// Such an effect changes the model where its size is nothing as well: both disagreements pass the factor
    /// `1 + τ s` once more, which takes off any exponential of time constant `τ`, as of an amplifier that warms up. A
    /// gain that comes with a size of nothing is no sign of the effect.
    pub(crate) fn has_size(&self, fitted: &Fitted, index: usize) -> bool {
        let Fitted { model, theta, .. } = fitted;
        let effect = &model.effects[index];
        let main = effect.main().map(|i| (i, &effect.parameters()[i]));
        let Some((main, _)) = main.filter(|(_, p)| matches!(p.variable.scale, Scale::Linear { .. })) else {
            return true;
        };
        if !effect.about().turns_phases {
            return true;
        }
        let main = model.range(index).start + main;
        let normal = model.normal_equations(theta, self.observations, self.selection, None);
        let Some(inverse) = dense::inverse(&normal.products) else { return false };
        let variance = inverse[main][main] * fitted.mean_energy().max(1.0);
        theta[main] * theta[main] > threshold(1, self.policy.round_false_alarm_probability) * variance
    }

    /// Whether the noise that is left over at `without` is of the colour of `taken`.
    pub(crate) fn needs_noise(&self, without: &Fitted, taken: &Candidate) -> bool {
        let is_needed = |c: &Candidate| {
            c.white_gain > threshold(c.added, self.policy.round_false_alarm_probability)
                && c.score(without, self.policy).white() > 0.0
                && c.held_out_nats > 0.0
        };
        self.with_noise(without, &taken.effect).as_ref().is_some_and(is_needed)
    }
}
