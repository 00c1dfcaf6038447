//! `twinlag compensate FILE --out OUT.csv`: the gas temperature with its standard deviation.

use twinlag::diagnosis::Verdict;
use twinlag::{CompensateOptions, DiagnoseOptions, Options, Status};

use crate::arguments::{Compensate, Trust};
use crate::characterise::model;
use crate::console::Console;
use crate::failure::Failure;
use crate::grades;
use crate::output::{self, Views};
use crate::print;
use crate::progress::Progress;
use crate::read::read_watched;
use crate::report;

pub(crate) fn run(command: &Compensate, console: Console) -> Result<u8, Failure> {
    let views =
        Views { picture: command.picture.as_deref(), report: command.report.as_deref(), save: command.save.as_deref() };
    let model_file = command.model.as_deref();
    let to_stdout = output::check_data(&command.input.file, model_file, &command.out, &views, command.force, console)?;
    let asked = command.input.method.options()?;
    let model = model_file.map(model).transpose()?;
    let record = read_watched(&command.input.file, &command.input.columns.profile()?, console)?;
    print::notes(&record, console);
    let plausibility = command.physics.plausibility(std::slice::from_ref(&record))?;
    let run = |characterise: Options| {
        let options = CompensateOptions {
            diagnose: DiagnoseOptions { characterise, without: command.without.clone(), ..DiagnoseOptions::default() },
            model: model.clone(),
            form: command.form,
            trusted: usize::from(command.trust == Trust::T2),
        };
        let progress = Progress::start(console, format!("compensating {} samples", record.len()));
        twinlag::compensate_watched(&record, &options, &|task, done, total| progress.watch(task, done, total))
            .map_err(|error| Failure::in_file(error, &record.source))
    };
    let answer = plausibility.answer(asked, run, |answer| &mut answer.last)?;
    if answer.status == Status::Ok {
        let columns: [(&str, &[f64]); 3] =
            [("time_s", &answer.time_s), ("gas_C", &answer.gas_c), ("gas_std_K", &answer.gas_std_k)];
        output::data(&command.out, to_stdout, &columns, ("grade", std::iter::repeat(answer.judgement.grade)))?;
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
    let is_partial = matches!(answer.verdict, Some(Verdict::PartlyExplained | Verdict::Unexplained));
    let code = |strict| grades::exit_code(&[answer.judgement.grade], &[], is_partial, strict);
    let code = grades::strictly(command.input.method.strict && answer.status == Status::Ok, code);
    Ok(if answer.status == Status::Ok { code } else { 4 })
}
