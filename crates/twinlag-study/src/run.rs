//! Running a study, or a shard of it, on threads.
//!
//! The blocks still to be computed form one queue, cell after cell, from which threads take the
//! next. The calling thread merges what they send, reports progress and writes the part.

use std::any::Any;
use std::num::NonZeroUsize;
use std::ops::{ControlFlow, Range};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::error::StudyError;
use crate::lock::Lock;
use crate::part::{Header, Part};
use crate::shard::Shard;
use crate::study::{Failure, Outcome, Study};
use crate::tally::Tally;

/// The longest time without a report of progress while trials run.
const TICK: Duration = Duration::from_millis(100);

/// Most threads that are started; chosen: more than any machine has processors.
const MAX_THREADS: usize = 1 << 12;

/// How to run a study. Nothing here changes a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How many threads run trials; by default one for each processor.
    pub threads: NonZeroUsize,
    /// Which part of the study to run; by default all of it.
    pub shard: Shard,
    /// Where to keep what there is so far; by default nowhere. At the end it is the shard's result.
    pub checkpoint: Option<PathBuf>,
    /// Whether to go on from the checkpoint if there is one. Without, an existing one is an error.
    pub resume: bool,
    /// How long to wait between checkpoints; by default five seconds.
    pub every: Duration,
    /// The program that runs it, by its version and commit; by default empty. It is kept in each part, and parts of different programs
    /// are not joined; the result does not hold it.
    pub program: String,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            threads: thread::available_parallelism().unwrap_or(NonZeroUsize::MIN),
            shard: Shard::WHOLE,
            checkpoint: None,
            resume: false,
            every: Duration::from_secs(5),
            program: String::new(),
        }
    }
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Trials done, those of earlier runs included.
    pub done: u64,
    /// Trials of this shard.
    pub total: u64,
    /// Trials that earlier runs had done.
    pub restored: u64,
    /// Time since this run began.
    pub elapsed: Duration,
}

