//! Files that a batch has written, which are no records.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use crate::parquet::is_parquet_table;
use crate::row::first_columns;
use crate::{journal, manifest};

/// How a file of Parquet begins.
const PARQUET_START: &str = "PAR1";

/// Whether a file is a table, a journal, a part or a manifest that a batch has written. One that cannot be read is not.
pub fn is_of_batch(file: &Path) -> bool {
    let header = first_columns().join(",");
    let starts = [&header, journal::START, manifest::START, PARQUET_START];
    let (longest, mut head) = (starts.iter().map(|start| start.len()).max().unwrap_or(0), Vec::new());
    let read = File::open(file).and_then(|file| file.take(longest as u64).read_to_end(&mut head));
    let is = starts.into_iter().find(|start| read.is_ok() && head.starts_with(start.as_bytes()));
    is.is_some_and(|start| start != PARQUET_START || is_parquet_table(file))
}
