//! Shards in the hands of a cluster's engine: what `study submit` and `batch --engine` have in common.

use std::ffi::OsStr;
use std::num::{NonZeroU32, NonZeroU64};
use std::path::{Path, PathBuf};

use clap::{Arg, Args, Command, CommandFactory};
use schemars::JsonSchema;
use serde::Serialize;
use twinlag_cluster::{ClusterError, Engine, Queue, Resources, State, Storage, Submission, Submitted, Work};
use twinlag_study::ranges;

use crate::arguments::Arguments;
use crate::columns::columns;
use crate::config;
use crate::console::Console;
use crate::failure::Failure;
use crate::invocation::Invocation;
use crate::print;

fn shards(text: &str) -> Result<NonZeroU64, String> {
    let shards = text.parse().ok().filter(|shards: &NonZeroU64| shards.get() <= Work::MAX_SHARDS);
    shards.ok_or_else(|| format!("expected a number of shards from 1 to {}", Work::MAX_SHARDS))
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
    /// Write the scripts, and print the command that would submit them.
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
    /// The engine's name of the job that has the shards; null if there are none, or if it is started by hand.
    job: Option<String>,
    /// The engine's name of the job that joins the parts; null if it is in the other one, or started by hand.
    merge_job: Option<String>,
    /// Lines for a shell that start it, where that is done by hand.
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

/// How far a shard is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum ShardState {
    /// All its units are done.
    Done,
    /// Not done, and started by the engine.
    Running,
    /// Not done, and in the engine's queue.
    Waiting,
    /// Not done, and neither running nor waiting.
    Missing,
    /// Not done, and the engine cannot be asked whether it runs or waits.
    Unknown,
    /// Its part is not of this work, or is damaged.
    Unusable,
}

impl ShardState {
    const ALL: [(Self, &str); 6] = [
        (Self::Done, "done"),
        (Self::Running, "running"),
        (Self::Waiting, "waiting"),
        (Self::Missing, "missing"),
        (Self::Unknown, "unknown"),
        (Self::Unusable, "unusable"),
    ];

    /// - `queue`: what has not ended; `None` of an engine that cannot be asked
    fn of(shard: u64, progress: &ShardProgress, queue: Option<&Queue>) -> Self {
        if progress.done.is_err() {
            return Self::Unusable;
        }
        if progress.is_done() {
            return Self::Done;
        }
        match queue.map(|queue| queue.shards.get(&shard)) {
            Some(Some(State::Running)) => Self::Running,
            Some(Some(State::Waiting)) => Self::Waiting,
            Some(None) => Self::Missing,
            None => Self::Unknown,
        }
    }
}

/// A shard.
#[derive(Serialize, JsonSchema)]
struct ShardStatus {
    /// Its index, from 0.
    shard: u64,
    /// How far it is.
    state: ShardState,
    /// Number of units done.
    done: u64,
    /// Number of its units.
    total: u64,
    /// Why it is unusable; of one that is missing or unknown, the last line of its log.
    because: Option<String>,
}

/// What a shard has left of its work.
pub(crate) struct ShardProgress {
    pub(crate) total: u64,
    /// Why its part cannot be used, if not how many units are done.
    pub(crate) done: Result<u64, String>,
    /// The part.
    pub(crate) part: PathBuf,
}

impl ShardProgress {
    fn is_done(&self) -> bool {
        self.done == Ok(self.total)
    }
}

/// Whether the parts have been joined: all are done, and the result is no older than any.
///
/// - `result`: where it is; `None` if there is none
fn is_merged(progress: &[ShardProgress], result: Option<&Path>) -> bool {
    let written = |path: &Path| path.metadata().and_then(|file| file.modified());
    let Some(Ok(result)) = result.map(written) else { return false };
    let is_older = |part: &Path| written(part).is_ok_and(|part| part <= result);
    // A shard of no units has no part.
    progress.iter().all(|shown| shown.is_done() && (shown.total == 0 || is_older(&shown.part)))
}

impl Cluster {
    /// Number of shards.
    pub(crate) fn shards(&self) -> u64 {
        self.shards.map_or(1, NonZeroU64::get)
    }

