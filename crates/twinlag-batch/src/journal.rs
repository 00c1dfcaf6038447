//! The journal of a batch: what is done, line by line, so that a run that was killed goes on where it stopped.
//!
//! The first line says what was asked; each further one has the rows of a unit, with the size and the time of change of its files: a
//! unit whose files have changed since is asked again. Each of these begins with its SHA-256. A line that was cut off in the middle is
//! dropped; one that does not fit its hash is an error. The journal of a shard is its part of the batch.

use std::collections::HashMap;
use std::fs::{File, Metadata, TryLockError};
use std::io::{BufRead, BufReader, Read as _, Seek, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use twinlag_study::Shard;

use crate::asked::difference;
use crate::digest::{Digest, digest, sha256};
use crate::error::BatchError;
use crate::group::{Unit, name_of};
use crate::row::Row;

/// Name and number of the format.
const SCHEMA: &str = "twinlag.batch-journal/3";

/// Digits of a SHA-256.
const HASH_DIGITS: usize = 64;

/// How every journal begins.
pub(crate) const START: &str = "{\"schema\":\"twinlag.batch-journal/";

/// How a run begins where there may be a journal of an earlier one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Begin {
    /// With a new journal; one that is there is an error.
    Create,
    /// With a new journal; one that is there is replaced.
    Replace,
    /// Where the journal ends, if there is one; with a new one otherwise.
    Resume,
}

/// What is done of a batch, on disk.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    /// Where the next line goes.
    end: u64,
    /// What is done, by [`Unit::digest`]: of each unit as many bytes, however many files it has and whatever they are called.
    done: HashMap<Digest, Done>,
}

/// Where the rows of a unit are, and of which files they are.
#[derive(Debug)]
struct Done {
    at: u64,
    bytes: usize,
    stamps: Digest,
}

/// What shows that a file has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Stamp {
    bytes: u64,
    modified_ns: i128,
}

/// The first line.
#[derive(Serialize, Deserialize)]
pub(crate) struct Header {
    schema: String,
    version: String,
    asked: Value,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    part_of: Option<PartOf>,
}

/// What a journal is a part of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PartOf {
    /// [`Manifest::sha256`](crate::Manifest::sha256) of the batch.
    pub manifest: String,
    /// The shard.
    pub shard: Shard,
}

/// Any further line, behind its hash.
#[derive(Serialize, Deserialize)]
struct Entry<Rows> {
    unit: String,
    stamps: Stamps,
    rows: Rows,
}

impl Journal {
    /// Opens the journal of a batch, which no other run may be writing.
    ///
    /// - `asked`: the question; a run that goes on has to ask the same, of the same version of this crate
    ///
    /// # Errors
    /// [`BatchError::Exists`], [`BatchError::NoJournal`], [`BatchError::OtherQuestion`], [`BatchError::Damaged`], [`BatchError::Busy`],
    /// [`BatchError::Read`], [`BatchError::Write`].
    pub fn open(path: &Path, asked: &Value, begin: Begin) -> Result<Self, BatchError> {
        Self::open_as(path, asked, None, begin)
    }

    /// Opens the journal of a shard, as [`Self::open`] does that of a batch.
    ///
    /// - `part_of`: the batch that it is a part of; a run that goes on has to be of the same shard
    ///
    /// # Errors
    /// As of [`Self::open`].
    pub fn open_part(path: &Path, asked: &Value, part_of: PartOf, begin: Begin) -> Result<Self, BatchError> {
        Self::open_as(path, asked, Some(part_of), begin)
    }

