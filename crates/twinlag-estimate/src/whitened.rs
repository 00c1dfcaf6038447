//! The whitened estimate: noise levels and parameters, each in the light of the other.
//!
//! Exact maximum likelihood of errors in variables for given levels; the levels themselves are
//! found in turn, from third differences first and from what the fit leaves then. Where they were
//! found, or only their ratio was given, their ratio is kept and their size is in the end that of
//! the residual: an estimator takes its model for right, and then nothing else says the size as
//! well. Both the levels as they were found and that size are kept, for whoever wants to test the
//! model by them.

use twinlag_cross_relation::{Parameter, Readings, ScoreVariance, Whitened};
use twinlag_optimise::{End, Evaluations, Fit, Variable};
use twinlag_sensor::Discretisation;

use crate::error::EstimateError;
use crate::fitting::{add, free, minimise_whitened, polish};
use crate::intervals::{Minimum, TauIntervals, inverse, with_level_uncertainty};
use crate::levels::NoiseLevels;
use crate::objective::{EstimatorCost, Objective, Prior};
use crate::outcome::Solved;
use crate::second_lag::Unseen;
use crate::starts::{hold_known, second_lags, starts};
use crate::task::Task;
use crate::vocabulary::{NoiseColour, NoiseKnowledge};

/// What is known beforehand is weighed against a residual of more energy per degree of freedom than
/// this times that of the noise, in place of the noise. Half as much again: twelve standard errors
/// of the energy of a record of 1000 samples, so that it is no chance, and a fifth in the standard
/// deviation, so that weights hardly differ where it just is not reached.
pub const ENERGY_THAT_OUTWEIGHS_NOISE: f64 = 1.5;

/// Where the whitened estimate ended on one task: parameters, levels, the cost, and what became of
/// second lags.
/// ```
#[doc = include_str!("../doc/readings.txt")]
/// use twinlag_cross_relation::ScoreVariance;
/// use twinlag_estimate::{Task, WhitenedFit};
///
/// let fit = WhitenedFit::<2>::find(&Task::new(&readings))?;
/// // The levels of the third differences, and what the residual has of them.
/// assert!((fit.levels().std_k[0] / 0.05 - 1.0).abs() < 0.1 && (fit.energy() - 1.0).abs() < 0.2);
/// let covariance = fit.covariance(ScoreVariance::WhiteNoise).expect("a minimum");
/// assert!((fit.theta()[0] - 0.0238).abs() < 4.0 * covariance[0][0].sqrt());
/// # Ok::<(), twinlag_estimate::EstimateError>(())
/// ```
pub struct WhitenedFit<'a, const P: usize> {
    pub(crate) task: Task<'a>,
    /// In its exact form, at the size of the noise that the estimate rests on.
    pub(crate) whitened: Whitened<'a>,
    pub(crate) levels: NoiseLevels,
    pub(crate) variables: Vec<Variable>,
    pub(crate) priors: Vec<Prior>,
    pub(crate) fit: Fit,
    pub(crate) starts: usize,
    pub(crate) evaluations: Evaluations,
    pub(crate) unseen: [Option<Unseen<P>>; 2],
}

impl<const P: usize> std::fmt::Debug for WhitenedFit<'_, P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WhitenedFit")
            .field("task", &self.task)
            .field("levels", &self.levels)
            .field("fit", &self.fit)
            .finish_non_exhaustive()
    }
}

/// Where one run of the minimiser ended.
pub(crate) struct Ended<'a> {
    pub(crate) whitened: Whitened<'a>,
    pub(crate) fit: Fit,
    /// Where every start ended, the lowest first.
    pub(crate) ends: Vec<Vec<f64>>,
    pub(crate) evaluations: Evaluations,
}

