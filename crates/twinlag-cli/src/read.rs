//! Files to records, with progress.

use std::fs::{File, Metadata};
use std::io::stdin;
use std::path::Path;

use twinlag::record::{Record, Table};
use twinlag_files::Choice;

use crate::console::Console;
use crate::failure::Failure;
use crate::place;
use crate::profile::Profile;
use crate::progress::Progress;

/// Reads what the profile says from a file, and shows how far it has come; `-` is standard input.
pub(crate) fn read_watched(file: &Path, profile: &Profile, console: Console) -> Result<Record, Failure> {
    Ok(Record::from_owned(table_watched(file, &profile.choice(), console)?, &profile.selection)?)
}

/// Reads all columns of a file, and shows how far it has come; `-` is standard input, which is text.
pub(crate) fn table_watched(file: &Path, choice: &Choice, console: Console) -> Result<Table, Failure> {
    if file == Path::new("-") {
        return Ok(Table::from_reader(stdin(), "standard input")?);
    }
    place::expect_file(file)?;
    let opened = std::fs::metadata(file).ok().filter(Metadata::is_file).zip(File::open(file).ok());
    let Some((about, opened)) = opened else { return Ok(Table::from_path(file)?) };
    let progress = Progress::start(console, "reading".into());
    if twinlag_files::is_binary(file) {
        return Ok(twinlag_files::read(file, choice)?);
    }
    Ok(Table::from_reader(progress.reading(opened, about.len()), &file.display().to_string())?)
}
