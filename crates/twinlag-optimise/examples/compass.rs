//! A solver of one's own behind the trait [`Minimiser`]: compass search.
//!
//! `cargo run -p twinlag-optimise --example compass`

use twinlag_optimise::{Budget, Cost, End, Evaluations, Fit, Minimiser, Problem, ProblemError, Variable};

// ANCHOR: solver
/// Compass search: a step each way along each coordinate; halve the step when none helps.
struct Compass {
    smallest_step: f64,
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

/// `(ln(x/3))² + (y − 1)²`, values only.
struct Bowl;

impl Cost for Bowl {
    fn value(&self, x: &[f64]) -> f64 {
        (x[0] / 3.0).ln().powi(2) + (x[1] - 1.0).powi(2)
    }
}

fn main() -> Result<(), ProblemError> {
    let variables = vec![Variable::logarithmic("x", 1e-3, 1e3), Variable::linear("y", 1.0, -10.0, 10.0)];
    let problem = Problem::new(&Bowl, variables)?;
    let fit = Compass { smallest_step: 1e-9 }.minimise(&problem, &[100.0, -4.0], &Budget::default())?;
    println!("{fit:#?}");
    assert_eq!(fit.end, End::Unchecked); // the cost has no derivatives to check the end with
    assert!((fit.x[0] - 3.0).abs() < 1e-6 && (fit.x[1] - 1.0).abs() < 1e-6);
    Ok(())
}
