//! Progress on standard error during long work.

use std::io::{self, IsTerminal, Read};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::console::Console;

/// Work that takes longer than this shows how far it has come.
const LONG: Duration = Duration::from_secs(2);

/// A spinner with the elapsed time. It shows on a terminal only, and disappears when dropped.
pub(crate) struct Progress {
    bar: Option<(ProgressBar, Instant)>,
    task: Mutex<Running>,
}

/// What is being done.
struct Running {
    task: String,
    done: usize,
    total: usize,
    since: Instant,
}

impl Running {
    fn new() -> Self {
        Self { task: String::new(), done: 0, total: 0, since: Instant::now() }
    }

    /// Takes a report. A task that begins anew, as each round of a search does, has its own time.
    fn go_on(&mut self, task: &str, done: usize, total: usize) {
        let begins_anew = done <= 1 && self.done > 1;
        if self.task != task || self.total != total || begins_anew {
            *self = Self { task: task.to_owned(), since: Instant::now(), ..Self::new() };
        }
        (self.done, self.total) = (done, total);
    }

    /// How far it has come after so long. A single piece of work has no count.
    fn message(&self, elapsed: Duration) -> String {
        let Self { task, done, total, .. } = self;
        if *total <= 1 {
            return task.clone();
        }
        let left = time_left(elapsed, *done, *total).map(|left| format!(", {} s left", left.as_secs().max(1)));
        format!("{task}: {done} of {total}{}", left.unwrap_or_default())
    }
}

impl Progress {
    pub(crate) fn start(console: Console, message: String) -> Self {
        if console.quiet {
            return Self::showing(None);
        }
        let style = ProgressStyle::with_template("{spinner} {msg} {elapsed}").expect("the template is well formed");
        let bar = ProgressBar::new_spinner().with_style(style).with_message(message);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self::showing(Some((bar, Instant::now())))
    }

    fn showing(bar: Option<(ProgressBar, Instant)>) -> Self {
        Self { bar, task: Mutex::new(Running::new()) }
    }

    /// How far a verb has come, with the time that is left of its task, once that has taken two seconds; it is never cancelled
    /// from here.
    pub(crate) fn watch(&self, task: &str, done: usize, total: usize) -> ControlFlow<()> {
        let mut running = self.task.lock().expect("no thread panics");
        running.go_on(task, done, total);
        self.say(|| running.message(running.since.elapsed()));
        ControlFlow::Continue(())
    }

    /// `reader`, of a file of so many bytes, whose reading is shown with the time that is left.
    pub(crate) fn reading<R: Read>(&self, reader: R, bytes: u64) -> impl Read {
        Counted { reader, progress: self, read: 0, bytes }
    }

    /// Shows how far the work has come, once it has taken two seconds.
    fn say(&self, message: impl Fn() -> String) {
        if let Some((bar, since)) = &self.bar
            && since.elapsed() > LONG
        {
            bar.set_message(message());
        }
    }
}

/// A bar for work that consists of many equal pieces, with the time left; hidden where the program is to be quiet, and where standard
/// error is no terminal.
pub(crate) fn bar(console: Console) -> ProgressBar {
    if console.quiet || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style =
        ProgressStyle::with_template("{msg} {bar:40} {percent:>3} %, {eta} left").expect("the template is well formed");
    ProgressBar::new(1).with_style(style)
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
        let [read_mib, all_mib] = [self.read, self.bytes].map(|bytes| (bytes >> 20) as usize);
        // Nobody is asked whether to go on.
        let _ = self.progress.watch("reading, MiB", read_mib, all_mib);
        Ok(read)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((bar, _)) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// The time that the rest of a task takes, if it goes on as it did; `None` before that can be said.
fn time_left(elapsed: Duration, done: usize, total: usize) -> Option<Duration> {
    let left = total.checked_sub(done).filter(|left| *left > 0 && done > 0 && elapsed > LONG)?;
    Some(elapsed.mul_f64(left as f64 / done as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_takes_as_long_as_what_was_done() {
        let after = |elapsed_s, done| time_left(Duration::from_secs(elapsed_s), done, 40);
        assert_eq!(after(30, 10), Some(Duration::from_secs(90)));
        assert_eq!([after(1, 10), after(30, 0), after(30, 40)], [None; 3]);
    }

    #[test]
    fn what_is_not_counted_has_no_count() {
        let said = |done, total| {
            let mut running = Running::new();
            running.go_on("windows", done, total);
            running.message(Duration::from_secs(30))
        };
        assert_eq!(said(10, 40), "windows: 10 of 40, 90 s left");
        assert_eq!(said(0, 1), "windows");
    }

    /// Failed: the second round of a search was as fast as both rounds together.
    #[test]
    fn each_round_has_its_own_time() {
        let mut running = Running::new();
        running.go_on("candidates", 40, 40);
        let first = running.since;
        running.go_on("candidates", 1, 40);
        assert!(running.since > first);
        let second = running.since;
        running.go_on("candidates", 2, 40);
        assert_eq!(running.since, second);
    }
}