impl<'a, const P: usize> WhitenedFit<'a, P> {
    /// Levels and parameters of `task`.
    ///
    /// The order of the steps is forced. Levels can only be corrected by a fit; second lags that
    /// are not seen are taken out before that, since a fit with one on its bound says nothing
    /// reliable of the levels; and once more after it, since weights from wrong levels can make a
    /// lag look needed. The size of the noise comes last: it is that of the residual of the fit
    /// that is kept.
    ///
    /// # Errors
    /// [`EstimateError`] where the question cannot be put. A fit that ran is never an error.
    pub fn find(task: &Task<'a>) -> Result<Self, EstimateError> {
        let first = NoiseLevels::of(task)?;
        let mut found = Self::search(task, first)?;
        found.leave_out_unseen_lags()?;
        found.settle_levels(&first)?;
        if found.leave_out_unseen_lags()? {
            found.settle_levels(&first)?;
        }
        polish::<P>(&found.whitened, &found.priors, &found.variables, &mut found.fit);
        found.take_size_from_residual()?;
        found.weigh_knowledge_against_residual()?;
        Ok(found)
    }

    /// The lowest minimum from all starts, for noise of `levels`.
    fn search(task: &Task<'a>, levels: NoiseLevels) -> Result<Self, EstimateError> {
        let variables = task.variables::<P>(levels.std_k[1]);
        let priors = task.priors();
        let whitened = Whitened::new(task.readings, task.hold, levels.std_k)?;
        let ended = minimise::<P>(task, &variables, &priors, &levels, whitened, None)?;
        Ok(Self {
            task: task.clone(),
            whitened: ended.whitened,
            levels,
            variables,
            priors,
            fit: ended.fit,
            starts: ended.ends.len(),
            evaluations: ended.evaluations,
            unseen: [None; 2],
        })
    }

