//! Long work beside an interpreter: its lock is free, Ctrl-C stops the work, and progress is reported.

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use twinlag::{Error, Watch};

use crate::error::of_verb;

/// Between two looks at signals and progress: short beside a person's reaction, long beside a look. Chosen.
const TICK: Duration = Duration::from_millis(50);

/// Task, steps done, steps in all.
type Step = (String, usize, usize);

/// Runs `work` in a thread of its own. This one looks after signals, and calls `progress` with the latest step.
///
/// # Errors
/// Those of the work; what a signal handler or `progress` raises, when the work has stopped.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Watch<'_>) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let is_stopped = AtomicBool::new(false);
    let latest: Mutex<Option<Step>> = Mutex::new(None);
    let watch = |task: &str, done: usize, total: usize| {
        *latest.lock().unwrap_or_else(PoisonError::into_inner) = Some((task.to_owned(), done, total));
        if is_stopped.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let look = || -> PyResult<()> {
        py.check_signals()?;
        let step = latest.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some((progress, step)) = progress.zip(step) {
            progress.call1(step)?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let (sender, mut receiver) = sync_channel(1);
        let worker = scope.spawn(|| {
            let sender = sender;
            // The other end waits for it.
            let _ = sender.send(work(&watch));
        });
        let mut raised = None;
        loop {
            let waiting = &mut receiver;
            match py.detach(move || waiting.recv_timeout(TICK)) {
                Ok(result) => {
                    let result = raised.map_or(result.map_err(|error| of_verb(&error)), Err);
                    return result.and_then(|answer| look().map(|()| answer));
                }
                Err(RecvTimeoutError::Timeout) => {
                    if raised.is_none()
                        && let Err(error) = look()
                    {
                        is_stopped.store(true, Ordering::Relaxed);
                        raised = Some(error);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => match worker.join() {
                    Err(panic) => resume_unwind(panic),
                    Ok(()) => unreachable!("the worker sends before it ends"),
                },
            }
        }
    })
}
