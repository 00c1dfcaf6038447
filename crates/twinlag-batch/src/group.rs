//! Which records are of one rig.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use regex::Regex;

use crate::error::BatchError;

/// What the rig of a record is known by.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum GroupBy {
    /// The folder that its file lies in.
    Folder,
    /// A column of this name, the same from its first row to its last.
    Column(String),
    /// A part of the file's name.
    Name(NamePattern),
}

/// A pattern of file names that says which part is the name of the rig.
#[derive(Clone, Debug)]
pub struct NamePattern {
    text: String,
    regex: Regex,
}

impl FromStr for GroupBy {
    type Err = BatchError;

    /// `folder`, `column:NAME`, or a pattern: `{rig}` stands for the name of the rig, as short as it can be, `*` for anything and `?`
    /// for one character, none of them across folders. A pattern with a `/` is of the path's end, any other of the file's name.
    ///
    /// ```
    /// use std::path::Path;
    /// use twinlag_batch::GroupBy;
    ///
    /// let GroupBy::Name(pattern) = "{rig}_run*.csv".parse()? else { panic!("a pattern") };
    /// assert_eq!(pattern.rig(Path::new("2024/boiler-3_run07.csv")), Some("boiler-3".to_owned()));
    /// assert_eq!(pattern.rig(Path::new("2024/readme.txt")), None);
    /// assert!("*.csv".parse::<GroupBy>().is_err());
    /// # Ok::<(), twinlag_batch::BatchError>(())
    /// ```
    fn from_str(text: &str) -> Result<Self, BatchError> {
        if text == "folder" {
            return Ok(Self::Folder);
        }
        match text.strip_prefix("column:") {
            Some("") => Err(BatchError::GroupBy { got: text.to_owned() }),
            Some(name) => Ok(Self::Column(name.to_owned())),
            None => Ok(Self::Name(NamePattern::new(text)?)),
        }
    }
}

impl std::fmt::Display for GroupBy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Folder => f.write_str("folder"),
            Self::Column(name) => write!(f, "column:{name}"),
            Self::Name(pattern) => f.write_str(&pattern.text),
        }
    }
}

impl NamePattern {
    fn new(text: &str) -> Result<Self, BatchError> {
        let wrong = || BatchError::GroupBy { got: text.to_owned() };
        let [before, after] = text.split("{rig}").collect::<Vec<_>>().try_into().map_err(|_| wrong())?;
        let part = |text: &str| regex::escape(text).replace(r"\*", "[^/]*").replace(r"\?", "[^/]");
        let regex = format!("(?:^|/){}(?<rig>[^/]+?){}$", part(before), part(after));
        Ok(Self { text: text.to_owned(), regex: Regex::new(&regex).map_err(|_| wrong())? })
    }

    /// The name of the rig; `None` where the file's name does not fit.
    pub fn rig(&self, file: &Path) -> Option<String> {
        let is_of_path = self.text.contains('/');
        let whole = if is_of_path { file.as_os_str() } else { file.file_name()? };
        let path = whole.to_string_lossy().replace('\\', "/");
        Some(self.regex.captures(&path)?["rig"].to_owned())
    }
}

/// What one question is asked of.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unit {
    /// A record by itself.
    Record(PathBuf),
    /// The records of one rig.
    Rig {
        /// Its name.
        name: String,
        /// Their files, in order.
        files: Vec<PathBuf>,
    },
    /// A file of which nothing says which rig it is of.
    WithoutRig {
        /// The file.
        file: PathBuf,
        /// Why.
        reason: String,
    },
}

impl Unit {
    /// Its files.
    pub fn files(&self) -> &[PathBuf] {
        match self {
            Self::Record(file) | Self::WithoutRig { file, .. } => std::slice::from_ref(file),
            Self::Rig { files, .. } => files,
        }
    }

    /// A name that no other unit of the batch has.
    pub(crate) fn key(&self) -> String {
        match self {
            Self::Rig { name, .. } => format!("rig {name}"),
            Self::Record(file) | Self::WithoutRig { file, .. } => format!("file {}", name_of(file)),
        }
    }
}

/// The name of a file as text that no other file has: what is no Unicode in it is written as its bytes.
#[expect(clippy::unnecessary_debug_formatting, reason = "what is no Unicode would be replaced by one sign for all")]
pub fn name_of(file: &Path) -> String {
    file.to_str().map_or_else(|| format!("{file:?}").trim_matches('"').to_owned(), str::to_owned)
}

/// Each file by itself.
pub fn each(files: Vec<PathBuf>) -> Vec<Unit> {
    files.into_iter().map(Unit::Record).collect()
}

/// The files by their rigs, in the order of the rigs' names; those without a rig follow.
///
/// - `rigs`: the rig of each file, or why there is none
///
/// # Panics
/// If there are not as many rigs as files.
pub fn grouped(files: Vec<PathBuf>, rigs: Vec<Result<String, String>>) -> Vec<Unit> {
    assert_eq!(files.len(), rigs.len(), "each file has a rig, or a reason why not");
    let mut by_rig: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    let mut without = Vec::new();
    for (file, rig) in files.into_iter().zip(rigs) {
        match rig {
            Ok(name) => by_rig.entry(name).or_default().push(file),
            Err(reason) => without.push(Unit::WithoutRig { file, reason }),
        }
    }
    by_rig.into_iter().map(|(name, files)| Unit::Rig { name, files }).chain(without).collect()
}

/// The rig of a file by its folder or its name; `None` where that is by a column, for which the file has to be read.
pub fn rig_by_path(file: &Path, by: &GroupBy) -> Option<Result<String, String>> {
    match by {
        GroupBy::Column(_) => None,
        GroupBy::Folder => {
            let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            Some(Ok(name_of(folder)))
        }
        GroupBy::Name(pattern) => Some(
            pattern
                .rig(file)
                .ok_or_else(|| format!("its name does not fit {}, so nothing says which rig it is of", pattern.text)),
        ),
    }
}