    fn open_as(path: &Path, asked: &Value, part_of: Option<PartOf>, begin: Begin) -> Result<Self, BatchError> {
        let unwritable = |error: std::io::Error| BatchError::Write { path: path.to_owned(), reason: error.to_string() };
        if begin == Begin::Create && path.exists() {
            return Err(BatchError::Exists { path: path.to_owned() });
        }
        let file =
            File::options().read(true).write(true).create(true).truncate(false).open(path).map_err(unwritable)?;
        match file.try_lock() {
            // A file system without locks has one writer as far as can be known.
            Ok(()) | Err(TryLockError::Error(_)) => {}
            Err(TryLockError::WouldBlock) => return Err(BatchError::Busy { path: path.to_owned() }),
        }
        let (schema, version) = (SCHEMA.to_owned(), env!("CARGO_PKG_VERSION").to_owned());
        let header = Header { schema, version, asked: asked.clone(), part_of };
        let mut journal = Self { file, path: path.to_owned(), end: 0, done: HashMap::new() };
        journal.expect_journal()?;
        let was = if begin == Begin::Resume { journal.take_up()? } else { None };
        if let Some(was) = was {
            was.expect_same(&header, &journal.path)?;
        }
        // One that has nothing to be cut off keeps its time of change.
        if journal.file.metadata().map_err(unwritable)?.len() != journal.end {
            journal.file.set_len(journal.end).map_err(unwritable)?;
        }
        if journal.end == 0 {
            journal.write_line(&text_of(&header, path)?)?;
        }
        Ok(journal)
    }

