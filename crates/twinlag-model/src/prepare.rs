//! Before the loop: noise levels, defects of the data, and which residuals fit, choose and judge.

use statrs::distribution::{ContinuousCDF, Normal};
use twinlag_cross_relation::{ResidualTest, total_energy_test};

use crate::blocks;
use crate::defects::{self, ChannelNoise};
use crate::effect::{self, Context, Identifier};
use crate::error::ModelError;
use crate::fit::{Effort, Fitted};
use crate::fitted::Defect;
use crate::member_noise;
use crate::model::Model;
use crate::observations::Observations;
use crate::policy::Policy;
use crate::range_end::{Judge, RangeEnd, range_ends};
use crate::records::Member;
use crate::selection::Selection;
use crate::settings::Settings;
use crate::spectrum::{Bands, levels_below};
use crate::weighting::Weighting;

/// Samples of a record that is looked at through excerpts first, and of each of these.
const MIN_EXCERPTED_SAMPLES: usize = 7000;
const EXCERPT_SAMPLES: usize = 500;
/// Starts of the two-lag fit that the best points of a grid of time constants give.
pub(crate) const GRID_STARTS: usize = 3;
/// Probability that any of several records with levels of its own is wrongly said to leave less than noise. Chosen: a false alarm costs
/// little, since levels of what is left over are as certain as those of third differences.
const LESS_THAN_NOISE_PROBABILITY: f64 = 0.01;
/// Times that spikes are looked for.
const SPIKE_ROUNDS: usize = 3;

/// A record with its defects masked, and the two-lag model of it.
#[derive(Debug)]
pub struct Prepared {
    /// The record, its defects masked.
    pub observations: Observations,
    /// Its noise.
    pub levels: ChannelNoise,
    /// The numbers that decide.
    pub policy: Policy,
    /// What candidates are made from.
    pub context: Context,
    /// Defects of the data.
    pub found: Vec<Defect>,
    /// Single wrong readings of each channel, counted through the stretches.
    spikes: [Vec<usize>; 2],
    /// The record as it came, and its noise.
    pub raw: (Observations, ChannelNoise),
    /// Residuals of the whole record.
    pub everything: Selection,
    /// The samples without the blocks that judge.
    pub searched: Selection,
}

/// Least change of a channel, K: squares of what is a millionth of it are numbers still.
const MIN_CHANGE_K: f64 = 1e-140;

impl Prepared {
    /// The record with saturation and coarse steps dealt with.
    ///
    /// # Errors
    /// [`ModelError`] for settings that mean nothing, an effect of another crate that breaks a promise of
    /// [`crate::Effect`], a channel that never changes, and a record too fragmented for
    /// noise levels.
    pub fn new(observations: &Observations, settings: &Settings) -> Result<Self, ModelError> {
        settings.check()?;
        let policy = settings.policy.clone();
        for i in 0..2 {
            let first = observations.channel(i).next().unwrap_or_default();
            if observations.channel(i).all(|y| (y - first).abs() < MIN_CHANGE_K) {
                return Err(ModelError::Constant { channel: i + 1 });
            }
        }
        let mut observations = observations.clone();
        let samples = observations.samples();
        let mut levels =
            defects::levels(&observations).ok_or(ModelError::InShreds { samples, needed: defects::MIN_LEVEL_ROWS })?;
        if let Some(std_k) = settings.noise_std_k {
            levels = ChannelNoise { std_k, log_error: [0.0; 2], is_given: true, ..levels };
        } else {
            // Those of an earlier preparation are over other levels: a record that is left of several has none.
            let is_joined = observations.is_joined();
            let factors = if is_joined { member_noise::factors(&observations, &levels, &policy) } else { Vec::new() };
            observations = observations.with_noise_factors(&factors);
        }
        let raw = (observations.clone(), levels);
        let found = data_defects(&mut observations, &levels, settings);
        let weighting = Weighting::of(&observations, levels.std_k);
        let context = context(&observations, &levels);
        effect::check_all(&settings.effects, &context)?;
        Ok(Self {
            everything: selection(&observations, None, &weighting),
            searched: selection(&observations, Some(&policy), &weighting),
            context,
            observations,
            levels,
            policy,
            found,
            spikes: [Vec::new(), Vec::new()],
            raw,
        })
    }

