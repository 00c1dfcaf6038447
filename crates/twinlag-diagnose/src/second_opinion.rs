//! What the readings themselves say of candidates, with the gas in the state.
//!
//! The whitened residual knows nothing of the gas: above the frequencies that the gas has, noise of one channel meets noise of the other in
//! it, and what turns the phase of one of them (a delay, a second lag) can pick the angle at which they happen to cancel. So the energies
//! of two models that turn phases differ by chance as well, the more the less their residuals agree. The likelihood of the readings with
//! the gas as one process, its spectrum learned from them, has no such term: where the gas is not, it does not depend on the sensors.

use rayon::prelude::*;
use twinlag_compensate::{Form, learn_quickly, reconstruct};
use twinlag_model::{Extended, Fitted, Observations, Policy, energy_difference_std, held_out_gain};

use crate::candidates::{Candidate, Search};
use crate::rank::{schwarz_penalty, threshold};
use crate::transfer::EffectInChannel;

/// Standard deviations beyond a tie within which chance may have made the deviance between two effects that turn phases: three, once in 370.
const CHANCE_STANDARD_DEVIATIONS: f64 = 3.0;

impl Search<'_> {
    /// The candidate under which the readings are most probable: the accepted one, or a rival that turns phases too and whose gain is no
    /// further from its than chance may make it. With those within a tie of it.
    ///
    /// - `ties`: those of the accepted one by their gains
    pub(crate) fn by_likelihood(
        &self,
        current: &Fitted,
        first: Candidate,
        mut ties: Vec<Candidate>,
        all: &[Candidate],
    ) -> (Candidate, Vec<Candidate>) {
        let rivals = self.rivals(current, &first, all);
        if rivals.is_empty() {
            return (first, ties);
        }
        let score = |candidate: &Candidate| {
            let likelihood = log_likelihood(&candidate.fitted, self.observations)?;
            Some(2.0 * likelihood - schwarz_penalty(candidate.added as f64, candidate.fitted.count))
        };
        let scored = std::iter::once(first.clone()).chain(rivals).collect::<Vec<_>>().into_par_iter();
        let mut scored: Vec<_> = scored.map(|candidate| (score(&candidate), candidate)).collect();
        // What has no such likelihood explains the record as well as its gain says.
        let Some(of_first) = scored[0].0 else { return (first, ties) };
        let best = scored.iter().filter_map(|(score, _)| *score).fold(of_first, f64::max);
        let at = scored.iter().position(|(score, _)| *score == Some(best)).unwrap_or(0);
        let (_, chosen) = scored.remove(at);
        let is_judged =
            |tie: &Candidate| scored.iter().any(|(score, other)| score.is_some() && seat(other) == seat(tie));
        ties.retain(|tie| !is_judged(tie));
        let is_tied = |score: &Option<f64>| score.is_some_and(|score| best - score < self.policy.tie_deviance);
        ties.extend(scored.into_iter().filter(|(score, _)| is_tied(score)).map(|(_, tie)| tie));
        ties.retain(|tie| seat(tie) != seat(&chosen));
        (chosen, ties)
    }

    /// The candidates that could stand in the place of `first`, which turns phases, and between which and it chance may have chosen.
    fn rivals(&self, current: &Fitted, first: &Candidate, all: &[Candidate]) -> Vec<Candidate> {
        let turns_phases = |c: &Candidate| c.effect.about().turns_phases && !c.effect.is_noise();
        if !turns_phases(first) {
            return Vec::new();
        }
        let white_of_first = first.score(current, self.policy).white();
        let is_rival = |other: &&Candidate| {
            let score = other.score(current, self.policy);
            seat(other) != seat(first)
                && score.is_sound
                && score.white() > 0.0
                && self.may_be_chance(&first.fitted, &other.fitted, white_of_first - score.white())
                && self.has_size(&other.fitted, current.model.effects.len())
        };
        let held_out = |other: &Candidate| {
            let nats = held_out_gain(self.observations, self.selection, current, &other.fitted, self.policy);
            (nats > 0.0).then(|| Candidate { held_out_nats: nats, ..other.clone() })
        };
        all.iter().filter(|other| turns_phases(other)).filter(is_rival).filter_map(held_out).collect()
    }

    /// Deviance by which `other` makes the readings more probable than `fitted` does, its parameters counted; `None` where chance does not make
    /// `advantage`, that of their residuals, and where there is no such likelihood.
    ///
    /// - `more`: parameters that `other` has more
    pub(crate) fn likelihood_advantage(
        &self,
        fitted: &Fitted,
        other: &Fitted,
        advantage: f64,
        more: f64,
    ) -> Option<f64> {
        if !self.may_be_chance(fitted, other, advantage) {
            return None;
        }
        let (before, after) =
            rayon::join(|| log_likelihood(fitted, self.observations), || log_likelihood(other, self.observations));
        Some(2.0 * (after? - before?) - schwarz_penalty(more, other.count))
    }

    /// Whether chance may have made the deviance between two models that leave hardly more than noise; a tie is no evidence in any case.
    fn may_be_chance(&self, one: &Fitted, other: &Fitted, deviance: f64) -> bool {
        if one.mean_energy().max(other.mean_energy()) > self.policy.incomplete_energy {
            return false;
        }
        let std = energy_difference_std(one, other, self.observations, self.selection);
        deviance.abs() < self.policy.tie_deviance + CHANCE_STANDARD_DEVIATIONS * std
    }
}

fn seat(candidate: &Candidate) -> EffectInChannel {
    (candidate.effect.identifier(), candidate.effect.channel())
}

/// Whether the candidate makes the readings more probable than `without` does, and by more than
/// chance, where chance might have brought it about.
pub(crate) fn is_confirmed(
    candidate: &Candidate,
    without: &Fitted,
    observations: &Observations,
    policy: &Policy,
) -> bool {
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
    let of_each = members.iter().map(|member| of_one_record(fitted, &observations.of_member(member.number)));
    of_each.sum::<Option<f64>>().filter(|likelihood| likelihood.is_finite())
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
