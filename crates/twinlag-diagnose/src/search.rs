//! The search: fit, examine the residual, add the effect that explains it best, and repeat.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use twinlag_model::{
    Bands, Context, Effort, Fitted, Identifier, Linearised, Model, Observations, Parameter, Place, Prepared, Selection,
    Settings, Shared, Stretch, Watch, candidates, dense, fit_noise, held_out_gain, line_channel, lines, runs,
};
use twinlag_optimise::{End, Scale, Variable};

use crate::confirm::is_confirmed;
use crate::diagnosis::Limit;

/// Probability, over all candidates of a round, of taking one that is not there.
pub(crate) const FALSE_ALARM: f64 = 1e-3;
/// Difference of `−2 ln L` (penalties included) up to which two effects explain a record equally well.
pub(crate) const TIE: f64 = 10.0;

/// An effect comes before noise of another colour only if it explains at least this share of what
/// that noise explains, whatever the noise, or removes half as much energy.
const BESIDE_NOISE: f64 = 0.03;
/// Energy of the residual per degree of freedom beyond which a model is far off.
pub(crate) const FAR_OFF: f64 = 3.0;
/// Share of the best candidate's score that a static disagreement must have to come first where none explains the record.
const STATIC: f64 = 0.25;
/// Energy per degree of freedom that the best of the candidates leaves, beyond which no single effect explains the record.
const INCOMPLETE: f64 = 1.5;
/// Candidates that are fitted to the end.
const MOST_FITTED: usize = 10;
/// Share of the residuals that must be left with an effect in the model.
const KEPT: f64 = 0.8;
/// Difference of gains up to which two effects are one model in two guises.
const EQUAL: f64 = 2.0;

/// A candidate with its fit.
#[derive(Clone)]
pub(crate) struct Tried {
    pub(crate) effect: Shared,
    pub(crate) fitted: Fitted,
    /// Parameters it added.
    pub(crate) added: usize,
    /// `−2 ln L` saved, noise white with the levels that there are.
    pub(crate) gain: f64,
    /// `−2 ln L` saved with a free noise level in every band, which noise of any colour does not
    /// explain.
    pub(crate) robust_gain: f64,
    /// Nats that it saves on blocks that were left out.
    pub(crate) held_out_nats: f64,
    /// Of a look-alike: how much better its score is than that of what it would replace.
    pub(crate) advantage: f64,
    /// What the gains count beside those of the others: those of a line are of all frequencies, whatever weight these have.
    share: f64,
}

impl Tried {
    fn penalty(&self) -> f64 {
        self.added as f64 * self.fitted.count.max(2.0).ln()
    }

    fn score(&self) -> f64 {
        self.share * self.gain - self.penalty()
    }

    fn robust_score(&self) -> f64 {
        self.share * self.robust_gain - self.penalty()
    }
}

/// What a search works on.
pub(crate) struct Search<'a> {
    pub(crate) observations: &'a Observations,
    pub(crate) selection: &'a Selection,
    pub(crate) context: Context,
    /// Effects that may be named.
    pub(crate) allowed: &'a [Identifier],
    pub(crate) watch: &'a (dyn Fn(&str, usize, usize) + Sync),
    /// Pieces of the record, for a quick look, and what counts of them.
    pub(crate) excerpt: (Observations, Selection),
}

impl<'a> Search<'a> {
    /// A search of `prepared`.
    pub(crate) fn of(prepared: &'a Prepared, settings: &'a Settings, watch: Watch<'a>) -> Self {
        Self {
            observations: &prepared.observations,
            selection: &prepared.searched,
            context: prepared.context.clone(),
            allowed: &settings.effects,
            watch,
            excerpt: prepared.excerpt(),
        }
    }

    pub(crate) fn bands(&self, fitted: &Fitted) -> Bands {
        let evaluation = fitted.model.evaluate(&fitted.theta, self.observations);
        Bands::of(&runs(&evaluation, |s| self.selection.holds(s)))
    }

    /// What candidates are made from, as `current` shows it.
    pub(crate) fn look(&mut self, current: &Fitted) {
        self.context.tau_s = [current.theta[0], current.theta[1]];
        let evaluation = current.model.evaluate(&current.theta, self.observations);
        let found = lines(self.observations, &evaluation, |s| self.selection.holds(s));
        self.context.lines = found.into_iter().map(|hz| (hz, line_channel(self.observations, hz))).collect();
    }

