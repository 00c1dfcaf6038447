//! The dogleg step: an approximate minimum of the model `gᵀp + pᵀHp/2` within `|p| ≤ r`.
//!
//! Along the gradient to the model's minimum there, then straight to the Newton point, as far as
//! the region goes. argmin's own inverts the Hessian, which it can do for external matrix types
//! alone, and takes it to be positive definite. This one raises the diagonal until it is; with a
//! positive definite Hessian the two are the same.
//!
//! # Source
//! Nocedal and Wright, *Numerical Optimization*, 2006, section 4.1.

use argmin::core::{Error, KV, Problem, Solver, State as _, TerminationReason, TrustRegionRadius};

use crate::adapter::SolverState;
use crate::cholesky;

type State = SolverState<Vec<f64>, Vec<Vec<f64>>>;

/// A solver of one iteration: the state's parameters become the step.
#[derive(Clone)]
pub(crate) struct Dogleg {
    radius: f64,
}

impl Dogleg {
    pub(crate) fn new() -> Self {
        Self { radius: f64::NAN }
    }
}

impl TrustRegionRadius<f64> for Dogleg {
    fn set_radius(&mut self, radius: f64) {
        self.radius = radius;
    }
}

impl<O> Solver<O, State> for Dogleg {
    fn name(&self) -> &'static str {
        "dogleg"
    }

    fn next_iter(&mut self, _: &mut Problem<O>, mut state: State) -> Result<(State, Option<KV>), Error> {
        let lost = || Error::msg("the dogleg needs a gradient and a Hessian");
        let gradient = state.take_gradient().ok_or_else(lost)?;
        let hessian = state.take_hessian().ok_or_else(lost)?;
        let step = step(&gradient, &hessian, self.radius);
        Ok((state.param(step).terminate_with(TerminationReason::SolverConverged), None))
    }
}

/// The step. Its length is at most `radius`, and the model falls along it unless the gradient is
/// zero.
fn step(gradient: &[f64], hessian: &[Vec<f64>], radius: f64) -> Vec<f64> {
    let n = gradient.len();
    let mut raised = hessian.concat();
    let size = hessian.iter().flatten().fold(f64::MIN_POSITIVE.sqrt(), |m: f64, h| m.max(h.abs()));
    let mut raise = 0.0_f64;
    let newton = loop {
        let (mut matrix, mut solution) = (raised.clone(), gradient.iter().map(|g| -g).collect::<Vec<_>>());
        if cholesky::solve(&mut matrix, &mut solution).is_some() && solution.iter().all(|s| s.is_finite()) {
            break solution;
        }
        // Diagonally dominant, hence positive definite, once the raise exceeds n times the largest
        // entry.
        let next = (10.0 * raise).max(1e-3 * size);
        (0..n).for_each(|i| raised[i * n + i] += next - raise);
        raise = next;
    };
    if norm(&newton) <= radius {
        return newton;
    }
    let bend: f64 = (0..n).map(|i| (0..n).map(|j| gradient[i] * raised[i * n + j] * gradient[j]).sum::<f64>()).sum();
    let share = dot(gradient, gradient) / bend;
    let steepest: Vec<f64> = gradient.iter().map(|g| -share * g).collect();
    let length = norm(&steepest);
    if length >= radius || length.is_nan() {
        let slope = norm(gradient);
        return gradient.iter().map(|g| -radius * g / slope).collect();
    }
    // |steepest + t leg| = radius for t in (0, 1), by the root that does not cancel.
    let leg: Vec<f64> = newton.iter().zip(&steepest).map(|(a, b)| a - b).collect();
    let (a, b, c) = (dot(&leg, &leg), dot(&steepest, &leg), length * length - radius * radius);
    let root = (b * b - a * c).sqrt();
    let t = if b > 0.0 { -c / (b + root) } else { (root - b) / a };
    steepest.iter().zip(&leg).map(|(s, l)| s + t * l).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{norm, step};

    fn model(gradient: &[f64], hessian: &[Vec<f64>], p: &[f64]) -> f64 {
        (0..2).map(|i| p[i] * (gradient[i] + 0.5 * (0..2).map(|j| hessian[i][j] * p[j]).sum::<f64>())).sum()
    }

    /// For a gradient (2, 2) and curvatures 1 and 4 the Newton point is (−2, −½), and the lowest
    /// along the gradient −(2, 2)·8/20 = −(0.8, 0.8). Lengths 2.06 and 1.13: radii on the three
    /// parts of the path.
    #[test]
    fn the_path_is_gradient_then_leg_then_newton_point() {
        let (gradient, hessian) = ([2.0, 2.0], [vec![1.0, 0.0], vec![0.0, 4.0]]);
        assert_eq!(step(&gradient, &hessian, 3.0), [-2.0, -0.5]);
        let short = step(&gradient, &hessian, 0.5);
        assert!((short[0] + 0.125_f64.sqrt()).abs() < 1e-15 && short[0] == short[1], "{short:?}");
        let middle = step(&gradient, &hessian, 1.5);
        // On the leg: (−0.8, −0.8) + t (−1.2, 0.3), so p₂ = −0.8 + (−0.8 − p₁)/4.
        assert!((middle[1] - (-0.8 + (-0.8 - middle[0]) / 4.0)).abs() < 1e-15, "{middle:?}");
        assert!((norm(&middle) - 1.5).abs() < 1e-15, "{middle:?}");
    }

    /// argmin's dogleg takes the Newton point for a minimum where it is a saddle, and steps
    /// upwards.
    #[test]
    fn the_model_falls_where_the_curvature_is_negative_or_none() {
        let gradient = [1.0, -2.0];
        for hessian in
            [[vec![-1.0, 0.0], vec![0.0, 3.0]], [vec![-2.0, 1.0], vec![1.0, -2.0]], [vec![0.0, 0.0], vec![0.0, 0.0]]]
        {
            for radius in [1e-8, 0.1, 1.0, 50.0] {
                let p = step(&gradient, &hessian, radius);
                assert!(norm(&p) <= radius * (1.0 + 1e-12), "{p:?} for {radius}");
                assert!(model(&gradient, &hessian, &p) < 0.0, "{p:?} for {radius}");
            }
        }
    }
}