    /// Pieces of this record, as [`Observations::excerpt`] takes them: effects that add nothing on average do so over all of
    /// it.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_excerpt(&self, excerpt: &Observations, settings: &Settings) -> Result<Self, ModelError> {
        let mut out = Self::new(excerpt, settings)?;
        (out.context.mean_c, out.context.moments) = (self.context.mean_c, self.context.moments);
        if self.observations.is_joined() {
            out.context.members.clone_from(&self.context.members);
        }
        Ok(out)
    }

    /// The two-lag model, isolated wrong readings, which show once there is one, masked.
    pub fn base(&mut self, settings: &Settings) -> Fitted {
        self.base_by(settings, |model, observations, searched| {
            model.fit_over_grid(&[], GRID_STARTS, observations, searched)
        })
    }

    /// As [`Self::base`], from time constants that are about right.
    pub fn base_from(&mut self, tau_s: &[f64], settings: &Settings) -> Fitted {
        self.base_by(settings, |model, observations, searched| {
            model.fit(tau_s, observations, searched, Effort::Compare)
        })
    }

    fn base_by(&mut self, settings: &Settings, fit: impl Fn(&Model, &Observations, &Selection) -> Fitted) -> Fitted {
        let model = Model::new(&settings.known, self.levels.std_k);
        let mut base = fit(&model, &self.observations, &self.searched);
        // A wrong reading hides its neighbours: once more where there were some.
        for _ in 0..SPIKE_ROUNDS {
            if !settings.effects.contains(&Identifier::SPIKES) || !self.mask_spikes(&base) {
                break;
            }
            base = fit(&model, &self.observations, &self.searched);
        }
        if !self.found.is_empty() {
            self.find_levels(&base);
            base = self.refit(&base);
        }
        base
    }

    /// The two-lag model of the record as it came, where `base` is that of the record with defects masked; none where none is.
    pub fn unmasked(&self, base: &Fitted) -> Option<Fitted> {
        if self.found.iter().all(|f| f.effect == Identifier::QUANTISATION) {
            return None;
        }
        let (observations, levels) = &self.raw;
        let model = base.model.clone().with_noise(levels.std_k);
        Some(model.fit(&base.theta, observations, &self.searched, Effort::Compare))
    }

    pub(crate) fn mask_spikes(&mut self, base: &Fitted) -> bool {
        let parts = base.model.details(&base.theta, &self.observations).into_scored();
        let mut new = [Vec::new(), Vec::new()];
        let policy = &self.policy;
        for (round, far) in
            [policy.spike_standard_deviations, policy.further_spike_standard_deviations].into_iter().enumerate()
        {
            let known = [0, 1].map(|i| self.spikes[i].len() + new[i].len());
            let spikes = defects::spikes(&self.observations, &parts, far, known, policy);
            for i in 0..2 {
                // Where there are some there are smaller ones.
                if round == 0 || !new[i].is_empty() {
                    defects::mask(&mut self.observations, i, &spikes[i]);
                    new[i].extend_from_slice(&spikes[i]);
                }
            }
        }
        let any = new.iter().any(|samples| !samples.is_empty());
        for (i, samples) in new.into_iter().enumerate().filter(|(_, samples)| !samples.is_empty()) {
            let all = &mut self.spikes[i];
            all.extend(samples);
            all.sort_unstable();
            self.found.retain(|f| f.effect != Identifier::SPIKES || f.channel != i);
            let readings = if all.len() == 1 { "reading" } else { "readings" };
            let what = format!("{} single {readings}", all.len());
            self.found.push(masking(Identifier::SPIKES, i, what, all.clone()));
        }
        any
    }

    /// Levels again, without what is masked and without the disturbances of `fitted`, unless they were given.
    pub fn find_levels(&mut self, fitted: &Fitted) {
        let found = defects::levels(&fitted.model.without_disturbances(&fitted.theta, &self.observations));
        if let (false, Some(found)) = (self.levels.is_given, found) {
            self.levels = ChannelNoise { step_k: self.levels.step_k, ..found };
        }
    }

    /// Whether what `fitted` leaves over, of several records in any that has levels of its own, is clearly less than noise of the levels that
    /// there are, as uncertain as these are: the disagreement holds all of the noise, and third differences hold the fastest changes of the
    /// gas as well. Levels that were given are believed.
    pub fn has_high_levels(&self, fitted: &Fitted) -> bool {
        let is_coarse = self.levels.coarse_step_k().iter().any(Option::is_some);
        if self.levels.is_given || fitted.model.noise().is_some() || is_coarse {
            return false;
        }
        if self.observations.has_own_noise() {
            return self.observations.members().iter().any(|member| self.does_leave_less_than_noise(fitted, member));
        }
        fitted.mean_energy().ln() < -self.policy.lower_levels_standard_errors * self.log_energy_std(fitted)
    }

    /// Whether a record with levels of its own leaves less than noise of these levels by more than chance.
    fn does_leave_less_than_noise(&self, fitted: &Fitted, member: &Member) -> bool {
        let of_member = self.observations.of_member(member.number);
        // The variance of a level is inversely proportional to its samples.
        let share = of_member.samples() as f64 / self.observations.samples() as f64;
        let error = self.levels.log_variance_error() / share.sqrt();
        let test = energy_test(&fitted.model, &fitted.theta, &of_member, &self.searched_of(member), error);
        let p_value = LESS_THAN_NOISE_PROBABILITY / self.observations.members().len() as f64;
        test.is_some_and(|test| test.statistic < 1.0 && test.p_value < p_value)
    }

    /// Probability that noise leaves by chance as much energy as `fitted` does where the gas is seen, of levels as uncertain as they are.
    pub fn chance_of_energy(&self, fitted: &Fitted) -> f64 {
        let in_std = fitted.mean_energy().ln() / self.log_energy_std(fitted);
        Normal::standard().sf(in_std)
    }

    /// The standard deviation by which the logarithm of the energy that `fitted` leaves over differs by chance from that of the noise.
    fn log_energy_std(&self, fitted: &Fitted) -> f64 {
        (2.0 / fitted.count + self.levels.log_variance_error().powi(2)).sqrt()
    }

    /// What is searched of a record.
    fn searched_of(&self, member: &Member) -> Selection {
        self.searched.of_samples(member.samples.clone())
    }

    /// Lowers the levels to what `fitted` leaves over, of several records whose noise is their own in those that leave less than it; which
    /// may show that a converter is coarse.
    pub fn lower_levels(&mut self, fitted: &Fitted, settings: &Settings) {
        if self.observations.has_own_noise() {
            self.lower_own_levels(fitted);
        } else {
            self.levels.replace(self.levels_left(fitted, &self.observations, &self.searched));
            // Their ratio is that of the spectrum, and their size that of all that is left over, which is then clearly less no more.
            let model = fitted.model.clone().with_noise(self.levels.std_k);
            let energy = model.energy(&fitted.theta, &self.observations, &self.searched) / fitted.count;
            self.levels.replace(self.levels.std_k.map(|level_k| level_k * energy.sqrt()));
        }
        self.levels.is_of_residual = true;
        self.context.noise_std_k = self.levels.std_k;
        self.context.is_coarse = self.levels.coarse_step_k().map(|step_k| step_k.is_some());
        if settings.effects.contains(&Identifier::QUANTISATION) {
            self.found.extend(coarse_steps(&self.levels));
        }
    }

    /// Lowers the levels of each record that leaves less than noise; those of all are a mean.
    fn lower_own_levels(&mut self, fitted: &Fitted) {
        let members = self.observations.members();
        let of = |member: &Member| {
            let (of_member, selection) = (self.observations.of_member(member.number), self.searched_of(member));
            let factor = of_member.noise_factor();
            if !self.does_leave_less_than_noise(fitted, member) {
                return [0, 1].map(|i| factor[i] * self.levels.std_k[i]);
            }
            // Their ratio is that of the spectrum, and their size that of all that is left over.
            let left_k = self.levels_left(fitted, &of_member, &selection);
            let model = fitted.model.clone().with_noise([0, 1].map(|i| left_k[i] / factor[i]));
            let test = energy_test(&model, &fitted.theta, &of_member, &selection, 0.0);
            left_k.map(|level_k| level_k * test.as_ref().map_or(1.0, |test| test.statistic.sqrt()))
        };
        let own: Vec<[f64; 2]> = members.iter().map(of).collect();
        let samples = |member: &Member| member.samples.len() as f64;
        let all: f64 = members.iter().map(samples).sum();
        let sum =
            |i: usize| members.iter().zip(&own).map(|(member, own)| samples(member) * own[i].powi(2)).sum::<f64>();
        self.levels.replace([0, 1].map(|i| (sum(i) / all).sqrt()));
        let over_all = |own: &[f64; 2]| [0, 1].map(|i| own[i] / self.levels.std_k[i]);
        self.observations = self.observations.clone().with_noise_factors(&own.iter().map(over_all).collect::<Vec<_>>());
    }

    /// Noise levels, K, of what `fitted` leaves over in `observations`, these or one of these records, by its spectrum, which determines
    /// their ratio.
    fn levels_left(&self, fitted: &Fitted, observations: &Observations, selection: &Selection) -> [f64; 2] {
        let left = fitted.model.residual_runs(&fitted.theta, observations, |sample| selection.holds(sample));
        let mut plant = fitted.model.plant(&fitted.theta, observations);
        let factor = observations.noise_factor();
        (0..2).for_each(|i| plant.noise_std_k[i] *= factor[i]);
        levels_below(&plant, observations, &Bands::of(&left), self.context.is_coarse)
    }

    /// All of the record and its noise levels as they were before either was weighed by what a fit leaves over.
    pub fn before_residuals(&self) -> (Selection, &ChannelNoise) {
        let levels = &self.raw.1;
        let weighting = Weighting::of(&self.observations, levels.std_k);
        (Selection { weighting, ..self.everything.clone() }, levels)
    }

    /// From here on frequencies count by the spectrum of what `fitted` leaves over.
    pub fn weigh_by(&mut self, fitted: &Fitted) {
        let left = fitted.model.residual_runs(&fitted.theta, &self.observations, |s| self.searched.holds(s));
        self.searched.weighting = self.searched.weighting.by_residual(&left);
        self.everything.weighting = self.searched.weighting.clone();
    }

    /// This model with the current noise levels.
    pub fn refit(&self, fitted: &Fitted) -> Fitted {
        let model = fitted.model.clone().with_noise(self.levels.std_k);
        model.fit(&fitted.theta, &self.observations, &self.searched, Effort::Compare)
    }

    /// Whether pieces of the record are enough for a quick look.
    pub(crate) fn is_excerpted(&self) -> bool {
        self.observations.samples() >= MIN_EXCERPTED_SAMPLES
    }

    /// Pieces of a long record, for a quick look, and what counts of them; all of a short one.
    pub fn excerpt(&self) -> (Observations, Selection) {
        let samples = self.observations.samples();
        if !self.is_excerpted() {
            return (self.observations.clone(), self.searched.clone());
        }
        // After each block that judges.
        let starts = blocks::after_judges(samples, &self.policy);
        let excerpt = self.observations.excerpt(starts, EXCERPT_SAMPLES);
        let whole = selection(&excerpt, None, &self.searched.weighting);
        (excerpt, whole)
    }

    /// All residuals of models without a delay, which is what takes most of those at the ends.
    pub fn without_delay(&self) -> Selection {
        away_from_ends(&self.observations, 0, &self.everything.weighting)
    }

    /// Whether a sample is of the blocks that judge.
    pub fn judges(&self, sample: usize) -> bool {
        self.everything.holds(sample) && blocks::is_judge(sample, self.observations.samples(), &self.policy)
    }
}

