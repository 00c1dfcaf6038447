//! A fit as a picture needs it: lines thinned to what can be drawn, and numbers of the whole residual.

use std::ops::Range;

use crate::blocks;
use crate::correlation::autocorrelation;
use crate::fit::Fitted;
use crate::implied::Details;
use crate::instants::Instants;
use crate::observations::Observations;
use crate::policy::Policy;
use crate::selection::{Selection, ranges};
use crate::spectrum::Bands;

/// Points of a line that is kept whole: no screen has as many, and a twentieth of them is enlarged to its width.
const MAX_POINTS: usize = 65_536;
/// Parts of the record whose mean squares are shown.
const SHOWN_PARTS: usize = 100;
/// Parts of the record of which the one with most of the residual is named.
const NAMED_PARTS: usize = 10;
/// Lags of the autocorrelation: twice those of the test of whiteness, so that what follows them is seen as well.
const LAGS: usize = 40;
/// Order statistics at either end that are all kept, and those between them.
const EXTREMES: usize = 30;
const BETWEEN: usize = 140;

/// Values over time.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Line {
    /// Instants, s, rising.
    pub time_s: Vec<f64>,
    /// The values; NaN in a gap of a line that was thinned.
    pub value: Vec<f64>,
}

impl Line {
    /// All values, or of more than 65 536 the smallest and the largest of as many neighbours as leave so many; a stretch begins
    /// with NaN then, but for the first.
    ///
    /// - `stretches`: their places among the values
    pub(crate) fn thinned(time_s: &Instants, value: &[f64], stretches: impl Iterator<Item = Range<usize>>) -> Self {
        if value.len() <= MAX_POINTS {
            return Self { time_s: time_s.iter().collect(), value: value.to_vec() };
        }
        let together = value.len().div_ceil(MAX_POINTS / 2);
        let mut out = Self::default();
        for Range { start, end } in stretches.filter(|stretch| !stretch.is_empty()) {
            if !out.value.is_empty() {
                out.push(time_s.at(start), f64::NAN);
            }
            for first in (start..end).step_by(together) {
                let neighbours = first..(first + together).min(end);
                let by_value = |a: &usize, b: &usize| value[*a].total_cmp(&value[*b]);
                let extremes = [neighbours.clone().min_by(by_value), neighbours.max_by(by_value)];
                let [one, other] = extremes.map(|k| k.expect("a neighbour"));
                out.push(time_s.at(one.min(other)), value[one.min(other)]);
                if one != other {
                    out.push(time_s.at(one.max(other)), value[one.max(other)]);
                }
            }
        }
        out
    }

    fn push(&mut self, time_s: f64, value: f64) {
        self.time_s.push(time_s);
        self.value.push(value);
    }
}

/// Neighbouring residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ResidualPart {
    /// First and last instant, s.
    pub ends_s: [f64; 2],
    /// How many there are.
    pub count: usize,
    /// Their mean square.
    pub mean_square: f64,
}

impl ResidualPart {
    fn of(time_s: &Instants, residual: &[f64], range: Range<usize>) -> Self {
        let (ends_s, count) = ([time_s.at(range.start), time_s.at(range.end - 1)], range.len());
        Self { ends_s, count, mean_square: residual[range].iter().map(|r| r * r).sum::<f64>() / count as f64 }
    }
}

/// A fit as a picture needs it.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Trace {
    /// Whitened residual; of a long record its smallest and largest values.
    pub residual: Line,
    /// Estimated gas temperature, °C: both inferred inputs together, without the frequencies in which there is only noise. Of a
    /// long record its smallest and largest values.
    pub gas_c: Line,
    /// The residual in hundredths of the record, equal but for the last.
    pub parts: Vec<ResidualPart>,
    /// The tenth of the record with most of the residual.
    pub worst: Option<ResidualPart>,
    /// Samples with a residual that are of the blocks that judge, counted through the stretches, in order.
    pub judged: Vec<Range<usize>>,
    /// Root mean square of what the gas temperature differs from the reading of the faster sensor, where that is there, K.
    pub gas_change_k: f64,
    /// Power of the residual in bands: frequency in Hz, power, degrees of freedom.
    pub bands: Vec<[f64; 3]>,
    /// Autocorrelation of the residual at lags of 0, 1, 2, … samples: 1 at none.
    pub autocorrelation: Vec<f64>,
    /// Order statistics of the residual: rank from 1, and value; the extremes all, of the others as many as a picture shows.
    pub order_statistics: Vec<(usize, f64)>,
    /// How many residuals there are.
    pub count: usize,
}

