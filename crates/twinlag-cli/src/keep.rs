//! Columns of a file that go to an output as they are: its dates and times of day, and what `--keep` names.

use std::path::Path;

use twinlag::record::{ColumnRef, Record};
use twinlag::{Keep, Kept};

use crate::console::Console;
use crate::failure::Failure;
use crate::profile::Profile;
use crate::read::table_watched;

/// The word for all columns that are not read as time or temperature.
const ALL: &str = "all";

/// Refuses names of columns that the file does not have, before any work.
pub(crate) fn check(
    file: &Path,
    profile: &Profile,
    named: &[ColumnRef],
    record: &Record,
    console: Console,
) -> Result<(), Failure> {
    if named.is_empty() { Ok(()) } else { kept(file, profile, named, record, console).map(drop) }
}

/// Reads the file once more; `None` where there is nothing to keep, as of what came from a pipe.
///
/// - `named`: the columns to keep beside dates and times, or `all`
pub(crate) fn kept(
    file: &Path,
    profile: &Profile,
    named: &[ColumnRef],
    record: &Record,
    console: Console,
) -> Result<Option<Kept>, Failure> {
    if !file.metadata().is_ok_and(|about| about.is_file()) {
        return match named {
            [] => Ok(None),
            _ => Err(Failure::Usage(format!("--keep: {} is no file, and cannot be read twice", file.display()))),
        };
    }
    let table = table_watched(file, &profile.choice(), console)?;
    if table.rows() != record.len() {
        return Err(Failure::File(format!("{}: it has changed while it was read", file.display())));
    }
    let is_all = named.iter().any(|name| name.to_string() == ALL);
    let keep = if is_all { Keep::All } else { Keep::Named(named) };
    Ok(Kept::of(table, &profile.selection, keep, record)?)
}
