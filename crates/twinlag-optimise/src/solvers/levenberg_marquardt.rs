//! Levenberg-Marquardt with bounds, which argmin's does not support.
//!
//! Each iteration solves `(H + μ diag H) s = −g` over the variables that are not held at a bound by
//! the gradient, moves to the nearest point inside the bounds, and accepts a lower cost. `H` is
//! whatever curvature the cost supplies: for sums of squares the Gauss-Newton matrix, otherwise the
//! Hessian, made positive by the damping where it is not.
//!
//! It runs on the ledger itself, without argmin between: on a cost of two variables that is cheap
//! to evaluate, argmin's bookkeeping took longer than all the rest.
//!
//! # Source
//! Damping by the gain ratio: Nielsen, *Damping parameter in Marquardt's method*, 1999. Bounds by
//! projection on the active set: Bertsekas, *Projected Newton methods*, 1982.

use crate::cholesky;
use crate::ledger::{Ledger, Refusal, Stop};
use crate::problem::{Derivatives, NoDerivatives};

/// Damping at the start, relative to the curvature.
const DAMPING: f64 = 1e-3;
/// Largest damping: past it no step is long enough to matter.
const DAMPING_LIMIT: f64 = 1e16;
/// Longest step in any coordinate: a factor e² for logarithms.
const LONGEST_STEP: f64 = 2.0;

/// Minimises from the best point so far, which has to be known with its derivatives. Done when no
/// coordinate would move by more than `step_tolerance`, or the cost fall by more than its resolution.
pub(crate) fn run(ledger: &Ledger<'_, '_, '_>, step_tolerance: f64) -> Stop {
    let bounds = ledger.problem().bounds();
    let best = ledger.best();
    let mut z = best.z;
    let Some(mut here) = best.derivatives else {
        return Stop::Failed(NoDerivatives::NotFinite.to_string());
    };
    let n = z.len();
    let mut system = System { free: Vec::with_capacity(n), matrix: vec![0.0; n * n], rhs: vec![0.0; n] };
    let (mut new, mut step) = (vec![0.0; n], vec![0.0; n]);
    let (mut damping, mut raise) = (DAMPING, 2.0);
    // Where steps are refused, the value says so at a fraction of the price of the derivatives.
    let mut is_wary = false;
    while !ledger.is_spent() {
        ledger.count_iteration();
        // Whether the gradient presses a coordinate against a bound.
        let is_pressed = |i: usize| {
            let (lower, upper) = bounds[i];
            (z[i] <= lower && here.gradient[i] > 0.0) || (z[i] >= upper && here.gradient[i] < 0.0)
        };
        system.free.clear();
        system.free.extend((0..n).filter(|&i| !is_pressed(i)));
        if system.free.is_empty() || ledger.problem().is_resolved(&here, &system.free) {
            ledger.report();
            return Stop::BySolver;
        }
        loop {
            if system.solve(&here, damping, &mut step) {
                let longest = longest(&step);
                if longest > LONGEST_STEP {
                    step.iter_mut().for_each(|s| *s *= LONGEST_STEP / longest);
                }
                for i in 0..n {
                    new[i] = (z[i] + step[i]).clamp(bounds[i].0, bounds[i].1);
                    step[i] = new[i] - z[i];
                }
                if self::longest(&step) <= step_tolerance {
                    ledger.report();
                    return Stop::BySolver;
                }
                let is_higher = is_wary && ledger.value(&new).is_ok_and(|value| value > here.value || value.is_nan());
                match (!is_higher).then(|| ledger.derivatives(&new)) {
                    Some(Ok(there)) if there.value <= here.value => {
                        let predicted: f64 = -(0..n)
                            .map(|i| {
                                let bend: f64 = (0..n).map(|j| here.curvature[i][j] * step[j]).sum();
                                step[i] * (here.gradient[i] + 0.5 * bend)
                            })
                            .sum::<f64>();
                        let ratio = (here.value - there.value) / predicted.max(f64::MIN_POSITIVE);
                        damping *= (1.0 - (2.0 * ratio.min(1.0) - 1.0).powi(3)).max(1.0 / 10.0);
                        is_wary = raise > 2.0;
                        raise = 2.0;
                        here = there;
                        std::mem::swap(&mut z, &mut new);
                        break;
                    }
                    Some(Err(Refusal::Exhausted(_))) => {
                        ledger.report();
                        return Stop::Exhausted;
                    }
                    // A point without finite derivatives is no better than one with a higher cost.
                    _ => {}
                }
            }
            damping = damping.max(1e-12) * raise;
            raise *= 2.0;
            is_wary = true;
            if damping > DAMPING_LIMIT {
                ledger.report();
                return Stop::BySolver;
            }
        }
        ledger.report();
    }
    Stop::Exhausted
}

fn longest(step: &[f64]) -> f64 {
    step.iter().fold(0.0_f64, |m, s| m.max(s.abs()))
}

/// The damped equations over the variables that can move, in memory that is used again in every
/// iteration.
struct System {
    free: Vec<usize>,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
}

impl System {
    /// Writes the damped step to `step`, zero for variables that cannot move. False if the matrix
    /// is not positive definite.
    fn solve(&mut self, here: &Derivatives, damping: f64, step: &mut [f64]) -> bool {
        let m = self.free.len();
        for (p, &i) in self.free.iter().enumerate() {
            for (q, &j) in self.free.iter().enumerate() {
                let h = here.curvature[i][j];
                // A variable without curvature is damped by the unit of its coordinate.
                let more = if p == q { damping * h.abs().max(f64::MIN_POSITIVE.sqrt()) } else { 0.0 };
                self.matrix[p * m + q] = h + more;
            }
            self.rhs[p] = -here.gradient[i];
        }
        if cholesky::solve(&mut self.matrix[..m * m], &mut self.rhs[..m]).is_none() {
            return false;
        }
        step.fill(0.0);
        for (p, &i) in self.free.iter().enumerate() {
            step[i] = self.rhs[p];
        }
        step.iter().all(|s| s.is_finite())
    }
}
