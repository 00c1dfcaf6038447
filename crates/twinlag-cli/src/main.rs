//! The `twinlag` program, which is the library of this crate, called with the arguments of the process.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(twinlag_cli::run(std::env::current_exe().ok(), std::env::args_os()))
}
