//! Several files that are records of one rig.

use std::path::{Path, PathBuf};

use twinlag::record::Record;

use crate::arguments::Input;
use crate::console::Console;
use crate::failure::Failure;
use crate::print;
use crate::profile::Profile;
use crate::read::read_watched;

/// Rows that differ from the one before, at least, where records that share so many in a row share them not by chance: each of two
/// readings in coarse steps, up, down or none, agrees with a chance of a third, and 16 of them with one of 2e-8. Chosen.
const MIN_SHARED_CHANGES: usize = 16;

/// The files of a command, the first of which is in its input; refused where one is named twice.
pub(crate) fn files<'a>(input: &'a Input, more: &'a [PathBuf]) -> Result<Vec<&'a Path>, Failure> {
    let files: Vec<&Path> = std::iter::once(&input.file).chain(more).map(PathBuf::as_path).collect();
    let is_seen = |(place, file): &(usize, &&Path)| {
        let same = |other: &Path| {
            other == **file || other.canonicalize().is_ok_and(|one| file.canonicalize().is_ok_and(|two| one == two))
        };
        files[..*place].iter().any(|other| same(other))
    };
    match files.iter().enumerate().find(is_seen) {
        Some((_, file)) => Err(Failure::Usage(format!(
            "{} is named twice: a record that is counted twice is not left out when it is left out once",
            file.display()
        ))),
        None => Ok(files),
    }
}

/// Reads all of them, and says how each was read; refused where one has readings of another.
pub(crate) fn read(files: &[&Path], input: &Input, console: Console) -> Result<Vec<Record>, Failure> {
    let profile = input.columns.profile()?;
    let mut records = Vec::new();
    for file in files {
        let record = read_watched(file, &profile, console)?;
        let source = (files.len() > 1).then_some(record.source.as_str());
        print::notes_of(&record, source, console);
        records.push(record);
    }
    of_one_rig(records, &profile, console)
}

/// The records with the names that the sensors have in the first one, where the columns were chosen; refused where one has
/// readings of another.
pub(crate) fn of_one_rig(
    mut records: Vec<Record>,
    profile: &Profile,
    console: Console,
) -> Result<Vec<Record>, Failure> {
    if profile.selection.t1.is_some()
        && profile.selection.t2.is_some()
        && let [first, others @ ..] = &mut records[..]
    {
        others.iter_mut().for_each(|record| named_as(record, first, console));
    }
    no_copies(&records)?;
    Ok(records)
}

/// Gives the sensors of a record the names that they have in the first one, where the columns of both were chosen.
fn named_as(record: &mut Record, first: &Record, console: Console) {
    if record.channels != first.channels && !console.quiet {
        let ([one, two], [as_one, as_two]) = (&record.channels, &first.channels);
        eprintln!("note: {}: {one} and {two} are the sensors {as_one} and {as_two} of {}", record.source, first.source);
    }
    record.channels.clone_from(&first.channels);
}

/// Refuses a record that has readings of another: left out, they would be there all the same.
fn no_copies(records: &[Record]) -> Result<(), Failure> {
    for (place, record) in records.iter().enumerate() {
        for other in &records[..place] {
            let rows = shared_rows(record, other).max(shared_rows(other, record));
            if rows > 0 {
                let part = if rows == record.len() {
                    String::new()
                } else {
                    format!(" in {rows} of its {} rows", record.len())
                };
                return Err(Failure::Usage(format!(
                    "{} has the readings of {}{part}: what is counted twice is not left out when it is left out once",
                    record.source, other.source
                )));
            }
        }
    }
    Ok(())
}

/// Rows with which `later` begins and which `earlier` has as well, up to the end of either; none where they are so few, or change so
/// seldom, that two records may have them by chance.
fn shared_rows(earlier: &Record, later: &Record) -> usize {
    // Missing readings are NaN, which equal nothing.
    let row = |record: &Record, k: usize| [record.t1_c[k].to_bits(), record.t2_c[k].to_bits()];
    let changes = |rows: std::ops::Range<usize>| rows.skip(1).filter(|k| row(later, *k) != row(later, k - 1)).count();
    // Where readings rest at first, every row of rest would be a place to begin.
    let Some(changed) = (1..later.len()).find(|k| row(later, *k) != row(later, k - 1)) else { return 0 };
    let is_from = |first: usize| {
        let rows = later.len().min(earlier.len() - first);
        rows > changed
            && [changed, changed - 1].iter().all(|k| row(earlier, first + k) == row(later, *k))
            && (0..rows).all(|k| row(earlier, first + k) == row(later, k))
            && (rows == later.len() && rows == earlier.len() || changes(0..rows) >= MIN_SHARED_CHANGES)
    };
    (0..earlier.len()).find(|first| is_from(*first)).map_or(0, |first| later.len().min(earlier.len() - first))
}

/// Their names, for a message about all of them.
pub(crate) fn sources(records: &[Record]) -> String {
    records.iter().map(|record| record.source.as_str()).collect::<Vec<_>>().join(", ")
}

/// All their samples.
pub(crate) fn samples(records: &[Record]) -> usize {
    records.iter().map(Record::len).sum()
}
