//! What there is of a study so far, in memory and on disk.

use std::fmt;
use std::fs;
use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Gap, StudyError};
use crate::forest::{Forest, ForestError};
use crate::hashed::{HashedError, with_hash, without_hash};
use crate::replace::replace_file;
use crate::shard::Shard;
use crate::study::{Quantity, Study};
use crate::tally::Tally;

/// Version of the layout of a study, in parts and results.
const FORMAT: u32 = 1;

/// Name and number of the layout of the file of a part: a line with its SHA-256, and a line with the part.
const FILE_SCHEMA: &str = "twinlag.study-part-file/2";

/// What a study is: parts belong together if this is equal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    format: u32,
    version: String,
    plan: String,
    trials: u64,
    block: u64,
    cells: Vec<Vec<Quantity>>,
}

impl Header {
    pub(crate) fn of<S: Study>(study: &S) -> Result<Self, StudyError> {
        let (cells, trials, block) = (study.cells(), study.trials(), study.block());
        if cells == 0 || trials == 0 || block == 0 {
            return Err(StudyError::Empty { cells, trials, block });
        }
        let blocks = trials.div_ceil(block).checked_mul(cells as u64);
        // A block's end is computed as well.
        if blocks.is_none_or(|n| n > Forest::<Tally>::LARGEST) || trials.checked_add(block).is_none() {
            return Err(StudyError::TooLarge { cells, trials, block });
        }
        let cells: Vec<_> = (0..cells).map(|cell| study.quantities(cell)).collect();
        for (cell, quantities) in cells.iter().enumerate() {
            let mut names: Vec<_> = quantities.iter().map(|q| &q.name).collect();
            names.sort_unstable();
            if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
                return Err(StudyError::SameName { cell, name: pair[0].clone() });
            }
        }
        let version = env!("CARGO_PKG_VERSION").into();
        Ok(Self { format: FORMAT, version, plan: study.plan(), trials, block, cells })
    }

    /// The study's own digest of its plan.
    pub fn plan(&self) -> &str {
        &self.plan
    }

    /// The version of this crate that wrote it.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Trials of each cell.
    pub fn trials(&self) -> u64 {
        self.trials
    }

    /// Trials of a block.
    pub fn block(&self) -> u64 {
        self.block
    }

    /// The quantities of each cell.
    pub fn cells(&self) -> &[Vec<Quantity>] {
        &self.cells
    }

    /// Blocks of each cell.
    pub(crate) fn blocks(&self) -> u64 {
        self.trials.div_ceil(self.block)
    }

    /// Blocks of all cells. Job `j` is block `j mod blocks` of cell `j / blocks`.
    pub(crate) fn jobs(&self) -> u64 {
        self.blocks() * self.cells.len() as u64
    }

    /// Trials in these blocks of a cell.
    pub(crate) fn trials_in(&self, blocks: &Range<u64>) -> Range<u64> {
        blocks.start * self.block..(blocks.end * self.block).min(self.trials)
    }

    /// Trials of a job.
    pub(crate) fn job_trials(&self, job: u64) -> u64 {
        let block = job % self.blocks();
        let trials = self.trials_in(&(block..block + 1));
        trials.end - trials.start
    }

    fn expect_same(&self, got: &Self, path: &Path) -> Result<(), StudyError> {
        let Self { format, version, plan, trials, block, cells } = self;
        expect_equal("format", format, &got.format, path)?;
        expect_equal("version of twinlag-study", version, &got.version, path)?;
        expect_equal("plan", plan, &got.plan, path)?;
        expect_equal("number of trials", trials, &got.trials, path)?;
        expect_equal("block size", block, &got.block, path)?;
        expect_equal("number of cells", &cells.len(), &got.cells.len(), path)?;
        let names = |quantities: &[Quantity]| {
            quantities.iter().map(|q| format!("{} ({:?})", q.name, q.kind)).collect::<Vec<_>>().join(", ")
        };
        let mut pairs = cells.iter().zip(&got.cells);
        pairs.try_for_each(|(a, b)| expect_equal("list of quantities", &names(a), &names(b), path))
    }
}

