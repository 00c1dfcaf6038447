//! Experiments of the closed loop: random rigs with effects that are not declared, diagnosed blind.
//!
//! The rigs integrate physics in continuous time and share no code with the effects that explain them.

use std::fmt::Write as _;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use twinlag::diagnosis::{Identifier, Verdict};
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag::signal::undeclared::{GasKind, Kind, Undeclared, undeclared};
use twinlag::{DiagnoseOptions, diagnose};
use twinlag_study::{Failure, Options, Outcome, Quantity, Results, Study, Tally};

/// A plan: which effects, how large, in which gas, how many records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) seed: u64,
    /// Records in each cell.
    pub(super) records: u64,
    /// Effects that a record has together; an empty list is a record with nothing missing.
    sets: Vec<Vec<Kind>>,
    /// What sizes are multiplied with.
    size_factors: Vec<f64>,
    gases: Vec<GasKind>,
    /// Effects that the library is to be without.
    #[serde(default)]
    without: Vec<Identifier>,
}

impl Plan {
    /// The plan, if the text is one of this kind.
    pub(super) fn read(text: &str) -> Option<Result<Self>> {
        let is_one = text.lines().any(|l| l.starts_with("sets"));
        is_one.then(|| toml::from_str(text).context("the plan of the closed loop"))
    }

    /// One record of the first two sets.
    pub(super) fn shorten(&mut self) {
        self.records = 1;
        self.sets.truncate(2);
    }

    fn cells(&self) -> Vec<(&[Kind], f64)> {
        self.sets.iter().flat_map(|set| self.size_factors.iter().map(move |size| (set.as_slice(), *size))).collect()
    }
}

const RIGHT: usize = 0;
const STATED: usize = 1;
const EXPLAINED: usize = 2;
const ALL_FOUND: usize = 3;
const COVERED: usize = 4;
const ERROR: usize = 6;
const RATIO: usize = 8;
const HELD_OUT: usize = 10;
const FIRST: usize = 11;

impl Study for Plan {
    type Scratch = ();

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(self).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        Plan::cells(self).len()
    }

    fn trials(&self) -> u64 {
        self.records
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        let mut out: Vec<Quantity> =
            ["right first", "right or stated", "explained", "all found"].into_iter().map(Quantity::event).collect();
        out.extend(["covered 1", "covered 2"].into_iter().map(Quantity::event));
        let values = ["relative error 1", "relative error 2", "error over its standard error 1"];
        out.extend(values.into_iter().map(Quantity::value));
        out.extend(["error over its standard error 2", "held-out rms after"].into_iter().map(Quantity::value));
        out.extend(Identifier::ALL.iter().map(|e| Quantity::event(format!("first: {e}"))));
        out.push(Quantity::event("first: none"));
        out
    }

    fn scratch(&self, _cell: usize) -> std::result::Result<(), Failure> {
        Ok(())
    }

    fn trial(&self, cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> std::result::Result<(), Failure> {
        let cells = Plan::cells(self);
        let (kinds, size) = cells[cell];
        let gas = self.gases[index as usize % self.gases.len()];
        let rig = undeclared(kinds, size, Some(gas), self.seed + 100_000 * cell as u64 + index)?;
        let simulated = rig.simulate()?;
        let truth_s = truth_s(&rig, &simulated.time_s, &simulated.gas_c);
        let record = Record::from_channels(
            Channels {
                source: "a rig".into(),
                names: simulated.channels,
                time_s: simulated.time_s,
                t1_c: simulated.t1_c,
                t2_c: simulated.t2_c,
                reference_c: Some(simulated.gas_c),
            },
            SamplingChoice::Auto,
        )?;
        let options = DiagnoseOptions { without: self.without.clone(), ..DiagnoseOptions::default() };
        let answer = diagnose(&record, &options, &|_, _, _| ())?;

        let wanted = rig.effects();
        let is_alien = kinds.iter().any(|k| k.effect().is_none());
        let named = |e: &twinlag::NamedEffect, name: &str| e.effect.name() == name;
        let stated =
            |e: &twinlag::NamedEffect, name: &str| named(e, name) || e.alternatives.iter().any(|a| a.name() == name);
        let first = answer.effects.first();
        if !is_alien {
            let (right, or_stated) = match first {
                None => (wanted.is_empty(), wanted.is_empty()),
                Some(e) => (wanted.iter().any(|w| named(e, w)), wanted.iter().any(|w| stated(e, w))),
            };
            outcome.event(RIGHT, right);
            outcome.event(STATED, or_stated);
            let all = wanted.iter().all(|w| answer.effects.iter().any(|e| stated(e, w)));
            outcome.event(ALL_FOUND, all && answer.effects.len() >= wanted.len());
        }
        outcome.event(EXPLAINED, matches!(answer.verdict, Verdict::Explained | Verdict::Adequate));
        for i in 0..2 {
            let sensor = &answer.last.sensors[i];
            if let (Some(tau_s), Some([low, high])) = (sensor.time_constant_s, sensor.interval_95_s) {
                outcome.event(COVERED + i, low <= truth_s[i] && truth_s[i] <= high);
                outcome.value(ERROR + i, (tau_s / truth_s[i] - 1.0).abs());
                if let Some(se) = sensor.standard_error_s {
                    outcome.value(RATIO + i, (tau_s - truth_s[i]).abs() / se);
                }
            }
        }
        outcome.value(HELD_OUT, answer.error.held_out_normalised_rms.after);
        for (i, effect) in Identifier::ALL.iter().enumerate() {
            outcome.event(FIRST + i, first.is_some_and(|e| e.effect == *effect));
        }
        outcome.event(FIRST + Identifier::ALL.len(), first.is_none());
        Ok(())
    }
}

