//! Experiments that are studies of their own, with tables of their own beside the stored results.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use twinlag_study::{Results, Study};

use super::reconstruction::Reconstruction;
use super::tracking::Tracking;
use super::{
    Run, campaign, coverage, grades, loops, observed, options, place, planning, policy, provenance, reconstruction,
    ties, tracking,
};

/// What a plan begins with.
pub(super) struct Head<'a> {
    pub(super) name: &'a str,
    pub(super) title: &'a str,
    pub(super) seed: u64,
}

/// An experiment that is a study of its own, with tables of its own.
pub(super) trait Stored: Study {
    fn head(&self) -> Head<'_>;

    /// Both numbers of the plan that may be given beside it.
    fn trials_and_seed(&mut self) -> [&mut u64; 2];

    /// A few cells alone.
    fn shorten(&mut self);

    fn cell_name(&self, cell: usize) -> String;

    /// Tables and pictures.
    fn tables(&self, results: &Results, out: &Path) -> Result<()>;
}

/// What is done with one of them, whichever it is.
pub(super) trait Own {
    fn title(&self) -> &str;

    /// Runs it, and writes or checks what came of it.
    fn run(self: Box<Self>, folder: &Path, run: &Run) -> Result<()>;

    /// The parts of shards, in one.
    fn merge(self: Box<Self>, results: &Results, out: &Path) -> Result<()>;
}

/// The experiment of this name, by the text of its plan; `None` where it is none of these.
pub(super) fn read(name: &str, text: &str) -> Option<Result<Box<dyn Own>>> {
    fn own(study: impl Own + 'static) -> Box<dyn Own> {
        Box::new(study)
    }
    Some(match name {
        name if campaign::NAMES.contains(&name) => campaign::Plan::read(text).map(own),
        coverage::NAME => coverage::Plan::read(text).map(own),
        name if grades::NAMES.contains(&name) => grades::Plan::read(text).map(own),
        planning::NAME => planning::Plan::read(text).map(own),
        policy::NAME => policy::Plan::read(text).map(own),
        reconstruction::NAME => reconstruction::Plan::read(text).map(Reconstruction::new).map(own),
        ties::NAME => ties::Plan::read(text).map(own),
        tracking::NAME => tracking::Plan::read(text).map(Tracking::new).map(own),
        _ => loops::Plan::read(text)?.map(own),
    })
}

/// Results, tables and pictures.
fn write_stored(study: &impl Stored, results: &Results, out: &Path) -> Result<()> {
    let Head { name, .. } = study.head();
    ensure!(
        results.header().plan() == study.plan(),
        "the results are of another plan than {name}, or of another version of it"
    );
    fs::create_dir_all(out)?;
    fs::write(out.join("results.json"), results.to_json())?;
    study.tables(results, out)?;
    println!("{name}: {}", out.display());
    Ok(())
}

/// Holds results against those that are stored in `folder`: an error names the first cell that differs.
fn check_stored(study: &impl Stored, results: &Results, folder: &Path) -> Result<()> {
    let Head { name, .. } = study.head();
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

impl<S: Stored> Own for S {
    fn title(&self) -> &str {
        self.head().title
    }

    fn run(mut self: Box<Self>, folder: &Path, run: &Run) -> Result<()> {
        let [trials, seed] = self.trials_and_seed();
        *trials = run.trials.unwrap_or(*trials);
        *seed = run.seed.unwrap_or(*seed);
        if run.quick {
            self.shorten();
        }
        let Head { name, seed, .. } = self.head();
        let out = place(run, folder)?;
        let options = options(run, &out)?;
        let (finished, seconds) = observed(&*self, name, &options)?;
        if let Some(shard) = run.shard {
            println!("{name}: part {shard} in {seconds:.0} s");
            return Ok(());
        }
        let results = finished.into_results()?;
        if run.check {
            check_stored(&*self, &results, folder)?;
            println!("{name}: the stored results hold, to the byte; {seconds:.0} s");
            return Ok(());
        }
        write_stored(&*self, &results, &out)?;
        provenance(name, seed, self.trials(), &out, seconds, options.threads.get())?;
        if let Some(part) = options.checkpoint {
            fs::remove_file(part)?;
        }
        Ok(())
    }

    fn merge(mut self: Box<Self>, results: &Results, out: &Path) -> Result<()> {
        let [trials, _] = self.trials_and_seed();
        *trials = results.header().trials();
        write_stored(&*self, results, out)
    }
}
