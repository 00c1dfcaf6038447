//! Which numbers an effect that nobody has seen could move.
//!
//! A search names an effect where it stands out from chance. One that does not may be there all the same, and where the record
//! hardly shows it, it may move a number by more than its interval. How probable that is follows from Bayes'
//! rule with two ingredients from outside the record: how often an effect is there at all, and how large it then usually is
//! (a normal of zero mean whose standard deviation is [`Effect::usual_size`](twinlag_model::Effect::usual_size)). What the record
//! shows well, and does not show, is not there.

use std::ops::Range;

use twinlag_model::{
    Effort, Fitted, Identifier, Model, ModelError, Observations, Prepared, Settings, Shared, Watch, evenly_spread,
};

use crate::candidates::{Candidate, Search};
use crate::size::{Around, Lacking, Posterior, Profile, least_size};

/// Pieces of a longer record that are looked at for effects that two lags may hide, and the samples of each in the last look.
/// What is resolved in them is in the whole; of what is not, they say more often that it may be there. Chosen: a second for the
/// largest.
const PIECES: usize = 4;
const PIECE_SAMPLES: usize = 16_384;
/// Samples of each piece in the looks before the last one: each takes an eighth of the time of the next.
const FIRST_PIECES_SAMPLES: [usize; 2] = [512, 4096];
/// Parts of the probability that the policy allows: up to the first, what would move a number is improbable enough for no
/// further look; effects that together have no more than the second are left out of it. Of 480 numbers of two lags that leave
/// only noise (299 records of random rigs, each with an effect of a tenth or so of its usual size, 2000 to 100 000 samples) two
/// then have another grade than by a single look at all; with parts of 1 and 0.1 it is seven.
const SETTLED_SHARE: f64 = 0.5;
const CLOSED_SHARE: f64 = 0.1;

/// Part of the usual size of an effect below none up to which it counts as positive: bounds leave room for noise. Chosen.
const NEGLIGIBLE_SHARE: f64 = 0.1;

/// The samples of a record by which [`unseen`] judges it, where it does not take them all.
pub fn pieces_of_long(samples: usize) -> Option<Vec<Range<usize>>> {
    let piece = |start: usize| start..start + PIECE_SAMPLES;
    (samples > PIECES * PIECE_SAMPLES).then(|| evenly_spread(samples, PIECES, PIECE_SAMPLES).map(piece).collect())
}

/// Effects that two lags may hide, for both time constants and their difference: those that most probably are there unseen and
/// move the number out of its interval, where that is together more probable than the policy allows.
///
/// ```
/// use twinlag_diagnose::{Observations, Settings, Stretch, unseen};
/// # let time_s: Vec<f64> = (0..4000).map(|k| 0.01 * f64::from(k)).collect();
/// # let gas = |t: f64| (1..40).map(|m| (0.9 * f64::from(m * m) * t + f64::from(m)).sin() / f64::from(m)).sum::<f64>();
/// # let lag = |tau_s: f64, seed: u32| {
/// #     let (mut t_c, mut state) = (0.0, seed);
/// #     time_s.iter().map(|t| {
/// #         t_c += (gas(*t) - t_c) * (1.0 - (-0.01 / tau_s).exp());
/// #         state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
/// #         t_c + 0.02 * (f64::from(state) / f64::from(u32::MAX) - 0.5)
/// #     }).collect::<Vec<f64>>()
/// # };
/// # let reading_c = [lag(0.05, 1), lag(0.3, 2)];
/// // 40 s of a gas with many frequencies, as sensors of 0.05 and 0.3 s read it; these were found within 1 %.
/// let observations = Observations::new(vec![Stretch::new(time_s, reading_c)], Some(0.01))?;
/// let half_s = [Some(0.0005), Some(0.003), Some(0.003)];
/// let watch = |_: &str, _, _| std::ops::ControlFlow::Continue(());
/// let hidden = unseen(&observations, &Settings::default(), [0.05, 0.3], &[], half_s, &watch)?;
/// assert!(hidden.iter().all(Vec::is_empty));
/// # Ok::<(), twinlag_diagnose::ModelError>(())
/// ```
///
/// Looks at ever longer pieces are taken until all that would move a number is improbable enough, and at those effects alone of
/// which a shorter one has left it open: whatever part of a record makes an effect improbable, it is. The likeliest come first,
/// and where these are improbable enough after all, the others are not looked at again. A record of more than 65 536 samples is
/// judged by four pieces of it.
///
/// - `tau_s`: where to begin the fit of the two lags, s
/// - `beside`: effects that are in the model beside these, each with its channel
/// - `half_s`: half the intervals, s; `None` of a number that has none
///
/// # Errors
/// As [`crate::diagnose()`].
pub fn unseen(
    observations: &Observations,
    settings: &Settings,
    tau_s: [f64; 2],
    beside: &[(Identifier, usize)],
    half_s: [Option<f64>; 3],
    watch: Watch<'_>,
) -> Result<[Vec<Identifier>; 3], ModelError> {
    let asked = Asked { settings, tau_s, beside, watch };
    let most = settings.policy.hidden_effect_probability;
    let above = |hidden: &[Hidden], share: f64| decisive(hidden, &half_s, share * most).concat();
    let is_settled = |hidden: &[Hidden]| above(hidden, SETTLED_SHARE).is_empty();
    let (mut hidden, mut stages) = (Vec::new(), vec![settings.effects.clone()]);
    for look in first_looks(observations) {
        match asked.look(&look, &stages, &mut hidden, is_settled) {
            Ok(true) => return Ok([const { Vec::new() }; 3]),
            Ok(false) => stages = vec![above(&hidden, SETTLED_SHARE), above(&hidden, CLOSED_SHARE)],
            Err(ModelError::Cancelled) => return Err(ModelError::Cancelled),
            // What pieces cannot show, all of the record may.
            Err(_) => {}
        }
    }
    let excerpt = pieces_of_long(observations.samples())
        .map(|pieces| observations.excerpt(pieces.iter().map(|piece| piece.start), PIECE_SAMPLES));
    asked.look(excerpt.as_ref().unwrap_or(observations), &stages, &mut hidden, is_settled)?;
    let mut lists = decisive(&hidden, &half_s, most);
    Ok([0, 1, 2].map(|i| std::mem::take(&mut lists[i])))
}

