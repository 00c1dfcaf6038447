//! Whether records give what a plan expects of them: the scatter of time constants and of the effect's parameter over the expected
//! standard error, and the deviance between the right model and the closest rival over the expected one.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use twinlag::signal::{Record as Sampling, Rig};
use twinlag_plan::Rehearsal;
use twinlag_study::{Failure, Moments, Outcome, Quantity, Results, Study, Values};

use super::pair::{self, Named};
use super::stored::{Head, Stored};

pub(super) const NAME: &str = "planning";

/// The effect of a rig.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Effect {
    /// Delay of the second channel, s; 0 where it has a second lag.
    delay_s: f64,
    /// Second lag of the first sensor, s; 0 where it has a delay.
    second_time_constant_s: f64,
}

/// A plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    name: String,
    title: String,
    seed: u64,
    trials: u64,
    samples: usize,
    sample_period_s: f64,
    tau_s: [f64; 2],
    /// Noise of each channel, per cent of the gas's standard deviation.
    noise_percent: Vec<f64>,
    effects: Vec<Effect>,
    gases: Vec<Named>,
}

/// What is kept of each trial.
const QUANTITIES: [&str; 6] = [
    "error of tau 1 over expected",
    "error of tau 2 over expected",
    "error of the effect over expected",
    "deviance expected",
    "deviance expected, noise known",
    "deviance found",
];
/// Records that a gas's standard deviation is taken from.
const RECORDS: u64 = 20;

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        toml::from_str(text).context("the plan of the planning")
    }

    /// Gas, effect and noise in per cent of a cell.
    fn place(&self, cell: usize) -> (usize, usize, f64) {
        let (effects, levels) = (self.effects.len(), self.noise_percent.len());
        (cell / (effects * levels), cell / levels % effects, self.noise_percent[cell % levels])
    }

    fn rig(&self, cell: usize) -> Result<Rig, Failure> {
        let (gas, effect, percent) = self.place(cell);
        let sampling = Sampling::new(self.samples, self.sample_period_s);
        let rig = |noise_std_k| {
            pair::rig(self.seed + cell as u64, sampling.clone(), &self.gases[gas], self.tau_s, Some(noise_std_k))
        };
        let rig = rig(0.01 * percent * pair::gas_std_k(&rig(1.0)?, RECORDS)?)?;
        let mut sensors = rig.sensors().clone();
        let Effect { delay_s, second_time_constant_s } = self.effects[effect];
        sensors[1].delay_s = delay_s;
        sensors[0].second_time_constant_s = (second_time_constant_s > 0.0).then_some(second_time_constant_s);
        // The plan is of this gas and no other.
        let mut signal = rig.gas().clone();
        signal.per_trial = false;
        Ok(rig.with_gas(signal)?.with_sensors(sensors)?)
    }

    fn effect_name(&self, effect: usize) -> &'static str {
        if self.effects[effect].delay_s > 0.0 { "delay" } else { "second-order" }
    }
}

impl Study for Plan {
    type Scratch = (Rig, Rehearsal);

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(self).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        self.gases.len() * self.effects.len() * self.noise_percent.len()
    }

    fn trials(&self) -> u64 {
        self.trials
    }

    fn block(&self) -> u64 {
        10
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        QUANTITIES.map(Quantity::value).to_vec()
    }

    fn scratch(&self, cell: usize) -> std::result::Result<(Rig, Rehearsal), Failure> {
        let rig = self.rig(cell)?;
        let rehearsal = Rehearsal::of(&rig)?;
        Ok((rig, rehearsal))
    }

    fn trial(
        &self,
        _cell: usize,
        index: u64,
        (rig, rehearsal): &mut (Rig, Rehearsal),
        outcome: &mut Outcome,
    ) -> std::result::Result<(), Failure> {
        let observations = rehearsal.observations(&rig.simulate_trial(index)?)?;
        let found = rehearsal.held_against(&observations)?;
        let expected = rehearsal.expected();
        for place in 0..3 {
            if let Some(error) = expected.standard_error(place) {
                outcome.value(place, (found.parameters[place] - expected.value(place)) / error);
            }
        }
        if let (Some([fitted, known]), Some(deviance)) = (rehearsal.deviances().first(), found.deviances.first()) {
            [*fitted, *known, *deviance].iter().enumerate().for_each(|(i, x)| outcome.value(3 + i, *x));
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
        [&mut self.trials, &mut self.seed]
    }

    /// One gas and one effect.
    fn shorten(&mut self) {
        self.trials = 2;
        self.gases.truncate(1);
        self.effects.truncate(1);
        self.noise_percent.truncate(1);
    }

    fn cell_name(&self, cell: usize) -> String {
        let (gas, effect, percent) = self.place(cell);
        format!("{}, {}, {percent} %", self.gases[gas].name, self.effect_name(effect))
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        let mut text =
            "| gas | effect | noise (%) | `τ1` | `τ2` | its parameter | expected | expected, noise known | found |\n\
                        |---|---|---|---|---|---|---|---|---|\n"
                .to_owned();
        for (cell, tally) in results.cells().iter().enumerate() {
            let moments = |place: usize| tally.values(QUANTITIES[place]).map(Values::moments);
            let scatter = |place: usize| {
                let of = moments(place)
                    .and_then(|m| Some((m.mean()?, m.standard_deviation()?, m.standard_deviation_error()?)));
                of.map_or("–".into(), |(mean, std, error)| format!("{std:.2} ± {error:.2} ({mean:+.1})"))
            };
            let mean = |place: usize| {
                let of = moments(place).and_then(Moments::mean);
                of.map_or("–".into(), |mean| format!("{mean:.1}"))
            };
            let found = |place: usize| {
                let of = moments(place).and_then(|m| Some((m.mean()?, m.mean_error()?)));
                of.map_or("–".into(), |(mean, error)| format!("{mean:.1} ± {error:.1}"))
            };
            let (gas, effect, percent) = self.place(cell);
            let row = [scatter(0), scatter(1), scatter(2), mean(3), mean(4), found(5)].join(" | ");
            let _ = writeln!(text, "| {} | {} | {percent} | {row} |", self.gases[gas].name, self.effect_name(effect));
        }
        Ok(fs::write(out.join("planning.md"), text)?)
    }
}
