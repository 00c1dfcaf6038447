//! One record with one set of options: noise levels, starts, fits.

use twinlag_bias::{Compensated, Noise, NoiseLevel, Normalised, estimate_noise, plain_covariance};
use twinlag_cross_relation::{
    CrossRelation, Middle, Parameter, Readings, ResidualTest, Segment, Whitened, residual_tests,
};
use twinlag_optimise::{Budget, Fit, MultiStart, Problem, Variable};
use twinlag_record::Record;
use twinlag_sensor::Discretisation;

use crate::characterisation::Characterisation;
use crate::error::Error;
use crate::objective::{EstimatorCost, Objective, Prior};
use crate::options::{Estimator, Hold, Known, Options};
use crate::starts::starts;

/// A residual test below this p-value rejects the model: four tests, so one false alarm in a thousand records.
pub(crate) const REJECT: f64 = 1e-3 / 4.0;
/// The other hold must lower the sum of squares by this many times the residual's energy per degree of freedom.
const CLEARLY_BETTER: f64 = 10.0;

/// A converter whose own noise `q/√12` is this share of the level is coarse: its errors are not white.
const COARSE: f64 = 0.7;

/// Noise levels and how well they are known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levels {
    pub(crate) std_k: [f64; 2],
    pub(crate) given: bool,
    /// Relative standard deviation of the variances: 0 if given.
    uncertainty: f64,
    /// Step of each converter where it is coarser than the noise, K.
    pub(crate) coarse_step_k: [Option<f64>; 2],
    /// Third differences that are too large for noise, in each channel.
    pub(crate) outliers: [usize; 2],
    /// Energy of the residual in units of the levels as found, where these had to be scaled to it.
    pub(crate) energy_as_found: Option<f64>,
}

impl Levels {
    pub(crate) fn of(readings: &Readings, options: &Options) -> Result<Self, Error> {
        if let Some(std_k) = options.noise_std_k {
            let (coarse_step_k, outliers) = ([None; 2], [0; 2]);
            return Ok(Self { std_k, given: true, uncertainty: 0.0, coarse_step_k, outliers, energy_as_found: None });
        }
        let found = estimate_noise(readings)?;
        let coarse = |l: &NoiseLevel| l.quantisation_step_k.filter(|q| q / 12.0_f64.sqrt() > COARSE * l.std_k);
        let uncertainty = found.iter().map(|l| 2.0 * l.standard_error_k / l.std_k).fold(0.0, f64::max);
        // A channel without any noise at all: a hundred-thousandth of its swing stands in, far below any converter's step.
        let least = 1e-5 * readings.swing();
        Ok(Self {
            std_k: found.map(|l| l.std_k.max(least)),
            given: false,
            uncertainty,
            coarse_step_k: [coarse(&found[0]), coarse(&found[1])],
            outliers: found.map(|l| l.outliers),
            energy_as_found: None,
        })
    }
}

