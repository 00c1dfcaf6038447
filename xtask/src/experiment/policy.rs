//! Experiment `policy`: what a diagnosis says otherwise if one of the numbers that decide is half
//! or twice as large.
//!
//! Nothing here is a truth to be right about: a number that moves much has to be derived or
//! measured with care, one that moves nothing may be what it is.

use std::fmt::Write as _;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use twinlag::diagnosis::{Diagnosis, Identifier, Observations, Policy, Settings, Stretch, diagnose};
use twinlag::signal::undeclared::{GasKind, Kind, undeclared};
use twinlag_study::{Failure, Merge, Outcome, Quantity, Results, Study, Tally};

use super::stored::{Head, Stored};

pub(super) const NAME: &str = "policy";

/// What may move, in the order of the quantities of one number and factor.
const MOVES: [&str; 4] = ["verdict", "first effect", "effects", "time constants"];
/// Part of a standard error beyond which a time constant has moved.
const NOTICEABLE: f64 = 0.1;

/// A plan: which records, and which numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    name: String,
    title: String,
    seed: u64,
    /// Records of each set.
    records: u64,
    /// Samples of each record, from its start.
    samples: usize,
    /// What each number is multiplied with; shares and probabilities become 1 at most.
    factors: Vec<f64>,
    gases: Vec<GasKind>,
    /// Effects that a record has; an empty list is a record with nothing missing.
    sets: Vec<Vec<Kind>>,
    /// Numbers of the policy; all of them where none is named.
    #[serde(default)]
    numbers: Vec<String>,
}

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        toml::from_str(text).context("the plan of the policy")
    }

    /// Names of the numbers, each with its value.
    fn numbers(&self) -> Vec<(&'static str, f64)> {
        let mut all = Policy::default().numbers();
        all.retain(|(name, _)| self.numbers.is_empty() || self.numbers.iter().any(|n| n == name));
        all
    }

    /// The record as the loop takes it.
    fn observations(&self, cell: usize, index: u64) -> Result<Observations, Failure> {
        let gas = self.gases[(cell + index as usize) % self.gases.len()];
        let rig = undeclared(&self.sets[cell], 1.0, Some(gas), self.seed + 1000 * cell as u64 + index)?;
        let mut simulated = rig.simulate()?;
        for channel in [&mut simulated.time_s, &mut simulated.t1_c, &mut simulated.t2_c] {
            channel.truncate(self.samples);
        }
        let period_s = simulated.time_s[1] - simulated.time_s[0];
        let stretch = Stretch::new(simulated.time_s, [simulated.t1_c, simulated.t2_c]);
        Ok(Observations::new(vec![stretch], Some(period_s))?)
    }
}

/// The policy with one number multiplied, as far as that has a meaning.
fn scaled(name: &str, value: f64, factor: f64) -> Option<Policy> {
    let is_share = name.ends_with("_share") || name.ends_with("_probability");
    let value = if is_share { (factor * value).min(1.0) } else { factor * value };
    Policy::default().with(name, value)
}

/// Which of [`MOVES`] there are from `before` to `after`.
fn moves(before: &Diagnosis, after: &Diagnosis) -> [bool; 4] {
    let effects = |d: &Diagnosis| -> Vec<Identifier> { d.effects.iter().map(|f| f.effect).collect() };
    let (named, named_after) = (effects(before), effects(after));
    let pairs = before.last.time_constants.iter().zip(&after.last.time_constants);
    let mut has_moved = pairs.map(|(a, b)| match (a.value_s, b.value_s) {
        (Some(x), Some(y)) => (x - y).abs() > NOTICEABLE * a.standard_error_s.unwrap_or(0.0),
        (x, y) => x.is_some() != y.is_some(),
    });
    [
        before.verdict != after.verdict,
        named.first() != named_after.first(),
        named != named_after,
        has_moved.any(|one| one),
    ]
}

fn quantity(number: &str, factor: f64, what: &str) -> String {
    format!("{number} × {factor}: {what}")
}

impl Study for Plan {
    type Scratch = ();

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(self).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        self.sets.len()
    }

    fn trials(&self) -> u64 {
        self.records
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        let numbers = self.numbers();
        let pairs = numbers.iter().flat_map(|(name, _)| self.factors.iter().map(move |factor| (*name, *factor)));
        pairs.flat_map(|(name, factor)| MOVES.map(|what| Quantity::event(quantity(name, factor, what)))).collect()
    }

    fn scratch(&self, _cell: usize) -> std::result::Result<(), Failure> {
        Ok(())
    }

    fn trial(&self, cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> std::result::Result<(), Failure> {
        let observations = self.observations(cell, index)?;
        let with = |policy: Policy| {
            let settings = Settings { policy, ..Settings::default() };
            diagnose(&observations, &settings, &|_, _, _| ControlFlow::Continue(()))
        };
        let before = with(Policy::default())?;
        let mut place = 0;
        for (name, value) in self.numbers() {
            for factor in &self.factors {
                let Some(policy) = scaled(name, value, *factor) else { continue };
                let after = with(policy)?;
                for moved in moves(&before, &after) {
                    outcome.event(place, moved);
                    place += 1;
                }
            }
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

    /// Two numbers and one record.
    fn shorten(&mut self) {
        self.records = 1;
        self.samples = self.samples.min(1500);
        self.sets.truncate(1);
        self.numbers = self.numbers().into_iter().take(2).map(|(name, _)| name.to_owned()).collect();
    }

    fn cell_name(&self, cell: usize) -> String {
        let names: Vec<&str> = self.sets[cell].iter().map(|k| k.name()).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(" + ") }
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        let mut cells = results.cells().iter();
        let mut all = cells.next().context("a plan has a set at least")?.clone();
        cells.for_each(|tally| all.merge(tally.clone()));
        Ok(fs::write(out.join("policy.md"), self.table(&all))?)
    }
}

impl Plan {
    /// In how many of all records each number moves what.
    fn table(&self, all: &Tally) -> String {
        let heads: Vec<String> = self.factors.iter().map(|f| format!("× {f}")).collect();
        let mut text = format!(
            "Records in which the verdict / the first effect / any effect / a time constant is another, of {}:\n\n\
             | number | value | {} |\n|---|---|{}\n",
            all.trials(),
            heads.join(" | "),
            "---|".repeat(heads.len())
        );
        let hits = |name: &str, factor: f64, what: &str| {
            all.rate(&quantity(name, factor, what)).map_or("-".into(), |rate| rate.hits().to_string())
        };
        for (name, value) in self.numbers() {
            let of = |factor: &f64| MOVES.map(|what| hits(name, *factor, what)).join(" / ");
            let row: Vec<String> = self.factors.iter().map(of).collect();
            let _ = writeln!(text, "| `{name}` | {value} | {} |", row.join(" | "));
        }
        text
    }
}