/// What one shard has computed so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "UncheckedPart")]
pub struct Part {
    header: Header,
    shard: Shard,
    program: String,
    cells: Vec<Forest<Tally>>,
}

impl Part {
    pub(crate) fn empty(header: Header, shard: Shard, program: &str) -> Self {
        let cells = vec![Forest::new(header.blocks()); header.cells.len()];
        Self { header, shard, program: program.to_owned(), cells }
    }

    /// Reads a part.
    ///
    /// # Errors
    /// [`StudyError::Read`]; [`StudyError::Damaged`] if it is not a part of a study, or does not fit its hash;
    /// [`StudyError::OtherStudy`] if it is in another format.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let bytes = fs::read(path).map_err(|cause| StudyError::Read { path: path.into(), cause })?;
        let damaged = |reason: String| StudyError::Damaged { path: path.into(), reason };
        let other = |got: String| StudyError::OtherStudy {
            path: path.into(),
            what: "format",
            expected: FILE_SCHEMA.to_owned(),
            got,
        };
        let part = without_hash(FILE_SCHEMA, &bytes).map_err(|error| match error {
            HashedError::Schema { got } => other(got),
            // Before there was a first line.
            HashedError::Damaged { .. } if is_of_first_format(&bytes) => other("1".to_owned()),
            HashedError::Damaged { reason } => damaged(reason),
        })?;
        serde_json::from_slice(part).map_err(|error| damaged(error.to_string()))
    }

    /// Reads the part of a shard of a study.
    ///
    /// - `program`: [`Options::program`](crate::Options) of its run
    ///
    /// # Errors
    /// [`StudyError::OtherStudy`] if it is of another study, shard or program; those of [`Self::read`]; [`StudyError::Empty`],
    /// [`StudyError::TooLarge`], [`StudyError::SameName`] for an invalid study.
    pub fn read_of<S: Study>(study: &S, shard: Shard, program: &str, path: &Path) -> Result<Self, StudyError> {
        Self::empty(Header::of(study)?, shard, program).read_same(path)
    }

    /// Reads a part of the study, the shard and the program of this one.
    pub(crate) fn read_same(&self, path: &Path) -> Result<Self, StudyError> {
        let found = Self::read(path)?;
        self.expect_same_study(&found, path)?;
        expect_equal("shard", &self.shard, &found.shard, path)?;
        Ok(found)
    }

    /// Writes the part, as [`replace_file`] does.
    ///
    /// # Errors
    /// [`StudyError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), StudyError> {
        let write = || {
            let part = serde_json::to_string(self)? + "\n";
            replace_file(path, with_hash(FILE_SCHEMA, &part).as_bytes())
        };
        write().map_err(|cause| StudyError::Write { path: path.into(), cause })
    }

    /// What study this is a part of.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The shard to which this part belongs.
    pub fn shard(&self) -> Shard {
        self.shard
    }

    /// The program that made it, see [`Options::program`](crate::Options).
    pub fn program(&self) -> &str {
        &self.program
    }

    /// Trials that are there.
    pub fn done(&self) -> u64 {
        let trials = |forest: &Forest<Tally>| forest.nodes().map(|(_, tally)| tally.trials()).sum::<u64>();
        self.cells.iter().map(trials).sum()
    }

    /// What each cell has so far.
    pub fn cells(&self) -> &[Forest<Tally>] {
        &self.cells
    }

    /// Blocks of this shard that are still to be computed.
    pub fn missing(&self) -> Vec<Gap> {
        self.gaps_in(&self.shard.range(self.header.jobs()))
    }

    /// Whether this shard is done.
    pub fn is_complete(&self) -> bool {
        self.missing().is_empty()
    }

    /// The result, if this part is all of the study.
    ///
    /// # Errors
    /// [`StudyError::Incomplete`].
    pub fn into_results(self) -> Result<Results, StudyError> {
        let shards = self.shard.of();
        finish(self, Some(shards))
    }

    /// Refuses a part, at `path`, of another study or program.
    fn expect_same_study(&self, found: &Self, path: &Path) -> Result<(), StudyError> {
        self.header.expect_same(&found.header, path)?;
        expect_equal("program", &self.program, &found.program, path)
    }

    pub(crate) fn insert(&mut self, job: u64, tally: Tally) {
        let blocks = self.header.blocks();
        self.cells[(job / blocks) as usize].insert(job % blocks, tally).expect(
            "each job is taken once, and \
            exists",
        );
    }

    /// Jobs in `range` that are not there.
    fn gaps_in(&self, range: &Range<u64>) -> Vec<Gap> {
        let blocks = self.header.blocks();
        let mut gaps = Vec::new();
        for (cell, forest) in self.cells.iter().enumerate() {
            let first = cell as u64 * blocks;
            let own = range.start.max(first)..range.end.min(first + blocks);
            if own.is_empty() {
                continue;
            }
            let own = own.start - first..own.end - first;
            let clipped = forest.missing().into_iter().map(|gap| gap.start.max(own.start)..gap.end.min(own.end));
            gaps.extend(clipped.filter(|gap| !gap.is_empty()).map(|blocks| Gap { cell, blocks }));
        }
        gaps
    }
}

