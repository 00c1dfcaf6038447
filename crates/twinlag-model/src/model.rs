//! A model: two lags and the effects added so far; and its least-squares fit to the whitened disagreement.

use twinlag_optimise::{Budget, Cost, Derivatives, End, Fit, Minimiser, Optimiser, Problem, Scale, Variable};

use crate::dense;
use crate::effect::{Identifier, Parameter, Shared};
use crate::observations::Observations;
use crate::plant::{Evaluation, Plant};
use crate::weighting::Weighting;

/// Longest time constant beside the length of the record: of a longer one there is no more than a drift in it.
pub const LONGEST: f64 = 4.0;
/// Parameters whose second derivatives are taken.
const MOST_EXACT: usize = 7;

/// Something known of a time constant beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownTimeConstant {
    /// Sensor 0 or 1.
    pub sensor: usize,
    /// Its time constant, s.
    pub value_s: f64,
    /// Standard deviation of that knowledge, s; `None` holds it.
    pub std_s: Option<f64>,
}

/// Two lags and effects. Parameters are in the order τ₁, τ₂, then those of each effect.
#[derive(Clone)]
pub struct Model {
    pub effects: Vec<Shared>,
    known: Vec<KnownTimeConstant>,
    noise_std_k: [f64; 2],
    /// Whether the effects stay as they are, and the time constants alone are fitted.
    pub is_frozen: bool,
}

/// Which residuals count, by the sample in the middle of their reach.
#[derive(Clone, Debug)]
pub struct Selection {
    pub counts: Vec<bool>,
    /// Which frequencies count.
    pub weighting: Weighting,
}

impl Selection {
    pub fn holds(&self, sample: usize) -> bool {
        self.counts.get(sample).copied().unwrap_or(false)
    }

    /// The residuals that count, filtered.
    fn of(&self, evaluation: &Evaluation) -> Vec<f64> {
        let mut out = Vec::with_capacity(evaluation.residual.len());
        let ends = evaluation.begins.iter().skip(1).copied().chain([evaluation.residual.len()]);
        for (from, to) in evaluation.begins.iter().copied().zip(ends) {
            let filtered = self.weighting.apply(&evaluation.residual[from..to]);
            let pairs = filtered.iter().zip(&evaluation.sample[from..to]);
            out.extend(pairs.filter(|(_, s)| self.holds(**s)).map(|(r, _)| *r));
        }
        out
    }
}

impl Model {
    pub fn new(known: &[KnownTimeConstant], noise_std_k: [f64; 2]) -> Self {
        Self { effects: Vec::new(), known: known.to_vec(), noise_std_k, is_frozen: false }
    }

    pub fn with(&self, effect: Shared) -> Self {
        let mut out = self.clone();
        out.effects.push(effect);
        out
    }

    pub fn without(&self, index: usize) -> Self {
        let mut out = self.clone();
        out.effects.remove(index);
        out
    }

    /// The first effect that is noise.
    pub fn noise(&self) -> Option<usize> {
        self.effects.iter().position(|e| e.is_noise())
    }

    /// With another form of effect `index`.
    pub fn replaced(&self, index: usize, effect: Shared) -> Self {
        let mut out = self.clone();
        out.effects[index] = effect;
        out
    }

    /// With a time constant held.
    pub fn holding(mut self, sensor: usize, value_s: f64) -> Self {
        self.known.retain(|k| k.sensor != sensor);
        self.known.push(KnownTimeConstant { sensor, value_s, std_s: None });
        self
    }

    pub fn with_noise(mut self, noise_std_k: [f64; 2]) -> Self {
        self.noise_std_k = noise_std_k;
        self
    }

    pub fn noise_std_k(&self) -> [f64; 2] {
        self.noise_std_k
    }

    /// Whether a time constant is held at a known value.
    pub fn knows(&self, sensor: usize) -> bool {
        self.known.iter().any(|k| k.sensor == sensor && k.std_s.is_none())
    }

    /// Where the parameters of effect `index` are.
    pub fn range(&self, index: usize) -> std::ops::Range<usize> {
        let from = 2 + self.effects[..index].iter().map(|e| e.parameters().len()).sum::<usize>();
        from..from + self.effects[index].parameters().len()
    }