/// Parameter `i` with the widest bounds that make sense for the record.
fn variable(i: usize, readings: &Readings, levels: &Levels) -> Variable {
    let name = Known::NAMES[i];
    match Parameter::ALL[i] {
        Parameter::Tau1 | Parameter::Tau2 => {
            Variable::logarithmic(name, 0.2 * readings.mean_step_s(), 10.0 * readings.span_s())
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
}

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
}

impl<'a, const P: usize> Question<'a, P> {
    pub(crate) fn new(record: &'a Record, readings: &'a Readings, options: &'a Options, levels: Levels) -> Self {
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
                None => variable.held_at(if Parameter::ALL[i] == Parameter::Gain { 1.0 } else { 0.0 }),
            }
        });
        let variables = variables.collect();
        Self { record, readings, options, levels, variables, priors, warnings: Vec::new(), is_determined: true }
    }

    pub(crate) fn free(&self) -> Vec<usize> {
        (0..P).filter(|&i| !self.is_held(i)).collect()
    }

    pub(crate) fn is_held(&self, i: usize) -> bool {
        self.variables[i].lower == self.variables[i].upper
    }

    fn prior_std(&self) -> [f64; P] {
        let mut out = [f64::INFINITY; P];
        self.priors.iter().for_each(|p| out[p.index] = p.std);
        out
    }

    pub(crate) fn answer(mut self) -> Result<Characterisation, Error> {
        if self.options.discard.is_some() && self.options.estimator == Estimator::Whitened {
            self.warnings.push("the whitened estimator discards no samples: --discard was not needed".into());
        }
        let mut best = self.fit_whitened(self.options.hold.first(), None)?;
        let mut energy = self.energy(&best);
        if !self.priors.is_empty() && energy > 1.5 {
            // What is known beforehand must weigh against the residual that there is, not against sensor noise alone.
            let louder = self.levels.std_k.map(|s| s * energy.sqrt());
            best = self.fit_whitened_with(self.options.hold.first(), louder, None)?;
            self.warnings.push(format!(
                "the residual has {energy:.3} times the energy that sensor noise explains; the known values were weighed \
                 against the residual"
            ));
        }
        let hold_sensitivity = self.try_other_hold(&mut best)?;
        let theta: [f64; P] = std::array::from_fn(|i| best.fit.x[i]);
        energy = self.energy(&best);
        let expected_spread = (2.0 / best.whitened.terms() as f64 + self.levels.uncertainty.powi(2)).sqrt();
        if !self.levels.given && energy < 1.0 - 4.0 * expected_spread {
            // Only the ratio matters to the fit; a signal that moves between samples makes third differences too large.
            let quieter = best.whitened.noise_std().map(|s| s * energy.sqrt());
            best.whitened = best.whitened.with_noise(quieter)?;
            self.levels.std_k = quieter;
            self.levels.energy_as_found = Some(energy);
            self.warnings.push(
                "the signal moves between samples as noise would: the noise levels are scaled to the residual, and their \
                 ratio is a guess; give --noise S1,S2 if you know them"
                    .into(),
            );
        }
        let tests = self.tests(&best);
        let middle = if self.rejected(&tests) { Middle::ResidualSpectrum } else { Middle::WhiteNoise };
        let covariance = best.whitened.covariance(&theta, &self.free(), &self.prior_std(), middle);
        if self.options.estimator == Estimator::Whitened {
            return self.conclude(&best, theta, covariance, tests, hold_sensitivity);
        }
        // What the whitened estimate cannot tell, the others only seem to tell.
        self.is_determined = best.fit.end.is_usable() && self.vague(&theta, covariance.as_ref()).is_empty();
        self.answer_published(best)
    }

    /// The estimators built on the published cost, started from the whitened fit.
    fn answer_published(mut self, mut whitened: Fitted<'a>) -> Result<Characterisation, Error> {
        let std_k = self.levels.std_k;
        let longest = self.readings.segments().iter().map(Segment::len).max().unwrap_or(0);
        let settled = (5.0 * whitened.fit.x[0].max(whitened.fit.x[1]) / self.readings.mean_step_s()).ceil() as usize;
        let discard = self.options.discard.unwrap_or(settled.min(longest / 2));
        if discard >= longest {
            return Err(Error::DiscardsAll { discard, longest });
        }
        let published = CrossRelation::new(self.readings, discard)?;
        let noise = || -> Result<[Noise; 2], Error> { Ok([Noise::white(std_k[0])?, Noise::white(std_k[1])?]) };
        let cost = match self.options.estimator {
            Estimator::BiasCompensated => EstimatorCost::Compensated(Compensated::new(published, noise()?)),
            Estimator::Normalised => EstimatorCost::Normalised(Normalised::new(published, noise()?)),
            _ => {
                self.warnings.push(
                    "the plain cross-relation cost is biased to long time constants by noise; its intervals say how the \
                     estimate scatters, not how far it is off"
                        .into(),
                );
                EstimatorCost::CrossRelation(published)
            }
        };
        // These costs have lower minima far out, where the filters' unknown initial state still shows after what was
        // discarded. Of several minima the one next to a consistent estimate is the one that is consistent itself.
        let mut all = self.minimise_from(&cost, std::slice::from_ref(&whitened.fit.x))?;
        if !all.best().end.is_usable() {
            all = self.minimise(&cost)?;
        }
        whitened.fit = all.best().clone();
        whitened.starts = all.fits().len();
        let theta: [f64; P] = std::array::from_fn(|i| whitened.fit.x[i]);
        let free = self.free();
        let covariance = match &cost {
            EstimatorCost::Compensated(c) => c.covariance(&theta, &free, std_k),
            EstimatorCost::Normalised(c) => c.covariance(&theta, &free, std_k),
            EstimatorCost::CrossRelation(c) => plain_covariance(c, &theta, &free, std_k),
            EstimatorCost::Whitened(_) => None,
        };
        let tests = self.tests(&whitened);
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
        let cost = EstimatorCost::Whitened(Whitened::new(self.readings, hold, noise_std)?);
        let all = match from {
            // Close to where another hold ended: no need to search again.
            Some(x) => self.minimise_from(&cost, &[x.to_vec()])?,
            None => self.minimise(&cost)?,
        };
        let EstimatorCost::Whitened(whitened) = cost else { unreachable!("built as whitened above") };
        Ok(Fitted { whitened, fit: all.best().clone(), starts: all.fits().len() })
    }

    fn minimise(&self, cost: &EstimatorCost<'a>) -> Result<MultiStart, Error> {
        let objective = Objective::<P> { cost, priors: &self.priors };
        self.minimise_from(cost, &starts(&objective, self.readings, &self.variables))
    }

    fn minimise_from(&self, cost: &EstimatorCost<'a>, from: &[Vec<f64>]) -> Result<MultiStart, Error> {
        let objective = Objective::<P> { cost, priors: &self.priors };
        let problem = Problem::new(&objective, self.variables.clone())?;
        Ok(MultiStart::run(&problem, &self.options.optimiser, from, &Budget::default())?)
    }

    /// Sum of squares over degrees of freedom, priors left out, in units of the levels that the question started with.
    fn energy(&self, fitted: &Fitted<'_>) -> f64 {
        let theta: [f64; P] = std::array::from_fn(|i| fitted.fit.x[i]);
        let assumed = fitted.whitened.noise_std()[0] / self.levels.std_k[0];
        let dof = fitted.whitened.terms().saturating_sub(self.free().len()).max(1);
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
        let mut tests = residual_tests(&residual, self.free().len(), self.levels.uncertainty);
        if self.levels.energy_as_found.is_some() {
            // Levels taken from the residual say nothing about its energy.
            tests.retain(|t| t.test != "total-energy");
        }
        if P == 2 && self.options.estimator == Estimator::Whitened && fitted.fit.end.is_usable() {
            let at_rest_alike = [theta[0], theta[1], 1.0, 0.0];
            let statistic = fitted.whitened.score_test(&at_rest_alike, &self.free(), &[2, 3]);
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
