//! The `twinlag` program: identifies the dynamics of two temperature sensors from their readings
//! alone.
//!
//! The program is a thin layer over the crate `twinlag`: it reads arguments, shows progress and
//! prints answers. Data go to standard output, messages to standard error. Exit codes: 0 answered;
//! 2 wrong usage; 3 the file cannot be used; 4 the data were read but cannot answer the question
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

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use crate::arguments::{Arguments, Command};
use crate::failure::Failure;

fn main() -> ExitCode {
    twinlag_memory::give_back_large();
    match run() {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            eprintln!("twinlag: {failure}");
            failure.excerpt().iter().for_each(|line| eprintln!("{line}"));
            ExitCode::from(failure.exit_code())
        }
    }
}

/// Lets options take negative numbers, so that what says which numbers an option may have says it of these too.
fn taking_negative_numbers(command: clap::Command) -> clap::Command {
    let taking = |argument: clap::Arg| {
        let is_option = !argument.is_positional() && argument.get_action().takes_values();
        if is_option { argument.allow_negative_numbers(true) } else { argument }
    };
    command.mut_args(taking).mut_subcommands(taking_negative_numbers)
}

fn run() -> Result<u8, Failure> {
    let command = taking_negative_numbers(Arguments::command());
    let matches = command.get_matches_from(config::with_config(std::env::args_os().collect())?);
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
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
