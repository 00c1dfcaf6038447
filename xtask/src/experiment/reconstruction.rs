//! The gas temperature held against an oracle: the linear smoother that knows time constants, noise, and the true spectrum of the gas.
//!
//! The oracle is Gaussian conditioning on dense covariance matrices, whose entries are correlations of gas and noise-free readings over
//! many simulated records: it shares neither state, recursion nor spectral model with what it judges.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use anyhow::{Context, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use serde::{Deserialize, Serialize};
use twinlag::signal::{Record as Sampling, Rig};
use twinlag::{CompensateOptions, DiagnoseOptions, Estimator, Model, Options, characterise, compensate};
use twinlag_study::{Failure, Outcome, Quantity, Results, Study, Tally};
use twinlag_transform::{Complex64, Forward, Inverse};

use super::keep_last;
use super::pair::{self, LEVEL_C, Named, OTHERS};
use super::stored::{Head, Stored};

pub(super) const NAME: &str = "reconstruction";

/// A plan: which gases, with how much noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) seed: u64,
    pub(super) trials: u64,
    samples: usize,
    sample_period_s: f64,
    tau_s: [f64; 2],
    /// Noise of each channel, per cent of the gas's standard deviation.
    noise_percent: Vec<f64>,
    gases: Vec<Named>,
}

/// Samples of a noise-free record that correlations are taken from, in records of a trial, and how many of these.
const LONGER: usize = 8;
const RECORDS: u64 = 400;

/// Estimates that are held against the oracle.
const ESTIMATES: [&str; 4] =
    ["twinlag", "inverse of the faster sensor", "inverse by the compensated estimate", "faster sensor as it reads"];
const COVERED: usize = 1 + ESTIMATES.len();

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        toml::from_str(text).context("the plan of a reconstruction")
    }

    fn rig(&self, gas: usize, noise_std_k: Option<f64>, samples: usize) -> Result<Rig, Failure> {
        let sampling = Sampling::new(samples, self.sample_period_s);
        pair::rig(self.seed + gas as u64, sampling, &self.gases[gas], self.tau_s, noise_std_k)
    }
}

/// The experiment with its oracles, made when they are first needed.
pub(super) struct Reconstruction {
    pub(super) plan: Plan,
    moments: Vec<OnceLock<Moments>>,
    oracles: Vec<OnceLock<Mat<f64>>>,
}

/// Correlations at lags of 0 and more samples: gas and sensors with each other, `[a][b]` of `a(t) b(t + lag)`, 0 being the gas.
struct Moments {
    at: [[Vec<f64>; 3]; 3],
}

impl Reconstruction {
    pub(super) fn new(plan: Plan) -> Self {
        let moments = plan.gases.iter().map(|_| OnceLock::new()).collect();
        let oracles = (0..plan.gases.len() * plan.noise_percent.len()).map(|_| OnceLock::new()).collect();
        Self { plan, moments, oracles }
    }

    fn place(&self, cell: usize) -> (usize, f64) {
        let levels = self.plan.noise_percent.len();
        (cell / levels, self.plan.noise_percent[cell % levels])
    }

    fn moments(&self, gas: usize) -> &Moments {
        self.moments[gas].get_or_init(|| Moments::of(&self.plan, gas).expect("a valid plan"))
    }

    fn noise_std_k(&self, cell: usize) -> f64 {
        let (gas, percent) = self.place(cell);
        0.01 * percent * self.moments(gas).at[0][0][0].sqrt()
    }

    /// Weights of both channels' readings about the level, `[n][2n]`.
    fn oracle(&self, cell: usize) -> &Mat<f64> {
        self.oracles[cell].get_or_init(|| {
            let n = self.plan.samples;
            let moments = self.moments(self.place(cell).0);
            let noise = self.noise_std_k(cell).powi(2);
            let between = |a: usize, j: usize, b: usize, k: usize| {
                if k >= j { moments.at[a][b][k - j] } else { moments.at[b][a][j - k] }
            };
            let readings = Mat::from_fn(2 * n, 2 * n, |p, q| {
                between(1 + p / n, p % n, 1 + q / n, q % n) + if p == q { noise } else { 0.0 }
            });
            let with_gas = Mat::from_fn(2 * n, n, |p, k| between(1 + p / n, p % n, 0, k));
            let factor = readings.llt(Side::Lower).expect("correlations of records with noise are positive");
            factor.solve(&with_gas).transpose().to_owned()
        })
    }
}

impl Moments {
    fn of(plan: &Plan, gas: usize) -> Result<Self, Failure> {
        let (n, m) = (plan.samples, plan.samples * LONGER);
        let rig = plan.rig(gas, None, m)?;
        let (forward, inverse) = (Forward::of(2 * m), Inverse::of(2 * m));
        let mut sums: [[Vec<_>; 3]; 3] =
            std::array::from_fn(|_| std::array::from_fn(|_| vec![Complex64::ZERO; inverse.bins()]));
        for record in 0..RECORDS {
            let simulated = rig.simulate_trial(OTHERS + record)?;
            let spectra = [&simulated.gas_c, &simulated.t1_c, &simulated.t2_c]
                .map(|values| forward.transform(&values.iter().map(|v| v - LEVEL_C).collect::<Vec<f64>>()));
            for (a, row) in sums.iter_mut().enumerate() {
                for (b, sum) in row.iter_mut().enumerate() {
                    for (s, (x, y)) in sum.iter_mut().zip(spectra[a].iter().zip(&spectra[b])) {
                        *s += x.conj() * y;
                    }
                }
            }
        }
        let at = sums.map(|row| {
            row.map(|sum| {
                let out = inverse.transform(sum);
                let scale = 1.0 / (2.0 * m as f64 * m as f64 * RECORDS as f64);
                out[..n].iter().map(|v| v * scale).collect()
            })
        });
        Ok(Self { at })
    }
}

