//! How long parts of one block each take to be joined, and how much memory: the worst that a study can be divided into.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use anyhow::{Result, ensure};
use rayon::prelude::*;
use twinlag_study::{Failure, Options, Outcome, Quantity, Shard, Study, merge};

use super::{peak_mb, peak_memory};

/// Trials of a block, as in the plans of this repository.
const BLOCK: u64 = 100;
/// Numbers and events of a trial: as of one estimator with intervals.
const NUMBERS: usize = 6;
const EVENTS: usize = 4;

/// A study whose trials cost nothing: numbers of a fixed sequence, near one another as estimates are.
struct Records {
    blocks: u64,
}

impl Study for Records {
    type Scratch = ();

    fn plan(&self) -> String {
        "block records".to_owned()
    }

    fn cells(&self) -> usize {
        1
    }

    fn trials(&self) -> u64 {
        self.blocks * BLOCK
    }

    fn block(&self) -> u64 {
        BLOCK
    }

    fn quantities(&self, _: usize) -> Vec<Quantity> {
        let numbers = (0..NUMBERS).map(|number| Quantity::value(format!("number {number}")));
        numbers.chain((0..EVENTS).map(|event| Quantity::event(format!("event {event}")))).collect()
    }

    fn scratch(&self, _: usize) -> Result<(), Failure> {
        Ok(())
    }

    fn trial(&self, _: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> Result<(), Failure> {
        // Multiples of the golden section, which fill the unit interval evenly.
        let unit = |place: u64| ((index * 16 + place) as f64 * 0.618_033_988_749_894_8).fract();
        for number in 0..NUMBERS {
            outcome.value(number, 1.0 + 0.2 * (unit(number as u64) - 0.5));
        }
        for event in 0..EVENTS {
            outcome.event(NUMBERS + event, unit((NUMBERS + event) as u64) < 0.95);
        }
        Ok(())
    }
}

/// Joins a tenth of the parts, then all of them: the memory of the second shows whether it grows.
pub(crate) fn run(parts: u64) -> Result<()> {
    for of in [parts / 10, parts] {
        ensure!(of > 0, "there are too few parts to take a tenth of them");
        let folder = tempfile::tempdir()?;
        write(folder.path(), of)?;
        let before = peak_mb();
        let paths = || Shard::all(of).map(|shard| folder.path().join(shard.file_name()));
        let bytes: u64 = paths().map(|path| path.metadata().map_or(0, |file| file.len())).sum();
        let start = Instant::now();
        let results = merge(paths())?;
        let seconds = start.elapsed().as_secs_f64();
        ensure!(results.cells()[0].trials() == of * BLOCK, "trials were lost");
        println!(
            "{of} parts of one block, {:.0} MB: joined in {seconds:.2} s; peak memory {}, before {}",
            bytes as f64 / 1e6,
            peak_memory(),
            before.map_or("unknown".to_owned(), |mb| format!("{mb:.1} MB"))
        );
    }
    Ok(())
}

fn write(folder: &Path, of: u64) -> Result<()> {
    let study = Records { blocks: of };
    let one = |index| -> Result<()> {
        let shard = Shard::new(index, of)?;
        let path = folder.join(shard.file_name());
        let threads = std::num::NonZeroUsize::MIN;
        let options = Options { threads, shard, checkpoint: Some(path.clone()), ..Options::default() };
        let part = twinlag_study::run(&study, &options, |_| ControlFlow::Continue(()))?;
        ensure!(part.is_complete(), "{}: is not done", path.display());
        Ok(())
    };
    (0..of).into_par_iter().try_for_each(one)
}
