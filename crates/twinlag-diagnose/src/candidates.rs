//! What may be added to a model: made from what the record shows, screened by a linearisation,
//! fitted.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use twinlag_model::{
    Bands, Beside, Context, Effort, Fitted, Gas, Identifier, Linearised, Model, ModelError, Observations, Parameter,
    Policy, Prepared, Selection, Settings, Shared, Watch, candidates, dense, line_channel, lines, report,
    white_deviance,
};
use twinlag_optimise::{End, Scale, Variable};

use crate::grade::Reason;
use crate::long::is_long;
use crate::own_in_each::shorter_forms;
use crate::rank::{Kind, Score, schwarz_penalty, threshold};

/// Margin of a logarithm from its bound, and of a number as a share of its range, within which a
/// parameter is on its bound.
const LOG_MARGIN: f64 = 1e-3;
const LINEAR_MARGIN: f64 = 1e-9;
/// Share of the gain of the best start, by its linearisation, from which on another start is fitted as well. Of a gas with few tones starts
/// gain alike, and from the best alone a delay of 5 ms was found as radiation (the test of a delay that is no period longer). Chosen: half.
const START_GAIN_SHARE: f64 = 0.5;
/// Points of the grid of each time constant, and its ends: sample periods, and a share of the
/// record.
const GRID_POINTS: usize = 5;
const GRID_FROM_PERIODS: f64 = 2.0;
const GRID_TO_SHARE: f64 = 0.03;
/// Fewest periods of a line in the longest of several records. A search starts from 1.5 periods, the slowest line of a single record, and
/// a fit may move the frequency by 1.5 more.
const MIN_LINE_PERIODS: f64 = 3.0;
/// Parameters of an effect up to which it is fitted from that grid.
const MOST_GRID_PARAMETERS: usize = 3;

/// A candidate with its fit.
#[derive(Clone)]
pub(crate) struct Candidate {
    pub(crate) effect: Shared,
    pub(crate) fitted: Fitted,
    /// The better first look among the starts of which `fitted` is not: plain ones, or those of [`balanced_start`]. `None` if there are no such starts,
    /// and once fitted to the end. A first look is too short to say which of the two ends lower, so both are fitted to the end.
    pub(crate) runner_up: Option<Fitted>,
    /// Parameters it added.
    pub(crate) added: usize,
    /// `−2 ln L` saved, noise white with the levels that there are.
    pub(crate) white_gain: f64,
    /// `−2 ln L` saved with a free noise level in every band: what noise of any colour does not
    /// explain.
    pub(crate) robust_gain: f64,
    /// `−2 ln L` saved with levels as free as those beside a noise: what its gain is to be held
    /// against. `None` in a round without noise among the candidates.
    pub(crate) free_level_gain: Option<f64>,
    /// Nats that it saves on blocks that were left out.
    pub(crate) held_out_nats: f64,
    /// What its gains count beside those of the others.
    pub(crate) share: f64,
    /// The place of the effect that has lost a parameter to make room for this one.
    pub(crate) shortened: Option<usize>,
}

/// An effect that is worth a fit, and where from.
struct Promising {
    effect: Shared,
    starts: Vec<Vec<f64>>,
    /// Energy that it takes off if the residual is linear in everything; boundless where that was
    /// not asked.
    gain: f64,
}

/// What an effect is to the order of candidates.
pub(crate) fn kind(effect: &Shared) -> Kind {
    let about = effect.about();
    if about.is_noise {
        Kind::Noise
    } else if about.is_static {
        Kind::Static
    } else if about.imitates_static {
        Kind::Imitator
    } else {
        Kind::Sensor
    }
}

impl Candidate {
    /// What it is worth, added to `current`.
    pub(crate) fn score(&self, current: &Fitted, policy: &Policy) -> Score {
        Score {
            seat: (self.effect.identifier(), self.effect.channel()),
            kind: kind(&self.effect),
            prevalence: self.effect.about().rank,
            yields: self.effect.yields_to_other_forms(),
            is_sound: self.is_sound(current, policy),
            added: self.added,
            count: self.fitted.count,
            white_gain: self.white_gain,
            robust_gain: self.robust_gain,
            share: self.share,
            free_level_gain: self.free_level_gain,
            energy: self.fitted.mean_energy(),
        }
    }

    /// Whether its fit says anything: it has ended well, and keeps most residuals. A time constant
    /// that is too short to be seen may lie on its bound, which says nothing against the effect.
    fn is_sound(&self, current: &Fitted, policy: &Policy) -> bool {
        let has_ended = match &self.fitted.end {
            End::OnBound(which) => which.iter().all(|i| *i < 2),
            end => end.is_usable() || *end == End::LimitReached,
        };
        has_ended && self.fitted.count > policy.kept_share * current.count && self.is_clear_of_bounds()
    }