fn expect_equal<T: PartialEq + fmt::Display>(
    what: &'static str,
    expected: &T,
    got: &T,
    path: &Path,
) -> Result<(), StudyError> {
    if expected == got {
        return Ok(());
    }
    let (expected, got) = where_they_differ(&expected.to_string(), &got.to_string());
    Err(StudyError::OtherStudy { path: path.into(), what, expected, got })
}

/// Two texts as they are, or where they are long the parts in which they first differ.
fn where_they_differ(one: &str, other: &str) -> (String, String) {
    /// Most characters that are shown, and those before the difference.
    const SHOWN: usize = 60;
    const BEFORE: usize = 20;
    if one.chars().count().max(other.chars().count()) <= SHOWN {
        return (one.to_owned(), other.to_owned());
    }
    let same = one.chars().zip(other.chars()).take_while(|(a, b)| a == b).count();
    let part = |text: &str| {
        let start = same.saturating_sub(BEFORE);
        let [before, behind] =
            [start > 0, text.chars().count() > start + SHOWN].map(|cut| if cut { "..." } else { "" });
        format!("{before}{}{behind}", text.chars().skip(start).take(SHOWN).collect::<String>())
    };
    (part(one), part(other))
}

/// Whether a file is a part as it was written before there were hashes.
fn is_of_first_format(file: &[u8]) -> bool {
    let first = file.split(|byte| *byte == b'\n').next().unwrap_or(file);
    serde_json::from_slice::<serde_json::Value>(first).is_ok_and(|part| part["header"]["format"].is_u64())
}

#[derive(Deserialize)]
struct UncheckedPart {
    header: Header,
    shard: Shard,
    program: String,
    cells: Vec<Forest<Tally>>,
}

impl TryFrom<UncheckedPart> for Part {
    type Error = String;

    fn try_from(UncheckedPart { header, shard, program, cells }: UncheckedPart) -> Result<Self, String> {
        header.check()?;
        if cells.len() != header.cells.len() {
            return Err(format!("the header has {} cells, the body {}", header.cells.len(), cells.len()));
        }
        for (cell, forest) in cells.iter().enumerate() {
            if forest.blocks() != header.blocks() {
                return Err(format!("cell {cell} has {} blocks, expected {}", forest.blocks(), header.blocks()));
            }
            for (blocks, tally) in forest.nodes() {
                header.check_tally(cell, &blocks, tally)?;
            }
        }
        Ok(Self { header, shard, program, cells })
    }
}

impl Header {
    fn check(&self) -> Result<(), String> {
        let jobs = self.trials.checked_add(self.block).filter(|_| self.block > 0 && self.trials > 0);
        let jobs = jobs.and_then(|_| self.blocks().checked_mul(self.cells.len() as u64));
        match jobs {
            Some(1..=Forest::<Tally>::LARGEST) => Ok(()),
            _ => Err(format!(
                "there is no study of {} cells and {} trials in blocks of {}",
                self.cells.len(),
                self.trials,
                self.block
            )),
        }
    }

