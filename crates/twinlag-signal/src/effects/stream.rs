//! A stream that carries the gas past the sensors, with a velocity that is recorded beside them:
//! `v(t) = v̄ (1 + depth · sin(2π t/period + phase))`. A sensor downstream of the other meets the
//! same gas later, and a time constant may go with a power of the velocity, of each sensor its own.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{finite, path, positive};
use crate::grid::Grid;

/// Velocity of the stream, always positive; time zero at the record's first sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Stream {
    /// Mean velocity `v̄`, m/s.
    pub mean_m_per_s: f64,
    /// Depth of the modulation, between −1 and 1 (both excluded).
    pub depth: f64,
    /// Period, s.
    pub period_s: f64,
    /// Phase at the record's first sample, rad; 0 if left out.
    #[serde(default)]
    pub phase_rad: f64,
}

impl Stream {
    /// `mean_m_per_s · (1 + depth · sin(2π t/period_s + phase_rad))`.
    pub fn new(mean_m_per_s: f64, depth: f64, period_s: f64, phase_rad: f64) -> Self {
        Self { mean_m_per_s, depth, period_s, phase_rad }
    }

    /// Velocity at a time after the first sample, m/s.
    pub fn velocity_m_per_s(&self, time_s: f64) -> f64 {
        self.mean_m_per_s * self.relative_velocity(time_s)
    }

    /// Velocity over its mean.
    pub(crate) fn relative_velocity(&self, time_s: f64) -> f64 {
        1.0 + self.depth * self.phase(time_s).sin()
    }

    /// Bounds of the velocity over its mean: least and greatest.
    pub(crate) fn relative_velocity_range(&self) -> [f64; 2] {
        [1.0 - self.depth.abs(), 1.0 + self.depth.abs()]
    }

    /// The longest that gas is on its way over `distance_m`, s.
    pub(crate) fn longest_transit_s(&self, distance_m: f64) -> f64 {
        distance_m / (self.mean_m_per_s * self.relative_velocity_range()[0])
    }

    /// For each point of `grid`, when the gas that arrives there had been `distance_m` upstream: in points of the grid, with fractions.
    /// Gas from before the grid begins counts as that of its first point.
    pub(crate) fn departures(&self, grid: Grid, distance_m: f64) -> impl Iterator<Item = f64> {
        let mut point = 0;
        grid.times_s().map(move |time_s| {
            let departed_m = self.travelled_m(time_s) - distance_m;
            let at_m = |point: usize| self.travelled_m(grid.time_s(point));
            while at_m(point + 1) <= departed_m {
                point += 1;
            }
            let [from_m, to_m] = [at_m(point), at_m(point + 1)];
            let mut departed_s = grid.time_s(point) + (departed_m - from_m) / (to_m - from_m) * grid.step_s;
            // From the chord two steps of Newton reach rounding.
            for _ in 0..2 {
                departed_s -= (self.travelled_m(departed_s) - departed_m) / self.velocity_m_per_s(departed_s);
            }
            (departed_s / grid.step_s + grid.before as f64).max(0.0)
        })
    }

    /// How far the gas has gone since time zero, but for a constant, m.
    fn travelled_m(&self, time_s: f64) -> f64 {
        self.mean_m_per_s * (time_s - self.depth * self.period_s / TAU * self.phase(time_s).cos())
    }

    fn phase(&self, time_s: f64) -> f64 {
        TAU * time_s / self.period_s + self.phase_rad
    }

    pub(crate) fn check(&self) -> Result<(), SignalError> {
        let within = "stream";
        positive(within, "mean_m_per_s", self.mean_m_per_s)?;
        positive(within, "period_s", self.period_s)?;
        finite(within, "phase_rad", self.phase_rad)?;
        if self.depth.abs() < 1.0 {
            return Ok(());
        }
        Err(SignalError::OutOfRange { field: path(within, "depth"), value: self.depth, low: -1.0, high: 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Hold, Record};

    /// The way from departure to arrival is the distance, to rounding of some metres.
    #[test]
    fn gas_departs_when_it_has_the_distance_to_go() {
        let stream = Stream::new(2.0, 0.6, 0.31, 0.2);
        let grid = Grid::new(&Record::new(500, 0.002), 100, Hold::Continuous);
        let (distance_m, tol_m) = (0.05, 1e-12);
        let mut seen = 0;
        for (arrived_s, point) in grid.times_s().zip(stream.departures(grid, distance_m)).filter(|(_, p)| *p > 0.0) {
            let departed_s = (point - grid.before as f64) * grid.step_s;
            let way_m = stream.travelled_m(arrived_s) - stream.travelled_m(departed_s);
            assert!((way_m - distance_m).abs() < tol_m, "{arrived_s} s: {way_m} m, within {tol_m}");
            seen += 1;
        }
        assert!(seen > grid.points / 2);
    }
}
