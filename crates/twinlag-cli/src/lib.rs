//! The `twinlag` program: identifies the dynamics of two temperature sensors from their readings
//! alone.
//!
//! The program is a thin layer over the crate `twinlag`: it reads arguments, shows progress and
//! prints answers. Data go to standard output, messages to standard error. It is a library so that others can bring it along, as
//! the Python package does; whoever wants answers in a program of their own takes `twinlag` itself.
//!
//! ```
//! let arguments = ["twinlag", "explain", "gain"];
//! assert_eq!(twinlag_cli::run(None, arguments.map(Into::into)), 0);
//! ```
//!
//! Exit codes: 0 answered; 2 wrong usage; 3 the file cannot be used; 4 the data were read but cannot answer the question
//! (the answer is still printed, with a `status` that says why); 75 a shard of a study is missing;
//! 1 any other error.

mod arguments;
mod batch;
mod characterise;
mod columns;
mod compensate;
mod config;
mod console;
mod demo;
mod diagnose;
mod excerpt;
mod explain;
mod failure;
mod grades;
mod if_known;
mod inspect;
mod invocation;
mod keep;
mod live;
mod manual;
mod output;
mod place;
mod plan;
mod print;
mod profile;
mod progress;
mod read;
mod records;
mod report;
mod schema;
mod settings;
mod several;
mod shards;
mod simulate;
mod sparkline;
mod study;
mod submission;
mod track;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{CommandFactory, FromArgMatches};

use crate::arguments::{Arguments, Command};
use crate::failure::Failure;
use crate::invocation::Invocation;

/// Runs the program and returns its exit code. To be called once in a process, before it has long vectors.
///
/// - `program`: what is to be started to call it again, as shards on a cluster do; `None` where nobody knows
/// - `arguments`: those of a command line, the first of which is the name of the program
pub fn run(program: Option<PathBuf>, arguments: impl IntoIterator<Item = OsString>) -> u8 {
    twinlag_memory::give_back_large();
    let invocation = Invocation { program, arguments: arguments.into_iter().collect() }.begin();
    answer(invocation).unwrap_or_else(|failure| {
        eprintln!("twinlag: {failure}");
        failure.excerpt().iter().for_each(|line| eprintln!("{line}"));
        failure.exit_code()
    })
}

/// Lets options take negative numbers, so that what says which numbers an option may have says it of these too.
fn taking_negative_numbers(command: clap::Command) -> clap::Command {
    let taking = |argument: clap::Arg| {
        let is_option = !argument.is_positional() && argument.get_action().takes_values();
        if is_option { argument.allow_negative_numbers(true) } else { argument }
    };
    command.mut_args(taking).mut_subcommands(taking_negative_numbers)
}

fn answer(invocation: &Invocation) -> Result<u8, Failure> {
    let command = taking_negative_numbers(Arguments::command());
    let (given, added) = config::with_config(invocation.arguments.clone())?;
    let parsed = command.try_get_matches_from(given).and_then(|matches| Arguments::from_arg_matches(&matches));
    let arguments = match parsed {
        Ok(arguments) => arguments,
        // Help and version are among them, and belong on standard output; a reader that has closed it has read enough.
        Err(error) => {
            let _ = error.print();
            added.iter().filter(|_| error.use_stderr()).for_each(|added| eprintln!("{added}"));
            return Ok(error.exit_code() as u8);
        }
    };
    match (carry_out(arguments), added) {
        (Err(Failure::Usage(text)), Some(added)) => Err(Failure::Usage(format!("{text}\n{added}"))),
        (answered, _) => answered,
    }
}

fn carry_out(arguments: Arguments) -> Result<u8, Failure> {
    let console = arguments.console();
    match arguments.command {
        Command::Characterise(command) => characterise::run(&command, console),
        Command::Diagnose(command) => diagnose::run(&command, console),
        Command::Compensate(command) => compensate::run(&command, console),
        Command::Simulate(command) => simulate::run(&command, console),
        Command::Inspect(command) => inspect::run(&command, console),
        Command::Batch(command) => batch::run(*command, console),
        Command::Plan(command) => plan::run(&command, console),
        Command::Track(command) => track::run(&command, console),
        Command::Study(command) => study::run(&command, console),
        Command::Explain(command) => explain::run(&command, console),
        Command::Demo(command) => demo::run(&command, console),
        Command::Completions { shell } => manual::completions(shell),
        Command::Schema { name } => schema::run(name),
        Command::Man { out } => manual::pages(&out, console),
    }
}
