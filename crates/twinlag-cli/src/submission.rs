//! Shards in the hands of a cluster's engine: what `study submit` and `batch --engine` have in common.

use std::ffi::OsStr;
use std::num::{NonZeroU32, NonZeroU64};
use std::path::{Path, PathBuf};

use clap::{Arg, Args, Command, CommandFactory};
use schemars::JsonSchema;
use serde::Serialize;
use twinlag_cluster::{ClusterError, Engine, Resources, State, Submission, Submitted, Work};
use twinlag_study::ranges;

use crate::arguments::Arguments;
use crate::columns::columns;
use crate::config;
use crate::console::Console;
use crate::failure::Failure;
use crate::print;

/// Most shards of one submission; chosen: engines take some thousand, and each has a file.
const MAX_SHARDS: u64 = 1_000_000;

fn shards(text: &str) -> Result<NonZeroU64, String> {
    let shards = text.parse().ok().filter(|shards: &NonZeroU64| shards.get() <= MAX_SHARDS);
    shards.ok_or_else(|| format!("expected a number of shards from 1 to {MAX_SHARDS}"))
}

/// Which engine runs the shards, and what each of them needs.
#[derive(Debug, Args)]
#[command(next_help_heading = "Cluster")]
pub(crate) struct Cluster {
    /// Submit all shards to this engine: slurm, hyperqueue, parallel or kubernetes.
    #[arg(long, value_name = "ENGINE", requires_all = ["shards", "time_limit"])]
    pub(crate) engine: Option<Engine>,
    /// Number of shards; best such that each takes some minutes or more.
    #[arg(long, value_name = "N", requires = "engine", value_parser = shards)]
    shards: Option<NonZeroU64>,
    /// The longest that a shard may take, in minutes.
    #[arg(long, value_name = "MINUTES")]
    pub(crate) time_limit: Option<NonZeroU32>,
    /// Processors of each shard, one if left out.
    #[arg(long, value_name = "N", requires = "engine")]
    pub(crate) cpus: Option<NonZeroU32>,
    /// Memory of each shard, as the engine writes it, such as 2G.
    #[arg(long, value_name = "SIZE", requires = "engine")]
    memory: Option<String>,
    /// An option of the engine's own, such as --engine-option=--partition=short; may be repeated.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true, requires = "engine")]
    engine_option: Vec<String>,
    /// Write the scripts, and print the commands that would submit them.
    #[arg(long, requires = "engine")]
    dry_run: bool,
}

/// What `twinlag study submit`, `twinlag batch --engine` and their resubmission print with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct SubmissionAnswer {
    /// `twinlag.submission/1`.
    schema: &'static str,
    /// `slurm`, `hyperqueue`, `parallel` or `kubernetes`.
    engine: &'static str,
    /// Folder of the scripts and of what they say.
    scripts: PathBuf,
    /// Indices of the shards, as ranges, such as `0-2,9`.
    shards: String,
    /// The engine's name of the job that has the shards; null if it is started by hand.
    job: Option<String>,
    /// The engine's name of the job that joins the parts; null if it is in the other one, or started by hand.
    merge_job: Option<String>,
    /// Commands that start it, where that is done by hand.
    commands: Vec<String>,
}

/// What `twinlag study status` and `twinlag batch --status` print with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct SubmissionStatus {
    /// `twinlag.submission-status/1`.
    schema: &'static str,
    /// `slurm`, `hyperqueue`, `parallel` or `kubernetes`.
    engine: &'static str,
    /// `trials`, `records` or `rigs`: what is counted.
    units: &'static str,
    /// Number of them that are done.
    done: u64,
    /// Number of them in all shards.
    total: u64,
    /// Whether the parts have been joined.
    merged: bool,
    /// Each shard, in order.
    shards: Vec<ShardStatus>,
}

/// A shard.
#[derive(Serialize, JsonSchema)]
struct ShardStatus {
    /// Its index, from 0.
    shard: u64,
    /// `done`; `running` or `waiting` by the engine; `missing`: neither done nor in the engine's hands; `unknown`: not done, and the
    /// engine cannot be asked; `unusable`: its part is not of this work, or damaged.
    state: &'static str,
    /// Number of units done.
    done: u64,
    /// Number of its units.
    total: u64,
    /// Why it is unusable.
    because: Option<String>,
}

/// What a shard has left of its work.
pub(crate) struct ShardProgress {
    pub(crate) total: u64,
    /// Why its part cannot be used, if not how many units are done.
    pub(crate) done: Result<u64, String>,
}

impl ShardProgress {
    fn is_done(&self) -> bool {
        self.done == Ok(self.total)
    }
}

