//! An effect that each of several records has for itself, in the place of a part of another effect that all of them share.
//!
//! A calibration with an offset excludes a drift, which has an offset as well. Where a rig has a gain and each record an offset, a gain and
//! one offset of all records fit best at first, and the drift of each record would never be tried. Here it is tried with the calibration
//! without its offset.

use twinlag_model::{Effort, Fitted, ModelError, Shared, candidates};

use crate::candidates::{Candidate, Search, accepts, white_gain};

/// An effect that each record has for itself, and the shorter form of another effect that makes room for it.
struct Swap {
    effect: Shared,
    /// The place of the other effect in the model.
    index: usize,
    /// The model with the shorter form.
    shorter: Fitted,
}

impl Search<'_> {
    /// Candidates that `current` excludes for a parameter of one of its effects, each with that effect in a shorter form, fitted to the
    /// end. None of a single record.
    pub(crate) fn own_in_each(&self, current: &Fitted) -> Result<Vec<Candidate>, ModelError> {
        if self.context.members.len() < 2 {
            return Ok(Vec::new());
        }
        let robust_before = self.robust(current);
        self.each(&self.swaps(current), |Swap { effect, index, shorter }| {
            let looked = self.with(shorter, effect, &effect.starts());
            let finished = self.finished(shorter, &looked, robust_before);
            let dropped = current.theta.len() - shorter.theta.len();
            Candidate { added: finished.added.saturating_sub(dropped).max(1), shortened: Some(*index), ..finished }
        })
    }

    /// Every effect of the records that `current` excludes, with each shorter form of one of its own that admits it.
    fn swaps(&self, current: &Fitted) -> Vec<Swap> {
        let all = candidates(self.allowed, &self.context);
        let own = all.into_iter().filter(|effect| effect.is_of_the_record() && !accepts(&current.model, effect));
        let shorter = |index: usize| {
            let range = current.model.range(index);
            let forms = shorter_forms(&current.model.effects[index], &current.theta[range.clone()]);
            forms.into_iter().map(move |(form, values)| {
                let mut theta = current.theta.clone();
                theta.splice(range.clone(), values);
                // Not fitted: its energy stays that of `current`, from which gains are counted.
                (index, Fitted { model: current.model.replaced(index, form), theta, ..current.clone() })
            })
        };
        let admitting = |effect: Shared| {
            let all = (0..current.model.effects.len()).flat_map(shorter);
            let admits = all.filter(|(_, shorter)| accepts(&shorter.model, &effect));
            admits.map(|(index, shorter)| Swap { effect: effect.clone(), index, shorter }).collect::<Vec<_>>()
        };
        own.flat_map(admitting).collect()
    }

    /// Effect `index` in the shorter form that it has in `fitted`, with what it gains there.
    ///
    /// - `taken`: the effect as it was found
    pub(crate) fn shortened(&self, fitted: &Fitted, index: usize, taken: &Candidate) -> Candidate {
        let (model, theta) = fitted.without(index);
        let without = model.fit(&theta, self.observations, self.selection, Effort::Compare);
        let effect = fitted.model.effects[index].clone();
        Candidate {
            added: effect.parameters().len(),
            effect,
            white_gain: white_gain(&without, fitted),
            robust_gain: self.robust(&without) - self.robust(fitted),
            fitted: fitted.clone(),
            runner_up: None,
            ..taken.clone()
        }
    }
}

/// Every form of an effect with fewer parameters, and the values to start from.
pub(crate) fn shorter_forms(effect: &Shared, values: &[f64]) -> Vec<(Shared, Vec<f64>)> {
    let each = effect.reduced(values).into_iter().flat_map(|(form, values)| {
        let shorter = shorter_forms(&form, &values);
        std::iter::once((form, values)).chain(shorter)
    });
    each.collect()
}
