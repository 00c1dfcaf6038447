//! A local search after a global one: a swarm or a random walk comes near a minimum, and no nearer.

use crate::ledger::{Ledger, Refusal, Stop};
use crate::solvers::{levenberg_marquardt, nelder_mead};

/// Levenberg-Marquardt from the best point so far, or the simplex where the cost has no derivatives
/// there.
pub(crate) fn run(ledger: &Ledger<'_, '_, '_>) -> Stop {
    match ledger.derivatives(&ledger.best().z) {
        Ok(_) => levenberg_marquardt::run(ledger, 1e-9),
        Err(Refusal::None(_)) => nelder_mead::run(ledger, 1e-14, 0.1),
        Err(Refusal::Exhausted(_)) => Stop::Exhausted,
    }
}