    fn robust(&self, fitted: &Fitted) -> f64 {
        self.bands(fitted).robust(|omega| self.selection.weighting.at(omega))
    }

    /// `−2 ln L` saved by going from `before` to `after`, the level of the noise free.
    fn gain(before: &Fitted, after: &Fitted) -> f64 {
        let n = after.count;
        n * (before.mean_energy() / after.mean_energy().max(1e-300)).ln()
    }

    /// Both gains of a candidate. A line has its own frequency, and is judged there: with no weight over frequency, and no free
    /// level in a band that is wider than it.
    fn gains(&self, before: &Fitted, after: &Fitted, effect: &Shared, robust: f64) -> (f64, f64) {
        if !effect.about().is_narrow {
            return (Self::gain(before, after), robust);
        }
        let energy = |fitted: &Fitted| {
            let evaluation = fitted.model.evaluate(&fitted.theta, self.observations);
            let pairs = evaluation.residual.iter().zip(&evaluation.sample);
            pairs.filter(|(_, s)| self.selection.holds(**s)).fold((0.0, 0.0), |(sum, n), (r, _)| (sum + r * r, n + 1.0))
        };
        let ((b, n), (a, _)) = (energy(before), energy(after));
        let gain = n * (b / a.max(1e-300)).ln();
        (gain, gain)
    }

    /// Every candidate that may be added to `current`: those that may explain something are fitted.
    ///
    /// - `thorough`: where the model is far off, the score at it says little, and every candidate is fitted, from a grid of time
    ///   constants as well
    pub(crate) fn try_all(&self, current: &Fitted, thorough: bool) -> Vec<Tried> {
        let all: Vec<Shared> =
            candidates(self.allowed, &self.context).into_iter().filter(|c| Self::is_new(current, c)).collect();
        let robust_before = self.robust(current);
        let now = (!thorough).then(|| current.model.linearised(&current.theta, self.observations, self.selection));
        let promises = self.in_parallel(&all, |effect| {
            let is_line = effect.about().is_narrow;
            let promise = if effect.is_noise() || is_line || thorough {
                f64::INFINITY
            } else {
                self.promise(current, effect, now.as_ref())
            };
            let least = threshold(effect.parameters().len(), 0.01) * current.mean_energy().max(1.0);
            Some((promise > least).then_some(promise))
        });
        let mut promising: Vec<(f64, Shared)> =
            all.iter().zip(promises).filter_map(|(effect, p)| Some((p??, effect.clone()))).collect();
        promising.sort_by(|a, b| b.0.total_cmp(&a.0));
        let certain = promising.iter().take_while(|p| p.0.is_infinite()).count();
        promising.truncate(certain + MOST_FITTED);
        let looked = self.in_parallel(&promising, |(_, effect)| {
            if effect.is_noise() {
                return self.try_noise(current, effect);
            }
            Some(self.try_one(current, effect, robust_before, thorough))
        });
        // The best few are fitted to the end.
        let mut looked: Vec<Tried> = looked.into_iter().flatten().collect();
        let (noise, mut mean): (Vec<Tried>, Vec<Tried>) = looked.drain(..).partition(|t| t.effect.is_noise());
        mean.sort_by(|a, b| (b.gain - b.penalty()).total_cmp(&(a.gain - a.penalty())));
        mean.truncate(MOST_FITTED);
        let finished = self.in_parallel(&mean, |tried| {
            let model = &tried.fitted.model;
            let fitted = model.fit(&tried.fitted.theta, self.observations, self.selection, Effort::Finish);
            let robust = self.robust(&fitted);
            let (gain, robust_gain) = self.gains(current, &fitted, &tried.effect, robust_before - robust);
            Some(Tried { fitted, gain, robust_gain, ..tried.clone() })
        });
        finished.into_iter().flatten().chain(noise).collect()
    }

    fn in_parallel<T: Sync, R: Send + Clone>(
        &self,
        items: &[T],
        work: impl Fn(&T) -> Option<R> + Sync,
    ) -> Vec<Option<R>> {
        let next = AtomicUsize::new(0);
        let done = AtomicUsize::new(0);
        let results: Mutex<Vec<Option<R>>> = Mutex::new(vec![None; items.len()]);
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(8);
        std::thread::scope(|scope| {
            for _ in 0..threads.min(items.len()) {
                scope.spawn(|| {
                    loop {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        let Some(item) = items.get(index) else { break };
                        let result = work(item);
                        results.lock().expect("no thread panics")[index] = result;
                        (self.watch)("candidates", done.fetch_add(1, Ordering::Relaxed) + 1, items.len());
                    }
                });
            }
        });
        results.into_inner().expect("no thread panics")
    }

