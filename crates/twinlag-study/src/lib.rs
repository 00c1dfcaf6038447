//! Monte-Carlo studies whose result is byte-identical for any number of threads, shards and
//! restarts.
//!
//! This crate is for anyone who repeats a trial many times at each cell of a grid, and wants means,
//! spreads, quantiles and rates with their standard errors. It knows neither thermocouples nor
//! experiments, and runs any [`Study`]. Nor does it draw random numbers: a trial seeds itself from
//! its index, as below. To accumulate numbers without running anything, use [`Values`] and [`Rate`]
//! alone; to combine anything else in a fixed order, use [`Forest`].
//!
//! ```
//! use std::ops::ControlFlow;
//! use rand::{RngExt, SeedableRng};
//! use rand_chacha::ChaCha8Rng;
//! use twinlag_study::{Failure, Options, Outcome, Quantity, Study, run};
//!
//! /// π from points in the unit square.
//! struct Circle {
//!     seed: u64,
//! }
//!
//! impl Study for Circle {
//!     type Scratch = ChaCha8Rng;
//!
//!     fn plan(&self) -> String {
//!         format!("circle, seed {}", self.seed) // in earnest: a digest of the plan file and of the program
//!     }
//!     fn cells(&self) -> usize {
//!         1
//!     }
//!     fn trials(&self) -> u64 {
//!         10_000
//!     }
//!     fn block(&self) -> u64 {
//!         250
//!     }
//!     fn quantities(&self, _cell: usize) -> Vec<Quantity> {
//!         vec![Quantity::event("inside"), Quantity::value("radius")]
//!     }
//!     fn scratch(&self, _cell: usize) -> Result<ChaCha8Rng, Failure> {
//!         Ok(ChaCha8Rng::seed_from_u64(self.seed))
//!     }
//!     fn trial(&self, _: usize, index: u64, rng: &mut ChaCha8Rng, outcome: &mut Outcome) -> Result<(), Failure> {
//!         rng.set_stream(index); // each trial has a stream of its own ...
//!         rng.set_word_pos(0); // ... and starts at its beginning, whatever ran before
//!         let [x, y]: [f64; 2] = rng.random();
//!         let radius = x.hypot(y);
//!         outcome.event(0, radius < 1.0);
//!         outcome.value(1, radius);
//!         Ok(())
//!     }
//! }
//!
//! let part = run(&Circle { seed: 1 }, &Options::default(), |_| ControlFlow::Continue(()))?;
//! let results = part.into_results()?;
//! let inside = results.cells()[0].rate("inside").expect("a quantity of the study");
//! let [lower, upper] = inside.wilson_interval().expect("there are trials");
//! assert!(4.0 * lower < std::f64::consts::PI && std::f64::consts::PI < 4.0 * upper);
//! # Ok::<(), twinlag_study::StudyError>(())
//! ```
//!
//! # Why the bytes are the same
//!
//! Floating-point addition is not associative, so the order of additions is part of the result.
//! Trials are grouped in *blocks* of a size that the study fixes. Within a block they are added up
//! in order of their index, by one thread. Blocks merge along one binary tree over the block index
//! ([`Forest`]), whoever computed them and whenever they came. Nothing but `+ − × ÷` and
//! comparisons enters what is stored, so the bytes do not depend on a machine's mathematical
//! library, as far as this crate is concerned; a study's own trials may.
//!
//! # Shards and restarts
//!
//! A [`Shard`] `k/n` owns the `k`-th of `n` contiguous ranges of the blocks of all cells. [`run()`]
//! keeps a [`Part`] on disk: it is replaced, never edited, so that there is a whole one at every
//! moment, and one process at a time writes it. The part of a finished shard is its result. [`merge`] joins parts in any order and says
//! which shards are missing. [`replay`] runs a single trial again. [`pilot()`] says beforehand what shards take.

mod error;
mod forest;
mod hashed;
mod lock;
mod moments;
mod part;
mod pilot;
mod rate;
mod replace;
mod run;
mod shard;
mod sketch;
mod study;
mod tally;

pub use error::{Gap, StudyError};
pub use forest::{Forest, ForestError, Merge};
pub use hashed::{HashedError, with_hash, without_hash};
pub use moments::Moments;
pub use part::{Header, Part, Results, merge};
pub use pilot::{Pilot, PilotCost, PilotOptions, PilotTime, pilot};
pub use rate::Rate;
pub use replace::replace_file;
pub use run::{Options, Progress, replay, run};
pub use shard::{Shard, ranges};
pub use sketch::Sketch;
pub use study::{Failure, Kind, Outcome, Quantity, Study};
pub use tally::{Column, Statistic, Tally, Values};
