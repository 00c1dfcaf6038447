//! Work, and what a shard of it needs.

use std::num::{NonZeroU32, NonZeroU64};
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::engine::Engine;
use crate::error::ClusterError;

/// Work that is divided into shards.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// What engines show it as.
    pub name: String,
    /// The folder in which all commands run. Every machine has to see it, except pods of work that is all in [`Storage::Objects`].
    pub folder: PathBuf,
    /// Where the files are that a shard reads and writes.
    #[serde(default)]
    pub storage: Storage,
    /// The program; on a machine that has it elsewhere, the variable `TWINLAG` says where.
    pub program: PathBuf,
    /// Its arguments for a shard, with [`Self::SHARD`] in the place of which shard it is.
    pub shard: Vec<String>,
    /// Its arguments that join the parts of all shards.
    pub merge: Vec<String>,
    /// Number of shards.
    pub shards: NonZeroU64,
}

impl Work {
    /// What stands in [`Self::shard`] for the shard, `K/N` with K counted from 0: the first argument that is this.
    pub const SHARD: &'static str = "{shard}";
    /// Most shards; chosen: engines take some thousand, and each has a file.
    pub const MAX_SHARDS: u64 = 1_000_000;
}

/// Where the files are that a shard reads and writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Storage {
    /// In folders that every machine sees.
    #[default]
    Folders,
    /// Some in folders, the others in an object store.
    FoldersAndObjects,
    /// All in an object store.
    Objects,
}

impl Storage {
    /// Whether shards use folders that every machine sees.
    pub(crate) fn has_folders(self) -> bool {
        self != Self::Objects
    }

    /// Whether shards use an object store.
    pub(crate) fn has_objects(self) -> bool {
        self != Self::Folders
    }
}

/// What a shard needs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resources {
    /// The longest that it may take, min. Without such a limit a shard whose machine was lost may be taken to run for ever.
    pub time_min: NonZeroU32,
    /// Processors, each with a thread.
    pub cpus: NonZeroU32,
    /// Memory, as the engine writes it; `None` for what it gives by itself.
    pub memory: Option<String>,
    /// Further options of the engine, as they are.
    pub options: Vec<String>,
}

impl Resources {
    /// One processor for so many minutes.
    ///
    /// # Panics
    /// If they are zero.
    pub fn of_minutes(time_min: u32) -> Self {
        let time_min = NonZeroU32::new(time_min).expect("a shard takes some time");
        Self { time_min, cpus: NonZeroU32::MIN, memory: None, options: Vec::new() }
    }

    /// Refuses what an engine would not heed.
    pub(crate) fn check_for(&self, engine: Engine) -> Result<(), ClusterError> {
        let not = |option, instead| Err(ClusterError::NotOfEngine { option, engine, instead });
        match engine {
            Engine::Parallel if self.memory.is_some() => {
                not("--memory", "leave it out; --engine-option=--memfree=2G starts a shard only where so much is free")
            }
            Engine::Hyperqueue if self.memory.is_some() => {
                not("--memory", "leave it out, and choose the workers by it")
            }
            Engine::Kubernetes if !self.options.is_empty() => not("--engine-option", "write it into job.yaml"),
            _ => Ok(()),
        }
    }
}