impl Trace {
    /// The trace without the bands.
    ///
    /// - `details`: of the fitted model, which keep no inferred inputs
    pub(crate) fn of(
        fitted: &Fitted,
        details: &mut Details,
        observations: &Observations,
        selection: &Selection,
        policy: &Policy,
    ) -> Self {
        let is_judge = |s: usize| selection.holds(s) && blocks::is_judge(s, observations.samples(), policy);
        let gas_c = crate::residual::estimated_gas(fitted, &mut details.parts[..], observations);
        let (time_s, residual, n) = (&details.time_s, &details.residual[..], details.residual.len());
        let size = n.div_ceil(SHOWN_PARTS).max(1);
        let parts = (0..n).step_by(size).map(|from| ResidualPart::of(time_s, residual, from..(from + size).min(n)));
        Self {
            parts: parts.collect(),
            worst: worst(time_s, residual),
            residual: Line::thinned(time_s, residual, details.stretches()),
            judged: ranges(details.sample().filter(|s| is_judge(*s))),
            gas_change_k: gas_change_k(fitted, details.sample(), &gas_c, observations),
            gas_c: Line::thinned(time_s, &gas_c, details.stretches()),
            bands: Vec::new(),
            autocorrelation: normalised(autocorrelation(residual, LAGS.min(n.saturating_sub(1) / 4))),
            order_statistics: order_statistics(residual),
            count: n,
        }
    }

    /// This trace with the bands of its residual.
    pub(crate) fn with_bands(self, bands: &Bands, observations: &Observations) -> Self {
        let to_hz = 1.0 / (std::f64::consts::TAU * observations.step_s());
        Self { bands: bands.0.iter().map(|b| [b.omega * to_hz, b.power(), b.dof()]).collect(), ..self }
    }
}

/// An autocorrelation over its value at no lag; nothing of a series without energy.
fn normalised(values: Vec<f64>) -> Vec<f64> {
    let Some(energy) = values.first().copied().filter(|energy| *energy > 0.0) else { return Vec::new() };
    values.into_iter().map(|value| value / energy).collect()
}

/// Ranks with their values, as [`Trace::order_statistics`] has them.
fn order_statistics(residual: &[f64]) -> Vec<(usize, f64)> {
    let mut sorted = residual.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    let inner = EXTREMES.min(n)..n.saturating_sub(EXTREMES);
    let step = inner.len().div_ceil(BETWEEN).max(1);
    let kept = (0..inner.start).chain(inner.clone().step_by(step)).chain(inner.end.max(inner.start)..n);
    kept.map(|k| (k + 1, sorted[k])).collect()
}

/// The one of [`NAMED_PARTS`] parts, equal but for a value, with the largest mean square; `None` of no values.
fn worst(time_s: &Instants, residual: &[f64]) -> Option<ResidualPart> {
    let n = residual.len();
    let parts = (0..NAMED_PARTS).map(|i| i * n / NAMED_PARTS..(i + 1) * n / NAMED_PARTS);
    let parts = parts.filter(|part| !part.is_empty()).map(|part| ResidualPart::of(time_s, residual, part));
    parts.max_by(|a, b| a.mean_square.total_cmp(&b.mean_square))
}