/// The energy that two lags leave over across the missing readings of a record, over that of the noise, and the probability that noise leaves as
/// much by chance. At missing readings an estimate from unbroken parts alone is cut, and such parts may all be explained by time constants
/// that are wrong.
///
/// - `tau_s`, `beside`: as in [`unseen`]
///
/// # Errors
/// As [`crate::diagnose()`].
pub fn energy_across_missing(
    observations: &Observations,
    settings: &Settings,
    tau_s: [f64; 2],
    beside: &[(Identifier, usize)],
    watch: Watch<'_>,
) -> Result<(f64, f64), ModelError> {
    let prepared = Prepared::new(observations, settings)?;
    let fitted = Asked { settings, tau_s, beside, watch }.fitted(&prepared);
    Ok((fitted.mean_energy(), prepared.chance_of_energy(&fitted)))
}

/// Pieces of a record that is much longer, ever longer ones.
fn first_looks(observations: &Observations) -> impl Iterator<Item = Observations> {
    let samples = observations.samples();
    let is_far_shorter = move |piece: &usize| 2 * PIECES * piece < samples && observations.flow().is_none();
    let pieces = FIRST_PIECES_SAMPLES.into_iter().filter(is_far_shorter);
    let looks = pieces.map(move |piece| observations.excerpt(evenly_spread(samples, PIECES, piece), piece));
    // A record in short stretches has no such pieces.
    looks.filter(move |look| look.samples() < samples)
}

/// What [`unseen`] is asked.
struct Asked<'a> {
    settings: &'a Settings,
    tau_s: [f64; 2],
    beside: &'a [(Identifier, usize)],
    watch: Watch<'a>,
}

impl Asked<'_> {
    /// Puts what `observations` show in the place of what is known of `hidden` effects, stage by stage, each of some kinds, until
    /// it is settled; whether it is.
    fn look(
        &self,
        observations: &Observations,
        stages: &[Vec<Identifier>],
        hidden: &mut Vec<Hidden>,
        is_settled: impl Fn(&[Hidden]) -> bool,
    ) -> Result<bool, ModelError> {
        let Self { settings, watch, .. } = self;
        let prepared = Prepared::new(observations, settings)?;
        let fitted = self.fitted(&prepared);
        let search = Search::of(&prepared, settings, *watch).beside(&fitted);
        let mut done: Vec<Identifier> = Vec::new();
        for kinds in stages {
            let is_next = |kind: Identifier| kinds.contains(&kind) && !done.contains(&kind);
            if !kinds.iter().any(|kind| is_next(*kind)) {
                continue;
            }
            let around = search.quickly_around(&fitted, |effect| is_broad(effect) && is_next(effect.identifier()))?;
            hidden.retain(|hidden| !is_next(hidden.effect));
            hidden.extend(search.near(&around));
            if is_settled(hidden) {
                return Ok(true);
            }
            done.extend(kinds);
        }
        Ok(false)
    }

    /// Two lags with what is in the model beside them.
    fn fitted(&self, prepared: &Prepared) -> Fitted {
        let Self { settings, tau_s, beside, watch } = self;
        let fit =
            |model: &Model, theta: &[f64]| model.fit(theta, &prepared.observations, &prepared.searched, Effort::Finish);
        let mut fitted = fit(&Model::new(&settings.known, prepared.levels.std_k), tau_s);
        for (identifier, channel) in *beside {
            let search = Search::of(prepared, settings, *watch).beside(&fitted);
            let is_it = |effect: &Shared| effect.identifier() == *identifier && effect.channel() == Some(*channel);
            let Some(effect) = search.candidates(&fitted.model).into_iter().find(is_it) else { continue };
            let start = effect.starts().into_iter().next().unwrap_or_default();
            fitted = fit(&fitted.model.with(effect), &[&fitted.theta[..], &start].concat());
        }
        fitted
    }
}

