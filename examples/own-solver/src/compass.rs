//! Compass search: the simplest solver that there is, and a complete one.

use twinlag_optimise::{Budget, End, Evaluations, Fit, Minimiser, Problem, ProblemError};

// ANCHOR: solver
/// Compass search: a step each way along each coordinate; halve the step when none helps.
pub(crate) struct Compass {
    pub(crate) smallest_step: f64,
}

impl Minimiser for Compass {
    fn name(&self) -> String {
        "compass".into()
    }

    fn minimise(&self, problem: &Problem<'_>, start: &[f64], budget: &Budget) -> Result<Fit, ProblemError> {
        let mut z = problem.coordinates(start)?;
        let bounds = problem.bounds();
        let mut value = problem.value_at(&z);
        let mut evaluations = Evaluations { values: 1, derivatives: 0 };
        let (mut step, mut iterations, mut limited) = (1.0, 0, false);
        'search: while step > self.smallest_step {
            if iterations == budget.iterations {
                limited = true;
                break;
            }
            iterations += 1;
            let before = value;
            for i in 0..z.len() {
                for sign in [1.0, -1.0] {
                    if evaluations.values == budget.evaluations {
                        limited = true;
                        break 'search;
                    }
                    let mut trial = z.clone();
                    trial[i] = (z[i] + sign * step).clamp(bounds[i].0, bounds[i].1);
                    evaluations.values += 1;
                    let at_trial = problem.value_at(&trial);
                    if at_trial < value {
                        (z, value) = (trial, at_trial);
                        break;
                    }
                }
            }
            if value == before {
                step *= 0.5;
            }
        }
        let end = if limited { End::LimitReached } else { problem.assess(&z, None) };
        evaluations.derivatives += u64::from(!limited);
        Ok(Fit {
            optimiser: self.name(),
            start: start.to_vec(),
            x: problem.point(&z),
            value,
            end,
            iterations,
            evaluations,
        })
    }
}
// ANCHOR_END: solver
