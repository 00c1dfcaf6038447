//! What was submitted, kept beside its scripts.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};
use twinlag_study::ranges;

use crate::engine::{Engine, State};
use crate::error::ClusterError;
use crate::script::{self, LOGS, MERGE, SHARD};
use crate::work::{Resources, Work};
use crate::{hyperqueue, kubernetes, parallel, slurm};

/// Name and number of the format.
const SCHEMA: &str = "twinlag.submitted/1";
/// The file of what was submitted.
const FILE: &str = "submission.json";

/// Work in the hands of an engine: its scripts in a folder of their own, and its jobs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Submission {
    schema: String,
    version: String,
    engine: Engine,
    work: Work,
    resources: Resources,
    jobs: Vec<Job>,
    #[serde(skip)]
    folder: PathBuf,
}

/// What an engine has taken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Job {
    /// The engine's name of the job that has the shards.
    pub id: String,
    /// The engine's name of the job that joins the parts; `None` where it is part of the other.
    pub merge_id: Option<String>,
    /// The shards, as ranges.
    pub shards: String,
}

/// What came of a submission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Submitted {
    /// The engine has taken it.
    Job(Job),
    /// These commands start it, once what they need is filled in.
    ByHand(Vec<String>),
}

impl Submission {
    /// Writes the scripts into a folder, which is created where necessary. Nothing is submitted.
    ///
    /// # Errors
    /// [`ClusterError::Exists`] if an engine has taken something from there; [`ClusterError::NoText`], [`ClusterError::Write`].
    pub fn prepare(folder: &Path, engine: Engine, work: Work, resources: Resources) -> Result<Self, ClusterError> {
        match Self::open(folder) {
            Err(ClusterError::NotSubmitted { .. }) => {}
            // The engine has taken nothing.
            Ok(earlier) if earlier.jobs.is_empty() => {}
            _ => return Err(ClusterError::Exists { path: folder.join(FILE) }),
        }
        let (schema, version) = (SCHEMA.to_owned(), env!("CARGO_PKG_VERSION").to_owned());
        let submission = Self { schema, version, engine, work, resources, jobs: Vec::new(), folder: folder.to_owned() };
        submission.write_scripts()?;
        Ok(submission)
    }

