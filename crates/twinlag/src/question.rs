//! One record with one set of options: noise levels, starts, fits.

use twinlag_bias::{Compensated, Hybrid, Normalised, plain_covariance};
use twinlag_cross_relation::{
    CostError, CrossRelation, Form, Parameter, Readings, ResidualTest, ScoreVariance, Segment, Whitened,
    residual_tests, sandwich,
};
use twinlag_estimate::parts::{
    EstimatorCost, Objective, Prior, SETTLED, hold_known, minimise_whitened, noise, profile_level, second_lags, starts,
    with_level_uncertainty,
};
use twinlag_estimate::{Estimate, EstimateError, Estimator, Hold, Known, Levels, NoiseKnowledge, NoiseSource, Task};
use twinlag_optimise::{Budget, End, Fit, MultiStart, Problem, Variable};
use twinlag_record::Record;
use twinlag_sensor::Discretisation;

use crate::characterisation::Characterisation;
use crate::error::Error;
use crate::options::Options;
use crate::second_lag::Unseen;

/// A residual test below this p-value rejects the model: four tests, so one false alarm in a thousand records.
pub(crate) const REJECT: f64 = 1e-3 / 4.0;
/// The other hold must lower the sum of squares by this many times the residual's energy per degree of freedom.
const CLEARLY_BETTER: f64 = 10.0;

/// Parameter `i` with the widest bounds that make sense for the record.
fn variable(i: usize, readings: &Readings, levels: &Levels) -> Variable {
    let name = Known::NAMES[i];
    match Parameter::ALL[i] {
        Parameter::Tau1 | Parameter::Tau2 => {
            Variable::logarithmic(name, 0.2 * readings.mean_step_s(), 10.0 * readings.span_s())
        }
        Parameter::SecondTau1 | Parameter::SecondTau2 => {
            Variable::logarithmic(name, 0.05 * readings.mean_step_s(), readings.span_s())
        }
        Parameter::Gain => Variable::linear(name, 0.01, 0.2, 5.0),
        Parameter::Offset => {
            // At 0 °C a gain may hide in the offset, so the level counts too.
            let widest =
                10.0 * (readings.swing() + readings.segments().iter().map(Segment::highest).fold(0.0, f64::max));
            Variable::linear(name, levels.std_k[1], -widest, widest)
        }
    }
}

/// Where a fit of the whitened cost ended.
pub(crate) struct Fitted<'a> {
    pub(crate) whitened: Whitened<'a>,
    pub(crate) fit: Fit,
    pub(crate) starts: usize,
    /// Where every start ended, the lowest first.
    pub(crate) ends: Vec<Vec<f64>>,
}

impl Fitted<'_> {
    pub(crate) fn theta<const P: usize>(&self) -> [f64; P] {
        std::array::from_fn(|i| self.fit.x[i])
    }
}

/// Progress callback of a bootstrap: `(done, total)` replicates.
pub type Watch<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// One record with one set of options, `P` parameters.
pub(crate) struct Question<'a, const P: usize> {
    pub(crate) record: &'a Record,
    pub(crate) readings: &'a Readings,
    pub(crate) options: &'a Options,
    pub(crate) levels: Levels,
    pub(crate) variables: Vec<Variable>,
    pub(crate) priors: Vec<Prior>,
    pub(crate) warnings: Vec<String>,
    /// Whether the whitened estimate determines both time constants, for the estimators that cannot judge it themselves.
    pub(crate) is_determined: bool,
    /// Whether the whitened estimate's residual is noise, for the other estimators.
    pub(crate) whitened_is_accepted: bool,
    /// Second lags that were asked for and are not seen, with what the record allows.
    pub(crate) unseen: [Option<Unseen<P>>; 2],
    pub(crate) watch: Watch<'a>,
}

