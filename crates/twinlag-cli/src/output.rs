//! Output files: checked before the work begins, and overwritten only if the user asks for it.

use std::fs::File;
use std::io::{ErrorKind, Write, stdout};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};
use twinlag::Model;
use twinlag::record::RecordError;

use crate::console::Console;
use crate::failure::Failure;
use crate::invocation::Invocation;
use crate::place;

/// A file to be written, and the option that names it.
pub(crate) type Output<'a> = (&'static str, &'a Path);

/// Refuses, before any work, outputs that could not be written or would overwrite something.
pub(crate) fn check(record: &Path, outputs: &[Output<'_>], force: bool) -> Result<(), Failure> {
    let usage = |text: String| Err(Failure::Usage(text));
    let mut seen: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in outputs {
        place::expect_file(path)?;
        let folder = folder_of(path);
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
        if is_same(record, &whole) {
            return usage(format!("{} is the record itself: choose another name", path.display()));
        }
        if let Some((other, _)) = seen.iter().find(|s| s.1 == whole) {
            return usage(format!("{other} and {option} name the same file: each needs one of its own"));
        }
        seen.push((option, whole));
        if path.exists() && !force {
            return usage(format!("{} exists: choose another name, or add --force", path.display()));
        }
        // Begun, and removed again: a folder that takes no files is noticed before the work, not after it.
        part_of(path).map_err(|e| cannot_be_written(path, &e))?;
    }
    Ok(())
}

/// Whether two paths lead to one file.
pub(crate) fn is_same(one: &Path, other: &Path) -> bool {
    one.canonicalize().is_ok_and(|one| other.canonicalize().is_ok_and(|other| one == other))
}

/// The picture, the report and the model that go with a table of numbers.
#[derive(Default)]
pub(crate) struct Views<'a> {
    pub(crate) picture: Option<&'a Path>,
    pub(crate) report: Option<&'a Path>,
    pub(crate) save: Option<&'a Path>,
}

/// Checks the outputs of a table of numbers, its picture and its report. Returns whether the table
/// goes to standard output, `-`.
///
/// - `model`: what `--model` reads, which only another model may replace
pub(crate) fn check_data(
    record: &Path,
    model: Option<&Path>,
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
    let views = [("--picture", views.picture), ("--report", views.report), ("--save", views.save)];
    let views = views.into_iter().filter_map(|(option, path)| Some((option, path?)));
    let outputs: Vec<Output<'_>> = table.into_iter().chain(views).collect();
    let is_model = |path: &Path| model.is_some_and(|model| is_same(model, path));
    if let Some((_, path)) = outputs.iter().find(|(option, path)| *option != "--save" && is_model(path)) {
        return Err(Failure::Usage(format!("{} is the model that --model reads: choose another name", path.display())));
    }
    check(record, &outputs, force)?;
    Ok(to_stdout)
}

/// Writes a model for `--model` of other commands.
pub(crate) fn model(path: &Path, model: &Model) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(model);
    write(path, text.map_err(|e| Failure::Other(format!("the model cannot be written as JSON: {e}")))?)
}

/// Writes a table of numbers, row by row, to a file or to standard output.
pub(crate) fn data(
    out: &Path,
    to_stdout: bool,
    write_csv: impl FnOnce(&mut UntilClosed<&mut dyn Write>) -> Result<(), RecordError>,
) -> Result<(), Failure> {
    let written = |out: &mut dyn Write, name: &str| {
        write_csv(&mut UntilClosed::new(out)).map_err(|error| match error {
            RecordError::CannotWrite { reason } => Failure::Other(format!("{name}: cannot be written: {reason}")),
            other => twinlag::Error::from(other).into(),
        })
    };
    if to_stdout {
        return written(&mut stdout().lock(), "standard output");
    }
    replace(out, |file| written(file, &out.display().to_string()))
}

/// Writes a file beside the one that it replaces when it is whole: a run that fails leaves the old one, or none; one that is killed
/// leaves the part beside it, `.twinlag-*.part`. The new file has the permissions of the old one, and no other hard links.
pub(crate) fn replace(path: &Path, write: impl FnOnce(&mut File) -> Result<(), Failure>) -> Result<(), Failure> {
    let failed = |error: std::io::Error| cannot_be_written(path, &error);
    let Some((mut part, target)) = part_of(path).map_err(failed)? else {
        return write(&mut File::create(path).map_err(failed)?);
    };
    write(part.as_file_mut())?;
    part.as_file().sync_all().map_err(failed)?;
    part.persist(target).map_err(|error| failed(error.error))?;
    Ok(())
}

/// A new file beside the one that `path` is, and the path of that; `None` where it is written in place: what is no file, a pipe or a
/// device, a standard stream, a link that leads nowhere yet, and a file in a folder that takes no new ones.
fn part_of(path: &Path) -> std::io::Result<Option<(NamedTempFile<File>, PathBuf)>> {
    let is_link = std::fs::symlink_metadata(path).is_ok_and(|there| there.is_symlink());
    // Whoever opened a standard stream holds the file that it is.
    let is_stream = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/proc"].iter().any(|stream| path.starts_with(stream));
    let (target, old) = match path.canonicalize() {
        // Whoever reads a pipe would take an opening for all that is written.
        Ok(target) if !target.metadata()?.is_file() => return Ok(None),
        // A file that may not be written is not replaced either.
        Ok(target) => (target.clone(), Some(File::options().write(true).open(target)?.metadata()?)),
        Err(error) if error.kind() == ErrorKind::NotFound => (path.to_owned(), None),
        Err(error) => return Err(error),
    };
    if is_stream || (is_link && old.is_none()) {
        return Ok(None);
    }
    let folder = folder_of(&target);
    let part = match (new_part(folder), old) {
        (Ok(part), None) => part,
        (Ok(part), Some(old)) => {
            part.as_file().set_permissions(old.permissions())?;
            part
        }
        (Err(_), Some(_)) => return Ok(None),
        (Err(error), None) => return Err(error),
    };
    Ok(Some((part, target)))
}

