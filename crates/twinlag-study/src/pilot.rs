//! What a study takes, from a few of its trials.

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use crate::error::StudyError;
use crate::forest::{Merge as _, nodes_of};
use crate::moments::Moments;
use crate::part::Header;
use crate::run::told;
use crate::shard::Shard;
use crate::sketch::expected_bytes;
use crate::study::{Outcome, Study};
use crate::tally::{Column, Statistic, Tally, Values};

/// Fewest trials of a cell that are timed, behind the first; chosen: the spread of their times is in the interval.
const MIN_TIMED_TRIALS: u64 = 5;

/// How to run a pilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PilotOptions {
    /// How many threads run trials side by side, as they will in a shard: they share caches and memory.
    pub threads: NonZeroUsize,
    /// How long all of it should take. It takes longer where six trials of each cell do.
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
    /// What the first trial takes longer than others, with all that comes before it, s.
    prepare_s: f64,
    tally: Tally,
}

/// A time with its interval, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotTime {
    /// The estimate.
    pub s: f64,
    /// 95 % interval.
    pub interval_s: [f64; 2],
}

/// What so many shards of a study take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotCost {
    /// Processor time of all shards.
    pub total: PilotTime,
    /// Time of the shard that may take longest, on the threads of the pilot.
    pub longest: PilotTime,
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
/// - `progress`: called with the number of cells that are done, of all
///
/// # Errors
/// [`StudyError::Trial`], [`StudyError::Scratch`]; [`StudyError::Empty`], [`StudyError::TooLarge`], [`StudyError::SameName`] for an
/// invalid study.
///
/// # Panics
/// Never: the panic of a trial is its error.
pub fn pilot<S: Study>(
    study: &S,
    options: PilotOptions,
    progress: impl FnMut(usize) + Send,
) -> Result<Pilot, StudyError> {
    let header = Header::of(study)?;
    let (cells, threads) = (header.cells().len(), options.threads.get());
    // Fewer cells than threads are worked on by several.
    let workers = threads.div_ceil(cells);
    let pieces = cells * workers;
    let share = options.time.mul_f64(threads.min(pieces) as f64 / pieces as f64);
    let (next, done) = (AtomicUsize::new(0), Mutex::new((progress, vec![None::<CellPilot>; cells], 0)));
    let work = || -> Result<(), StudyError> {
        loop {
            let piece = next.fetch_add(1, Ordering::Relaxed);
            if piece >= pieces {
                return Ok(());
            }
            let cell = piece % cells;
            // The other threads stop as well.
            let timed = pilot_of_cell(study, &header, cell, (piece / cells, workers), share)
                .inspect_err(|_| next.store(pieces, Ordering::Relaxed))?;
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            let (progress, cells, count) = &mut *done;
            match &mut cells[cell] {
                Some(other) => other.add(timed),
                none => *none = Some(timed),
            }
            *count += 1;
            progress(*count / workers);
        }
    };
    let ended: Vec<Result<(), StudyError>> = thread::scope(|scope| {
        let threads: Vec<_> = (0..threads.min(pieces)).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().expect("panics of trials are errors")).collect()
    });
    ended.into_iter().collect::<Result<(), _>>()?;
    let (_, timed, _) = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    let cells = timed.into_iter().map(|cell| cell.expect("all pieces are done")).collect();
    Ok(Pilot { header, cells, threads: options.threads })
}

/// - `(first, step)`: the first trial, and the step from one to the next
fn pilot_of_cell<S: Study>(
    study: &S,
    header: &Header,
    cell: usize,
    (first, step): (usize, usize),
    share: Duration,
) -> Result<CellPilot, StudyError> {
    let started = Instant::now();
    let quantities = &header.cells()[cell];
    let mut scratch = catch_unwind(AssertUnwindSafe(|| study.scratch(cell)))
        .unwrap_or_else(|panic| Err(told(&*panic)))
        .map_err(|cause| StudyError::Scratch { cell, cause })?;
    let (mut outcome, mut tally, mut times) = (Outcome::new(quantities), Tally::new(quantities), Moments::default());
    let mut first_s = 0.0;
    for trial in (first as u64..header.trials()).step_by(step) {
        if times.count() >= MIN_TIMED_TRIALS && started.elapsed() >= share {
            break;
        }
        let before = Instant::now();
        outcome.clear();
        catch_unwind(AssertUnwindSafe(|| study.trial(cell, trial, &mut scratch, &mut outcome)))
            .unwrap_or_else(|panic| Err(told(&*panic)))
            .map_err(|cause| StudyError::Trial { cell, trial, cause })?;
        tally.push(&outcome);
        if tally.trials() == 1 {
            first_s = started.elapsed().as_secs_f64();
        } else {
            times.push(before.elapsed().as_secs_f64());
        }
    }
    let prepare_s = (first_s - times.mean().unwrap_or(0.0)).max(0.0);
    Ok(CellPilot { times, prepare_s, tally })
}

