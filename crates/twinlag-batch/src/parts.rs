//! The parts of a batch, of all its shards, as one.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use twinlag_study::{Shard, ranges};

use crate::digest::Digest;
use crate::error::BatchError;
use crate::group::Unit;
use crate::journal::{Answers, Journal, PartOf};
use crate::manifest::Manifest;
use crate::row::Row;

/// The path of a shard's part, beside the table: `table.csv.part-1-of-3`.
pub fn part_path(table: &Path, shard: Shard) -> PathBuf {
    let mut path = OsString::from(table);
    path.push(format!(".part-{}-of-{}", shard.index(), shard.of()));
    path.into()
}

/// The shard whose part has this name beside a table; `None` if it is no part of that.
pub fn shard_of_part(table: &Path, name: &str) -> Option<Shard> {
    let (index, of) = name.strip_prefix(table.file_name()?.to_str()?)?.strip_prefix(".part-")?.split_once("-of-")?;
    let shard = Shard::new(index.parse().ok()?, of.parse().ok()?).ok()?;
    part_path(table, shard).file_name().filter(|is| *is == name).map(|_| shard)
}

/// The parts that lie beside a table, in the order of their shards.
///
/// # Errors
/// [`BatchError::Read`] if the folder cannot be listed.
pub fn parts_beside(table: &Path) -> Result<Vec<(Shard, PathBuf)>, BatchError> {
    let folder = table.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let unreadable = |error: std::io::Error| BatchError::Read { path: folder.to_owned(), reason: error.to_string() };
    let mut parts = Vec::new();
    for entry in folder.read_dir().map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let shard = path.file_name().and_then(|name| shard_of_part(table, name.to_str()?));
        parts.extend(shard.map(|shard| (shard, path)));
    }
    parts.sort_by_key(|(shard, _)| (shard.of(), shard.index()));
    Ok(parts)
}

/// How many units of a shard are done, whether its part is being written or not.
///
/// # Errors
/// [`BatchError::Read`], [`BatchError::Foreign`], [`BatchError::Twice`], [`BatchError::DamagedPart`].
pub fn done_in_part(table: &Path, shard: Shard, manifest: &Manifest) -> Result<usize, BatchError> {
    let path = part_path(table, shard);
    if !path.exists() {
        return Ok(0);
    }
    let part_of = PartOf { manifest: manifest.sha256().to_owned(), shard };
    Journal::done_in_part(&path, &part_of, manifest.asked()).map_err(of_part)
}

/// What is wrong with a journal, said of a part.
fn of_part(error: BatchError) -> BatchError {
    match error {
        BatchError::Damaged { path, line, reason } => BatchError::DamagedPart { path, line, reason },
        BatchError::NoJournal { path } => BatchError::Foreign { path, what: "everything".to_owned() },
        BatchError::OtherQuestion { path, what } => BatchError::Foreign { path, what },
        error => error,
    }
}

/// The parts of all shards of a batch.
#[derive(Debug)]
pub struct Parts {
    parts: Vec<Journal>,
    /// The part that has a unit, by [`Unit::digest`].
    places: HashMap<Digest, usize>,
}

impl Parts {
    /// Reads all parts of the batch of a manifest.
    ///
    /// # Errors
    /// [`BatchError::Divisions`], [`BatchError::Twice`], [`BatchError::Foreign`], [`BatchError::DamagedPart`] and [`BatchError::Busy`], each
    /// with the part; [`BatchError::NoParts`]; [`BatchError::Incomplete`] with the shards to run again.
    pub fn open(parts: &[(Shard, PathBuf)], manifest: &Manifest) -> Result<Self, BatchError> {
        let Some((division, _)) = parts.first() else { return Err(BatchError::NoParts) };
        if let Some(pair) = parts.windows(2).find(|pair| pair[0].0.of() != pair[1].0.of()) {
            return Err(BatchError::Divisions { first: pair[0].1.clone(), second: pair[1].1.clone() });
        }
        let mut out = Self { parts: Vec::new(), places: HashMap::new() };
        for (shard, path) in parts {
            let (journal, header) = Journal::read_part(path).map_err(of_part)?;
            let part_of = PartOf { manifest: manifest.sha256().to_owned(), shard: *shard };
            header.expect_part(&part_of, manifest.asked(), path)?;
            out.places.extend(journal.digests().map(|unit| (*unit, out.parts.len())));
            out.parts.push(journal);
        }
        out.expect_all(*division, manifest)?;
        Ok(out)
    }

    /// - `division`: any shard of it
    fn expect_all(&self, division: Shard, manifest: &Manifest) -> Result<(), BatchError> {
        let units = manifest.units();
        let is_missing = |unit: &Unit| !self.places.contains_key(&unit.digest());
        let Some(first) = units.iter().find(|unit| is_missing(unit)) else { return Ok(()) };
        let of = division.of();
        let shards = manifest.shards(of);
        let missing: Vec<u64> =
            units.iter().zip(&shards).filter(|(unit, _)| is_missing(unit)).map(|(_, shard)| *shard).collect();
        Err(BatchError::Incomplete {
            units: missing.len(),
            all: units.len(),
            first: first.key(),
            shards: ranges(&missing),
            of,
        })
    }
}

impl Answers for Parts {
    fn rows(&mut self, unit: &Unit) -> Result<Vec<Row>, BatchError> {
        match self.places.get(&unit.digest()) {
            Some(place) => self.parts[*place].rows(unit),
            None => Ok(Vec::new()),
        }
    }
}
