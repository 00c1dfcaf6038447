//! Time constants along records in changing flow, held against the bound of the spline that an answer took; steps of the flow; steady
//! flow.
//!
//! In a swinging flow both time constants go up and down by the plan's share of themselves, twice along the record, so that a quarter
//! of it takes them from one extreme to the other. The rigs integrate this in continuous time, and [`bound`] has its own model.

mod bound;
mod tables;

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::OnceLock;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use twinlag::signal::{Flow, FlowSine, FlowStep, Record as Sampling, Rig, Simulated};
use twinlag::{Options, Track, TrackOptions, track};
use twinlag_study::{Failure, Outcome, Quantity, Results, Study};

use super::keep_last;
use super::pair::{self, Named};
use super::stored::{Head, Stored};
use bound::{Bound, Spread};

pub(super) const NAME: &str = "tracking";

/// A plan: which gases, with how much noise, and how much the flow changes.
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
    /// Noise of each channel in a swinging flow, per cent of the gas's standard deviation.
    noise_percent: Vec<f64>,
    /// In a step and in steady flow.
    other_noise_percent: Vec<f64>,
    /// By how much a swinging flow changes time constants either way.
    swing: f64,
    /// What a step multiplies them with.
    step_factor: f64,
    /// The noise that is drawn.
    pictured_percent: f64,
    gases: Vec<Named>,
}

/// What the flow does.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Swing,
    Step,
    Steady,
}

const KINDS: [Kind; 3] = [Kind::Swing, Kind::Step, Kind::Steady];

/// Records without noise that a gas's standard deviation is taken from.
const RECORDS: u64 = 100;
/// Periods of a swinging flow in the record.
const PERIODS: f64 = 2.0;
/// The part of the record in which a step may be.
const STEPS_WITHIN: [f64; 2] = [0.4, 0.6];
/// Pieces of fixed splines that the answer's own is held against.
const SIZES: [usize; 8] = [3, 5, 8, 12, 16, 20, 26, 32];

/// Quantities of a record, in order; those of sensors are two.
const ANSWERED: usize = 0;
const CHANGE: usize = 1;
const CHANGES: [&str; 3] = ["smooth", "step", "constant"];
const RATIO: usize = CHANGE + CHANGES.len();
const RATIO_5: usize = RATIO + 1;
const REJECTED: usize = RATIO_5 + 1;
const INSTANT_INSIDE: usize = REJECTED + 1;
const EVENTS: [&str; 4] = ["ratio changes", "p of the ratio below 5 %", "something is left over", "instant inside"];
const COEFFICIENTS: usize = INSTANT_INSIDE + 1;
const INSTANT: usize = COEFFICIENTS + 1;
const HALF_WIDTH: usize = INSTANT + 1;
const RESOLUTION: usize = HALF_WIDTH + 1;
const FACTOR: usize = RESOLUTION + 1;
const OVER_BOUND: usize = FACTOR + 1;
const VALUES: [&str; 6] = [
    "coefficients",
    "error of the instant",
    "half width",
    "resolution",
    "error of the factor",
    "square error over that of the bound",
];
const ERROR: usize = OVER_BOUND + 1;
const BOUND: usize = ERROR + 2;
const BIAS: usize = BOUND + 2;
const CLAIMED: usize = BIAS + 2;
const INSIDE: usize = CLAIMED + 2;
const OF_SENSORS: [&str; 5] = ["mean square error", "bound", "systematic", "claimed variance", "inside"];
const FIXED: usize = INSIDE + 2;

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        toml::from_str(text).context("the plan of changing flow")
    }

    fn noise_percent(&self, kind: Kind) -> &[f64] {
        if kind == Kind::Swing { &self.noise_percent } else { &self.other_noise_percent }
    }

    /// - `seed`: added to the plan's
    fn rig(&self, seed: u64, gas: usize, flow: Option<Flow>, noise_std_k: Option<f64>) -> Result<Rig, Failure> {
        let sampling = Sampling::new(self.samples, self.sample_period_s);
        let rig = pair::rig(self.seed + seed, sampling, &self.gases[gas], self.tau_s, noise_std_k)?;
        Ok(if let Some(flow) = flow { rig.with_flow(flow)? } else { rig })
    }

    fn span_s(&self) -> f64 {
        (self.samples - 1) as f64 * self.sample_period_s
    }

    /// Phases and places go evenly through all of theirs (multiples of the golden ratio).
    fn flow(&self, kind: Kind, index: u64) -> Option<Flow> {
        let share = (index as f64 * 0.618_033_988_749_895).fract();
        match kind {
            Kind::Swing => Some(Flow::Sine(FlowSine::new(self.swing, self.span_s() / PERIODS, TAU * share))),
            Kind::Step => {
                let [from, to] = STEPS_WITHIN;
                let at_s = (from + (to - from) * share) * self.span_s();
                Some(Flow::Step(FlowStep::new(self.step_factor, at_s, 1e-3 * self.sample_period_s)))
            }
            Kind::Steady => None,
        }
    }
}

