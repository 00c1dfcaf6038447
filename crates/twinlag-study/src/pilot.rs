//! What a study takes, from a few of its trials.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::ops::{ControlFlow, Range};
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use crate::error::StudyError;
use crate::moments::Moments;
use crate::part::Header;
use crate::shard::Shard;
use crate::sketch::expected_bytes;
use crate::study::{Outcome, Study};
use crate::tally::{Column, Statistic, Tally, Values};

/// Fewest trials of a cell that are timed; chosen: the spread of their times is in the interval.
const MIN_TRIALS: u64 = 5;

/// How to run a pilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PilotOptions {
    /// How many threads run trials side by side, as they will in a shard: they share caches and memory.
    pub threads: NonZeroUsize,
    /// How long all of it should take. It takes longer where five trials of each cell do.
    pub time: Duration,
}

/// A few trials of each cell, timed.
#[derive(Clone, Debug, PartialEq)]
pub struct Pilot {
    header: Header,
    cells: Vec<CellPilot>,
    threads: NonZeroUsize,
}

#[derive(Clone, Debug, PartialEq)]
struct CellPilot {
    /// Time of a trial, s.
    times: Moments,
    /// Time before the first one, with that one, s.
    prepare_s: f64,
    tally: Tally,
}

/// A time with its interval, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Time {
    /// The estimate.
    pub s: f64,
    /// 95 % interval.
    pub interval_s: [f64; 2],
}

/// What so many shards of a study take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Time of all of them on one thread.
    pub total: Time,
    /// Time on one thread of that which takes longest.
    pub longest: Time,
    /// Expected bytes of all parts.
    pub bytes: u64,
    /// Expected bytes of the largest part.
    pub largest_bytes: u64,
}

/// Runs a few trials of each cell, and times them.
///
/// The first trial of a cell is not timed: it fills caches and buffers. Intervals are from how much the times of trials differ; how fast
/// the processors are then, which may differ more, is not in them.
///
/// - `progress`: called with the number of cells that are done; if it breaks, threads stop after the cell in hand
///
/// # Errors
/// [`StudyError::Trial`], [`StudyError::Scratch`]; [`StudyError::Empty`], [`StudyError::TooLarge`], [`StudyError::SameName`] for an
/// invalid study. A pilot that was broken off has [`StudyError::Empty`]. Panics are passed on.
pub fn pilot<S: Study>(
    study: &S,
    options: PilotOptions,
    progress: impl FnMut(usize) -> ControlFlow<()> + Send,
) -> Result<Pilot, StudyError> {
    let header = Header::of(study)?;
    let cells = header.cells().len();
    let share = options.time.mul_f64(options.threads.get().min(cells) as f64 / cells as f64);
    let (next, done) = (AtomicUsize::new(0), Mutex::new((progress, vec![None; cells])));
    let work = || -> Result<(), StudyError> {
        loop {
            let cell = next.fetch_add(1, Ordering::Relaxed);
            if cell >= cells {
                return Ok(());
            }
            // The other threads stop as well.
            let timed =
                pilot_of_cell(study, &header, cell, share).inspect_err(|_| next.store(cells, Ordering::Relaxed))?;
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            let (progress, cells) = &mut *done;
            cells[cell] = Some(timed);
            if progress(cells.iter().flatten().count()).is_break() {
                next.store(cells.len(), Ordering::Relaxed);
            }
        }
    };
    let ended: Vec<Result<(), StudyError>> = thread::scope(|scope| {
        let threads: Vec<_> = (0..options.threads.get().min(cells)).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic))).collect()
    });
    ended.into_iter().collect::<Result<(), _>>()?;
    let (_, timed) = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    let empty = StudyError::Empty { cells: 0, trials: header.trials(), block: header.block() };
    let cells = timed.into_iter().collect::<Option<Vec<_>>>().ok_or(empty)?;
    Ok(Pilot { header, cells, threads: options.threads })
}

fn pilot_of_cell<S: Study>(study: &S, header: &Header, cell: usize, share: Duration) -> Result<CellPilot, StudyError> {
    let started = Instant::now();
    let quantities = &header.cells()[cell];
    let mut scratch = study.scratch(cell).map_err(|cause| StudyError::Scratch { cell, cause })?;
    let (mut outcome, mut tally, mut times) = (Outcome::new(quantities), Tally::new(quantities), Moments::default());
    let mut prepare_s = 0.0;
    for index in 0..header.trials() {
        if index > MIN_TRIALS && started.elapsed() >= share {
            break;
        }
        let before = Instant::now();
        outcome.clear();
        study.trial(cell, index, &mut scratch, &mut outcome).map_err(|cause| StudyError::Trial {
            cell,
            trial: index,
            cause,
        })?;
        tally.push(&outcome);
        if index == 0 {
            prepare_s = started.elapsed().as_secs_f64();
        } else {
            times.push(before.elapsed().as_secs_f64());
        }
    }
    Ok(CellPilot { times, prepare_s, tally })
}

impl CellPilot {
    /// Time of a trial, s, its standard error, and the degrees of freedom of that.
    fn trial_s(&self) -> (f64, f64, f64) {
        match (self.times.mean(), self.times.mean_error()) {
            (Some(mean), Some(error)) => (mean, error, (self.times.count() - 1) as f64),
            // Of so few trials in all that nothing shows how their times differ.
            _ => (self.prepare_s, self.prepare_s, 1.0),
        }
    }

