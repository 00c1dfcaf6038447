//! The minimum of any smooth cost within bounds, with a report on how the fit ended.
//!
//! This crate is for anyone with a cost of a few variables who wants to swap solvers by name, keep
//! bounds, and learn when a result is not a minimum because it lies on a bound or a plateau, or
//! because the budget was spent. The crate knows nothing of thermocouples: the costs are in
//! `twinlag-cross-relation`, their use on records in `twinlag`.
//!
//! The solvers are those of [argmin](https://argmin-rs.org), and a bounded Levenberg-Marquardt of
//! our own; argmin itself does not appear in this crate's signatures. [`Optimiser`] lists them:
//! local solvers that use derivatives or values, global solvers that search the whole of the
//! bounds, and one for a single variable. To add another, implement [`Minimiser`]. To watch a fit,
//! use [`Minimiser::minimise_observed`].
//!
//! ```
//! use twinlag_optimise::{Budget, Cost, Derivatives, End, Minimiser, Optimiser, Problem, Variable};
//!
//! /// `(ln(x/3))² + (y − 1)²`, with its derivatives.
//! struct Bowl;
//!
//! impl Cost for Bowl {
//!     fn value(&self, x: &[f64]) -> f64 {
//!         (x[0] / 3.0).ln().powi(2) + (x[1] - 1.0).powi(2)
//!     }
//!
//!     fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
//!         let l = (x[0] / 3.0).ln();
//!         Some(Derivatives {
//!             value: self.value(x),
//!             gradient: vec![2.0 * l / x[0], 2.0 * (x[1] - 1.0)],
//!             curvature: vec![vec![2.0 * (1.0 - l) / (x[0] * x[0]), 0.0], vec![0.0, 2.0]],
//!         })
//!     }
//! }
//!
//! let variables = vec![Variable::logarithmic("x", 1e-3, 1e3), Variable::linear("y", 1.0, -10.0, 10.0)];
//! let problem = Problem::new(&Bowl, variables)?;
//! for name in Optimiser::NAMES {
//!     let fit = Optimiser::by_name(name)?.minimise(&problem, &[100.0, -4.0], &Budget::default())?;
//!     assert_eq!(fit.end, End::Converged);
//!     assert!((fit.x[0] - 3.0).abs() < 1e-5 && (fit.x[1] - 1.0).abs() < 1e-5);
//! }
//! # Ok::<(), twinlag_optimise::ProblemError>(())
//! ```

mod adapter;
mod assess;
mod cholesky;
mod ledger;
mod minimiser;
mod multi_start;
mod optimiser;
mod problem;
mod report;
mod solvers;

pub use minimiser::Minimiser;
pub use multi_start::MultiStart;
pub use optimiser::Optimiser;
pub use problem::{Cost, Derivatives, Problem, ProblemError, Scale, Variable};
pub use report::{Budget, End, Evaluations, Fit, Progress};

/// What a solver is asked and what it reports may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(Budget, Derivatives, End, Fit, MultiStart, Optimiser, ProblemError, Progress, Variable)>();
};
