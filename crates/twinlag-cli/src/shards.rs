//! The shards of a batch: their manifest, and their parts beside the table.

use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use twinlag_batch::{Found, Manifest, Parts, Unit, done_in_part, part_path, parts_beside, shard_of_part};
use twinlag_study::Shard;

use crate::console::Console;
use crate::failure::Failure;
use crate::output::{folder_of, new_part, with_ending};
use crate::place::Place;
use crate::submission::ShardProgress;
use crate::{print, progress};

/// What `twinlag batch --shard` prints with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct BatchPart {
    /// `twinlag.batch-part/1`.
    schema: &'static str,
    /// File of the shard's rows.
    part: PathBuf,
    /// Index of the shard, from 0, and number of shards, as in `0/3`.
    shard: String,
}

/// How the journal of a batch on one machine ends.
pub(crate) const JOURNAL_ENDING: &str = ".journal";
/// How the manifest of a table ends.
const MANIFEST_ENDING: &str = ".manifest";

/// How the folder of what was submitted to a cluster ends.
const SUBMISSION_ENDING: &str = ".submission";

/// The folder of what was submitted of a table to a cluster.
pub(crate) fn submission_path(table: &Path) -> PathBuf {
    with_ending(table, SUBMISSION_ENDING)
}

/// The manifest of a table.
pub(crate) fn manifest_path(table: &Path) -> PathBuf {
    with_ending(table, MANIFEST_ENDING)
}

/// Whether a file is the manifest of a table, its journal, one of its parts, or of its submission to a cluster.
pub(crate) fn is_beside(table: &Path, file: &Path) -> bool {
    let submission = submission_path(table).canonicalize();
    if submission.is_ok_and(|submission| file.canonicalize().is_ok_and(|file| file.starts_with(submission))) {
        return true;
    }
    let is_in = |folder: PathBuf| folder_of(file).canonicalize().is_ok_and(|is| is == folder);
    file.file_name().and_then(|name| name.to_str()).is_some_and(|name| is_named_beside(table, name))
        && folder_of(table).canonicalize().is_ok_and(is_in)
}

/// Whether the manifest of a table, its journal or one of its parts has this name.
pub(crate) fn is_named_beside(table: &Path, name: &str) -> bool {
    let rest = table.file_name().and_then(|table| name.strip_prefix(table.to_str()?));
    rest.is_some_and(|rest| [MANIFEST_ENDING, JOURNAL_ENDING].contains(&rest) || rest.starts_with(".part-"))
}

/// Lists the units of a batch, with sizes and hashes of their files.
pub(crate) fn listed(
    what: &[PathBuf],
    asked: &Value,
    units: &[Unit],
    files: &[Found],
    threads: Option<NonZeroUsize>,
    console: Console,
) -> Result<Manifest, Failure> {
    let bar = progress::bar(console).with_message("listing files");
    let manifest = Manifest::of(what, asked.clone(), units, files, threads, |progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
    });
    bar.finish_and_clear();
    Ok(manifest?)
}

/// The manifest of a table: that of the first shard that has made one, whole and never replaced.
pub(crate) fn manifest(
    table: &Path,
    what: &[PathBuf],
    asked: &Value,
    place: &mut Place,
    make: impl FnOnce() -> Result<Manifest, Failure>,
) -> Result<Manifest, Failure> {
    let path = manifest_path(table);
    if !path.exists() {
        let made = make()?;
        let failed = |error: std::io::Error| Failure::Other(format!("{}: cannot be written: {error}", path.display()));
        let mut part = new_part(folder_of(&path)).map_err(failed)?;
        made.write(part.as_file_mut()).and_then(|()| part.as_file().sync_all()).map_err(failed)?;
        match part.persist_noclobber(&path) {
            Err(error) if error.error.kind() != ErrorKind::AlreadyExists => return Err(failed(error.error)),
            _ => {}
        }
        place.store_first(&path)?;
    }
    let manifest = read(&path)?;
    manifest.expect_same(&path, what, asked)?;
    Ok(manifest)
}

/// Refuses parts of another number of shards, saying which.
pub(crate) fn expect_one_division(
    table: &Path,
    place: &Place,
    of: u64,
    refused: fn(String) -> Failure,
) -> Result<(), Failure> {
    match place.names()?.iter().filter_map(|name| shard_of_part(table, name)).find(|shard| shard.of() != of) {
        None => Ok(()),
        Some(shard) => {
            let part = part_path(table, shard);
            Err(refused(format!("{}: is of another number of shards than {of}; remove it", part.display())))
        }
    }
}

/// What each of so many shards has left.
pub(crate) fn progress_of(table: &Path, place: &Place, of: u64) -> Result<Vec<ShardProgress>, Failure> {
    let manifest = read(&manifest_path(table))?;
    expect_one_division(table, place, of, Failure::File)?;
    let progress = |(shard, total)| {
        let done = done_in_part(table, shard, &manifest).map(|done| done as u64);
        ShardProgress {
            total,
            done: done.map_err(|error| place.said(error.into()).to_string()),
            part: part_path(table, shard),
        }
    };
    Ok(Shard::all(of).zip(manifest.units_of_shards(of)).map(progress).collect())
}

/// What was asked of the units of a table in shards.
pub(crate) fn asked(table: &Path) -> Result<Value, Failure> {
    Ok(read(&manifest_path(table))?.asked().clone())
}

fn read(path: &Path) -> Result<Manifest, Failure> {
    let file = File::open(path).map_err(|error| {
        Failure::File(format!("{}: cannot be read: {error}; run the shards first (option --shard)", path.display()))
    })?;
    Ok(Manifest::read(path, BufReader::new(file))?)
}

/// The manifest of a table, and all its parts.
pub(crate) fn all(table: &Path) -> Result<(Manifest, Parts), Failure> {
    let manifest = read(&manifest_path(table))?;
    let parts = Parts::open(&parts_beside(table)?, &manifest)?;
    Ok((manifest, parts))
}

/// Says that a shard is done.
///
/// - `table`, `part`: as the user would call them
pub(crate) fn say_done(table: &Path, part: &Path, shard: Shard, console: Console) -> Result<(), Failure> {
    if console.json {
        let (part, shard) = (part.to_owned(), shard.to_string());
        return print::json(&BatchPart { schema: "twinlag.batch-part/1", part, shard });
    }
    console.note(|| {
        let (part, table) = (part.display(), table.display());
        format!("{part}: done; when all parts are done, run `twinlag batch --merge --out {table}`")
    });
    Ok(())
}
