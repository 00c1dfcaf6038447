//! The plan of an experiment: which records, which methods, how many trials.
//!
//! Cells are the product of all lists, in the order in which they stand here; every method analyses
//! the same records.

use serde::{Deserialize, Serialize};
use twinlag::signal::{Gas, Noise, Record, Rig, Sensor};

use crate::error::ExperimentError;

mod columns;
mod method;
mod picture;
mod summary;

#[cfg(test)]
pub(crate) use columns::COLUMNS;
pub(crate) use columns::LABELS;
pub use method::{Method, OptimiserChoice, Start, Told};
pub use picture::{Drawn, PictureSpec};
pub use summary::SummarySpec;

/// An experiment, as its TOML file has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name of the experiment and of its folder.
    pub name: String,
    /// What it shows, one line.
    pub title: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Trials in each cell.
    pub trials: u64,
    /// Trials added up at a time. Part of the plan, because it decides the last digits.
    #[serde(default = "default_block")]
    pub block: u64,
    /// Gas signals.
    pub gases: Vec<NamedGas>,
    /// Lengths of the record, samples.
    #[serde(default = "default_samples")]
    pub samples: Vec<usize>,
    /// Sample periods, s.
    #[serde(default = "default_periods")]
    pub sample_period_s: Vec<f64>,
    /// Pairs of time constants, s.
    #[serde(default = "default_time_constants")]
    pub time_constants_s: Vec<[f64; 2]>,
    /// Noise standard deviations, per cent; the louder channel's where the levels differ.
    pub noise_percent: Vec<f64>,
    /// The signal to whose standard deviation the per cent refer.
    #[serde(default = "default_noise_of")]
    pub noise_of: Vec<NoiseOf>,
    /// Noise of channel 2 over that of channel 1.
    #[serde(default = "default_ratio")]
    pub noise_ratio: Vec<f64>,
    /// First-order autoregressive coefficient of both noises.
    #[serde(default = "default_white")]
    pub noise_ar1: Vec<f64>,
    /// The methods that analyse each record.
    pub methods: Vec<Method>,
    /// Time constants of a grid of starts (every pair of two of them), s, for methods that start
    /// there.
    #[serde(default)]
    pub grid_s: Vec<f64>,
    /// Whether the methods are timed as well; times go into a file of their own, since no two runs
    /// agree on them.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub timed: bool,
    /// Pictures of the table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pictures: Vec<PictureSpec>,
    /// Tables for people.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub summaries: Vec<SummarySpec>,
}

fn default_block() -> u64 {
    100
}
fn default_samples() -> Vec<usize> {
    vec![2500]
}
fn default_periods() -> Vec<f64> {
    vec![0.002]
}
fn default_time_constants() -> Vec<[f64; 2]> {
    vec![[0.0238, 0.1168]]
}
fn default_noise_of() -> Vec<NoiseOf> {
    vec![NoiseOf::Gas]
}
fn default_ratio() -> Vec<f64> {
    vec![1.0]
}
fn default_white() -> Vec<f64> {
    vec![0.0]
}

/// A gas signal with the name that tables have for it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedGas {
    /// Name.
    pub name: String,
    /// The signal, as in a rig file.
    pub gas: Gas,
}

/// The signal against which noise is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseOf {
    /// The standard deviation of the gas temperature: both channels have the same noise.
    Gas,
    /// The standard deviation of each channel's own reading before noise.
    Reading,
}

impl NoiseOf {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gas => "gas",
            Self::Reading => "reading",
        }
    }
}

/// One cell: a kind of record.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Which gas, by position.
    pub gas: usize,
    /// Samples.
    pub samples: usize,
    /// Sample period, s.
    pub sample_period_s: f64,
    /// True time constants, s.
    pub tau_s: [f64; 2],
    /// Noise, per cent.
    pub noise_percent: f64,
    /// The signal to whose standard deviation the per cent refer.
    pub noise_of: NoiseOf,
    /// Noise of channel 2 over that of channel 1.
    pub noise_ratio: f64,
    /// Autoregressive coefficient of both noises.
    pub noise_ar1: f64,
}