    /// Minimises again for noise of `noise_std`, `from` a point or from all starts.
    pub(crate) fn minimise_again(
        &self,
        hold: Discretisation,
        noise_std: [f64; 2],
        from: Option<&[f64]>,
    ) -> Result<Ended<'a>, EstimateError> {
        let Self { task, variables, priors, levels, .. } = self;
        let whitened = self.whitened.clone().with_hold(hold)?.with_noise(noise_std)?;
        minimise::<P>(task, variables, priors, levels, whitened, from)
    }

    /// Takes `ended` for the fit.
    pub(crate) fn accept(&mut self, ended: Ended<'a>) {
        add(&mut self.evaluations, ended.evaluations);
        (self.whitened, self.fit) = (ended.whitened, ended.fit);
    }

    /// Levels in the light of the fit, and the fit again in the light of the levels. `first` are
    /// the levels before any fit.
    fn settle_levels(&mut self, first: &NoiseLevels) -> Result<(), EstimateError> {
        let Some(colour) = self.task.colour_to_find() else { return Ok(()) };
        for _ in 0..max_rounds(colour) {
            // A second lag on its bound is none, and is no objection to the rest.
            let is_reliable = match &self.fit.end {
                End::OnBound(which) => which.iter().all(|&i| i >= 4),
                end => end.is_usable(),
            };
            if !is_reliable {
                break;
            }
            let refined = NoiseLevels::refined(first, self.task.readings, self.task.hold, &self.theta(), colour);
            if refined.agrees_with(&self.levels, colour) {
                break;
            }
            self.levels = refined;
            let from = self.fit.x.clone();
            let ended = self.minimise_again(self.task.hold, refined.std_k, Some(&from))?;
            self.accept(ended);
        }
        Ok(())
    }

    /// Noise of the residual's own size, unless levels were given. Where only the ratio was, these
    /// are the levels.
    fn take_size_from_residual(&mut self) -> Result<(), EstimateError> {
        if !self.task.noise_has_size_of_residual() || !self.fit.end.is_usable() {
            return Ok(());
        }
        let factor = self.energy().sqrt();
        let std_k = self.levels.std_k.map(|s| s * factor);
        self.whitened = self.whitened.clone().with_noise(std_k)?;
        if self.levels.given {
            self.levels = self.levels.scaled_to_residual(factor, self.degrees_of_freedom());
            self.fit.value = self.value();
        }
        Ok(())
    }

    /// What is known beforehand must weigh against the residual that there is. Where the levels
    /// were given that is noise of these, unless the residual has much more energy; otherwise the
    /// size is known only now, and the fit has to follow it.
    fn weigh_knowledge_against_residual(&mut self) -> Result<(), EstimateError> {
        if self.priors.is_empty() || !self.fit.end.is_usable() {
            return Ok(());
        }
        let energy = self.energy();
        let ended = if energy > ENERGY_THAT_OUTWEIGHS_NOISE {
            // Knowledge that weighs less may let the fit into another valley: from all starts.
            let louder = self.levels.std_k.map(|s| s * energy.sqrt());
            self.minimise_again(self.task.hold, louder, None)?
        } else if self.task.noise_has_size_of_residual() {
            let from = self.fit.x.clone();
            self.minimise_again(self.task.hold, self.whitened.noise_std(), Some(&from))?
        } else {
            return Ok(());
        };
        self.accept(ended);
        polish::<P>(&self.whitened, &self.priors, &self.variables, &mut self.fit);
        self.take_size_from_residual()
    }

    /// Takes the residual's size for the levels where these are clearly above it: a signal that
    /// moves between samples makes third differences too large. `true` where it was so.
    ///
    /// Clearly is by four standard errors of the residual's energy, those of the levels included:
    /// by chance once in 30 000.
    pub fn lower_levels_to_residual(&mut self) -> bool {
        const CLEARLY_STANDARD_ERRORS: f64 = 4.0;
        let theta = self.theta();
        let level_spread = self.levels.energy_uncertainty(self.whitened.noise_shares(&theta));
        let spread = (2.0 / self.whitened.terms(&theta) as f64 + level_spread.powi(2)).sqrt();
        let energy = self.energy();
        if self.levels.given || energy >= 1.0 - CLEARLY_STANDARD_ERRORS * spread {
            return false;
        }
        // Where the fit is no end the weights are those of the levels still.
        let quieter = self.levels.std_k.map(|s| s * energy.sqrt());
        if let Ok(whitened) = self.whitened.clone().with_noise(quieter) {
            self.whitened = whitened;
            self.levels = self.levels.of_residual(quieter, energy);
        }
        true
    }

    /// The parameters, in the order of [`twinlag_cross_relation::Parameter::ALL`].
    pub fn theta(&self) -> [f64; P] {
        std::array::from_fn(|i| self.fit.x[i])
    }

    /// How the fit ended.
    pub fn fit(&self) -> &Fit {
        &self.fit
    }

    /// What is known of the noise: levels as given or found, where from, how well.
    pub fn levels(&self) -> &NoiseLevels {
        &self.levels
    }

    /// The cost, in its exact form, at the size of the noise that the estimate rests on.
    pub fn whitened(&self) -> &Whitened<'a> {
        &self.whitened
    }

    /// The task that this is the fit of.
    pub fn task(&self) -> &Task<'a> {
        &self.task
    }

    /// The task as it is to be put to records like this one: levels of a rest that these do not
    /// have are known, and second lags that are not seen are not asked for.
    pub fn task_of_replicates(&self) -> Task<'a> {
        let mut task = self.task.clone();
        if !task.at_rest.is_empty() {
            task.noise = NoiseKnowledge::Known { std_k: self.levels.std_k, ar1: self.levels.ar1 };
            task.at_rest = &[];
        }
        task.second_order = [4, 5].map(|i| i < P && !self.is_held(i));
        task
    }

    /// The two channels.
    pub fn readings(&self) -> &'a Readings {
        self.task.readings
    }

    /// The variables, of which second lags that are not seen are held at none.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Knowledge that was weighed: index of the parameter, mean and standard deviation.
    pub fn knowledge(&self) -> &[Prior] {
        &self.priors
    }

    /// Second lags that were asked for and are not seen.
    pub fn unseen(&self) -> &[Option<Unseen<P>>; 2] {
        &self.unseen
    }

    /// Indices of the parameters that are fitted.
    pub fn free(&self) -> Vec<usize> {
        free(&self.variables)
    }

    /// Whether parameter `i` is not fitted.
    pub fn is_held(&self, i: usize) -> bool {
        self.variables[i].lower == self.variables[i].upper
    }

    /// Sum of squares over degrees of freedom, knowledge left out, in units of the levels: 1 where
    /// only their noise is left.
    pub fn energy(&self) -> f64 {
        let assumed = self.whitened.noise_std()[0] / self.levels.std_k[0];
        self.whitened.evaluate(&self.theta()).value * assumed * assumed / self.degrees_of_freedom()
    }

    /// Sum of squares over degrees of freedom in units of the noise that the estimate rests on.
    pub(crate) fn energy_of_assumed_noise(&self) -> f64 {
        self.whitened.evaluate(&self.theta()).value / self.degrees_of_freedom()
    }

    pub(crate) fn degrees_of_freedom(&self) -> f64 {
        self.whitened.terms(&self.theta()).saturating_sub(self.free().len()).max(1) as f64
    }

    /// The objective where the fit ended, at the size of the noise that the estimate rests on.
    pub(crate) fn value(&self) -> f64 {
        let cost = EstimatorCost::Whitened(self.whitened.clone());
        Objective::<P> { cost: &cost, priors: &self.priors }.at(&self.fit.x).value
    }

    pub(crate) fn prior_std(&self) -> [f64; P] {
        let mut out = [f64::INFINITY; P];
        self.priors.iter().for_each(|p| out[p.index] = p.std);
        out
    }

    /// Covariance `[P][P]` of the parameters, the uncertainty of found levels included; `None`
    /// where the end is no minimum.
    ///
    /// - `middle`: noise of the stated size, or the residual's own spectrum where the model leaves
    ///   more than noise
    pub fn covariance(&self, middle: ScoreVariance) -> Option<[[f64; P]; P]> {
        if !self.fit.end.is_usable() {
            return None;
        }
        let (theta, free) = (self.theta(), self.free());
        let information = self.whitened.observed_information(&theta);
        let covariance = self.whitened.covariance_by(&information, &theta, &free, &self.prior_std(), middle)?;
        let inverse = || inverse(information, &free, &self.priors);
        Some(with_level_uncertainty(&self.whitened, &theta, &free, &covariance, &self.levels, inverse))
    }

    /// 95 % intervals of both time constants for that `covariance`; by the profile of the cost
    /// `always`, or only where standard errors do not describe it.
    pub fn intervals(&self, covariance: &[[f64; P]; P], always: bool) -> TauIntervals {
        self.with_minimum(covariance, |minimum| minimum.intervals(always))
    }

    /// 95 % interval of the free parameter `i`, a time constant, for that `covariance`.
    pub fn interval(&self, i: usize, covariance: &[[f64; P]; P], always: bool) -> [f64; 2] {
        self.with_minimum(covariance, |minimum| minimum.interval(i, always).0)
    }

    fn with_minimum<R>(&self, covariance: &[[f64; P]; P], ask: impl FnOnce(Minimum<'_, 'a, P>) -> R) -> R {
        ask(Minimum {
            whitened: &self.whitened,
            theta: self.theta(),
            free: &self.free(),
            covariance,
            variables: &self.variables,
            priors: &self.priors,
            minimiser: self.task.minimiser,
        })
    }

    /// The fit as where an estimator ended, with that covariance.
    pub fn solved(&self, covariance: Option<[[f64; P]; P]>) -> Solved<P> {
        Solved {
            theta: self.theta(),
            covariance,
            noise_std_k: Some(self.whitened.noise_std()),
            noise_ar1: self.levels.ar1,
            end: self.fit.end.clone(),
            fit: Some(self.fit.clone()),
            starts: self.starts,
            evaluations: self.evaluations,
            discarded: 0,
        }
    }
}

