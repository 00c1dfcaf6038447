//! Files to records, with progress.

use std::fs::{File, Metadata};
use std::io::{BufRead, Read, stdin};
use std::path::Path;

use twinlag::record::{Record, Table};
use twinlag_files::{Choice, Format};

use crate::console::Console;
use crate::failure::Failure;
use crate::place;
use crate::profile::Profile;
use crate::progress::Progress;

/// Reads what the profile says from a file, and shows how far it has come; `-` is standard input.
pub(crate) fn read_watched(file: &Path, profile: &Profile, console: Console) -> Result<Record, Failure> {
    Ok(Record::from_owned(table_watched(file, &profile.choice(), console)?, &profile.selection)?)
}

/// Reads all columns of a file, and shows how far it has come; `-` is standard input.
pub(crate) fn table_watched(file: &Path, choice: &Choice, console: Console) -> Result<Table, Failure> {
    if file == Path::new("-") {
        return of_stdin(choice);
    }
    place::expect_file(file)?;
    let opened = std::fs::metadata(file).ok().filter(Metadata::is_file).zip(File::open(file).ok());
    let Some((about, opened)) = opened else { return Ok(Table::from_path(file)?) };
    let progress = Progress::start(console, "reading".into());
    if twinlag_files::is_binary(file) {
        return Ok(twinlag_files::read(file, choice)?);
    }
    if let Some(group) = &choice.group {
        console
            .note(|| format!("note: {}: it is text, which has no group '{group}': all of it is read", file.display()));
    }
    Ok(Table::from_reader(progress.reading(opened, about.len()), &file.display().to_string())?)
}

/// Reads all columns of what comes on standard input: text as it comes, a binary file when it is whole.
fn of_stdin(choice: &Choice) -> Result<Table, Failure> {
    const SOURCE: &str = "standard input";
    let mut input = stdin().lock();
    let unreadable = |error: std::io::Error| Failure::File(format!("{SOURCE}: cannot be read: {error}"));
    if Format::of(input.fill_buf().map_err(unreadable)?).is_none() {
        return Ok(Table::from_reader(input, SOURCE)?);
    }
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(twinlag_files::read_bytes(bytes, choice, SOURCE)?)
}
