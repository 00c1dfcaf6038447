//! Which files a folder or a pattern means.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use walkdir::{DirEntry, WalkDir};

use crate::error::BatchError;

/// The files that `what` names, in the order of their paths, each once, however it is named. What cannot be listed, and what is no
/// file, is among them: it has its row as any other file that cannot be used.
///
/// - `what`: files; folders, for all files in them and below, hidden ones left out; patterns with `*`, `?`, `[…]`, and `**` for any
///   folders
///
/// # Errors
/// [`BatchError::NothingFound`], [`BatchError::Empty`], [`BatchError::Pattern`].
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
    let mut files = Vec::new();
    for what in what.iter().map(AsRef::as_ref) {
        let found = if what.is_dir() {
            Some(below(what))
                .filter(|found| !found.is_empty())
                .ok_or_else(|| BatchError::Empty { path: what.to_owned() })?
        } else if what.symlink_metadata().is_ok() {
            vec![what.to_owned()]
        } else {
            fitting(what)?
        };
        files.extend(found);
    }
    files.sort();
    let mut seen = HashSet::new();
    files.retain(|file| seen.insert(file.canonicalize().unwrap_or_else(|_| file.clone())));
    Ok(files)
}

/// All files of a folder and of those in it.
fn below(folder: &Path) -> Vec<PathBuf> {
    let is_hidden = |entry: &DirEntry| entry.depth() > 0 && entry.file_name().to_string_lossy().starts_with('.');
    let entries = WalkDir::new(folder).follow_links(true).into_iter().filter_entry(|entry| !is_hidden(entry));
    let file = |entry: Result<DirEntry, walkdir::Error>| match entry {
        Ok(entry) => (!entry.file_type().is_dir()).then(|| entry.into_path()),
        Err(error) => error.path().map(Path::to_owned),
    };
    entries.filter_map(file).collect()
}

fn fitting(pattern: &Path) -> Result<Vec<PathBuf>, BatchError> {
    let what = pattern.display().to_string();
    let found =
        glob::glob(&what).map_err(|error| BatchError::Pattern { what: what.clone(), reason: error.to_string() })?;
    let path = |found: glob::GlobResult| found.unwrap_or_else(|error| error.path().to_owned());
    let files: Vec<PathBuf> = found.map(path).filter(|path| !path.is_dir()).collect();
    if files.is_empty() { Err(BatchError::NothingFound { what }) } else { Ok(files) }
}