/// Rounds of levels and fit at most. For white noise the second changes levels by a few per cent of
/// their standard error; with its colour to be found as well, time constants, levels and
/// coefficients follow each other slowly where the samples lie far apart.
fn max_rounds(colour: NoiseColour) -> usize {
    match colour {
        NoiseColour::White => 2,
        NoiseColour::Autoregressive => 8,
    }
}

/// Minimises `whitened`, with the colour that `levels` have, `from` a point or from all starts.
fn minimise<'a, const P: usize>(
    task: &Task<'a>,
    variables: &[Variable],
    priors: &[Prior],
    levels: &NoiseLevels,
    mut whitened: Whitened<'a>,
    from: Option<&[f64]>,
) -> Result<Ended<'a>, EstimateError> {
    let mut evaluations = Evaluations::default();
    let hold = whitened.hold();
    if levels.ar1 != [0.0; 2] {
        whitened = whitened.with_autoregression(levels.ar1.map(|phi| vec![phi]))?;
    }
    let own = match from {
        Some(x) => vec![x.to_vec()],
        None if P == 6 && task.starts_s.is_empty() => {
            second_order_starts::<P>(task, levels, hold, variables, &mut evaluations)?
        }
        None => task.starts::<P>(variables),
    };
    let run = |whitened: Whitened<'a>, own: Vec<Vec<f64>>| {
        minimise_whitened::<P>(whitened, priors, variables, task.minimiser, own)
    };
    let mut done = run(whitened, own)?;
    add(&mut evaluations, done.evaluations());
    let is_own_start = from.is_none() && task.starts_s.is_empty();
    if P == 6 && is_own_start && done.all.best().value > ENERGY_THAT_OUTWEIGHS_NOISE * task.readings.len() as f64 {
        // What two lags alone come to may lie in another valley.
        let (first, cost) = (done.all, EstimatorCost::Whitened(done.whitened));
        let second_order = [4, 5].map(|i| variables[i].lower < variables[i].upper);
        let grid = starts(&Objective::<P> { cost: &cost, priors }, task.readings, variables, second_order);
        let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
        done = run(whitened, grid)?;
        add(&mut evaluations, done.evaluations());
        if first.best().value <= done.all.best().value {
            done.all = first;
        }
    }
    let mut ends: Vec<Vec<f64>> = done.all.fits().iter().map(|f| f.x.clone()).collect();
    if let Some(swapped) = larger_first::<P>(&done.all.best().x, variables, priors) {
        done = run(done.whitened, vec![swapped])?;
        add(&mut evaluations, done.evaluations());
        ends.insert(0, done.all.best().x.clone());
    }
    let fit = done.all.best().clone();
    Ok(Ended { whitened: done.whitened, fit, ends, evaluations })
}

