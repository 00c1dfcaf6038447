//! Experiments that are studies of their own, with tables of their own beside the stored results.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use twinlag_study::{Results, Study};

use super::reconstruction::Reconstruction;
use super::tracking::Tracking;
use super::{Run, coverage, loops, observed, options, place, provenance, reconstruction, tracking};

/// An experiment that is a study of its own, with tables of its own.
pub(super) trait Stored: Study {
    fn name(&self) -> &str;

    fn title(&self) -> &str;

    fn seed(&self) -> u64;

    fn set_seed(&mut self, seed: u64);

    fn set_trials(&mut self, trials: u64);

    /// A few cells alone.
    fn shorten(&mut self);

    fn cell_name(&self, cell: usize) -> String;

    /// Tables and pictures.
    fn tables(&self, results: &Results, out: &Path) -> Result<()>;
}

/// Results, tables and pictures.
fn write_stored(study: &impl Stored, results: &Results, out: &Path) -> Result<()> {
    ensure!(
        results.header().plan() == study.plan(),
        "the results are of another plan than {}, or of another version of it",
        study.name()
    );
    fs::create_dir_all(out)?;
    fs::write(out.join("results.json"), results.to_json())?;
    study.tables(results, out)?;
    println!("{}: {}", study.name(), out.display());
    Ok(())
}

/// Holds results against those that are stored in `folder`: an error names the first cell that differs.
fn check_stored(study: &impl Stored, results: &Results, folder: &Path) -> Result<()> {
    let name = study.name();
    let now = results.to_json();
    let stored = fs::read_to_string(folder.join("results.json")).context("there is no stored table")?;
    if now == stored {
        return Ok(());
    }
    let cells = |text: &str| -> Result<Vec<Value>> {
        let value: Value = serde_json::from_str(text).context("the stored results cannot be read")?;
        Ok(value["cells"].as_array().cloned().unwrap_or_default())
    };
    let (now, stored) = (cells(&now)?, cells(&stored)?);
    match now.iter().zip(&stored).position(|(a, b)| a != b) {
        Some(cell) => bail!("{name}: the first cell that differs from the stored results is {}", study.cell_name(cell)),
        None => bail!("{name}: the stored results are of another plan"),
    }
}

/// The parts of shards, in one.
fn merge_stored(mut study: impl Stored, results: &Results, out: &Path) -> Result<()> {
    study.set_trials(results.header().trials());
    write_stored(&study, results, out)
}

/// Runs it, and writes or checks what came of it.
fn stored(mut study: impl Stored, folder: &Path, run: &Run) -> Result<()> {
    if let Some(trials) = run.trials {
        study.set_trials(trials);
    }
    if run.quick {
        study.shorten();
    }
    if let Some(seed) = run.seed {
        study.set_seed(seed);
    }
    let (study, name) = (&study, study.name());
    let out = place(run, folder)?;
    let options = options(run, &out)?;
    let (finished, seconds) = observed(study, name, &options)?;
    if let Some(shard) = run.shard {
        println!("{name}: part {shard} in {seconds:.0} s");
        return Ok(());
    }
    let results = finished.into_results()?;
    if run.check {
        check_stored(study, &results, folder)?;
        println!("{name}: the stored results hold, to the byte; {seconds:.0} s");
        return Ok(());
    }
    write_stored(study, &results, &out)?;
    provenance(name, study.seed(), study.trials(), &out, seconds, options.threads.get())?;
    if let Some(part) = options.checkpoint {
        fs::remove_file(part)?;
    }
    Ok(())
}

/// One of them.
pub(super) enum Own {
    Loops(loops::Plan),
    Coverage(coverage::Plan),
    Reconstruction(Reconstruction),
    Tracking(Tracking),
}

impl Own {
    /// The experiment of this name, by the text of its plan; `None` where it is none of these.
    pub(super) fn read(name: &str, text: &str) -> Option<Result<Self>> {
        Some(match name {
            coverage::NAME => coverage::Plan::read(text).map(Self::Coverage),
            reconstruction::NAME => reconstruction::Plan::read(text).map(Reconstruction::new).map(Self::Reconstruction),
            tracking::NAME => tracking::Plan::read(text).map(Tracking::new).map(Self::Tracking),
            _ => loops::Plan::read(text)?.map(Self::Loops),
        })
    }

    pub(super) fn title(&self) -> &str {
        match self {
            Self::Loops(study) => study.title(),
            Self::Coverage(study) => study.title(),
            Self::Reconstruction(study) => study.title(),
            Self::Tracking(study) => study.title(),
        }
    }

    pub(super) fn run(self, folder: &Path, run: &Run) -> Result<()> {
        match self {
            Self::Loops(study) => stored(study, folder, run),
            Self::Coverage(study) => stored(study, folder, run),
            Self::Reconstruction(study) => stored(study, folder, run),
            Self::Tracking(study) => stored(study, folder, run),
        }
    }

    pub(super) fn merge(self, results: &Results, out: &Path) -> Result<()> {
        match self {
            Self::Loops(study) => merge_stored(study, results, out),
            Self::Coverage(study) => merge_stored(study, results, out),
            Self::Reconstruction(study) => merge_stored(study, results, out),
            Self::Tracking(study) => merge_stored(study, results, out),
        }
    }
}
