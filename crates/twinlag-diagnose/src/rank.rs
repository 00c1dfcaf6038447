//! Which candidate comes first: a matter of numbers alone, with no record and no model.

use std::cmp::Ordering;

use statrs::distribution::{ChiSquared, ContinuousCDF};
use twinlag_model::{Identifier, Policy};

/// What an effect is to the order of candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A disagreement at rest.
    Static,
    /// One that looks like a static one where it is small.
    Imitator,
    /// Any other that changes what the sensors do.
    Sensor,
    /// Noise of another colour.
    Noise,
}

/// What a candidate is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Score {
    /// The effect and its channel: candidates that share both are forms of one effect.
    pub(crate) seat: (Identifier, Option<usize>),
    pub(crate) kind: Kind,
    /// Place in the order of how often effects occur, the most frequent first.
    pub(crate) prevalence: u8,
    /// Whether another form of the effect is taken where the record does not distinguish them.
    pub(crate) yields: bool,
    /// Whether its fit has ended well, its parameters inside their bounds, with enough residuals
    /// left.
    pub(crate) is_sound: bool,
    /// Parameters that it adds.
    pub(crate) added: usize,
    /// Residuals that it is judged by.
    pub(crate) count: f64,
    /// Deviance that it saves if the noise is white.
    pub(crate) white_gain: f64,
    /// Deviance that it saves with a free noise level in every band of frequency.
    pub(crate) robust_gain: f64,
    /// Weight of its gains against those of other candidates: those of a line are of all
    /// frequencies, whatever weight these have.
    pub(crate) share: f64,
    /// Deviance that it saves with levels as free as those beside a noise: that of the same spectrum
    /// as the gain of the noise that it is held against. `None` without noise among the candidates.
    pub(crate) free_level_gain: Option<f64>,
    /// Energy per residual that it leaves.
    pub(crate) energy: f64,
}

impl Score {
    fn penalty(&self) -> f64 {
        schwarz_penalty(self.added as f64, self.count)
    }

    /// Deviance saved beyond the penalty, if the noise is white.
    pub(crate) fn white(&self) -> f64 {
        self.share * self.white_gain - self.penalty()
    }

    /// Deviance saved beyond the penalty for as many residuals as it was found in: what a candidate is worth by itself. A line counts by
    /// its share only against others.
    fn alone(&self) -> f64 {
        self.white_gain - schwarz_penalty(self.added as f64, self.count / self.share)
    }

    /// Deviance saved beyond the penalty, whatever the noise.
    fn robust(&self) -> f64 {
        self.share * self.robust_gain - self.penalty()
    }

    fn is_noise(&self) -> bool {
        self.kind == Kind::Noise
    }
}

/// The deviance that noise alone saves with probability `p` when `added` parameters are added.
pub(crate) fn threshold(added: usize, p: f64) -> f64 {
    let chi2 = ChiSquared::new(added.max(1) as f64).expect("a positive number");
    chi2.inverse_cdf(1.0 - p)
}

/// Deviance by which so many parameters are expected to be better than none in a fit of `count` residuals (Schwarz 1978).
pub(crate) fn schwarz_penalty(parameters: f64, count: f64) -> f64 {
    parameters * count.max(2.0).ln()
}

/// The deviance that `added` parameters must save, by chance and by penalty, to be worth having in
/// a fit of `count` residuals.
pub(crate) fn worth(added: usize, count: f64, policy: &Policy) -> f64 {
    threshold(added, policy.round_false_alarm_probability).max(added as f64 * count.ln())
}

