//! Several files that are records of one rig.

use std::path::{Path, PathBuf};

use twinlag::record::Record;

use crate::arguments::Input;
use crate::console::Console;
use crate::failure::Failure;
use crate::print;
use crate::profile::Profile;
use crate::read::read_watched;

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

/// Reads all of them, and says how each was read; refused where one is a copy of another.
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

/// The records with the names that the sensors have in the first one, where the columns were chosen; refused where one is a copy of
/// another.
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

/// Refuses a record that is a copy of another: left out, it would be there all the same.
fn no_copies(records: &[Record]) -> Result<(), Failure> {
    // Missing readings are NaN, which equal nothing.
    let are_same = |one: &[f64], other: &[f64]| {
        one.len() == other.len() && one.iter().zip(other).all(|(a, b)| a.to_bits() == b.to_bits())
    };
    for (place, record) in records.iter().enumerate() {
        let is_copy = |other: &&Record| are_same(&other.t1_c, &record.t1_c) && are_same(&other.t2_c, &record.t2_c);
        if let Some(other) = records[..place].iter().find(is_copy) {
            return Err(Failure::Usage(format!(
                "{} has the readings of {}: a record that is counted twice is not left out when it is left out once",
                record.source, other.source
            )));
        }
    }
    Ok(())
}

/// Their names, for a message about all of them.
pub(crate) fn sources(records: &[Record]) -> String {
    records.iter().map(|record| record.source.as_str()).collect::<Vec<_>>().join(", ")
}

/// All their samples.
pub(crate) fn samples(records: &[Record]) -> usize {
    records.iter().map(Record::len).sum()
}