    fn check_tally(&self, cell: usize, blocks: &Range<u64>, tally: &Tally) -> Result<(), String> {
        if !tally.is_over(&self.cells[cell]) {
            return Err(format!("a tally of cell {cell} is over other quantities than the header says"));
        }
        let trials = self.trials_in(blocks);
        if tally.trials() != trials.end - trials.start {
            return Err(format!(
                "cell {cell}, blocks {} to {}, has {} trials, expected {}",
                blocks.start,
                blocks.end - 1,
                tally.trials(),
                trials.end - trials.start
            ));
        }
        Ok(())
    }
}

/// What a study found: a tally for each cell. Equal studies give equal bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "UncheckedResults")]
pub struct Results {
    header: Header,
    cells: Vec<Tally>,
}

impl Results {
    /// What study this is.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// What each cell found.
    pub fn cells(&self) -> &[Tally] {
        &self.cells
    }

    /// The results as JSON, which reads back to the same bits.
    ///
    /// # Panics
    /// Never: all that is kept is finite.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("maps have string keys and writing to memory does not fail")
    }
}

#[derive(Deserialize)]
struct UncheckedResults {
    header: Header,
    cells: Vec<Tally>,
}

impl TryFrom<UncheckedResults> for Results {
    type Error = String;

    fn try_from(UncheckedResults { header, cells }: UncheckedResults) -> Result<Self, String> {
        header.check()?;
        if cells.len() != header.cells.len() {
            return Err(format!("the header has {} cells, the body {}", header.cells.len(), cells.len()));
        }
        for (cell, tally) in cells.iter().enumerate() {
            header.check_tally(cell, &(0..header.blocks()), tally)?;
        }
        Ok(Self { header, cells })
    }
}

/// Joins the parts of a study, in any order.
///
/// What counts is that every block is there once; how the study was divided does not. So a missing
/// shard can be made up for by smaller ones.
///
/// # Errors
/// [`StudyError::Incomplete`], with the shards to run again; [`StudyError::Twice`];
/// [`StudyError::OtherStudy`]; and those of [`Part::read`].
pub fn merge<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Result<Results, StudyError> {
    let mut whole: Option<Part> = None;
    let mut divided_by = None;
    for path in paths {
        let path = path.as_ref();
        let part = Part::read(path)?;
        let Some(whole) = &mut whole else {
            divided_by = Some(part.shard.of());
            whole = Some(part);
            continue;
        };
        whole.expect_same_study(&part, path)?;
        divided_by = divided_by.filter(|&of| of == part.shard.of());
        for (cell, (mine, other)) in whole.cells.iter_mut().zip(part.cells).enumerate() {
            mine.join(other).map_err(|e| match e {
                ForestError::Twice { range: blocks, .. } => {
                    StudyError::Twice { path: path.into(), gap: Gap { cell, blocks } }
                }
                other => unreachable!("the headers are equal, so the trees are: {other}"),
            })?;
        }
    }
    finish(whole.ok_or(StudyError::NoParts)?, divided_by)
}

/// All cells' roots, or what is missing; with the shards that had it, if the study was divided by
/// one number.
fn finish(part: Part, divided_by: Option<u64>) -> Result<Results, StudyError> {
    let jobs = part.header.jobs();
    let gaps = part.gaps_in(&(0..jobs));
    if !gaps.is_empty() {
        let shards = divided_by.into_iter().flat_map(Shard::all);
        let shards = shards.filter(|shard| !part.gaps_in(&shard.range(jobs)).is_empty()).collect();
        return Err(StudyError::Incomplete { shards, gaps });
    }
    let cells = part.cells.into_iter().map(|forest| forest.into_root().ok()).collect::<Option<_>>();
    Ok(Results { header: part.header, cells: cells.expect("a forest without gaps is a tree") })
}
