//! A contact that opens now and then: episodes begin as a Poisson process and last exponentially
//! long. During each, a part of the reading's distance from a reference is lost:
//! `y → y − d (y − r)`. The edges are sharp.

use rand::{Rng, RngExt};
use rand_distr::Exp1;
use serde::{Deserialize, Serialize};

use crate::check::{between, finite, positive};
use crate::{Record, SignalError};

/// Random episodes in which a part of the reading is lost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct IntermittentContact {
    /// How often an episode begins while none is on, 1/s; 0 is allowed, and at most one per
    /// sample period.
    pub rate_hz: f64,
    /// Mean duration of an episode, s.
    pub mean_duration_s: f64,
    /// The part `d` that is lost, 0 to 1.
    pub drop_fraction: f64,
    /// The reference `r` towards which the reading falls, °C, such as the temperature of the cold
    /// junction. The mean of the channel's record if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub towards_c: Option<f64>,
}

impl IntermittentContact {
    /// Episodes in which the reading falls towards the mean of its record.
    pub fn new(rate_hz: f64, mean_duration_s: f64, drop_fraction: f64) -> Self {
        Self { rate_hz, mean_duration_s, drop_fraction, towards_c: None }
    }

    /// Applies the episodes to the readings at the given times, which increase from zero. At time
    /// zero the contact is in either state with its stationary probability.
    pub(crate) fn apply(&self, times_s: &[f64], readings_c: &mut [f64], rng: &mut impl Rng) {
        let mean_c = readings_c.iter().sum::<f64>() / readings_c.len() as f64;
        let towards_c = self.towards_c.unwrap_or(mean_c);
        let mut open = rng.random::<f64>() * (1.0 + self.rate_hz * self.mean_duration_s) >= 1.0;
        let mut lasts_s = |open: bool| {
            let draw: f64 = rng.sample(Exp1);
            // A rate of 0 is a wait without end.
            if open { draw * self.mean_duration_s } else { draw / self.rate_hz }
        };
        let mut end_s = lasts_s(open);
        for (time_s, reading_c) in times_s.iter().zip(readings_c) {
            while *time_s >= end_s {
                open = !open;
                end_s += lasts_s(open);
            }
            if open {
                *reading_c -= self.drop_fraction * (*reading_c - towards_c);
            }
        }
    }

    pub(crate) fn check(&self, within: &str, record: &Record) -> Result<(), SignalError> {
        // More than one episode per sample is not seen as such, and would take for ever to draw.
        between(within, "rate_hz", self.rate_hz, 0.0, 1.0 / record.sample_period_s)?;
        positive(within, "mean_duration_s", self.mean_duration_s)?;
        between(within, "drop_fraction", self.drop_fraction, 0.0, 1.0)?;
        self.towards_c.map_or(Ok(()), |towards_c| finite(within, "towards_c", towards_c))
    }
}