impl Cluster {
    /// What is submitted.
    ///
    /// - `shard`, `merge`: arguments of the program
    pub(crate) fn work(&self, name: &str, shard: Vec<String>, merge: Vec<String>) -> Result<Work, Failure> {
        let unknown = |what: &str, error: std::io::Error| Failure::Other(format!("{what} is not known: {error}"));
        Ok(Work {
            name: name.to_owned(),
            folder: std::env::current_dir().map_err(|error| unknown("the folder in which the program runs", error))?,
            program: std::env::current_exe().map_err(|error| unknown("where the program is", error))?,
            shard,
            merge,
            shards: self.shards.unwrap_or(NonZeroU64::MIN),
        })
    }

    /// Submits all shards.
    ///
    /// - `scripts`: a folder of their own
    pub(crate) fn submit(&self, scripts: &Path, work: Work, console: Console) -> Result<u8, Failure> {
        let (Some(engine), Some(time_min)) = (self.engine, self.time_limit) else {
            return Err(Failure::Usage("--engine, --shards and --time-limit are needed".to_owned()));
        };
        let cpus = self.cpus.unwrap_or(NonZeroU32::MIN);
        let resources = Resources { time_min, cpus, memory: self.memory.clone(), options: self.engine_option.clone() };
        let all: Vec<u64> = (0..work.shards.get()).collect();
        let mut submission = Submission::prepare(scripts, engine, work, resources)?;
        let submitted =
            if self.dry_run { Submitted::ByHand(submission.commands(&all)?) } else { submission.submit(&all)? };
        say(&submission, &all, submitted, console)
    }

    /// The names of its options.
    pub(crate) fn options() -> Vec<String> {
        let command = Self::augment_args(Command::new("cluster"));
        command.get_arguments().filter_map(Arg::get_long).map(str::to_owned).collect()
    }
}

/// Submits again what is missing: shards that are not done, and that the engine does not have any more.
///
/// - `progress`: what each shard of so many has left
pub(crate) fn resubmit(
    scripts: &Path,
    progress: impl FnOnce(u64) -> Result<Vec<ShardProgress>, Failure>,
    time_limit: Option<NonZeroU32>,
    console: Console,
) -> Result<u8, Failure> {
    let mut submission = Submission::open(scripts)?;
    // A shard that ends in between is done, not missing.
    let states = submission.states()?.unwrap_or_default();
    let progress = progress(submission.work().shards.get())?;
    if let Some(reason) = progress.iter().find_map(|shown| shown.done.as_ref().err()) {
        return Err(Failure::File(reason.clone()));
    }
    let missing: Vec<u64> = (0..)
        .zip(&progress)
        .filter(|(shard, shown)| !shown.is_done() && !states.contains_key(shard))
        .map(|(shard, _)| shard)
        .collect();
    if missing.is_empty() {
        console.note(|| {
            if states.is_empty() {
                let merge = submission.merge_script();
                format!("nothing is missing: all shards are done; if there is no result, run `sh {}`", merge.display())
            } else {
                "nothing is missing: all shards are done, wait or run".to_owned()
            }
        });
        return Ok(0);
    }
    if let Some(time_min) = time_limit {
        submission.limit_time(time_min)?;
    }
    let submitted = submission.submit(&missing)?;
    say(&submission, &missing, submitted, console)
}

fn say(submission: &Submission, shards: &[u64], submitted: Submitted, console: Console) -> Result<u8, Failure> {
    let (job, commands) = match submitted {
        Submitted::Job(job) => (Some(job), Vec::new()),
        Submitted::ByHand(commands) => (None, commands),
    };
    let answer = SubmissionAnswer {
        schema: "twinlag.submission/1",
        engine: submission.engine().name(),
        scripts: submission.folder().to_owned(),
        shards: ranges(shards),
        job: job.as_ref().map(|job| job.id.clone()),
        merge_job: job.and_then(|job| job.merge_id),
        commands,
    };
    if console.json {
        print::json(&answer)?;
        return Ok(0);
    }
    let SubmissionAnswer { scripts, shards, job, merge_job, commands, .. } = answer;
    let scripts = scripts.display();
    if let Some(job) = job {
        let merge = merge_job.map_or(String::new(), |merge| format!(", and the merge as job {merge}"));
        print::on_stdout(&format!("shards {shards} are submitted as job {job}{merge}; scripts and logs: {scripts}\n"))?;
    } else {
        console.note(|| format!("scripts: {scripts}; these commands start shards {shards}, and the merge:"));
        print::on_stdout(&(commands.join("\n") + "\n"))?;
    }
    Ok(0)
}