    pub fn parameters(&self) -> impl Iterator<Item = &Parameter> {
        self.effects.iter().flat_map(|e| e.parameters())
    }

    /// What the effects know of their parameters beforehand.
    pub fn prior(&self, theta: &[f64]) -> Vec<f64> {
        self.effects.iter().enumerate().flat_map(|(index, e)| e.prior(&theta[self.range(index)])).collect()
    }

    /// Number of all parameters.
    pub fn len(&self) -> usize {
        2 + self.parameters().count()
    }

    /// Number of parameters that are fitted to the readings, known ones left out.
    pub fn fitted(&self) -> usize {
        self.len() - self.known.iter().filter(|k| k.std_s.is_none()).count()
    }

    pub fn plant(&self, theta: &[f64], observations: &Observations) -> Plant {
        let mut plant = Plant::new(observations, [theta[0], theta[1]], self.noise_std_k);
        for (index, effect) in self.effects.iter().enumerate() {
            effect.install(&theta[self.range(index)], &mut plant);
        }
        plant
    }

    /// The readings with the lines of the model taken off.
    pub fn without_lines(&self, theta: &[f64], observations: &Observations) -> Observations {
        let plant = self.plant(theta, observations);
        let mut out = observations.clone();
        for stretch in &mut out.stretches {
            for (i, sensor) in plant.sensors.iter().enumerate() {
                for (y, t) in stretch.reading_c[i].iter_mut().zip(&stretch.time_s) {
                    *y -= sensor.reading.lines_at(*t);
                }
            }
        }
        out
    }

    pub fn evaluate(&self, theta: &[f64], observations: &Observations) -> Evaluation {
        self.plant(theta, observations).whitened(observations, false)
    }

    /// Variables of the fit. Noise is held: its likelihood is another.
    fn variables(&self, theta: &[f64], observations: &Observations) -> Vec<Variable> {
        let [first, last] = observations.ends_s();
        let tau = |i: usize| {
            let name = ["tau 1", "tau 2"][i];
            let variable = Variable::logarithmic(name, 0.1 * observations.step_s(), LONGEST * (last - first));
            match self.known.iter().find(|k| k.sensor == i) {
                Some(known) if known.std_s.is_none() => variable.held_at(known.value_s),
                _ => variable,
            }
        };
        let mut out = vec![tau(0), tau(1)];
        out.extend(self.parameters().map(|p| p.variable.clone()));
        for (index, effect) in self.effects.iter().enumerate() {
            if effect.is_noise() || (self.is_frozen && !effect.is_of_the_record()) {
                for i in self.range(index) {
                    out[i] = out[i].clone().held_at(theta[i]);
                }
            }
        }
        out
    }
}

/// A fitted model.
#[derive(Clone)]
pub struct Fitted {
    pub model: Model,
    pub theta: Vec<f64>,
    /// Energy of the selected residuals, as the fit weighs frequencies, and their number as it does.
    pub chi2: f64,
    pub count: f64,
    pub end: End,
    /// The report of the solver.
    pub report: Fit,
}

impl Fitted {
    /// The same with the larger lag of a sensor that has two as its time constant: the product does not tell them apart.
    pub fn larger_lag_first(mut self) -> Self {
        for (index, effect) in self.model.effects.iter().enumerate() {
            let (Identifier::SecondOrder, Some(sensor)) = (effect.identifier(), effect.channel()) else { continue };
            let at = self.model.range(index).start;
            if self.theta[at] > self.theta[sensor] && self.model.known.iter().all(|k| k.sensor != sensor) {
                self.theta.swap(at, sensor);
            }
        }
        self
    }

    /// Model and parameters without effect `index`.
    pub fn without(&self, index: usize) -> (Model, Vec<f64>) {
        let mut theta = self.theta.clone();
        theta.drain(self.model.range(index));
        (self.model.without(index), theta)
    }

    /// Energy per residual that counts.
    pub fn mean_energy(&self) -> f64 {
        self.chi2 / self.count.max(1.0)
    }
}

struct Squares<'a> {
    model: &'a Model,
    observations: &'a Observations,
    selection: &'a Selection,
    variables: Vec<Variable>,
}

