//! How long a fit and a trial take (Criterion, `benches/fits.rs`), the fits beside the SciPy script that a user would otherwise
//! write: same record, same cost, same start, same minimum, in one run.

mod merge;
pub(crate) mod scale;
mod smoother;
mod stream;

use std::fs;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use twinlag::signal::undeclared::{Kind, undeclared};
use twinlag::{DiagnoseOptions, diagnose};
use twinlag_experiment::{Experiment, Plan};
use twinlag_study::Options;

use crate::experiment::record_of;
use crate::root;

const NOISE_STD_K: f64 = 0.583_363_094_478_901_8;
/// Fits that the script averages over.
const SCIPY_FITS: usize = 20;
/// What the compensated and the plain fit reach on this record, s; the reference tests hold them to 1e-6.
const MINIMA: &str = "the reference tests hold both minima to 1e-6";

#[derive(Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(crate) struct Bench {
    /// Also runs the study of a million trials, and says how long it takes and how much memory.
    #[arg(long)]
    million: bool,
    /// Trials of that study, in place of a million.
    #[arg(long, requires = "million")]
    trials: Option<u64>,
    /// Times the closed loop on a record of 20 000 samples of every kind in place of the fits.
    #[arg(long, conflicts_with = "million")]
    diagnose: bool,
    /// Samples of these records, in place of 20 000: what is found in so many must be found in more.
    #[arg(long, requires = "diagnose", value_name = "ROWS")]
    rows: Option<usize>,
    /// One kind of record alone, by its name in the output, with the moves of its diagnosis.
    #[arg(long, requires = "diagnose", value_name = "NAME")]
    kind: Option<String>,
    /// Times the causal filter that takes readings sample by sample in place of the fits, and says how much memory it takes.
    #[arg(long, conflicts_with_all = ["million", "diagnose"])]
    stream: bool,
    /// Times one pass of filter and smoother over 1e5 samples in place of the fits, beside the same in NumPy.
    #[arg(long, conflicts_with_all = ["million", "diagnose", "stream"])]
    smoother: bool,
    /// Times the merge of a study whose parts have one block each in place of the fits: of so many parts, and of a tenth.
    #[arg(long, value_name = "PARTS", conflicts_with_all = ["million", "diagnose", "stream", "smoother"])]
    merge: Option<u64>,
    #[command(flatten)]
    long: Long,
    /// One step of `--scale`, in a process of its own.
    #[arg(long, hide = true, requires = "file")]
    step: Option<scale::Named>,
    /// The file of that step.
    #[arg(hide = true)]
    file: Option<PathBuf>,
}

/// How the verbs grow.
#[derive(Args)]
struct Long {
    /// Measures how time and memory of each verb grow with the record, in place of the fits, and writes the book's page on it.
    #[arg(long, conflicts_with_all = ["million", "diagnose", "stream"])]
    scale: bool,
    /// Up to a hundred thousand rows alone, and no page.
    #[arg(long, requires = "scale")]
    quick: bool,
    /// A hundred million rows as well, where the machine has the memory.
    #[arg(long, requires = "scale")]
    huge: bool,
    /// A folder of measured records, as for `measured`, to diagnose as well.
    #[arg(long, requires = "scale", value_name = "DIR")]
    measured: Option<PathBuf>,
    /// A verb that would take longer is not asked for more rows, s.
    #[arg(long, requires = "scale", default_value_t = 600.0)]
    limit: f64,
}

pub(crate) fn run(arguments: &Bench) -> Result<()> {
    if let (Some(step), Some(file)) = (&arguments.step, &arguments.file) {
        return step.run(file);
    }
    if arguments.long.scale {
        return scale::run(&scale::Asked {
            quick: arguments.long.quick,
            huge: arguments.long.huge,
            measured: arguments.long.measured.as_deref(),
            limit_s: arguments.long.limit,
        });
    }
    if arguments.million {
        return million(arguments.trials);
    }
    if arguments.diagnose {
        return closed_loop(arguments.rows.unwrap_or(LONG), arguments.kind.as_deref());
    }
    if arguments.stream {
        return stream::run();
    }
    if let Some(parts) = arguments.merge {
        return merge::run(parts);
    }
    if arguments.smoother {
        return smoother::run();
    }
    let status = Command::new("cargo")
        .args(["bench", "--package", "xtask", "--bench", "fits", "--", "--noplot", "--quiet"])
        .current_dir(root()?)
        .status()
        .context("cargo could not be started")?;
    ensure!(status.success(), "the benchmarks failed");
    let shown = [
        ("fit-plain", "plain cross-relation, one fit"),
        ("fit-compensated", "compensated, one fit"),
        ("fit-whitened", "whitened, one fit"),
        ("fit-whitened-all-bins", "whitened without compression, one fit"),
        ("evaluate-all-bins", "whitened, one evaluation, all bins"),
        ("evaluate-compressed", "whitened, one evaluation, compressed"),
        ("estimate-everything-found", "whitened, noise and starts found, intervals"),
        ("characterise", "characterise, all of it"),
        ("noise-and-transforms", "noise of both channels and its transforms"),
        ("trial", "one trial: simulate, fit, accumulate"),
    ];
    for (id, what) in shown {
        println!("{what:45} {:>9.1} µs", 1e6 * mean_s(id)?);
    }
    println!(
        "one trial takes {:.2} times its noise and transforms",
        mean_s("trial")? / mean_s("noise-and-transforms")?
    );

    let file = root()?.join("tests/data/sine_5pct.csv");
    let output = Command::new("python3")
        .arg(root()?.join("xtask/bench/scipy_baseline.py"))
        .arg(&file)
        .args([NOISE_STD_K.to_string(), SCIPY_FITS.to_string()])
        .output()
        .context("python3 could not be started: the comparison needs Python with NumPy and SciPy")?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr);
        bail!("the SciPy script failed (pip install numpy scipy?): {}", why.lines().last().unwrap_or(""));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let theirs_s = |name: &str| -> Result<f64> {
        let line =
            text.lines().find(|l| l.starts_with(name)).with_context(|| format!("no line '{name}' in: {text}"))?;
        Ok(1e-3 * line.split_whitespace().nth(1).context("a shorter line")?.parse::<f64>()?)
    };
    for (ours, theirs) in [("fit-plain", "plain"), ("fit-compensated", "compensated"), ("fit-whitened", "compensated")]
    {
        let (ours_s, theirs_s) = (mean_s(ours)?, theirs_s(theirs)?);
        println!("{ours}: SciPy's {theirs} fit takes {:.2} ms, {:.0} times as long", 1e3 * theirs_s, theirs_s / ours_s);
    }
    println!("{MINIMA}");
    Ok(())
}