    /// Whether every parameter of an effect, noise left out, lies inside its bounds.
    pub(crate) fn is_clear_of_bounds(&self) -> bool {
        effects_on_bounds(&self.fitted).next().is_none()
    }
}

/// The effects, noise aside, of which the best fit lies on a bound. Standard errors of all other numbers of the model hold them there, so
/// these are no estimates either.
pub(crate) fn effects_on_bounds(fitted: &Fitted) -> impl Iterator<Item = Reason> {
    let effects = fitted.model.effects.iter().enumerate().filter(|(_, effect)| !effect.is_noise());
    let on_bounds = effects.filter(|(index, effect)| {
        let mut places = effect.parameters().iter().zip(fitted.model.range(*index));
        places.any(|(parameter, at)| is_on_bound(parameter, at, fitted))
    });
    on_bounds.map(|(_, effect)| Reason::EffectOnBound { effect: effect.identifier(), channel: effect.channel() })
}

/// Whether a parameter of an effect lies on a bound of it in a fit.
///
/// - `at`: its place among all that the model has
pub(crate) fn is_on_bound(parameter: &Parameter, at: usize, fitted: &Fitted) -> bool {
    let has_ended_there = matches!(&fitted.end, End::OnBound(which) if which.contains(&at));
    has_ended_there || !is_inside_bounds(parameter, fitted.theta[at])
}

/// Whether a value of a parameter lies inside its bounds, and not on one.
fn is_inside_bounds(parameter: &Parameter, value: f64) -> bool {
    let Variable { lower, upper, scale, .. } = parameter.variable;
    let [margin, low, high] = match scale {
        Scale::Logarithmic => [LOG_MARGIN, (value / lower).ln(), (upper / value).ln()],
        Scale::Linear { .. } => [LINEAR_MARGIN * (upper - lower), value - lower, upper - value],
    };
    value.is_finite() && low > margin && high > margin
}

/// Deviance saved by going from `before` to `after`, the level of the noise free.
pub(crate) fn white_gain(before: &Fitted, after: &Fitted) -> f64 {
    after.count * (before.mean_energy() / after.mean_energy().max(1e-300)).ln()
}

/// Whether the model lacks the effect, and can take it: it repeats none, excludes none, and determines
/// nothing that another one determines.
pub fn accepts(model: &Model, effect: &Shared) -> bool {
    let id = effect.identifier();
    let is_form_of =
        |e: &Shared| e.identifier() == id && (e.channel() == effect.channel() || !effect.about().is_narrow);
    let is_excluded = model.effects.iter().any(|e| is_form_of(e) || e.identifier().excludes(id));
    let determined: Vec<_> = model.parameters().filter_map(|p| p.determines).collect();
    let mut determines = effect.parameters().iter().filter_map(|p| p.determines);
    !is_excluded && !determines.any(|freedom| determined.contains(&freedom))
}

/// Whether `model` has the effect in the other channel alone, and could take it in place of that. Of effects that turn phases: of
/// others that both channels have, only the difference shows.
fn is_in_other_channel(model: &Model, effect: &Shared) -> bool {
    let same: Vec<usize> =
        (0..model.effects.len()).filter(|&i| model.effects[i].identifier() == effect.identifier()).collect();
    let [other] = same[..] else { return false };
    let channels = [effect.channel(), model.effects[other].channel()];
    effect.about().turns_phases
        && channels.iter().all(Option::is_some)
        && channels[0] != channels[1]
        && accepts(&model.without(other), effect)
}

/// What a search works on.
pub(crate) struct Search<'a> {
    prepared: &'a Prepared,
    pub(crate) observations: &'a Observations,
    pub(crate) selection: &'a Selection,
    pub(crate) context: Context,
    /// Effects that may be named.
    pub(crate) allowed: &'a [Identifier],
    pub(crate) policy: &'a Policy,
    watch: Watch<'a>,
    excerpt: OnceLock<Excerpt>,
}

/// Pieces of a long record, all of a short one, and what counts of them.
type Excerpt = (Observations, Selection);

impl<'a> Search<'a> {
    /// A search of `prepared`.
    pub(crate) fn of(prepared: &'a Prepared, settings: &'a Settings, watch: Watch<'a>) -> Self {
        Self {
            prepared,
            observations: &prepared.observations,
            selection: &prepared.searched,
            context: prepared.context.clone(),
            allowed: &settings.effects,
            policy: &settings.policy,
            watch,
            excerpt: OnceLock::new(),
        }
    }

    /// What a first look takes in.
    pub(crate) fn excerpt(&self) -> &Excerpt {
        self.excerpt.get_or_init(|| self.prepared.excerpt())
    }