impl Squares<'_> {
    fn residual(&self, theta: &[f64]) -> Vec<f64> {
        let evaluation = self.model.evaluate(theta, self.observations);
        let mut out = self.selection.of(&evaluation);
        for known in &self.model.known {
            if let Some(std_s) = known.std_s {
                out.push((theta[known.sensor] - known.value_s) / std_s);
            }
        }
        out.extend(self.model.prior(theta));
        out
    }

    /// Columns of the derivative, from the parameter `first` on.
    fn columns(&self, theta: &[f64], base: &[f64], first: usize) -> Vec<Vec<f64>> {
        (first..theta.len())
            .map(|i| {
                let variable = &self.variables[i];
                if variable.lower == variable.upper {
                    return vec![0.0; base.len()];
                }
                let step = difference_step(variable, theta[i]);
                let mut moved = theta.to_vec();
                moved[i] += step;
                self.residual(&moved).iter().zip(base).map(|(a, b)| (a - b) / step).collect()
            })
            .collect()
    }
}

/// A step that is small for the parameter and large beside rounding, into the allowed range.
fn difference_step(variable: &Variable, x: f64) -> f64 {
    let step = match variable.scale {
        Scale::Logarithmic => 1e-5 * x,
        Scale::Linear { typical } => 1e-3 * typical,
    };
    if x + step > variable.upper { -step } else { step }
}

impl Cost for Squares<'_> {
    fn value(&self, theta: &[f64]) -> f64 {
        self.residual(theta).iter().map(|r| r * r).sum()
    }

    fn derivatives(&self, theta: &[f64]) -> Option<Derivatives> {
        let r = self.residual(theta);
        let columns = self.columns(theta, &r, 0);
        Some(Derivatives {
            value: r.iter().map(|r| r * r).sum(),
            gradient: columns.iter().map(|c| 2.0 * dense::dot(c, &r)).collect(),
            curvature: columns.iter().map(|a| columns.iter().map(|b| 2.0 * dense::dot(a, b)).collect()).collect(),
        })
    }
}

/// How hard a fit tries.
#[derive(Clone, Copy)]
pub enum Effort {
    /// Enough to rank it.
    Look,
    /// To the end.
    Finish,
}

impl Model {
    /// The fit from `start`, noise parameters held.
    pub fn fit(
        &self,
        start: &[f64],
        observations: &Observations,
        selection: &Selection,
        effort: Effort,
    ) -> Fitted {
        let variables = self.variables(start, observations);
        let cost = Squares { model: self, observations, selection, variables: variables.clone() };
        let (iterations, step_tolerance) = match effort {
            Effort::Look => (10, 2e-2),
            Effort::Finish => (40, 1e-4),
        };
        let problem = Problem::new(&cost, variables).expect("bounds are in order and the time constants are free");
        let budget = Budget { iterations, evaluations: 4 * iterations };
        let fit = Optimiser::LevenbergMarquardt { step_tolerance }
            .minimise(&problem, start, &budget)
            .expect("the start is finite and there are derivatives");
        let count = cost.residual(&fit.x).len() as f64 * selection.weighting.mean();
        Fitted { model: self.clone(), theta: fit.x.clone(), chi2: fit.value, count, end: fit.end.clone(), report: fit }
    }

