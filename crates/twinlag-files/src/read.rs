//! From a file to a table: what format it is, which group is meant, what the notes say.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use twinlag_record::{Note, RecordError, Table, gzip};

use crate::choice::{Choice, choose, joined};
use crate::contents::{Contents, Group};
use crate::error::FileError;
use crate::fault::Fault;
use crate::format::Format;
use crate::input::{Input, head_of_bytes};
use crate::join::Base;
use crate::series::{Loaded, Opened, Series, Values};

/// Reads a group of channels of a file as a table, with notes of what was taken.
///
/// # Errors
/// The variants of [`FileError`].
pub fn read(path: impl AsRef<Path>, choice: &Choice) -> Result<Table, FileError> {
    let (input, file) = of_path(path.as_ref())?;
    read_input(input, choice, &file)
}

/// As [`read`], of a file in memory.
///
/// - `source`: its name in messages
///
/// # Errors
/// As of [`read`].
pub fn read_bytes(bytes: Vec<u8>, choice: &Choice, source: &str) -> Result<Table, FileError> {
    read_input(Input::Bytes(bytes), choice, source)
}

/// What a file holds: its groups and their channels.
///
/// # Errors
/// The variants of [`FileError`] on files that cannot be read.
pub fn contents(path: impl AsRef<Path>) -> Result<Contents, FileError> {
    let (input, file) = of_path(path.as_ref())?;
    contents_of_input(input, &file)
}

/// As [`contents`], of a file in memory.
///
/// - `source`: its name in messages
///
/// # Errors
/// As of [`contents`].
pub fn contents_of_bytes(bytes: Vec<u8>, source: &str) -> Result<Contents, FileError> {
    contents_of_input(Input::Bytes(bytes), source)
}

/// Whether the first bytes of a file, or of what gzip has compressed in it, are those of a format that is no text.
pub fn is_binary(path: impl AsRef<Path>) -> bool {
    let head = Input::Path(path.as_ref().to_owned()).head();
    head.is_ok_and(|head| Format::of(&head).is_some())
}

/// As [`is_binary`], of a file in memory.
pub fn are_binary(bytes: &[u8]) -> bool {
    head_of_bytes(bytes).is_ok_and(|head| Format::of(&head).is_some())
}

fn of_path(path: &Path) -> Result<(Input, String), FileError> {
    let file = path.display().to_string();
    if path.is_dir() {
        return Err(FileError::IsDirectory { file });
    }
    Ok((Input::Path(path.to_owned()), file))
}

/// A file that is being read.
struct Reading {
    file: String,
    format: Format,
    /// Its length, decompressed.
    bytes: u64,
    /// Whether gzip has compressed it.
    is_compressed: bool,
}

impl Reading {
    /// The file, and where its bytes are when it is decompressed.
    fn of(input: Input, file: &str) -> Result<(Self, Input), FileError> {
        let failed = |error: std::io::Error| match gzip::failure(file, &error) {
            RecordError::CannotRead { file, reason } => FileError::CannotRead { file, reason },
            damaged => damaged.into(),
        };
        let decompressed = input.decompressed().map_err(failed)?;
        let is_compressed = decompressed.is_some();
        let input = decompressed.unwrap_or(input);
        let head = input.head().map_err(failed)?;
        let bytes = input.bytes().map_err(failed)?;
        let file = file.to_owned();
        match Format::of(&head) {
            Some(Format::Foreign(foreign)) => Err(FileError::NoReader { file, foreign }),
            Some(format) => Ok((Self { file, format, bytes, is_compressed }, input)),
            None => Err(FileError::Unrecognised { file, beginning: beginning(&head) }),
        }
    }

