//! The engines, and what they say of shards.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// What runs the shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Engine {
    /// An array of jobs, and one that joins the parts after it (`sbatch`).
    Slurm,
    /// A job of many tasks on a server that is running (`python3` with the package `hyperqueue`).
    Hyperqueue,
    /// GNU parallel, on this machine or on those that it is given; started by hand.
    Parallel,
    /// An indexed job; its image and volume are to be filled in, and it is started by hand.
    Kubernetes,
}

impl Engine {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Slurm, Self::Hyperqueue, Self::Parallel, Self::Kubernetes];

    /// Its name in options and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slurm => "slurm",
            Self::Hyperqueue => "hyperqueue",
            Self::Parallel => "parallel",
            Self::Kubernetes => "kubernetes",
        }
    }
}

impl fmt::Display for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Engine {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::name).join(", ");
        Self::ALL.into_iter().find(|engine| engine.name() == text).ok_or_else(|| format!("expected one of {}", names()))
    }
}

/// What an engine does with a shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Queued, or queued again.
    Waiting,
    /// Started, and not ended.
    Running,
}

/// What an engine has of a submission.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Queue {
    /// The shards that have not ended.
    pub shards: BTreeMap<u64, State>,
    /// The jobs that have these shards.
    pub jobs: BTreeSet<String>,
    /// The merge, if it has not ended.
    pub merge: Option<State>,
}