    /// Opens a part that nobody writes any more, to read it.
    ///
    /// # Errors
    /// As of [`Journal::open`].
    pub(crate) fn read_part(path: &Path) -> Result<(Self, Header), BatchError> {
        let unreadable = |error: std::io::Error| BatchError::Read { path: path.to_owned(), reason: error.to_string() };
        let file = File::open(path).map_err(unreadable)?;
        if matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)) {
            return Err(BatchError::Busy { path: path.to_owned() });
        }
        let mut journal = Self { file, path: path.to_owned(), end: 0, done: HashMap::new() };
        journal.expect_journal()?;
        match journal.take_up()? {
            Some(header) => Ok((journal, header)),
            None => Err(BatchError::Damaged {
                path: path.to_owned(),
                line: 1,
                reason: "its first line is cut off".to_owned(),
            }),
        }
    }

    /// How many units are done in a part, whether it is being written or not.
    ///
    /// # Errors
    /// [`BatchError::Read`], [`BatchError::NoJournal`], [`BatchError::OtherQuestion`], [`BatchError::Damaged`], [`BatchError::Foreign`],
    /// [`BatchError::Twice`].
    pub(crate) fn done_in_part(path: &Path, part: &PartOf, asked: &Value) -> Result<usize, BatchError> {
        let file =
            File::open(path).map_err(|error| BatchError::Read { path: path.to_owned(), reason: error.to_string() })?;
        let mut journal = Self { file, path: path.to_owned(), end: 0, done: HashMap::new() };
        journal.expect_journal()?;
        if let Some(header) = journal.take_up()? {
            header.expect_part(part, asked, path)?;
        }
        Ok(journal.done.len())
    }

    /// [`Unit::digest`] of the units that are done.
    pub(crate) fn digests(&self) -> impl Iterator<Item = &Digest> {
        self.done.keys()
    }

    /// Has a unit asked again, since what it led to beside its rows is gone.
    pub fn forget(&mut self, unit: &Unit) {
        self.done.remove(&unit.digest());
    }

    /// How many units it holds that are not among these, which are those of a whole batch.
    pub fn other_units(&self, units: &[Unit]) -> usize {
        self.done.len() - units.iter().filter(|unit| self.done.contains_key(&unit.digest())).count()
    }

    /// Whether a unit is done, and its files are as they were then.
    pub(crate) fn is_done(&self, unit: &Unit) -> bool {
        self.done.get(&unit.digest()).is_some_and(|done| done.stamps == digest_of(&stamps(unit)))
    }

    /// Puts down the rows of a unit.
    ///
    /// # Errors
    /// [`BatchError::Write`].
    pub(crate) fn append(&mut self, unit: &Unit, seen: Seen, rows: &[Row]) -> Result<(), BatchError> {
        let (at, stamps) = (self.end, digest_of(&seen.0));
        let text = text_of(&Entry { unit: unit.key(), stamps: seen.0, rows }, &self.path)?;
        self.write_line(&format!("{} {text}", sha256(text.as_bytes())))?;
        self.done.insert(unit.digest(), Done { at, bytes: (self.end - at) as usize, stamps });
        Ok(())
    }

    /// Refuses to replace a file that is no journal.
    fn expect_journal(&mut self) -> Result<(), BatchError> {
        let mut start = Vec::new();
        let read = (&self.file).take(START.len() as u64).read_to_end(&mut start);
        read.and_then(|_| self.file.rewind())
            .map_err(|error| BatchError::Read { path: self.path.clone(), reason: error.to_string() })?;
        let is_journal = START.as_bytes().starts_with(&start);
        if is_journal { Ok(()) } else { Err(BatchError::NoJournal { path: self.path.clone() }) }
    }

    /// Reads what an earlier run has done, and what was asked; `None` of an empty file.
    fn take_up(&mut self) -> Result<Option<Header>, BatchError> {
        let unreadable =
            |path: &Path, error: &std::io::Error| BatchError::Read { path: path.to_owned(), reason: error.to_string() };
        let mut reader = BufReader::new(&self.file);
        let (mut header, mut text) = (None, Vec::new());
        for line in 1.. {
            text.clear();
            reader.read_until(b'\n', &mut text).map_err(|error| unreadable(&self.path, &error))?;
            if text.last() != Some(&b'\n') {
                break;
            }
            let damaged = |reason: String| BatchError::Damaged { path: self.path.clone(), line, reason };
            if line == 1 {
                let was: Header = serde_json::from_slice(&text).map_err(|error| damaged(error.to_string()))?;
                was.expect_this_version(&self.path)?;
                header = Some(was);
            } else {
                let json = checked(&text).ok_or_else(|| damaged("it does not fit its hash".to_owned()))?;
                let entry: Entry<IgnoredAny> =
                    serde_json::from_slice(json).map_err(|error| damaged(error.to_string()))?;
                let done = Done { at: self.end, bytes: text.len(), stamps: digest_of(&entry.stamps) };
                self.done.insert(digest(entry.unit.as_bytes()), done);
            }
            self.end += text.len() as u64;
        }
        Ok(header)
    }

    /// Appends a line in one piece.
    fn write_line(&mut self, text: &str) -> Result<(), BatchError> {
        let line = format!("{text}\n");
        let mut write = || self.file.seek(SeekFrom::Start(self.end)).and_then(|_| self.file.write_all(line.as_bytes()));
        write().map_err(|error| BatchError::Write { path: self.path.clone(), reason: error.to_string() })?;
        self.end += line.len() as u64;
        Ok(())
    }
}

/// Gives the rows of each unit.
pub trait Answers {
    /// The rows of a unit; none of one that is not done.
    ///
    /// # Errors
    /// [`BatchError::Read`].
    fn rows(&mut self, unit: &Unit) -> Result<Vec<Row>, BatchError>;
}

impl Answers for Journal {
    fn rows(&mut self, unit: &Unit) -> Result<Vec<Row>, BatchError> {
        let Some(done) = self.done.get(&unit.digest()) else { return Ok(Vec::new()) };
        let mut line = vec![0; done.bytes];
        let mut read = || self.file.seek(SeekFrom::Start(done.at)).and_then(|_| self.file.read_exact(&mut line));
        let wrong = |reason: String| BatchError::Read { path: self.path.clone(), reason };
        read().map_err(|error| wrong(error.to_string()))?;
        let json = checked(&line).ok_or_else(|| wrong("a line no longer fits its hash".to_owned()))?;
        let entry: Entry<Vec<Row>> = serde_json::from_slice(json).map_err(|error| wrong(error.to_string()))?;
        Ok(entry.rows)
    }
}

