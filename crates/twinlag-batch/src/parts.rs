//! The parts of a batch, of all its shards, as one.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use serde_json::Value;
use twinlag_study::Shard;

use crate::error::BatchError;
use crate::group::Unit;
use crate::journal::{Answers, Header, Journal};
use crate::manifest::Manifest;
use crate::row::Row;

/// Shards that are named when they are missing; chosen, so that the message stays a line.
const NAMED_SHARDS: usize = 8;

/// The path of a shard's part, beside the table: `table.csv.part-1-of-3`.
pub fn part_path(table: &Path, shard: Shard) -> PathBuf {
    let mut path = OsString::from(table);
    path.push(format!(".part-{}-of-{}", shard.index(), shard.of()));
    path.into()
}

/// The parts that lie beside a table, in the order of their shards.
///
/// # Errors
/// [`BatchError::Read`] if the folder cannot be listed.
pub fn parts_beside(table: &Path) -> Result<Vec<(Shard, PathBuf)>, BatchError> {
    let folder = table.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let unreadable = |error: std::io::Error| BatchError::Read { path: folder.to_owned(), reason: error.to_string() };
    let start = format!("{}.part-", table.file_name().unwrap_or_default().to_string_lossy());
    let mut parts = Vec::new();
    for entry in folder.read_dir().map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let shard = path.file_name().and_then(|name| {
            let (index, of) = name.to_str()?.strip_prefix(&start)?.split_once("-of-")?;
            Shard::new(index.parse().ok()?, of.parse().ok()?).ok()
        });
        if let Some(shard) = shard.filter(|shard| part_path(table, *shard).file_name() == path.file_name()) {
            parts.push((shard, path));
        }
    }
    parts.sort_by_key(|(shard, _)| (shard.of(), shard.index()));
    Ok(parts)
}

/// The parts of a batch. How it was divided does not count, but that every unit is there once.
#[derive(Debug)]
pub struct Parts {
    parts: Vec<Journal>,
    /// The part that has a unit.
    places: HashMap<String, usize>,
    asked: Value,
}

impl Parts {
    /// Reads all parts of the batch of a manifest.
    ///
    /// # Errors
    /// [`BatchError::Foreign`], [`BatchError::Twice`], [`BatchError::DamagedPart`] and [`BatchError::Busy`], each with the part;
    /// [`BatchError::Incomplete`] with the shards to run again.
    pub fn open(parts: &[(Shard, PathBuf)], manifest: &Manifest) -> Result<Self, BatchError> {
        let hash = manifest.sha256();
        let mut first: Option<Header> = None;
        let mut out = Self { parts: Vec::new(), places: HashMap::new(), asked: Value::Null };
        for (_, path) in parts {
            let (journal, header) = Journal::read_part(path).map_err(|error| match error {
                BatchError::Damaged { path, line, reason } => BatchError::DamagedPart { path, line, reason },
                BatchError::NoJournal { path } => BatchError::Foreign { path, what: "everything".to_owned() },
                error => error,
            })?;
            header.expect_part_of(&hash, first.as_ref().unwrap_or(&header), path)?;
            for unit in journal.keys() {
                if let Some(other) = out.places.insert(unit.clone(), out.parts.len()) {
                    let (first, second) = (out.parts[other].path().to_owned(), path.clone());
                    return Err(BatchError::Twice { unit: unit.clone(), first, second });
                }
            }
            out.parts.push(journal);
            first = first.or(Some(header));
        }
        out.asked = first.map_or(Value::Null, |header| header.asked().clone());
        out.expect_all(parts, manifest)?;
        Ok(out)
    }

    /// What was asked of the units.
    pub fn asked(&self) -> &Value {
        &self.asked
    }

    fn expect_all(&self, parts: &[(Shard, PathBuf)], manifest: &Manifest) -> Result<(), BatchError> {
        let units = manifest.units();
        let is_missing = |unit: &Unit| !self.places.contains_key(&unit.key());
        let Some(first) = units.iter().find(|unit| is_missing(unit)) else { return Ok(()) };
        let of = parts.iter().map(|(shard, _)| shard.of()).max().unwrap_or(1);
        let shards = manifest.shards(of);
        let mut missing: Vec<u64> =
            units.iter().zip(&shards).filter(|(unit, _)| is_missing(unit)).map(|(_, shard)| *shard).collect();
        let count = missing.len();
        missing.sort_unstable();
        missing.dedup();
        let mut named: Vec<String> = missing.iter().take(NAMED_SHARDS).map(|shard| format!("{shard}/{of}")).collect();
        if missing.len() > NAMED_SHARDS {
            named.push(format!("and {} others", missing.len() - NAMED_SHARDS));
        }
        Err(BatchError::Incomplete { units: count, all: units.len(), first: first.key(), shards: named.join(", ") })
    }
}

impl Answers for Parts {
    fn rows(&mut self, unit: &Unit) -> Result<Vec<Row>, BatchError> {
        match self.places.get(&unit.key()) {
            Some(place) => self.parts[*place].rows(unit),
            None => Ok(Vec::new()),
        }
    }
}
