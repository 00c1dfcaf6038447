//! Which records are of one rig.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use regex::Regex;

use crate::digest::{Digest, digest};
use crate::error::BatchError;

/// What the rig of a record is known by: the folder that its file lies in, a column, or a part of the file's name.
#[derive(Clone, Debug)]
pub struct GroupBy(By);

#[derive(Clone, Debug)]
enum By {
    Folder,
    /// A column of this name, the same from its first row to its last.
    Column(String),
    Name(NamePattern),
}

/// A pattern of file names that says which part is the name of the rig.
#[derive(Clone, Debug)]
struct NamePattern {
    text: String,
    regex: Regex,
}

impl FromStr for GroupBy {
    type Err = BatchError;

    /// `folder`, `column:NAME`, or a pattern: `{rig}` stands for the name of the rig, as short as it can be, `*` for anything and `?`
    /// for one character, none of them across folders. A pattern with a `/` is matched against the end of the path, any other against
    /// the file name.
    ///
    /// ```
    /// use std::path::Path;
    /// use twinlag_batch::GroupBy;
    ///
    /// let by: GroupBy = "{rig}_run*.csv".parse()?;
    /// let rig = |file: &str| by.rig(Path::new(file), |column| Err(format!("no column {column}")));
    /// assert_eq!(rig("2024/boiler-3_run07.csv"), Ok("boiler-3".to_owned()));
    /// assert!(rig("2024/readme.txt").is_err());
    /// assert!("*.csv".parse::<GroupBy>().is_err());
    /// # Ok::<(), twinlag_batch::BatchError>(())
    /// ```
    fn from_str(text: &str) -> Result<Self, BatchError> {
        if text == "folder" {
            return Ok(Self(By::Folder));
        }
        match text.strip_prefix("column:") {
            Some("") => Err(BatchError::GroupBy { got: text.to_owned() }),
            Some(name) => Ok(Self(By::Column(name.to_owned()))),
            None => Ok(Self(By::Name(NamePattern::new(text)?))),
        }
    }
}

impl std::fmt::Display for GroupBy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.0 {
            By::Folder => f.write_str("folder"),
            By::Column(name) => write!(f, "column:{name}"),
            By::Name(pattern) => f.write_str(&pattern.text),
        }
    }
}

impl GroupBy {
    /// The name of the rig of a file.
    ///
    /// - `of_column`: the value of the column of this name, for which the file has to be read, or why it does not name a rig; asked only
    ///   where the rig is known by a column
    ///
    /// # Errors
    /// Why nothing says which rig the file is of, in words: its name does not fit the pattern, or what `of_column` says.
    pub fn rig(&self, file: &Path, of_column: impl FnOnce(&str) -> Result<String, String>) -> Result<String, String> {
        match &self.0 {
            By::Folder => {
                let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
                Ok(name_of(folder))
            }
            By::Column(name) => of_column(name),
            By::Name(pattern) => pattern
                .rig(file)
                .ok_or_else(|| format!("its name does not fit {self}, so nothing says which rig it is of")),
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
    fn rig(&self, file: &Path) -> Option<String> {
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

    /// What stands for its key in an index, whatever the length of that.
    pub(crate) fn digest(&self) -> Digest {
        digest(self.key().as_bytes())
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