impl Study for Reconstruction {
    type Scratch = ();

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(&self.plan).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        self.oracles.len()
    }

    fn trials(&self) -> u64 {
        self.plan.trials
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        let errors =
            ["oracle"].into_iter().chain(ESTIMATES).map(|name| Quantity::value(format!("mean square of {name}")));
        errors.chain([Quantity::value("inside the 95 % band")]).collect()
    }

    fn scratch(&self, cell: usize) -> std::result::Result<(), Failure> {
        self.oracle(cell);
        Ok(())
    }

    fn trial(&self, cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> std::result::Result<(), Failure> {
        let (gas, _) = self.place(cell);
        let n = self.plan.samples;
        let rig = self.plan.rig(gas, Some(self.noise_std_k(cell)), n)?;
        let simulated = rig.simulate_trial(index)?;
        let truth = simulated.gas_c.clone();
        let mean_square =
            |values: &[f64]| values.iter().zip(&truth).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / n as f64;
        let about = |values: &[f64]| values.iter().map(|v| v - LEVEL_C).collect::<Vec<f64>>();
        let readings = [about(&simulated.t1_c), about(&simulated.t2_c)].concat();
        let by_oracle = self.oracle(cell) * Mat::from_fn(2 * n, 1, |k, _| readings[k]);
        let by_oracle: Vec<f64> = (0..n).map(|k| LEVEL_C + by_oracle[(k, 0)]).collect();
        outcome.value(0, mean_square(&by_oracle));
        let faster = simulated.t1_c.clone();
        let record = super::record_of(simulated)?;
        // What is found is judged here, and not what of it is given.
        let found = Options { best_effort: true, ..Options::default() };
        let options = CompensateOptions {
            model: Some(Model::of_two_lags(record.channels.clone())),
            diagnose: DiagnoseOptions { characterise: found.clone(), ..DiagnoseOptions::default() },
            ..CompensateOptions::default()
        };
        let answer = compensate(&record, &options)?;
        if !answer.gas_c.is_empty() {
            outcome.value(1, mean_square(&answer.gas_c));
            let inside = (0..n).filter(|&k| (answer.gas_c[k] - truth[k]).abs() <= 1.96 * answer.gas_std_k[k]).count();
            outcome.value(COVERED, inside as f64 / n as f64);
        }
        if let Some(tau_s) = answer.last.sensors[0].time_constant_s {
            outcome.value(2, mean_square(&inverse(&faster, tau_s, self.plan.sample_period_s)));
        }
        let compensated = Options { estimator: Estimator::BiasCompensated, ..found };
        let tau_s = characterise(&record, &compensated).ok().and_then(|a| a.sensors[0].time_constant_s);
        if let Some(tau_s) = tau_s {
            outcome.value(3, mean_square(&inverse(&faster, tau_s, self.plan.sample_period_s)));
        }
        outcome.value(4, mean_square(&faster));
        Ok(())
    }
}

/// What a user would do by hand: `T + τ dT/dt` by central differences.
fn inverse(reading_c: &[f64], tau_s: f64, period_s: f64) -> Vec<f64> {
    let last = reading_c.len() - 1;
    (0..=last)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
            reading_c[k] + tau_s * (reading_c[b] - reading_c[a]) / ((b - a) as f64 * period_s)
        })
        .collect()
}

impl Stored for Reconstruction {
    fn head(&self) -> Head<'_> {
        let Plan { name, title, seed, .. } = &self.plan;
        Head { name, title, seed: *seed }
    }

    fn trials_and_seed(&mut self) -> [&mut u64; 2] {
        [&mut self.plan.trials, &mut self.plan.seed]
    }

    /// One gas with the most noise, short.
    fn shorten(&mut self) {
        let mut plan = self.plan.clone();
        (plan.trials, plan.samples) = (1, 300);
        plan.gases.truncate(1);
        keep_last(&mut plan.noise_percent, 1);
        *self = Self::new(plan);
    }

    fn cell_name(&self, cell: usize) -> String {
        let (gas, percent) = self.place(cell);
        format!("{}, {percent} %", self.plan.gases[gas].name)
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        let mut text = String::from(
            "| gas | noise (%) | oracle (K) | twinlag / oracle | inverse of the faster sensor / oracle | inverse by the compensated \
             estimate / oracle | faster sensor / oracle | inside the 95 % band (%) |\n|---|---|---|---|---|---|---|---|\n",
        );
        for (cell, tally) in results.cells().iter().enumerate() {
            let (gas, percent) = self.place(cell);
            let root = |name: &str| rms(tally, name);
            let oracle = root("oracle");
            let ratios: Vec<String> = ESTIMATES.iter().map(|name| format!("{:.3}", root(name) / oracle)).collect();
            let inside = mean(tally, "inside the 95 % band").map_or(f64::NAN, |m| 100.0 * m);
            let _ = writeln!(
                text,
                "| {} | {percent} | {oracle:.3} | {} | {inside:.1} |",
                self.plan.gases[gas].name,
                ratios.join(" | ")
            );
        }
        fs::write(out.join("error.md"), text)?;
        Ok(())
    }
}

/// Root of the mean over all trials.
fn rms(tally: &Tally, name: &str) -> f64 {
    mean(tally, &format!("mean square of {name}")).map_or(f64::NAN, f64::sqrt)
}

fn mean(tally: &Tally, name: &str) -> Option<f64> {
    tally.values(name)?.moments().mean()
}