    /// Whether the model lacks the candidate, and can take it.
    fn is_new(current: &Fitted, candidate: &Shared) -> bool {
        Self::fits(&current.model, candidate)
    }

    fn fits(model: &Model, candidate: &Shared) -> bool {
        let id = candidate.identifier();
        let repeats = model
            .effects
            .iter()
            .any(|e| e.identifier() == id && (e.channel() == candidate.channel() || !candidate.about().is_narrow));
        let excluded = model.effects.iter().any(|e| e.identifier().excludes(id));
        let determined: Vec<_> = model.parameters().filter_map(|p| p.determines).collect();
        let twice = candidate.parameters().iter().filter_map(|p| p.determines).any(|f| determined.contains(&f));
        !repeats && !excluded && !twice
    }

    /// What a candidate would take off the energy if the residual were linear in everything, from the best of its starts.
    ///
    /// The residual is that of the candidate's own model: another number of factors is another whitening of the same disagreement.
    ///
    /// - `now`: the current model, linearised
    fn promise(&self, current: &Fitted, effect: &Shared, now: Option<&Linearised>) -> f64 {
        let model = current.model.with(effect.clone());
        let of = |start: &Vec<f64>| -> f64 {
            let mut theta = current.theta.clone();
            theta.extend_from_slice(start);
            let lin = model.linearised_beside(&theta, self.observations, self.selection, now);
            let matrix: Vec<Vec<f64>> =
                lin.columns.iter().map(|a| lin.columns.iter().map(|b| dense::dot(a, b)).collect()).collect();
            let slope: Vec<f64> = lin.columns.iter().map(|c| dense::dot(c, &lin.residual)).collect();
            // Where it is singular, along the diagonal: less than it could take off, but no more than it can.
            let taken =
                dense::inverse(&matrix).map_or(0.0, |inverse| dense::dot(&slope, &dense::times(&inverse, &slope)));
            current.chi2 - (dense::dot(&lin.residual, &lin.residual) - taken)
        };
        effect.starts().iter().map(of).fold(0.0, f64::max)
    }

    /// For each candidate that the model lacks, the smallest size that the search would have seen: the square root of the threshold
    /// times the standard error that its main parameter would have.
    pub(crate) fn limits(&self, current: &Fitted) -> Vec<Limit> {
        let all: Vec<Shared> = candidates(self.allowed, &self.context)
            .into_iter()
            .filter(|c| Self::is_new(current, c) && !c.is_noise())
            .filter(|c| c.main().is_some())
            .collect();
        let count = all.len().max(1) as f64;
        let now = current.model.linearised(&current.theta, self.observations, self.selection);
        let found = self.in_parallel(&all, |effect| {
            let main = effect.main()?;
            let model = current.model.with(effect.clone());
            let mut theta = current.theta.clone();
            theta.extend_from_slice(effect.starts().first()?);
            let lin = model.linearised_beside(&theta, self.observations, self.selection, Some(&now));
            let matrix: Vec<Vec<f64>> =
                lin.columns.iter().map(|a| lin.columns.iter().map(|b| dense::dot(a, b)).collect()).collect();
            let inverse = dense::inverse(&matrix)?;
            let index = current.theta.len() + main;
            let size = (inverse[index][index] * current.mean_energy().max(1.0)).sqrt()
                * threshold(effect.parameters().len(), FALSE_ALARM / count).sqrt();
            let parameter = &effect.parameters()[main];
            (size > 0.0 && size.is_finite()).then(|| Limit {
                effect: effect.identifier(),
                channel: effect.channel(),
                parameter: parameter.name.into(),
                size,
                unit: parameter.unit.into(),
            })
        });
        let mut out: Vec<Limit> = Vec::new();
        for limit in found.into_iter().flatten() {
            let is_same = |o: &Limit| o.effect == limit.effect && o.channel == limit.channel;
            if !out.iter().any(is_same) {
                out.push(limit);
            }
        }
        out
    }

