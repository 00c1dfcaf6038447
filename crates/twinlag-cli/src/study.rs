//! `twinlag study run PLAN.toml --out DIR` and `twinlag study merge DIR`.
//!
//! A shard leaves its part in the folder, with the plan beside it; `merge` finds both there. A run
//! without shards merges its only part itself.

use std::ffi::OsStr;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use schemars::JsonSchema;
use serde::Serialize;
use twinlag_experiment::{Experiment, ExperimentError, Plan, Row, Table, write};
use twinlag_study::{Options, Shard, Study as _, StudyError};

use crate::console::Console;
use crate::failure::Failure;
use crate::print;
use crate::progress;

/// What to do with a Monte-Carlo study.
#[derive(Debug, Subcommand)]
pub(crate) enum Study {
    /// Run a study, or one shard of it; the result is byte-identical for any number of threads,
    /// shards and restarts.
    Run(Run),
    /// Join the parts of all shards in a folder into the table and the pictures.
    Merge {
        /// The folder that holds the parts.
        dir: PathBuf,
    },
}

#[derive(Debug, Args)]
pub(crate) struct Run {
    /// The plan, a TOML file; the book's chapter Experiments describes it.
    plan: PathBuf,
    /// The folder for the results, created if necessary.
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
        Study::Run(run) => start(run, console),
        Study::Merge { dir } => merge(dir, console),
    }
}

fn read(path: &Path) -> Result<(Plan, String), Failure> {
    let name = path.display();
    let text = fs::read_to_string(path).map_err(|e| Failure::File(format!("{name}: cannot be read: {e}")))?;
    let plan = Plan::from_toml(&text).map_err(|e| Failure::File(format!("{name}: {e}")))?;
    Ok((plan, text))
}

fn start(run: &Run, console: Console) -> Result<u8, Failure> {
    let (plan, text) = read(&run.plan)?;
    let experiment = Experiment::new(&plan).map_err(|e| Failure::File(format!("{}: {e}", run.plan.display())))?;
    let out = run.out.display();
    fs::create_dir_all(&run.out).map_err(|e| Failure::Other(format!("{out}: cannot be created: {e}")))?;
    if !run.resume && run.shard.is_none() && run.out.join("results.json").exists() {
        return Err(Failure::Usage(format!("{out}: already holds results; name another folder, or remove them")));
    }
    let copy = run.out.join("plan.toml");
    match fs::read_to_string(&copy) {
        Ok(other) if other != text => {
            return Err(Failure::Usage(format!("{}: holds another plan; name another folder", copy.display())));
        }
        Ok(_) => {}
        Err(_) => {
            fs::write(&copy, &text)
                .map_err(|e| Failure::Other(format!("{}: cannot be written: {e}", copy.display())))?;
        }
    }
    let shard = run.shard.unwrap_or(Shard::WHOLE);
    let part = run.out.join(shard.file_name());
    let options = Options {
        threads: run.threads.unwrap_or(Options::default().threads),
        shard,
        checkpoint: Some(part.clone()),
        resume: run.resume,
        program: env!("TWINLAG_VERSION").to_owned(),
        ..Options::default()
    };
    let bar = progress::bar(console).with_message("trials");
    let done = twinlag_study::run(&experiment, &options, |p| {
        bar.set_length(p.total);
        bar.set_position(p.done);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    done?;
    if run.shard.is_some() {
        let text = format!("{}: done; when all parts are done, run `twinlag study merge {out}`", part.display());
        say(console, &StudyPart { schema: "twinlag.study-part/1", part, shard: shard.to_string() }, text)?;
        return Ok(0);
    }
    merge(&run.out, console)
}

fn merge(dir: &Path, console: Console) -> Result<u8, Failure> {
    let (plan, _) = read(&dir.join("plan.toml"))?;
    let name = dir.display();
    let entries = fs::read_dir(dir).map_err(|e| Failure::File(format!("{name}: cannot be read: {e}")))?;
    let mut parts: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| is_part(p)).collect();
    parts.sort();
    if parts.is_empty() {
        return Err(Failure::File(format!("{name}: holds no part of a study; run `twinlag study run` first")));
    }
    let results = twinlag_study::merge(&parts)?;
    let experiment = Experiment::new(&plan)?;
    if results.header().plan() != experiment.plan() {
        return Err(Failure::File(format!(
            "{name}: the parts belong to a plan other than plan.toml, or to another version"
        )));
    }
    let table = Table::of(&experiment, &results)?;
    write(&plan, &table, dir)?;
    let trials: u64 = results.cells().iter().map(twinlag_study::Tally::trials).sum();
    let text = format!("{name}: {trials} trials in {} cells: results.json, results.csv", results.cells().len());
    say(console, &StudyAnswer { schema: "twinlag.study/1", out: dir.to_owned(), trials, rows: table.rows }, text)?;
    Ok(0)
}

fn is_part(path: &Path) -> bool {
    path.file_name().and_then(OsStr::to_str).and_then(Shard::of_file_name).is_some()
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
            StudyError::Incomplete { .. } => Self::NotYet(error.to_string()),
            StudyError::Damaged { .. } | StudyError::OtherStudy { .. } => Self::File(error.to_string()),
            _ => Self::Other(error.to_string()),
        }
    }
}
