//! A number of each of several records in the place of one of all, such as an offset.
//!
//! An effect with an offset that all records share excludes one that has an offset in each. Where a rig has a gain and every record an
//! offset of its own, gain and offset of all together help most at first, and whatever is then added leaves the offsets apart.

use twinlag_model::{Effort, Fitted, ModelError, Shared, candidates};

use crate::candidates::{Candidate, Search, accepts, white_gain};

/// A shorter form of an effect, beside a candidate that determines the rest in each record.
#[derive(Clone)]
pub(crate) struct Shortened {
    /// The place of the effect in the model.
    pub(crate) index: usize,
    /// The shorter form, with what it gains beside the candidate.
    pub(crate) candidate: Box<Candidate>,
}

/// A candidate that `current` can take with a shorter form of one of its effects.
struct Instead {
    effect: Shared,
    index: usize,
    /// `current` with the shorter form.
    shorter: Fitted,
}

impl Search<'_> {
    /// Candidates that each record has for itself, and with each the effect of `current` that determines the same for all records, in
    /// a form without that: fitted to the end. None where there is one record.
    ///
    /// - `taken`: how the effects of `current` were found
    pub(crate) fn own_in_each(&self, current: &Fitted, taken: &[&Candidate]) -> Result<Vec<Candidate>, ModelError> {
        if self.context.members.len() < 2 {
            return Ok(Vec::new());
        }
        let robust_before = self.robust(current);
        let fits = self.each(&self.instead(current), |Instead { effect, index, shorter }| {
            let looked = self.with(shorter, effect, &effect.starts());
            let finished = self.finished(shorter, &looked, robust_before);
            let dropped = current.theta.len() - shorter.theta.len();
            Candidate {
                white_gain: white_gain(current, &finished.fitted),
                added: finished.added - dropped,
                shortened: Some(self.shortened(&finished.fitted, *index, taken[*index])),
                ..finished
            }
        })?;
        Ok(fits)
    }

    fn instead(&self, current: &Fitted) -> Vec<Instead> {
        let all = candidates(self.allowed, &self.context);
        let own = all.into_iter().filter(|effect| effect.is_of_the_record() && !accepts(&current.model, effect));
        let with_shorter = |effect: Shared| {
            let forms = (0..current.model.effects.len()).flat_map(|index| {
                let values = &current.theta[current.model.range(index)];
                shorter_forms(&current.model.effects[index], values).into_iter().map(move |form| (index, form))
            });
            let beside = |(index, (form, values)): (usize, (Shared, Vec<f64>))| {
                let model = current.model.replaced(index, form);
                let mut theta = current.theta.clone();
                theta.splice(current.model.range(index), values);
                let shorter = Fitted { model, theta, ..current.clone() };
                accepts(&shorter.model, &effect).then(|| Instead { effect: effect.clone(), index, shorter })
            };
            forms.filter_map(beside).collect::<Vec<_>>()
        };
        own.flat_map(with_shorter).collect()
    }

    /// The form of effect `index` in `fitted`, with what it gains there.
    fn shortened(&self, fitted: &Fitted, index: usize, taken: &Candidate) -> Shortened {
        let (model, theta) = fitted.without(index);
        let without = model.fit(&theta, self.observations, self.selection, Effort::Compare);
        let effect = fitted.model.effects[index].clone();
        let candidate = Candidate {
            added: effect.parameters().len(),
            effect,
            white_gain: white_gain(&without, fitted),
            robust_gain: self.robust(&without) - self.robust(fitted),
            fitted: fitted.clone(),
            runner_up: None,
            ..taken.clone()
        };
        Shortened { index, candidate: Box::new(candidate) }
    }
}

/// Every shorter form of an effect, with its values.
fn shorter_forms(effect: &Shared, values: &[f64]) -> Vec<(Shared, Vec<f64>)> {
    let each = effect.reduced(values).into_iter().flat_map(|(form, values)| {
        let shorter = shorter_forms(&form, &values);
        std::iter::once((form, values)).chain(shorter)
    });
    each.collect()
}