    /// Expected bytes of the tally of so many trials, as text, if its numbers are normal.
    fn bytes(&self, trials: u64) -> f64 {
        let text = |value: &Values| serde_json::to_string(value.sketch()).map_or(0, |text| text.len()) as f64;
        let growth = |column: &Column| match column.statistic() {
            Statistic::Value(values) => match (values.moments().mean(), values.moments().standard_deviation()) {
                (Some(mean), Some(deviation)) => expected_bytes(mean, deviation, trials as f64) - text(values),
                _ => 0.0,
            },
            Statistic::Event(_) => 0.0,
        };
        let is = serde_json::to_string(&self.tally).map_or(0, |text| text.len()) as f64;
        is + self.tally.columns().iter().map(growth).sum::<f64>()
    }
}

/// A sum of times.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    s: f64,
    variance: f64,
    /// Of each part, its squared variance over its degrees of freedom.
    spread: f64,
}

impl Sum {
    fn add(&mut self, cell: &CellPilot, trials: u64) {
        let (mean, error, freedom) = cell.trial_s();
        let variance = (trials as f64 * error).powi(2);
        self.s += trials as f64 * mean;
        self.variance += variance;
        self.spread += variance * variance / freedom;
    }

    /// The interval is that of Student's distribution, with the degrees of freedom of Welch and Satterthwaite.
    fn time(&self) -> Time {
        let half = if self.variance > 0.0 {
            let freedom = self.variance * self.variance / self.spread;
            let quantile = StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975));
            quantile * self.variance.sqrt()
        } else {
            0.0
        };
        Time { s: self.s, interval_s: [(self.s - half).max(0.0), self.s + half] }
    }
}

impl Pilot {
    /// What the study is.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Trials that were run.
    pub fn trials(&self) -> u64 {
        self.cells.iter().map(|cell| cell.tally.trials()).sum()
    }

    /// Blocks of all cells: more shards than these have nothing to do.
    pub fn blocks(&self) -> u64 {
        self.header.jobs()
    }

    /// What so many shards take. Each prepares, on each of its threads, every cell that it has trials of.
    ///
    /// - `of`: number of shards, not zero
    pub fn cost(&self, of: u64) -> Cost {
        let (blocks, jobs) = (self.header.blocks(), self.header.jobs());
        let (mut total, mut longest) = (Sum::default(), Sum::default());
        let (mut bytes, mut largest_bytes) = (0.0, 0.0_f64);
        // A shard has nodes of a few sizes, each of which is worked out once.
        let mut of_node: HashMap<(usize, u64), f64> = HashMap::new();
        for shard in Shard::all(of) {
            let range = shard.range(jobs);
            let (mut sum, mut part) = (Sum::default(), 0.0);
            let mut start = range.start;
            while start < range.end {
                let cell = (start / blocks) as usize;
                let end = range.end.min((cell as u64 + 1) * blocks);
                let first = cell as u64 * blocks;
                let own = start - first..end - first;
                let timed = &self.cells[cell];
                let trials = self.header.trials_in(&own);
                for sum in [&mut sum, &mut total] {
                    sum.add(timed, trials.end - trials.start);
                    sum.s += timed.prepare_s * self.threads.get() as f64;
                }
                for node in nodes(own) {
                    let trials = (node * self.header.block()).min(self.header.trials());
                    part += *of_node.entry((cell, trials)).or_insert_with(|| timed.bytes(trials));
                }
                start = end;
            }
            if sum.s > longest.s {
                longest = sum;
            }
            bytes += part;
            largest_bytes = largest_bytes.max(part);
        }
        Cost { total: total.time(), longest: longest.time(), bytes: bytes as u64, largest_bytes: largest_bytes as u64 }
    }
}

/// Blocks of each node of a forest that covers neighbours, see [`Forest`](crate::Forest).
fn nodes(mut blocks: Range<u64>) -> impl Iterator<Item = u64> {
    std::iter::from_fn(move || {
        let left = blocks.end.checked_sub(blocks.start).filter(|left| *left > 0)?;
        let aligned = if blocks.start == 0 { u64::MAX } else { 1 << blocks.start.trailing_zeros() };
        let node = aligned.min(1 << left.ilog2());
        blocks.start += node;
        Some(node)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nodes_of_neighbours_are_those_of_a_forest() {
        for range in [0..1, 0..13, 3..4, 3..29, 8..16, 1..1024] {
            let mut forest = crate::Forest::new(1 << 20);
            for block in range.clone() {
                forest.insert(block, crate::Rate::default()).expect("each once");
            }
            let are: Vec<u64> = forest.nodes().map(|(node, _)| node.end - node.start).collect();
            assert_eq!(nodes(range).collect::<Vec<_>>(), are);
        }
    }

    #[test]
    fn intervals_of_a_sum_are_those_of_its_parts() {
        let cell = |times: &[f64]| {
            let mut moments = Moments::default();
            for time in times {
                moments.push(*time);
            }
            CellPilot { times: moments, prepare_s: 0.0, tally: Tally::new(&[]) }
        };
        let mut sum = Sum::default();
        sum.add(&cell(&[1.0, 2.0, 3.0]), 10);
        // By hand: mean 2 and standard error 1/√3 of each trial; Student's quantile for two degrees of freedom is 4.302653.
        let half = 4.302_653 * 10.0 / 3_f64.sqrt();
        let Time { s, interval_s: [low, high] } = sum.time();
        assert!((s - 20.0).abs() < 1e-9 && low == 0.0 && (high - 20.0 - half).abs() < 1e-4, "{high}");
        sum.add(&cell(&[5.0, 5.0]), 1);
        let with_certain = sum.time();
        assert!((with_certain.s - 25.0).abs() < 1e-9 && (with_certain.interval_s[1] - 25.0 - half).abs() < 1e-4);
    }
}
