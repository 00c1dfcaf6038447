//! Whether the 95 % bands of the gas temperature hold the gas: of the whole record, from what was read so far and with a fixed lag, with time
//! constants and noise known and found, with readings missing, in short records and long ones; over all instants, and over those where
//! the gas moves most.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use twinlag::compensation::Form;
use twinlag::cross_relation::Parameter;
use twinlag::signal::{Record as Sampling, Rig, Simulated};
use twinlag::{CompensateOptions, DiagnoseOptions, Known, Model, Options, compensate};
use twinlag_study::{Failure, Outcome, Quantity, Results, Study};

use super::keep_last;
use super::pair::{self, Named};
use super::stored::{Head, Stored};

pub(super) const NAME: &str = "reconstruction-coverage";

/// A plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) seed: u64,
    pub(super) trials: u64,
    samples: Vec<usize>,
    sample_period_s: f64,
    tau_s: [f64; 2],
    /// Noise of each channel, per cent of the gas's standard deviation.
    noise_percent: Vec<f64>,
    /// Samples of the fixed lag.
    lag: usize,
    /// Share of the rows that is missing, in runs of so many.
    missing_share: f64,
    missing_run: usize,
    gases: Vec<Named>,
}

/// What is asked of each record, by name.
const CASES: [&str; 5] = ["smoother, all known", "smoother", "smoother, readings missing", "fixed lag", "filter"];
/// A standard deviation that nothing sees: both time constants cannot be held.
const AS_GOOD_AS_EXACT: f64 = 1e-6;
/// Records that a gas's standard deviation is taken from.
const RECORDS: u64 = 20;
/// Share of the instants at which the gas moves most.
const LIVELY: f64 = 0.1;

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        toml::from_str(text).context("the plan of a reconstruction's coverage")
    }

    /// Gas, noise in per cent and samples of a cell.
    fn place(&self, cell: usize) -> (usize, f64, usize) {
        let (levels, lengths) = (self.noise_percent.len(), self.samples.len());
        (cell / (levels * lengths), self.noise_percent[cell / lengths % levels], self.samples[cell % lengths])
    }

    fn rig(&self, cell: usize, noise_std_k: f64) -> Result<Rig, Failure> {
        let (gas, _, samples) = self.place(cell);
        let sampling = Sampling::new(samples, self.sample_period_s);
        pair::rig(self.seed + cell as u64, sampling, &self.gases[gas], self.tau_s, Some(noise_std_k))
    }
}

impl Study for Plan {
    /// The noise of the cell, K.
    type Scratch = f64;

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(self).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        self.gases.len() * self.noise_percent.len() * self.samples.len()
    }

    fn trials(&self) -> u64 {
        self.trials
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        CASES.iter().flat_map(|case| [format!("inside: {case}"), lively(case)]).map(Quantity::value).collect()
    }

    fn scratch(&self, cell: usize) -> std::result::Result<f64, Failure> {
        Ok(0.01 * self.place(cell).1 * pair::gas_std_k(&self.rig(cell, 1.0)?, RECORDS)?)
    }

    fn trial(
        &self,
        cell: usize,
        index: u64,
        noise_std_k: &mut f64,
        outcome: &mut Outcome,
    ) -> std::result::Result<(), Failure> {
        let simulated = self.rig(cell, *noise_std_k)?.simulate_trial(index)?;
        let truth = simulated.gas_c.clone();
        let mut score = |case: usize, gas_c: &[f64], std_k: &[f64]| {
            if gas_c.len() == truth.len() {
                let [all, lively] = inside(&truth, gas_c, std_k);
                outcome.value(2 * case, all);
                outcome.value(2 * case + 1, lively);
            }
        };
        let holed = self.holed(&simulated, index);
        let known = [Parameter::Tau1, Parameter::Tau2].into_iter().zip(self.tau_s);
        // What is found is judged here, and not what of it is given.
        let found = Options { best_effort: true, ..Options::default() };
        let all_known = Options {
            noise_std_k: Some([*noise_std_k; 2]),
            known: known
                .map(|(parameter, value)| Known { parameter, value, std: Some(AS_GOOD_AS_EXACT * value) })
                .collect(),
            ..found.clone()
        };
        let forms = [Form::Smoother, Form::Smoother, Form::Smoother, Form::FixedLag(self.lag), Form::Filter];
        for (case, form) in forms.into_iter().enumerate() {
            let of = if case == 2 { &holed } else { &simulated };
            let record = super::record_of(of.clone())?;
            let model = Some(Model::of_two_lags(record.channels.clone()));
            let characterise = if case == 0 { all_known.clone() } else { found.clone() };
            let diagnose = DiagnoseOptions { characterise, ..DiagnoseOptions::default() };
            let options = CompensateOptions { diagnose, model, form, trusted: 0 };
            let answer = compensate(&record, &options)?;
            score(case, &answer.gas_c, &answer.gas_std_k);
        }
        Ok(())
    }
}

