//! Least-squares fits of a model to the whitened disagreement.

use twinlag_optimise::{Budget, Cost, End, Fit, Minimiser, Optimiser, Problem, Variable};

use crate::cost::{Linearised, ResidualCost};
use crate::dense;
use crate::lag_pair::LagPair;
use crate::model::Model;
use crate::normal::NormalEquations;
use crate::observations::{Observations, evenly_spread};
use crate::prepare::whole_selection;
use crate::selection::Selection;

/// Parameters whose second derivatives are taken. Those of many, all of one effect, are given by products of first
/// ones: what second ones add is of the time constants.
const MAX_EXACT_CURVATURES: usize = 7;
/// Samples up to which second derivatives are taken of the whole record, and the pieces of a longer one.
const MAX_CURVED_SAMPLES: usize = 16_384;
const CURVED_PIECES: usize = 8;
/// Step of second derivatives, in standard errors of a parameter: derivatives of the gradient over it average the
/// curvature where the parameter may be.
const CURVATURE_STEP_SE: f64 = 0.3;
/// Time constants of the grid for each sensor.
const GRID_POINTS: usize = 7;
/// Shortest of them, in sample periods, and longest, in lengths of the record.
const GRID_MIN_STEPS: f64 = 1.5;
const GRID_MAX_SPANS: f64 = 0.1;
/// Most iterations of a fit.
const LOOK_ITERATIONS: u64 = 5;
const MAX_ITERATIONS: u64 = 40;
/// Relative step at which a fit ends that is to be ranked, and any other: in a long record a standard error may be a hundred-thousandth
/// of a time constant.
const LOOK_STEP: f64 = 2e-2;
const STEP: f64 = 1e-7;
/// Deviance that a fit need not find where models are compared: a hundredth of the least that decides between them, some ten. In a
/// curved valley, where the record hardly determines anything, each of dozens of iterations gains as much.
const COMPARED_DEVIANCE: f64 = 0.1;
/// Deviance that the last fit need not find: the square of a hundredth of a standard error.
const FINISHED_DEVIANCE: f64 = 1e-4;
/// Evaluations for each iteration.
const EVALUATIONS_PER_ITERATION: u64 = 4;

/// How much effort a fit makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// A few iterations, enough to rank it.
    Look,
    /// To a tenth of a unit of deviance, enough to compare models.
    Compare,
    /// Until no parameter moves by a hundredth of its standard error.
    Finish,
}

impl Effort {
    /// Most iterations, the relative step at which the fit ends, and the deviance that it need not find.
    fn limits(self) -> (u64, f64, f64) {
        match self {
            Self::Look => (LOOK_ITERATIONS, LOOK_STEP, COMPARED_DEVIANCE),
            Self::Compare => (MAX_ITERATIONS, STEP, COMPARED_DEVIANCE),
            Self::Finish => (MAX_ITERATIONS, STEP, FINISHED_DEVIANCE),
        }
    }
}

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// All parameters: `τ₁`, `τ₂`, then those of each effect.
    pub theta: Vec<f64>,
    /// Energy of the residuals that count, as the fit weighs frequencies.
    pub chi2: f64,
    /// Their degrees of freedom, as the fit weighs frequencies: masked readings take some away.
    pub count: f64,
    /// How the fit ended.
    pub end: End,
    /// The report of the solver.
    pub report: Fit,
    /// Whether the bias that a mismatch of the gas makes has been removed from the parameters.
    pub is_mismatch_bias_removed: bool,
}

impl Fitted {
    /// A model where a solver ended.
    ///
    /// - `count`: degrees of freedom
    pub(crate) fn of(model: &Model, report: Fit, count: f64) -> Self {
        Self {
            model: model.clone(),
            theta: report.x.clone(),
            chi2: report.value,
            count,
            end: report.end.clone(),
            report,
            is_mismatch_bias_removed: false,
        }
    }