/// Runs what is missing of a shard of a study.
///
/// `progress` is called on the calling thread, after each block and ten times a second at least; if
/// it breaks, threads stop after the trial in hand, their unfinished blocks are dropped, and the
/// part comes back as far as it is. See [`Part::is_complete`].
///
/// # Errors
/// [`StudyError::Trial`] or [`StudyError::Scratch`], the first in order of the blocks, on any
/// number of threads; what was done is in the checkpoint. [`StudyError::Busy`], [`StudyError::Exists`],
/// [`StudyError::OtherStudy`], [`StudyError::Damaged`] before anything is run.
/// [`StudyError::Write`]. [`StudyError::Empty`], [`StudyError::TooLarge`], [`StudyError::SameName`]
/// for an invalid study.
pub fn run<S: Study>(
    study: &S,
    options: &Options,
    mut progress: impl FnMut(Progress) -> ControlFlow<()>,
) -> Result<Part, StudyError> {
    let started = Instant::now();
    let header = Header::of(study)?;
    // Held until the part is written.
    let _lock = options.checkpoint.as_deref().map(Lock::of).transpose()?;
    let mut part = open(&header, options)?;
    let queue = Queue::new(&part);
    let own = options.shard.range(header.jobs());
    let total = own.map(|job| header.job_trials(job)).sum();
    let restored = total - queue.ranges.iter().cloned().flatten().map(|job| header.job_trials(job)).sum::<u64>();
    let mut state = Progress { done: restored, total, restored, elapsed: started.elapsed() };

    // Jobs from here on are not to be worked on: 0 stops all, and a job that failed stops those
    // after it. Those before it go on, so that the error reported is the first whatever the number
    // of threads.
    let fence = AtomicU64::new(u64::MAX);
    let (mut failed, mut unwritten) = (None::<(u64, StudyError)>, None);
    thread::scope(|scope| {
        let workers = options.threads.get().min(MAX_THREADS).min(queue.len().try_into().unwrap_or(usize::MAX));
        let (sender, receiver): (_, Receiver<Report>) = sync_channel(workers);
        for _ in 0..workers {
            let sender = sender.clone();
            scope.spawn(|| work(study, &header, &queue, &fence, sender));
        }
        drop(sender);
        let (mut saved, mut unsaved) = (Instant::now(), false);
        loop {
            match receiver.recv_timeout(TICK) {
                Ok((job, Ok(tally))) => {
                    state.done += tally.trials();
                    part.insert(job, tally);
                    unsaved = true;
                }
                Ok((job, Err(error))) => {
                    if failed.as_ref().is_none_or(|(first, _)| job < *first) {
                        failed = Some((job, error));
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            state.elapsed = started.elapsed();
            if progress(state).is_break() {
                fence.store(0, Ordering::Relaxed);
            }
            if let Some(path) = &options.checkpoint
                && unsaved
                && saved.elapsed() >= options.every
            {
                if let Err(error) = part.write(path) {
                    fence.store(0, Ordering::Relaxed);
                    unwritten = Some(error);
                }
                (saved, unsaved) = (Instant::now(), false);
            }
        }
        if let (Some(path), true) = (&options.checkpoint, unsaved) {
            unwritten = part.write(path).err().or(unwritten.take());
        }
    });
    match failed.map(|(_, error)| error).or(unwritten) {
        Some(error) => Err(error),
        None => Ok(part),
    }
}

/// Runs one trial again, for a closer look.
///
/// # Errors
/// [`StudyError::Trial`], [`StudyError::Scratch`]. Panics are passed on.
pub fn replay<S: Study>(study: &S, cell: usize, trial: u64) -> Result<Outcome, StudyError> {
    let mut scratch = study.scratch(cell).map_err(|cause| StudyError::Scratch { cell, cause })?;
    let mut outcome = Outcome::new(&study.quantities(cell));
    match study.trial(cell, trial, &mut scratch, &mut outcome) {
        Ok(()) => Ok(outcome),
        Err(cause) => Err(StudyError::Trial { cell, trial, cause }),
    }
}

/// The part to go on from.
fn open(header: &Header, options: &Options) -> Result<Part, StudyError> {
    let part = Part::empty(header.clone(), options.shard, &options.program);
    let Some(path) = &options.checkpoint else { return Ok(part) };
    match (path.try_exists(), options.resume) {
        (Err(cause), _) => Err(StudyError::Read { path: path.clone(), cause }),
        (Ok(true), false) => Err(StudyError::Exists { path: path.clone() }),
        (Ok(true), true) => part.read_same(path),
        // Written at once, so that a directory that cannot be written to shows before the work is
        // done.
        (Ok(false), _) => part.write(path).map(|()| part),
    }
}

/// What a thread sends: a block's tally, or why there is none.
type Report = (u64, Result<Tally, StudyError>);

/// Jobs to be done, in order.
struct Queue {
    ranges: Vec<Range<u64>>,
    taken: AtomicU64,
}

impl Queue {
    fn new(part: &Part) -> Self {
        let blocks = part.header().blocks();
        let ranges = part.missing().into_iter().map(|gap| {
            let first = gap.cell as u64 * blocks;
            first + gap.blocks.start..first + gap.blocks.end
        });
        Self { ranges: ranges.collect(), taken: AtomicU64::new(0) }
    }

    fn len(&self) -> u64 {
        self.ranges.iter().map(|range| range.end - range.start).sum()
    }

    /// The next job that nobody has taken.
    fn take(&self) -> Option<u64> {
        let mut place = self.taken.fetch_add(1, Ordering::Relaxed);
        for range in &self.ranges {
            let length = range.end - range.start;
            if place < length {
                return Some(range.start + place);
            }
            place -= length;
        }
        None
    }
}

#[expect(clippy::needless_pass_by_value, reason = "the channel closes when the last thread drops its sender")]
fn work<S: Study>(study: &S, header: &Header, queue: &Queue, fence: &AtomicU64, sender: SyncSender<Report>) {
    let mut bench = None;
    while let Some(job) = queue.take() {
        let report = match block(study, header, job, fence, &mut bench) {
            Ok(Some(tally)) => Ok(tally),
            Ok(None) => return,
            Err(error) => {
                fence.fetch_min(job, Ordering::Relaxed);
                Err(error)
            }
        };
        let failed = report.is_err();
        if sender.send((job, report)).is_err() || failed {
            return;
        }
    }
}

/// What a thread holds for a cell.
struct Bench<X> {
    cell: usize,
    scratch: X,
    outcome: Outcome,
}

/// Runs one block; `None` if it is beyond the fence.
fn block<S: Study>(
    study: &S,
    header: &Header,
    job: u64,
    fence: &AtomicU64,
    bench: &mut Option<Bench<S::Scratch>>,
) -> Result<Option<Tally>, StudyError> {
    let (cell, block) = ((job / header.blocks()) as usize, job % header.blocks());
    let quantities = &header.cells()[cell];
    let mut at = None;
    let result = catch_unwind(AssertUnwindSafe(|| {
        let mut held = match bench.take() {
            Some(held) if held.cell == cell => held,
            _ => Bench { cell, scratch: study.scratch(cell)?, outcome: Outcome::new(quantities) },
        };
        let mut tally = Tally::new(quantities);
        for index in header.trials_in(&(block..block + 1)) {
            if job >= fence.load(Ordering::Relaxed) {
                return Ok(None);
            }
            at = Some(index);
            held.outcome.clear();
            study.trial(cell, index, &mut held.scratch, &mut held.outcome)?;
            tally.push(&held.outcome);
        }
        *bench = Some(held);
        Ok(Some(tally))
    }));
    result.unwrap_or_else(|panic| Err(told(&*panic))).map_err(|cause| match at {
        Some(trial) => StudyError::Trial { cell, trial, cause },
        None => StudyError::Scratch { cell, cause },
    })
}

/// What a panic said.
pub(crate) fn told(panic: &(dyn Any + Send)) -> Failure {
    let message = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!("it panicked: {}", message.unwrap_or("without a message")).into()
}