/// What a cell's records are made of.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The rig, noise included.
    pub rig: Rig,
    /// Noise standard deviations, K.
    pub noise_std_k: [f64; 2],
}

impl Plan {
    /// Reads a plan.
    ///
    /// ```
    /// use twinlag_experiment::Plan;
    ///
    /// let text = r#"
    ///     name = "example"
    ///     title = "Nothing but a start"
    ///     seed = 1
    ///     trials = 10
    ///     noise_percent = [5]
    ///     gases = [{ name = "sine", gas = { kind = "sine", amplitude_k = 10.0, frequency_hz = 2.0 } }]
    ///     methods = [{ name = "whitened", estimator = "whitened" }]
    /// "#;
    /// let plan = Plan::from_toml(text)?;
    /// assert_eq!((plan.samples, plan.sample_period_s), (vec![2500], vec![0.002])); // where nothing is said
    /// let error = Plan::from_toml(&text.replace("trials = 10", "trials = 0")).expect_err("nothing to run");
    /// assert_eq!(error.to_string(), "the plan: trials and block must be positive");
    /// # Ok::<(), twinlag_experiment::ExperimentError>(())
    /// ```
    ///
    /// # Errors
    /// For text that is not a plan, with the line at fault, and for a plan that cannot run.
    pub fn from_toml(text: &str) -> Result<Self, ExperimentError> {
        let plan: Self = toml::from_str(text).map_err(|e| ExperimentError::Plan(e.to_string()))?;
        plan.check()?;
        Ok(plan)
    }

    fn check(&self) -> Result<(), ExperimentError> {
        let refuse = |what: String| Err(ExperimentError::Plan(what));
        if self.trials == 0 || self.block == 0 {
            return refuse("trials and block must be positive".into());
        }
        if self.cells().is_empty() || self.methods.is_empty() {
            return refuse("a plan needs a method, and one entry at least in each of its lists".into());
        }
        let positive = |v: &f64| v.is_finite() && *v > 0.0;
        if !self.noise_percent.iter().all(|v| v.is_finite() && *v >= 0.0) {
            return refuse(format!("noise_percent must not be negative, got {:?}", self.noise_percent));
        }
        if !self.noise_ratio.iter().chain(&self.grid_s).all(positive) {
            return refuse(format!(
                "noise_ratio and grid_s must be positive, got {:?} and {:?}",
                self.noise_ratio, self.grid_s
            ));
        }
        if let Some((i, gas)) =
            self.gases.iter().enumerate().find(|(i, g)| self.gases[..*i].iter().any(|h| h.name == g.name))
        {
            return refuse(format!("two gases are called \"{}\", the last of them number {}", gas.name, i + 1));
        }
        for (i, method) in self.methods.iter().enumerate() {
            if !method.variance_factor.iter().all(positive) {
                return refuse(format!("method \"{}\": variance_factor must be positive", method.name));
            }
            if let Start::At(tau_s) = method.start
                && !tau_s.iter().all(positive)
            {
                return refuse(format!("method \"{}\": it must start at positive time constants", method.name));
            }
            if self.methods[..i].iter().any(|m| m.name == method.name) {
                return refuse(format!("two methods are called \"{}\"", method.name));
            }
            if method.start == Start::Grid && self.grid_s.is_empty() {
                return refuse(format!("method \"{}\" starts on the grid, but the plan has no grid_s", method.name));
            }
        }
        for cell in self.cells() {
            self.bench(&cell, 0)?;
        }
        self.pictures.iter().try_for_each(|picture| picture.check(&self.methods))?;
        self.summaries.iter().try_for_each(|summary| summary.check(&self.methods))
    }