    /// The chosen candidate in the size that the data support.
    fn sized(&self, current: &Fitted, mut chosen: Tried, robust_before: f64) -> Tried {
        for effect in chosen.effect.sizes() {
            // More of it where something is left, three standard errors of the energy.
            let left = 1.0 + 3.0 * (2.0 / chosen.fitted.count).sqrt();
            if effect.parameters().len() > chosen.added && chosen.fitted.mean_energy() < left {
                continue;
            }
            let other = self.try_one(current, &effect, robust_before, false);
            if other.score() > chosen.score() {
                chosen = other;
            }
        }
        chosen
    }

    /// Effect `index` of `current` with one parameter more, where the data support that.
    pub(crate) fn grown(&self, current: &Fitted, index: usize, tried: &Tried) -> Option<Tried> {
        let range = current.model.range(index);
        let (effect, start) = tried.effect.extended(&current.theta[range.clone()])?;
        if !Self::fits(&current.model.without(index), &effect) {
            return None;
        }
        let added = start.len() - range.len();
        let mut theta = current.theta.clone();
        theta.splice(range, start);
        let model = current.model.replaced(index, effect.clone());
        let fitted = model.fit(&theta, self.observations, self.selection, Effort::Finish);
        let gain = Self::gain(current, &fitted);
        let robust_gain = self.robust(current) - self.robust(&fitted);
        let is_supported = gain.min(robust_gain) > threshold(added, FALSE_ALARM).max(added as f64 * fitted.count.ln());
        let held_out_nats = held_out_gain(self.observations, self.selection, current, &fitted);
        (is_supported && held_out_nats > 0.0 && fitted.end.is_usable()).then(|| Tried {
            gain: tried.gain + gain,
            robust_gain: tried.robust_gain + robust_gain,
            held_out_nats: tried.held_out_nats + held_out_nats,
            added: tried.added + added,
            effect,
            fitted,
            ..tried.clone()
        })
    }

    /// Effects that look like effect `index` of `current`, in its place, best first, with what they gain.
    pub(crate) fn look_alikes(&self, current: &Fitted, index: usize, tried: &Tried) -> Vec<Tried> {
        let effect = &tried.effect;
        let (id, rest) = (effect.identifier(), current.model.without(index));
        if effect.is_noise() {
            return Vec::new();
        }
        let is_alike = |c: &Shared| {
            let other = c.identifier();
            id.resembles(other) || (other == id && c.channel() != effect.channel())
        };
        let all: Vec<Shared> = candidates(self.allowed, &self.context)
            .into_iter()
            .filter(|c| !c.is_noise() && is_alike(c) && Self::fits(&rest, c))
            .collect();
        let range = current.model.range(index);
        let replaced = self.in_parallel(&all, |other| {
            let model = current.model.replaced(index, other.clone());
            let look = |start: Vec<f64>| {
                let mut theta = current.theta.clone();
                theta.splice(range.clone(), start);
                model.fit(&theta, self.observations, self.selection, Effort::Look)
            };
            let best = other.starts().into_iter().map(look).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
            let fitted = model.fit(&best.theta, self.observations, self.selection, Effort::Finish);
            let more = other.parameters().len() as f64 - range.len() as f64;
            let gain = Self::gain(current, &fitted);
            let robust_gain = self.robust(current) - self.robust(&fitted);
            Some(Tried {
                effect: other.clone(),
                gain: tried.gain + gain,
                robust_gain: tried.robust_gain + robust_gain,
                added: other.parameters().len(),
                advantage: gain.min(robust_gain) - more * fitted.count.max(2.0).ln(),
                fitted,
                ..tried.clone()
            })
        });
        let mut alike: Vec<Tried> = replaced.into_iter().flatten().filter(Self::is_there).collect();
        alike.sort_by(|a, b| b.advantage.total_cmp(&a.advantage));
        alike
    }

    /// Whether the noise that is left over at `without` is of this colour.
    pub(crate) fn needs_noise(&self, without: &Fitted, effect: &Shared) -> bool {
        let tried = self.try_noise(without, effect);
        tried.is_some_and(|t| t.gain > threshold(t.added, FALSE_ALARM) && t.score() > 0.0 && t.held_out_nats > 0.0)
    }

