//! `twinlag characterise FILE`.

use std::io::{Read, stdin};
use std::path::Path;

use twinlag::record::{Record, Selection, Table};
use twinlag::{Characterisation, Options, Status};

use crate::arguments::{Characterise, Talk};
use crate::failure::Failure;
use crate::print;
use crate::progress::Progress;

pub(crate) fn run(command: &Characterise, talk: Talk) -> Result<u8, Failure> {
    let options = command.method.options()?;
    let record = read(&command.file, &command.columns.selection())?;
    print::notes(&record, talk);
    let answer = characterise(&record, &options, talk)?;
    print::characterisation(&answer, talk)?;
    Ok(exit_code(answer.status))
}

pub(crate) fn characterise(record: &Record, options: &Options, talk: Talk) -> Result<Characterisation, Failure> {
    let progress = Progress::start(talk, format!("characterising {} samples", record.len()));
    let watch = |done: usize, of: usize| progress.say(|| format!("bootstrap: {done} of {of} simulated records"));
    Ok(twinlag::characterise_watched(record, options, &watch)?)
}

/// 0 for an answer; 4 where the data were read but do not give one.
pub(crate) fn exit_code(status: Status) -> u8 {
    if status == Status::Ok { 0 } else { 4 }
}

fn read(file: &Path, selection: &Selection) -> Result<Record, Failure> {
    if file == Path::new("-") {
        let mut bytes = Vec::new();
        stdin().read_to_end(&mut bytes).map_err(|e| Failure::File(format!("standard input: cannot be read: {e}")))?;
        Ok(Record::from_table(&Table::read(&bytes, "standard input")?, selection)?)
    } else {
        Ok(Record::read(file, selection)?)
    }
}