impl<'a, const P: usize> Question<'a, P> {
    pub(crate) fn new(
        record: &'a Record,
        readings: &'a Readings,
        options: &'a Options,
        levels: Levels,
        watch: Watch<'a>,
    ) -> Self {
        let mut priors = Vec::new();
        let variables = (0..P).map(|i| {
            let known = options.known(Parameter::ALL[i]);
            if let Some(&Known { value, std: Some(std), .. }) = known {
                priors.push(Prior { index: i, mean: value, std });
            }
            let variable = variable(i, readings, &levels);
            let is_free = match Parameter::ALL[i] {
                Parameter::Tau1 | Parameter::Tau2 => true,
                Parameter::Gain => options.free_gain,
                Parameter::Offset => options.free_offset,
                Parameter::SecondTau1 => options.second_order[0],
                Parameter::SecondTau2 => options.second_order[1],
            };
            match known {
                Some(Known { value, std: None, .. }) => variable.held_at(*value),
                // Wherever it is said to lie, it may be found.
                Some(Known { value, .. }) => Variable {
                    lower: variable.lower.min(0.1 * value),
                    upper: variable.upper.max(10.0 * value),
                    ..variable
                },
                None if is_free => variable,
                None => {
                    let value = if Parameter::ALL[i] == Parameter::Gain { 1.0 } else { 0.0 };
                    Variable::linear(variable.name, 1.0, value, value)
                }
            }
        });
        let variables = variables.collect();
        Self {
            record,
            readings,
            options,
            levels,
            variables,
            priors,
            warnings: Vec::new(),
            is_determined: true,
            whitened_is_accepted: false,
            unseen: [None; 2],
            watch,
        }
    }

    pub(crate) fn free(&self) -> Vec<usize> {
        (0..P).filter(|&i| !self.is_held(i)).collect()
    }

    pub(crate) fn is_held(&self, i: usize) -> bool {
        self.variables[i].lower == self.variables[i].upper
    }

    pub(crate) fn prior_std(&self) -> [f64; P] {
        let mut out = [f64::INFINITY; P];
        self.priors.iter().for_each(|p| out[p.index] = p.std);
        out
    }

    pub(crate) fn answer(mut self) -> Result<Characterisation, Error> {
        if self.options.discard.is_some() && self.options.estimator == Estimator::Whitened {
            self.warnings.push("the whitened estimator discards no samples: --discard was not needed".into());
        }
        if self.options.noise_std_k.is_some() && !self.options.quiet_segments_s.is_empty() {
            self.warnings.push("--noise gives the levels: --quiet-segment was not needed".into());
        }
        let first_levels = self.levels;
        let mut best = self.fit_whitened(self.options.hold.first(), None)?;
        if P == 6 {
            best = self.without_unseen(best)?;
        }
        self.settle_levels(&first_levels, &mut best)?;
        if P == 6 {
            // Weights from wrong levels can make a lag look needed.
            best = self.without_unseen(best)?;
            self.settle_levels(&first_levels, &mut best)?;
        }
        if self.levels_are_those_of_the_residual() && best.fit.end.is_usable() {
            self.scale_to_residual(&mut best)?;
            if !self.priors.is_empty() {
                best = self.fit_whitened(best.whitened.hold(), Some(&best.fit.x.clone()))?;
                self.scale_to_residual(&mut best)?;
            }
        }
        let mut energy = self.energy(&best);
        if !self.priors.is_empty() && energy > 1.5 {
            // What is known beforehand must weigh against the residual that there is, not against sensor noise alone.
            let louder = self.levels.std_k.map(|s| s * energy.sqrt());
            best = self.fit_whitened_with(self.options.hold.first(), louder, None)?;
            self.warnings.push(format!(
                "the residual has {energy:.3} times the energy that sensor noise explains; the known values \
                 were weighed \
                 against the residual"
            ));
        }
        let first_hold = best.whitened.hold();
        let hold_sensitivity = self.try_other_hold(&mut best)?;
        if best.whitened.hold() != first_hold {
            if self.priors.is_empty() {
                self.settle_levels(&first_levels, &mut best)?;
            }
            if self.levels_are_those_of_the_residual() {
                self.scale_to_residual(&mut best)?;
            }
        }
        let theta: [f64; P] = best.theta();
        energy = self.energy(&best);
        let level_spread = self.levels.energy_uncertainty(best.whitened.noise_shares(&theta));
        let expected_spread = (2.0 / best.whitened.terms(&theta) as f64 + level_spread.powi(2)).sqrt();
        if !self.levels.given && energy < 1.0 - 4.0 * expected_spread {
            // Only the ratio matters to the fit; a signal that moves between samples makes third differences too large.
            let quieter = best.whitened.noise_std().map(|s| s * energy.sqrt());
            best.whitened = best.whitened.with_noise(quieter)?;
            self.levels.std_k = quieter;
            self.levels.source = [NoiseSource::Residual; 2];
            self.levels.energy_as_found = Some(energy);
            self.warnings.push(
                "the signal changes between samples as noise does, so the noise levels are scaled to the \
                 residual and their ratio is a guess; give --noise S1,S2 if you know them"
                    .into(),
            );
        }
        let tests = self.tests(&best);
        let middle = if self.rejected(&tests) { ScoreVariance::ResidualSpectrum } else { ScoreVariance::WhiteNoise };
        let free = self.free();
        let covariance = best.whitened.covariance(&theta, &free, &self.prior_std(), middle);
        let covariance =
            covariance.map(|c| with_level_uncertainty(&best.whitened, &theta, &free, &c, &self.levels, &self.priors));
        if best.fit.end.is_usable() && covariance.is_some() {
            self.bound_unseen(&best, middle)?;
        }
        if self.options.estimator == Estimator::Whitened {
            return self.conclude(&best, theta, covariance, tests, hold_sensitivity);
        }
        // What the whitened estimate cannot tell, the others only seem to tell.
        self.is_determined = best.fit.end.is_usable() && self.vague(&theta, covariance.as_ref()).is_empty();
        self.whitened_is_accepted = !self.rejected(&tests);
        if self.options.estimator.is_closed_form() {
            return self.answer_closed_form(best);
        }
        self.answer_published(best)
    }

