//! A sign of life on standard error while something takes long.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::arguments::Talk;

/// A spinner with elapsed time that shows only on a terminal, and goes without a trace when dropped.
pub(crate) struct Progress(Option<ProgressBar>);

impl Progress {
    pub(crate) fn start(talk: Talk, message: String) -> Self {
        if talk.quiet {
            return Self(None);
        }
        let style = ProgressStyle::with_template("{spinner} {msg} {elapsed}").expect("the template is well formed");
        let bar = ProgressBar::new_spinner().with_style(style).with_message(message);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(Some(bar))
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}
