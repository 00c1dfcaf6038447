//! Progress on standard error during long work.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::console::Console;

/// Work that takes longer than this shows how far it has come.
const LONG: Duration = Duration::from_secs(2);

/// A spinner with the elapsed time. It shows on a terminal only, and disappears when dropped.
pub(crate) struct Progress(Option<(ProgressBar, Instant)>);

impl Progress {
    pub(crate) fn start(console: Console, message: String) -> Self {
        if console.quiet {
            return Self(None);
        }
        let style = ProgressStyle::with_template("{spinner} {msg} {elapsed}").expect("the template is well formed");
        let bar = ProgressBar::new_spinner().with_style(style).with_message(message);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(Some((bar, Instant::now())))
    }

    /// How far a verb has come; it is never cancelled from here.
    pub(crate) fn watch(&self, task: &str, done: usize, total: usize) -> ControlFlow<()> {
        self.say(|| format!("{task}: {done} of {total}"));
        ControlFlow::Continue(())
    }

    /// Shows how far the work has come, once it has taken two seconds.
    fn say(&self, message: impl Fn() -> String) {
        if let Some((bar, since)) = &self.0
            && since.elapsed() > LONG
        {
            bar.set_message(message());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((bar, _)) = &self.0 {
            bar.finish_and_clear();
        }
    }
}
