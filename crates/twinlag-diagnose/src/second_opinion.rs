//! What the readings themselves say of candidates, with the gas in the state.
//!
//! The whitened residual knows nothing of the gas: above the frequencies that the gas has, noise of one channel meets noise of the other in
//! it, and what turns the phase of one of them (a delay, a second lag) can pick the angle at which they happen to cancel. So the energies
//! of two models that turn phases differ by chance as well, the more the less their residuals agree. The likelihood of the readings with
//! the gas as one process, its spectrum learned from them, has no such term: where the gas is not, it does not depend on the sensors.

use twinlag_compensate::{Form, learn_quickly, reconstruct};
use twinlag_model::{Extended, Fitted, Observations, Policy, held_out_gain};

use crate::candidates::{Candidate, Search};
use crate::rank::threshold;

/// Standard deviations of the difference of two energies within which chance may have made it.
const CHANCE_STANDARD_DEVIATIONS: f64 = 3.0;
/// Most samples by which the residuals of two models may be apart: what each is centred on, and a delay between the channels.
const MAX_SHIFT_SAMPLES: usize = 16;

impl Search<'_> {
    /// The candidate that makes the readings most probable, among the one that was accepted and its rivals: those that turn phases as it
    /// does and have so nearly its gain that chance may have chosen between them. With it come those that explain the record as well.
    ///
    /// - `ties`: those that do by their gains
    pub(crate) fn by_likelihood(
        &self,
        current: &Fitted,
        first: Candidate,
        ties: Vec<Candidate>,
        all: &[Candidate],
    ) -> (Candidate, Vec<Candidate>) {
        let rivals = self.rivals(current, &first, all);
        if rivals.is_empty() {
            return (first, ties);
        }
        let judged = std::iter::once(&first).chain(&rivals).map(|candidate| {
            let likelihood = log_likelihood(&candidate.fitted, self.observations)?;
            Some((2.0 * likelihood - penalty(candidate.added as f64, &candidate.fitted), candidate.clone()))
        });
        // What has no such likelihood is judged without.
        let Some(mut judged) = judged.collect::<Option<Vec<_>>>() else { return (first, ties) };
        judged.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let (most, best) = judged.remove(0);
        let tied = judged.into_iter().filter(|(deviance, _)| most - deviance < self.policy.tie_deviance);
        let others = ties.into_iter().filter(|tie| !tie.effect.about().turns_phases);
        (best, others.chain(tied.map(|(_, tie)| tie)).collect())
    }

    /// The candidates that could stand in the place of `first`, which turns phases, and between which and it chance may have chosen.
    fn rivals(&self, current: &Fitted, first: &Candidate, all: &[Candidate]) -> Vec<Candidate> {
        let turns_phases = |c: &Candidate| c.effect.about().turns_phases && !c.effect.is_noise();
        if !turns_phases(first) {
            return Vec::new();
        }
        let of_first = first.score(current, self.policy);
        let is_rival = |other: &&Candidate| {
            let score = other.score(current, self.policy);
            score.seat != of_first.seat
                && score.is_sound
                && score.white() > 0.0
                && self.may_be_chance(&first.fitted, &other.fitted, of_first.white() - score.white())
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
        Some(2.0 * (after? - before?) - penalty(more, other))
    }

    /// Whether chance may have made the deviance between two models that leave hardly more than noise. Of so many residuals `N` with the
    /// correlation `ρ` between both models the energies differ with the variance `4 N (1 − ρ²)`; and a tie is no evidence in any case.
    fn may_be_chance(&self, one: &Fitted, other: &Fitted, deviance: f64) -> bool {
        if one.mean_energy().max(other.mean_energy()) > self.policy.incomplete_energy {
            return false;
        }
        let apart = 1.0 - self.residual_correlation(one, other).powi(2);
        let std = 2.0 * (one.count * apart).max(0.0).sqrt();
        deviance.abs() < self.policy.tie_deviance + CHANCE_STANDARD_DEVIATIONS * std
    }

    /// The correlation between the residuals of two models, each at its own place among the samples.
    fn residual_correlation(&self, one: &Fitted, other: &Fitted) -> f64 {
        let [a, b] = [one, other].map(|fitted| {
            let evaluation = fitted.model.evaluate(&fitted.theta, self.observations);
            let mut by_sample = vec![0.0; self.observations.samples()];
            for (residual, sample) in evaluation.residual.iter().zip(evaluation.sample()) {
                if self.selection.holds(sample) {
                    by_sample[sample] = *residual;
                }
            }
            by_sample
        });
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let energy = (dot(&a, &a) * dot(&b, &b)).sqrt();
        let shifted = |by: usize| dot(&a[by.min(a.len())..], &b).max(dot(&a, &b[by.min(b.len())..]));
        (0..=MAX_SHIFT_SAMPLES).map(|by| shifted(by) / energy).fold(0.0, f64::max)
    }
}

/// Schwarz's penalty of so many parameters.
fn penalty(parameters: f64, fitted: &Fitted) -> f64 {
    parameters * fitted.count.max(2.0).ln()
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
