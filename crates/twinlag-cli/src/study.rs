//! `twinlag study run PLAN.toml --out DIR`, `twinlag study merge DIR`, what a study will take, and shards on a cluster.
//!
//! A shard leaves its part in the folder, or the object store, with the plan beside it; `merge` finds both there. A run without shards
//! merges its only part itself. What was submitted is in the folder `submission` within.

mod plan;

use std::fs;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use schemars::JsonSchema;
use serde::Serialize;
use twinlag_cluster::{Storage, Work};
use twinlag_experiment::{Experiment, ExperimentError, Plan, Row, Table, write};
use twinlag_study::{Options, Part, Shard, Study as _, StudyError};

use crate::console::Console;
use crate::failure::Failure;
use crate::place::{self, Place};
use crate::study::plan::Planning;
use crate::submission::{self, Cluster, ShardProgress};
use crate::{output, print, progress};

pub(crate) use crate::study::plan::StudyPlan;

/// What to do with a Monte-Carlo study.
#[derive(Debug, Subcommand)]
pub(crate) enum Study {
    /// Run a study, or one shard of it; the result is byte-identical for any number of threads,
    /// shards and restarts.
    Run(Run),
    /// Join the parts of all shards in a folder into the table and the pictures.
    Merge {
        /// The folder that holds the parts, or `s3://BUCKET/PREFIX`.
        dir: PathBuf,
    },
    /// Run a few trials, and say what the whole study will take, and in how many shards.
    Plan(Planning),
    /// Run all shards of a study on a cluster, and the merge behind them.
    #[command(mut_arg("engine", |engine| engine.required(true)))]
    Submit(Submit),
    /// Say how far the shards are that were submitted. Exit code 75: there is no result yet.
    Status {
        /// The folder that holds the parts, or `s3://BUCKET/PREFIX`.
        dir: PathBuf,
    },
    /// Submit again the shards that are missing, which are neither done nor waiting nor running, and the merge.
    Resubmit {
        /// The folder that holds the parts, or `s3://BUCKET/PREFIX`.
        dir: PathBuf,
        /// Another limit than before, in minutes.
        #[arg(long, value_name = "MINUTES")]
        time_limit: Option<NonZeroU32>,
    },
}

#[derive(Debug, Args)]
pub(crate) struct Submit {
    /// The plan, a TOML file; the book's chapter Experiments describes it.
    plan: PathBuf,
    /// The folder for the results, created if necessary; all machines have to see it, as they see `s3://BUCKET/PREFIX`.
    #[arg(long)]
    out: PathBuf,
    #[command(flatten)]
    cluster: Cluster,
}

#[derive(Debug, Args)]
pub(crate) struct Run {
    /// The plan, a TOML file; the book's chapter Experiments describes it.
    plan: PathBuf,
    /// The folder for the results, created if necessary; or `s3://BUCKET/PREFIX`, in an object store.
    #[arg(long)]
    out: PathBuf,
    /// Run only part K of N, with K counted from 0.
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Continue where an interrupted run stopped.
    #[arg(long)]
    resume: bool,
    /// Number of threads; one per processor if left out. The result does not depend on it.
    #[arg(long)]
    threads: Option<std::num::NonZeroUsize>,
}

/// What `twinlag study run` and `twinlag study merge` print with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct StudyAnswer {
    /// `twinlag.study/1`.
    schema: &'static str,
    /// Folder of the results.
    out: PathBuf,
    /// Number of trials in all cells together.
    trials: u64,
    /// A row for each cell, method and sensor, with the columns of results.csv.
    rows: Vec<Row>,
}

/// What `twinlag study run --shard` prints with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct StudyPart {
    /// `twinlag.study-part/1`.
    schema: &'static str,
    /// File of the shard's results.
    part: PathBuf,
    /// Index of the shard, from 0, and number of shards, as in `0/3`.
    shard: String,
}

pub(crate) fn run(command: &Study, console: Console) -> Result<u8, Failure> {
    match command {
        Study::Run(run) => place::at(&run.out, |place| start(run, place, console)),
        Study::Merge { dir } => place::at(dir, |place| merge(place, console)),
        Study::Plan(planning) => plan::run(planning, console),
        Study::Submit(command) => place::at(&command.out, |place| submit(command, place, console)),
        Study::Status { dir } => place::at(dir, |place| status(place, console)),
        Study::Resubmit { dir, time_limit } => place::at(dir, |place| resubmit(place, *time_limit, console)),
    }
}

/// The plan in the folder of the results.
const PLAN: &str = "plan.toml";
/// The results.
const RESULTS: &str = "results.json";
/// The results as a table.
const RESULTS_TABLE: &str = "results.csv";
/// What parts say made them.
const PROGRAM: &str = env!("TWINLAG_VERSION");
/// The folder of what was submitted.
const SUBMISSION: &str = "submission";

/// Says how far the shards are.
fn status(place: &mut Place, console: Console) -> Result<u8, Failure> {
    let result = fetched_results(place)?;
    submission::status(&scripts(place), |of| progress_of(place, of), "trials", result.as_deref(), console)
}