/// Root mean square of what the gas temperature differs from the reading of the faster sensor, where that is there, K.
///
/// - `sample`: the sample of each gas temperature, rising
fn gas_change_k(
    fitted: &Fitted,
    sample: impl Iterator<Item = usize>,
    gas_c: &[f64],
    observations: &Observations,
) -> f64 {
    let faster = usize::from(fitted.theta[1] < fitted.theta[0]);
    let readings = observations.stretches.iter().flat_map(|s| s.reading_c[faster].iter().zip(&s.masked[faster]));
    let mut readings = readings.enumerate();
    let there = sample.zip(gas_c).filter_map(|(sample, gas_c)| {
        let (_, (reading_c, is_masked)) = readings.find(|(k, _)| *k == sample)?;
        (!is_masked).then_some(gas_c - reading_c)
    });
    let (sum, count) = there.fold((0.0, 0.0_f64), |(sum, n), change_k| (sum + change_k.powi(2), n + 1.0));
    (sum / count.max(1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts are tenths whatever the length: the last few values are no part of their own.
    #[test]
    fn the_worst_part_is_a_tenth() {
        let worst_of = |residual: Vec<f64>| {
            let time_s: Vec<f64> = (0..residual.len()).map(|k| k as f64).collect();
            worst(&time_s.into(), &residual).map(|part| (part.ends_s, part.count))
        };
        let mut residual = vec![1.0; 1009];
        residual[1008] = 3.0;
        residual[300..400].fill(2.0);
        assert_eq!(worst_of(residual), Some(([302.0, 402.0], 101)));
        assert_eq!(worst_of(vec![1.0, 2.0]).map(|(_, count)| count), Some(1));
        assert_eq!(worst_of(Vec::new()), None);
    }

    /// White noise that flips its sign each time has the autocorrelation ±1, and its ranks are all there, in order.
    #[test]
    fn autocorrelation_and_order_statistics_are_of_the_whole_residual() {
        let residual: Vec<f64> = (0..1000).map(|k| if k % 2 == 0 { 2.0 } else { -2.0 }).collect();
        let of_lags = normalised(autocorrelation(&residual, 3));
        for (lag, got) in of_lags.iter().enumerate() {
            // Lag m has n − m products.
            let want = (1.0 - lag as f64 / 1000.0) * if lag % 2 == 0 { 1.0 } else { -1.0 };
            assert!((got - want).abs() < 1e-12, "{got} at {lag}, not {want}");
        }
        assert!(normalised(vec![0.0; 4]).is_empty());
        for n in [0, 1, 59, 60, 61, 1000] {
            let falling: Vec<f64> = (0..n).map(|k| (n - k) as f64).collect();
            let kept = order_statistics(&falling);
            assert!(kept.iter().all(|(rank, value)| *rank as f64 == *value), "{n}");
            assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0) && kept.len() <= 2 * EXTREMES + BETWEEN, "{n}");
            assert_eq!(kept.first().map(|k| k.0).zip(kept.last().map(|k| k.0)), (n > 0).then_some((1, n)));
        }
    }

    /// Every extreme of a hundredth of a long line is in the thinned one, at its instant; a short line is kept as it is.
    #[test]
    fn a_long_line_keeps_its_extremes_and_its_gaps() {
        let n = 3 * MAX_POINTS + 17;
        let time_s: Vec<f64> = (0..n).map(|k| if k < 70_000 { k as f64 } else { k as f64 + 500.0 }).collect();
        let value: Vec<f64> = (0..n).map(|k| ((k * k * 7 + k) as f64 * 2.399).sin()).collect();
        let line = Line::thinned(&time_s.clone().into(), &value, [0..70_000, 70_000..n].into_iter());
        assert!(line.value.len() <= MAX_POINTS + 2, "{}", line.value.len());
        assert!(line.time_s.is_sorted());
        let points: Vec<(u64, u64)> =
            line.time_s.iter().zip(&line.value).map(|(t, v)| (t.to_bits(), v.to_bits())).collect();
        for (time_s, value) in time_s.chunks(n / 100).zip(value.chunks(n / 100)) {
            let order = |a: &usize, b: &usize| value[*a].total_cmp(&value[*b]);
            for k in [(0..value.len()).min_by(order), (0..value.len()).max_by(order)].map(|k| k.expect("a value")) {
                assert!(points.contains(&(time_s[k].to_bits(), value[k].to_bits())), "{} at {}", value[k], time_s[k]);
            }
        }
        let gaps: Vec<f64> = line.time_s.iter().zip(&line.value).filter(|(_, v)| v.is_nan()).map(|(t, _)| *t).collect();
        assert_eq!(gaps, [70_500.0]);
        let short = Line::thinned(&time_s[..900].to_vec().into(), &value[..900], std::iter::once(0..900));
        assert_eq!((&short.time_s[..], &short.value[..]), (&time_s[..900], &value[..900]));
    }
}