/// Whether an effect is more than a line, which a search finds wherever it matters.
fn is_broad(effect: &Shared) -> bool {
    !effect.about().is_narrow
}

/// An effect that may be there unseen.
struct Hidden {
    effect: Identifier,
    /// Probability that it is there.
    probability: f64,
    shift: Shift,
}

/// How far both time constants, their difference, and the parameters of effects are off where an effect is there unseen.
enum Shift {
    /// In proportion to its size.
    WithSize { for_each: Vec<f64>, size: Posterior },
    /// As far as to where they were fitted with it.
    Afar(Vec<f64>),
    /// Nobody knows.
    Any,
}

impl Shift {
    /// Probability that number `i` is off by more than `distance`.
    fn beyond(&self, i: usize, distance: f64) -> f64 {
        match self {
            Self::WithSize { for_each, .. } if for_each[i] == 0.0 => 0.0,
            Self::WithSize { for_each, size } if for_each[i].is_finite() => size.beyond(distance / for_each[i].abs()),
            Self::Afar(far) if far[i] <= distance => 0.0,
            _ => 1.0,
        }
    }
}

impl Search<'_> {
    /// For both time constants, their difference, and each parameter of the effects of a model the effects that may be there
    /// unseen and move the number by more than half its interval: so many kinds, the likeliest first, that it is together no more
    /// probable than the policy allows that others do.
    ///
    /// - `far`: effects that were fitted with quite other time constants, and not accepted
    /// - `half`: half the intervals; `None` of a number that has none
    pub(crate) fn hidden(&self, around: &Around<'_>, far: &[Candidate], half: &[Option<f64>]) -> Vec<Vec<Identifier>> {
        let mut hidden = self.near(around);
        hidden.extend(
            far.iter().filter_map(|c| unseen_afar(around.fitted, c, self.prior_probability(&c.effect, around))),
        );
        decisive(&hidden, half, self.policy.hidden_effect_probability)
    }

    /// The effects that a model lacks, where its time constants are.
    fn near(&self, around: &Around<'_>) -> Vec<Hidden> {
        let lacking = around.lacking.iter().filter(|lacking| is_broad(&lacking.effect));
        let prior = |effect: &Shared| self.prior_probability(effect, around);
        lacking.flat_map(|lacking| unseen_near(around.fitted, lacking, prior(&lacking.effect))).collect()
    }

    /// How probable `effect` is beforehand: each kind of effect that the model lacks is as probable as any other, but for those that
    /// turn phases, and the places and forms that it may have share that. One that the model has in one sensor is in the other one as
    /// probable as a kind that it lacks.
    fn prior_probability(&self, effect: &Shared, around: &Around<'_>) -> f64 {
        let is_named = |kind: Identifier| around.fitted.model.effects.iter().any(|e| e.identifier() == kind);
        let kinds: Vec<Identifier> = around.sized.iter().filter(|e| is_broad(e)).map(|e| e.identifier()).collect();
        let forms = kinds.iter().filter(|kind| **kind == effect.identifier()).count();
        let is_new = |i: usize| !is_named(kinds[i]) && !kinds[..i].contains(&kinds[i]);
        let lacking = (0..kinds.len()).filter(|&i| is_new(i)).count();
        let factor = if effect.about().turns_phases { self.policy.prior_phase_factor } else { 1.0 };
        factor * self.policy.prior_effect_probability / (lacking.max(1) * forms.max(1)) as f64
    }
}

/// For each number the kinds of effects that may move it by more than half its interval and without which it is together no more
/// probable than `most` that others do.
fn decisive(hidden: &[Hidden], half: &[Option<f64>], most: f64) -> Vec<Vec<Identifier>> {
    let of = |(i, half): (usize, &Option<f64>)| {
        let moves = |h: &Hidden| half.map_or(0.0, |half| h.probability * h.shift.beyond(i, half));
        too_probable(hidden.iter().map(|h| (h.effect, moves(h))), most)
    };
    half.iter().enumerate().map(of).collect()
}

