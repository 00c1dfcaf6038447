//! The experiments: each a plan in a folder of the book, with its table, its pictures and what made them beside it.

mod campaign;
mod coverage;
mod grades;
mod loops;
mod missing;
mod pair;
mod planning;
mod policy;
mod reconstruction;
mod stored;
mod surface;
mod ties;
mod tracking;

use std::fs;
use std::io::IsTerminal;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use twinlag_experiment::{Experiment, Method, Plan, Table, write};
use twinlag_study::{Options, Outcome, Part, Results, Shard, Study};

use crate::root;
pub(crate) use loops::record_of;

/// What to do with the experiments.
#[derive(Subcommand)]
pub(crate) enum Task {
    /// Their names, and what each shows.
    List,
    /// Runs one, or all of them.
    Run(Run),
    /// Draws pictures and tables of stored results again, after a change of how the plan wants them.
    Draw {
        /// The experiment; `all` draws every one.
        name: String,
    },
    /// Joins the parts of shards, in any order, into the table and the pictures.
    Merge {
        /// The experiment.
        name: String,
        /// The parts.
        #[arg(required = true)]
        parts: Vec<PathBuf>,
        /// Where the results go.
        #[arg(long)]
        out: PathBuf,
    },
}

#[derive(Args, Clone)]
pub(crate) struct Run {
    /// The experiment; `all` runs every one.
    name: String,
    /// Trials in each cell, in place of the plan's.
    #[arg(long)]
    trials: Option<u64>,
    /// Seed, in place of the plan's.
    #[arg(long)]
    seed: Option<u64>,
    /// Threads; by default one for each processor. The result does not depend on them.
    #[arg(long)]
    threads: Option<NonZeroUsize>,
    /// Where the results go; by default the experiment's own folder in the book, which needs the plan as it stands.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Goes on where an interrupted run stopped.
    #[arg(long)]
    resume: bool,
    /// Runs part `k/n` alone (`k` from 0), into OUT/part-k-of-n.json; see `merge`.
    #[arg(long, requires = "out")]
    shard: Option<Shard>,
    /// Runs again and names the first cell that differs from the stored table; writes nothing.
    #[arg(long, conflicts_with_all = ["trials", "seed", "out", "shard"])]
    check: bool,
    /// A few cells alone: that it runs, not what it says.
    #[arg(skip)]
    quick: bool,
}

const FOLDER: &str = "docs/src/experiments";

pub(crate) fn run(task: Task) -> Result<()> {
    match task {
        Task::List => {
            for name in names()? {
                println!("{name:24} {}", title(&name)?);
            }
            Ok(())
        }
        Task::Run(run) if run.name == "all" => names()?.iter().try_for_each(|name| {
            let out = run.out.as_ref().map(|out| out.join(name));
            one(name, &Run { out, ..run.clone() })
        }),
        Task::Run(run) => one(&run.name, &run),
        Task::Draw { name } if name == "all" => names()?.iter().try_for_each(|name| draw(name)),
        Task::Draw { name } => draw(&name),
        Task::Merge { name, parts, out } => {
            let results = twinlag_study::merge(&parts)?;
            if let Some(own) = stored::read(&name, &text(&name)?) {
                return own?.merge(&results, &out);
            }
            let plan = plan(&name)?;
            // The plan of the parts is in their header; a table is only made of the one that is asked for.
            let plan = with_trials_of(plan, &results);
            ensure!(
                results.header().plan() == Experiment::new(&plan)?.plan(),
                "the parts are of another plan than {name}, or of another version of it"
            );
            write(&plan, &Table::new(&plan, &results)?, &out)?;
            println!("{name}: {}", out.display());
            Ok(())
        }
    }
}

/// Leaves out all but the last so many of a list.
fn keep_last<T>(list: &mut Vec<T>, count: usize) {
    list.drain(..list.len().saturating_sub(count));
}

/// Every experiment with a trial in each cell, into `out`: that they run, not what they say.
pub(crate) fn quick(out: &Path) -> Result<()> {
    let run = Run {
        name: "all".into(),
        trials: Some(1),
        seed: None,
        threads: None,
        out: Some(out.to_owned()),
        resume: false,
        shard: None,
        check: false,
        quick: true,
    };
    self::run(Task::Run(run))
}

fn with_trials_of(mut plan: Plan, results: &Results) -> Plan {
    plan.trials = results.header().trials();
    plan
}

