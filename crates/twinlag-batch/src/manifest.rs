//! The files of a batch as they were when it was divided into shards, so that any machine that sees them asks the same.
//!
//! One line of JSON says what the batch is of and what is asked, each further one has a unit, and the last one how many there are, with
//! the hash of all before. A manifest that was cut off or edited is refused.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::io::{BufRead, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use twinlag_study::Shard;

use crate::asked::difference;
use crate::digest::{sha256, sha256_of_file};
use crate::error::BatchError;
use crate::find::Found;
use crate::group::{Unit, name_of};
use crate::run::{Progress, map};

/// Name and number of the format.
const SCHEMA: &str = "twinlag.manifest/2";
/// How every manifest begins.
pub(crate) const START: &str = "{\"schema\":\"twinlag.manifest/";
/// What a file counts beside its bytes when shards are balanced; chosen: what opening one costs beside reading it.
const FILE_BYTES: u64 = 1 << 12;

/// What a batch asks, and its units, with size and hash of their files.
#[derive(Clone, Debug, PartialEq)]
pub struct Manifest {
    header: Header,
    units: Vec<Listed>,
    /// The place of the unit that each file is of.
    places: HashMap<PathBuf, usize>,
    /// Of all lines but the last.
    sha256: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    schema: String,
    /// Folders, patterns and files that were named.
    what: Vec<String>,
    /// What is asked of each unit.
    asked: Value,
}

/// A unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Listed {
    /// The name of the rig; `None` of a record by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rig: Option<String>,
    /// Why nothing says which rig it is of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    without_rig: Option<String>,
    files: Vec<ListedFile>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct ListedFile {
    path: PathBuf,
    /// As in [`Found`].
    below: PathBuf,
    /// `None` where it could not be read.
    #[serde(flatten)]
    content: Option<Content>,
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Content {
    bytes: u64,
    sha256: String,
}

/// The last line.
#[derive(PartialEq, Serialize, Deserialize)]
struct End {
    units: usize,
    /// Of all lines before.
    sha256: String,
}

fn names(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|path| name_of(path)).collect()
}

/// One line of a manifest.
fn line(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("names are text") + "\n"
}

impl Content {
    fn of(path: &Path) -> Option<Self> {
        let bytes = path.metadata().ok()?.len();
        Some(Self { bytes, sha256: sha256_of_file(path).ok()? })
    }
}

impl Manifest {
    /// Lists units, and reads all their files.
    ///
    /// - `what`: folders, patterns and files that were named
    /// - `asked`: the question; all shards have to ask the same
    /// - `found`: the files of all units
    ///
    /// # Errors
    /// [`BatchError::NoUnicode`].
    pub fn of(
        what: &[PathBuf],
        asked: Value,
        units: &[Unit],
        found: &[Found],
        threads: Option<NonZeroUsize>,
        progress: impl FnMut(Progress),
    ) -> Result<Self, BatchError> {
        if let Some(file) = found.iter().find(|file| file.path.to_str().is_none()) {
            return Err(BatchError::NoUnicode { file: name_of(&file.path) });
        }
        let contents = map(found, threads, |file| Content::of(&file.path), progress);
        let listed: HashMap<&Path, ListedFile> = found
            .iter()
            .zip(contents)
            .map(|(file, content)| {
                let Found { path, below } = file.clone();
                (file.path.as_path(), ListedFile { path, below, content })
            })
            .collect();
        let unit = |unit: &Unit| {
            let files = unit.files().iter().filter_map(|file| listed.get(file.as_path()).cloned()).collect();
            let (rig, without_rig) = match unit {
                Unit::Record(_) => (None, None),
                Unit::Rig { name, .. } => (Some(name.clone()), None),
                Unit::WithoutRig { reason, .. } => (None, Some(reason.clone())),
            };
            Listed { rig, without_rig, files }
        };
        let header = Header { schema: SCHEMA.to_owned(), what: names(what), asked };
        Ok(Self::new(header, units.iter().map(unit).collect()))
    }

    fn new(header: Header, units: Vec<Listed>) -> Self {
        let of_unit = |(place, unit): (usize, &Listed)| {
            unit.files.iter().map(|file| (file.path.clone(), place)).collect::<Vec<_>>()
        };
        let places = units.iter().enumerate().flat_map(of_unit).collect();
        let mut manifest = Self { header, units, places, sha256: String::new() };
        manifest.sha256 = sha256(manifest.body().as_bytes());
        manifest
    }

    /// Reads a manifest.
    ///
    /// - `path`: for messages
    ///
    /// # Errors
    /// [`BatchError::DamagedManifest`].
    pub fn read(path: &Path, text: impl BufRead) -> Result<Self, BatchError> {
        let (mut header, mut units, mut end) = (None, Vec::new(), None);
        let damaged = |line, reason: String| BatchError::DamagedManifest { path: path.to_owned(), line, reason };
        let mut last = 0;
        for (line, text) in (1..).zip(text.lines()) {
            last = line;
            let text = text.map_err(|error| damaged(line, error.to_string()))?;
            let wrong = |error: serde_json::Error| damaged(line, error.to_string());
            if header.is_none() {
                let is: Header = serde_json::from_str(&text).map_err(wrong)?;
                if is.schema != SCHEMA {
                    return Err(damaged(line, format!("expected {SCHEMA}, got {}", is.schema)));
                }
                header = Some(is);
            } else if let Ok(is) = serde_json::from_str::<End>(&text) {
                end = Some(is);
            } else {
                units.push(serde_json::from_str(&text).map_err(wrong)?);
            }
        }
        let (Some(header), Some(end)) = (header, end) else {
            return Err(damaged(last, "it is cut off".to_owned()));
        };
        let manifest = Self::new(header, units);
        let is_whole = end == manifest.end() && manifest.units.iter().all(|unit| !unit.files.is_empty());
        if is_whole { Ok(manifest) } else { Err(damaged(last, "the lines do not fit their hash".to_owned())) }
    }

