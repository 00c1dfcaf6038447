//! Which files a folder or a pattern means.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use walkdir::{DirEntry, WalkDir};

use crate::error::BatchError;

/// The files that `what` names, in the order of their paths, each once.
///
/// - `what`: files; folders, for all files in them and below, hidden ones left out; patterns with `*`, `?`, `[…]`, and `**` for any
///   folders
///
/// # Errors
/// [`BatchError::NothingFound`], [`BatchError::Pattern`], [`BatchError::CannotList`].
///
/// ```
/// let folder = tempfile::tempdir()?;
/// for name in ["a.csv", "b.csv", "notes.txt"] {
///     std::fs::write(folder.path().join(name), "")?;
/// }
/// let csv = twinlag_batch::find(&[folder.path().join("*.csv")])?;
/// assert_eq!(csv.len(), 2);
/// assert_eq!(twinlag_batch::find(&[folder.path(), &csv[0]])?.len(), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn find(what: &[impl AsRef<Path>]) -> Result<Vec<PathBuf>, BatchError> {
    let mut files = BTreeSet::new();
    for what in what.iter().map(AsRef::as_ref) {
        if what.is_dir() {
            files.append(&mut below(what)?);
        } else if what.exists() {
            files.insert(what.to_owned());
        } else {
            files.append(&mut fitting(what)?);
        }
    }
    Ok(files.into_iter().collect())
}

/// All files of a folder and of those in it.
fn below(folder: &Path) -> Result<BTreeSet<PathBuf>, BatchError> {
    let is_hidden = |entry: &DirEntry| entry.depth() > 0 && entry.file_name().to_string_lossy().starts_with('.');
    let mut files = BTreeSet::new();
    for entry in WalkDir::new(folder).follow_links(true).into_iter().filter_entry(|entry| !is_hidden(entry)) {
        let entry = entry.map_err(|error| BatchError::CannotList {
            path: error.path().unwrap_or(folder).to_owned(),
            reason: error.to_string(),
        })?;
        if entry.file_type().is_file() {
            files.insert(entry.into_path());
        }
    }
    nonempty(files, folder)
}

fn fitting(pattern: &Path) -> Result<BTreeSet<PathBuf>, BatchError> {
    let what = pattern.display().to_string();
    let found =
        glob::glob(&what).map_err(|error| BatchError::Pattern { what: what.clone(), reason: error.to_string() })?;
    let mut files = BTreeSet::new();
    for path in found {
        let path = path.map_err(|error| BatchError::CannotList {
            path: error.path().to_owned(),
            reason: error.error().to_string(),
        })?;
        if path.is_file() {
            files.insert(path);
        }
    }
    nonempty(files, pattern)
}

fn nonempty(files: BTreeSet<PathBuf>, what: &Path) -> Result<BTreeSet<PathBuf>, BatchError> {
    if files.is_empty() { Err(BatchError::NothingFound { what: what.display().to_string() }) } else { Ok(files) }
}
