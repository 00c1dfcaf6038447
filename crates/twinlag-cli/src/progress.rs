//! A sign of life on standard error while something takes long.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::arguments::Talk;

/// What takes longer says how far it is.
const LONG: Duration = Duration::from_secs(2);

/// A spinner with elapsed time that shows only on a terminal, and goes without a trace when dropped.
pub(crate) struct Progress(Option<(ProgressBar, Instant)>);

impl Progress {
    pub(crate) fn start(talk: Talk, message: String) -> Self {
        if talk.quiet {
            return Self(None);
        }
        let style = ProgressStyle::with_template("{spinner} {msg} {elapsed}").expect("the template is well formed");
        let bar = ProgressBar::new_spinner().with_style(style).with_message(message);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(Some((bar, Instant::now())))
    }

    /// How far it is, once it has taken two seconds.
    pub(crate) fn say(&self, message: impl Fn() -> String) {
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
