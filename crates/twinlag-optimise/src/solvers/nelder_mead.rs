//! Simplex search, argmin's, inside the bounds and twice.

use argmin::solver::neldermead::NelderMead;

use crate::adapter::{Objective, Outside, SolverState, run as run_argmin};
use crate::ledger::{Ledger, Stop};

/// Searches from the best point so far, and once more from where that ended: a simplex can shrink
/// onto a point that is no minimum, and a second one started there then moves on.
pub(crate) fn run(ledger: &Ledger<'_, '_, '_>, spread_tolerance: f64, edge: f64) -> Stop {
    match once(ledger, spread_tolerance, edge) {
        Stop::BySolver => once(ledger, spread_tolerance, edge),
        stop => stop,
    }
}

fn once(ledger: &Ledger<'_, '_, '_>, spread_tolerance: f64, edge: f64) -> Stop {
    let solver = NelderMead::new(simplex(&ledger.best().z, ledger.problem().bounds(), edge))
        .with_sd_tolerance(spread_tolerance.max(0.0))
        .expect("the tolerance is not negative");
    run_argmin(ledger, Objective::new(ledger, Outside::Infinite), solver, |s: SolverState<(), ()>| s)
}

/// A simplex with one corner at `from` and edges along the coordinates, towards the farther bound.
fn simplex(from: &[f64], bounds: &[(f64, f64)], edge: f64) -> Vec<Vec<f64>> {
    let corner = |i: usize| {
        let mut z = from.to_vec();
        let (lower, upper) = bounds[i];
        z[i] += if upper - z[i] > z[i] - lower { edge.min(upper - z[i]) } else { -edge.min(z[i] - lower) };
        z
    };
    std::iter::once(from.to_vec()).chain((0..from.len()).map(corner)).collect()
}