    /// The search with candidates made from what `current` shows: its time constants, lines that it
    /// leaves over.
    pub(crate) fn beside(mut self, current: &Fitted) -> Self {
        self.context.tau_s = [current.theta[0], current.theta[1]];
        // Of several records, what is slower than this differs from record to record, and is no line.
        let slowest_hz = if self.context.members.len() < 2 { 0.0 } else { MIN_LINE_PERIODS / self.context.span_s() };
        let found = lines(current, self.observations, |s| self.selection.holds(s), self.policy).into_iter();
        let within = found.filter(|hz| *hz >= slowest_hz);
        self.context.lines = within.map(|hz| (hz, line_channel(self.observations, hz))).collect();
        // After the lines, which take as much memory again, and leave none of it.
        if self.allowed.iter().any(|effect| effect.about().follows_gas) {
            self.context.gas = current.estimated_gas(self.observations);
        }
        self
    }

    /// The gas temperature that candidates were made for; `None` where none follows it.
    pub(crate) fn gas(&self) -> Option<&Arc<Gas>> {
        self.context.gas.as_ref()
    }

    /// The candidates that `model` lacks and can take.
    pub(crate) fn candidates(&self, model: &Model) -> Vec<Shared> {
        candidates(self.allowed, &self.context).into_iter().filter(|c| accepts(model, c)).collect()
    }

    /// The candidates that `model` lacks and can take, and those that turn phases in one channel where it has the same effect in the
    /// other: the search names each effect once, and both sensors may have it.
    pub(crate) fn unseen_candidates(&self, model: &Model) -> Vec<Shared> {
        let mut all = candidates(self.allowed, &self.context);
        all.retain(|candidate| accepts(model, candidate) || is_in_other_channel(model, candidate));
        all
    }

    /// What `work` makes of each of the items, in their order.
    ///
    /// # Errors
    /// [`ModelError::Cancelled`] if the watch says so.
    pub(crate) fn each<T: Sync, R: Send>(
        &self,
        items: &[T],
        work: impl Fn(&T) -> R + Sync,
    ) -> Result<Vec<R>, ModelError> {
        let done = AtomicUsize::new(0);
        let one = |item| {
            let out = work(item);
            report(self.watch, "candidates", done.fetch_add(1, Ordering::Relaxed) + 1, items.len())?;
            Ok(out)
        };
        items.par_iter().map(one).collect()
    }

    pub(crate) fn bands(&self, fitted: &Fitted) -> Bands {
        Bands::of(&fitted.model.residual_runs(&fitted.theta, self.observations, |s| self.selection.holds(s)))
    }

    /// `−2 ln L` with a free noise level in every band.
    pub(crate) fn robust(&self, fitted: &Fitted) -> f64 {
        self.bands(fitted).robust(|omega| self.selection.weighting.at(omega))
    }

    /// `−2 ln L` of white noise whose levels are as free as those beside a noise of another colour.
    fn at_free_levels(&self, fitted: &Fitted) -> f64 {
        let plant = fitted.model.plant(&fitted.theta, self.observations);
        white_deviance(&plant, self.observations, &self.bands(fitted), self.context.is_coarse)
    }

    /// The part of all residuals that an effect is judged by: a line has its own frequency, and is judged there, with no weight over
    /// frequency, and any other by what the weights leave of them.
    fn share(&self, effect: &Shared) -> f64 {
        if effect.about().is_narrow { self.selection.weighting.mean() } else { 1.0 }
    }

    /// As many residuals as an effect is judged by.
    pub(crate) fn residuals(&self, fitted: &Fitted, effect: &Shared) -> f64 {
        fitted.count / self.share(effect)
    }

    /// Deviance that an effect saves if the noise is white.
    pub(crate) fn white_gain(&self, before: &Fitted, after: &Fitted, effect: &Shared) -> f64 {
        if !effect.about().is_narrow {
            return white_gain(before, after);
        }
        let energy = |fitted: &Fitted| {
            let evaluation = fitted.model.evaluate(&fitted.theta, self.observations);
            let pairs = evaluation.residual.iter().zip(evaluation.sample());
            let held = pairs.filter(|(_, s)| self.selection.holds(*s));
            held.fold((0.0, 0.0), |(sum, n), (r, _)| (sum + r * r, n + 1.0))
        };
        let ((b, n), (a, _)) = (energy(before), energy(after));
        n * (b / a.max(1e-300)).ln()
    }

    /// Both gains of a candidate, white and robust: those of a line are one, since no band with a free level is as narrow.
    fn gains(&self, before: &Fitted, after: &Fitted, effect: &Shared, robust: f64) -> [f64; 2] {
        let white = self.white_gain(before, after, effect);
        [white, if effect.about().is_narrow { white } else { robust }]
    }