/// Both time constants as an answer means them: means over the record where the flow changes, those at the record's mean
/// temperature where they change with it, the larger one of two.
fn truth_s(rig: &Undeclared, time_s: &[f64], gas_c: &[f64]) -> [f64; 2] {
    let mean = |values: &mut dyn Iterator<Item = f64>| -> f64 {
        let (sum, n) = values.fold((0.0, 0.0_f64), |(sum, n), v| (sum + v, n + 1.0));
        sum / n.max(1.0)
    };
    let flow = rig.rig.flow().map_or(1.0, |flow| mean(&mut time_s.iter().map(|t| flow.factor(*t))));
    let mean_k = mean(&mut gas_c.iter().copied()) + 273.15;
    [0, 1].map(|i| {
        let sensor = &rig.rig.sensors()[i];
        let warm = sensor
            .temperature_dependence
            .as_ref()
            .map_or(1.0, |d| (mean_k / (d.reference_c + 273.15)).powf(d.exponent));
        sensor.time_constant_s * flow * warm
    })
}

/// Runs the plan, writes results and tables to `out`; or holds it against what is there.
pub(super) fn run(plan: &Plan, out: &Path, check: bool, options: &Options) -> Result<f64> {
    let start = Instant::now();
    let bar = super::bar(&plan.name);
    let finished = twinlag_study::run(plan, options, |p| {
        bar.set_length(p.total);
        bar.set_position(p.done);
        ControlFlow::Continue(())
    })?;
    bar.finish_and_clear();
    let seconds = start.elapsed().as_secs_f64();
    let results = finished.into_results()?;
    let path = out.join("results.json");
    if check {
        let stored = fs::read_to_string(&path).context("there is no stored table")?;
        if stored != results.to_json() {
            bail!("{}: the stored results are others", plan.name);
        }
        println!("{}: the stored results hold, to the byte; {seconds:.0} s", plan.name);
        return Ok(seconds);
    }
    fs::create_dir_all(out)?;
    fs::write(path, results.to_json())?;
    fs::write(out.join("found.md"), found(plan, &results))?;
    fs::write(out.join("confusion.md"), confusion(plan, &results))?;
    println!(
        "{}: {} records in {seconds:.0} s, {}",
        plan.name,
        plan.records * Plan::cells(plan).len() as u64,
        out.display()
    );
    Ok(seconds)
}

fn cell_name(kinds: &[Kind], size: f64, sizes: usize) -> String {
    let names: Vec<&str> = kinds.iter().map(|k| k.name()).collect();
    let names = if names.is_empty() { "none".to_owned() } else { names.join(" + ") };
    if sizes > 1 { format!("{names}, × {size}") } else { names }
}

fn percent(tally: &Tally, name: &str) -> String {
    tally.rate(name).and_then(twinlag_study::Rate::rate).map_or("-".into(), |r| format!("{:.0}", 100.0 * r))
}

fn median(tally: &Tally, name: &str, scale: f64) -> String {
    tally.values(name).and_then(|v| v.quantile(0.5)).map_or("-".into(), |q| format!("{:.2}", scale * q))
}

fn found(plan: &Plan, results: &Results) -> String {
    let mut text = String::from(
        "| effects | right first (%) | right or stated (%) | all found (%) | explained (%) | covered (%) | median error (%) | \
         median error / standard error | held-out rms |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for ((kinds, size), tally) in Plan::cells(plan).into_iter().zip(results.cells()) {
        let both = |name: &str, of: fn(&Tally, &str) -> String| {
            format!("{} / {}", of(tally, &format!("{name} 1")), of(tally, &format!("{name} 2")))
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            cell_name(kinds, size, plan.size_factors.len()),
            percent(tally, "right first"),
            percent(tally, "right or stated"),
            percent(tally, "all found"),
            percent(tally, "explained"),
            both("covered", percent),
            both("relative error", |t, n| median(t, n, 100.0)),
            both("error over its standard error", |t, n| median(t, n, 1.0)),
            median(tally, "held-out rms after", 1.0),
        );
    }
    text
}

/// Which effect is named first, in per cent; those that never are are left out.
fn confusion(plan: &Plan, results: &Results) -> String {
    let names: Vec<String> = Identifier::ALL.iter().map(|e| e.name().to_owned()).chain(["none".into()]).collect();
    let used: Vec<&String> = names
        .iter()
        .filter(|n| {
            let rate = |t: &Tally| t.rate(&format!("first: {n}")).is_some_and(|r| r.hits() > 0);
            results.cells().iter().any(rate)
        })
        .collect();
    let mut text = format!(
        "| effects | {} |\n|---|{}\n",
        used.iter().map(|n| n.as_str()).collect::<Vec<_>>().join(" | "),
        "---|".repeat(used.len())
    );
    for ((kinds, size), tally) in Plan::cells(plan).into_iter().zip(results.cells()) {
        let row: Vec<String> = used
            .iter()
            .map(|n| match tally.rate(&format!("first: {n}")).and_then(twinlag_study::Rate::rate) {
                Some(rate) if rate > 0.0 => format!("{:.0}", 100.0 * rate),
                _ => String::new(),
            })
            .collect();
        let _ = writeln!(text, "| {} | {} |", cell_name(kinds, size, plan.size_factors.len()), row.join(" | "));
    }
    text
}