/// Kinds of effects without which all others are together no more probable than `most`.
fn too_probable(hidden: impl Iterator<Item = (Identifier, f64)>, most: f64) -> Vec<Identifier> {
    let mut kinds: Vec<(Identifier, f64)> = Vec::new();
    for (effect, probability) in hidden {
        match kinds.iter_mut().find(|(kind, _)| *kind == effect) {
            Some((_, sum)) => *sum += probability,
            None => kinds.push((effect, probability)),
        }
    }
    kinds.sort_by(|a, b| b.1.total_cmp(&a.1));
    let from = |first: usize| kinds[first..].iter().map(|(_, probability)| probability).sum::<f64>();
    let count = (0..kinds.len()).find(|count| from(*count) <= most).unwrap_or(kinds.len());
    kinds[..count].iter().map(|(kind, _)| *kind).collect()
}

/// How probable an effect is, and what it would do, for each set of values that its other parameters may begin with.
fn unseen_near<'a>(current: &'a Fitted, lacking: &'a Lacking, prior: f64) -> impl Iterator<Item = Hidden> + 'a {
    let Lacking { effect, main, along } = lacking;
    let (count, prior) = (current.theta.len(), prior / along.len() as f64);
    let hidden = move |along: &Option<Profile>, usual: f64| {
        let size = &effect.parameters()[*main];
        let is_positive = least_size(size) - size.variable.lower < NEGLIGIBLE_SHARE * usual;
        let (bayes_factor, shift) = along.as_ref().map_or((1.0, Shift::Any), |along| {
            let size = along.posterior(usual, is_positive);
            (size.bayes_factor, Shift::WithSize { for_each: with_difference(&along.follow[..count]), size })
        });
        Hidden { effect: effect.identifier(), probability: probability_of(prior * bayes_factor), shift }
    };
    let usual = effect.usual_size();
    along.iter().filter_map(move |along| Some(hidden(along, usual?)))
}

fn probability_of(odds: f64) -> f64 {
    if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 }
}

/// How probable an effect is that was fitted with quite other time constants.
fn unseen_afar(current: &Fitted, candidate: &Candidate, prior: f64) -> Option<Hidden> {
    let Candidate { effect, fitted, .. } = candidate;
    let main = effect.main()?;
    let gain = candidate.white_gain.min(candidate.robust_gain) - (candidate.added - 1) as f64;
    if gain <= 0.0 || !fitted.end.is_usable() || !candidate.is_clear_of_bounds() {
        return None;
    }
    let usual = effect.usual_size()?;
    // So many standard errors make the gain.
    let error = fitted.theta[current.theta.len() + main].abs() / gain.sqrt();
    let odds = prior * error / error.hypot(usual) * (0.5 * gain).exp();
    let (here, there) = (with_difference(&current.theta), with_difference(&fitted.theta[..current.theta.len()]));
    let far = here.iter().zip(&there).map(|(here, there)| (there - here).abs()).collect();
    Some(Hidden { effect: effect.identifier(), probability: probability_of(odds), shift: Shift::Afar(far) })
}

/// Both time constants, their difference, and the parameters of effects, from the parameters of a model.
fn with_difference(theta: &[f64]) -> Vec<f64> {
    [&[theta[0], theta[1], theta[1] - theta[0]], &theta[2..]].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A size that is normal about none is beyond one standard deviation in 32 of 100 cases, beyond half of one in 62. Of an effect
    /// that is there in one of ten, the first is below the one in twenty that is allowed and the second above.
    #[test]
    fn what_seldom_moves_a_number_out_of_its_interval_is_no_condition() {
        let hidden = |for_each: Vec<f64>| {
            let size = Profile::unseen().posterior(1.0, false);
            Hidden { effect: Identifier::DELAY, probability: 0.1, shift: Shift::WithSize { for_each, size } }
        };
        let half = [Some(1.0), Some(0.5), None];
        let lists = decisive(&[hidden(vec![1.0; 3])], &half, 0.05);
        assert_eq!(lists, [vec![], vec![Identifier::DELAY], vec![]]);
        // An effect that does not move a number, or opposite to it, and one of which nothing is known.
        let lists = decisive(&[hidden(vec![0.0, -1.0, 1.0])], &[Some(0.0), Some(0.5), Some(0.5)], 0.05);
        assert_eq!(lists, [vec![], vec![Identifier::DELAY], vec![Identifier::DELAY]]);
        let any = Hidden { effect: Identifier::DELAY, probability: 0.1, shift: Shift::Any };
        assert_eq!(decisive(&[any], &half, 0.05)[0], [Identifier::DELAY]);
    }
}
