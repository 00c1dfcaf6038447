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
    /// Bands in order of frequency. Their powers add up to the variance within the parts of the record, each weighted by its samples.
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
    /// The spectrum of the evenly spaced parts of a line, none of which reaches from one record into the next: the mean of their tapered
    /// periodograms (Hann), each weighted by the number of its values. That of a part is, bin by bin, `2 |X|² / (n Σ w²)`, scaled so that
    /// all bands together have the variance of its values. `None` if no part has at least 64 values, all of them there, that change.
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
        let all = even_parts(&line.time_s).into_iter();
        let parts: Vec<Part> = all.filter_map(|rows| Part::of(&line.time_s[rows.clone()], &line.value[rows])).collect();
        let longest = parts.iter().max_by_key(|part| part.count)?;
        let count: usize = parts.iter().map(|part| part.count).sum();
        let weighted_sum = |of: fn(&Part) -> f64| parts.iter().map(|part| part.count as f64 * of(part)).sum::<f64>();
        let variance_k2 = weighted_sum(|part| part.power_k2.iter().sum()) / count as f64;
        let edges = band_edges(longest.power_k2.len());
        // Power and its first moment over frequency.
        let mut sums = vec![(0.0, 0.0); edges.len()];
        for part in &parts {
            let weight = part.count as f64 / count as f64;
            for (bin, power_k2) in part.power_k2.iter().enumerate().skip(1) {
                let frequency_hz = bin as f64 / part.length_s;
                // Bins of a shorter part are further apart. Rounded, since that of the longest is whole.
                let bin_of_longest = (frequency_hz * longest.length_s).round() as usize;
                let (power, moment) = &mut sums[edges.partition_point(|edge| *edge <= bin_of_longest) - 1];
                *power += weight * power_k2;
                *moment += weight * power_k2 * frequency_hz;
            }
        }
        let is_shown = |(power_k2, _): &(f64, f64)| *power_k2 > MIN_SHARE * variance_k2;
        let band = |(power_k2, moment): (f64, f64)| GasBand { frequency_hz: moment / power_k2, power_k2 };
        let bands = sums.into_iter().filter(is_shown).map(band).collect();
        Some(Self { mean_c: weighted_sum(|part| part.mean_c) / count as f64, bands })
    }
}

/// An evenly spaced part of a line.
struct Part {
    count: usize,
    /// As many sample periods as it has values, s.
    length_s: f64,
    mean_c: f64,
    /// Power of each bin of the transform, K², from frequency 0, whose power is set to 0: the mean was removed.
    power_k2: Vec<f64>,
}

impl Part {
    /// `None` where values are too few, are missing, or do not change.
    fn of(time_s: &[f64], values: &[f64]) -> Option<Self> {
        let n = values.len();
        if n < MIN_SAMPLES || !values.iter().all(|v| v.is_finite()) {
            return None;
        }
        let mean_c = values.iter().sum::<f64>() / n as f64;
        let variance_k2 = values.iter().map(|v| (v - mean_c).powi(2)).sum::<f64>() / n as f64;
        let transform = Tapered::new(hann(n)).transform(values.iter().map(|v| v - mean_c));
        let mut power_k2: Vec<f64> = transform.iter().map(Complex64::norm_sqr).collect();
        power_k2[0] = 0.0;
        let total: f64 = power_k2.iter().sum();
        if !(variance_k2 > 0.0 && total > 0.0) {
            return None;
        }
        power_k2.iter_mut().for_each(|power| *power *= variance_k2 / total);
        let length_s = n as f64 * (time_s[n - 1] - time_s[0]) / (n - 1) as f64;
        Some(Self { count: n, length_s, mean_c, power_k2 })
    }
}

/// The first bins of bands of a sixth of an octave, or of one bin where that is wider.
fn band_edges(bins: usize) -> Vec<usize> {
    let next = |from: &usize| Some(((*from as f64 * BAND_RATIO).ceil() as usize).max(from + 1));
    std::iter::successors(Some(1), next).take_while(|from| *from < bins).collect()
}