/// What is written until the reader has closed the pipe, having read enough; nothing after that.
pub(crate) struct UntilClosed<W> {
    out: W,
    is_closed: bool,
}

impl<W: Write> UntilClosed<W> {
    pub(crate) fn new(out: W) -> Self {
        Self { out, is_closed: false }
    }

    fn unless_closed(&mut self, result: std::io::Result<()>) -> std::io::Result<()> {
        self.is_closed |= result.as_ref().is_err_and(|e| e.kind() == ErrorKind::BrokenPipe);
        if self.is_closed { Ok(()) } else { result }
    }
}

impl<W: Write> Write for UntilClosed<W> {
    fn write(&mut self, text: &[u8]) -> std::io::Result<usize> {
        if !self.is_closed {
            let written = self.out.write_all(text);
            self.unless_closed(written)?;
        }
        Ok(text.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        let flushed = self.out.flush();
        self.unless_closed(flushed)
    }
}

pub(crate) fn write(path: &Path, text: impl AsRef<[u8]>) -> Result<(), Failure> {
    replace(path, |file| file.write_all(text.as_ref()).map_err(|e| cannot_be_written(path, &e)))
}

/// A new file, `.twinlag-*.part`, that takes its name when it is whole. It can be read by whoever may read other new files of the user,
/// other than those in folders of temporary files.
pub(crate) fn new_part(folder: &Path) -> std::io::Result<NamedTempFile<File>> {
    let new = |path: &Path| File::options().write(true).create_new(true).open(path);
    Builder::new().prefix(".twinlag-").suffix(".part").make_in(folder, new)
}

/// A path with something appended to its name.
pub(crate) fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// The folder of a file: of a bare name this one.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The command line of this run, quoted for a shell. Of absolute paths the last name alone is kept: where files and the program lie is
/// nobody's business but the user's.
pub(crate) fn command_line() -> String {
    let quoted = |argument: String| {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+".contains(c);
        if !argument.is_empty() && argument.chars().all(is_plain) {
            argument
        } else {
            format!("'{}'", argument.replace('\'', "'\\''"))
        }
    };
    let mut arguments =
        Invocation::of_process().arguments.iter().map(|argument| argument.to_string_lossy().into_owned());
    let program = arguments.next().map(|path| file_name(&path));
    let rest = arguments.map(|argument| match argument.split_once('=') {
        Some((option, value)) if option.starts_with("--") => format!("{option}={}", without_folders(value)),
        _ => without_folders(&argument),
    });
    program.into_iter().chain(rest).map(quoted).collect::<Vec<_>>().join(" ")
}

/// The last name of an absolute path; anything else as it is.
fn without_folders(argument: &str) -> String {
    if Path::new(argument).is_absolute() { format!(".../{}", file_name(argument)) } else { argument.to_owned() }
}

fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or(path.to_owned(), |name| name.to_string_lossy().into_owned())
}

pub(crate) fn cannot_be_written(path: &Path, error: &std::io::Error) -> Failure {
    Failure::Other(format!("{}: cannot be written: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run that is broken off while it writes leaves what was there, and nothing beside it.
    #[test]
    fn a_file_that_is_not_finished_leaves_the_old_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("out.csv");
        write(&path, "old").expect("can be written");
        let broken = replace(&path, |file| {
            file.write_all(b"half of").expect("can be written");
            Err(Failure::Other("broken off".into()))
        });
        assert!(broken.is_err());
        assert_eq!(std::fs::read(&path).expect("is there"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("is there").count(), 1);
        write(&path, "new").expect("can be written");
        assert_eq!(std::fs::read(&path).expect("is there"), b"new");
    }

    /// Failed: what could not be written was noticed when the work was done.
    #[cfg(unix)]
    #[test]
    fn what_cannot_be_written_is_refused_before_the_work() {
        let folder = tempfile::tempdir().expect("a folder");
        let long = folder.path().join("a".repeat(300));
        let around = folder.path().join("around");
        std::os::unix::fs::symlink(&around, &around).expect("a link to itself");
        let mut cases = vec![long, around];
        if cfg!(target_os = "linux") {
            cases.push("/sys/kernel/out.csv".into());
        }
        for path in cases {
            let refused = check(Path::new("record.csv"), &[("--out", &path)], false).expect_err("cannot be written");
            let expected = format!("{}: cannot be written", path.display());
            assert!(refused.to_string().starts_with(&expected), "{refused}");
        }
        let path = folder.path().join("out.csv");
        check(Path::new("record.csv"), &[("--out", &path)], false).expect("can be written");
        assert!(!path.exists());
        assert_eq!(std::fs::read_dir(folder.path()).expect("is there").count(), 1);
    }

    /// What a link leads to is written, whether it is there yet or not, with nothing of a longer old file left.
    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let folder = tempfile::tempdir().expect("a folder");
        let [link, file] = ["link", "file"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink(&file, &link).expect("can be linked");
        for text in ["a longer text", "short"] {
            write(&link, text).expect("can be written");
            assert!(std::fs::symlink_metadata(&link).is_ok_and(|link| link.is_symlink()));
            assert_eq!(std::fs::read(&file).expect("is there"), text.as_bytes());
        }
    }
}
