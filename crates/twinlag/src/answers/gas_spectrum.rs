//! The spectrum of the gas that a record shows, in bands: what a record to come may expect.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinlag_diagnose::Line;
use twinlag_transform::{Complex64, Tapered, hann};

use crate::bands::median;

/// Fewest samples of a usable spectrum.
const MIN_SAMPLES: usize = 64;
/// Ratio of the ends of a band: a sixth of an octave.
const BAND_RATIO: f64 = 1.122_462_048_309_373;
/// Share of the variance below which a band is left out.
const MIN_SHARE: f64 = 1e-9;
/// Part of a sample period by which a step may differ.
const MAX_UNEVEN_SHARE: f64 = 1e-3;

/// The power of a gas temperature in bands of a sixth of an octave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct GasSpectrum {
    /// Mean temperature, °C.
    #[serde(rename = "mean_C")]
    pub mean_c: f64,
    /// Bands in order of frequency. Their powers add up to the variance.
    pub bands: Vec<GasBand>,
}

/// The power of a gas temperature in a band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct GasBand {
    /// Mean frequency, each weighted by its power, Hz.
    pub frequency_hz: f64,
    /// Power, K².
    #[serde(rename = "power_K2")]
    pub power_k2: f64,
}

impl GasSpectrum {
    /// The spectrum of the longest evenly spaced part of a line, which never reaches from one record into the next: its tapered
    /// periodogram (Hann), bin by bin `2 |X|² / (n Σ w²)`, scaled so that all bands together have the variance of the values. `None`
    /// where values are missing or do not change in it, or are fewer than 64.
    ///
    /// ```
    /// use twinlag::GasSpectrum;
    /// use twinlag::diagnosis::Line;
    ///
    /// let mut line = Line::default();
    /// line.time_s = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
    /// line.value = line.time_s.iter().map(|t| 300.0 + 4.0 * (std::f64::consts::TAU * 2.0 * t).sin()).collect();
    /// let spectrum = GasSpectrum::of(&line).expect("even, and it changes");
    /// // Half the square of the amplitude; 20 whole periods, so that the variance is exact.
    /// let power_k2: f64 = spectrum.bands.iter().map(|band| band.power_k2).sum();
    /// assert!((spectrum.mean_c - 300.0).abs() < 1e-9 && (power_k2 - 8.0).abs() < 1e-9);
    /// // Hann's taper spreads a line over three bins of 0.1 Hz.
    /// let near = spectrum.bands.iter().filter(|band| (band.frequency_hz - 2.0).abs() < 0.21);
    /// assert!(near.map(|band| band.power_k2).sum::<f64>() > 0.999 * power_k2);
    /// ```
    pub fn of(line: &Line) -> Option<Self> {
        if line.time_s.len() != line.value.len() {
            return None;
        }
        let part = longest_even_part(&line.time_s);
        let (time_s, values) = (&line.time_s[part.clone()], &line.value[part]);
        let n = values.len();
        if n < MIN_SAMPLES || !values.iter().all(|v| v.is_finite()) {
            return None;
        }
        let period_s = (time_s[n - 1] - time_s[0]) / (n - 1) as f64;
        let mean_c = values.iter().sum::<f64>() / n as f64;
        let variance_k2 = values.iter().map(|v| (v - mean_c).powi(2)).sum::<f64>() / n as f64;
        let transform = Tapered::new(hann(n)).transform(values.iter().map(|v| v - mean_c));
        let power: Vec<f64> = transform.iter().map(Complex64::norm_sqr).collect();
        let total: f64 = power[1..].iter().sum();
        if !(variance_k2 > 0.0 && total > 0.0) {
            return None;
        }
        let to_hz = 1.0 / (n as f64 * period_s);
        let mut bands = Vec::new();
        let mut from = 1;
        while from < power.len() {
            let to = ((from as f64 * BAND_RATIO).ceil() as usize).clamp(from + 1, power.len());
            let sum: f64 = power[from..to].iter().sum();
            if sum > MIN_SHARE * total {
                let moment: f64 = (from..to).map(|bin| bin as f64 * power[bin]).sum();
                bands.push(GasBand { frequency_hz: to_hz * moment / sum, power_k2: variance_k2 * sum / total });
            }
            from = to;
        }
        Some(Self { mean_c, bands })
    }
}

/// The longest run of times whose steps are the median one.
fn longest_even_part(time_s: &[f64]) -> Range<usize> {
    let steps_s: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let period_s = median(steps_s.clone());
    let is_uneven = |step_s: &f64| (step_s - period_s).abs() > MAX_UNEVEN_SHARE * period_s;
    let (mut longest, mut from) = (0..0, 0);
    for part in steps_s.split(is_uneven) {
        let to = (from + part.len() + 1).min(time_s.len());
        if to - from > longest.len() {
            longest = from..to;
        }
        from = to;
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two records, one after the other: the longer one counts, at the end as at the beginning.
    #[test]
    fn the_longest_unbroken_part_counts() {
        let times = |from_s: f64, count: usize| (0..count).map(move |k| from_s + 0.01 * k as f64);
        let shorter_first: Vec<f64> = times(0.0, 80).chain(times(5.0, 120)).collect();
        assert_eq!(longest_even_part(&shorter_first), 80..200);
        let longer_first: Vec<f64> = times(0.0, 120).chain(times(0.5, 80)).collect();
        assert_eq!(longest_even_part(&longer_first), 0..120);
        assert_eq!(longest_even_part(&[]), 0..0);
    }
}
