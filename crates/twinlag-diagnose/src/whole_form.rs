//! An effect of which the record supports a part alone, such as a gain without an offset.
//!
//! The offset of an instrument is small, not nil. Far from 0 °C a gain that is fitted without it has an interval as narrow as that of
//! the ratio of two means, and the smallest offset puts the true gain outside. The same holds the other way round. So the intervals of
//! what is fitted cover the fit of the whole form as well: of the numbers of the effect, of its exact twins, and of the time constants.

use twinlag_model::{Effort, Fitted, Identifier, ModelFit, Prepared, Value, covariance};

use crate::diagnosis::Found;
use crate::naming::{hull, interval_95};
use crate::ties::Tie;
use crate::twins::exact_twins;

/// A fit of the whole form of an effect in the place of a part of it.
pub(crate) struct WholeForm {
    /// The place of the effect in the model.
    index: usize,
    fitted: Fitted,
    covariance: Vec<Vec<f64>>,
}

impl WholeForm {
    /// Those of all effects of the model `last` that are parts, `fit` being that model in numbers.
    pub(crate) fn each(last: &Fitted, fit: &ModelFit, prepared: &Prepared) -> Vec<Self> {
        (0..last.model.effects.len()).filter_map(|index| Self::of(index, last, fit, prepared)).collect()
    }

    fn of(index: usize, last: &Fitted, fit: &ModelFit, prepared: &Prepared) -> Option<Self> {
        let (observations, everything) = (&prepared.observations, &prepared.everything);
        let range = last.model.range(index);
        let (effect, start) = last.model.effects[index].whole(&last.theta[range.clone()])?;
        let mut theta = last.theta.clone();
        theta.splice(range, start);
        let model = last.model.replaced(index, effect);
        let fitted = model.fit(&theta, observations, everything, Effort::Finish).in_order();
        let fitted = fitted.with_bias_as(last, observations, everything);
        let covariance = covariance(&fitted, observations, everything, fit.is_weighted_by_residual)?;
        fitted.end.is_usable().then_some(Self { index, fitted, covariance })
    }

    /// What the time constants are with it.
    pub(crate) fn tie(&self) -> Tie {
        let effect = &self.fitted.model.effects[self.index];
        let place = (effect.identifier(), effect.channel());
        Tie::of(place, place, &self.fitted, &self.covariance)
    }

    /// Makes the intervals of the effect, which are those of a part, cover those of the whole form.
    ///
    /// - `found`: all effects, each with its place in the model
    /// - `allowed`: effects that may be named
    pub(crate) fn widen_each(&self, found: &mut [(Option<usize>, Found)], allowed: &[Identifier]) {
        found
            .iter_mut()
            .filter(|(place, _)| *place == Some(self.index))
            .for_each(|(_, found)| self.widen(found, allowed));
    }

    fn widen(&self, found: &mut Found, allowed: &[Identifier]) {
        let Self { index, fitted, covariance } = self;
        let range = fitted.model.range(*index);
        let parameters = fitted.model.effects[*index].parameters();
        for (parameter, at) in parameters.iter().zip(range) {
            let error = covariance[at][at].max(0.0).sqrt();
            let whole = interval_95(fitted.theta[at], error, &parameter.variable.scale);
            let same = found.parameters.iter_mut().find(|value| value.name == parameter.name);
            if let Some(value) = same {
                cover(value, whole);
            }
        }
        let twins = exact_twins(*index, fitted, Some(covariance), allowed);
        for twin in &mut found.exact_twins {
            let same = twins.iter().find(|whole| (whole.effect, whole.channel) == (twin.effect, twin.channel));
            same.cloned().into_iter().for_each(|whole| twin.cover(whole));
        }
    }
}

/// Makes the interval of a value, where it has one, cover another one as well.
pub(crate) fn cover(value: &mut Value, other: [f64; 2]) {
    value.interval_95 = value.interval_95.map(|interval| hull(interval, other));
}
