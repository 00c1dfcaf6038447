//! Work that is divided into shards, on the engines that clusters have: Slurm, `HyperQueue`, GNU parallel and Kubernetes.
//!
//! For a program that can do part K of N of its work, leave the part in a folder that all machines see, and join the
//! parts. [`Submission::prepare`] writes a script for a shard and one that joins the parts, [`Submission::submit`] hands them to the
//! engine, [`Submission::queue`] asks Slurm which shards wait or run. Which of them are done only the program knows, from their
//! parts. How the work is divided, and that its result does not depend on it, is the business of `twinlag-study` and `twinlag-batch`.
//!
//! A shard may be killed at any moment, and may run twice at once: an engine that has lost a machine does not know whether the process
//! on it has ended. So a program keeps what is done, replaces files rather than edits them, and ends with exit code 75 where another
//! process writes its part.
//!
//! ```
//! use std::num::NonZeroU64;
//! use twinlag_cluster::{Engine, Resources, Storage, Submission, Work};
//!
//! let folder = tempfile::tempdir()?;
//! let words = |text: &str| text.split(' ').map(str::to_owned).collect();
//! let work = Work {
//!     name: "bias".into(),
//!     folder: folder.path().into(),
//!     storage: Storage::Folders,
//!     program: "/opt/bin/twinlag".into(),
//!     shard: words("study run plan.toml --out bias --resume --shard {shard}"),
//!     merge: words("study merge bias"),
//!     shards: NonZeroU64::new(8).expect("not zero"),
//! };
//! let scripts = folder.path().join("submission");
//! let submission = Submission::prepare(&scripts, Engine::Slurm, work, Resources::of_minutes(60))?;
//! let command = submission.command(&[0, 1, 2])?;
//! assert!(command.contains("sbatch --parsable '--array=0-2' "));
//! assert!(std::fs::read_to_string(scripts.join("shard.sh"))?.contains("#SBATCH --time=60"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod engine;
mod error;
mod hyperqueue;
mod kubernetes;
mod parallel;
mod script;
mod slurm;
mod submission;
mod work;

pub use engine::{Engine, Queue, State};
pub use error::ClusterError;
pub use submission::{Job, Submission, Submitted};
pub use work::{Resources, Storage, Work};
