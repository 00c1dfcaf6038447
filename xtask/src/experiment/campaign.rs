//! Several records of one rig against one of them: what is found with one, two or more, whether records are accused falsely, and what
//! becomes of the time constants. And what is named where the library is without the cause.
//!
//! The rigs are those of the closed loop's experiments, which integrate physics in continuous time and share no code with the
//! effects that explain them. Each record has a gas and noise of its own; a campaign of more records begins with those of
//! the smaller ones.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use twinlag::diagnosis::{Identifier, Verdict};
use twinlag::record::Record;
use twinlag::signal::undeclared::{GasKind, Kind, Undeclared, undeclared};
use twinlag::signal::{Record as Sampling, SignalError, Simulated};
use twinlag::{DiagnoseOptions, Diagnosis, Options, diagnose, diagnose_records};
use twinlag_study::{Failure, Outcome, Quantity, Results, Study, Tally};

use super::loops::{Naming, hits_of_count, own_effects, set_name, truth_s};
use super::record_of;
use super::stored::{Head, Stored};

/// The experiment with the whole library, and that without the effects that the records have.
pub(super) const NAMES: [&str; 2] = ["campaign", "transfer"];

/// A plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    name: String,
    title: String,
    seed: u64,
    /// Campaigns in each cell.
    campaigns: u64,
    /// Records that a campaign has, from cell to cell.
    records: Vec<usize>,
    /// Samples of each record.
    samples: usize,
    /// Effects that a rig has together; an empty list is a rig with nothing missing.
    sets: Vec<Vec<Kind>>,
    gases: Vec<GasKind>,
    /// Whether the library is to be without the effects that a rig has.
    #[serde(default)]
    without_own: bool,
}

/// Quantities of a campaign, in order; those of sensors are two.
const EVENTS: [&str; 6] = ["right or stated", "wrong name", "explained", "accused", "covered 1", "covered 2"];
const VALUES: [&str; 6] = [
    "relative error 1",
    "relative error 2",
    "error over its standard error 1",
    "error over its standard error 2",
    "left-out rms before",
    "left-out rms after",
];

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        let plan: Self = toml::from_str(text).context("the plan of the campaigns")?;
        ensure!(!plan.gases.is_empty(), "the plan of the campaigns: expected one gas or more");
        Ok(plan)
    }

    /// The effects and the number of records of a cell.
    fn place(&self, cell: usize) -> (usize, usize) {
        (cell / self.records.len(), self.records[cell % self.records.len()])
    }

    /// The rig of campaign `index`, the same with any number of records.
    fn rig(&self, set: usize, index: u64) -> Result<Undeclared, SignalError> {
        let gas = self.gases[index as usize % self.gases.len()];
        let mut drawn = undeclared(&self.sets[set], 1.0, Some(gas), self.seed + 100_000 * set as u64 + index)?;
        let sampling = Sampling::new(self.samples, drawn.rig.record().sample_period_s);
        let mut gas = drawn.rig.gas().clone();
        gas.per_trial = true;
        let mut sensors = drawn.rig.sensors().clone();
        // An instrument has one temperature at which nothing is picked up, and not the mean of each record.
        sensors.iter_mut().for_each(|sensor| sensor.crosstalk_about_c = Some(gas.mean_c));
        drawn.rig = drawn.rig.with_record(sampling)?.with_gas(gas)?.with_sensors(sensors)?;
        Ok(drawn)
    }
}

/// The answer to one record or several.
fn answer(records: &[Record], without: Vec<Identifier>) -> Result<Diagnosis, twinlag::Error> {
    // What is found counts here, and not what of it is given.
    let characterise = Options { best_effort: true, ..Options::default() };
    let options = DiagnoseOptions { characterise, without, ..DiagnoseOptions::default() };
    match records {
        [record] => diagnose(record, &options),
        records => diagnose_records(records, &options),
    }
}

