//! What the engine adds to a trial that yields ten numbers, on one thread.
//!
//! `cargo run --release -p twinlag-study --example overhead`

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::time::Instant;

use twinlag_study::{Failure, Options, Outcome, Quantity, Study, StudyError, run};

/// Ten numbers that cost next to nothing, spread over three octaves.
struct Idle;

impl Study for Idle {
    type Scratch = ();

    fn plan(&self) -> String {
        "idle".into()
    }

    fn cells(&self) -> usize {
        1
    }

    fn trials(&self) -> u64 {
        1_000_000
    }

    fn block(&self) -> u64 {
        250
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        (0..10).map(|i| Quantity::value(format!("q{i}"))).collect()
    }

    fn scratch(&self, _cell: usize) -> Result<(), Failure> {
        Ok(())
    }

    fn trial(&self, _cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> Result<(), Failure> {
        for i in 0..10 {
            outcome.value(i, 1.0 + 7.0 * ((index + i as u64) as f64 * 0.618_033_988_749_894_8).fract());
        }
        Ok(())
    }
}

fn main() -> Result<(), StudyError> {
    let started = Instant::now();
    let options = Options { threads: NonZeroUsize::MIN, ..Options::default() };
    let part = run(&Idle, &options, |_| ControlFlow::Continue(()))?;
    let nanoseconds = started.elapsed().as_secs_f64() * 1e9 / Idle.trials() as f64;
    let json = part.into_results()?.to_json();
    println!("{nanoseconds:.0} ns a trial of ten numbers; the result is {} kB of JSON", json.len() / 1000);
    Ok(())
}