/// The candidates that may be taken, the first choice first.
///
/// 1. Effects of the sensors whose robust gain is beyond chance and whose white gain is beyond the
///    penalty. Noise comes where there are none, or where it explains incomparably more.
/// 2. Of those with nearly the best robust gain the one with the best white gain; of these, where
///    they hardly differ, the one that occurs more often.
/// 3. A static disagreement before its imitators, and where no effect explains the record. Noise
///    comes first there if there is no static disagreement.
/// 4. Of the forms of one effect that the record does not distinguish, the usual one.
///
/// - `considered`: candidates of the round, those among them that were not worth a fit as well: any of them may have
///   been the one that chance favours
pub(crate) fn rank(scores: &[Score], considered: usize, policy: &Policy) -> Vec<usize> {
    let probability = policy.round_false_alarm_probability / considered.max(scores.len()).max(1) as f64;
    let is_worth = |s: &Score, gain: f64| gain > threshold(s.added, probability) && s.alone() > 0.0;
    let noise = best_first(scores, Score::white, |s| s.is_noise() && is_worth(s, s.white_gain));
    // Fitted with wrong weights, an effect absorbs a little of any noise.
    let loudest = noise.first().map_or(0.0, |i| scores[*i].white_gain);
    let is_beside_noise = |s: &Score| {
        s.robust_gain > policy.beside_noise_share * loudest
            || s.free_level_gain.is_some_and(|gain| gain > policy.instead_of_noise_share * loudest)
    };
    let effects = best_first(scores, Score::robust, |s| {
        !s.is_noise() && s.is_sound && is_worth(s, s.robust_gain) && is_beside_noise(s)
    });
    let Some(&best) = effects.first() else { return noise };
    let near = |s: &Score| s.robust() > scores[best].robust() - policy.near_deviance;
    let mut order: Vec<usize> = effects.iter().copied().filter(|i| near(&scores[*i])).collect();
    order.sort_by(|a, b| descending(scores[*a].white(), scores[*b].white()));
    let highest = scores[order[0]].white();
    let is_same = |i: &usize| highest - scores[*i].white() < policy.same_deviance;
    if let Some(at) = (0..order.len()).filter(|at| is_same(&order[*at])).min_by_key(|at| scores[order[*at]].prevalence)
    {
        order.swap(0, at);
    }
    let first = &scores[order[0]];
    let is_incomplete = first.energy > policy.incomplete_energy;
    if first.kind == Kind::Imitator || is_incomplete {
        let at_rest = order.iter().chain(&effects).filter(|i| scores[**i].kind == Kind::Static);
        let is_due = |s: &Score| {
            highest - s.white() < policy.tie_deviance
                || (is_incomplete && s.white() > policy.static_share * highest && s.robust_gain > 0.0)
        };
        let at_rest = at_rest.max_by(|a, b| scores[**a].white().total_cmp(&scores[**b].white()));
        let at_rest = at_rest.filter(|i| is_due(&scores[**i])).copied();
        // Where model error dominates, weights that are those of the residual itself let the rest
        // be seen.
        let before = at_rest.or_else(|| noise.first().copied().filter(|_| is_incomplete));
        if let Some(before) = before {
            order.retain(|i| *i != before);
            order.insert(0, before);
        }
    }
    let first = &scores[order[0]];
    // Where model error dominates, gains do not distinguish forms of one effect.
    let is_open =
        |s: &Score| first.energy > policy.incomplete_energy || first.white() - s.white() < policy.tie_deviance;
    let is_usual = |s: &Score| (s.seat, s.added) == (first.seat, first.added) && !s.yields && is_open(s);
    let usual = order.iter().chain(&effects).copied().find(|i| first.yields && is_usual(&scores[*i]));
    if let Some(usual) = usual {
        order.retain(|i| *i != usual);
        order.insert(0, usual);
    }
    order
}

/// Which of `others` explain the record as well as `first`, noise beside noise and effects of the
/// sensors beside such.
pub(crate) fn ties(first: &Score, others: &[Score], policy: &Policy) -> Vec<usize> {
    let is_tie = |s: &Score| {
        s.seat != first.seat && s.is_noise() == first.is_noise() && first.white() - s.white() < policy.tie_deviance
    };
    (0..others.len()).filter(|i| is_tie(&others[*i])).collect()
}

/// What an effect that is in the model, and its look-alikes in its place, are worth: their kinds,
/// and the deviance by which a look-alike is better, its parameters counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LookAlike {
    pub(crate) kind: Kind,
    /// Whether its fit is one that may take another's place.
    pub(crate) can_replace: bool,
    pub(crate) advantage: f64,
}

impl LookAlike {
    /// Whether it explains the record as well as what it would replace.
    pub(crate) fn is_tied(&self, policy: &Policy) -> bool {
        self.advantage > -policy.tie_deviance
    }
}

/// The look-alike that takes the place of an effect of `kind`: one that is clearly better, or a
/// static disagreement that is as good as its imitator.
pub(crate) fn successor(kind: Kind, look_alikes: &[LookAlike], policy: &Policy) -> Option<usize> {
    look_alikes.iter().position(|l| {
        let is_due = kind == Kind::Imitator && l.kind == Kind::Static && l.is_tied(policy);
        l.can_replace && (l.advantage > policy.tie_deviance || is_due)
    })
}

fn descending(a: f64, b: f64) -> Ordering {
    b.total_cmp(&a)
}

/// Indices of the scores that `holds` is true of, those of the largest `value` first.
fn best_first(scores: &[Score], value: impl Fn(&Score) -> f64, holds: impl Fn(&Score) -> bool) -> Vec<usize> {
    let mut out: Vec<usize> = (0..scores.len()).filter(|i| holds(&scores[*i])).collect();
    out.sort_by(|a, b| descending(value(&scores[*a]), value(&scores[*b])));
    out
}

#[cfg(test)]
mod tests;