/// Two lags in series have no order: the larger one comes first. `None` where it does, or where
/// knowledge distinguishes them.
fn larger_first<const P: usize>(x: &[f64], variables: &[Variable], priors: &[Prior]) -> Option<Vec<f64>> {
    let is_free = |i: usize| variables[i].lower < variables[i].upper && priors.iter().all(|p| p.index != i);
    let mut out = x.to_vec();
    for i in 0..2 {
        if P == 6 && x[4 + i] > x[i] && is_free(i) && is_free(4 + i) {
            out.swap(i, 4 + i);
        }
    }
    hold_known(&mut out, variables);
    (out != x).then_some(out)
}

/// Second lags of several sizes beside what the record gives at first order, for either order of
/// the time constants: one found from a single start may be missed.
fn second_order_starts<const P: usize>(
    task: &Task<'_>,
    levels: &NoiseLevels,
    hold: Discretisation,
    variables: &[Variable],
    evaluations: &mut Evaluations,
) -> Result<Vec<Vec<f64>>, EstimateError> {
    let known: Vec<_> = task
        .known
        .iter()
        .filter(|k| !matches!(k.parameter, Parameter::SecondTau1 | Parameter::SecondTau2))
        .copied()
        .collect();
    let plain = Task { second_order: [false; 2], known: &known, starts_s: Vec::new(), ..*task };
    let ends = if plain.calibrates() {
        first_order_ends::<4>(&plain, levels, hold, evaluations)?
    } else {
        first_order_ends::<2>(&plain, levels, hold, evaluations)?
    };
    let first = |x: &Vec<f64>| [x[0], x[1], x.get(2).copied().unwrap_or(1.0), x.get(3).copied().unwrap_or(0.0)];
    let best = first(&ends[0]);
    let has_second = [4, 5].map(|i| variables[i].lower < variables[i].upper);
    let mut out = second_lags::<P>(&best, has_second);
    if let Some(other) = ends.iter().map(first).find(|x| (x[0] < x[1]) != (best[0] < best[1])) {
        out.extend(second_lags::<P>(&other, has_second));
    }
    out.iter_mut().for_each(|x| hold_known(x, variables));
    Ok(out)
}

/// Where the fits at first order end, the lowest first.
fn first_order_ends<const Q: usize>(
    task: &Task<'_>,
    levels: &NoiseLevels,
    hold: Discretisation,
    evaluations: &mut Evaluations,
) -> Result<Vec<Vec<f64>>, EstimateError> {
    let variables = task.variables::<Q>(levels.std_k[1]);
    let whitened = Whitened::new(task.readings, hold, levels.std_k)?;
    let ended = minimise::<Q>(task, &variables, &task.priors(), levels, whitened, None)?;
    add(evaluations, ended.evaluations);
    Ok(ended.ends)
}
