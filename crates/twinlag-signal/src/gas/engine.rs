//! Pulsation of an engine's exhaust: in every cycle the gas rises within a fraction of the period
//! to the cycle's peak (half a raised cosine, from wherever it was) and decays exponentially
//! towards the base.
//!
//! The mean of the cycle without variation, `A [ρ (1 + ε)/2 + δ (1 − ε)]` with the rise fraction
//! `ρ`, the decay fraction `δ` and `ε = exp(−(1 − ρ)/δ)`, is subtracted, so that the gas has the
//! given mean. Variation from cycle to cycle is log-normal with mean one: peaks and periods stay
//! positive. A model of the shape, not of an engine's gas exchange.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::{Resolution, smooth_step};
use crate::SignalError;
use crate::check::{between, not_negative, path, positive};
use crate::grid::Grid;

/// Pulsation with a sharp rise and an exponential decay in each cycle. The first cycle starts with
/// the run-in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Engine {
    /// Height of the mean peak above the base to which the gas decays, K.
    pub amplitude_k: f64,
    /// Mean cycle frequency, Hz (one over the mean period).
    pub frequency_hz: f64,
    /// Relative standard deviation of the peaks from cycle to cycle, at most 1; 0 if left out.
    #[serde(default)]
    pub amplitude_relative_std: f64,
    /// Relative standard deviation of the periods from cycle to cycle, at most 1; 0 if left out.
    #[serde(default)]
    pub period_relative_std: f64,
    /// Part of each period in which the gas rises, between 0 and 1 (both excluded); 0.08 if left
    /// out.
    #[serde(default = "default_rise_fraction")]
    pub rise_fraction: f64,
    /// Time constant of the decay as a part of the period; 0.25 if left out.
    #[serde(default = "default_decay_fraction")]
    pub decay_fraction: f64,
}

fn default_rise_fraction() -> f64 {
    0.08
}

fn default_decay_fraction() -> f64 {
    0.25
}

/// One cycle: all about the base, K and s.
struct Cycle {
    start_s: f64,
    period_s: f64,
    from_k: f64,
    peak_k: f64,
}

impl Engine {
    /// Pulsation without variation from cycle to cycle, with the default shape.
    pub fn new(amplitude_k: f64, frequency_hz: f64) -> Self {
        Self {
            amplitude_k,
            frequency_hz,
            amplitude_relative_std: 0.0,
            period_relative_std: 0.0,
            rise_fraction: default_rise_fraction(),
            decay_fraction: default_decay_fraction(),
        }
    }

    /// What is left of a peak at the cycle's end.
    fn left_at_end(&self) -> f64 {
        (-(1.0 - self.rise_fraction) / self.decay_fraction).exp()
    }

    /// Mean of the cycle without variation above the base, K.
    fn mean_k(&self) -> f64 {
        let left = self.left_at_end();
        self.amplitude_k * (0.5 * self.rise_fraction * (1.0 + left) + self.decay_fraction * (1.0 - left))
    }

    fn cycle(&self, start_s: f64, from_k: f64, rng: &mut impl Rng) -> Cycle {
        let peak_k = self.amplitude_k * log_normal(self.amplitude_relative_std, rng);
        let period_s = log_normal(self.period_relative_std, rng) / self.frequency_hz;
        Cycle { start_s, period_s, from_k, peak_k }
    }

    /// Height above the base, K.
    fn at_k(&self, cycle: &Cycle, time_s: f64) -> f64 {
        let u = (time_s - cycle.start_s) / cycle.period_s;
        if u < self.rise_fraction {
            cycle.from_k + (cycle.peak_k - cycle.from_k) * smooth_step(u / self.rise_fraction)
        } else {
            cycle.peak_k * (-(u - self.rise_fraction) / self.decay_fraction).exp()
        }
    }

    pub(super) fn values_k(&self, grid: Grid, rng: &mut impl Rng) -> Vec<f64> {
        let mean_k = self.mean_k();
        let mut cycle = self.cycle(grid.time_s(0), self.amplitude_k * self.left_at_end(), rng);
        let mut next = move |time_s: f64| {
            while time_s >= cycle.start_s + cycle.period_s {
                let end_k = cycle.peak_k * self.left_at_end();
                cycle = self.cycle(cycle.start_s + cycle.period_s, end_k, rng);
            }
            self.at_k(&cycle, time_s) - mean_k
        };
        grid.times_s().map(&mut next).collect()
    }

    pub(super) fn check(&self, within: &str, resolution: Resolution) -> Result<(), SignalError> {
        positive(within, "amplitude_k", self.amplitude_k)?;
        positive(within, "frequency_hz", self.frequency_hz)?;
        for (name, std) in
            [("amplitude_relative_std", self.amplitude_relative_std), ("period_relative_std", self.period_relative_std)]
        {
            not_negative(within, name, std)?;
            between(within, name, std, 0.0, 1.0)?;
        }
        positive(within, "rise_fraction", self.rise_fraction)?;
        if self.rise_fraction >= 1.0 {
            let (field, value) = (path(within, "rise_fraction"), self.rise_fraction);
            return Err(SignalError::OutOfRange { field, value, low: 0.0, high: 1.0 });
        }
        positive(within, "decay_fraction", self.decay_fraction)?;
        let rise_s = self.rise_fraction / self.frequency_hz;
        resolution.check_rise(within, "frequency_hz", self.frequency_hz, rise_s)
    }
}

/// Log-normal with mean 1 and standard deviation `std`: `exp(σ ξ − σ²/2)`, `σ² = ln(1 + std²)`.
fn log_normal(std: f64, rng: &mut impl Rng) -> f64 {
    let variance = (std * std).ln_1p();
    let draw: f64 = rng.sample(StandardNormal);
    (variance.sqrt() * draw - 0.5 * variance).exp()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// A log-normal of relative standard deviation r has kurtosis `w⁴ + 2w³ + 3w² − 3`,
    /// `w = 1 + r²`, so the mean square about 1 has standard error `r² √((kurtosis − 1)/n)`; the
    /// mean `r/√n`. Four of each.
    #[test]
    fn cycles_vary_about_one_with_the_given_relative_deviation() {
        let (n, r) = (200_000, 0.2_f64);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let draws: Vec<f64> = (0..n).map(|_| log_normal(r, &mut rng)).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(n);
        let square = draws.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>() / f64::from(n);
        let w = 1.0 + r * r;
        let kurtosis = w.powi(4) + 2.0 * w.powi(3) + 3.0 * w.powi(2) - 3.0;
        let tol_mean = 4.0 * r / f64::from(n).sqrt();
        let tol_square = 4.0 * r * r * ((kurtosis - 1.0) / f64::from(n)).sqrt();
        assert!((mean - 1.0).abs() < tol_mean, "mean {mean}, want 1 ± {tol_mean:e}");
        assert!((square - r * r).abs() < tol_square, "variance {square}, want {} ± {tol_square:e}", r * r);
    }
}
