//! Progress on standard error during long work.

use std::io::{self, Read};
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

    /// `reader`, of a file of so many bytes, whose reading is shown with the time that is left.
    pub(crate) fn reading<R: Read>(&self, reader: R, bytes: u64) -> impl Read {
        Counted { reader, progress: self, read: 0, bytes }
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

/// Counts what is read.
struct Counted<'a, R> {
    reader: R,
    progress: &'a Progress,
    read: u64,
    bytes: u64,
}

impl<R: Read> Read for Counted<'_, R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let read = self.reader.read(to)?;
        self.read += read as u64;
        if let Some((_, since)) = &self.progress.0 {
            let share = (self.read as f64 / self.bytes.max(1) as f64).min(1.0);
            let left_s = since.elapsed().as_secs_f64() * (1.0 - share) / share.max(f64::MIN_POSITIVE);
            self.progress.say(|| format!("reading: {:.0} %, {left_s:.0} s left,", 100.0 * share));
        }
        Ok(read)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((bar, _)) = &self.0 {
            bar.finish_and_clear();
        }
    }
}
