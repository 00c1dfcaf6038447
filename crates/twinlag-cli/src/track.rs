//! `twinlag track FILE --out OUT.csv`: both time constants along the record.

use twinlag::{Status, TrackOptions};

use crate::arguments::Track;
use crate::characterise::model;
use crate::console::Console;
use crate::failure::Failure;
use crate::grades;
use crate::keep::{self, kept};
use crate::live;
use crate::output::{self, Views};
use crate::print;
use crate::progress::Progress;
use crate::read::read_watched;
use crate::report;
use crate::several::with_sensors;

pub(crate) fn run(command: &Track, console: Console) -> Result<u8, Failure> {
    if let Some(rows) = command.live {
        return live::run(command, rows as usize, console);
    }
    let views = Views { picture: command.picture.as_deref(), report: command.report.as_deref(), ..Views::default() };
    let model_file = command.model.as_deref();
    let to_stdout = output::check_data(&command.input.file, model_file, &command.out, &views, command.force, console)?;
    let options = TrackOptions {
        characterise: command.input.method.options()?,
        model: model_file.map(model).transpose()?,
        window_s: command.window,
    };
    let profile = command.input.columns.profile()?;
    let mut record = read_watched(&command.input.file, &profile, console)?;
    if let Some(model) = &options.model {
        with_sensors(&mut record, &model.channels, "the model", &profile, console);
    }
    keep::check(&command.input.file, &profile, &command.keep, &record, console)?;
    print::notes(&record, console);
    let answer = {
        let progress = Progress::start(console, format!("tracking {} samples", record.len()));
        twinlag::track_watched(&record, &options, &|task, done, total| progress.watch(task, done, total))
            .map_err(|error| Failure::in_file(error, &record.source))?
    };
    if !answer.time_s.is_empty() {
        let kept = kept(&command.input.file, &profile, &command.keep, &record, console)?;
        output::data(&command.out, to_stdout, |out| answer.write_csv(out, kept.as_ref()))?;
        if let Some(path) = views.picture {
            output::write(path, twinlag_pages::track_picture(&answer)?)?;
        }
    }
    if let Some(path) = views.report {
        let report =
            twinlag_pages::track_report(&record, &answer, &report::making(&[&command.input.file], command.is_static))?;
        output::write(path, report)?;
    }
    print::track(&answer, &command.out, to_stdout, console)?;
    let is_partial = answer.status == Status::ModelRejected;
    let code = |strict| grades::exit_code(&[answer.judgement.grade], &[], is_partial, strict);
    Ok(grades::strictly(command.input.method.strict, code))
}