    /// A candidate with its best fit; of a quick look where `thorough`, which tries more.
    fn try_one(&self, current: &Fitted, effect: &Shared, robust_before: f64, thorough: bool) -> Tried {
        let model = current.model.with(effect.clone());
        let (observations, selection) =
            if thorough { (&self.excerpt.0, &self.excerpt.1) } else { (self.observations, self.selection) };
        let mut best: Option<Fitted> = None;
        for start in effect.starts() {
            let mut theta = current.theta.clone();
            theta.extend_from_slice(&start);
            let mut fits = vec![model.fit(&theta, observations, selection, Effort::Look)];
            if thorough && effect.parameters().len() <= 3 {
                fits.push(self.over_grid_quickly(&model, &theta[2..]));
            }
            for fit in fits {
                if best.as_ref().is_none_or(|b| fit.chi2 < b.chi2) {
                    best = Some(fit);
                }
            }
        }
        let fitted = best.expect("every effect has a start");
        let (gain, robust_gain) = if thorough {
            // How it compares with the others; what it is worth is found when it is fitted to the end.
            let before = current.model.energy(&current.theta, observations, selection);
            let gain = current.count * (before / fitted.chi2.max(1e-300)).ln();
            (gain, gain)
        } else {
            self.gains(current, &fitted, effect, robust_before - self.robust(&fitted))
        };
        Tried {
            gain,
            robust_gain,
            added: effect.parameters().len(),
            effect: effect.clone(),
            fitted,
            held_out_nats: 0.0,
            advantage: 0.0,
            share: if effect.about().is_narrow { self.selection.weighting.mean() } else { 1.0 },
        }
    }

    fn over_grid_quickly(&self, model: &Model, rest: &[f64]) -> Fitted {
        let (excerpt, selection) = &self.excerpt;
        let (low, high) = (2.0 * self.context.step_s, 0.03 * self.context.span_s());
        let points = 5;
        let at = |i: usize| low * (high / low).powf(i as f64 / (points - 1) as f64);
        let mut best = (f64::INFINITY, Vec::new());
        for i in 0..points {
            for j in 0..points {
                let mut theta = vec![at(i), at(j)];
                theta.extend_from_slice(rest);
                let energy = model.energy(&theta, excerpt, selection);
                if energy < best.0 || best.1.is_empty() {
                    best = (energy, theta);
                }
            }
        }
        model.fit(&best.1, excerpt, selection, Effort::Look)
    }

    fn try_noise(&self, current: &Fitted, effect: &Shared) -> Option<Tried> {
        let plant = current.model.plant(&current.theta, self.observations);
        let longest = self.observations.stretches.iter().map(Stretch::len).max()?;
        if longest < plant.consumed(true) + 20 {
            return None;
        }
        let bands = self.bands(current);
        let place = match effect.channel() {
            Some(i) => Place::Reading(i),
            None => Place::Gas,
        };
        let starts: Vec<[f64; 2]> = effect.starts().iter().map(|s| [s[0], s[1]]).collect();
        let white = fit_noise(&plant, self.observations, &bands, None, &[], self.context.is_coarse);
        let with = fit_noise(&plant, self.observations, &bands, Some(place), &starts, self.context.is_coarse);
        let extra = with.extra?;
        let model = current.model.with(effect.clone()).with_noise(with.noise_std_k);
        let mut theta = current.theta.clone();
        theta.extend([extra.std_k, extra.correlation_s]);
        // The weights move the time constants, and these the noise: once more is enough.
        let fitted = model.fit(&theta, self.observations, self.selection, Effort::Finish);
        Some(Tried {
            gain: white.likelihood - with.likelihood,
            robust_gain: 0.0,
            added: 2,
            effect: effect.clone(),
            fitted,
            held_out_nats: 0.5 * (white.held_out - with.held_out),
            advantage: 0.0,
            share: 1.0,
        })
    }

