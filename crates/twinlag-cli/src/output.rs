//! Output files: checked before the work begins, and overwritten only if the user asks for it.

use std::io::{ErrorKind, Write, stdout};
use std::path::{Path, PathBuf};

use crate::console::Console;
use crate::failure::Failure;

/// A file to be written, and the option that names it.
pub(crate) type Output<'a> = (&'static str, &'a Path);

/// Refuses, before any work, outputs that could not be written or would overwrite something.
pub(crate) fn check(record: &Path, outputs: &[Output<'_>], force: bool) -> Result<(), Failure> {
    let usage = |text: String| Err(Failure::Usage(text));
    let mut seen: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in outputs {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.exists() {
            let (path, folder) = (path.display(), folder.display());
            return Err(Failure::Other(format!(
                "{path}: cannot be written: there is no folder {folder}; create it, or choose another for {option}"
            )));
        }
        let folder = folder.canonicalize().map_err(|e| cannot_be_written(path, &e))?;
        let Some(name) = path.file_name().filter(|_| !path.is_dir()) else {
            return usage(format!("{} is a folder: name a file in it", path.display()));
        };
        if path.as_os_str() == "-" {
            return usage(format!("standard output is reserved for the answer: name a file for {option}"));
        }
        let whole = folder.join(name);
        if record.canonicalize().is_ok_and(|record| whole.canonicalize().is_ok_and(|out| out == record)) {
            return usage(format!("{} is the record itself: choose another name", path.display()));
        }
        if let Some((other, _)) = seen.iter().find(|s| s.1 == whole) {
            return usage(format!("{other} and {option} name the same file: each needs one of its own"));
        }
        seen.push((option, whole));
        if path.exists() && !force {
            return usage(format!("{} exists: choose another name, or add --force", path.display()));
        }
    }
    Ok(())
}

/// The picture and the report that go with a table of numbers.
pub(crate) struct Views<'a> {
    pub(crate) picture: Option<&'a Path>,
    pub(crate) report: Option<&'a Path>,
}

/// Checks the outputs of a table of numbers, its picture and its report. Returns whether the table
/// goes to standard output, `-`.
pub(crate) fn check_data(
    record: &Path,
    out: &Path,
    views: &Views<'_>,
    force: bool,
    console: Console,
) -> Result<bool, Failure> {
    let to_stdout = out == Path::new("-");
    if to_stdout && console.json {
        return Err(Failure::Usage("--out - and --json both need standard output: name a file".into()));
    }
    let table = (!to_stdout).then_some(("--out", out));
    let views = [("--picture", views.picture), ("--report", views.report)];
    let views = views.into_iter().filter_map(|(option, path)| Some((option, path?)));
    check(record, &table.into_iter().chain(views).collect::<Vec<_>>(), force)?;
    Ok(to_stdout)
}

/// Writes a table of numbers to a file or to standard output.
pub(crate) fn data(out: &Path, to_stdout: bool, text: &[u8]) -> Result<(), Failure> {
    if to_stdout {
        return match stdout().write_all(text) {
            // The reader has closed the pipe, having read enough.
            Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
            written => written.map_err(|e| Failure::Other(format!("standard output: {e}"))),
        };
    }
    write(out, text)
}

/// A table of numbers with one column more, the same in each row.
pub(crate) fn with_column(text: &[u8], name: &str, value: &str) -> Vec<u8> {
    with_cells(text, name, std::iter::repeat(value))
}

/// A table of numbers with one column more, a cell for each row.
pub(crate) fn with_cells<T: ToString>(text: &[u8], name: &str, cells: impl IntoIterator<Item = T>) -> Vec<u8> {
    let text = String::from_utf8_lossy(text);
    let cells = std::iter::once(name.to_owned()).chain(cells.into_iter().map(|cell| cell.to_string()));
    let rows = text.lines().zip(cells).map(|(row, cell)| format!("{row},{cell}\n"));
    rows.collect::<String>().into_bytes()
}

pub(crate) fn write(path: &Path, text: impl AsRef<[u8]>) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|e| cannot_be_written(path, &e))
}

/// The command line of this run, quoted for a shell.
pub(crate) fn command_line() -> String {
    let quoted = |argument: String| {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+".contains(c);
        if !argument.is_empty() && argument.chars().all(is_plain) {
            argument
        } else {
            format!("'{}'", argument.replace('\'', "'\\''"))
        }
    };
    std::env::args().map(quoted).collect::<Vec<_>>().join(" ")
}

fn cannot_be_written(path: &Path, error: &std::io::Error) -> Failure {
    Failure::Other(format!("{}: cannot be written: {error}", path.display()))
}
