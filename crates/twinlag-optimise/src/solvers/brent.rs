//! Brent's search for the minimum in one variable, argmin's, between its bounds. It searches the
//! whole interval; the start is only one candidate. It never evaluates the ends of the interval, so
//! the end nearer to where it stopped is evaluated here, which finds a minimum on a bound exactly.

use argmin::core::{CostFunction, Error, IterState};
use argmin::solver::brent::BrentOpt;

use crate::adapter::{Objective, Outside, run as run_argmin};
use crate::ledger::{Ledger, Stop};

/// Stands in for an infinite value: the parabola through three points has to be one of numbers, or
/// the search is lost.
const VERY_HIGH: f64 = 1e100;

/// Searches until the minimum is known to `step_tolerance`, or to the square root of the rounding
/// of its coordinate.
pub(crate) fn run(ledger: &Ledger<'_, '_, '_>, step_tolerance: f64) -> Stop {
    let (lower, upper) = ledger.problem().bounds()[0];
    let solver = BrentOpt::new(lower, upper).set_tolerance(f64::EPSILON.sqrt(), step_tolerance);
    let line = Line(Objective::new(ledger, Outside::Infinite));
    match run_argmin(ledger, line, solver, |s: IterState<f64, (), (), (), (), f64>| s) {
        Stop::BySolver => {
            let z = ledger.best().z[0];
            match ledger.value(&[if z - lower < upper - z { lower } else { upper }]) {
                Ok(_) => Stop::BySolver,
                Err(_) => Stop::Exhausted,
            }
        }
        stop => stop,
    }
}

/// A problem of one variable, as a function of a number.
struct Line<'l, 'p, 'c, 'o>(Objective<'l, 'p, 'c, 'o>);

impl CostFunction for Line<'_, '_, '_, '_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, z: &f64) -> Result<f64, Error> {
        Ok(self.0.cost(&vec![*z])?.min(VERY_HIGH))
    }
}
