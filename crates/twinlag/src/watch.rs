//! Progress of a verb, and the wish to stop it.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::Error;

pub use twinlag_model::Watch;

/// Nobody watches, and nothing is cancelled.
pub(crate) const UNWATCHED: Watch<'static> = &|_, _, _| ControlFlow::Continue(());

/// A watch that remembers the wish to stop, for layers that only report.
pub(crate) struct Stop<'a> {
    watch: Watch<'a>,
    is_wanted: AtomicBool,
}

impl<'a> Stop<'a> {
    pub(crate) fn new(watch: Watch<'a>) -> Self {
        Self { watch, is_wanted: AtomicBool::new(false) }
    }

    /// Reports progress.
    pub(crate) fn say(&self, task: &str, done: usize, total: usize) {
        if !self.is_wanted() && (self.watch)(task, done, total).is_break() {
            self.is_wanted.store(true, Ordering::Relaxed);
        }
    }

    /// Whether the watch has asked to stop.
    pub(crate) fn is_wanted(&self) -> bool {
        self.is_wanted.load(Ordering::Relaxed)
    }

    /// Ends the verb where that was asked for.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.is_wanted() { Err(Error::Cancelled) } else { Ok(()) }
    }
}
