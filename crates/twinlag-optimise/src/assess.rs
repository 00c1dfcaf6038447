//! What kind of point a solver ended at, judged by the cost rather than by the solver's own word.

use nalgebra::{DMatrix, DVector};

use crate::problem::{Derivatives, Problem};
use crate::report::End;

/// Distance from a bound, in coordinates, within which a point counts as on it.
const ON_BOUND: f64 = 1e-6;
/// A Newton step longer than this, in coordinates, means that the minimum is elsewhere.
const NOT_THERE: f64 = 1e-3;
/// Curvature below this share of the largest one is none.
const FLAT: f64 = 1e-12;

impl Problem<'_> {
    /// How a fit that stopped at coordinates `z` ended. Costs one evaluation of the derivatives.
    ///
    /// [`End::OnBound`] within 1e-6 of a bound; else [`End::Converged`] where the curvature is positive and a Newton step
    /// would move no coordinate by more than 1e-3, [`End::Stalled`] where not, with `failure` (what the solver itself said)
    /// as the reason if there is one; [`End::Unchecked`] for a cost without derivatives.
    pub fn assess(&self, z: &[f64], failure: Option<&str>) -> End {
        self.judge(z, self.derivatives_at(z).as_ref(), failure)
    }

    /// [`Problem::assess`] with the derivatives at `z` at hand.
    pub(crate) fn judge(&self, z: &[f64], derivatives: Option<&Derivatives>, failure: Option<&str>) -> End {
        let stalled = |why: &str| End::Stalled(failure.unwrap_or(why).into());
        let on_bound: Vec<usize> = self
            .bounds()
            .iter()
            .enumerate()
            .filter(|&(i, (lower, upper))| z[i] - lower < ON_BOUND || upper - z[i] < ON_BOUND)
            .map(|(i, _)| self.free()[i])
            .collect();
        if !on_bound.is_empty() {
            return End::OnBound(on_bound);
        }
        let Some(d) = derivatives else {
            return match failure {
                None if self.value_at(z).is_finite() => End::Unchecked,
                _ => stalled("the cost is not finite anywhere that was tried"),
            };
        };
        let n = z.len();
        let matrix = DMatrix::from_fn(n, n, |i, j| d.curvature[i][j]);
        let eigenvalues = matrix.clone().symmetric_eigenvalues();
        if eigenvalues.min() <= FLAT * eigenvalues.max().max(0.0) {
            return End::Stalled("the cost is flat or falls away in some direction: this is no minimum".into());
        }
        let gradient = DVector::from_column_slice(&d.gradient);
        match matrix.cholesky().map(|c| c.solve(&gradient).amax()) {
            Some(step) if step <= NOT_THERE => End::Converged,
            _ => stalled("the solver stopped where the cost still falls"),
        }
    }
}