impl Plan {
    /// The same record with rows missing, in runs that are evenly apart and begin elsewhere in each trial.
    fn holed(&self, simulated: &Simulated, index: u64) -> Simulated {
        let mut out = simulated.clone();
        let apart = (self.missing_run as f64 / self.missing_share).round() as usize;
        let first = 1 + index as usize % (apart - self.missing_run);
        for k in (0..out.t1_c.len()).filter(|k| *k >= first && (k - first) % apart < self.missing_run) {
            (out.t1_c[k], out.t2_c[k]) = (f64::NAN, f64::NAN);
        }
        out
    }
}

fn lively(case: &str) -> String {
    format!("inside where the gas moves most: {case}")
}

/// Share of the instants inside the band: of all, and of those at which the gas moves most.
fn inside(truth: &[f64], gas_c: &[f64], std_k: &[f64]) -> [f64; 2] {
    let n = truth.len();
    let holds = |k: usize| (gas_c[k] - truth[k]).abs() <= 1.96 * std_k[k];
    let moves = |k: usize| (truth[(k + 1).min(n - 1)] - truth[k.saturating_sub(1)]).abs();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| moves(*b).total_cmp(&moves(*a)));
    let share = |of: &[usize]| of.iter().filter(|k| holds(**k)).count() as f64 / of.len() as f64;
    [share(&order), share(&order[..(LIVELY * n as f64) as usize])]
}

impl Stored for Plan {
    fn head(&self) -> Head<'_> {
        let Plan { name, title, seed, .. } = self;
        Head { name, title, seed: *seed }
    }

    fn trials_and_seed(&mut self) -> [&mut u64; 2] {
        [&mut self.trials, &mut self.seed]
    }

    /// One gas, short.
    fn shorten(&mut self) {
        self.trials = 1;
        self.samples.truncate(1);
        self.gases.truncate(1);
        keep_last(&mut self.noise_percent, 1);
    }

    fn cell_name(&self, cell: usize) -> String {
        let (gas, percent, samples) = self.place(cell);
        format!("{}, {percent} %, {samples} samples", self.gases[gas].name)
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        let name_of = |case: &str| format!("inside: {case}");
        for (file, quantity) in [("inside.md", &name_of as &dyn Fn(&str) -> String), ("lively.md", &lively)] {
            let mut text = format!(
                "| gas | noise (%) | samples | {} |\n|---|---|---|{}\n",
                CASES.join(" | "),
                "---|".repeat(CASES.len())
            );
            for (cell, tally) in results.cells().iter().enumerate() {
                let (gas, percent, samples) = self.place(cell);
                let share = |case: &&str| {
                    let mean = tally.values(&quantity(case)).and_then(|v| v.moments().mean());
                    mean.map_or("–".into(), |m| format!("{:.1}", 100.0 * m))
                };
                let shares: Vec<String> = CASES.iter().map(share).collect();
                let _ = writeln!(text, "| {} | {percent} | {samples} | {} |", self.gases[gas].name, shares.join(" | "));
            }
            fs::write(out.join(file), text)?;
        }
        Ok(())
    }
}