    /// Every candidate that may be added to `current`: those that may explain something are fitted,
    /// the best few to the end.
    pub(crate) fn fitted(&self, current: &Fitted) -> Result<Vec<Candidate>, ModelError> {
        let promising = self.screened(current)?;
        let robust_before = self.robust(current);
        // Where the model is far off, every candidate is fitted, from a grid of time constants as
        // well.
        let is_far_off = self.is_far_off(current);
        let looked = self.each(&promising, |Promising { effect, starts, gain }| {
            let looked = if effect.is_noise() {
                self.with_noise(current, effect)?
            } else if is_far_off {
                self.looked_at(current, effect)
            } else {
                self.with(current, effect, starts)
            };
            Some((gain.max(looked.white_gain).max(looked.robust_gain), looked))
        })?;
        let (noise, mut mean): (Vec<_>, Vec<_>) = looked.into_iter().flatten().partition(|(_, c)| c.effect.is_noise());
        let unshared = |c: &Candidate| c.white_gain - schwarz_penalty(c.added as f64, c.fitted.count);
        mean.sort_by(|(_, a), (_, b)| unshared(b).total_cmp(&unshared(a)));
        mean.truncate(self.policy.most_fitted_candidates);
        let mut finished = Vec::new();
        if !is_far_off {
            // With a smaller part of the best gain than this none is taken, not even a static one.
            let finite = mean.iter().map(|(gain, _)| *gain).filter(|gain| gain.is_finite());
            let least = self.policy.static_share * finite.fold(0.0, f64::max);
            mean.retain(|(gain, _)| *gain > least);
        } else if !mean.is_empty() {
            let (_, looked) = mean.remove(0);
            let best = self.finished(current, &looked, robust_before);
            // Where this one leaves but noise, those that explain far less are not fitted to the end.
            if best.fitted.mean_energy() < self.policy.incomplete_energy {
                mean.retain(|(_, c)| c.white_gain > self.policy.rival_share * looked.white_gain);
            }
            finished.extend(self.beside_best(current, &best, robust_before));
            finished.push(best);
        }
        finished.extend(self.each(&mean, |(_, looked)| self.finished(current, looked, robust_before))?);
        finished.extend(self.own_in_each(current)?);
        if !noise.is_empty() {
            let before = self.at_free_levels(current);
            let after = self.each(&finished, |candidate| self.at_free_levels(&candidate.fitted))?;
            for (candidate, after) in finished.iter_mut().zip(after) {
                candidate.free_level_gain = Some(before - after);
            }
        }
        Ok(finished.into_iter().chain(noise.into_iter().map(|(_, c)| c)).collect())
    }

    /// Candidates that turn phases, from a grid of time constants: with them the time constants may lie where no step
    /// from `current` leads. None where the model is far off, since every candidate was fitted from there.
    pub(crate) fn far_away(&self, current: &Fitted) -> Result<Vec<Candidate>, ModelError> {
        if self.is_far_off(current) {
            return Ok(Vec::new());
        }
        let mut all = self.candidates(&current.model);
        all.retain(|c| c.about().turns_phases && !c.is_noise() && c.parameters().len() <= MOST_GRID_PARAMETERS);
        let robust_before = self.robust(current);
        self.each(&all, |effect| self.finished(current, &self.looked_at(current, effect), robust_before))
    }

    /// A candidate that was looked at, fitted to the end.
    pub(crate) fn finished(&self, current: &Fitted, looked: &Candidate, robust_before: f64) -> Candidate {
        let fit = |from: &Fitted| from.model.fit(&from.theta, self.observations, self.selection, Effort::Compare);
        let mut fitted =
            best(std::iter::once(&looked.fitted).chain(&looked.runner_up).map(fit)).expect("it was looked at");
        if looked.effect.about().follows_gas {
            // The estimate that it was made with is that of a model without it.
            fitted = fitted.in_own_gas(self.observations, fit);
        }
        let effect = fitted.model.effects[current.model.effects.len()].clone();
        let robust = robust_before - self.robust(&fitted);
        let [white_gain, robust_gain] = self.gains(current, &fitted, &effect, robust);
        Candidate { effect, fitted, runner_up: None, white_gain, robust_gain, ..looked.clone() }
    }