    /// The energy at a point.
    pub fn energy(&self, theta: &[f64], observations: &Observations, selection: &Selection) -> f64 {
        let evaluation = self.evaluate(theta, observations);
        let sum: f64 = selection.of(&evaluation).iter().map(|r| r * r).sum();
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// Residual and its derivatives at a point, in units of the parameters, for the samples that count.
    pub fn linearised(&self, theta: &[f64], observations: &Observations, selection: &Selection) -> Linearised {
        self.linearised_beside(theta, observations, selection, None)
    }

    /// The same; the columns of the parameters that this model has more than that of `known` alone where both have the same
    /// residuals, `known`'s for the others: what an effect of no size does not change.
    pub fn linearised_beside(
        &self,
        theta: &[f64],
        observations: &Observations,
        selection: &Selection,
        known: Option<&Linearised>,
    ) -> Linearised {
        let variables = self.variables(theta, observations);
        let cost = Squares { model: self, observations, selection, variables };
        let evaluation = self.evaluate(theta, observations);
        let samples: Vec<usize> = evaluation.sample.into_iter().filter(|s| selection.holds(*s)).collect();
        let residual = cost.residual(theta);
        let known = known.filter(|k| k.samples == samples);
        let mut columns = known.map_or_else(Vec::new, |k| k.columns.clone());
        columns.extend(cost.columns(theta, &residual, columns.len()));
        Linearised { samples, residual, columns }
    }
}

impl Model {
    /// Inverse of half the second derivatives of the energy; of the products of first ones where those are not positive definite.
    pub fn curvature(
        &self,
        theta: &[f64],
        observations: &Observations,
        selection: &Selection,
        lin: &Linearised,
    ) -> Option<Vec<Vec<f64>>> {
        let p = theta.len();
        let variables = self.variables(theta, observations);
        let products: Vec<Vec<f64>> =
            (0..p).map(|a| (0..p).map(|b| dense::dot(&lin.columns[a], &lin.columns[b])).collect()).collect();
        let scale = |i: usize| products[i][i].max(f64::MIN_POSITIVE).sqrt();
        let slope =
            |lin: &Linearised| -> Vec<f64> { lin.columns.iter().map(|c| dense::dot(c, &lin.residual)).collect() };
        // Those of many, all of one effect, by first derivatives: what the second ones add is of the time constants.
        let exact = p.min(MOST_EXACT);
        let mut second = products.clone();
        for i in 0..exact {
            if variables[i].lower == variables[i].upper {
                second[i].fill(0.0);
                continue;
            }
            // A step of about a third of a standard error either way.
            let step = 0.3 / scale(i);
            let moved = |by: f64| {
                let mut at = theta.to_vec();
                at[i] = (at[i] + by).clamp(variables[i].lower, variables[i].upper);
                (at[i] - theta[i], slope(&self.linearised(&at, observations, selection)))
            };
            let ((up, above), (down, below)) = (moved(step), moved(-step));
            for j in 0..p {
                second[i][j] = (above[j] - below[j]) / (up - down);
            }
        }
        let between = |i: usize, j: usize| match (i < exact, j < exact) {
            (true, false) => second[i][j],
            (false, true) => second[j][i],
            _ => 0.5 * (second[i][j] + second[j][i]),
        };
        let symmetric: Vec<Vec<f64>> = (0..p).map(|i| (0..p).map(|j| between(i, j)).collect()).collect();
        dense::inverse(&symmetric).or_else(|| dense::inverse(&products))
    }
}

/// A whitened residual with its derivatives.
pub struct Linearised {
    /// Samples of the residuals; knowledge beforehand comes after them in both of the others.
    pub samples: Vec<usize>,
    pub residual: Vec<f64>,
    /// One column for each parameter.
    pub columns: Vec<Vec<f64>>,
}

impl Model {
    /// The best fit with effect values as given, from the best points of a grid of time constants.
    pub fn fit_over_grid(&self, rest: &[f64], most: usize, observations: &Observations, selection: &Selection) -> Fitted {
        let step_s = observations.step_s();
        let span_s = observations.span_s();
        let (low, high) = (1.5 * step_s, 0.1 * span_s);
        let points = 7;
        let at = |i: usize| low * (high / low).powf(i as f64 / (points - 1) as f64);
        let mut starts = Vec::new();
        for i in 0..points {
            for j in 0..points {
                if i != j {
                    let mut theta = vec![at(i), at(j)];
                    theta.extend_from_slice(rest);
                    let energy = self.energy(&theta, observations, selection);
                    starts.push((energy, theta));
                }
            }
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Of either order the best.
        let is_first_faster = |theta: &[f64]| theta[0] < theta[1];
        let mut chosen: Vec<Vec<f64>> = starts.iter().take(most).map(|s| s.1.clone()).collect();
        let order = is_first_faster(&chosen[0]);
        if let Some(other) = starts.iter().find(|s| is_first_faster(&s.1) != order) {
            chosen.push(other.1.clone());
        }
        chosen
            .iter()
            .map(|start| self.fit(start, observations, selection, Effort::Look))
            .min_by(|a, b| a.chi2.total_cmp(&b.chi2))
            .map(|best| self.fit(&best.theta, observations, selection, Effort::Finish))
            .expect("at least one start")
    }
}
