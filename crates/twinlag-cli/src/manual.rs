//! `twinlag completions SHELL` and `twinlag man --out FOLDER`: what shells and `man` know of the program.

use std::fs;
use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;

use crate::arguments::Arguments;
use crate::console::Console;
use crate::failure::Failure;
use crate::print;

/// Prints the script for a shell.
pub(crate) fn completions(shell: Shell) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "twinlag", &mut script);
    print::on_stdout(&String::from_utf8_lossy(&script))?;
    Ok(0)
}

/// Writes a page for the program and one for each of its commands.
pub(crate) fn pages(folder: &Path, console: Console) -> Result<u8, Failure> {
    let wrong = |error| Failure::Other(format!("{}: cannot be created: {error}", folder.display()));
    fs::create_dir_all(folder).map_err(wrong)?;
    let wrong = |error| Failure::Other(format!("{}: cannot be written: {error}", folder.display()));
    clap_mangen::generate_to(Arguments::command(), folder).map_err(wrong)?;
    console.note(|| format!("read them with: man {}", folder.join("twinlag.1").display()));
    Ok(0)
}