    /// Runs what calls a format's library.
    ///
    /// Some of these panic on damaged files, in spite of what they promise. A file must never bring
    /// down the program, so this one place catches it and reports damage. Nothing that the closure
    /// touched is used afterwards: what was opened is dropped with the error.
    fn guarded<T>(&self, work: impl FnOnce() -> Result<T, Fault>) -> Result<T, FileError> {
        let outcome = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let found = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("nothing of the kind");
            Err(Fault::damaged("what the format prescribes", found))
        });
        outcome.map_err(|fault| fault.of(&self.file, self.format, self.bytes))
    }

    fn open(&self, input: Input) -> Result<Box<dyn Opened>, FileError> {
        let Some(open) = self.format.opener() else {
            let (file, format) = (self.file.clone(), self.format);
            return Err(FileError::NotBuiltIn { file, format, feature: format.feature() });
        };
        self.guarded(|| open(input, self.format))
    }

    /// The group to take, with the reason if it was not the only one. Periods take time to read, and are read where they count.
    fn choose(&self, opened: &mut dyn Opened, choice: &Choice) -> Result<(usize, Option<String>), FileError> {
        if !choice.join
            && let Ok(chosen) = choose(opened.groups(), choice, &self.file, self.format)
        {
            return Ok(chosen);
        }
        choose(&self.groups(opened)?, choice, &self.file, self.format)
    }

    /// The groups with their periods.
    fn groups(&self, opened: &mut dyn Opened) -> Result<Vec<Group>, FileError> {
        self.guarded(|| {
            let periods_s: Vec<_> = (0..opened.groups().len()).map(|group| opened.period_s(group)).collect();
            let groups = opened.groups().iter().cloned().zip(periods_s);
            Ok(groups.map(|(group, period_s)| Group { period_s, ..group }).collect())
        })
    }

    fn load(&self, opened: &mut dyn Opened, group: usize) -> Result<Loaded, FileError> {
        let described = &opened.groups()[group];
        if !described.channels.is_empty() && described.channels.iter().all(|channel| channel.obstacle.is_some()) {
            let found = format!("no channel of this group can be read as numbers:\n  {described}\n");
            return Err(Fault::unsupported(found, "choose another group, or export it as CSV").of(
                &self.file,
                self.format,
                self.bytes,
            ));
        }
        let mut loaded = self.guarded(|| opened.load(group))?;
        let name = &opened.groups()[group].name;
        if let Some((first, odd)) = unequal(&loaded.series) {
            let expected = format!("{} samples of '{}' in group '{name}'", first.len(), odd.name);
            return Err(Fault::damaged(expected, odd.len()).of(&self.file, self.format, self.bytes));
        }
        let left_out = opened.groups()[group].channels.iter().filter_map(|channel| {
            let obstacle = channel.obstacle.as_ref()?;
            Some(format!("channel '{}' was left out: {obstacle}", channel.name))
        });
        loaded.notes.extend(left_out);
        Ok(loaded)
    }

    fn cannot_join(&self, group: &Group, reason: String) -> FileError {
        FileError::CannotJoin { file: self.file.clone(), group: group.name.clone(), reason }
    }

    /// Adds the channels of the other groups, at the stamps of one.
    fn join(&self, opened: &mut dyn Opened, group: usize, loaded: &mut Loaded) -> Result<(), FileError> {
        let groups = opened.groups().to_vec();
        let others: Vec<usize> = joined(&groups).into_iter().filter(|&other| other != group).collect();
        if others.is_empty() {
            return Ok(());
        }
        let mine = Base::of(&groups[group], loaded).map_err(|reason| self.cannot_join(&groups[group], reason))?;
        for other in others {
            let its_group = &groups[other];
            let its = self.load(opened, other)?;
            let base = Base::of(its_group, &its).map_err(|reason| self.cannot_join(its_group, reason))?;
            let mut names = Vec::new();
            for (index, series) in its.series.into_iter().enumerate() {
                let Values::Numbers(values) = &series.values else { continue };
                if Some(index) == its.time || crate::series::is_time(&series.name, &series.unit) {
                    continue;
                }
                let taken = mine.take(&base, values).map_err(|reason| self.cannot_join(its_group, reason))?;
                let is_taken = loaded.series.iter().any(|present| present.name == series.name);
                let name = if is_taken { format!("{}: {}", its_group.name, series.name) } else { series.name };
                names.push(format!("'{name}'"));
                loaded.series.push(Series::numbers(name, series.unit, taken));
            }
            loaded.notes.extend(its.notes);
            let clock = if mine.has_start() {
                ""
            } else {
                "; the file gives no start times, both were taken to start together"
            };
            loaded.notes.push(format!(
                "{} of group '{}' interpolated linearly to the stamps of group '{}', not beyond its ends, not beside invalid \
                 samples, not over pauses{clock}",
                names.join(", "),
                its_group.name,
                groups[group].name,
            ));
            if let Some(ratio) = mine.faster_than(&base) {
                loaded.notes.push(format!(
                    "group '{}' has one sample for every {ratio} of group '{}': the values in between are interpolated, not read, and \
                     no model of a sensor explains them; name group '{0}' as the one whose stamps are kept",
                    its_group.name, groups[group].name,
                ));
            }
        }
        Ok(())
    }
}

fn read_input(input: Input, choice: &Choice, file: &str) -> Result<Table, FileError> {
    let (reading, input) = Reading::of(input, file)?;
    let mut opened = reading.open(input)?;
    let opened = opened.as_mut();
    let (group, why) = reading.choose(opened, choice)?;
    let mut loaded = reading.load(opened, group)?;
    if choice.join {
        reading.join(opened, group, &mut loaded)?;
    }
    let mut how = vec![format!("read as {}", reading.format), opened.version()];
    if opened.groups().len() > 1 {
        how.extend([format!("group '{}'", opened.groups()[group].name), why.unwrap_or_default()]);
    }
    how.retain(|part| !part.is_empty());
    let columns = loaded.series.into_iter().map(Series::into_column);
    let table = Table::from_columns(file, columns)?;
    let table = if reading.is_compressed { table.with_note(Note::Decompressed) } else { table };
    Ok([how.join(", ")].into_iter().chain(loaded.notes).fold(table, |table, how| table.with_note(Note::Read { how })))
}

fn contents_of_input(input: Input, file: &str) -> Result<Contents, FileError> {
    let (reading, input) = Reading::of(input, file)?;
    let mut opened = reading.open(input)?;
    let groups = reading.groups(opened.as_mut())?;
    Ok(Contents { format: reading.format, version: opened.version(), groups })
}

/// The first channel and one of another length, if there is one.
fn unequal(series: &[Series]) -> Option<(&Series, &Series)> {
    let first = series.first()?;
    series.iter().find(|other| other.len() != first.len()).map(|odd| (first, odd))
}

/// The first bytes of what no format begins with.
fn beginning(head: &[u8]) -> String {
    const SHOWN_BYTES: usize = 8;
    if head.is_empty() {
        return "nothing: it is empty".to_owned();
    }
    let bytes = head.iter().take(SHOWN_BYTES).map(|byte| format!("{byte:02x}")).collect::<Vec<_>>();
    format!("the bytes {}", bytes.join(" "))
}
