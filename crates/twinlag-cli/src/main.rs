//! The `twinlag` program: identifies the dynamics of two temperature sensors from their readings alone.
//!
//! The program is a thin layer over the crate `twinlag`: it reads arguments, shows progress and prints
//! answers. Data go to standard output, messages to standard error. Exit codes: 0 answered; 2 wrong
//! usage; 3 the file cannot be used; 4 the data were read but cannot answer the question (the answer is
//! still printed, with a `status` that says why); 75 a shard of a study is missing; 1 any other error.

mod arguments;
mod characterise;
mod compensate;
mod demo;
mod diagnose;
mod failure;
mod live;
mod output;
mod print;
mod progress;
mod simulate;
mod study;
mod track;

use std::process::ExitCode;

use clap::Parser;

use crate::arguments::{Arguments, Command};

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let talk = arguments.talk();
    let result = match arguments.command {
        Command::Characterise(command) => characterise::run(&command, talk),
        Command::Diagnose(command) => diagnose::run(&command, talk),
        Command::Compensate(command) => compensate::run(&command, talk),
        Command::Simulate(command) => simulate::run(&command, talk),
        Command::Track(command) => track::run(&command, talk),
        Command::Study(command) => study::run(&command, talk),
        Command::Demo(command) => demo::run(&command, talk),
    };
    match result {
        Ok(code) => ExitCode::from(code),
        Err(failure) => {
            eprintln!("twinlag: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}