/// The test of the energy that a model leaves over of a record of several; `None` of no more residuals than parameters.
fn energy_test(
    model: &Model,
    theta: &[f64],
    observations: &Observations,
    selection: &Selection,
    log_variance_error: f64,
) -> Option<ResidualTest> {
    let left = model.residual_runs(theta, observations, |sample| selection.holds(sample));
    let free = model.free_count() - model.of_other_records(observations).len();
    total_energy_test(&left, free, log_variance_error)
}

/// Saturation and coarse converters, masked and named.
fn data_defects(observations: &mut Observations, levels: &ChannelNoise, settings: &Settings) -> Vec<Defect> {
    let allowed = &settings.effects;
    let mut out = Vec::new();
    if allowed.contains(&Identifier::SATURATION) {
        for (i, samples) in saturated(observations, levels, settings).into_iter().enumerate() {
            if samples.is_empty() {
                continue;
            }
            defects::mask(observations, i, &samples);
            let seen = format!("{} readings at an end of the range", samples.len());
            out.push(masking(Identifier::SATURATION, i, seen, samples));
        }
    }
    if allowed.contains(&Identifier::QUANTISATION) {
        out.extend(coarse_steps(levels));
    }
    out
}

/// Samples of each channel at which its converter is at a limit.
fn saturated(observations: &Observations, levels: &ChannelNoise, settings: &Settings) -> [Vec<usize>; 2] {
    let policy = &settings.policy;
    let ends = range_ends(observations, levels, policy);
    let mut out = [Vec::new(), Vec::new()];
    if ends.is_empty() {
        return out;
    }
    let tau_s = lags_without(&ends, observations, levels, settings);
    let judge = Judge::new(&ends, observations, levels, tau_s, policy);
    for end in ends.iter().filter(|end| end.is_limit(&judge)) {
        out[end.channel()].extend(end.samples(observations));
    }
    out.iter_mut().for_each(|samples| samples.sort_unstable());
    out
}

