//! What was submitted, kept beside its scripts.

use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};
use twinlag_study::{ranges, replace_file};

use crate::engine::{Engine, Queue};
use crate::error::ClusterError;
use crate::script::{self, LOGS, MERGE, SHARD};
use crate::work::{Resources, Work};
use crate::{hyperqueue, kubernetes, parallel, slurm};

/// Name and number of the format.
const SCHEMA: &str = "twinlag.submitted/2";
/// The file of what was submitted.
const FILE: &str = "submission.json";
/// The file that the process that submits has locked.
const LOCK: &str = "lock";

/// Work in the hands of an engine: its scripts in a folder of their own, and its jobs.
#[derive(Debug, Serialize, Deserialize)]
pub struct Submission {
    schema: String,
    version: String,
    engine: Engine,
    work: Work,
    resources: Resources,
    jobs: Vec<Job>,
    #[serde(skip)]
    folder: PathBuf,
    /// The right to submit; `None` of one that was opened to look at it.
    #[serde(skip)]
    lock: Option<File>,
}

/// The name of the format.
#[derive(Deserialize)]
struct Named {
    schema: String,
}

/// What an engine has taken, or what was printed to be started by hand.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Job {
    /// The shards, as ranges; empty of a merge alone.
    pub shards: String,
    /// The engine's name of the job that has the shards.
    pub id: Option<String>,
    /// The engine's name of the job that joins the parts; `None` where it is part of the other.
    pub merge_id: Option<String>,
    /// The cluster that has taken it, of several that Slurm was to choose from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cluster: Option<String>,
}

/// What came of a submission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Submitted {
    /// The engine has taken it.
    Job(Job),
    /// This line of a shell starts it, once what it needs is filled in.
    ByHand(String),
}

impl Submission {
    /// Writes the scripts into a folder, which is created where necessary. Nothing is submitted.
    ///
    /// # Errors
    /// [`ClusterError::Exists`] if an engine has taken something from there; [`ClusterError::Busy`], [`ClusterError::NotOfEngine`],
    /// [`ClusterError::NoText`], [`ClusterError::Write`].
    pub fn prepare(folder: &Path, engine: Engine, work: Work, resources: Resources) -> Result<Self, ClusterError> {
        resources.check_for(engine)?;
        fs::create_dir_all(folder)
            .map_err(|error| ClusterError::Write { path: folder.to_owned(), reason: error.to_string() })?;
        let lock = Some(lock(folder)?);
        match Self::open(folder) {
            Err(ClusterError::NotSubmitted { .. }) => {}
            // Nothing was submitted, or it was refused.
            Ok(earlier) if earlier.jobs.is_empty() => {}
            Ok(_) => return Err(ClusterError::Exists { path: folder.join(FILE) }),
            Err(error) => return Err(error),
        }
        let job = folder.join(kubernetes::FILE);
        if fs::read_to_string(&job).is_ok_and(|job| kubernetes::is_filled_in(&job)) {
            return Err(ClusterError::Exists { path: job });
        }
        let (schema, version) = (SCHEMA.to_owned(), env!("CARGO_PKG_VERSION").to_owned());
        let folder = folder.to_owned();
        let submission = Self { schema, version, engine, work, resources, jobs: Vec::new(), folder, lock };
        submission.write_scripts()?;
        Ok(submission)
    }

