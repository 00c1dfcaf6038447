//! What is said of rows that are not as the start was, and of those that could not be used.

use twinlag::LiveAnswer;

use crate::console::Console;
use crate::print;

/// Number of warnings about bad rows that are printed one by one.
const MAX_WARNINGS: usize = 5;
/// Rows for which nothing is to be said before it is said again.
const QUIET_ROWS: u64 = 1000;
/// Rows in which a sensor gives no reading before that is said.
const SILENT_ROWS: u64 = 100;

/// Something that lasts: it is said when it begins, and again where it begins anew after [`QUIET_ROWS`] rows without it.
#[derive(Default)]
struct Lasting {
    is_said: bool,
    rows_without: u64,
}

impl Lasting {
    /// Whether it is to be said now.
    fn begins(&mut self, is_so: bool) -> bool {
        self.rows_without = if is_so { 0 } else { self.rows_without.saturating_add(1) };
        let begins = is_so && !self.is_said;
        self.is_said = is_so || (self.is_said && self.rows_without < QUIET_ROWS);
        begins
    }
}

/// What has been said of rows that are not as the start was.
#[derive(Default)]
pub(super) struct Alarms {
    beyond: Lasting,
    wider: Lasting,
    silent: [Lasting; 2],
    rows_unread: [u64; 2],
}

/// What is known once a row is read, and what the row was.
pub(super) struct Row<'a> {
    pub(super) now: &'a LiveAnswer,
    /// Time of the row before, s.
    pub(super) last_s: f64,
    pub(super) line: usize,
    pub(super) channels: [&'a str; 2],
    /// Which of them gave a reading.
    pub(super) is_read: [bool; 2],
}

impl Alarms {
    /// Says what is new in a row: of a pause each time, of what lasts where it begins.
    pub(super) fn say(&mut self, row: &Row<'_>, console: Console) {
        let Row { now, last_s, line, channels, is_read } = *row;
        let time_s = || print::digits(now.time_s, 6);
        if now.is_resumed {
            let [before, after] = [last_s, now.time_s].map(to_nanosecond);
            console.note(|| {
                format!(
                    "warning: line {line}: the clock goes on from {after} s after {before} s, as after a pause or where it was set"
                )
            });
        }
        if self.beyond.begins(now.is_beyond) {
            console.note(|| {
                format!(
                    "warning: at {} s the time constants may have left the range that is tracked, 0.4 to 2.5 times their \
                     values at the start: restart from there",
                    time_s()
                )
            });
        }
        if self.wider.begins(now.widened_by > 1.0) {
            console.note(|| {
                format!(
                    "warning: at {} s the readings deviate from their predictions {:.1} times as far as expected: the gas \
                     or a sensor has changed since the start; while this lasts the bands are widened, and time constants \
                     that are no longer determined are left empty",
                    time_s(),
                    now.widened_by
                )
            });
        }
        for i in 0..2 {
            self.rows_unread[i] = if is_read[i] { 0 } else { self.rows_unread[i].saturating_add(1) };
            if self.silent[i].begins(self.rows_unread[i] >= SILENT_ROWS) {
                let [channel, other] = [channels[i], channels[1 - i]];
                console.note(|| {
                    format!(
                        "warning: at {} s {channel} has given no reading for {SILENT_ROWS} rows; while this lasts the gas \
                         temperature is that of {other} alone, and time constants are not followed",
                        time_s()
                    )
                });
            }
        }
    }
}

/// The last bits are of the conversion to seconds.
pub(super) fn to_nanosecond(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}

/// Count of the rows that could not be used.
#[derive(Default)]
pub(super) struct Bad {
    count: usize,
}

impl Bad {
    pub(super) fn say(&mut self, what: &impl ToString, console: Console) {
        self.count += 1;
        if self.count <= MAX_WARNINGS {
            console.note(|| format!("warning: {}", what.to_string()));
        }
    }

    pub(super) fn sum(&self, console: Console) {
        if self.count > MAX_WARNINGS {
            console.note(|| format!("warning: {} rows could not be used", self.count));
        }
    }
}
