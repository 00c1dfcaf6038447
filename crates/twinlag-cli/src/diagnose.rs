//! `twinlag diagnose FILE...`: the closed loop.

use std::borrow::Cow;

use twinlag::diagnosis::{Grade, Verdict};
use twinlag::record::Record;
use twinlag::{DiagnoseOptions, Diagnosis, Options, Status};
use twinlag_pages::diagnosis_report;

use crate::arguments::Diagnose;
use crate::console::Console;
use crate::failure::Failure;
use crate::grades;
use crate::output;
use crate::print;
use crate::progress::Progress;
use crate::report;
use crate::several;

pub(crate) fn run(command: &Diagnose, console: Console) -> Result<u8, Failure> {
    let outputs = [("--report", &command.report), ("--save", &command.save)];
    let outputs: Vec<_> = outputs.into_iter().filter_map(|(option, path)| Some((option, path.as_deref()?))).collect();
    let files = several::files(&command.input, &command.more)?;
    files.iter().try_for_each(|file| output::check(file, &outputs, command.force))?;
    let characterise = command.input.method.options()?;
    let records = several::read(&files, &command.input, console)?;
    let run = |characterise: Options| {
        let options = DiagnoseOptions { characterise, without: command.without.clone(), ..DiagnoseOptions::default() };
        ask(&records, &options, console)
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
        output::write(path, &diagnosis_report(&record, &answer, &report::making(&files, command.is_static))?)?;
    }
    print::diagnosis(&answer, console)?;
    Ok(grades::strictly(command.input.method.strict, |strict| exit_code(&answer, strict)))
}

/// What the closed loop says of a record, or of several of one rig.
pub(crate) fn ask(records: &[Record], options: &DiagnoseOptions, console: Console) -> Result<Diagnosis, Failure> {
    match records {
        [record] => diagnose(record, options, console),
        records => diagnose_records(records, options, console),
    }
}

fn diagnose_records(records: &[Record], options: &DiagnoseOptions, console: Console) -> Result<Diagnosis, Failure> {
    let samples = several::samples(records);
    let progress = Progress::start(console, format!("diagnosing {samples} samples of {} records", records.len()));
    let watch = |task: &str, done, total| progress.watch(task, done, total);
    let answer = twinlag::diagnose_records_watched(records, options, &watch);
    answer.map_err(|error| Failure::in_file(error, &several::sources(records)))
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
