//! Several files that are records of one rig.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use twinlag::record::Record;

use crate::arguments::Input;
use crate::console::Console;
use crate::failure::Failure;
use crate::print;
use crate::profile::Profile;
use crate::read::read_watched;

/// Different rows, at least, among those that two records share: fewer, as at rest in coarse steps, they may share by chance. Chosen.
const MIN_SHARED: usize = 16;

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
            "{} is named twice. Name it once: each record must be left out in turn, and this one would still be there",
            file.display()
        ))),
        None => Ok(files),
    }
}

/// Reads all of them, and says how each was read; refused where one shares rows with another.
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

/// The records with the sensors of the first one; refused where one shares rows with another.
pub(crate) fn of_one_rig(
    mut records: Vec<Record>,
    profile: &Profile,
    console: Console,
) -> Result<Vec<Record>, Failure> {
    if let [first, others @ ..] = &mut records[..] {
        others.iter_mut().for_each(|record| with_sensors(record, &first.channels, &first.source, profile, console));
    }
    no_shared_rows(&records)?;
    Ok(records)
}

/// Gives a record the sensors of others: in their order where that was not chosen, as of a file whose columns are sorted by name; with
/// their names where the columns were chosen.
///
/// - `whose`: what has the sensors of these names
pub(crate) fn with_sensors(
    record: &mut Record,
    sensors: &[String; 2],
    whose: &str,
    profile: &Profile,
    console: Console,
) {
    let ([one, two], [as_one, as_two]) = (&record.channels, sensors);
    let is_chosen = profile.selection.t1.is_some() && profile.selection.t2.is_some();
    let is_reversed = one == as_two && two == as_one;
    if record.channels == *sensors || is_chosen == is_reversed {
        return;
    }
    let source = &record.source;
    if is_reversed {
        console.note(|| format!("note: {source}: {two} is taken as the first sensor, as in {whose}"));
        std::mem::swap(&mut record.t1_c, &mut record.t2_c);
    } else {
        console.note(|| format!("note: {source}: {one} and {two} are the sensors {as_one} and {as_two} of {whose}"));
    }
    record.channels.clone_from(sensors);
}

/// Refuses a record that shares rows with another: where one of them is left out, these would be there all the same.
fn no_shared_rows(records: &[Record]) -> Result<(), Failure> {
    for (place, record) in records.iter().enumerate() {
        for other in &records[..place] {
            let rows = shared_rows(record, other).max(shared_rows(other, record));
            if rows > 0 {
                return Err(Failure::Usage(format!(
                    "{}: {rows} of its {} rows are also rows of {}. Take one of the two files: each record must be left out in turn, and \
                     these rows would still be there",
                    record.source,
                    record.len(),
                    other.source
                )));
            }
        }
    }
    Ok(())
}

/// Rows with which `later` begins and which `earlier` has as well, up to the end of either; none where so few of them differ that two
/// records may share them by chance.
fn shared_rows(earlier: &Record, later: &Record) -> usize {
    // Missing readings are NaN, which equal nothing: bits are compared.
    let row = |record: &Record, k: usize| [record.t1_c[k].to_bits(), record.t2_c[k].to_bits()];
    let overlap = |first: usize| later.len().min(earlier.len() - first);
    let is_same = |first: usize| (0..overlap(first)).all(|k| row(earlier, first + k) == row(later, k));
    if later.len() == earlier.len() && is_same(0) {
        return later.len();
    }
    // Where readings rest at first every row of rest would be a place to begin: the first change is looked for.
    let Some(changed) = (1..later.len()).find(|k| row(later, *k) != row(later, k - 1)) else { return 0 };
    let may_begin = |first: usize| {
        overlap(first) > changed && [changed, changed - 1].iter().all(|k| row(earlier, first + k) == row(later, *k))
    };
    let different = |rows: usize| (0..rows).map(|k| row(later, k)).collect::<HashSet<_>>().len();
    let is_from = |first: &usize| may_begin(*first) && is_same(*first) && different(overlap(*first)) >= MIN_SHARED;
    (0..earlier.len()).find(is_from).map_or(0, overlap)
}

/// Their names, for a message about all of them.
pub(crate) fn sources(records: &[Record]) -> String {
    records.iter().map(|record| record.source.as_str()).collect::<Vec<_>>().join(", ")
}

/// All their samples.
pub(crate) fn samples(records: &[Record]) -> usize {
    records.iter().map(Record::len).sum()
}