    /// What decides the numbers: the plan without its pictures, summaries and timing.
    #[must_use]
    pub fn decisive(&self) -> Self {
        Self { timed: false, pictures: Vec::new(), summaries: Vec::new(), ..self.clone() }
    }

    /// All cells, in order.
    ///
    /// ```
    /// # use twinlag_experiment::Plan;
    /// # let plan = Plan::from_toml(r#"
    /// #     name = "grid"
    /// #     title = "Six cells"
    /// #     seed = 2
    /// #     trials = 1
    /// #     samples = [500, 1000]
    /// #     noise_percent = [1, 3, 10]
    /// #     gases = [{ name = "slow", gas = { kind = "broadband", std_k = 9.0, corner_hz = 1.0 } }]
    /// #     methods = [{ name = "ls", estimator = "difference-equation-ls" }]
    /// # "#)?;
    /// // A plan with `samples = [500, 1000]` and `noise_percent = [1, 3, 10]`.
    /// let cells = plan.cells();
    /// assert_eq!(cells.len(), 6);
    /// // What stands last in the plan changes first.
    /// let of: Vec<_> = cells.iter().map(|cell| (cell.samples, cell.noise_percent)).collect();
    /// assert_eq!(of[..4], [(500, 1.0), (500, 3.0), (500, 10.0), (1000, 1.0)]);
    /// # Ok::<(), twinlag_experiment::ExperimentError>(())
    /// ```
    pub fn cells(&self) -> Vec<Cell> {
        let mut out = Vec::new();
        for gas in 0..self.gases.len() {
            for &samples in &self.samples {
                for &sample_period_s in &self.sample_period_s {
                    for &tau_s in &self.time_constants_s {
                        for &noise_of in &self.noise_of {
                            for &noise_ratio in &self.noise_ratio {
                                for &noise_ar1 in &self.noise_ar1 {
                                    for &noise_percent in &self.noise_percent {
                                        out.push(Cell {
                                            gas,
                                            samples,
                                            sample_period_s,
                                            tau_s,
                                            noise_percent,
                                            noise_of,
                                            noise_ratio,
                                            noise_ar1,
                                        });
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
        out
    }

    /// The rig of a cell, the `index`-th: each has a seed of its own.
    ///
    /// # Errors
    /// For an impossible rig.
    pub fn bench(&self, cell: &Cell, index: usize) -> Result<Bench, ExperimentError> {
        let seed = self.seed.wrapping_add(index as u64 * 0x9E37_79B9);
        let sensor = |channel: &str, tau_s: f64, noise: Option<Noise>| {
            let mut sensor = Sensor::new(channel, tau_s);
            sensor.noise = noise;
            sensor
        };
        let record = Record::new(cell.samples, cell.sample_period_s);
        let rig = |noise: [Option<Noise>; 2]| {
            let [n1, n2] = noise;
            let sensors = [sensor("T1", cell.tau_s[0], n1), sensor("T2", cell.tau_s[1], n2)];
            Rig::new(seed, record.clone(), self.gases[cell.gas].gas.clone(), sensors)
        };
        let clean = rig([None, None])?.clean(0)?;
        let scale = match cell.noise_of {
            NoiseOf::Gas => [standard_deviation(&clean.gas_c); 2],
            NoiseOf::Reading => [0, 1].map(|i| standard_deviation(&clean.readings_c[i])),
        };
        let louder = cell.noise_ratio.max(1.0);
        let noise_std_k = [1.0 / louder, cell.noise_ratio / louder].map(|share| 0.01 * cell.noise_percent * share);
        let noise_std_k = [noise_std_k[0] * scale[0], noise_std_k[1] * scale[1]];
        let noise = noise_std_k.map(|std_k| {
            let mut noise = Noise::white(std_k);
            noise.ar1 = cell.noise_ar1;
            Some(noise)
        });
        Ok(Bench { rig: rig(noise)?, noise_std_k })
    }
}

fn standard_deviation(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    (x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / x.len() as f64).sqrt()
}
