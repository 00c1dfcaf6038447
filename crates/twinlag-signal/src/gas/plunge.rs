//! Random steps, as of a probe plunged from one bath into another: levels uniform over ±A, each
//! reached by half a raised cosine. The time from one step to the next is the rise and then an
//! exponential wait, so every level is reached, the temperature and its slope are continuous, and
//! the mean time is the one given.

use rand::{Rng, RngExt};
use rand_distr::Exp1;
use serde::{Deserialize, Serialize};

use super::{Resolution, smooth_step};
use crate::SignalError;
use crate::check::{below, positive};
use crate::grid::Grid;

/// Smoothed random steps between random levels. The first step starts with the run-in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plunge {
    /// Levels are uniform between minus and plus this, K.
    pub amplitude_k: f64,
    /// Mean time from the start of one step to the start of the next, s.
    pub dwell_s: f64,
    /// Time in which a step is made, s, shorter than `dwell_s`.
    pub rise_s: f64,
}

impl Plunge {
    fn level_k(&self, rng: &mut impl Rng) -> f64 {
        self.amplitude_k * rng.random_range(-1.0..=1.0)
    }

    fn wait_s(&self, rng: &mut impl Rng) -> f64 {
        let draw: f64 = rng.sample(Exp1);
        self.rise_s + (self.dwell_s - self.rise_s) * draw
    }

    pub(super) fn values_k(&self, grid: Grid, rng: &mut impl Rng) -> Vec<f64> {
        let mut start_s = grid.time_s(0);
        let (mut from_k, mut to_k) = (self.level_k(rng), self.level_k(rng));
        let mut end_s = start_s + self.wait_s(rng);
        let mut next = |time_s: f64| {
            while time_s >= end_s {
                (start_s, from_k, to_k) = (end_s, to_k, self.level_k(rng));
                end_s = start_s + self.wait_s(rng);
            }
            let u = (time_s - start_s) / self.rise_s;
            if u < 1.0 { from_k + (to_k - from_k) * smooth_step(u) } else { to_k }
        };
        grid.times_s().map(&mut next).collect()
    }

    pub(super) fn check(&self, within: &str, resolution: Resolution) -> Result<(), SignalError> {
        positive(within, "amplitude_k", self.amplitude_k)?;
        positive(within, "dwell_s", self.dwell_s)?;
        positive(within, "rise_s", self.rise_s)?;
        below(within, "rise_s", self.rise_s, "dwell_s", self.dwell_s)?;
        resolution.check_rise(within, "rise_s", self.rise_s, self.rise_s)
    }
}
