//! `twinlag diagnose FILE`: the closed loop.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use twinlag::diagnosis::{Grade, Verdict};
use twinlag::record::Record;
use twinlag::{DiagnoseOptions, Diagnosis, Options, Status};
use twinlag_pages::diagnosis_report;

use crate::arguments::Diagnose;
use crate::characterise::read_watched;
use crate::console::Console;
use crate::failure::Failure;
use crate::grades;
use crate::output;
use crate::print;
use crate::progress::Progress;

pub(crate) fn run(command: &Diagnose, console: Console) -> Result<u8, Failure> {
    let outputs = [("--report", &command.report), ("--save", &command.save)];
    let outputs: Vec<_> = outputs.into_iter().filter_map(|(option, path)| Some((option, path.as_deref()?))).collect();
    let files = files(command)?;
    files.iter().try_for_each(|file| output::check(file, &outputs, command.force))?;
    let characterise = command.input.method.options()?;
    let mut records = Vec::new();
    for file in &files {
        let record = read_watched(file, &command.input.columns.selection(), console)?;
        print::notes(&record, console);
        records.push(record);
    }
    no_copies(&records)?;
    let run = |characterise: Options| {
        let options = DiagnoseOptions { characterise, without: command.without.clone(), ..DiagnoseOptions::default() };
        match &records[..] {
            [record] => diagnose(record, &options, console),
            records => diagnose_records(records, &options, console),
        }
    };
    let plausibility = command.physics.plausibility(&records)?;
    let answer = plausibility.answer(characterise, run, |answer| &mut answer.last)?;
    let record = match &records[..] {
        [record] => Cow::Borrowed(record),
        records => Cow::Owned(twinlag::joined(records)?),
    };
    if let Some(path) = &command.save {
        output::model(path, &answer.model())?;
    }
    if let Some(path) = &command.report {
        output::write(path, &diagnosis_report(&record, &answer, &output::command_line())?)?;
    }
    print::diagnosis(&answer, console)?;
    Ok(grades::strictly(command.input.method.strict, |strict| exit_code(&answer, strict)))
}

/// The records, each named once.
fn files(command: &Diagnose) -> Result<Vec<&Path>, Failure> {
    let files: Vec<&Path> = std::iter::once(&command.input.file).chain(&command.more).map(PathBuf::as_path).collect();
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

fn diagnose_records(records: &[Record], options: &DiagnoseOptions, console: Console) -> Result<Diagnosis, Failure> {
    let samples: usize = records.iter().map(Record::len).sum();
    let progress = Progress::start(console, format!("diagnosing {samples} samples of {} records", records.len()));
    let watch = |task: &str, done, total| progress.watch(task, done, total);
    let all: Vec<&str> = records.iter().map(|record| record.source.as_str()).collect();
    let answer = twinlag::diagnose_records_watched(records, options, &watch);
    answer.map_err(|error| Failure::in_file(error, &all.join(", ")))
}

pub(crate) fn diagnose(record: &Record, options: &DiagnoseOptions, console: Console) -> Result<Diagnosis, Failure> {
    let progress = Progress::start(console, format!("diagnosing {} samples", record.len()));
    let answer = twinlag::diagnose_watched(record, options, &|task, done, total| progress.watch(task, done, total));
    answer.map_err(|error| Failure::in_file(error, &record.source))
}

/// The exit code of a diagnosis: it is asked for both time constants, and for what is missing.
pub(crate) fn exit_code(answer: &Diagnosis, strict: bool) -> u8 {
    if answer.last.status == Status::NotIdentifiable {
        return 4;
    }
    let asked = [0, 1].map(|i| answer.last.sensors[i].judgement.grade);
    let others: Vec<Grade> = answer.grades().collect();
    let is_partial = matches!(answer.verdict, Verdict::PartlyExplained | Verdict::Unexplained);
    grades::exit_code(&asked, &others, is_partial, strict)
}