/// Says how far the shards are. Ends with exit code 75 while there is no result.
///
/// - `progress`: what each shard of so many has left
pub(crate) fn status(
    scripts: &Path,
    progress: impl FnOnce(u64) -> Result<Vec<ShardProgress>, Failure>,
    units: &'static str,
    merged: bool,
    console: Console,
) -> Result<u8, Failure> {
    let submission = Submission::open(scripts)?;
    let states = match submission.states() {
        Err(error) => {
            console.note(|| format!("whether shards wait or run is not known: {error}"));
            None
        }
        Ok(states) => states,
    };
    let progress = progress(submission.work().shards.get())?;
    let of_shard = |(shard, shown): (u64, ShardProgress)| {
        let state = match (&shown.done, states.as_ref().map(|states| states.get(&shard))) {
            (Err(_), _) => "unusable",
            (Ok(done), _) if *done == shown.total => "done",
            (_, Some(Some(State::Running))) => "running",
            (_, Some(Some(State::Waiting))) => "waiting",
            (_, Some(None)) => "missing",
            (_, None) => "unknown",
        };
        let done = *shown.done.as_ref().unwrap_or(&0);
        ShardStatus { shard, state, done, total: shown.total, because: shown.done.err() }
    };
    let shards: Vec<ShardStatus> = (0..).zip(progress).map(of_shard).collect();
    // A result that was there before some of the parts is not theirs.
    let merged = merged && shards.iter().all(|shard| shard.state == "done");
    let (done, total) = shards.iter().fold((0, 0), |(done, total), shard| (done + shard.done, total + shard.total));
    let schema = "twinlag.submission-status/1";
    let engine = submission.engine().name();
    let answer = SubmissionStatus { schema, engine, units, done, total, merged, shards };
    if console.json {
        print::json(&answer)?;
    } else {
        print::on_stdout(&answer.in_words())?;
    }
    Ok(if merged { 0 } else { 75 })
}

impl SubmissionStatus {
    fn in_words(&self) -> String {
        let Self { engine, units, done, total, merged, shards, .. } = self;
        let count = shards.len();
        let of_state = |state: &&str| {
            let of: Vec<u64> = shards.iter().filter(|shard| shard.state == *state).map(|shard| shard.shard).collect();
            (!of.is_empty()).then(|| vec![(*state).to_owned(), of.len().to_string(), ranges(&of)])
        };
        let rows: Vec<_> =
            ["done", "running", "waiting", "missing", "unknown", "unusable"].iter().filter_map(of_state).collect();
        let because = shards.iter().filter_map(|shard| shard.because.clone());
        let end = if *merged { "the result is there\n" } else { "no result yet\n" };
        let lines = columns(&rows, |column| column != 1).into_iter().chain(because).map(|line| format!("  {line}"));
        [format!("{engine}: {done} of {total} {units} in {count} shards")]
            .into_iter()
            .chain(lines)
            .chain([end.to_owned()])
            .collect::<Vec<_>>()
            .join("\n")
    }
}

/// The arguments of this run, those of its `--config` among them, without some of its options.
///
/// - `dropped`: names of options of the command, or of all commands
pub(crate) fn arguments_without(command: &str, dropped: &[String]) -> Result<Vec<String>, Failure> {
    let program = Arguments::command();
    let within = program.find_subcommand(command).into_iter().flat_map(Command::get_arguments);
    let options: Vec<&Arg> = within.chain(program.get_arguments()).collect();
    let takes_value = |name: &str| {
        let option = options.iter().find(|option| option.get_long() == Some(name));
        option.is_some_and(|option| option.get_action().takes_values())
    };
    let (mut kept, mut is_value, mut is_over) = (Vec::new(), false, false);
    for argument in config::with_config(std::env::args_os().collect())?.into_iter().skip(1) {
        let argument = text(&argument)?;
        if std::mem::take(&mut is_value) {
            continue;
        }
        is_over |= argument == "--";
        let option = argument.strip_prefix("--").filter(|_| !is_over);
        let name = option.map(|option| option.split_once('=').map_or(option, |(name, _)| name));
        match name.filter(|name| dropped.iter().any(|dropped| dropped == name)) {
            Some(name) => is_value = takes_value(name) && !argument.contains('='),
            None => kept.push(argument),
        }
    }
    Ok(kept)
}

/// A name as a script has it.
pub(crate) fn text(name: impl AsRef<OsStr>) -> Result<String, Failure> {
    let name = name.as_ref();
    let text = name.to_str().map(str::to_owned);
    text.ok_or_else(|| Failure::Usage(format!("{}: is no Unicode, as a script needs it", name.display())))
}

/// What was submitted depends on how the program was called; what an engine refuses does not.
impl From<ClusterError> for Failure {
    fn from(error: ClusterError) -> Self {
        let text = error.to_string();
        match error {
            ClusterError::Exists { .. } | ClusterError::NoText { .. } => Self::Usage(text),
            ClusterError::NotSubmitted { .. } | ClusterError::Damaged { .. } => Self::File(text),
            _ => Self::Other(text),
        }
    }
}