/// The runs of times whose steps are the median one.
fn even_parts(time_s: &[f64]) -> Vec<Range<usize>> {
    let steps_s: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let period_s = median(steps_s.clone());
    let is_uneven = |step_s: &f64| (step_s - period_s).abs() > MAX_UNEVEN_SHARE * period_s;
    let mut from = 0;
    let part = |steps: &[f64]| {
        let to = (from + steps.len() + 1).min(time_s.len());
        std::mem::replace(&mut from, to)..to
    };
    steps_s.split(is_uneven).map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of sines of 2 Hz, one record after the other with a pause.
    ///
    /// - `records`: of each its samples, every 0.01 s, and its amplitude, K
    fn line(records: &[(u32, f64)]) -> Line {
        let mut line = Line::default();
        let mut from_s = 0.0;
        for &(samples, amplitude_k) in records {
            let time_s: Vec<f64> = (0..samples).map(|k| from_s + 0.01 * f64::from(k)).collect();
            line.value.extend(
                time_s.iter().map(|t| 300.0 + amplitude_k * (std::f64::consts::TAU * 2.0 * (t - from_s)).sin()),
            );
            line.time_s.extend(time_s);
            from_s += 0.01 * f64::from(samples) + 5.0;
        }
        line
    }

    /// Each record counts by its length, in whatever order: of 20 and 40 periods, `(20 · 2²/2 + 40 · 6²/2) / 60`. One of fewer than 64 samples,
    /// and one with a value that is missing, count nothing.
    #[test]
    fn all_records_count() {
        for records in [[(1000, 2.0), (2000, 6.0)], [(2000, 6.0), (1000, 2.0)]] {
            let mut line = line(&[&records[..], &[(50, 9.0), (100, 9.0)]].concat());
            *line.value.last_mut().expect("there are some") = f64::NAN;
            let spectrum = GasSpectrum::of(&line).expect("even, and it changes");
            let power_k2: f64 = spectrum.bands.iter().map(|band| band.power_k2).sum();
            // Rounding of values of 300 K moves squares of 6 K by less than 1e-12.
            assert!((power_k2 - 38.0 / 3.0).abs() < 1e-9, "{power_k2}");
            // Hann's taper spreads a line over three bins, of 0.1 Hz in the shorter record.
            let shown = spectrum.bands.iter().filter(|band| band.power_k2 > 1e-6);
            assert!(shown.clone().all(|band| (band.frequency_hz - 2.0).abs() < 0.11));
        }
    }

    /// Bins of the longer record are half as wide, and so may be the bands, in whatever order.
    #[test]
    fn bands_are_those_of_the_longest_part() {
        let bands = |records: &[(u32, f64)]| {
            let mut line = line(records);
            // Single readings, whose power is spread over all bins.
            [700, 1700, 2400].into_iter().for_each(|row| line.value[row] += 1.0);
            let bands = GasSpectrum::of(&line).expect("even, and it changes").bands;
            bands.iter().map(|band| band.frequency_hz).collect::<Vec<f64>>()
        };
        let [forth, back] = [bands(&[(1000, 2.0), (2000, 6.0)]), bands(&[(2000, 6.0), (1000, 2.0)])];
        assert_eq!(forth.len(), back.len());
        // The first two bins of 20 s, of which a band holds one each.
        for of in [&forth, &back] {
            assert!((of[0] - 0.05).abs() < 0.01 && (of[1] - 0.1).abs() < 0.01, "{of:?}");
        }
    }

    #[test]
    fn steps_that_differ_end_a_part() {
        let times = |from_s: f64, count: usize| (0..count).map(move |k| from_s + 0.01 * k as f64);
        let time_s: Vec<f64> = times(0.0, 80).chain(times(5.0, 120)).collect();
        assert_eq!(even_parts(&time_s), [0..80, 80..200]);
        assert!(even_parts(&[]).iter().all(Range::is_empty));
    }
}