    /// The forms of a candidate that have fewer parameters, and its exact twins, fitted from where it has ended.
    ///
    /// A first look is too short for some of them: a gain alone moves both time constants on the way, where an offset beside it takes
    /// what is left meanwhile. Failed: of a wrong gain in slow gas the gain alone was behind crosstalk after a first look, and crosstalk was
    /// named, which has one parameter as well.
    fn beside_best(&self, current: &Fitted, best: &Candidate, robust_before: f64) -> Vec<Candidate> {
        let (model, place) = (&best.fitted.model, current.model.effects.len());
        let (before, values) = best.fitted.theta.split_at(model.range(place).start);
        let parts = shorter_forms(&best.effect, values).into_iter();
        let parts = parts.map(|(effect, values)| (effect, [before, &values].concat()));
        let possible = self.candidates(&current.model);
        let twins = model.twins(place, &best.fitted.theta).into_iter().filter_map(|twin| {
            let is_it = |effect: &&Shared| {
                let [parameter] = effect.parameters() else { return false };
                (effect.identifier(), effect.channel(), parameter.name)
                    == (twin.effect, Some(twin.channel), twin.parameter)
            };
            let effect = possible.iter().find(is_it)?.clone();
            Some((effect, [&twin.time_constants_s[..], &before[2..], &[twin.value]].concat()))
        });
        let fitted = |(effect, theta): (Shared, Vec<f64>)| {
            let start = Fitted { model: current.model.with(effect.clone()), theta, ..best.fitted.clone() };
            self.finished(current, &self.candidate(&effect, start, 0.0, 0.0), robust_before)
        };
        parts.chain(twins).map(fitted).collect()
    }

    fn is_far_off(&self, current: &Fitted) -> bool {
        current.mean_energy() > self.policy.far_off_energy
    }

    /// The candidates that are worth a fit, the most promising first: all of them where the model
    /// is far off, and its score there says little; else noise, lines, and those that would gain
    /// more than chance if the residual were linear.
    fn screened(&self, current: &Fitted) -> Result<Vec<Promising>, ModelError> {
        let all = self.candidates(&current.model);
        let is_far_off = self.is_far_off(current);
        let now = (!is_far_off).then(|| current.model.linearised(&current.theta, self.observations, self.selection));
        let scored = self.each(&all, |effect| {
            if effect.is_noise() || effect.about().is_narrow || is_far_off {
                return Promising { effect: effect.clone(), starts: effect.starts(), gain: f64::INFINITY };
            }
            let scores = effect.starts().into_iter().map(|s| (self.score_gain(current, effect, &s, now.as_ref()), s));
            let scores: Vec<(f64, Vec<f64>)> = scores.collect();
            let gain = scores.iter().map(|(gain, _)| *gain).fold(f64::NEG_INFINITY, f64::max);
            let is_near = |(of_start, _): &(f64, Vec<f64>)| *of_start >= gain - (1.0 - START_GAIN_SHARE) * gain.abs();
            Promising {
                effect: effect.clone(),
                starts: scores.into_iter().filter(is_near).map(|(_, s)| s).collect(),
                gain,
            }
        })?;
        let least = |effect: &Shared| {
            threshold(effect.parameters().len(), self.policy.screening_probability) * current.mean_energy().max(1.0)
        };
        let mut promising: Vec<Promising> = scored.into_iter().filter(|p| p.gain > least(&p.effect)).collect();
        promising.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let certain = promising.iter().take_while(|p| p.gain.is_infinite()).count();
        promising.truncate(certain + self.policy.most_fitted_candidates);
        Ok(promising)
    }

    /// Energy that a candidate would take off from `start` if the residual were linear in
    /// everything.
    ///
    /// The residual is that of the candidate's own model: another number of factors is another
    /// whitening of the same disagreement.
    ///
    /// - `now`: the current model, linearised
    fn score_gain(&self, current: &Fitted, effect: &Shared, start: &[f64], now: Option<&Linearised>) -> f64 {
        let model = current.model.with(effect.clone());
        let theta = [&current.theta[..], start].concat();
        let beside = now.map(|without| Beside { without, max_difference: f64::INFINITY });
        let normal = model.normal_equations(&theta, self.observations, self.selection, beside);
        let slope = &normal.slope;
        // Where it is singular, along the diagonal: less than it could take off, but no more
        // than it can.
        let taken =
            dense::inverse(&normal.products).map_or(0.0, |inverse| dense::dot(slope, &dense::times(&inverse, slope)));
        current.chi2 - (normal.energy - taken)
    }

    /// Where an effect is looked at first: in an excerpt of the record; in all of it where its parameter is a frequency, and of a
    /// long record, in which pieces have shown what so few samples can.
    pub(crate) fn looked_in(&self, effect: &Shared) -> (&Observations, &Selection) {
        if effect.about().is_narrow || is_long(self.observations) {
            (self.observations, self.selection)
        } else {
            let (observations, selection) = self.excerpt();
            (observations, selection)
        }
    }

    /// The candidate with the best fit of all from `starts`, as a first look has it. Its gains say how it compares with the others;
    /// what it is worth is found when it is fitted to the end.
    pub(crate) fn with(&self, current: &Fitted, effect: &Shared, starts: &[Vec<f64>]) -> Candidate {
        let part = self.looked_in(effect);
        self.fitted_to(
            part,
            current,
            effect,
            |model, theta| vec![model.fit(theta, part.0, part.1, Effort::Look)],
            starts,
        )
    }