/// The mean time of a benchmark, s, as Criterion wrote it.
fn mean_s(id: &str) -> Result<f64> {
    let target = std::env::var("CARGO_TARGET_DIR").map_or(root()?.join("target"), Into::into);
    let path = target.join("criterion").join(id).join("new/estimates.json");
    let text = fs::read_to_string(&path).with_context(|| format!("{}", path.display()))?;
    let estimates: serde_json::Value = serde_json::from_str(&text)?;
    Ok(1e-9 * estimates["mean"]["point_estimate"].as_f64().context("a mean")?)
}

/// The most memory that this process has had, MB; `None` where the system does not say.
pub(crate) fn peak_mb() -> Option<f64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with("VmHWM"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// As a text.
fn peak_memory() -> String {
    peak_mb().map_or("unknown".into(), |m| format!("{m:.1} MB"))
}

/// The study of a million trials.
fn million(trials: Option<u64>) -> Result<()> {
    let mut plan = Plan::from_toml(&fs::read_to_string(root()?.join("xtask/bench/million.toml"))?)?;
    plan.trials = trials.unwrap_or(plan.trials);
    let experiment = Experiment::new(&plan)?;
    let start = Instant::now();
    let mut tenth = 0;
    let part = twinlag_study::run(&experiment, &Options::default(), |p| {
        if p.done * 10 / p.total > tenth {
            tenth = p.done * 10 / p.total;
            eprintln!("{} trials, {:.1} s, peak memory {}", p.done, start.elapsed().as_secs_f64(), peak_memory());
        }
        ControlFlow::Continue(())
    })?;
    let results = part.into_results()?;
    let seconds = start.elapsed().as_secs_f64();
    let threads = Options::default().threads;
    let trials = results.cells()[0].trials();
    println!(
        "{trials} trials of {} samples in {seconds:.1} s on {threads} threads, {:.1} µs each on one; peak memory {}",
        plan.samples[0],
        1e6 * seconds * threads.get() as f64 / trials as f64,
        peak_memory()
    );
    Ok(())
}

/// Samples of the records of which the closed loop is timed.
const LONG: usize = 20_000;

/// How long a diagnosis of all effects takes, for each kind of record, or for the one called `only`.
fn closed_loop(rows: usize, only: Option<&str>) -> Result<()> {
    let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|k| only.is_none_or(|name| name == k.name())).collect();
    let names = Kind::ALL.map(Kind::name).join(", ");
    ensure!(!kinds.is_empty(), "no kind of record is called '{}': one of {names}", only.unwrap_or_default());
    let mut slowest = (0.0, "none");
    for &kind in &kinds {
        let drawn = undeclared(&[kind], 1.0, None, 1)?;
        let mut sampled = drawn.rig.record().clone();
        sampled.samples = rows;
        let rig = drawn.rig.with_record(sampled)?;
        // Without the reference: that it is scored against costs two smoothers more.
        let mut record = record_of(rig.simulate()?)?;
        record.reference_c = None;
        let start = Instant::now();
        let answer = diagnose(&record, &DiagnoseOptions::default())?;
        let seconds = start.elapsed().as_secs_f64();
        let named: Vec<&str> = answer.effects.iter().map(|e| e.effect.name()).collect();
        println!("{:36} {seconds:6.2} s   {}", kind.name(), named.join(", "));
        if only.is_some() {
            println!("{}", serde_json::to_string_pretty(&answer.moves)?);
            println!("{:?}: {}", answer.verdict, answer.remarks.join("; "));
        }
        if seconds > slowest.0 {
            slowest = (seconds, kind.name());
        }
    }
    println!(
        "the slowest of {} records of {rows} samples takes {:.2} s ({}), on {} processors",
        kinds.len(),
        slowest.0,
        slowest.1,
        Options::default().threads
    );
    Ok(())
}
