//! Effects that look alike: whether the answer ties them where the record does not distinguish them, and names one alone where it does.
//!
//! The rigs are those of the closed loop's experiments; the louder the noise, the less a record distinguishes.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use twinlag::diagnosis::Identifier;
use twinlag::signal::undeclared::{GasKind, Kind, undeclared};
use twinlag::{DiagnoseOptions, NamedEffect, diagnose};
use twinlag_study::{Failure, Outcome, Quantity, Results, Study};

use super::loops::{hits_of_count, record_of};
use super::stored::{Head, Stored};

pub(super) const NAME: &str = "ties";

/// A plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    name: String,
    title: String,
    seed: u64,
    /// Records in each cell.
    records: u64,
    /// Times as loud as usual that the noise is.
    noise_factors: Vec<f64>,
    gases: Vec<GasKind>,
    /// Effects, one in each record.
    kinds: Vec<Kind>,
}

/// What an answer may be: of these each record has one.
const ANSWERS: [&str; 5] = [RIGHT_ALONE, RIGHT_TIED, TIED_TO_RIGHT, ANOTHER, NOTHING];
const RIGHT_ALONE: &str = "right alone";
const RIGHT_TIED: &str = "right, tied to others";
const TIED_TO_RIGHT: &str = "another, tied to the right";
const ANOTHER: &str = "another";
const NOTHING: &str = "nothing";
/// A gain with the crosstalk that is the same for any record, or the other way round.
const TWIN: &str = "exact twin stated";

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        toml::from_str(text).context("the plan of the ties")
    }

    fn place(&self, cell: usize) -> (Kind, f64) {
        let factors = self.noise_factors.len();
        (self.kinds[cell / factors], self.noise_factors[cell % factors])
    }
}

/// Which of the answers it is that names `first` first.
fn answer(first: Option<&NamedEffect>, wanted: &[&str]) -> &'static str {
    let Some(first) = first else { return NOTHING };
    let is_right = |effect: &Identifier| wanted.contains(&effect.name());
    match (is_right(&first.effect), first.alternatives.is_empty()) {
        (true, true) => RIGHT_ALONE,
        (true, false) => RIGHT_TIED,
        (false, _) if first.alternatives.iter().any(is_right) => TIED_TO_RIGHT,
        (false, _) => ANOTHER,
    }
}

impl Study for Plan {
    type Scratch = ();

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(self).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        self.kinds.len() * self.noise_factors.len()
    }

    fn trials(&self) -> u64 {
        self.records
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        ANSWERS.into_iter().chain([TWIN]).map(Quantity::event).collect()
    }

    fn scratch(&self, _cell: usize) -> std::result::Result<(), Failure> {
        Ok(())
    }

    fn trial(&self, cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> std::result::Result<(), Failure> {
        let (kind, noise_factor) = self.place(cell);
        let gas = self.gases[index as usize % self.gases.len()];
        // The same record in each noise.
        let seed = self.seed + 100_000 * (cell / self.noise_factors.len()) as u64 + index;
        let mut drawn = undeclared(&[kind], 1.0, Some(gas), seed)?;
        let mut sensors = drawn.rig.sensors().clone();
        sensors.iter_mut().filter_map(|s| s.noise.as_mut()).for_each(|noise| noise.std_k *= noise_factor);
        drawn.rig = drawn.rig.with_sensors(sensors)?;
        let mut record = record_of(drawn.simulate()?)?;
        record.reference_c = None;
        let found = diagnose(&record, &DiagnoseOptions::default())?;
        let first = found.effects.first();
        let given = answer(first, &drawn.effects());
        ANSWERS.iter().enumerate().for_each(|(k, answer)| outcome.event(k, *answer == given));
        if matches!(kind, Kind::Gain | Kind::Crosstalk) {
            outcome.event(ANSWERS.len(), first.is_some_and(|first| !first.exact_twins.is_empty()));
        }
        Ok(())
    }
}

impl Stored for Plan {
    fn head(&self) -> Head<'_> {
        let Plan { name, title, seed, .. } = self;
        Head { name, title, seed: *seed }
    }

    fn trials_and_seed(&mut self) -> [&mut u64; 2] {
        [&mut self.records, &mut self.seed]
    }

    /// One record of the first effect.
    fn shorten(&mut self) {
        self.records = 1;
        self.kinds.truncate(1);
        self.noise_factors.truncate(1);
    }

    fn cell_name(&self, cell: usize) -> String {
        let (kind, noise_factor) = self.place(cell);
        format!("{}, noise × {noise_factor}", kind.name())
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        let mut text =
            format!("| effect | noise | {} | {TWIN} |\n|---|---|---|---|---|---|---|---|\n", ANSWERS.join(" | "));
        for (cell, tally) in results.cells().iter().enumerate() {
            let (kind, noise_factor) = self.place(cell);
            let row: Vec<String> = ANSWERS.iter().chain(&[TWIN]).map(|name| hits_of_count(tally, name)).collect();
            let _ = writeln!(text, "| {} | × {noise_factor} | {} |", kind.name(), row.join(" | "));
        }
        Ok(fs::write(out.join("ties.md"), text)?)
    }
}