    /// This fit with parameters in their conventional order, where the model is the same for several.
    #[must_use]
    pub fn in_order(mut self) -> Self {
        for LagPair { time_constant, second } in LagPair::each(&self.model) {
            if self.theta[time_constant] < self.theta[second] {
                self.theta.swap(time_constant, second);
            }
        }
        self.report.x.clone_from(&self.theta);
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

/// The minimum of `cost`, the energy of so many residuals, from `start`.
pub(crate) fn minimised(
    cost: &dyn Cost,
    variables: Vec<Variable>,
    start: &[f64],
    residuals: usize,
    effort: Effort,
) -> Fit {
    let (iterations, step_tolerance, deviance) = effort.limits();
    let problem = Problem::new(cost, variables).expect("bounds are in order and the time constants are free");
    // What is left over, whatever it is, is the unit of deviances.
    let problem = problem.with_resolution(deviance / residuals.max(1) as f64);
    let budget = Budget { iterations, evaluations: EVALUATIONS_PER_ITERATION * iterations };
    let solver = Optimiser::LevenbergMarquardt { step_tolerance };
    solver.minimise(&problem, start, &budget).expect("the start is finite and there are derivatives")
}

impl Model {
    /// The fit from `start`, noise parameters held.
    ///
    /// # Panics
    /// If both time constants are held, or `start` is not finite.
    pub fn fit(&self, start: &[f64], observations: &Observations, selection: &Selection, effort: Effort) -> Fitted {
        let cost = ResidualCost::new(self, start, observations, selection);
        let fit = minimised(&cost, cost.variables.clone(), start, selection.counted(), effort);
        let count = self.degrees_of_freedom(cost.count(), &fit.x, observations, selection);
        Fitted::of(self, fit, count)
    }

    /// Degrees of freedom of `residuals` that count, as the fit weighs frequencies.
    pub(crate) fn degrees_of_freedom(
        &self,
        residuals: usize,
        theta: &[f64],
        observations: &Observations,
        selection: &Selection,
    ) -> f64 {
        let consumed = self.plant(theta, observations).consumed(observations.period_s.is_some());
        residuals.saturating_sub(selection.taken_by_masks(observations, consumed)) as f64 * selection.weighting.mean()
    }

    /// The energy at a point.
    pub fn energy(&self, theta: &[f64], observations: &Observations, selection: &Selection) -> f64 {
        ResidualCost::new(self, theta, observations, selection).energy(theta)
    }

    /// The correlation between the residuals that count at two points, as the fit weighs frequencies; NaN where those of one have no energy.
    pub fn residual_correlation(&self, points: [&[f64]; 2], observations: &Observations, selection: &Selection) -> f64 {
        let [a, b] = points.map(|theta| ResidualCost::new(self, theta, observations, selection).residuals(theta));
        dense::dot(&a, &b) / (dense::dot(&a, &a) * dense::dot(&b, &b)).sqrt()
    }

    /// The best fit with effect values as given, from the best `most` points of a grid of time constants.
    ///
    /// # Panics
    /// If both time constants are held, or `rest` is not finite.
    pub fn fit_over_grid(
        &self,
        rest: &[f64],
        most: usize,
        observations: &Observations,
        selection: &Selection,
    ) -> Fitted {
        let (low_s, high_s) = (GRID_MIN_STEPS * observations.step_s(), GRID_MAX_SPANS * observations.span_s());
        let at = |i: usize| low_s * (high_s / low_s).powf(i as f64 / (GRID_POINTS - 1) as f64);
        let pairs = (0..GRID_POINTS).flat_map(|i| (0..GRID_POINTS).map(move |j| (i, j))).filter(|(i, j)| i != j);
        let points: Vec<Vec<f64>> =
            pairs.map(|(i, j)| [at(i), at(j)].into_iter().chain(rest.iter().copied()).collect()).collect();
        let cost = ResidualCost::new(self, &points[0], observations, selection);
        let mut starts: Vec<(f64, Vec<f64>)> = points.into_iter().map(|p| (cost.energy(&p), p)).collect();
        // Its memory is as long as the record, and each fit has its own.
        drop(cost);
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

    /// Residual and its derivatives at a point, in units of the parameters, for the samples that count.
    pub fn linearised(&self, theta: &[f64], observations: &Observations, selection: &Selection) -> Linearised {
        ResidualCost::new(self, theta, observations, selection).into_linearised(theta, 0)
    }

    /// Half the second derivatives of the energy at `theta`, symmetric, in units of the parameters; averages over a part of a
    /// standard error either way. Of a parameter that is held, or whose column is zero, they are zero.
    ///
    /// Products of first derivatives, those of the normal equations, count the noise that is in these as information on
    /// the parameters. In quiet records there is little of it; where the noise is a tenth of what the gas does, it can make up most
    /// of them. The difference is a matter of the noise, so that of a record of more than 16 384 samples is that of eight pieces of
    /// it: off by one part in a hundred or so, the inverse root of their samples.
    ///
    /// - `normal`: the normal equations at `theta`
    /// - `known`: this matrix of a model without the last parameters, where these are an effect of no size that leaves its residual
    ///   as it was; otherwise empty
    pub fn second_derivatives(
        &self,
        theta: &[f64],
        observations: &Observations,
        selection: &Selection,
        normal: &NormalEquations,
        known: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        let products = &normal.products;
        if observations.samples() <= MAX_CURVED_SAMPLES {
            return self.curved(theta, observations, selection, products, 1.0, known);
        }
        // What noise adds to the products is the same all along the record.
        let piece = MAX_CURVED_SAMPLES / CURVED_PIECES;
        let part = observations.excerpt(evenly_spread(observations.samples(), CURVED_PIECES, piece), piece);
        let of_part = whole_selection(&part, &selection.weighting);
        let NormalEquations { products: part_products, count, .. } =
            self.normal_equations(theta, &part, &of_part, None);
        let share = count as f64 / normal.count.max(1) as f64;
        if count == 0 {
            return self.curved(theta, observations, selection, products, 1.0, known);
        }
        let part_known: Vec<Vec<f64>> = part_products.iter().take(known.len()).cloned().collect();
        let curved = self.curved(theta, &part, &of_part, &part_products, share, &part_known);
        let at = |i: usize, j: usize| match known.get(i.max(j)) {
            Some(_) => known[i][j],
            None => products[i][j] + (curved[i][j] - part_products[i][j]) / share,
        };
        (0..theta.len()).map(|i| (0..theta.len()).map(|j| at(i, j)).collect()).collect()
    }

    /// The second derivatives of [`Self::second_derivatives`], all from the residual of `observations`.
    ///
    /// - `share`: the part of the record that these are, whose standard errors are longer by its root
    fn curved(
        &self,
        theta: &[f64],
        observations: &Observations,
        selection: &Selection,
        products: &[Vec<f64>],
        share: f64,
        known: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        let (p, first) = (theta.len(), known.len());
        let cost = ResidualCost::new(self, theta, observations, selection);
        let end = p.min(first + MAX_EXACT_CURVATURES);
        let is_still = |i: usize| cost.variables[i].lower == cost.variables[i].upper || products[i][i] <= 0.0;
        let row = |i: usize| {
            let variable = &cost.variables[i];
            if is_still(i) {
                return vec![0.0; p];
            }
            let step = CURVATURE_STEP_SE * (share / products[i][i]).sqrt();
            let moved = |by: f64| {
                let mut at = theta.to_vec();
                at[i] = (at[i] + by).clamp(variable.lower, variable.upper);
                (at[i] - theta[i], cost.slope(&at))
            };
            let ((up, above), (down, below)) = (moved(step), moved(-step));
            above.iter().zip(&below).map(|(above, below)| (above - below) / (up - down)).collect()
        };
        let exact: Vec<Vec<f64>> = (first..end).map(row).collect();
        let of = |i: usize, j: usize| {
            let exact_row = |i: usize| (first..end).contains(&i).then(|| &exact[i - first]);
            match (exact_row(i), exact_row(j)) {
                _ if is_still(i) || is_still(j) => 0.0,
                (Some(a), Some(b)) => 0.5 * (a[j] + b[i]),
                (Some(row), None) => row[j],
                (None, Some(row)) => row[i],
                (None, None) if i < first && j < first => known[i][j],
                (None, None) => products[i][j],
            }
        };
        (0..p).map(|i| (0..p).map(|j| of(i, j)).collect()).collect()
    }

    /// Inverse of half the second derivatives of the energy; `None` where these are not positive definite, so that no minimum can be
    /// distinguished from chance.
    pub(crate) fn inverse_second_derivatives(
        &self,
        theta: &[f64],
        observations: &Observations,
        selection: &Selection,
        normal: &NormalEquations,
    ) -> Option<Vec<Vec<f64>>> {
        dense::inverse(&self.second_derivatives(theta, observations, selection, normal, &[]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::fixture::{TAU_S, observations};
    use crate::weighting::Weighting;

    /// Half of what the tones are together.
    const LOUD_K: f64 = 2.0;

    /// Of a record of twice as many samples as are taken whole, second derivatives are those of all samples: what noise adds to
    /// the products is off by the inverse root of the pieces' samples, one part in 128, and it is a part of them. The bound on
    /// each is three times that of the root of the diagonal. That part is large enough to be seen: a tenth of them and more.
    #[test]
    fn second_derivatives_by_pieces_are_those_of_the_whole() {
        let observations = observations(2 * MAX_CURVED_SAMPLES, LOUD_K, |_| 1.0);
        let model = Model::new(&[], [LOUD_K; 2]);
        let selection = whole_selection(&observations, &Weighting::default());
        let normal = model.normal_equations(&TAU_S, &observations, &selection, None);
        let by_pieces = model.second_derivatives(&TAU_S, &observations, &selection, &normal, &[]);
        let whole = model.curved(&TAU_S, &observations, &selection, &normal.products, 1.0, &[]);
        let tol = 3.0 / (MAX_CURVED_SAMPLES as f64).sqrt();
        for i in 0..2 {
            assert!(
                normal.products[i][i] > 1.1 * whole[i][i],
                "noise is seen: {} and {}",
                normal.products[i][i],
                whole[i][i]
            );
            for j in 0..2 {
                let scale = (normal.products[i][i] * normal.products[j][j]).sqrt();
                let off = (by_pieces[i][j] - whole[i][j]).abs() / scale;
                assert!(off < tol, "{i}, {j}: {} and {}", by_pieces[i][j], whole[i][j]);
            }
        }
    }
}
