//! What a candidate must stand beside being the best: blocks that its fit has not seen, and a
//! second opinion.
//!
//! The second opinion comes from the readings themselves, with the gas in the state. The whitened
//! residual knows nothing of the gas: above the frequencies that the gas has, noise of one channel
//! meets noise of the other in it, and what turns the phase of one of them (a delay, a second lag)
//! can pick the angle at which they happen to cancel. The likelihood of the readings with the gas
//! as one process, its spectrum learned from them, has no such term: where the gas is not, it does
//! not depend on the sensors.

use std::collections::VecDeque;

use twinlag_compensate::{Form, learn_quickly, reconstruct};
use twinlag_model::{Extended, Fitted, Observations, Policy, dense, held_out_gain};
use twinlag_optimise::Scale;

use crate::candidates::{Candidate, Search};
use crate::rank::{Score, rank, threshold, ties};

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
                return Some((first, tied.into_iter().map(|i| all[order[i]].clone()).collect()));
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

/// Whether the candidate makes the readings more probable than `without` does, and by more than
/// chance, where chance might have brought it about.
fn is_confirmed(candidate: &Candidate, without: &Fitted, observations: &Observations, policy: &Policy) -> bool {
    if !candidate.effect.about().turns_phases || without.mean_energy() > policy.far_off_energy {
        return true;
    }
    let likelihood = |fitted| log_likelihood(fitted, observations);
    let (before, after) = rayon::join(|| likelihood(without), || likelihood(&candidate.fitted));
    let least = threshold(candidate.added, policy.round_false_alarm_probability);
    // What has no such likelihood is judged without.
    before.zip(after).is_none_or(|(before, after)| 2.0 * (after - before) > least)
}

/// Logarithm of the likelihood of the readings, up to what is the same for all models of a record; of several records that of
/// all of them, each with a gas of its own.
fn log_likelihood(fitted: &Fitted, observations: &Observations) -> Option<f64> {
    let members = observations.members();
    members.iter().map(|member| of_one_record(fitted, &observations.of_member(member.number))).sum()
}

fn of_one_record(fitted: &Fitted, observations: &Observations) -> Option<f64> {
    let (readings, rig) = Extended::new(fitted, observations).rig(&fitted.theta).ok()?;
    let prior = learn_quickly(&readings, &rig).ok()?.prior;
    let gas = reconstruct(&readings, &rig, &prior, Form::Filter).ok()?;
    // Of the readings as they were before they were taken back through a gain.
    let noise_std_k = fitted.model.noise_std_k();
    let gains = (0..2).map(|i| (rig.sensors[i].noise_std_k / noise_std_k[i]).ln()).sum::<f64>();
    Some(gas.log_likelihood + 0.5 * gas.innovations as f64 * gains)
}
