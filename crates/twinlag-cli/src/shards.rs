//! The shards of a batch: their manifest, and their parts beside the table.

use std::fs::File;
use std::io::{BufReader, Seek as _, Write as _};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;
use twinlag_batch::{Found, GroupBy, Manifest, Parts, Unit, parts_beside};
use twinlag_study::Shard;

use crate::console::Console;
use crate::failure::Failure;
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

/// The manifest of a table.
pub(crate) fn manifest_path(table: &Path) -> PathBuf {
    let mut path = table.as_os_str().to_owned();
    path.push(".manifest");
    path.into()
}

/// Whether a file is the manifest of a table, or one of its parts.
pub(crate) fn is_beside(table: &Path, file: &Path) -> bool {
    let is_named = |name: &str| {
        let rest = table.file_name().and_then(|table| name.strip_prefix(table.to_str()?));
        rest.is_some_and(|rest| rest == ".manifest" || rest.starts_with(".part-"))
    };
    let folder = |path: &Path| path.parent().map(|folder| folder.canonicalize().ok());
    file.file_name().and_then(|name| name.to_str()).is_some_and(is_named) && folder(table) == folder(file)
}

/// Lists the units of a batch, with sizes and hashes of their files.
pub(crate) fn listed(
    what: &[PathBuf],
    group_by: Option<&GroupBy>,
    units: &[Unit],
    files: &[Found],
    threads: Option<NonZeroUsize>,
    console: Console,
) -> Result<Manifest, Failure> {
    let bar = progress::bar(console).with_message("listing files");
    let manifest = Manifest::of(what, group_by, units, files, threads, |progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
    });
    bar.finish_and_clear();
    Ok(manifest?)
}

/// The manifest of a table. The first shard makes it, and those that begin at the same time wait for it.
pub(crate) fn manifest(
    table: &Path,
    what: &[PathBuf],
    group_by: Option<&GroupBy>,
    make: impl FnOnce() -> Result<Manifest, Failure>,
) -> Result<Manifest, Failure> {
    let path = manifest_path(table);
    let failed = |error: std::io::Error| Failure::Other(format!("{}: cannot be written: {error}", path.display()));
    let mut file = File::options().read(true).write(true).create(true).truncate(false).open(&path).map_err(failed)?;
    // A file system without locks has shards that make the same manifest twice.
    let _ = file.lock();
    if file.metadata().map_err(failed)?.len() == 0 {
        let manifest = make()?;
        manifest.write(&mut file).and_then(|()| file.flush()).map_err(failed)?;
        return Ok(manifest);
    }
    file.rewind().map_err(failed)?;
    let manifest = Manifest::read(&path, BufReader::new(&file))?;
    if !manifest.is_of(what, group_by) {
        return Err(Failure::Usage(format!(
            "{}: is of other files, or of rigs known by something else: name the same, or remove it and all parts beside it",
            path.display()
        )));
    }
    Ok(manifest)
}

/// The manifest of a table, and all its parts.
pub(crate) fn all(table: &Path) -> Result<(Manifest, Parts), Failure> {
    let path = manifest_path(table);
    let file = File::open(&path).map_err(|error| {
        Failure::File(format!("{}: cannot be read: {error}; --shard makes it (option --merge)", path.display()))
    })?;
    let manifest = Manifest::read(&path, BufReader::new(&file))?;
    let parts = Parts::open(&parts_beside(table)?, &manifest)?;
    Ok((manifest, parts))
}

/// Says that a shard is done.
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