    /// The candidate that explains the residual best, with those that do it as well; `None` where none is significant.
    pub(crate) fn choose(&self, current: &Fitted, tried: &[Tried]) -> Option<(Tried, Vec<Tried>)> {
        let count = tried.len().max(1) as f64;
        // A time constant that is too short to be seen may lie on its bound: the effect is none the worse for it. One that takes
        // most of the stretches away explains nothing.
        let is_sound = |t: &Tried| {
            let has_ended = match &t.fitted.end {
                End::OnBound(which) => which.iter().all(|i| *i < 2),
                end => end.is_usable() || *end == End::LimitReached,
            };
            has_ended && t.fitted.count > KEPT * current.count
        };
        let mut mean: Vec<Tried> = tried
            .iter()
            .filter(|t| !t.effect.is_noise() && is_sound(t) && Self::is_there(t))
            .filter(|t| t.robust_gain > threshold(t.added, FALSE_ALARM / count))
            .filter(|t| t.score() > 0.0)
            .cloned()
            .collect();
        mean.sort_by(|a, b| b.robust_score().total_cmp(&a.robust_score()));
        let mut noise: Vec<Tried> = tried
            .iter()
            .filter(|t| t.effect.is_noise() && t.gain > threshold(t.added, FALSE_ALARM / count) && t.score() > 0.0)
            .cloned()
            .collect();
        noise.sort_by(|a, b| b.score().total_cmp(&a.score()));
        // Noise that explains incomparably more comes first: fitted with wrong weights, an effect absorbs a little of it.
        let loudest = noise.first().map_or(0.0, |n| n.gain);
        mean.retain(|t| t.robust_gain > BESIDE_NOISE * loudest || current.chi2 - t.fitted.chi2 > 0.5 * loudest);
        let mut pool = if mean.is_empty() {
            noise
        } else {
            // Those that are as good whatever the noise, the best of them with white noise first.
            let all_mean = mean.clone();
            let best = mean[0].robust_score();
            let mut near: Vec<Tried> = mean.into_iter().filter(|t| t.robust_score() > best - 2.0 * TIE).collect();
            near.sort_by(|a, b| b.score().total_cmp(&a.score()));
            // Of those that are the same to rounding the one that is more often the case.
            let best = near[0].score();
            if let Some(index) = (0..near.len())
                .filter(|&i| best - near[i].score() < EQUAL)
                .min_by_key(|&i| (near[i].effect.identifier(), i))
            {
                near.swap(0, index);
            }
            // A static disagreement comes before its subtler imitators, and where no single effect explains the record, since that
            // is the part of it that depends least on the rest.
            let is_far_off = near[0].fitted.mean_energy() > INCOMPLETE;
            let imitates = near[0].effect.about().imitates_static;
            if imitates || is_far_off {
                let calibration = near
                    .iter()
                    .chain(&all_mean)
                    .filter(|t| t.effect.about().is_static)
                    .max_by(|a, b| a.score().total_cmp(&b.score()))
                    .filter(|t| {
                        best - t.score() < TIE || (is_far_off && t.score() > STATIC * best && t.robust_gain > 0.0)
                    })
                    .cloned();
                match (calibration, noise.first()) {
                    (Some(calibration), _) => near.insert(0, calibration),
                    // Model error dominates: what more can be told is told by weights that are those of the residual itself.
                    (None, Some(noise)) if is_far_off => near.insert(0, noise.clone()),
                    _ => {}
                }
            }
            near
        };
        while !pool.is_empty() {
            let mut first = self.sized(current, pool.remove(0), self.robust(current));
            if !first.effect.is_noise() {
                first.held_out_nats = held_out_gain(self.observations, self.selection, current, &first.fitted);
            }
            let is_there = first.held_out_nats > 0.0
                && is_confirmed(first.effect.identifier(), first.added, current, &first.fitted, self.observations);
            if is_there {
                let is_other = |t: &Tried| {
                    t.effect.identifier() != first.effect.identifier() || t.effect.channel() != first.effect.channel()
                };
                let ties = pool
                    .iter()
                    .filter(|t| is_other(t) && first.score() - t.score() < TIE)
                    .filter(|t| t.effect.is_noise() == first.effect.is_noise())
                    .cloned()
                    .collect();
                return Some((first, ties));
            }
        }
        None
    }

    /// Whether the effect's parameters are clear of nothing, or of a bound that means nothing, and leave those of the others there.
    fn is_there(t: &Tried) -> bool {
        let model = &t.fitted.model;
        let is_clear = |(p, x): (&Parameter, &f64)| {
            let Variable { lower, upper, scale, .. } = p.variable;
            let [margin, low, high] = match scale {
                Scale::Logarithmic => [1e-3, (x / lower).ln(), (upper / x).ln()],
                Scale::Linear { .. } => [1e-9 * (upper - lower), x - lower, upper - x],
            };
            x.is_finite() && low > margin && high > margin
        };
        let mean = model.effects.iter().enumerate().filter(|(_, e)| !e.is_noise());
        mean.flat_map(|(i, e)| e.parameters().iter().zip(&t.fitted.theta[model.range(i)])).all(is_clear)
    }
}

/// The gain that noise alone makes with probability `p` when `added` parameters are added.
pub(crate) fn threshold(added: usize, p: f64) -> f64 {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    let chi2 = ChiSquared::new(added.max(1) as f64).expect("a positive number");
    chi2.inverse_cdf(1.0 - p)
}
