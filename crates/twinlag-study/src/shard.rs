//! The part of a study that is run by itself.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::error::StudyError;
use crate::part::Header;
use crate::study::Study;

/// The `k`-th of `n` contiguous ranges of the blocks of all cells, cell after cell. Written `k/n`,
/// counted from 0.
///
/// Contiguous, because blocks that are neighbours merge: a shard of `b` blocks of a cell is at most
/// `2 log2 b + 1` nodes, where every `n`-th block would be `b` nodes. If cells differ much in cost,
/// divide into more shards than there are machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Shard {
    index: u64,
    of: u64,
}

impl Shard {
    /// The only shard there is: all of the study.
    pub const WHOLE: Self = Self { index: 0, of: 1 };

    /// Shard `index` of `of`.
    ///
    /// # Errors
    /// [`StudyError::NoSuchShard`] unless `index < of`.
    pub fn new(index: u64, of: u64) -> Result<Self, StudyError> {
        if index < of { Ok(Self { index, of }) } else { Err(StudyError::NoSuchShard { got: format!("{index}/{of}") }) }
    }

    /// All shards of a division.
    ///
    /// - `of`: number of shards
    pub fn all(of: u64) -> impl Iterator<Item = Self> {
        (0..of).map(move |index| Self { index, of })
    }

    /// Index of the shard, from 0.
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Number of shards.
    pub fn of(&self) -> u64 {
        self.of
    }

    /// The name of the file that holds its part.
    ///
    /// ```
    /// use twinlag_study::Shard;
    ///
    /// let shard = Shard::new(1, 3)?;
    /// assert_eq!(shard.file_name(), "part-1-of-3.json");
    /// assert_eq!(Shard::of_file_name("part-1-of-3.json"), Some(shard));
    /// assert_eq!(Shard::of_file_name("part-3-of-3.json"), None);
    /// # Ok::<(), twinlag_study::StudyError>(())
    /// ```
    pub fn file_name(&self) -> String {
        format!("part-{}-of-{}.json", self.index, self.of)
    }

    /// The shard whose part is in a file of this name; `None` where it is not the name of a part.
    pub fn of_file_name(name: &str) -> Option<Self> {
        let (index, of) = name.strip_prefix("part-")?.strip_suffix(".json")?.split_once("-of-")?;
        let shard = Self::new(index.parse().ok()?, of.parse().ok()?).ok()?;
        // Numbers with a sign or with zeros before them are not of a part.
        (shard.file_name() == name).then_some(shard)
    }

    /// Trials of this shard of a study.
    ///
    /// # Errors
    /// [`StudyError::Empty`], [`StudyError::TooLarge`], [`StudyError::SameName`] for an invalid study.
    pub fn trials<S: Study>(self, study: &S) -> Result<u64, StudyError> {
        let header = Header::of(study)?;
        Ok(self.range(header.jobs()).map(|job| header.job_trials(job)).sum())
    }

    /// Whether there are trials that both would run, of a study with more blocks than shards.
    ///
    /// ```
    /// use twinlag_study::Shard;
    ///
    /// let half = Shard::new(1, 2)?;
    /// assert!(half.overlaps(Shard::WHOLE) && half.overlaps(Shard::new(1, 3)?));
    /// assert!(!half.overlaps(Shard::new(1, 4)?));
    /// # Ok::<(), twinlag_study::StudyError>(())
    /// ```
    pub fn overlaps(self, other: Self) -> bool {
        let begins_before_end = |one: Self, other: Self| {
            u128::from(one.index) * u128::from(other.of) < (u128::from(other.index) + 1) * u128::from(one.of)
        };
        begins_before_end(self, other) && begins_before_end(other, self)
    }

    pub(crate) fn range(self, jobs: u64) -> Range<u64> {
        let edge = |k: u64| (u128::from(jobs) * u128::from(k) / u128::from(self.of)) as u64;
        edge(self.index)..edge(self.index + 1)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl FromStr for Shard {
    type Err = StudyError;

    fn from_str(text: &str) -> Result<Self, StudyError> {
        let parsed = text.split_once('/').and_then(|(k, n)| Some((k.trim().parse().ok()?, n.trim().parse().ok()?)));
        let (index, of) = parsed.ok_or_else(|| StudyError::NoSuchShard { got: format!("\"{text}\"") })?;
        Self::new(index, of)
    }
}

impl TryFrom<String> for Shard {
    type Error = StudyError;

    fn try_from(text: String) -> Result<Self, StudyError> {
        text.parse()
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

/// Numbers as ranges, in their order, each once.
///
/// ```
/// assert_eq!(twinlag_study::ranges(&[9, 0, 1, 2, 2]), "0-2,9");
/// ```
pub fn ranges(numbers: &[u64]) -> String {
    let mut numbers = numbers.to_vec();
    numbers.sort_unstable();
    numbers.dedup();
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let in_words =
        runs.map(|run| if run.len() == 1 { run[0].to_string() } else { format!("{}-{}", run[0], run[run.len() - 1]) });
    in_words.collect::<Vec<_>>().join(",")
}