fn names() -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(root()?.join(FOLDER))? {
        let path = entry?.path();
        if path.join("plan.toml").exists() {
            names.extend(path.file_name().map(|n| n.to_string_lossy().into_owned()));
        }
    }
    names.sort();
    Ok(names)
}

fn text(name: &str) -> Result<String> {
    let path = root()?.join(FOLDER).join(name).join("plan.toml");
    match fs::read_to_string(&path) {
        Ok(text) => Ok(text),
        Err(_) => bail!("there is no experiment called \"{name}\"; there are {}", names()?.join(", ")),
    }
}

fn plan(name: &str) -> Result<Plan> {
    Ok(Plan::from_toml(&text(name)?)?)
}

fn title(name: &str) -> Result<String> {
    if let Some(own) = stored::read(name, &text(name)?) {
        return Ok(own?.title().to_owned());
    }
    if name == surface::NAME { Ok(surface::Plan::read(&text(name)?)?.title) } else { Ok(plan(name)?.title) }
}

fn draw(name: &str) -> Result<()> {
    if name == surface::NAME || stored::read(name, &text(name)?).is_some() {
        println!("{name}: its pictures and tables are made by running it");
        return Ok(());
    }
    let (plan, folder) = (plan(name)?, root()?.join(FOLDER).join(name));
    let stored = fs::read_to_string(folder.join("results.json")).context("there is no stored table")?;
    let mut table: Table = serde_json::from_str(&stored).context("the stored table cannot be read")?;
    ensure!(table.plan.decisive() == plan.decisive(), "{name}: the stored table is of another plan: run it again");
    table.plan = plan.decisive();
    write(&plan, &table, &folder)?;
    println!("{name}: {}", folder.display());
    Ok(())
}

fn one(name: &str, run: &Run) -> Result<()> {
    let folder = root()?.join(FOLDER).join(name);
    if name == surface::NAME {
        let mut plan = surface::Plan::read(&text(name)?)?;
        if run.quick {
            plan.shorten();
        }
        return surface::run(&plan, run.out.as_deref().unwrap_or(&folder), run.check);
    }
    if let Some(own) = stored::read(name, &text(name)?) {
        return own?.run(&folder, run);
    }
    let mut plan = plan(name)?;
    plan.trials = run.trials.unwrap_or(plan.trials);
    plan.seed = run.seed.unwrap_or(plan.seed);
    let out = place(run, &folder)?;
    let options = options(run, &out)?;
    let (finished, seconds) = observed(&Experiment::new(&plan)?, name, &options)?;
    if let Some(shard) = run.shard {
        println!("{name}: part {shard} in {seconds:.0} s");
        return Ok(());
    }
    let table = Table::new(&plan, &finished.into_results()?)?;
    if run.check {
        let stored = fs::read_to_string(folder.join("results.json")).context("there is no stored table")?;
        let stored: Table = serde_json::from_str(&stored).context("the stored table cannot be read")?;
        match table.first_difference(&stored) {
            Some(difference) => bail!("{name}: {difference}"),
            None => println!("{name}: the stored table holds, to the byte; {seconds:.0} s"),
        }
        return Ok(());
    }
    write(&plan, &table, &out)?;
    provenance(&plan.name, plan.seed, plan.trials, &out, seconds, options.threads.get())?;
    if plan.timed {
        fs::write(out.join("times.md"), times(&plan)?)?;
    }
    if let Some(part) = options.checkpoint {
        fs::remove_file(part)?;
    }
    println!("{name}: {} trials in {seconds:.0} s, {}", plan.trials * plan.cells().len() as u64, out.display());
    Ok(())
}

/// Where results go: those that are stored are not overwritten by others.
fn place(run: &Run, folder: &Path) -> Result<PathBuf> {
    ensure!(
        run.out.is_some() || (run.trials.is_none() && run.seed.is_none()),
        "other trials or another seed than the plan's need --out DIR: the stored results are those of the plan"
    );
    let out = run.out.clone().unwrap_or(folder.to_owned());
    ensure!(
        run.out.is_none() || run.shard.is_some() || !out.join("results.json").exists(),
        "{}: holds results already; name another folder, or remove them",
        out.display()
    );
    Ok(out)
}

