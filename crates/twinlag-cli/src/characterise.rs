//! `twinlag characterise FILE...`.

use std::path::Path;

use twinlag::diagnosis::{Grade, ModelError};
use twinlag::record::Record;
use twinlag::{Characterisation, Model, Options, Status};

use crate::arguments::Characterise;
use crate::console::Console;
use crate::failure::{Failure, explained};
use crate::grades;
use crate::print;
use crate::progress::Progress;
use crate::several;

pub(crate) fn run(command: &Characterise, console: Console) -> Result<u8, Failure> {
    let options = command.input.method.options()?;
    let files = several::files(&command.input, &command.more)?;
    if let (Some(path), [_, _, ..]) = (&command.model, &files[..]) {
        return Err(Failure::Usage(format!(
            "--model {}: expected one file beside it, got {}. `twinlag diagnose` finds the effects of several records together",
            path.display(),
            files.len()
        )));
    }
    let mut records = several::read(&files, &command.input, console)?;
    let given = command.model.as_deref().map(|path| Ok::<_, Failure>((path, model(path)?))).transpose()?;
    if let (Some((_, model)), [record]) = (&given, &mut records[..]) {
        several::with_sensors(record, &model.channels, "the model", &command.input.columns.profile()?, console);
    }
    let run = |options: Options| ask(&records, given.as_ref().map(|(path, model)| (*path, model)), &options, console);
    let plausibility = command.physics.plausibility(&records)?;
    let answer = plausibility.answer(options, run, |answer| answer)?;
    print::characterisation(&answer, console)?;
    Ok(grades::strictly(command.input.method.strict, |strict| exit_code(&answer, strict)))
}

/// What two lags say of a record or, without a model, of several of one rig.
///
/// - `given`: a model, with the file that it is from
pub(crate) fn ask(
    records: &[Record],
    given: Option<(&Path, &Model)>,
    options: &Options,
    console: Console,
) -> Result<Characterisation, Failure> {
    match (records, given) {
        ([record], Some((path, model))) => {
            let _progress = Progress::start(console, format!("characterising {} samples", record.len()));
            twinlag::characterise_with(record, model, options).map_err(|e| match e {
                twinlag::Error::ModelChannels { .. }
                | twinlag::Error::ModelNumber { .. }
                | twinlag::Error::Model(
                    ModelError::Model { .. } | ModelError::Parameter { .. } | ModelError::Absurd,
                ) => Failure::File(format!("{}: {}", path.display(), explained(&e))),
                e => Failure::in_file(e, &record.source),
            })
        }
        ([record], None) => characterise(record, options, console),
        (records, _) => characterise_records(records, options, console),
    }
}

pub(crate) fn model(path: &Path) -> Result<Model, Failure> {
    let wrong = |what: String| Failure::File(format!("{}: {what}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|e| wrong(format!("cannot be read: {e}")))?;
    let expected = "expected a model written by `twinlag diagnose --save`";
    if !text.trim_start().starts_with('{') {
        return Err(wrong(format!("{expected}, which is JSON and begins with {{, got another file")));
    }
    let model: Model = serde_json::from_str(&text).map_err(|e| wrong(format!("{expected}: {e}")))?;
    if model.schema == Model::SCHEMA {
        Ok(model)
    } else {
        Err(wrong(format!("expected schema {}, got {}", Model::SCHEMA, model.schema)))
    }
}

pub(crate) fn characterise(record: &Record, options: &Options, console: Console) -> Result<Characterisation, Failure> {
    let progress = Progress::start(console, format!("characterising {} samples", record.len()));
    let answer = twinlag::characterise_watched(record, options, &|task, done, total| progress.watch(task, done, total));
    answer.map_err(|error| Failure::in_file(error, &record.source))
}

fn characterise_records(records: &[Record], options: &Options, console: Console) -> Result<Characterisation, Failure> {
    let samples = several::samples(records);
    let progress = Progress::start(console, format!("characterising {samples} samples of {} records", records.len()));
    let watch = |task: &str, done, total| progress.watch(task, done, total);
    let answer = twinlag::characterise_records_watched(records, options, &watch);
    answer.map_err(|error| Failure::in_file(error, &several::sources(records)))
}

/// The exit code of a characterisation: it is asked for both time constants, and strictly for their difference as well.
pub(crate) fn exit_code(answer: &Characterisation, strict: bool) -> u8 {
    let mut asked: Vec<Grade> = answer.sensors.iter().map(|sensor| sensor.judgement.grade).collect();
    if strict {
        asked.push(answer.time_constant_difference_s.judgement.grade);
    }
    if answer.status == Status::Ok { grades::exit_code(&asked, &[], false, strict) } else { 4 }
}
