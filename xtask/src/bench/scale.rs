//! How time and memory of each verb grow with the record: `cargo xtask bench --scale`.
//!
//! Each verb runs in a process of its own, on a simulated record of each length, and so does the work that it cannot do without: its
//! *bare work*. What is compared is the processor time of both, from one run on one machine; the memory is the most that the process
//! has had.

mod page;
mod step;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use twinlag::record::Decimals;
use twinlag::signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};

pub(crate) use step::{Named, Step, Verb, processor_s};

use crate::experiment::record_of;
use crate::root;

/// Rows of the records, for the page, for a quick look, and where the machine has the memory.
const ROWS: [usize; 4] = [10_000, 100_000, 1_000_000, 10_000_000];
const QUICK_ROWS: [usize; 3] = [1_000, 10_000, 100_000];
const MOST_ROWS: usize = 100_000_000;
/// Decimals of the temperatures in the files, K: a hundredth of the noise.
const DECIMALS: usize = 3;
const PERIOD_S: f64 = 0.001;
/// Steps that the sensors of one record are integrated in, at most.
const MOST_STEPS: usize = 80_000_000;

/// What is asked of the bench.
pub(crate) struct Asked<'a> {
    pub(super) quick: bool,
    /// Also a hundred million rows.
    pub(super) huge: bool,
    /// A folder of measured records.
    pub(super) measured: Option<&'a Path>,
    /// A verb that takes longer is not asked for more rows.
    pub(super) limit_s: f64,
}

/// What a step took.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Took {
    pub(crate) rows: usize,
    /// From beginning to end, s.
    pub(crate) wall_s: f64,
    /// Processor time of all threads, s.
    pub(crate) processor_s: f64,
    /// The most memory that the process has had, MB; `None` where the system does not say.
    pub(crate) peak_mb: Option<f64>,
}

/// A verb on one record, beside its bare work.
pub(super) struct Row {
    pub(super) verb: Verb,
    pub(super) took: Took,
    pub(super) bare: Took,
}

/// A measured record.
pub(super) struct Measured {
    pub(super) file: String,
    pub(super) took: Took,
}

/// Everything that was measured.
#[derive(Default)]
pub(super) struct Results {
    pub(super) rows: Vec<Row>,
    pub(super) measured: Vec<Measured>,
    /// What was not measured, and why.
    pub(super) left_out: Vec<String>,
}

pub(crate) fn run(asked: &Asked<'_>) -> Result<()> {
    let folder = root()?.join("target/scale");
    fs::create_dir_all(&folder)?;
    let mut lengths = if asked.quick { QUICK_ROWS.to_vec() } else { ROWS.to_vec() };
    lengths.extend(asked.huge.then_some(MOST_ROWS));
    let mut results = Results::default();
    let files = lengths.iter().map(|rows| simulated(&folder, *rows)).collect::<Result<Vec<PathBuf>>>()?;
    for verb in Verb::ALL {
        let mut last: Option<Took> = None;
        for (rows, file) in lengths.iter().zip(&files) {
            if let Some(before) = last.filter(|before| expected_s(before, *rows) > asked.limit_s) {
                let why = format!(
                    "{} of {rows} rows: {} took {:.0} s, and more than {:.0} s are not waited for",
                    verb.name(),
                    before.rows,
                    before.wall_s,
                    asked.limit_s
                );
                println!("left out: {why}");
                results.left_out.push(why);
                break;
            }
            match measure(verb, file) {
                Ok(row) => {
                    println!("{}", page::line(&row));
                    last = Some(row.took);
                    results.rows.push(row);
                }
                Err(error) => {
                    results.left_out.push(format!("{} of {rows} rows: {error:#}", verb.name()));
                    break;
                }
            }
        }
    }
    match asked.measured {
        Some(dir) => measured(dir, &mut results)?,
        None => results.left_out.push("measured records: no folder was given".into()),
    }
    page::print(&results);
    if asked.quick {
        return Ok(());
    }
    page::write(&results)
}

/// How long a verb will take if it grows as the record does.
fn expected_s(before: &Took, rows: usize) -> f64 {
    before.wall_s * rows as f64 / before.rows as f64
}

fn measure(verb: Verb, file: &Path) -> Result<Row> {
    let took = child(Step::Verb(verb), file)?;
    Ok(Row { verb, took, bare: child(verb.bare(), file)? })
}

/// A step in a process of its own.
pub(crate) fn child(step: Step, file: &Path) -> Result<Took> {
    let output = Command::new(std::env::current_exe()?)
        .args(["bench", "--step", &step.name()])
        .arg(file)
        .output()
        .context("the bench could not start itself")?;
    let error = String::from_utf8_lossy(&output.stderr);
    let last = error.lines().last().unwrap_or("no message");
    ensure!(output.status.success(), "{} failed: {last}", step.name());
    serde_json::from_slice(&output.stdout).with_context(|| format!("{}: what it says is no result", step.name()))
}

fn measured(dir: &Path, results: &mut Results) -> Result<()> {
    for (file, channels) in crate::measured::records() {
        let path = dir.join(file);
        if !path.exists() {
            results.left_out.push(format!("{file}: it is not in the folder"));
            continue;
        }
        let took = child(Step::Measured(channels), &path)?;
        println!("diagnose {file}: {} rows, {:.1} s", took.rows, took.wall_s);
        results.measured.push(Measured { file: file.into(), took });
    }
    Ok(())
}

/// The file of a simulated record: turbulence that sensors of 30 and 110 ms read every millisecond, in noise of 0.1 K.
pub(crate) fn simulated(folder: &Path, rows: usize) -> Result<PathBuf> {
    let path = folder.join(format!("turbulence-{rows}.csv"));
    if path.exists() {
        return Ok(path);
    }
    let sensors = [("T1", 0.03), ("T2", 0.11)].map(|(name, tau_s)| {
        let mut sensor = Sensor::new(name, tau_s);
        sensor.noise = Some(Noise::white(0.1));
        sensor
    });
    let signal = Signal::Turbulence(Turbulence { std_k: 8.0, corner_hz: 5.0, cutoff_hz: 200.0 });
    let mut sampling = Record::new(rows, PERIOD_S);
    sampling.oversampling = sampling.oversampling.min((MOST_STEPS / rows).max(1));
    let record = record_of(Rig::new(1, sampling, Gas::new(300.0, signal), sensors)?.simulate()?)?;
    // A run that is broken off must leave no half of a record.
    let half = path.with_extension("part");
    record.write_csv(&mut fs::File::create(&half)?, Decimals::Fixed(DECIMALS))?;
    fs::rename(&half, &path)?;
    Ok(path)
}
