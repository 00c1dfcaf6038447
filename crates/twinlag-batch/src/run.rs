//! Units on all cores.
//!
//! Each thread takes one unit after the other and works on it alone, so that no more records are in memory than there are threads.
//! Rows go into the journal as they come; the table is made in the order of the units.

use std::any::Any;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread;

use rayon::ThreadPoolBuilder;

use crate::error::BatchError;
use crate::group::Unit;
use crate::journal::{Journal, Seen};
use crate::outcome::Outcome;
use crate::row::Row;

/// Threads for each processor, at most; chosen, since more of them wait for each other, and each holds a record.
const MAX_THREADS_PER_PROCESSOR: usize = 4;

/// How far a batch is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Units done, those of earlier runs included.
    pub done: usize,
    /// Units of the batch.
    pub total: usize,
}

/// Asks `work` of every unit that is not done, and puts its rows into the journal. A unit on which it panics has a row that says so.
///
/// - `threads`: how many units are worked on at once, `None` for one for each processor; no cell depends on it. With fewer units than
///   threads, the others help within the units
/// - `progress`: called before the first unit and after each that is in the journal; if it breaks, no further unit is begun
///
/// # Errors
/// [`BatchError::Write`]; what was done before is in the journal.
pub fn run(
    units: &[Unit],
    journal: &mut Journal,
    threads: Option<NonZeroUsize>,
    work: impl Fn(&Unit) -> Vec<Row> + Sync,
    mut progress: impl FnMut(Progress) -> ControlFlow<()>,
) -> Result<(), BatchError> {
    let open: Vec<&Unit> = units.iter().filter(|unit| !journal.is_done(unit)).collect();
    let mut state = Progress { done: units.len() - open.len(), total: units.len() };
    if progress(state).is_break() {
        return Ok(());
    }
    let mut result = Ok(());
    let answer = |unit: &&Unit| {
        let seen = Seen::now(unit);
        let rows = match unit {
            Unit::WithoutRig { file, reason } => vec![Row::without_answer(unit, file, Outcome::Unusable, reason)],
            unit => catch_unwind(AssertUnwindSafe(|| work(unit))).unwrap_or_else(|panic| panicked(unit, &*panic)),
        };
        (seen, rows)
    };
    in_order_of_arrival(&open, threads, answer, |unit, (seen, rows)| {
        result = journal.append(unit, seen, &rows);
        state.done += 1;
        result.is_ok() && progress(state).is_continue()
    });
    result
}

/// What `work` returns for every item, in their order, computed in parallel.
///
/// - `threads`: how many items are worked on at once, `None` for one for each processor
///
/// # Panics
/// If `work` does.
pub fn map<Item: Sync, Out: Send>(
    items: &[Item],
    threads: Option<NonZeroUsize>,
    work: impl Fn(&Item) -> Out + Sync,
    mut progress: impl FnMut(Progress),
) -> Vec<Out> {
    let places: Vec<usize> = (0..items.len()).collect();
    let mut outs: Vec<Option<Out>> = items.iter().map(|_| None).collect();
    let mut done = 0;
    in_order_of_arrival(
        &places,
        threads,
        |place| work(&items[*place]),
        |place, out| {
            outs[*place] = Some(out);
            done += 1;
            progress(Progress { done, total: items.len() });
            true
        },
    );
    outs.into_iter().map(|out| out.expect("each item has been worked on")).collect()
}

/// `work` on every item, on so many threads; `take` gets each result as it comes, on the calling thread, until it wants no more.
fn in_order_of_arrival<Item: Sync, Out: Send>(
    items: &[Item],
    threads: Option<NonZeroUsize>,
    work: impl Fn(&Item) -> Out + Sync,
    mut take: impl FnMut(&Item, Out) -> bool,
) {
    let processors = thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let threads = threads.unwrap_or(processors).get().min(MAX_THREADS_PER_PROCESSOR * processors.get());
    let workers = threads.min(items.len());
    let within = threads.checked_div(workers).unwrap_or(1);
    let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
    thread::scope(|scope| {
        let (sender, receiver) = sync_channel(workers);
        for _ in 0..workers {
            let sender = sender.clone();
            let (next, is_over, work) = (&next, &is_over, &work);
            scope.spawn(move || {
                // What is parallel within a unit stays in it: otherwise a waiting thread would begin another unit and hold the records
                // of both.
                let pool = ThreadPoolBuilder::new().num_threads(within).build().ok();
                while !is_over.load(Ordering::Relaxed) {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(place) else { break };
                    let out = pool.as_ref().map_or_else(|| work(item), |pool| pool.install(|| work(item)));
                    if sender.send((place, out)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (place, out) in receiver {
            if !take(&items[place], out) {
                is_over.store(true, Ordering::Relaxed);
                break;
            }
        }
    });
}

/// The row of a unit on which the work panicked.
fn panicked(unit: &Unit, panic: &(dyn Any + Send)) -> Vec<Row> {
    let message = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    let reason = format!("a fault of the program: {}", message.unwrap_or("it panicked without a message"));
    vec![match unit {
        Unit::Rig { name, .. } => Row::rig_without_answer(name, 0, Outcome::Failed, &reason),
        Unit::Record(file) | Unit::WithoutRig { file, .. } => Row::without_answer(unit, file, Outcome::Failed, &reason),
    }]
}