/// How to run, with a checkpoint in `out` unless nothing is to be written.
fn options(run: &Run, out: &Path) -> Result<Options> {
    let checkpoint = match (run.check, run.shard) {
        (true, _) => None,
        (_, Some(shard)) => Some(out.join(shard.file_name())),
        _ => Some(out.join("checkpoint.json")),
    };
    if checkpoint.is_some() {
        fs::create_dir_all(out)?;
    }
    Ok(Options {
        threads: run.threads.unwrap_or(Options::default().threads),
        shard: run.shard.unwrap_or(Shard::WHOLE),
        checkpoint,
        resume: run.resume,
        program: commit(),
        ..Options::default()
    })
}

/// Runs a study under a progress bar; how long it took, s.
fn observed<S: Study>(study: &S, name: &str, options: &Options) -> Result<(Part, f64)> {
    let start = Instant::now();
    let bar = bar(name);
    let finished = twinlag_study::run(study, options, |p| {
        bar.set_length(p.total);
        bar.set_position(p.done);
        ControlFlow::Continue(())
    })?;
    bar.finish_and_clear();
    Ok((finished, start.elapsed().as_secs_f64()))
}

fn bar(name: &str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{prefix:24} {bar:40} {percent:>3} %, {eta} left");
    ProgressBar::new(1).with_prefix(name.to_owned()).with_style(style.unwrap_or(ProgressStyle::default_bar()))
}

/// Milliseconds of a fit by each method, the record's simulation taken off: one thread, mean over the first trials of each
/// gas's first cell.
fn times(plan: &Plan) -> Result<String> {
    let trials = plan.trials.min(50);
    let mean_ms = |plan: &Plan, cell: usize| -> Result<f64> {
        let experiment = Experiment::new(plan)?;
        let mut scratch = experiment.scratch(cell).map_err(|e| anyhow::anyhow!("{e}"))?;
        let mut outcome = Outcome::new(&experiment.quantities(cell));
        let start = Instant::now();
        for trial in 0..trials {
            outcome.clear();
            experiment.trial(cell, trial, &mut scratch, &mut outcome).map_err(|e| anyhow::anyhow!("{e}"))?;
        }
        Ok(1e3 * start.elapsed().as_secs_f64() / trials as f64)
    };
    let first_cell = |gas: usize| plan.cells().iter().position(|c| c.gas == gas).context("each gas has a cell");
    let names: Vec<&str> = plan.gases.iter().map(|g| g.name.as_str()).collect();
    let mut lines = vec![format!("| method | {} |", names.join(" | ")), format!("|---|{}", "---|".repeat(names.len()))];
    for method in &plan.methods {
        let alone = |methods: Vec<Method>| Plan { methods, ..plan.clone() };
        let mut cells = Vec::new();
        for gas in 0..names.len() {
            let cell = first_cell(gas)?;
            let fit_ms = mean_ms(&alone(vec![method.clone()]), cell)? - mean_ms(&alone(Vec::new()), cell)?;
            cells.push(format!("{fit_ms:.2}"));
        }
        lines.push(format!("| {} | {} |", method.name, cells.join(" | ")));
    }
    Ok(lines.join("\n") + "\n")
}

/// The commit that is checked out, and whether sources differ from it.
fn commit() -> String {
    let differ = if is_clean() == Some(false) { ", with changes" } else { "" };
    format!("{}{differ}", first_line("git", &["rev-parse", "HEAD"]).unwrap_or_default())
}

/// Whether the sources of the library are as committed; `None` without git.
fn is_clean() -> Option<bool> {
    first_line("git", &["status", "--porcelain", "--", "crates", "Cargo.lock"]).map(|changes| changes.is_empty())
}

/// What a program says; `None` where it fails.
fn first_line(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).current_dir(root().ok()?).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// What made the results: everything that may change from run to run, kept apart from the table that may not.
fn provenance(name: &str, seed: u64, trials: u64, out: &Path, seconds: f64, threads: usize) -> Result<()> {
    let commit = first_line("git", &["rev-parse", "HEAD"]);
    let cpu = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|l| l.starts_with("model name"))?;
        Some(line.split(':').nth(1)?.trim().to_owned())
    });
    let value = json!({
        "experiment": name, "seed": seed, "trials": trials, "version": env!("CARGO_PKG_VERSION"),
        "commit": commit, "sources_as_committed": is_clean(), "rustc": first_line("rustc", &["--version"]),
        "processor": cpu, "threads": threads, "seconds": (10.0 * seconds).round() / 10.0,
    });
    Ok(fs::write(out.join("provenance.json"), format!("{}\n", serde_json::to_string_pretty(&value)?))?)
}
