//! BFGS with the whole matrix and with limited memory, argmin's, with the Moré-Thuente line search.

use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::{BFGS, LBFGS};

use crate::adapter::{Objective, Outside, SolverState, run as run_argmin};
use crate::ledger::{Ledger, Stop};

/// BFGS with the whole inverse Hessian, which starts as the identity, since coordinates and values
/// are of size one.
pub(crate) fn bfgs(ledger: &Ledger<'_, '_, '_>, gradient_tolerance: f64) -> Stop {
    let z = ledger.best().z;
    let identity = (0..z.len()).map(|i| (0..z.len()).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let solver = BFGS::new(MoreThuenteLineSearch::new())
        .with_tolerance_grad(gradient_tolerance.max(0.0))
        .and_then(|s| s.with_tolerance_cost(0.0))
        .expect("the tolerances are not negative");
    run_argmin(ledger, Objective::new(ledger, Outside::Wall), solver, |s: SolverState<Vec<f64>, Vec<Vec<f64>>>| {
        s.param(z).inv_hessian(identity)
    })
}

/// L-BFGS, with the last `memory` steps in place of the inverse Hessian.
pub(crate) fn l_bfgs(ledger: &Ledger<'_, '_, '_>, memory: usize, gradient_tolerance: f64) -> Stop {
    let z = ledger.best().z;
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), memory)
        .with_tolerance_grad(gradient_tolerance.max(0.0))
        .and_then(|s| s.with_tolerance_cost(0.0))
        .expect("the tolerances are not negative");
    run_argmin(ledger, Objective::new(ledger, Outside::Wall), solver, |s: SolverState<Vec<f64>, ()>| s.param(z))
}