    /// What is submitted.
    ///
    /// - `shard`, `merge`: arguments of the program
    pub(crate) fn work(
        &self,
        name: &str,
        storage: Storage,
        shard: Vec<String>,
        merge: Vec<String>,
    ) -> Result<Work, Failure> {
        let unknown = |what: &str| Failure::Other(format!("{what} is not known"));
        let folder = std::env::current_dir().ok();
        Ok(Work {
            name: name.to_owned(),
            folder: folder.ok_or_else(|| unknown("the folder in which the program runs"))?,
            storage,
            program: Invocation::of_process().program.clone().ok_or_else(|| unknown("the file of the program"))?,
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
            if self.dry_run { Submitted::ByHand(submission.command(&all)?) } else { submission.submit(&all)? };
        say(&submission, &all, submitted, console)
    }

    /// The names of its options.
    pub(crate) fn options() -> Vec<String> {
        let command = Self::augment_args(Command::new("cluster"));
        command.get_arguments().filter_map(Arg::get_long).map(str::to_owned).collect()
    }
}

/// Submits again what is missing: shards that are not done, and that the engine does not have any more, and the merge.
///
/// - `progress`: what each shard of so many has left
/// - `result`: where the result is; `None` if there is none
pub(crate) fn resubmit(
    scripts: &Path,
    progress: impl FnOnce(u64) -> Result<Vec<ShardProgress>, Failure>,
    result: Option<&Path>,
    time_limit: Option<NonZeroU32>,
    console: Console,
) -> Result<u8, Failure> {
    let mut submission = Submission::resume(scripts)?;
    // Asked first: a shard that ends in between is done, not missing.
    let queue = submission.queue()?;
    let progress = progress(submission.work().shards.get())?;
    if let Some(reason) = progress.iter().find_map(|shown| shown.done.as_ref().err()) {
        return Err(Failure::File(reason.clone()));
    }
    let is_missing = |shard: u64, shown: &ShardProgress| {
        matches!(ShardState::of(shard, shown, queue.as_ref()), ShardState::Missing | ShardState::Unknown)
    };
    let missing: Vec<u64> =
        (0..).zip(&progress).filter(|(shard, shown)| is_missing(*shard, shown)).map(|(shard, _)| shard).collect();
    let is_merging = queue.is_some_and(|queue| queue.merge.is_some());
    // A merge that was lost is missing even while shards run.
    if missing.is_empty() && (is_merging || is_merged(&progress, result)) {
        console.note(|| {
            let what = if is_merging {
                "all shards are done, wait or run, and so does the merge"
            } else {
                "all shards are done, and the result is there"
            };
            format!("nothing is missing: {what}")
        });
        if console.json {
            print::json(&SubmissionAnswer::of(&submission, &[]))?;
        }
        return Ok(0);
    }
    if let Some(time_min) = time_limit {
        submission.limit_time(time_min)?;
    }
    let submitted = submission.submit(&missing)?;
    say(&submission, &missing, submitted, console)
}

impl SubmissionAnswer {
    /// What is said where nothing was submitted.
    fn of(submission: &Submission, shards: &[u64]) -> Self {
        Self {
            schema: "twinlag.submission/1",
            engine: submission.engine().name(),
            scripts: submission.folder().to_owned(),
            shards: ranges(shards),
            job: None,
            merge_job: None,
            commands: Vec::new(),
        }
    }
}

fn say(submission: &Submission, shards: &[u64], submitted: Submitted, console: Console) -> Result<u8, Failure> {
    let mut answer = SubmissionAnswer::of(submission, shards);
    match submitted {
        Submitted::Job(job) => (answer.job, answer.merge_job) = (job.id, job.merge_id),
        Submitted::ByHand(command) => answer.commands.push(command),
    }
    if console.json {
        print::json(&answer)?;
        return Ok(0);
    }
    let scripts = answer.scripts.display();
    let what =
        if shards.is_empty() { "the merge".to_owned() } else { format!("shards {}, and the merge", answer.shards) };
    let text = match (&answer.job, &answer.merge_job) {
        (None, None) => {
            console.note(|| format!("scripts: {scripts}; this starts {what}:"));
            answer.commands.join("\n")
        }
        (Some(job), None) => format!("submitted as job {job}: {what}; scripts and logs: {scripts}"),
        (None, Some(merge)) => format!("submitted as job {merge}: {what}; scripts and logs: {scripts}"),
        (Some(job), Some(merge)) => format!("submitted as jobs {job} and {merge}: {what}; scripts and logs: {scripts}"),
    };
    print::on_stdout(&(text + "\n"))?;
    Ok(0)
}

/// Says how far the shards are. Ends with exit code 75 while there is no result.
///
/// - `progress`: what each shard of so many has left
/// - `result`: where the result is; `None` if there is none
pub(crate) fn status(
    scripts: &Path,
    progress: impl FnOnce(u64) -> Result<Vec<ShardProgress>, Failure>,
    units: &'static str,
    result: Option<&Path>,
    console: Console,
) -> Result<u8, Failure> {
    let submission = Submission::open(scripts)?;
    let queue = match submission.queue() {
        Err(error) => {
            console.note(|| format!("whether shards wait or run is not known: {error}"));
            None
        }
        Ok(queue) => queue,
    };
    let progress = progress(submission.work().shards.get())?;
    let merged = is_merged(&progress, result);
    let of_shard = |(shard, shown): (u64, ShardProgress)| {
        let state = ShardState::of(shard, &shown, queue.as_ref());
        let done = *shown.done.as_ref().unwrap_or(&0);
        let because = match state {
            ShardState::Missing | ShardState::Unknown => submission.last_line_of(shard),
            _ => shown.done.err(),
        };
        ShardStatus { shard, state, done, total: shown.total, because }
    };
    let shards: Vec<ShardStatus> = (0..).zip(progress).map(of_shard).collect();
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

/// Most reasons that are shown.
const SHOWN_REASONS: usize = 5;

impl SubmissionStatus {
    fn in_words(&self) -> String {
        let Self { engine, units, done, total, merged, shards, .. } = self;
        let row = |(state, name): &(ShardState, &str)| {
            let of: Vec<u64> = shards.iter().filter(|shard| shard.state == *state).map(|shard| shard.shard).collect();
            (!of.is_empty()).then(|| vec![(*name).to_owned(), of.len().to_string(), ranges(&of)])
        };
        let rows: Vec<_> = ShardState::ALL.iter().filter_map(row).collect();
        let reasons: Vec<String> = shards
            .iter()
            .filter_map(|shard| Some(format!("shard {}: {}", shard.shard, shard.because.as_ref()?)))
            .collect();
        let more = reasons.len().saturating_sub(SHOWN_REASONS);
        let more = (more > 0).then(|| format!("... and {more} more, in the answer of --json"));
        let end = if *merged { "the result is there\n" } else { "no result yet\n" };
        let lines = columns(&rows, |column| column != 1);
        let lines = lines.into_iter().chain(reasons.into_iter().take(SHOWN_REASONS)).chain(more);
        [format!("{engine}: {done} of {total} {units} in {} shards", shards.len())]
            .into_iter()
            .chain(lines.map(|line| format!("  {line}")))
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
    let (arguments, _) = config::with_config(Invocation::of_process().arguments.clone())?;
    let (mut kept, mut is_value, mut is_over) = (Vec::new(), false, false);
    for argument in arguments.into_iter().skip(1) {
        let argument = argument.to_str().ok_or_else(|| no_unicode(&argument))?.to_owned();
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

/// A path as an argument in a script; one that begins with a hyphen would be taken for an option.
pub(crate) fn text(path: impl AsRef<Path>) -> Result<String, Failure> {
    let path = path.as_ref();
    let text = path.to_str().ok_or_else(|| no_unicode(path.as_os_str()))?;
    Ok(if text.starts_with('-') { format!("./{text}") } else { text.to_owned() })
}

fn no_unicode(name: &OsStr) -> Failure {
    Failure::Usage(format!("{}: is no Unicode, as a script needs it", name.display()))
}

/// What was submitted depends on how the program was called; what an engine refuses does not.
impl From<ClusterError> for Failure {
    fn from(error: ClusterError) -> Self {
        let text = error.to_string();
        match error {
            ClusterError::Exists { .. } | ClusterError::NoText { .. } | ClusterError::NotOfEngine { .. } => {
                Self::Usage(text)
            }
            ClusterError::NotSubmitted { .. } | ClusterError::Damaged { .. } | ClusterError::Read { .. } => {
                Self::File(text)
            }
            ClusterError::Busy { .. } => Self::NotYet(text),
            _ => Self::Other(text),
        }
    }
}