/// Time constants of the two-lag model with gain and offset, without the readings of `ends`, s.
fn lags_without(
    ends: &[RangeEnd],
    observations: &Observations,
    levels: &ChannelNoise,
    settings: &Settings,
) -> [f64; 2] {
    let mut without = observations.clone();
    for end in ends {
        defects::mask(&mut without, end.channel(), &end.samples(observations));
    }
    let weighting = Weighting::of(&without, levels.std_k);
    let (excerpt, searched) = if without.samples() < MIN_EXCERPTED_SAMPLES {
        let all = selection(&without, None, &weighting);
        (without, all)
    } else {
        let starts = blocks::after_judges(without.samples(), &settings.policy);
        let excerpt = without.excerpt(starts, EXCERPT_SAMPLES);
        let all = selection(&excerpt, None, &weighting);
        (excerpt, all)
    };
    let static_disagreement = effect::calibration::gain_and_offset(&context(&excerpt, levels));
    let rest = static_disagreement.starts().swap_remove(0);
    let model = Model::new(&settings.known, levels.std_k).with(static_disagreement);
    let fitted = model.fit_over_grid(&rest, GRID_STARTS, &excerpt, &searched);
    [fitted.theta[0], fitted.theta[1]]
}

fn coarse_steps(levels: &ChannelNoise) -> impl Iterator<Item = Defect> {
    let steps = levels.coarse_step_k().into_iter().enumerate();
    steps.filter_map(|(i, step)| {
        Some(masking(Identifier::QUANTISATION, i, format!("steps of {:.4} K", step?), Vec::new()))
    })
}

