//! Which files a folder or a pattern means.

use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};

use walkdir::{DirEntry, WalkDir};

use crate::error::BatchError;

/// A file that was found.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Found {
    /// Its path.
    pub path: PathBuf,
    /// Path relative to the folder searched, or to the folders before a pattern's first wildcard; of a named file, its file name.
    pub below: PathBuf,
}

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
/// assert_eq!((csv.len(), csv[1].below.to_str()), (2, Some("b.csv")));
/// assert_eq!(twinlag_batch::find(&[folder.path(), &csv[0].path])?.len(), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn find(what: &[impl AsRef<Path>]) -> Result<Vec<Found>, BatchError> {
    let mut files = Vec::new();
    for what in what.iter().map(AsRef::as_ref) {
        if what.is_dir() {
            let found = in_folder(what);
            if found.is_empty() {
                return Err(BatchError::Empty { path: what.to_owned() });
            }
            files.extend(found.into_iter().map(|path| Found::below(path, what)));
        } else if what.symlink_metadata().is_ok() {
            files.push(Found::below(what.to_owned(), what.parent().unwrap_or(Path::new(""))));
        } else {
            files.extend(fitting(what)?.into_iter().map(|path| Found::below(path, &fixed_part(what))));
        }
    }
    files.sort();
    let mut seen = HashSet::new();
    files.retain(|file| seen.insert(file.path.canonicalize().unwrap_or_else(|_| file.path.clone())));
    Ok(files)
}

impl Found {
    /// Names alone are below a folder, whatever stands between them.
    fn below(path: PathBuf, folder: &Path) -> Self {
        let rest = path.strip_prefix(folder).unwrap_or(&path);
        let below = rest.components().filter(|part| matches!(part, Component::Normal(_))).collect();
        Self { path, below }
    }
}

/// The folders of a pattern before its first wildcard.
fn fixed_part(pattern: &Path) -> PathBuf {
    let is_wild = |part: &Component<'_>| part.as_os_str().to_string_lossy().contains(['*', '?', '[']);
    pattern.components().take_while(|part| !is_wild(part)).collect()
}

/// All files of a folder and of those in it.
fn in_folder(folder: &Path) -> Vec<PathBuf> {
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