    /// What is known of the noise, as [`Estimate`] takes it.
    pub(crate) fn noise_knowledge(&self) -> NoiseKnowledge {
        match (self.options.noise_ratio, self.levels.given) {
            (Some(ratio), _) => NoiseKnowledge::Ratio(ratio),
            (None, true) => NoiseKnowledge::Known { std_k: self.levels.std_k, ar1: self.levels.ar1 },
            (None, false) => NoiseKnowledge::Found(self.options.noise_colour),
        }
    }

    /// The question as [`Estimate`] takes it, for the estimator that was asked.
    pub(crate) fn task(&self, hold: Discretisation, noise: NoiseKnowledge) -> Task<'a> {
        Task {
            hold,
            noise,
            minimiser: &self.options.optimiser,
            discard: self.options.discard,
            second_order: [4, 5].map(|i| i < P && !self.is_held(i)),
            ..Task::new(self.readings)
        }
    }

    /// The estimators on the difference equation.
    fn answer_closed_form(mut self, mut whitened: Fitted<'a>) -> Result<Characterisation, Error> {
        if self.options.discard.is_some() {
            self.warnings.push("estimators in closed form discard no samples: --discard was not needed".into());
        }
        let noise = match self.options.noise_ratio {
            Some(ratio) => NoiseKnowledge::Ratio(ratio),
            None => NoiseKnowledge::Known { std_k: self.levels.std_k, ar1: self.levels.ar1 },
        };
        let task = self.task(whitened.whitened.hold(), noise);
        let outcome = match self.options.estimator.estimate(&task) {
            Err(EstimateError::Cost(CostError::Singular)) => {
                whitened.fit = Fit {
                    optimiser: "closed-form".into(),
                    end: End::Stalled(
                        "the difference equation has no solution with two positive time constants".into(),
                    ),
                    ..whitened.fit
                };
                let tests = self.tests(&whitened);
                return self.conclude(&whitened, whitened.theta(), None, tests, None);
            }
            outcome => outcome?,
        };
        let bias = match self.options.estimator {
            Estimator::DifferenceEquationLs => {
                "noise biases least squares on the difference equation, in a direction that depends on which \
                 sensor is called T1"
            }
            Estimator::DifferenceEquationTls => "noise biases total least squares on the difference equation",
            _ => "",
        };
        if !bias.is_empty() {
            self.warnings.push(format!("{bias}; its intervals cover the scatter of the estimate, not its bias"));
        }
        let theta: [f64; P] = std::array::from_fn(|i| outcome.tau_s[i]);
        whitened.fit = Fit {
            optimiser: "closed-form".into(),
            start: Vec::new(),
            x: theta.to_vec(),
            value: whitened.whitened.evaluate(&theta).value,
            end: outcome.end.clone(),
            iterations: 0,
            evaluations: outcome.evaluations,
        };
        whitened.starts = 0;
        let tests = self.tests(&whitened);
        self.conclude_outcome(&whitened, &outcome, tests)
    }

    /// Whether only the ratio of the levels is known.
    fn levels_are_those_of_the_residual(&self) -> bool {
        self.levels.given && self.levels.source[0] == NoiseSource::Residual
    }

    /// Levels of the residual's own energy at the fit.
    fn scale_to_residual(&mut self, best: &mut Fitted<'a>) -> Result<(), Error> {
        let terms = best.whitened.terms(&best.theta::<P>()).saturating_sub(self.free().len()).max(1);
        self.levels = self.levels.scaled_to_residual(self.energy(best).sqrt(), terms as f64);
        let cost = EstimatorCost::Whitened(best.whitened.clone().with_noise(self.levels.std_k)?);
        best.fit.value = Objective::<P> { cost: &cost, priors: &self.priors }.at(&best.fit.x).value;
        best.whitened = best.whitened.clone().with_noise(self.levels.std_k)?;
        Ok(())
    }

    /// The estimators built on the published cost, started from the whitened fit.
    fn answer_published(mut self, mut whitened: Fitted<'a>) -> Result<Characterisation, Error> {
        let (mut std_k, ar1) = (self.levels.std_k, self.levels.ar1);
        let longest = self.readings.segments().iter().map(Segment::len).max().unwrap_or(0);
        let settled =
            (SETTLED * whitened.fit.x[0].max(whitened.fit.x[1]) / self.readings.mean_step_s()).ceil() as usize;
        let discard = self.options.discard.unwrap_or(settled.min(longest / 2));
        if discard >= longest {
            return Err(EstimateError::DiscardsAll { discard, longest }.into());
        }
        let published = CrossRelation::new(self.readings, discard)?;
        let noise = [noise(std_k[0], ar1[0])?, noise(std_k[1], ar1[1])?];
        let cost = match self.options.estimator {
            Estimator::BiasCompensated => EstimatorCost::Compensated(Compensated::new(published, noise)),
            Estimator::Normalised => EstimatorCost::Normalised(Normalised::new(published, noise)),
            Estimator::Hybrid => EstimatorCost::Hybrid(Hybrid::new(published, noise)?),
            _ => {
                self.warnings.push(
                    "the plain cross-relation cost is biased towards long time constants by noise; its \
                     intervals cover the scatter of the estimate, not its bias"
                        .into(),
                );
                EstimatorCost::CrossRelation(published)
            }
        };
        // These costs have lower minima far out, where the filters' unknown initial state still shows after what was
        // discarded. Of several minima the one next to a consistent estimate is the one that is consistent itself.
        let mut starts = 0;
        let mut run = |cost: &EstimatorCost<'a>, from: &[Vec<f64>]| -> Result<Fit, EstimateError> {
            let mut all = self.minimise_from(cost, from)?;
            if !all.best().end.is_usable() {
                all = self.minimise(cost)?;
            }
            starts = all.fits().len();
            Ok(all.best().clone())
        };
        let from = std::slice::from_ref(&whitened.fit.x);
        let (cost, fit) = match cost {
            EstimatorCost::Compensated(cost) if self.options.noise_ratio.is_some() => {
                let (cost, fit) = profile_level::<P>(&cost, from, &mut run)?;
                std_k = std_k.map(|s| s * cost.level().sqrt());
                (EstimatorCost::Compensated(cost), fit)
            }
            cost => {
                let fit = run(&cost, from)?;
                if self.options.noise_ratio.is_some() && matches!(cost, EstimatorCost::Normalised(_)) {
                    std_k = std_k.map(|s| s * fit.value.max(0.0).sqrt());
                }
                (cost, fit)
            }
        };
        whitened.fit = fit;
        whitened.starts = starts;
        let theta: [f64; P] = std::array::from_fn(|i| whitened.fit.x[i]);
        let free = self.free();
        let covariance = match &cost {
            EstimatorCost::Compensated(c) => c.covariance(&theta, &free, std_k),
            EstimatorCost::Normalised(c) => c.covariance(&theta, &free, std_k),
            EstimatorCost::Hybrid(c) => c.covariance(&theta, &free, std_k),
            EstimatorCost::CrossRelation(c) => plain_covariance(c, &theta, &free, std_k),
            EstimatorCost::Whitened(_) => None,
        };
        let tests = self.tests(&whitened);
        if std_k != self.levels.std_k {
            // Levels that this cost has profiled: how well it knows them is not known.
            (self.levels.std_k, self.levels.log_covariance) = (std_k, [[0.0; 2]; 2]);
        }
        self.warnings.push(format!("the first {discard} samples of each unbroken stretch were discarded"));
        self.conclude(&whitened, theta, covariance, tests, None)
    }

    fn fit_whitened(&self, hold: Discretisation, from: Option<&[f64]>) -> Result<Fitted<'a>, Error> {
        self.fit_whitened_with(hold, self.levels.std_k, from)
    }

    pub(crate) fn fit_whitened_with(
        &self,
        hold: Discretisation,
        noise_std: [f64; 2],
        from: Option<&[f64]>,
    ) -> Result<Fitted<'a>, Error> {
        let mut whitened = Whitened::new(self.readings, hold, noise_std)?;
        if self.levels.ar1 != [0.0; 2] {
            whitened = whitened.with_autoregression(self.levels.ar1.map(|phi| vec![phi]))?;
        }
        let own = match from {
            // Close to where another hold ended: no need to search again.
            Some(x) => vec![x.to_vec()],
            None if P == 6 => self.second_order_starts(hold)?,
            None => Vec::new(),
        };
        let minimise = |whitened: Whitened<'a>, own: Vec<Vec<f64>>| {
            minimise_whitened::<P>(whitened, &self.priors, &self.variables, &self.options.optimiser, |objective| {
                if own.is_empty() { starts(objective, self.readings, &self.variables) } else { own }
            })
        };
        let mut done = minimise(whitened, own)?;
        let mut count = done.all.fits().len();
        if let Some(swapped) = self.larger_first(&done.all.best().x) {
            done = minimise(done.whitened, vec![swapped])?;
            count += 1;
        }
        let ends = done.all.fits().iter().map(|f| f.x.clone()).collect();
        let mut fit = done.all.best().clone();
        self.polish(&done.whitened, &mut fit);
        Ok(Fitted { whitened: done.whitened, fit, starts: count, ends })
    }

    /// What compression has moved, put back: one Newton step on the cost as it is, and its value there. (Values are compared
    /// between holds, of which only one is compressed.)
    fn polish(&self, whitened: &Whitened<'a>, fit: &mut Fit) {
        if whitened.form() != Form::Spectral {
            return;
        }
        let cost = EstimatorCost::Whitened(whitened.clone());
        let objective = Objective::<P> { cost: &cost, priors: &self.priors };
        let here = objective.at(&fit.x);
        fit.value = here.value;
        let Some(inverse) = sandwich(&here.hessian, &here.hessian, &self.free()) else { return };
        if !fit.end.is_usable() {
            return;
        }
        let newton = |i: usize| fit.x[i] - (0..P).map(|j| inverse[i][j] * here.gradient[j]).sum::<f64>();
        let mut x: Vec<f64> = (0..P).map(newton).collect();
        hold_known(&mut x, &self.variables);
        let value = objective.at(&x).value;
        if value <= fit.value {
            (fit.x, fit.value) = (x, value);
        }
    }

    /// Two lags in series have no order: the larger one comes first. `None` where it does, or where
    /// prior knowledge distinguishes them.
    fn larger_first(&self, x: &[f64]) -> Option<Vec<f64>> {
        let is_free = |i: usize| !self.is_held(i) && self.priors.iter().all(|p| p.index != i);
        let mut out = x.to_vec();
        for i in 0..2 {
            if P == 6 && x[4 + i] > x[i] && is_free(i) && is_free(4 + i) {
                out.swap(i, 4 + i);
            }
        }
        hold_known(&mut out, &self.variables);
        (out != x).then_some(out)
    }

    /// Second lags of several sizes beside what the record gives at first order, for either order of the time constants.
    fn second_order_starts(&self, hold: Discretisation) -> Result<Vec<Vec<f64>>, Error> {
        let is_second = |p| matches!(p, Parameter::SecondTau1 | Parameter::SecondTau2);
        let mut plain = Options { second_order: [false; 2], ..self.options.clone() };
        plain.known.retain(|k| !is_second(k.parameter));
        let ends = if plain.calibrates() {
            Question::<4>::new(self.record, self.readings, &plain, self.levels, self.watch)
                .fit_whitened(hold, None)?
                .ends
        } else {
            Question::<2>::new(self.record, self.readings, &plain, self.levels, self.watch)
                .fit_whitened(hold, None)?
                .ends
        };
        let first = |x: &Vec<f64>| [x[0], x[1], x.get(2).copied().unwrap_or(1.0), x.get(3).copied().unwrap_or(0.0)];
        let best = first(&ends[0]);
        let has_second = [4, 5].map(|i| !self.is_held(i));
        let mut out = second_lags::<P>(&best, has_second);
        if let Some(other) = ends.iter().map(first).find(|x| (x[0] < x[1]) != (best[0] < best[1])) {
            out.extend(second_lags::<P>(&other, has_second));
        }
        out.iter_mut().for_each(|x| hold_known(x, &self.variables));
        Ok(out)
    }

    /// Levels in the light of the fit, and the fit again in the light of the levels.
    fn settle_levels(&mut self, first: &Levels, best: &mut Fitted<'a>) -> Result<(), Error> {
        for _ in 0..self.options.noise_colour.rounds() {
            // A second lag on its bound is none, and says nothing against the rest.
            let tells = match &best.fit.end {
                End::OnBound(which) => which.iter().all(|&i| i >= 4),
                end => end.is_usable(),
            };
            if !tells {
                break;
            }
            let theta: [f64; P] = std::array::from_fn(|i| best.fit.x[i]);
            let colour = self.options.noise_colour;
            let refined = Levels::refined(first, self.readings, best.whitened.hold(), &theta, colour);
            if refined.agrees_with(&self.levels, colour) {
                break;
            }
            self.levels = refined;
            let starts = best.starts;
            *best = self.fit_whitened(best.whitened.hold(), Some(&best.fit.x.clone()))?;
            best.starts = starts;
        }
        Ok(())
    }

    fn minimise(&self, cost: &EstimatorCost<'a>) -> Result<MultiStart, EstimateError> {
        let objective = Objective::<P> { cost, priors: &self.priors };
        self.minimise_from(cost, &starts(&objective, self.readings, &self.variables))
    }

    fn minimise_from(&self, cost: &EstimatorCost<'a>, from: &[Vec<f64>]) -> Result<MultiStart, EstimateError> {
        let objective = Objective::<P> { cost, priors: &self.priors };
        let problem = Problem::new(&objective, self.variables.clone())?;
        Ok(MultiStart::run(&problem, &self.options.optimiser, from, &Budget::default())?)
    }

    /// Sum of squares over degrees of freedom, priors left out, in units of the levels that the question started with.
    pub(crate) fn energy(&self, fitted: &Fitted<'_>) -> f64 {
        let theta: [f64; P] = std::array::from_fn(|i| fitted.fit.x[i]);
        let assumed = fitted.whitened.noise_std()[0] / self.levels.std_k[0];
        let dof = fitted.whitened.terms(&theta).saturating_sub(self.free().len()).max(1);
        fitted.whitened.evaluate(&theta).value * assumed * assumed / dof as f64
    }

    /// Fits with the other hold too; takes it if it may and the record is clearly better explained. Returns how far the time
    /// constants move.
    fn try_other_hold(&mut self, best: &mut Fitted<'a>) -> Result<Option<[f64; 2]>, Error> {
        if self.options.estimator != Estimator::Whitened || self.readings.even_period_s().is_none() {
            return Ok(None);
        }
        let other = match self.options.hold {
            Hold::FirstOrderHold => Discretisation::ZeroOrderHold,
            _ => Discretisation::FirstOrderHold,
        };
        let fitted = self.fit_whitened_with(other, best.whitened.noise_std(), Some(&best.fit.x))?;
        let moved = [0, 1].map(|i| fitted.fit.x[i] / best.fit.x[i] - 1.0);
        let usable = fitted.fit.end.is_usable() && best.fit.end.is_usable();
        if self.options.hold == Hold::Auto && fitted.fit.end.is_usable() {
            let needed = CLEARLY_BETTER * self.energy(best).max(1.0);
            let is_better = fitted.fit.value + needed < best.fit.value;
            if is_better || (self.rejected(&self.tests(best)) && !self.rejected(&self.tests(&fitted))) {
                *best = Fitted { starts: best.starts, ..fitted };
            }
        }
        Ok(usable.then_some(moved))
    }

    /// The tests of the residual, and of the calibration where it was not fitted.
    fn tests(&self, fitted: &Fitted<'_>) -> Vec<ResidualTest> {
        let theta: [f64; P] = std::array::from_fn(|i| fitted.fit.x[i]);
        // Levels that were rescaled for the priors' sake are not what the record is tested against.
        let scale = fitted.whitened.noise_std()[0] / self.levels.std_k[0];
        let residual: Vec<Vec<f64>> = fitted
            .whitened
            .residual(&theta)
            .into_iter()
            .map(|segment| segment.into_iter().map(|r| r * scale).collect())
            .collect();
        let level_spread = self.levels.energy_uncertainty(fitted.whitened.noise_shares(&theta));
        let mut tests = residual_tests(&residual, self.free().len(), level_spread);
        if self.levels.energy_as_found.is_some() || self.levels_are_those_of_the_residual() {
            // Levels taken from the residual say nothing about its energy.
            tests.retain(|t| t.test != "total-energy");
        }
        let is_fit = self.options.estimator == Estimator::Whitened && fitted.fit.end.is_usable();
        if is_fit && !self.options.calibrates() {
            let second = |i: usize| theta.get(i).copied().unwrap_or(0.0);
            let at_rest_alike = [theta[0], theta[1], 1.0, 0.0, second(4), second(5)];
            let (fitted, free) = (&fitted.whitened, self.free());
            let statistic = if P == 6 {
                fitted.score_test(&at_rest_alike, &free, &[2, 3])
            } else {
                fitted.score_test::<4>(&std::array::from_fn(|i| at_rest_alike[i]), &free, &[2, 3])
            };
            tests.extend(statistic.map(|s| {
                let statistic = s * scale * scale;
                // Chi-square with two degrees of freedom.
                ResidualTest {
                    test: "calibration".into(),
                    statistic,
                    degrees_of_freedom: Some(2.0),
                    p_value: (-0.5 * statistic).exp(),
                }
            }));
        }
        tests
    }

    /// Whether the tests reject the model. Where the levels are from the data, too little energy is no objection.
    pub(crate) fn rejected(&self, tests: &[ResidualTest]) -> bool {
        let counts = |t: &&ResidualTest| self.levels.given || t.test != "total-energy" || t.statistic > 1.0;
        tests.iter().filter(counts).any(|t| t.p_value < REJECT)
    }
}