    /// What was submitted from a folder.
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
        let mut submission: Self = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        if submission.schema != SCHEMA {
            return Err(damaged(format!("expected {SCHEMA}, found {}", submission.schema)));
        }
        folder.clone_into(&mut submission.folder);
        Ok(submission)
    }

    /// The engine.
    pub fn engine(&self) -> Engine {
        self.engine
    }

    /// What is divided.
    pub fn work(&self) -> &Work {
        &self.work
    }

    /// What was submitted, the first one first.
    pub fn jobs(&self) -> &[Job] {
        &self.jobs
    }

    /// The folder of its scripts.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The script that joins the parts.
    pub fn merge_script(&self) -> PathBuf {
        self.folder.join(MERGE)
    }

    /// Gives the shards that are submitted from now on another limit of time, and writes the scripts anew.
    ///
    /// # Errors
    /// [`ClusterError::Write`].
    pub fn limit_time(&mut self, time_min: std::num::NonZeroU32) -> Result<(), ClusterError> {
        self.resources.time_min = time_min;
        self.write_scripts()
    }

    fn write_scripts(&self) -> Result<(), ClusterError> {
        let Self { work, resources, .. } = self;
        let logs = self.folder.join(LOGS);
        fs::create_dir_all(&logs).map_err(|error| ClusterError::Write { path: logs, reason: error.to_string() })?;
        let logs = self.path(LOGS)?;
        let (of_shard, of_merge) = match self.engine {
            Engine::Slurm => (slurm::directives(work, resources), slurm::merge_directives(work, resources)),
            _ => (Vec::new(), Vec::new()),
        };
        self.write(SHARD, &script::shard(work, &of_shard, &logs)?)?;
        self.write(MERGE, &script::merge(work, &of_merge, &logs)?)?;
        match self.engine {
            Engine::Hyperqueue => self.write(hyperqueue::FILE, hyperqueue::SCRIPT),
            Engine::Kubernetes => self.write(kubernetes::FILE, &kubernetes::job(work, resources, &self.path(SHARD)?)),
            _ => Ok(()),
        }
    }

    fn write(&self, name: &str, text: &str) -> Result<(), ClusterError> {
        let path = self.folder.join(name);
        fs::write(&path, text).map_err(|error| ClusterError::Write { path, reason: error.to_string() })
    }

    /// The whole path of a file of it: the scripts may run in any folder.
    fn path(&self, name: &str) -> Result<String, ClusterError> {
        let path = self.folder.join(name);
        let whole = path.canonicalize().unwrap_or(path);
        whole.to_str().map(str::to_owned).ok_or_else(|| ClusterError::NoText { text: whole.to_string_lossy().into() })
    }

    /// The commands that submit these shards, as a shell takes them.
    ///
    /// # Errors
    /// [`ClusterError::NoText`].
    pub fn commands(&self, shards: &[u64]) -> Result<Vec<String>, ClusterError> {
        let [shard, merge] = [self.path(SHARD)?, self.path(MERGE)?];
        let command = |words: &[String]| -> Result<String, ClusterError> {
            Ok(words.iter().map(|word| script::quoted(word)).collect::<Result<Vec<_>, _>>()?.join(" "))
        };
        Ok(match self.engine {
            Engine::Slurm => vec![
                command(&slurm::array(shards, &shard))?,
                // JOB stands for what the first command prints.
                command(&slurm::behind("JOB", &merge))?,
            ],
            Engine::Hyperqueue => {
                vec![command(&hyperqueue::command(&self.path(hyperqueue::FILE)?, &self.work, &self.resources, shards))?]
            }
            Engine::Parallel => parallel::commands(&script::quoted(&shard)?, &script::quoted(&merge)?, shards),
            Engine::Kubernetes => kubernetes::commands(&script::quoted(&self.path(kubernetes::FILE)?)?),
        })
    }

    /// Hands shards to the engine, and the merge behind them. Slurm runs it whatever becomes of the shards, `HyperQueue` only if none fails.
    ///
    /// # Errors
    /// [`ClusterError::NoProgram`], [`ClusterError::Refused`], [`ClusterError::Write`].
    pub fn submit(&mut self, shards: &[u64]) -> Result<Submitted, ClusterError> {
        // What cannot be recorded is not submitted.
        self.save()?;
        let id = match self.engine {
            Engine::Slurm => slurm::submit_shards(shards, &self.path(SHARD)?)?,
            Engine::Hyperqueue => {
                hyperqueue::submit(&self.path(hyperqueue::FILE)?, &self.work, &self.resources, shards)?
            }
            Engine::Parallel | Engine::Kubernetes => return Ok(Submitted::ByHand(self.commands(shards)?)),
        };
        let mut job = Job { id, merge_id: None, shards: ranges(shards) };
        self.jobs.push(job.clone());
        self.save()?;
        if self.engine == Engine::Slurm {
            job.merge_id = Some(slurm::submit_merge(&self.path(MERGE)?, &job.id)?);
            self.jobs.pop();
            self.jobs.push(job.clone());
            self.save()?;
        }
        Ok(Submitted::Job(job))
    }

    fn save(&self) -> Result<(), ClusterError> {
        let wrong = |error: serde_json::Error| ClusterError::Write { path: FILE.into(), reason: error.to_string() };
        self.write(FILE, &(serde_json::to_string_pretty(self).map_err(wrong)? + "\n"))
    }

    /// The shards that wait or run; `None` of an engine that cannot be asked.
    ///
    /// # Errors
    /// [`ClusterError::NoProgram`], [`ClusterError::Refused`].
    pub fn states(&self) -> Result<Option<BTreeMap<u64, State>>, ClusterError> {
        match self.engine {
            Engine::Slurm => slurm::states(&self.jobs).map(Some),
            _ => Ok(None),
        }
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