/// The experiment, with the noise of each gas found when it is first needed.
pub(super) struct Tracking {
    pub(super) plan: Plan,
    gas_std_k: Vec<OnceLock<f64>>,
}

/// A simulated record, what is true of it, and the answer.
struct Trial {
    /// Readings without noise.
    clean: Simulated,
    noise_std_k: f64,
    flow: Option<Flow>,
    answer: Track,
}

impl Tracking {
    pub(super) fn new(plan: Plan) -> Self {
        let gas_std_k = plan.gases.iter().map(|_| OnceLock::new()).collect();
        Self { plan, gas_std_k }
    }

    /// What the flow does, which gas, and its noise in per cent, of each cell.
    fn places(&self) -> Vec<(Kind, usize, f64)> {
        let gases = 0..self.plan.gases.len();
        let of_kind = |kind: Kind| {
            let levels = self.plan.noise_percent(kind);
            gases.clone().flat_map(move |gas| levels.iter().map(move |percent| (kind, gas, *percent)))
        };
        KINDS.into_iter().flat_map(of_kind).collect()
    }

    fn place(&self, cell: usize) -> (Kind, usize, f64) {
        self.places()[cell]
    }

    fn gas_std_k(&self, gas: usize) -> Result<f64, Failure> {
        if let Some(std_k) = self.gas_std_k[gas].get() {
            return Ok(*std_k);
        }
        let rig = self.plan.rig(gas as u64, gas, None, None)?;
        let std_k = pair::gas_std_k(&rig, RECORDS)?;
        Ok(*self.gas_std_k[gas].get_or_init(|| std_k))
    }

    fn run(&self, cell: usize, index: u64) -> Result<Trial, Failure> {
        let (kind, gas, percent) = self.place(cell);
        let noise_std_k = 0.01 * percent * self.gas_std_k(gas)?;
        let flow = self.plan.flow(kind, index);
        let rig = |noise_std_k: Option<f64>| self.plan.rig(100 + cell as u64, gas, flow, noise_std_k);
        let clean = rig(None)?.simulate_trial(index)?;
        let record = super::record_of(rig(Some(noise_std_k))?.simulate_trial(index)?)?;
        // It is the estimator that is judged, also where its answer may not be used.
        let characterise = Options { best_effort: true, ..Options::default() };
        let answer = track(&record, &TrackOptions { characterise, ..TrackOptions::default() })?;
        Ok(Trial { clean, noise_std_k, flow, answer })
    }
}

impl Trial {
    fn factor(&self, time_s: f64) -> f64 {
        self.flow.map_or(1.0, |flow| flow.factor(time_s))
    }

    fn bound(&self, plan: &Plan) -> Bound {
        let middles = || (0..plan.samples - 1).map(|k| (k as f64 + 0.5) * plan.sample_period_s);
        let tau_s = plan.tau_s.map(|tau_s| middles().map(|t| tau_s * self.factor(t)).collect());
        Bound::new([&self.clean.t1_c, &self.clean.t2_c], tau_s, plan.sample_period_s, self.noise_std_k)
    }