    /// Writes it.
    ///
    /// # Errors
    /// Those of writing.
    pub fn write(&self, mut out: impl Write) -> std::io::Result<()> {
        out.write_all(self.body().as_bytes())?;
        out.write_all(line(&self.end()).as_bytes())
    }

    /// All lines but the last.
    fn body(&self) -> String {
        let mut text = line(&self.header);
        self.units.iter().for_each(|unit| text.push_str(&line(unit)));
        text
    }

    fn end(&self) -> End {
        End { units: self.units.len(), sha256: self.sha256.clone() }
    }

    /// Its own hash: parts of batches that differ in it are not mixed.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// What is asked of each unit.
    pub fn asked(&self) -> &Value {
        &self.header.asked
    }

    /// Refuses to be of other files than are named now, and of another question.
    ///
    /// - `path`: its own, for messages
    ///
    /// # Errors
    /// [`BatchError::OtherBatch`].
    pub fn expect_same(&self, path: &Path, what: &[PathBuf], asked: &Value) -> Result<(), BatchError> {
        let other = |difference: String| Err(BatchError::OtherBatch { path: path.to_owned(), difference });
        if self.header.what != names(what) {
            return other(format!("it is of {}", self.header.what.join(", ")));
        }
        match difference(self.asked(), asked) {
            None => Ok(()),
            Some(setting) => other(format!("it differs in {setting}")),
        }
    }

    /// Its units, in the order of the table.
    pub fn units(&self) -> Vec<Unit> {
        let unit = |listed: &Listed| {
            let mut files = listed.files.iter().map(|file| file.path.clone());
            match (&listed.rig, &listed.without_rig) {
                (Some(name), _) => Some(Unit::Rig { name: name.clone(), files: files.collect() }),
                (None, Some(reason)) => Some(Unit::WithoutRig { file: files.next()?, reason: reason.clone() }),
                (None, None) => files.next().map(Unit::Record),
            }
        };
        self.units.iter().filter_map(unit).collect()
    }

    /// Those of these files that it does not list.
    pub fn unlisted(&self, mut found: Vec<Found>) -> Vec<Found> {
        found.retain(|file| !self.places.contains_key(&file.path));
        found
    }

    /// The files of a shard.
    pub fn files_of(&self, shard: Shard) -> Vec<Found> {
        let units = self.units.iter().zip(self.shards(shard.of())).filter(|(_, of)| *of == shard.index());
        let files = units.flat_map(|(unit, _)| &unit.files);
        files.map(|file| Found { path: file.path.clone(), below: file.below.clone() }).collect()
    }

    /// The units of a shard, in the order of the table. Shards have as much to read as can be: the largest unit goes first, each to the
    /// shard that has least.
    pub fn units_of(&self, shard: Shard) -> Vec<Unit> {
        let shards = self.shards(shard.of());
        let units = self.units().into_iter().zip(shards);
        units.filter(|(_, of)| *of == shard.index()).map(|(unit, _)| unit).collect()
    }

    /// How many units each of so many shards has.
    pub fn units_of_shards(&self, of: u64) -> Vec<u64> {
        let mut counts = vec![0; of as usize];
        self.shards(of).into_iter().for_each(|shard| counts[shard as usize] += 1);
        counts
    }

    /// The shard, of so many, that each unit belongs to.
    pub(crate) fn shards(&self, of: u64) -> Vec<u64> {
        let bytes = |listed: &Listed| {
            let each = |file: &ListedFile| FILE_BYTES + file.content.as_ref().map_or(0, |content| content.bytes);
            listed.files.iter().map(each).sum::<u64>()
        };
        let mut largest_first: Vec<usize> = (0..self.units.len()).collect();
        largest_first.sort_by_key(|place| (Reverse(bytes(&self.units[*place])), *place));
        // Of shards that are more than the units the last ones have none.
        let used = of.min(self.units.len() as u64);
        let mut loads: BinaryHeap<Reverse<(u64, u64)>> = (0..used).map(|shard| Reverse((0, shard))).collect();
        let mut shards = vec![0; self.units.len()];
        for place in largest_first {
            let Reverse((load, shard)) = loads.pop().expect("there is a shard");
            shards[place] = shard;
            loads.push(Reverse((load + bytes(&self.units[place]), shard)));
        }
        shards
    }

    /// Why a file of a unit is not what it was, in words; `None` where all are.
    pub fn change_in(&self, unit: &Unit) -> Option<String> {
        let listed = &self.units[*self.places.get(unit.files().first()?)?];
        listed.files.iter().find_map(|file| {
            let is_same = Content::of(&file.path) == file.content;
            (!is_same).then(|| {
                format!(
                    "{}: has changed since the batch was divided into shards, or is gone: put it back, or remove manifest and parts to divide \
                     the batch anew",
                    name_of(&file.path)
                )
            })
        })
    }
}