impl Study for Plan {
    type Scratch = ();

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(self).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        self.sets.len() * self.records.len()
    }

    fn trials(&self) -> u64 {
        self.campaigns
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        EVENTS.map(Quantity::event).into_iter().chain(VALUES.map(Quantity::value)).collect()
    }

    fn scratch(&self, _cell: usize) -> std::result::Result<(), Failure> {
        Ok(())
    }

    fn trial(&self, cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> std::result::Result<(), Failure> {
        let (set, count) = self.place(cell);
        let rig = self.rig(set, index)?;
        let simulated: Vec<Simulated> =
            (0..count as u64).map(|k| rig.rig.simulate_trial(k)).collect::<Result<_, SignalError>>()?;
        let joined = |of: fn(&Simulated) -> &[f64]| simulated.iter().flat_map(of).copied().collect::<Vec<f64>>();
        let truth_s = truth_s(&rig, &joined(|s| &s.time_s), &joined(|s| &s.gas_c));
        let named = |(k, one): (usize, Simulated)| {
            let mut record = record_of(one)?;
            record.reference_c = None;
            record.source = format!("record {}", k + 1);
            Ok(record)
        };
        let records: Vec<Record> =
            simulated.into_iter().enumerate().map(named).collect::<Result<_, twinlag::record::RecordError>>()?;
        let wanted = rig.effects();
        let answer = answer(&records, if self.without_own { own_effects(&wanted) } else { Vec::new() })?;

        let named = Naming::of(&answer, &wanted);
        if !self.without_own {
            outcome.event(0, named.is_right_or_stated);
        }
        outcome.event(1, named.is_wrong);
        outcome.event(2, matches!(answer.verdict, Verdict::Adequate | Verdict::Explained));
        outcome.event(3, answer.records.iter().any(|record| record.agrees == Some(false)));
        for i in 0..2 {
            let sensor = &answer.last.sensors[i];
            if let (Some(tau_s), Some([low, high])) = (sensor.time_constant_s, sensor.interval_95_s) {
                outcome.event(4 + i, low <= truth_s[i] && truth_s[i] <= high);
                outcome.value(EVENTS.len() + i, (tau_s / truth_s[i] - 1.0).abs());
                if let Some(se) = sensor.standard_error_s {
                    outcome.value(EVENTS.len() + 2 + i, (tau_s - truth_s[i]).abs() / se);
                }
            }
        }
        if let Some(transfer) = &answer.transfer {
            let rms = transfer.error.held_out_normalised_rms;
            outcome.value(EVENTS.len() + 4, rms.before);
            outcome.value(EVENTS.len() + 5, rms.after);
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
        [&mut self.campaigns, &mut self.seed]
    }

    /// One campaign of one effect, with one record and with two.
    fn shorten(&mut self) {
        self.campaigns = 1;
        self.sets.truncate(1);
        self.records.truncate(2);
    }

    fn cell_name(&self, cell: usize) -> String {
        let (set, count) = self.place(cell);
        format!("{}, of {count}", set_name(&self.sets[set]))
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        // Without the effects of the rigs none is right.
        let right: &[&str] = if self.without_own { &[] } else { &["right or stated"] };
        let heads = ["effect", "records"].iter().chain(right).chain(&[
            "wrong name",
            "explained",
            "a record accused",
            "covered, of those given",
            "median error (%)",
            "median error / standard error",
            "left-out rms before / after",
        ]);
        let heads: Vec<&str> = heads.copied().collect();
        let mut text = format!("| {} |\n|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
        let median = |tally: &Tally, name: &str, scale: f64| {
            tally.values(name).and_then(|v| v.quantile(0.5)).map_or("–".into(), |q| format!("{:.2}", scale * q))
        };
        for (cell, tally) in results.cells().iter().enumerate() {
            let both = |of: &dyn Fn(&str) -> String, name: &str| {
                [1, 2].map(|sensor| of(&format!("{name} {sensor}"))).join(" / ")
            };
            let (set, records) = self.place(cell);
            let mut row = vec![set_name(&self.sets[set]), records.to_string()];
            row.extend(right.iter().map(|name| hits_of_count(tally, name)));
            row.extend([
                hits_of_count(tally, "wrong name"),
                hits_of_count(tally, "explained"),
                if records > 1 { hits_of_count(tally, "accused") } else { "–".into() },
                both(&|name| hits_of_count(tally, name), "covered"),
                both(&|name| median(tally, name, 100.0), "relative error"),
                both(&|name| median(tally, name, 1.0), "error over its standard error"),
                ["before", "after"].map(|when| median(tally, &format!("left-out rms {when}"), 1.0)).join(" / "),
            ]);
            let _ = writeln!(text, "| {} |", row.join(" | "));
        }
        Ok(fs::write(out.join(format!("{}.md", self.name)), text)?)
    }
}