    /// As [`Search::with`], from all starts and from a grid of time constants.
    fn looked_at(&self, current: &Fitted, effect: &Shared) -> Candidate {
        let (observations, selection) = self.excerpt();
        let fits = |model: &Model, theta: &[f64]| {
            let mut fits = vec![model.fit(theta, observations, selection, Effort::Look)];
            if effect.parameters().len() <= MOST_GRID_PARAMETERS {
                fits.push(self.over_grid(model, theta));
            }
            fits
        };
        self.fitted_to((observations, selection), current, effect, fits, &effect.starts())
    }

    fn fitted_to(
        &self,
        (observations, selection): (&Observations, &Selection),
        current: &Fitted,
        effect: &Shared,
        fits: impl Fn(&Model, &[f64]) -> Vec<Fitted>,
        starts: &[Vec<f64>],
    ) -> Candidate {
        let model = current.model.with(effect.clone());
        let plain = best(starts.iter().flat_map(|start| fits(&model, &[&current.theta[..], start].concat())));
        let plain = plain.expect("every effect has a start");
        let balanced = starts.iter().filter_map(|start| balanced_start(&model, current, start));
        let balanced = best(balanced.map(|theta| model.fit(&theta, observations, selection, Effort::Look)));
        let (fitted, runner_up) = match balanced {
            Some(balanced) if balanced.chi2.total_cmp(&plain.chi2).is_lt() => (balanced, Some(plain)),
            balanced => (plain, balanced),
        };
        let before = current.model.energy(&current.theta, observations, selection);
        let gain = current.count * (before / fitted.chi2.max(1e-300)).ln();
        Candidate { runner_up, ..self.candidate(effect, fitted, gain, gain) }
    }

    pub(crate) fn candidate(&self, effect: &Shared, fitted: Fitted, white_gain: f64, robust_gain: f64) -> Candidate {
        let added = effect.parameters().len();
        Candidate {
            effect: effect.clone(),
            fitted,
            runner_up: None,
            added,
            white_gain,
            robust_gain,
            free_level_gain: None,
            held_out_nats: 0.0,
            share: self.share(effect),
            shortened: None,
        }
    }

    /// The best fit to an excerpt from a grid of time constants, from the lowest point of either order. A second lag that was added last keeps
    /// its share of the first.
    ///
    /// - `theta`: parameters of which the time constants do not count
    fn over_grid(&self, model: &Model, theta: &[f64]) -> Fitted {
        let (observations, selection) = self.excerpt();
        let (low, high) = (GRID_FROM_PERIODS * self.context.step_s, GRID_TO_SHARE * self.context.span_s());
        let at = |i: usize| low * (high / low).powf(i as f64 / (GRID_POINTS - 1) as f64);
        let second_lag = model.effects.last().and_then(|effect| {
            let place = model.range(model.effects.len() - 1).start + effect.series_lag()?;
            Some((effect.channel()?, place))
        });
        let pairs = (0..GRID_POINTS).flat_map(|i| (0..GRID_POINTS).map(move |j| [i, j]));
        let points = pairs.map(|pair| {
            let mut at_point = theta.to_vec();
            at_point[..2].copy_from_slice(&pair.map(at));
            if let Some((sensor, place)) = second_lag {
                at_point[place] *= at_point[sensor] / theta[sensor];
            }
            (model.energy(&at_point, observations, selection), at_point)
        });
        let (shorter, longer): (Vec<_>, Vec<_>) = points.partition(|(_, theta)| theta[0] < theta[1]);
        let lowest = |points: Vec<(f64, Vec<f64>)>| points.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let starts = [shorter, longer].into_iter().filter_map(lowest);
        best(starts.map(|(_, theta)| model.fit(&theta, observations, selection, Effort::Look)))
            .expect("a grid has points of either order")
    }
}