fn masking(effect: Identifier, channel: usize, seen: String, masked: Vec<usize>) -> Defect {
    Defect { effect, channel, seen, masked }
}

/// All residuals away from the ends.
pub(crate) fn whole_selection(observations: &Observations, weighting: &Weighting) -> Selection {
    selection(observations, None, weighting)
}

/// All residuals away from the ends.
///
/// - `judging`: the policy whose judging blocks, and their surroundings, are left out
fn selection(observations: &Observations, judging: Option<&Policy>, weighting: &Weighting) -> Selection {
    let samples = observations.samples();
    let mut out = away_from_ends(observations, observations.reach(), weighting);
    if let Some(policy) = judging {
        let gap = policy.block_gap_samples(samples, policy.judging_blocks);
        for (k, counts) in out.counts.iter_mut().enumerate() {
            let near = [k.saturating_sub(gap), k, (k + gap).min(samples - 1)];
            *counts &= !near.iter().any(|s| blocks::is_judge(*s, samples, policy));
        }
    }
    out
}

/// All residuals away from the ends, where delays may reach so many samples.
fn away_from_ends(observations: &Observations, reach: usize, weighting: &Weighting) -> Selection {
    let samples = observations.samples();
    let margin = 8 + reach + weighting.half();
    let mut counts = vec![true; samples];
    let mut first = 0;
    for stretch in &observations.stretches {
        let n = stretch.len();
        // Every model of a stretch has residuals for these, whatever factors it needs.
        let inside = if n > 4 * margin { margin..n - margin } else { n / 8 + 1..n - n / 8 - 1 };
        for k in (0..n).filter(|k| !inside.contains(k)) {
            counts[first + k] = false;
        }
        first += n;
    }
    Selection { counts, weighting: weighting.clone() }
}

fn context(observations: &Observations, levels: &ChannelNoise) -> Context {
    let step_s = observations.step_s();
    Context {
        ends_s: observations.ends_s(),
        members: observations.members(),
        step_s,
        is_even: observations.period_s.is_some(),
        samples: observations.samples(),
        reach: observations.reach(),
        mean_c: [0, 1].map(|i| observations.mean_and_std(i)[0]),
        moments: observations.moments(),
        swing_k: observations.swing_k(),
        noise_std_k: levels.std_k,
        is_coarse: levels.coarse_step_k().map(|q| q.is_some()),
        tau_s: [10.0 * step_s; 2],
        flow: observations.flow().cloned(),
        gas: None,
        lines: Vec::new(),
    }
}
