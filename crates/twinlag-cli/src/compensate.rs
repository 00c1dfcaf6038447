//! `twinlag compensate FILE --out OUT.csv`: the gas temperature with its standard deviation.

use std::path::Path;

use twinlag::diagnosis::Verdict;
use twinlag::record::Record;
use twinlag::{CompensateOptions, Compensation, DiagnoseOptions, Kept, Options, Status};

use crate::arguments::{Compensate, Trust};
use crate::characterise::model;
use crate::console::Console;
use crate::failure::Failure;
use crate::grades;
use crate::keep::{self, kept};
use crate::output::{self, Views};
use crate::print;
use crate::progress::Progress;
use crate::read::read_watched;
use crate::report;
use crate::several::with_sensors;

pub(crate) fn run(command: &Compensate, console: Console) -> Result<u8, Failure> {
    let views =
        Views { picture: command.picture.as_deref(), report: command.report.as_deref(), save: command.save.as_deref() };
    let model_file = command.model.as_deref();
    let to_stdout = output::check_data(&command.input.file, model_file, &command.out, &views, command.force, console)?;
    let asked = command.input.method.options()?;
    let model = model_file.map(model).transpose()?;
    let profile = command.input.columns.profile()?;
    let mut record = read_watched(&command.input.file, &profile, console)?;
    if let Some(model) = &model {
        with_sensors(&mut record, &model.channels, "the model", &profile, console);
    }
    keep::check(&command.input.file, &profile, &command.keep, &record, console)?;
    print::notes(&record, console);
    let plausibility = command.physics.plausibility(std::slice::from_ref(&record))?;
    let run = |characterise: Options| {
        let options = CompensateOptions {
            diagnose: DiagnoseOptions { characterise, without: command.without.clone(), ..DiagnoseOptions::default() },
            model: model.clone(),
            form: command.form,
            trusted: usize::from(command.trust == Trust::T2),
        };
        ask(&record, &options, console)
    };
    let answer = plausibility.answer(asked, run, |answer| &mut answer.last)?;
    if answer.status == Status::Ok {
        let kept = kept(&command.input.file, &profile, &command.keep, &record, console)?;
        write_gas(&answer, kept.as_ref(), &command.out, to_stdout)?;
        if let Some(path) = views.picture {
            output::write(path, twinlag_pages::gas_picture(&record, &answer)?)?;
        }
        if let Some((path, model)) = views.save.zip(answer.model(&record)) {
            output::model(path, &model)?;
        }
    }
    if let Some(path) = views.report {
        let report =
            twinlag_pages::gas_report(&record, &answer, &report::making(&[&command.input.file], command.is_static))?;
        output::write(path, report)?;
    }
    print::compensation(&answer, &command.out, to_stdout, console)?;
    Ok(grades::strictly(command.input.method.strict, |strict| exit_code(&answer, strict)))
}

/// The gas temperature of a record.
pub(crate) fn ask(record: &Record, options: &CompensateOptions, console: Console) -> Result<Compensation, Failure> {
    let progress = Progress::start(console, format!("compensating {} samples", record.len()));
    twinlag::compensate_watched(record, options, &|task, done, total| progress.watch(task, done, total))
        .map_err(|error| Failure::in_file(error, &record.source))
}

/// Writes the gas temperature with its standard deviation, its grade, and what is kept of the file.
pub(crate) fn write_gas(
    answer: &Compensation,
    kept: Option<&Kept>,
    out: &Path,
    to_stdout: bool,
) -> Result<(), Failure> {
    output::data(out, to_stdout, |out| answer.write_csv(out, kept))
}

/// The exit code of a compensation, which is asked for the gas temperature.
pub(crate) fn exit_code(answer: &Compensation, strict: bool) -> u8 {
    if answer.status != Status::Ok {
        return 4;
    }
    let is_partial = matches!(answer.verdict, Some(Verdict::PartlyExplained | Verdict::Unexplained));
    grades::exit_code(&[answer.judgement.grade], &[], is_partial, strict)
}