/// The fit that leaves the least.
fn best(fits: impl Iterator<Item = Fitted>) -> Option<Fitted> {
    fits.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// Start values of `model`, which is that of `current` with one effect more: that effect at `start`, and the shorter time constant changed by as much
/// as the effect delays slow changes, so that the difference of both channels stays. `None` if the effect delays nothing or is of both channels, and if
/// the shorter time constant is known or would not stay positive.
fn balanced_start(model: &Model, current: &Fitted, start: &[f64]) -> Option<Vec<f64>> {
    let effect = model.effects.last().expect("it has one more");
    let (channel, lag_s) = (effect.channel()?, effect.lag_s(start));
    let mut theta = [&current.theta[..], start].concat();
    let shorter = usize::from(theta[1] < theta[0]);
    theta[shorter] += if channel == shorter { -lag_s } else { lag_s };
    (lag_s != 0.0 && theta[shorter] > 0.0 && !model.knows(shorter)).then_some(theta)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use twinlag_model::{Prepared, Settings, Stretch, candidates};
    use twinlag_signal::undeclared::{GasKind, Kind, undeclared};
    use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};

    use super::*;
    use crate::diagnose::searched;
    use crate::grade::Grade;

    /// Readings of two sensors in turbulence, the second of which has a second lag.
    ///
    /// - `times_s`: both time constants, and the second lag
    fn with_second_lag(seed: u64, step_s: f64, times_s: [f64; 3], noise_k: f64, gas: Turbulence) -> Observations {
        let mut sensors = [times_s[0], times_s[1]].map(|tau_s| Sensor::new(format!("{tau_s}"), tau_s));
        sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(noise_k)));
        sensors[1].second_time_constant_s = Some(times_s[2]);
        let gas = Gas::new(300.0, Signal::Turbulence(gas));
        observed(&Rig::new(seed, Record::new(2000, step_s), gas, sensors).expect("a rig"))
    }

    fn observed(rig: &Rig) -> Observations {
        let record = rig.simulate().expect("a record");
        let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
        Observations::new(vec![stretch], Some(rig.record().sample_period_s)).expect("a record")
    }

    /// A second lag nearly as long as the faster time constant. Two records of a user with such a lag were diagnosed wrongly.
    fn with_long_second_lag() -> Observations {
        let gas = Turbulence { std_k: 15.0, corner_hz: 0.2, cutoff_hz: 5.0 };
        with_second_lag(1, 0.01, [0.12, 0.7, 0.08], 0.2, gas)
    }

    /// The model of two lags, and candidates made for it.
    fn two_lags(observations: &Observations, settings: &Settings) -> (Prepared, Fitted, Vec<Shared>) {
        let mut prepared = Prepared::new(observations, settings).expect("it changes");
        let base = prepared.base(settings);
        let mut context = prepared.context.clone();
        context.tau_s = [base.theta[0], base.theta[1]];
        let all = candidates(&settings.effects, &context);
        (prepared, base, all)
    }

    /// What a search finds first, with all effects to choose from.
    fn found_first(observations: &Observations) -> (Identifier, Option<usize>) {
        let settings = Settings::default();
        let (state, _) = searched(observations, &settings, &|_, _, _| ControlFlow::Continue(())).expect("a search");
        let first = state.current.model.effects.first().expect("something is found");
        (first.identifier(), first.channel())
    }

    /// What it keeps is `τ2 + lag2 − τ1 − lag1`, by which the channels are apart in slow changes: exact but for the rounding of three sums.
    #[test]
    fn a_balanced_start_keeps_how_far_slow_changes_are_apart() {
        let settings = Settings { effects: vec![Identifier::SECOND_ORDER, Identifier::DELAY], ..Settings::default() };
        let observations = with_long_second_lag();
        let (_, mut base, all) = two_lags(&observations, &settings);
        assert_eq!(all.len(), 3, "a second lag in each sensor, and a delay of the second");
        let mut kept = 0;
        for _ in 0..2 {
            base.theta.swap(0, 1);
            let [one_s, two_s] = [base.theta[0], base.theta[1]];
            for effect in &all {
                let model = base.model.with(effect.clone());
                for start in effect.starts() {
                    let lag_s = effect.lag_s(&start);
                    let Some(theta) = balanced_start(&model, &base, &start) else {
                        assert!(lag_s.abs() >= one_s.min(two_s), "{lag_s} of {one_s} and {two_s}");
                        continue;
                    };
                    let delay_s = |i: usize| theta[i] + if effect.channel() == Some(i) { lag_s } else { 0.0 };
                    let apart_s = [delay_s(1) - delay_s(0), two_s - one_s];
                    assert!((apart_s[0] - apart_s[1]).abs() < 4.0 * f64::EPSILON, "{apart_s:?}");
                    assert_eq!(theta[usize::from(one_s < two_s)], one_s.max(two_s), "the longer one stays");
                    kept += 1;
                }
            }
        }
        assert!(kept >= 6, "{kept} starts");
    }

    /// Two lags take most of this second lag for a part of the faster time constant: first looks from there found less of it than of a delay.
    #[test]
    fn a_fit_starts_where_the_faster_time_constant_makes_up_for_the_effect() {
        let observations = with_long_second_lag();
        let settings = Settings { effects: vec![Identifier::SECOND_ORDER], ..Settings::default() };
        let (prepared, base, all) = two_lags(&observations, &settings);
        let effect = all.into_iter().find(|e| e.channel() == Some(1)).expect("one");
        let model = base.model.with(effect.clone());
        let gain = |from: &[f64], effort| {
            (base.chi2 / model.fit(from, &prepared.observations, &prepared.everything, effort).chi2).ln()
        };
        let most = |gains: &mut dyn Iterator<Item = f64>| gains.fold(0.0, f64::max);
        let balanced: Vec<_> = effect.starts().iter().filter_map(|s| balanced_start(&model, &base, s)).collect();
        let at_end = most(&mut balanced.iter().map(|from| gain(from, Effort::Finish)));
        let look = most(&mut balanced.iter().map(|from| gain(from, Effort::Look)));
        let plain =
            most(&mut effect.starts().iter().map(|start| gain(&[&base.theta[..], start].concat(), Effort::Look)));
        // Candidates with a smaller share of the gain of another are not fitted to the end.
        let least = settings.policy.rival_share * at_end;
        assert!(look > least && plain < least, "{look} and {plain} of {at_end}");
        let search = Search::of(&prepared, &settings, &|_, _, _| ControlFlow::Continue(()));
        let looked = search.with(&base, &effect, &effect.starts());
        assert!(looked.white_gain > least * base.count && looked.runner_up.is_some(), "{}", looked.white_gain);
    }

    /// One kind of start has the better first look here, and the other the better fit: with the better look alone fitted to the end, noise was found.
    #[test]
    fn fits_from_both_kinds_of_starts_go_to_their_ends() {
        let rig = undeclared(&[Kind::SecondOrder], 1.0, Some(GasKind::Plunge), 307_013).expect("a rig");
        assert_eq!(found_first(&observed(&rig.rig)), (Identifier::SECOND_ORDER, rig.channel));
    }

    /// A gain and an offset of all records leave the drift of each, which looks like part of a period of a line.
    #[test]
    fn what_differs_from_record_to_record_is_no_line() {
        let of = |(seed, mean_c, drift_k_per_s): (u64, f64, f64)| {
            let gas = Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 0.4, cutoff_hz: 6.0 });
            let mut sensors = [0.1, 0.45].map(|tau_s| Sensor::new(format!("{tau_s}"), tau_s));
            sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.1)));
            (sensors[1].gain, sensors[1].drift_k_per_s) = (1.01, drift_k_per_s);
            sensors[1].offset_k = 20.0 * drift_k_per_s;
            observed(&Rig::new(seed, Record::new(2000, 0.02), Gas::new(mean_c, gas), sensors).expect("a rig"))
        };
        let records = [(10, 120.0, 0.02), (11, 180.0, -0.015), (12, 240.0, 0.04)].map(of);
        let settings = Settings::default();
        let (prepared, base, all) = two_lags(&Observations::joined(&records).expect("of one period"), &settings);
        let is_it = |e: &&Shared| e.identifier() == Identifier::CALIBRATION && e.parameters().len() == 2;
        let calibration = all.iter().find(is_it).expect("a gain and an offset").clone();
        let from = [&base.theta[..], &calibration.starts()[0]].concat();
        let (observations, selection) = (&prepared.observations, &prepared.searched);
        let fitted = base.model.with(calibration).fit(&from, observations, selection, Effort::Compare);
        let found = lines(&fitted, observations, |s| selection.holds(s), &settings.policy);
        let search = Search::of(&prepared, &settings, &|_, _, _| ControlFlow::Continue(())).beside(&fitted);
        let kept = search.context.lines.iter().map(|(hz, _)| *hz).collect();
        let slowest_periods = |lines: Vec<f64>| lines.into_iter().fold(f64::INFINITY, f64::min) * records[0].span_s();
        let [found, kept] = [found, kept].map(slowest_periods);
        assert!(found < MIN_LINE_PERIODS && kept >= MIN_LINE_PERIODS, "{found} and {kept} periods");
    }

    /// A second lag that is found, and the same fit with it on its upper bound: nothing of that is an estimate.
    #[test]
    fn an_effect_on_its_bound_leaves_no_estimate() {
        let gas = Turbulence { std_k: 20.0, corner_hz: 2.4, cutoff_hz: 200.0 };
        let observations = with_second_lag(20, 0.001, [0.012, 0.060, 0.018], 0.1, gas);
        let settings = Settings::default();
        let (state, _) = searched(&observations, &settings, &|_, _, _| ControlFlow::Continue(())).expect("a search");
        let mut fitted = state.current;
        assert_eq!(fitted.model.effects[0].identifier(), Identifier::SECOND_ORDER);
        assert_eq!(effects_on_bounds(&fitted).count(), 0);
        let at = fitted.model.range(0).start;
        fitted.theta[at] = fitted.model.effects[0].parameters()[0].variable.upper;
        let reasons: Vec<Reason> = effects_on_bounds(&fitted).collect();
        assert_eq!(reasons, [Reason::EffectOnBound { effect: Identifier::SECOND_ORDER, channel: Some(1) }]);
        assert_eq!(reasons[0].grade(), Grade::NoGo);
    }
}
