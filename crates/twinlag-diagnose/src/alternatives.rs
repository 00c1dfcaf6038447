//! Other forms of an effect that has been chosen: another size, one parameter more, a look-alike in
//! its place.

use twinlag_model::{Effort, Fitted, ModelError, Shared, held_out_gain, is_unresolved};

use crate::candidates::{Candidate, Search, accepts, white_gain};
use crate::rank::{schwarz_penalty, worth};

/// A look-alike in the place of an effect.
pub(crate) struct Replacement {
    pub(crate) candidate: Candidate,
    /// Deviance by which it is better, its parameters counted.
    pub(crate) advantage: f64,
}

impl Search<'_> {
    /// The chosen candidate in the size that the data support: larger ones are tried where something
    /// is left, smaller ones where those do not help, as long as each is better.
    pub(crate) fn resized(&self, current: &Fitted, chosen: Candidate) -> Candidate {
        let mut sizes = chosen.effect.sizes();
        if sizes.is_empty() {
            return chosen;
        }
        sizes.sort_by_key(|effect| effect.parameters().len());
        let smaller = sizes.partition_point(|effect| effect.parameters().len() < chosen.added);
        let larger = sizes.split_off(smaller);
        let left = 1.0 + self.policy.resize_standard_errors * (2.0 / chosen.fitted.count).sqrt();
        if chosen.fitted.mean_energy() > left
            && let Some(better) = self.better(current, &chosen, larger.into_iter())
        {
            return better;
        }
        self.better(current, &chosen, sizes.into_iter().rev()).unwrap_or(chosen)
    }

    /// The best of `sizes` before the first that is no better than the one before it; `None` where
    /// none is better than `chosen`.
    fn better(&self, current: &Fitted, chosen: &Candidate, sizes: impl Iterator<Item = Shared>) -> Option<Candidate> {
        let robust_before = self.robust(current);
        let white = |candidate: &Candidate| candidate.score(current, self.policy).white();
        let mut best: Option<Candidate> = None;
        for effect in sizes {
            let looked = self.with(current, &effect, &effect.starts());
            let other = self.finished(current, &looked, robust_before);
            if white(&other) <= white(best.as_ref().unwrap_or(chosen)) {
                break;
            }
            best = Some(other);
        }
        best
    }

    /// Effect `index` of `current` with one parameter more, where the data support that.
    pub(crate) fn extended(&self, current: &Fitted, index: usize, taken: &Candidate) -> Option<Candidate> {
        let range = current.model.range(index);
        let (effect, start) = taken.effect.extended(&current.theta[range.clone()])?;
        if !accepts(&current.model.without(index), &effect) {
            return None;
        }
        let added = start.len() - range.len();
        let mut theta = current.theta.clone();
        theta.splice(range, start);
        let model = current.model.replaced(index, effect.clone());
        let fitted = model.fit(&theta, self.observations, self.selection, Effort::Compare);
        let white_gain = white_gain(current, &fitted);
        let robust_gain = self.robust(current) - self.robust(&fitted);
        let held_out_nats = held_out_gain(self.observations, self.selection, current, &fitted, self.policy);
        let is_supported = white_gain.min(robust_gain) > worth(added, fitted.count, self.policy);
        (is_supported && held_out_nats > 0.0 && fitted.end.is_usable()).then(|| Candidate {
            white_gain: taken.white_gain + white_gain,
            robust_gain: taken.robust_gain + robust_gain,
            held_out_nats: taken.held_out_nats + held_out_nats,
            added: taken.added + added,
            effect,
            fitted,
            ..taken.clone()
        })
    }

    /// Effect `index` of `current` without the parameter that is worth least, where the data do not support that one any more.
    pub(crate) fn reduced(&self, current: &Fitted, index: usize, taken: &Candidate) -> Option<Candidate> {
        let range = current.model.range(index);
        let without_one = |(effect, start): (Shared, Vec<f64>)| {
            let mut theta = current.theta.clone();
            let dropped = range.len() - start.len();
            theta.splice(range.clone(), start);
            let model = current.model.replaced(index, effect.clone());
            let fitted = model.fit(&theta, self.observations, self.selection, Effort::Compare);
            let white_loss = -white_gain(current, &fitted);
            let robust_loss = self.robust(&fitted) - self.robust(current);
            let is_needless = white_loss.max(robust_loss) < worth(dropped, fitted.count, self.policy);
            (is_needless && fitted.end.is_usable()).then(|| Candidate {
                white_gain: taken.white_gain - white_loss,
                robust_gain: taken.robust_gain - robust_loss,
                held_out_nats: taken.held_out_nats
                    - held_out_gain(self.observations, self.selection, &fitted, current, self.policy),
                added: taken.added - dropped,
                effect,
                fitted,
                ..taken.clone()
            })
        };
        let fewer = taken.effect.reduced(&current.theta[range.clone()]).into_iter().filter_map(without_one);
        fewer.max_by(|a, b| a.white_gain.total_cmp(&b.white_gain))
    }

    /// Effects that look like effect `index` of `current`, in its place, best first.
    pub(crate) fn look_alikes(
        &self,
        current: &Fitted,
        index: usize,
        taken: &Candidate,
    ) -> Result<Vec<Replacement>, ModelError> {
        let effect = &taken.effect;
        let (id, rest) = (effect.identifier(), current.model.without(index));
        if effect.is_noise() {
            return Ok(Vec::new());
        }
        let is_alike = |c: &Shared| {
            let other = c.identifier();
            !c.is_noise() && (id.resembles(other) || (other == id && c.channel() != effect.channel()))
        };
        let all: Vec<Shared> = self.candidates(&rest).into_iter().filter(is_alike).collect();
        let replaced = self.each(&all, |other| self.replaced(current, index, taken, other))?;
        let mut alike: Vec<Replacement> =
            replaced.into_iter().flatten().filter(|r| r.candidate.is_clear_of_bounds()).collect();
        alike.sort_by(|a, b| b.advantage.total_cmp(&a.advantage));
        Ok(alike)
    }

    /// Whether a look-alike of effect `index` can take its place: its fit has ended, it has a size,
    /// and time constants that the record resolves under `current` are resolved under it as well.
    /// One that fits better by taking a sensor's lag away replaces the sensor, not the effect.
    pub(crate) fn can_replace(&self, current: &Fitted, index: usize, other: &Fitted) -> bool {
        let is_unresolved = |fitted| is_unresolved(fitted, self.observations, self.policy);
        other.end.is_usable() && self.has_size(other, index) && (is_unresolved(current) || !is_unresolved(other))
    }

    /// `other` in the place of effect `index`, everything fitted again.
    fn replaced(&self, current: &Fitted, index: usize, taken: &Candidate, other: &Shared) -> Option<Replacement> {
        let range = current.model.range(index);
        let model = current.model.replaced(index, other.clone());
        let (observations, selection) = self.looked_in(other);
        let look = |start: Vec<f64>| {
            let mut theta = current.theta.clone();
            theta.splice(range.clone(), start);
            model.fit(&theta, observations, selection, Effort::Look)
        };
        let best = other.starts().into_iter().map(look).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
        let here = current.model.energy(&current.theta, observations, selection);
        if (here / best.chi2.max(1e-300)).ln() < -self.policy.look_alike_deficit_share {
            return None;
        }
        let fitted = model.fit(&best.theta, self.observations, self.selection, Effort::Compare);
        let more = other.parameters().len() as f64 - range.len() as f64;
        let white_gain = white_gain(current, &fitted);
        let robust_gain = self.robust(current) - self.robust(&fitted);
        let candidate = Candidate {
            effect: other.clone(),
            white_gain: taken.white_gain + white_gain,
            robust_gain: taken.robust_gain + robust_gain,
            added: other.parameters().len(),
            fitted,
            ..taken.clone()
        };
        let of_residuals = white_gain.min(robust_gain) - schwarz_penalty(more, candidate.fitted.count);
        let turn_phases = [&taken.effect, other].iter().all(|effect| effect.about().turns_phases);
        let of_readings =
            turn_phases.then(|| self.likelihood_advantage(current, &candidate.fitted, of_residuals, more));
        let advantage = of_readings.flatten().unwrap_or(of_residuals);
        Some(Replacement { candidate, advantage })
    }
}