    /// What was submitted from a folder, to look at it.
    ///
    /// # Errors
    /// [`ClusterError::NotSubmitted`], [`ClusterError::Read`], [`ClusterError::Damaged`].
    pub fn open(folder: &Path) -> Result<Self, ClusterError> {
        let path = folder.join(FILE);
        let text = fs::read_to_string(&path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => ClusterError::NotSubmitted { path: path.clone() },
            _ => ClusterError::Read { path: path.clone(), reason: error.to_string() },
        })?;
        let damaged = |reason| ClusterError::Damaged { path: path.clone(), reason };
        let wrong = |error: serde_json::Error| damaged(error.to_string());
        // Of another format nothing but its name is known.
        let Named { schema } = serde_json::from_str(&text).map_err(wrong)?;
        if schema != SCHEMA {
            return Err(damaged(format!("expected {SCHEMA}, found {schema}")));
        }
        let mut submission: Self = serde_json::from_str(&text).map_err(wrong)?;
        let shards = submission.work.shards.get();
        if shards > Work::MAX_SHARDS {
            return Err(damaged(format!("expected at most {} shards, found {shards}", Work::MAX_SHARDS)));
        }
        folder.clone_into(&mut submission.folder);
        Ok(submission)
    }

    /// What was submitted from a folder, to submit more of it. No other process submits from there as long as this lives.
    ///
    /// # Errors
    /// [`ClusterError::Busy`], and those of [`Self::open`].
    pub fn resume(folder: &Path) -> Result<Self, ClusterError> {
        if !folder.join(FILE).exists() {
            return Err(ClusterError::NotSubmitted { path: folder.join(FILE) });
        }
        let lock = Some(lock(folder)?);
        Ok(Self { lock, ..Self::open(folder)? })
    }

    /// The engine.
    pub fn engine(&self) -> Engine {
        self.engine
    }

    /// What is divided.
    pub fn work(&self) -> &Work {
        &self.work
    }

    /// The folder of its scripts.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The last line that a shard has said; `None` where it has said nothing.
    pub fn last_line_of(&self, shard: u64) -> Option<String> {
        let log = fs::read(self.folder.join(LOGS).join(script::log_of(shard))).ok()?;
        let log = String::from_utf8_lossy(&log);
        log.lines().rev().map(str::trim).find(|line| !line.is_empty()).map(str::to_owned)
    }

    /// Gives the shards that are submitted from now on another limit of time, and writes the scripts anew.
    ///
    /// # Errors
    /// [`ClusterError::LookedAt`], [`ClusterError::Write`].
    pub fn limit_time(&mut self, time_min: NonZeroU32) -> Result<(), ClusterError> {
        self.expect_lock()?;
        self.resources.time_min = time_min;
        self.write_scripts()
    }

    fn expect_lock(&self) -> Result<(), ClusterError> {
        if self.lock.is_some() { Ok(()) } else { Err(ClusterError::LookedAt { path: self.folder.clone() }) }
    }

    fn write_scripts(&self) -> Result<(), ClusterError> {
        let Self { work, resources, .. } = self;
        let logs = self.folder.join(LOGS);
        fs::create_dir_all(&logs).map_err(|error| ClusterError::Write { path: logs, reason: error.to_string() })?;
        let logs = self.path(LOGS)?;
        let (of_shard, of_merge) = match self.engine {
            Engine::Slurm => (slurm::directives(work, resources), slurm::merge_directives(work)),
            _ => (Vec::new(), Vec::new()),
        };
        self.write(SHARD, &script::shard(work, &of_shard, &logs)?)?;
        self.write(MERGE, &script::merge(work, &of_merge, &logs)?)?;
        match self.engine {
            Engine::Hyperqueue => self.write(hyperqueue::FILE, hyperqueue::SCRIPT),
            Engine::Kubernetes => {
                let job = match fs::read_to_string(self.folder.join(kubernetes::FILE)) {
                    Ok(job) if kubernetes::is_filled_in(&job) => kubernetes::with_limit(&job, resources),
                    _ => kubernetes::job(work, resources, &self.path(SHARD)?)?,
                };
                self.write(kubernetes::FILE, &job)
            }
            Engine::Slurm | Engine::Parallel => Ok(()),
        }
    }

    /// Writes a file in one piece: a shell may be reading the old one.
    fn write(&self, name: &str, text: &str) -> Result<(), ClusterError> {
        let path = self.folder.join(name);
        replace_file(&path, text.as_bytes()).map_err(|error| ClusterError::Write { path, reason: error.to_string() })
    }

    /// The whole path of a file of it: the scripts may run in any folder.
    fn path(&self, name: &str) -> Result<String, ClusterError> {
        let path = self.folder.join(name);
        let whole = path.canonicalize().unwrap_or(path);
        script::text(&whole).map(str::to_owned)
    }

    /// The line of a shell that submits these shards and the merge behind them; without shards, the merge alone.
    ///
    /// # Errors
    /// [`ClusterError::NoText`].
    pub fn command(&self, shards: &[u64]) -> Result<String, ClusterError> {
        let [shard, merge] = [self.path(SHARD)?, self.path(MERGE)?];
        let in_shell = [&*script::quoted(&shard)?, &*script::quoted(&merge)?];
        match self.engine {
            Engine::Slurm => slurm::command(&self.resources, shards, [&shard, &merge]),
            Engine::Hyperqueue => {
                let submit = self.path(hyperqueue::FILE)?;
                script::command(&hyperqueue::command(&submit, &self.work, &self.resources, shards))
            }
            Engine::Parallel => parallel::command(&self.resources, shards, in_shell),
            Engine::Kubernetes => {
                let job = script::quoted(&self.path(kubernetes::FILE)?)?;
                Ok(kubernetes::command(shards, [&job, in_shell[1]]))
            }
        }
    }

    /// Hands shards to the engine, and the merge behind them and behind what the engine still has; without shards, the merge alone. The
    /// merge runs whatever becomes of the shards, but for one that has lost more workers of `HyperQueue` than it may.
    ///
    /// # Errors
    /// [`ClusterError::LookedAt`] of one that was [opened](Self::open) to look at it; [`ClusterError::NoProgram`],
    /// [`ClusterError::Refused`], [`ClusterError::Write`].
    pub fn submit(&mut self, shards: &[u64]) -> Result<Submitted, ClusterError> {
        self.expect_lock()?;
        // What cannot be recorded is not submitted. Scripts that are gone, or whose folder has another name by now, are written anew.
        self.write_scripts()?;
        self.save()?;
        let mut job = Job { shards: ranges(shards), ..Job::default() };
        match self.engine {
            Engine::Slurm => self.submit_to_slurm(shards, job).map(Submitted::Job),
            Engine::Hyperqueue => {
                let script = self.path(hyperqueue::FILE)?;
                job.id = Some(hyperqueue::submit(&script, &self.work, &self.resources, shards)?);
                self.jobs.push(job.clone());
                self.save()?;
                Ok(Submitted::Job(job))
            }
            Engine::Parallel | Engine::Kubernetes => {
                self.jobs.push(job);
                self.save()?;
                Ok(Submitted::ByHand(self.command(shards)?))
            }
        }
    }

    /// Each job is recorded before the next is submitted.
    fn submit_to_slurm(&mut self, shards: &[u64], mut job: Job) -> Result<Job, ClusterError> {
        // Those of earlier submissions that have not ended.
        let mut behind: Vec<String> = slurm::queue(&self.jobs)?.jobs.into_iter().collect();
        job.cluster = self.jobs.last().and_then(|earlier| earlier.cluster.clone());
        if !shards.is_empty() {
            let taken = slurm::submit_shards(&self.resources, shards, &self.path(SHARD)?)?;
            behind.push(taken.id.clone());
            (job.id, job.cluster) = (Some(taken.id), taken.cluster);
            self.jobs.push(job.clone());
            self.save()?;
        }
        let taken = slurm::submit_merge(&self.resources, &behind, job.cluster.as_deref(), &self.path(MERGE)?)?;
        (job.merge_id, job.cluster) = (Some(taken.id), taken.cluster.or(job.cluster));
        if !shards.is_empty() {
            self.jobs.pop();
        }
        self.jobs.push(job.clone());
        self.save()?;
        Ok(job)
    }

    fn save(&self) -> Result<(), ClusterError> {
        let wrong = |error: serde_json::Error| ClusterError::Write { path: FILE.into(), reason: error.to_string() };
        self.write(FILE, &(serde_json::to_string_pretty(self).map_err(wrong)? + "\n"))
    }

    /// What has not ended; `None` of an engine that cannot be asked.
    ///
    /// # Errors
    /// [`ClusterError::NoProgram`], [`ClusterError::Refused`].
    pub fn queue(&self) -> Result<Option<Queue>, ClusterError> {
        match self.engine {
            Engine::Slurm => slurm::queue(&self.jobs).map(Some),
            _ => Ok(None),
        }
    }
}

/// The right to submit from a folder. On a file system without locks each process has it.
fn lock(folder: &Path) -> Result<File, ClusterError> {
    let path = folder.join(LOCK);
    let file = File::options().write(true).create(true).truncate(false).open(&path);
    let file = file.map_err(|error| ClusterError::Write { path, reason: error.to_string() })?;
    match file.try_lock() {
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(ClusterError::Busy { path: folder.to_owned() }),
    }
}

/// What a command of an engine prints.
pub(crate) fn answer(program: &'static str, arguments: &[String]) -> Result<String, ClusterError> {
    let output = Command::new(program)
        .args(arguments)
        .output()
        .map_err(|error| ClusterError::NoProgram { program, reason: error.to_string() })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Err(ClusterError::Refused {
            program,
            said: if said.is_empty() { output.status.to_string() } else { said },
        });
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