/// Submits again what is missing of the shards.
fn resubmit(place: &mut Place, time_limit: Option<NonZeroU32>, console: Console) -> Result<u8, Failure> {
    let result = fetched_results(place)?;
    submission::resubmit(&scripts(place), |of| progress_of(place, of), result.as_deref(), time_limit, console)
}

/// Brings the plan, the parts and the results, and returns where the results are; `None` if they are not all there.
fn fetched_results(place: &mut Place) -> Result<Option<PathBuf>, Failure> {
    place.fetch(|name| [PLAN, RESULTS, RESULTS_TABLE].contains(&name) || Shard::of_file_name(name).is_some())?;
    Ok(results_in(place.folder()))
}

/// The folder of what was submitted.
fn scripts(place: &Place) -> PathBuf {
    place.scripts(place.folder(), place.folder().join(SUBMISSION))
}

/// Submits all shards.
fn submit(command: &Submit, place: &mut Place, console: Console) -> Result<u8, Failure> {
    place.fetch(|name| name == PLAN)?;
    expect_no_results(&read(&command.plan)?.0, place)?;
    expect_one_division(place, command.cluster.shards(), Failure::Usage)?;
    let plan = prepare(&command.plan, place)?;
    let (out, copy) = (submission::text(&command.out)?, submission::text(place.named(&place.folder().join(PLAN)))?);
    let threads = command.cluster.cpus.unwrap_or(NonZeroU32::MIN).to_string();
    let shard =
        ["study", "run", &copy, "--out", &out, "--shard", Work::SHARD, "--resume", "--quiet", "--threads", &threads]
            .map(str::to_owned)
            .to_vec();
    let merge = ["study", "merge", &out].map(str::to_owned).to_vec();
    let storage = if place.is_stored() { Storage::Objects } else { Storage::Folders };
    let work = command.cluster.work(&plan.name, storage, shard, merge)?;
    command.cluster.submit(&scripts(place), work, console)
}

/// What each of so many shards has left.
fn progress_of(place: &Place, of: u64) -> Result<Vec<ShardProgress>, Failure> {
    let dir = place.folder();
    let (plan, _) = read(&dir.join(PLAN))?;
    let experiment = Experiment::new(&plan)?;
    expect_one_division(place, of, Failure::File)?;
    let progress = |shard: Shard| {
        let part = dir.join(shard.file_name());
        let read = || Part::read_of(&experiment, shard, PROGRAM, &part).map(|part| part.done());
        let done = if part.exists() { read().map_err(|error| place.said(error.into()).to_string()) } else { Ok(0) };
        Ok(ShardProgress { total: shard.trials(&experiment)?, done, part })
    };
    Shard::all(of).map(progress).collect()
}

/// Refuses parts of another number of shards, saying which.
fn expect_one_division(place: &Place, of: u64, refused: fn(String) -> Failure) -> Result<(), Failure> {
    match parts_in(place)?.into_iter().find(|part| part.of() != of) {
        None => Ok(()),
        Some(part) => {
            let part = place.folder().join(part.file_name());
            Err(refused(format!(
                "{}: is of another number of shards than {of}; remove it, or name another folder",
                part.display()
            )))
        }
    }
}

/// The names of all results, `results.json` last: where it is, so are the others.
fn result_names(plan: &Plan) -> Vec<String> {
    let summaries = plan.summaries.iter().map(|summary| format!("{}.md", summary.file));
    let pictures = plan.pictures.iter().map(|picture| format!("{}.svg", picture.file));
    [RESULTS_TABLE.to_owned()].into_iter().chain(summaries).chain(pictures).chain([RESULTS.to_owned()]).collect()
}

/// Refuses to replace what the results of a plan would replace.
fn expect_no_results(plan: &Plan, place: &Place) -> Result<(), Failure> {
    let there = place.names()?;
    match result_names(plan).into_iter().rev().find(|name| there.contains(name)) {
        None => Ok(()),
        Some(name) => {
            let path = place.folder().join(name);
            Err(Failure::Usage(format!("{} exists: name another folder, or remove it", path.display())))
        }
    }
}

/// Where the results are; `None` if they are not all there.
fn results_in(dir: &Path) -> Option<PathBuf> {
    let path = dir.join(RESULTS);
    let table: Table = serde_json::from_slice(&fs::read(&path).ok()?).ok()?;
    (!table.rows.is_empty() && dir.join(RESULTS_TABLE).exists()).then_some(path)
}

/// Reads the plan of a study, and puts it into the folder of the results.
fn prepare(plan_file: &Path, place: &mut Place) -> Result<Plan, Failure> {
    let (plan, text) = read(plan_file)?;
    let out = place.folder();
    Experiment::new(&plan).map_err(|e| Failure::File(format!("{}: {e}", plan_file.display())))?;
    fs::create_dir_all(out).map_err(|e| Failure::Other(format!("{}: cannot be created: {e}", out.display())))?;
    let copy = out.join(PLAN);
    if !copy.exists() {
        output::write(&copy, &text)?;
        place.store_first(&copy)?;
    }
    if place::text(&copy)? == text {
        return Ok(plan);
    }
    Err(Failure::Usage(format!("{}: holds another plan; name another folder", copy.display())))
}