/// A line as text, for a journal at `path`.
fn text_of(line: &impl Serialize, path: &Path) -> Result<String, BatchError> {
    serde_json::to_string(line).map_err(|error| BatchError::Write { path: path.to_owned(), reason: error.to_string() })
}

/// What stands behind the hash of a line; `None` where that is not its hash.
fn checked(line: &[u8]) -> Option<&[u8]> {
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    let (hash, text) = line.split_at_checked(HASH_DIGITS)?;
    let text = text.strip_prefix(b" ")?;
    (hash == sha256(text).as_bytes()).then_some(text)
}

impl Header {
    /// Refuses another part than this, and one that was asked something else.
    pub(crate) fn expect_part(&self, part: &PartOf, asked: &Value, path: &Path) -> Result<(), BatchError> {
        let foreign = |what: String| Err(BatchError::Foreign { path: path.to_owned(), what });
        match &self.part_of {
            None => return foreign("its batch: it is one by itself".to_owned()),
            Some(is) if is.manifest != part.manifest => return foreign("the manifest".to_owned()),
            Some(is) if is.shard != part.shard => {
                return Err(BatchError::Twice { path: path.to_owned(), shard: is.shard });
            }
            Some(_) => {}
        }
        match self.expect_same_question(asked, path) {
            Err(BatchError::OtherQuestion { what, .. }) => foreign(what),
            other => other,
        }
    }

    /// Refuses to go on with another question, or with another part.
    fn expect_same(&self, now: &Self, path: &Path) -> Result<(), BatchError> {
        self.expect_same_question(&now.asked, path)?;
        let what = match (&self.part_of, &now.part_of) {
            (was, is) if was == is => return Ok(()),
            (Some(was), Some(is)) if was.manifest == is.manifest => "the shard",
            _ => "the manifest",
        };
        Err(BatchError::OtherQuestion { path: path.to_owned(), what: what.to_owned() })
    }

    /// Refuses what another version has written.
    fn expect_this_version(&self, path: &Path) -> Result<(), BatchError> {
        let what = "the version of the program".to_owned();
        let is_same = (&self.schema[..], &self.version[..]) == (SCHEMA, env!("CARGO_PKG_VERSION"));
        if is_same { Ok(()) } else { Err(BatchError::OtherQuestion { path: path.to_owned(), what }) }
    }

    fn expect_same_question(&self, asked: &Value, path: &Path) -> Result<(), BatchError> {
        let differs = |what: &str| BatchError::OtherQuestion { path: path.to_owned(), what: what.to_owned() };
        difference(&self.asked, asked).map_or(Ok(()), |setting| Err(differs(&setting)))
    }
}

/// The files of a unit as they were before they were read.
pub(crate) struct Seen(Stamps);

impl Seen {
    pub(crate) fn now(unit: &Unit) -> Self {
        Self(stamps(unit))
    }
}

/// The name of each file of a unit, and what shows that it has changed; `None` of one that is not there.
type Stamps = Vec<(String, Option<Stamp>)>;

fn stamps(unit: &Unit) -> Stamps {
    let stamp = |file: &PathBuf| file.metadata().ok().map(|about| Stamp::of(&about));
    unit.files().iter().map(|file| (name_of(file), stamp(file))).collect()
}

/// What stands for the stamps of a unit in the index.
fn digest_of(stamps: &Stamps) -> Digest {
    digest(&serde_json::to_vec(stamps).expect("names and numbers are text"))
}

impl Stamp {
    fn of(about: &Metadata) -> Self {
        let modified_ns = about.modified().map_or(0, |at| match at.duration_since(UNIX_EPOCH) {
            Ok(after) => after.as_nanos() as i128,
            Err(before) => -(before.duration().as_nanos() as i128),
        });
        Self { bytes: about.len(), modified_ns }
    }
}
