//! `twinlag compensate FILE --out OUT.csv`: the gas temperature with its standard deviation.

use std::io::stdout;
use std::path::Path;

use twinlag::record::{Decimals, write_csv};
use twinlag::{CompensateOptions, Compensation, DiagnoseOptions, Status};

use crate::arguments::{Compensate, Talk, Trust};
use crate::characterise::{model, read};
use crate::failure::Failure;
use crate::output;
use crate::print;
use crate::progress::Progress;

pub(crate) fn run(command: &Compensate, talk: Talk) -> Result<u8, Failure> {
    let to_stdout = command.out == Path::new("-");
    if to_stdout && talk.json {
        return Err(Failure::Usage("--out - and --json both want standard output: name a file".into()));
    }
    if !to_stdout {
        output::check(&command.file, &[("--out", &command.out)], command.force)?;
    }
    let options = CompensateOptions {
        diagnose: DiagnoseOptions { characterise: command.method.options()?, without: command.without.clone() },
        model: command.model.as_deref().map(model).transpose()?,
        form: command.form,
        trusted: usize::from(command.trust == Trust::T2),
    };
    let record = read(&command.file, &command.columns.selection())?;
    print::notes(&record, talk);
    let answer = {
        let progress = Progress::start(talk, format!("compensating {} samples", record.len()));
        let watch = |what: &str, done: usize, of: usize| progress.say(|| format!("{what}: {done} of {of}"));
        twinlag::compensate(&record, &options, &watch)?
    };
    if answer.status == Status::Ok {
        if to_stdout {
            write(&mut stdout().lock(), &answer)?;
        } else {
            let mut text = Vec::new();
            write(&mut text, &answer)?;
            output::write(&command.out, &text)?;
        }
    }
    print::compensation(&answer, &command.out, to_stdout, talk)?;
    Ok(if answer.status == Status::Ok { 0 } else { 4 })
}

fn write(out: &mut impl std::io::Write, answer: &Compensation) -> Result<(), Failure> {
    let columns: [(&str, &[f64]); 3] =
        [("time_s", &answer.time_s), ("gas_C", &answer.gas_c), ("gas_std_K", &answer.gas_std_k)];
    Ok(write_csv(out, &columns, Decimals::Shortest).map_err(twinlag::Error::from)?)
}