fn read(path: &Path) -> Result<(Plan, String), Failure> {
    let name = path.display();
    let text = place::text(path)?;
    let plan = Plan::from_toml(&text).map_err(|e| Failure::File(format!("{name}: {e}")))?;
    Ok((plan, text))
}

fn start(run: &Run, place: &mut Place, console: Console) -> Result<u8, Failure> {
    let shard = run.shard.unwrap_or(Shard::WHOLE);
    place.fetch(|name| name == PLAN || name == shard.file_name())?;
    if !run.resume && run.shard.is_none() {
        expect_no_results(&read(&run.plan)?.0, place)?;
    }
    let plan = prepare(&run.plan, place)?;
    let experiment = Experiment::new(&plan)?;
    let is_other = |part: &Shard| *part != shard && part.overlaps(shard);
    if let Some(part) = parts_in(place)?.into_iter().find(is_other) {
        let part = place.folder().join(part.file_name());
        return Err(Failure::Usage(format!(
            "{}: has trials that shard {shard} has as well; remove it, or name another folder",
            part.display()
        )));
    }
    let part = place.folder().join(shard.file_name());
    let options = Options {
        threads: run.threads.unwrap_or(Options::default().threads),
        shard,
        checkpoint: Some(part.clone()),
        resume: run.resume,
        program: PROGRAM.to_owned(),
        ..Options::default()
    };
    let bar = progress::bar(console).with_message("trials");
    let done = twinlag_study::run(&experiment, &options, |p| {
        bar.set_length(p.total);
        bar.set_position(p.done);
        place.store_so_far(&part, console)
    });
    bar.finish_and_clear();
    // A trial that fails leaves what was done before it.
    if part.exists() {
        place.store(&part)?;
    }
    done?;
    if run.shard.is_some() {
        let (part, out) = (place.named(&part), run.out.display());
        let text = format!("{}: done; when all parts are done, run `twinlag study merge {out}`", part.display());
        say(console, &StudyPart { schema: "twinlag.study-part/1", part, shard: shard.to_string() }, text)?;
        return Ok(0);
    }
    merge(place, console)
}

fn merge(place: &mut Place, console: Console) -> Result<u8, Failure> {
    place.fetch(|name| name == PLAN || Shard::of_file_name(name).is_some())?;
    let dir = place.folder();
    let (plan, _) = read(&dir.join(PLAN))?;
    let name = dir.display();
    let parts = parts_in(place)?;
    if parts.is_empty() {
        return Err(Failure::NotYet(format!("{name}: holds no part of a study; run `twinlag study run` first")));
    }
    let results = twinlag_study::merge(parts.iter().map(|part| dir.join(part.file_name())))?;
    let experiment = Experiment::new(&plan)?;
    if results.header().plan() != experiment.plan() {
        return Err(Failure::File(format!(
            "{name}: the parts belong to a plan other than plan.toml, or to another version"
        )));
    }
    let table = Table::of(&experiment, &results)?;
    write(&plan, &table, dir)?;
    let dir = dir.to_owned();
    result_names(&plan).iter().try_for_each(|name| place.store(&dir.join(name)))?;
    let out = place.named(&dir);
    let trials: u64 = results.cells().iter().map(twinlag_study::Tally::trials).sum();
    let (name, cells) = (out.display(), results.cells().len());
    let text = format!("{name}: {trials} trials in {cells} cells: {RESULTS}, {RESULTS_TABLE}");
    say(console, &StudyAnswer { schema: "twinlag.study/1", out, trials, rows: table.rows }, text)?;
    Ok(0)
}

/// The shards whose parts are there, neighbours side by side: these merge at once.
fn parts_in(place: &Place) -> Result<Vec<Shard>, Failure> {
    let mut parts: Vec<Shard> = place.names()?.iter().filter_map(|name| Shard::of_file_name(name)).collect();
    parts.sort_by_key(|shard| (shard.of(), shard.index()));
    Ok(parts)
}

fn say(console: Console, answer: &impl Serialize, text: String) -> Result<(), Failure> {
    if console.json {
        return print::json(answer);
    }
    console.note(|| text);
    Ok(())
}

impl From<ExperimentError> for Failure {
    fn from(error: ExperimentError) -> Self {
        Self::Other(error.to_string())
    }
}

/// A part that already exists, or does not exist yet, depends on how the program was called.
impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Exists { .. } => Self::Usage(error.to_string()),
            StudyError::Incomplete { .. } | StudyError::Busy { .. } => Self::NotYet(error.to_string()),
            StudyError::Damaged { .. } | StudyError::OtherStudy { .. } => {
                Self::File(format!("{error}; remove it, and run its shard again"))
            }
            StudyError::Read { .. } | StudyError::Twice { .. } => Self::File(error.to_string()),
            _ => Self::Other(error.to_string()),
        }
    }
}