impl CellPilot {
    /// Adds what another thread has timed of the cell.
    fn add(&mut self, other: Self) {
        self.times.merge(other.times);
        self.prepare_s = self.prepare_s.max(other.prepare_s);
        self.tally.merge(other.tally);
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

/// Processor time of trials of several cells.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    s: f64,
    variance: f64,
    /// Of each cell, its squared variance over its degrees of freedom.
    spread: f64,
}

impl Sum {
    /// Adds trials that are still to be run: their mean is known to its standard error, and their sum differs from that by as much as
    /// they differ.
    fn add(&mut self, cell: &CellPilot, trials: u64) {
        let trials = trials as f64;
        let (mean, error, deviation, freedom) =
            match (cell.times.mean(), cell.times.mean_error(), cell.times.standard_deviation()) {
                (Some(mean), Some(error), Some(deviation)) => (mean, error, deviation, (cell.times.count() - 1) as f64),
                // One trial shows no spread.
                _ => (cell.prepare_s, cell.prepare_s, 0.0, 1.0),
            };
        let variance = (trials * error).powi(2) + trials * deviation.powi(2);
        self.s += trials * mean;
        self.variance += variance;
        self.spread += variance * variance / freedom;
    }

    /// The time if that many threads share it, all the time. The interval is that of Student's distribution, with the degrees of freedom
    /// of Welch and Satterthwaite.
    fn on(&self, threads: f64) -> PilotTime {
        let half = if self.variance > 0.0 {
            let freedom = self.variance * self.variance / self.spread;
            let quantile = StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975));
            quantile * self.variance.sqrt()
        } else {
            0.0
        };
        PilotTime { s: self.s / threads, interval_s: [self.s - half, self.s + half].map(|s| s.max(0.0) / threads) }
    }
}

impl Pilot {
    /// Trials that were run.
    pub fn trials(&self) -> u64 {
        self.cells.iter().map(|cell| cell.tally.trials()).sum()
    }

    /// Blocks of all cells: more shards than these have nothing to do.
    pub fn blocks(&self) -> u64 {
        self.header.jobs()
    }

