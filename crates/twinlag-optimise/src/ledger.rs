//! The account of a fit so far, and the one place through which every solver reaches the cost.
//!
//! Every call of the cost passes here, is counted as the cost sees it, and is refused once the
//! budget is spent. The best point is kept here too, so it survives any failure of the solver.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use crate::problem::{Derivatives, NoDerivatives, Problem};
use crate::report::{Budget, Evaluations, Progress};

/// How a run of a solver stopped, before anyone has looked at where.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    BySolver,
    Exhausted,
    Failed(String),
}

/// The lowest point that was evaluated.
#[derive(Clone, Debug)]
pub(crate) struct Best {
    pub(crate) z: Vec<f64>,
    pub(crate) value: f64,
    /// If it was evaluated with derivatives.
    pub(crate) derivatives: Option<Rc<Derivatives>>,
}

/// The evaluation budget ran out: not a failure of the solver, and it must not be taken for one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("evaluation budget exhausted")]
pub(crate) struct Exhausted;

/// Why there are no derivatives at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Refusal {
    #[error(transparent)]
    Exhausted(#[from] Exhausted),
    #[error(transparent)]
    None(#[from] NoDerivatives),
}

/// The observer of a fit.
pub(crate) type Observer<'o> = &'o mut dyn FnMut(&Progress);

/// The account of one fit.
pub(crate) struct Ledger<'p, 'c, 'o> {
    problem: &'p Problem<'c>,
    budget: Budget,
    counts: Cell<Evaluations>,
    iterations: Cell<u64>,
    /// Whether something was asked for after the budget was spent: solvers may hide the refusal in
    /// an error of their own.
    refused: Cell<bool>,
    best: RefCell<Best>,
    observer: Option<RefCell<Observer<'o>>>,
}

impl<'p, 'c, 'o> Ledger<'p, 'c, 'o> {
    /// An empty account: nothing is known of `start`, not even its value.
    pub(crate) fn new(
        problem: &'p Problem<'c>,
        start: Vec<f64>,
        budget: &Budget,
        observer: Option<Observer<'o>>,
    ) -> Self {
        Self {
            problem,
            // Without its value at the start there is no fit to report on.
            budget: Budget { evaluations: budget.evaluations.max(1), ..*budget },
            counts: Cell::default(),
            iterations: Cell::default(),
            refused: Cell::default(),
            best: RefCell::new(Best { z: start, value: f64::INFINITY, derivatives: None }),
            observer: observer.map(RefCell::new),
        }
    }

    pub(crate) fn problem(&self) -> &'p Problem<'c> {
        self.problem
    }

    pub(crate) fn best(&self) -> Best {
        self.best.borrow().clone()
    }

    pub(crate) fn evaluations(&self) -> Evaluations {
        self.counts.get()
    }

    pub(crate) fn iterations(&self) -> u64 {
        self.iterations.get()
    }

    /// Whether a solver has to stop now.
    pub(crate) fn is_spent(&self) -> bool {
        self.was_refused() || self.iterations.get() >= self.budget.iterations
    }

    /// Whether an evaluation was asked for that the budget did not have.
    pub(crate) fn was_refused(&self) -> bool {
        self.refused.get()
    }

    /// The cost at `z`, which lies inside the bounds.
    pub(crate) fn value(&self, z: &[f64]) -> Result<f64, Exhausted> {
        self.count(|c| c.values += 1)?;
        let value = self.problem.value_at(z);
        self.keep(z, value, None);
        Ok(value)
    }

    /// Value, gradient and curvature at `z`, which lies inside the bounds, from one evaluation.
    pub(crate) fn derivatives(&self, z: &[f64]) -> Result<Rc<Derivatives>, Refusal> {
        self.count(|c| c.derivatives += 1)?;
        let d = Rc::new(self.problem.look_at(z)?);
        self.keep(z, d.value, Some(&d));
        Ok(d)
    }

    /// Notes that an iteration begins.
    pub(crate) fn count_iteration(&self) {
        self.iterations.set(self.iterations.get() + 1);
    }

    /// Reports to the observer how far the fit has come.
    pub(crate) fn report(&self) {
        if let Some(observer) = &self.observer {
            let best = self.best.borrow();
            let progress = Progress {
                iteration: self.iterations.get(),
                evaluations: self.counts.get(),
                x: self.problem.point(&best.z),
                value: best.value,
            };
            (observer.borrow_mut())(&progress);
        }
    }

    fn count(&self, add: impl FnOnce(&mut Evaluations)) -> Result<(), Exhausted> {
        let mut counts = self.counts.get();
        if counts.values + counts.derivatives >= self.budget.evaluations {
            self.refused.set(true);
            return Err(Exhausted);
        }
        add(&mut counts);
        self.counts.set(counts);
        Ok(())
    }

    fn keep(&self, z: &[f64], value: f64, derivatives: Option<&Rc<Derivatives>>) {
        let mut best = self.best.borrow_mut();
        if value < best.value {
            best.z.copy_from_slice(z);
            best.value = value;
            best.derivatives = derivatives.cloned();
        } else if best.derivatives.is_none() && best.z == z {
            // A second look at the best point, this time with derivatives.
            best.derivatives = derivatives.cloned();
        }
    }
}
