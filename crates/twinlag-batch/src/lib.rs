//! Thousands of records of two temperature sensors asked the same question: one table, files that
//! cannot be used as rows with their reason, restarts without loss.
//!
//! For whoever has a folder of logger files or a fleet of rigs. [`find()`] lists the files,
//! [`each`] or [`grouped`] says what is asked together, [`run()`] asks it on all cores and keeps the
//! answers in a [`Journal`], from which [`write_csv`] and [`write_parquet`] make the table and [`Fleet`]
//! the summary. Neither depends on the number of threads or on how often a run was killed. No more
//! is held in memory than the records that are being worked on and a line for each file. How a file
//! is read is the caller's business; what is asked is in `twinlag`, which alone is the crate to take
//! for a few records; studies of simulated records are those of `twinlag-study`.
//!
//! ```
//! use std::ops::ControlFlow;
//! use twinlag::record::{Record, Selection};
//! use twinlag_batch::{Answer, Begin, Journal, Outcome, Row, Unit, Verb, each, find, run, write_csv};
//!
//! let folder = tempfile::tempdir()?;
//! std::fs::write(folder.path().join("empty.csv"), "")?;
//! let found = find(&[folder.path().join("*.csv")])?;
//! let units = each(found.into_iter().map(|file| file.path).collect());
//!
//! let characterise = |unit: &Unit| -> Vec<Row> {
//!     let Unit::Record(file) = unit else { unreachable!("each file by itself") };
//!     match Record::read(file, &Selection::default()) {
//!         Err(error) => vec![Row::without_answer(unit, file, Outcome::Unusable, &error.to_string())],
//!         Ok(record) => match twinlag::characterise(&record, &twinlag::Options::default()) {
//!             Err(error) => vec![Row::without_answer(unit, file, Outcome::Unusable, &error.to_string())],
//!             Ok(answer) => Row::of(unit, Outcome::Answered, &Answer::Characterisation(&answer)),
//!         },
//!     }
//! };
//! let asked = serde_json::json!({"verb": "characterise"});
//! let mut journal = Journal::open(&folder.path().join("table.journal"), &asked, Begin::Create)?;
//! run(&units, &mut journal, None, characterise, |_| ControlFlow::Continue(()))?;
//!
//! let mut table = Vec::new();
//! write_csv(&units, &mut journal, Verb::Characterise, &mut table)?;
//! assert!(String::from_utf8(table)?.contains("empty.csv: is empty"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod asked;
mod digest;
mod error;
mod find;
mod fleet;
mod group;
mod journal;
mod manifest;
mod outcome;
mod own;
mod parquet;
mod parts;
mod row;
mod run;
mod table;

pub use digest::sha256_of_file;
pub use error::BatchError;
pub use find::{Found, find};
pub use fleet::{Counts, Fleet, Member, MemberTau, ReasonCount};
pub use group::{GroupBy, Unit, each, grouped, name_of};
pub use journal::{Answers, Begin, Journal, PartOf};
pub use manifest::Manifest;
pub use outcome::Outcome;
pub use own::is_of_batch;
pub use parquet::write_parquet;
pub use parts::{Parts, done_in_part, part_path, parts_beside, shard_of_part};
pub use row::{Answer, Row, Verb};
pub use run::{Progress, map, run};
pub use table::write_csv;