    /// Along the record: how far it is off against the bound, and whether the bands hold.
    fn along(&self, plan: &Plan, outcome: &mut Outcome) {
        let bound = self.bound(plan);
        let size = self.answer.coefficients.unwrap_or(0);
        let own = bound.spread(size);
        for i in 0..2 {
            let sensor = &self.answer.sensors[i];
            let truth_s: Vec<f64> = self.answer.time_s.iter().map(|t| plan.tau_s[i] * self.factor(*t)).collect();
            let share = |of: &dyn Fn(usize) -> f64| (0..truth_s.len()).map(of).sum::<f64>() / truth_s.len() as f64;
            outcome.value(ERROR + i, share(&|k| (sensor.tau_s[k] / truth_s[k] - 1.0).powi(2)));
            let is_inside = |k: usize| sensor.low_s[k] <= truth_s[k] && truth_s[k] <= sensor.high_s[k];
            outcome.value(INSIDE + i, share(&|k| f64::from(u8::from(is_inside(k)))));
            outcome.value(CLAIMED + i, share(&|k| ((sensor.high_s[k] / sensor.tau_s[k]).ln() / 1.96).powi(2)));
            if let Some(own) = &own {
                outcome.value(BOUND + i, mean(&own.variance[i]));
                outcome.value(BIAS + i, mean_square(&own.bias[i]));
            }
        }
        let total = |of: usize| (0..2).map(|i| outcome.recorded_value(of + i)).sum::<Option<f64>>();
        if let (Some(error), Some(bound)) = (total(ERROR), total(BOUND)) {
            outcome.value(OVER_BOUND, error / bound);
        }
        for (j, size) in SIZES.into_iter().enumerate() {
            if let Some(Spread { variance, bias }) = bound.spread(size) {
                let total = (0..2).map(|i| mean(&variance[i]) + mean_square(&bias[i])).sum::<f64>();
                outcome.value(FIXED + j, total);
            }
        }
    }

    fn instant(&self, plan: &Plan, step: &FlowStep, outcome: &mut Outcome) {
        let resolution = self.bound(plan).step_resolution(step.at_s / plan.sample_period_s, step.factor);
        outcome.value(RESOLUTION, resolution * plan.sample_period_s);
        if let Some(found) = &self.answer.step {
            let [low_s, high_s] = found.interval_95_s;
            outcome.event(INSTANT_INSIDE, low_s <= step.at_s && step.at_s <= high_s);
            outcome.value(INSTANT, (found.at_s - step.at_s).abs());
            outcome.value(HALF_WIDTH, 0.5 * (high_s - low_s));
            outcome.value(FACTOR, (found.factor / step.factor - 1.0).powi(2));
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

impl Study for Tracking {
    type Scratch = ();

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(&self.plan).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        self.places().len()
    }

    fn trials(&self) -> u64 {
        self.plan.trials
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        let events = ["answered"].into_iter().chain(CHANGES).chain(EVENTS);
        let mut out: Vec<Quantity> = events.map(Quantity::event).collect();
        out.extend(VALUES.map(Quantity::value));
        for name in OF_SENSORS {
            out.extend((1..3).map(|sensor| Quantity::value(format!("{name} {sensor}"))));
        }
        out.extend(SIZES.map(|size| Quantity::value(fixed(size))));
        out
    }

    fn scratch(&self, cell: usize) -> std::result::Result<(), Failure> {
        self.gas_std_k(self.place(cell).1)?;
        Ok(())
    }

    fn trial(&self, cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> std::result::Result<(), Failure> {
        let trial = self.run(cell, index)?;
        let answer = &trial.answer;
        let is_answered = !answer.time_s.is_empty();
        outcome.event(ANSWERED, is_answered);
        if is_answered {
            for (i, name) in CHANGES.iter().enumerate() {
                outcome.event(CHANGE + i, answer.change == *name);
            }
            if let Some(ratio) = &answer.ratio {
                outcome.event(RATIO, !ratio.stays);
                outcome.event(RATIO_5, ratio.test.p_value < 0.05);
            }
            outcome.event(REJECTED, answer.status == twinlag::Status::ModelRejected);
            if let Some(coefficients) = answer.coefficients {
                outcome.value(COEFFICIENTS, coefficients as f64);
            }
            match &trial.flow {
                Some(Flow::Step(step)) => trial.instant(&self.plan, step, outcome),
                _ => trial.along(&self.plan, outcome),
            }
        }
        Ok(())
    }
}

/// Name of the sum of both sensors' bound and systematic error with a spline of `size` pieces.
fn fixed(size: usize) -> String {
    format!("bound with {size}")
}

impl Stored for Tracking {
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
        (plan.trials, plan.samples) = (1, 600);
        plan.gases.truncate(1);
        for levels in [&mut plan.noise_percent, &mut plan.other_noise_percent] {
            keep_last(levels, 1);
        }
        *self = Self::new(plan);
    }

    fn cell_name(&self, cell: usize) -> String {
        let (kind, gas, percent) = self.place(cell);
        let kind = match kind {
            Kind::Swing => "swinging",
            Kind::Step => "a step",
            Kind::Steady => "steady",
        };
        format!("{kind}, {}, {percent} %", self.plan.gases[gas].name)
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        tables::write(self, results, out)
    }
}