    /// What so many shards take. Each prepares, on each of its threads, every cell that it has blocks of; a thread works on one block at a
    /// time.
    ///
    /// - `of`: number of shards, not zero
    pub fn cost(&self, of: u64) -> PilotCost {
        let (blocks, jobs, threads) = (self.header.blocks(), self.header.jobs(), self.threads.get() as u64);
        // Of a cell in several shards the mean time is known no better than of one in a single shard.
        let mut total = Sum::default();
        self.cells.iter().for_each(|cell| total.add(cell, self.header.trials()));
        let (mut longest, mut longest_on, mut upper) = (Sum::default(), 1.0, 0.0_f64);
        let (mut bytes, mut largest_bytes) = (0.0, 0.0_f64);
        // A shard has nodes of a few sizes, each of which is worked out once.
        let mut of_node: HashMap<(usize, u64), f64> = HashMap::new();
        for shard in Shard::all(of) {
            let range = shard.range(jobs);
            let (mut sum, mut part) = (Sum::default(), 0.0);
            let mut start = range.start;
            while start < range.end {
                let cell = (start / blocks) as usize;
                let first = cell as u64 * blocks;
                let end = range.end.min(first + blocks);
                let own = start - first..end - first;
                let timed = &self.cells[cell];
                let trials = self.header.trials_in(&own);
                sum.add(timed, trials.end - trials.start);
                let preparing_s = timed.prepare_s * threads.min(end - start) as f64;
                total.s += preparing_s;
                sum.s += preparing_s;
                for node in nodes_of(own, blocks) {
                    let trials = self.header.trials_in(&node);
                    let trials = trials.end - trials.start;
                    part += *of_node.entry((cell, trials)).or_insert_with(|| timed.bytes(trials));
                }
                start = end;
            }
            let count = range.end - range.start;
            if count > 0 {
                // Threads that have no block left wait for the others.
                let on = count as f64 / count.div_ceil(threads) as f64;
                let two_errors = (sum.s + 2.0 * sum.variance.sqrt()) / on;
                if two_errors > upper {
                    (longest, longest_on, upper) = (sum, on, two_errors);
                }
            }
            bytes += part;
            largest_bytes = largest_bytes.max(part);
        }
        PilotCost {
            total: total.on(1.0),
            longest: longest.on(longest_on),
            bytes: bytes as u64,
            largest_bytes: largest_bytes as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{Failure, Quantity};

    fn cell(times: &[f64]) -> CellPilot {
        let mut moments = Moments::default();
        for time in times {
            moments.push(*time);
        }
        CellPilot { times: moments, prepare_s: 0.0, tally: Tally::new(&[]) }
    }

    #[test]
    fn intervals_of_a_sum_are_those_of_its_parts() {
        let mut sum = Sum::default();
        sum.add(&cell(&[1.0, 2.0, 3.0]), 10);
        // By hand: mean 2, standard deviation 1, and standard error 1/√3 of each trial; Student's quantile for two degrees of freedom is
        // 4.302653.
        let half = 4.302_653 * (100.0_f64 / 3.0 + 10.0).sqrt();
        let PilotTime { s, interval_s: [low, high] } = sum.on(2.0);
        assert!((s - 10.0).abs() < 1e-9 && low == 0.0 && (high - 10.0 - half / 2.0).abs() < 1e-4, "{high}");
        sum.add(&cell(&[5.0, 5.0]), 1);
        let with_certain = sum.on(1.0);
        assert!((with_certain.s - 25.0).abs() < 1e-9 && (with_certain.interval_s[1] - 25.0 - half).abs() < 1e-4);
    }

    /// A study of cells whose trials do nothing.
    struct Idle {
        cells: usize,
        trials: u64,
    }

    impl Study for Idle {
        type Scratch = ();

        fn plan(&self) -> String {
            "idle".to_owned()
        }
        fn cells(&self) -> usize {
            self.cells
        }
        fn trials(&self) -> u64 {
            self.trials
        }
        fn block(&self) -> u64 {
            10
        }
        fn quantities(&self, _: usize) -> Vec<Quantity> {
            vec![Quantity::value("x")]
        }
        fn scratch(&self, _: usize) -> Result<(), Failure> {
            Ok(())
        }
        fn trial(&self, _: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> Result<(), Failure> {
            assert!(index != 3 || self.trials != 4, "the fourth of four");
            outcome.value(0, 1.0 + 1e-3 * index as f64);
            Ok(())
        }
    }

    fn timed(cells: usize, trials: u64, threads: usize) -> Result<Pilot, StudyError> {
        let threads = NonZeroUsize::new(threads).expect("some");
        pilot(&Idle { cells, trials }, PilotOptions { threads, time: Duration::ZERO }, |_| ())
    }

    /// How a study is divided changes nothing of what is known of its time, and a shard of one block has one thread to work for it.
    #[test]
    fn a_division_adds_no_knowledge() {
        let mut pilot = timed(2, 1000, 4).expect("it runs");
        pilot.cells = vec![cell(&[1.0, 2.0, 3.0]), cell(&[1.0, 1.0])];
        let [one, many] = [1, 200].map(|of| pilot.cost(of));
        assert_eq!(one.total, many.total);
        assert!((one.longest.s - 3000.0 / 4.0).abs() < 1e-9, "{one:?}");
        assert!((many.longest.s - 20.0).abs() < 1e-9, "{many:?}");
    }

    #[test]
    fn every_cell_has_its_trials_whatever_the_threads() {
        for threads in [1, 3, 7] {
            let pilot = timed(2, 1000, threads).expect("it runs");
            assert!(pilot.trials() >= 2 * (1 + MIN_TIMED_TRIALS), "{}", pilot.trials());
            let whole = pilot.cost(1);
            assert_eq!(whole.bytes, whole.largest_bytes);
            assert!(whole.bytes > 0);
        }
    }

    #[test]
    fn a_trial_that_panics_is_named() {
        assert!(matches!(timed(1, 4, 1), Err(StudyError::Trial { cell: 0, trial: 3, .. })));
    }
}
