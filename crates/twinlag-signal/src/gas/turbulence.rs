//! Turbulence: Gaussian, with the one-sided spectrum `S(f) = S₀ min(1, (f/f_c)^(−5/3))` up to a
//! cutoff (the inertial range of a passive scalar: Obukhov 1949, Corrsin 1951), and none above it.
//!
//! A sum of sines at the multiples of `1/P` with Gaussian coefficients, of which the grid takes a
//! part: `P` is longer than the run by five periods of the corner, so that its end does not know
//! its start. The variances of the sines are scaled to add up to `std_k²`: the ensemble's standard
//! deviation is exact, for any record. `P` is a whole number of sample periods and the coefficients
//! are drawn from low to high frequencies, so they do not depend on the oversampling.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};
use twinlag_transform::{Complex64, Inverse};

use super::Resolution;
use crate::check::{below, positive};
use crate::grid::{self, Grid};
use crate::{Record, SignalError};

/// Gaussian random signal, its spectrum flat below a corner and falling as `f^(−5/3)` from there to
/// a cutoff.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turbulence {
    /// Standard deviation over the ensemble, K. One record shows less if it is not long against
    /// `1/corner_hz`.
    pub std_k: f64,
    /// Frequency above which the spectrum falls, Hz.
    pub corner_hz: f64,
    /// Highest frequency, Hz, above the corner.
    pub cutoff_hz: f64,
}

impl Turbulence {
    /// Sample periods in the synthesis period `P` of a run of `samples`: the next length with
    /// factors 2, 3, 5 only.
    fn period_samples(&self, samples: f64, sample_period_s: f64) -> f64 {
        let least = (samples + 5.0 / (self.corner_hz * sample_period_s)).ceil();
        let mut best = f64::INFINITY;
        let mut five = 1.0;
        while five < best {
            let mut odd = five;
            while odd < best {
                let length = odd * (least / odd).log2().ceil().max(0.0).exp2();
                // The logarithm may be a hair off: a length that is too short is left to the next
                // power of two.
                best = best.min(if length < least { 2.0 * length } else { length });
                odd *= 3.0;
            }
            five *= 5.0;
        }
        best
    }

    pub(super) fn values_k(&self, grid: Grid, rng: &mut impl Rng) -> Vec<f64> {
        let periods = self.period_samples(grid.samples() as f64, grid.sample_period_s());
        let length = periods as usize * grid.per_sample;
        let spacing_hz = 1.0 / (periods * grid.sample_period_s());
        // Bin 0 is the mean, which is given. A hair of tolerance: a cutoff on a bin includes it.
        let bins = (self.cutoff_hz / spacing_hz * (1.0 + 1e-12)) as usize;
        let shape = |bin: usize| (bin as f64 * spacing_hz / self.corner_hz).max(1.0).powf(-5.0 / 3.0);
        let scale = self.std_k * self.std_k / (1..=bins).map(shape).sum::<f64>();

        let inverse = Inverse::of(length);
        let mut spectrum = vec![Complex64::ZERO; inverse.bins()];
        for bin in 1..=bins {
            let (cosine, sine): (f64, f64) = (rng.sample(StandardNormal), rng.sample(StandardNormal));
            let std_k = (scale * shape(bin)).sqrt();
            // On a coarse grid (a held gas) high frequencies show as low ones; that keeps the
            // values and the variance.
            let (place, sign) = match bin % length {
                place if 2 * place <= length => (place, 1.0),
                place => (length - place, -1.0),
            };
            spectrum[place] += if place == 0 || 2 * place == length {
                Complex64::new(std_k * cosine, 0.0)
            } else {
                Complex64::new(0.5 * std_k * cosine, -0.5 * sign * std_k * sine)
            };
        }
        let mut values_k = inverse.transform(spectrum);
        values_k.truncate(grid.points);
        values_k
    }

    pub(super) fn check(&self, within: &str, resolution: Resolution, record: &Record) -> Result<(), SignalError> {
        positive(within, "std_k", self.std_k)?;
        positive(within, "corner_hz", self.corner_hz)?;
        positive(within, "cutoff_hz", self.cutoff_hz)?;
        below(within, "corner_hz", self.corner_hz, "cutoff_hz", self.cutoff_hz)?;
        resolution.check(within, "cutoff_hz", self.cutoff_hz, self.cutoff_hz)?;
        // The run-in is small beside the limit: it was checked with the record.
        let periods = self.period_samples(record.samples as f64, record.sample_period_s);
        grid::check_size(periods * record.oversampling as f64, "1/gas.corner_hz")?;
        grid::check_size(periods * record.sample_period_s * self.cutoff_hz, "gas.cutoff_hz")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: trial division of every number from the least allowed on.
    #[test]
    fn period_is_the_next_number_with_factors_two_three_and_five() {
        let smooth = |mut n: u32| {
            for factor in [2, 3, 5] {
                while n.is_multiple_of(factor) {
                    n /= factor;
                }
            }
            n == 1
        };
        let turbulence = Turbulence { std_k: 1.0, corner_hz: 5.0, cutoff_hz: 50.0 };
        for samples in 2..3000_u32 {
            let want = (samples + 1..=8192).find(|&n| smooth(n)).expect("8192 is one");
            assert_eq!(turbulence.period_samples(f64::from(samples), 1.0), f64::from(want), "samples {samples}");
        }
    }
}
