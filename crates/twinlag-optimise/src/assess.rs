//! What kind of point a solver ended at, judged by the cost rather than by the solver's own word.

use nalgebra::DMatrix;

use crate::cholesky;
use crate::problem::{Derivatives, Problem};
use crate::report::End;

/// Distance from a bound, in coordinates, within which a point counts as on it.
const ON_BOUND: f64 = 1e-6;
/// A Newton step longer than this, in coordinates, means that the minimum is elsewhere.
const NOT_THERE: f64 = 1e-3;
/// Curvature below this share of the largest one counts as zero.
const FLAT: f64 = 1e-12;

impl Problem<'_> {
    /// How a fit that stopped at coordinates `z` ended. Costs one evaluation of the derivatives,
    /// and one of the value where there are none.
    ///
    /// [`End::OnBound`] within 1e-6 of a bound; else [`End::Converged`] where the curvature is
    /// positive and a Newton step would move no coordinate by more than 1e-3, or lower the cost by
    /// no more than its resolution ([`Problem::with_resolution`]), [`End::Stalled`]
    /// where not, with `failure` (what the solver itself said) as the reason if there is one;
    /// [`End::Unchecked`] for a cost without derivatives.
    ///
    /// ```
    /// use twinlag_optimise::{Cost, Derivatives, End, Problem, Variable};
    ///
    /// /// `(x − 2)²`.
    /// struct Parabola;
    ///
    /// impl Cost for Parabola {
    ///     fn value(&self, x: &[f64]) -> f64 {
    ///         (x[0] - 2.0).powi(2)
    ///     }
    ///
    ///     fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
    ///         let gradient = vec![2.0 * (x[0] - 2.0)];
    ///         Some(Derivatives { value: self.value(x), gradient, curvature: vec![vec![2.0]] })
    ///     }
    /// }
    ///
    /// let problem = Problem::new(&Parabola, vec![Variable::linear("x", 1.0, 0.0, 5.0)])?;
    /// assert_eq!(problem.assess(&[2.0], None), End::Converged);
    /// assert!(matches!(problem.assess(&[3.0], None), End::Stalled(_))); // a Newton step would move it by 1
    /// # Ok::<(), twinlag_optimise::ProblemError>(())
    /// ```
    pub fn assess(&self, z: &[f64], failure: Option<&str>) -> End {
        self.judge(z, || self.value_at(z), self.derivatives_at(z).as_ref(), failure)
    }

    /// [`Problem::assess`] with what is known of `z` at hand.
    pub(crate) fn judge(
        &self,
        z: &[f64],
        value: impl FnOnce() -> f64,
        derivatives: Option<&Derivatives>,
        failure: Option<&str>,
    ) -> End {
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
                None if value().is_finite() => End::Unchecked,
                _ => stalled("the cost is not finite anywhere that was tried"),
            };
        };
        let (smallest, largest) = extreme_eigenvalues(&d.curvature);
        if smallest <= FLAT * largest.max(0.0) {
            return End::Stalled("the cost is flat or falls away in some direction: this is no minimum".into());
        }
        let all: Vec<usize> = (0..z.len()).collect();
        if failure.is_none() && self.is_resolved(d, &all) {
            return End::Converged;
        }
        let mut step = d.gradient.clone();
        let mut matrix = d.curvature.concat();
        match cholesky::solve(&mut matrix, &mut step) {
            Some(()) if step.iter().all(|s| s.abs() <= NOT_THERE) => End::Converged,
            _ => stalled("the solver stopped where the cost still falls"),
        }
    }
}

/// The smallest and the largest eigenvalue of a symmetric matrix, to rounding of the largest.
fn extreme_eigenvalues(matrix: &[Vec<f64>]) -> (f64, f64) {
    match matrix {
        [only] => (only[0], only[0]),
        // The usual case, two time constants: no matrix on the heap for it.
        [first, second] => {
            let middle = 0.5 * (first[0] + second[1]);
            let radius = (0.5 * (first[0] - second[1])).hypot(second[0]);
            (middle - radius, middle + radius)
        }
        rows => {
            let eigenvalues = DMatrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j]).symmetric_eigenvalues();
            (eigenvalues.min(), eigenvalues.max())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::extreme_eigenvalues;

    /// Eigenvalues 3 ± √2 and, with a third coordinate of curvature 7 added, the same and 7;
    /// rounding only.
    #[test]
    fn eigenvalues_are_the_same_by_the_short_way_and_the_long() {
        let two = extreme_eigenvalues(&[vec![4.0, 1.0], vec![1.0, 2.0]]);
        let three = extreme_eigenvalues(&[vec![4.0, 1.0, 0.0], vec![1.0, 2.0, 0.0], vec![0.0, 0.0, 7.0]]);
        let want = [3.0 - 2.0_f64.sqrt(), 3.0 + 2.0_f64.sqrt()];
        assert!((two.0 - want[0]).abs() < 1e-14 && (two.1 - want[1]).abs() < 1e-14, "{two:?}, want {want:?}");
        assert!((three.0 - want[0]).abs() < 1e-13 && (three.1 - 7.0).abs() < 1e-13, "{three:?}, want {want:?} and 7");
    }
}
