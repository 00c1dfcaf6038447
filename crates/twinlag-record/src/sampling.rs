//! How the stamps lie in time. An estimator needs the steps between samples; stamps are rounded,
//! jitter, and skip.
//!
//! Model: within a run without gaps `t[k] = t0 + k P + e[k]`; `P` by least squares over all runs,
//! each with its own `t0`. That averages rounding away: stamps of a 24 Hz logger rounded to 10 µs
//! give 1/24 s to many digits.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::selection::SamplingChoice;

/// What the stamps are taken to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SamplingKind {
    /// Every step is the period, within a hundredth of it or the grid that stamps are printed on.
    Uniform,
    /// Stamps lie on a grid that is coarse beside the period, and steps differ by one unit of it,
    /// as 3 s and 4 s with stamps of 1 s: the samples are taken as evenly spaced.
    Rounded,
    /// Steps differ: each is used as stamped.
    Irregular,
}

/// How the stamps lie in time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampling {
    /// Slope of the least-squares line through the stamps, gaps taken out; the median step if
    /// irregular.
    pub period_s: f64,
    /// Root mean square departure of the stamps from the line. A slow drift of the clock counts
    /// too.
    pub jitter_s: f64,
    /// Largest departure of a stamp from the line.
    pub largest_departure_s: f64,
    /// The grid that the stamps lie on, if any: the coarsest power of ten (or common divisor of the
    /// steps) of the file's time unit that divides them all; the last digit of the largest stamp
    /// where all are printed to one number of significant digits.
    pub stamp_resolution_s: Option<f64>,
    /// What they are taken to be.
    pub kind: SamplingKind,
}

/// A beat is at least one in so many steps: a logger's period is not off its clock's unit by less.
const MAX_STEPS_PER_BEAT: usize = 50;
/// Significant digits of a stamp, at most: those of more are not rounded to any number of them.
const MAX_DIGITS: i32 = 12;
/// Departure, in periods, below which stamps count as even.
const EXACT_PERIODS: f64 = 0.01;

impl Sampling {
    /// The step beyond which two rows do not belong together: 1.5 periods and the rounding of two
    /// stamps if evenly spaced, 5 median steps if irregular.
    pub fn gap_s(&self) -> f64 {
        match self.kind {
            SamplingKind::Irregular => 5.0 * self.period_s,
            _ => 1.5 * self.period_s + self.rounding_s(),
        }
    }

    /// How much longer than true a step may seem: less than one unit of the grid, if that is finer
    /// than the period and stamps depart from even ones at all.
    fn rounding_s(&self) -> f64 {
        let is_exact = self.kind == SamplingKind::Uniform && self.largest_departure_s <= EXACT_PERIODS * self.period_s;
        self.stamp_resolution_s.filter(|&unit_s| unit_s < self.period_s && !is_exact).unwrap_or(0.0)
    }
}

/// Judges stamps: at least two, strictly increasing.
///
/// - `time_s`: the stamps
/// - `unit_s`: the time unit that they were printed in, if they were
pub(crate) fn judge(time_s: &[f64], unit_s: Option<f64>, choice: SamplingChoice) -> Sampling {
    let steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let median = median(&steps);
    let grid = unit_s.and_then(|unit_s| grid(time_s, &steps, unit_s));
    let may_be_rounded = |unit: &f64| *unit < median * 1.5 && !are_skips(&steps, median);
    let rounding = grid.filter(may_be_rounded).unwrap_or(0.0);
    let limit = 1.5 * median + rounding;
    let (low, high) = steps
        .iter()
        .filter(|&&step| step <= limit)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), &step| (low.min(step), high.max(step)));
    let skips = steps.iter().filter(|&&step| step > limit).count();

    let even = line(time_s, limit);
    let period = even.slope_s;
    // With more skips than one in twenty a record cut at each would be in shreds: then steps count
    // as stamped.
    let is_whole = 20 * skips <= steps.len();
    let is_uniform = high - period <= 0.01 * period && period - low <= 0.01 * period;
    let is_rounded = grid.is_some_and(|unit| high - low <= 1.01 * unit && is_steady(time_s, limit, period, unit));
    let kind = match choice {
        SamplingChoice::Uniform => SamplingKind::Uniform,
        SamplingChoice::Auto if is_whole && is_uniform => SamplingKind::Uniform,
        SamplingChoice::Auto if is_whole && is_rounded => SamplingKind::Rounded,
        SamplingChoice::AsStamped | SamplingChoice::Auto => SamplingKind::Irregular,
    };
    let (line, period_s) = match kind {
        SamplingKind::Irregular => (line(time_s, 5.0 * median), median),
        _ => (even, period),
    };
    let Line { jitter_s, largest_departure_s, .. } = line;
    Sampling { period_s, jitter_s, largest_departure_s, stamp_resolution_s: grid, kind }
}

/// Whether the longer ones of `steps` are rows that were skipped: multiples of the median step,
/// which do not come in the even beat of a period that is a little longer than the unit it is
/// rounded to.
fn are_skips(steps: &[f64], median: f64) -> bool {
    if steps.iter().any(|step| off_grid(step / median) > EXACT_PERIODS) {
        return false;
    }
    let long: Vec<usize> = steps.iter().enumerate().filter(|(_, step)| **step > 1.5 * median).map(|(k, _)| k).collect();
    let between = || long.windows(2).map(|pair| pair[1] - pair[0]);
    let is_even = between().max().unwrap_or(0) - between().min().unwrap_or(0) <= 1;
    let is_beat = long.len() > 2 && is_even && steps.len() < MAX_STEPS_PER_BEAT * long.len();
    !long.is_empty() && !is_beat
}

/// A clock whose rate changes is not merely rounded: over blocks of 64 steps the mean step must
/// stay within 2 % and the rounding of the two stamps at the block's ends.
fn is_steady(time_s: &[f64], limit_s: f64, period_s: f64, unit_s: f64) -> bool {
    runs(time_s, limit_s).all(|run| {
        let time_s = &time_s[run];
        time_s.windows(65).step_by(64).all(|block| {
            let mean = (block[64] - block[0]) / 64.0;
            (mean - period_s).abs() <= 0.02 * period_s + 2.0 * unit_s / 64.0
        })
    })
}

fn median(steps: &[f64]) -> f64 {
    let mut sorted = steps.to_vec();
    let middle = sorted.len() / 2;
    *sorted.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Runs of rows whose steps are not longer than the limit.
pub(crate) fn runs(time_s: &[f64], limit_s: f64) -> impl Iterator<Item = Range<usize>> {
    let mut start = 0;
    (1..=time_s.len()).filter_map(move |end| {
        let ends = end == time_s.len() || time_s[end] - time_s[end - 1] > limit_s;
        ends.then(|| std::mem::replace(&mut start, end)..end)
    })
}

struct Line {
    slope_s: f64,
    jitter_s: f64,
    largest_departure_s: f64,
}

/// One slope through all runs, an intercept for each. The sums are over departures from a first
/// guess of the slope: of the stamps themselves they would lose half the digits in a million rows.
fn line(time_s: &[f64], limit_s: f64) -> Line {
    let (mut length_s, mut steps) = (0.0, 0);
    for run in runs(time_s, limit_s) {
        length_s += time_s[run.end - 1] - time_s[run.start];
        steps += run.len() - 1;
    }
    let guess_s = length_s / steps as f64;
    // Of each row of a run: its place from the middle, its departure from the guess less the run's
    // mean departure.
    let departures = |run: Range<usize>| {
        let (first, middle) = (time_s[run.start], (run.len() - 1) as f64 / 2.0);
        let rest = move |(k, t): (usize, &f64)| t - first - k as f64 * guess_s;
        let mean = time_s[run.clone()].iter().enumerate().map(rest).sum::<f64>() / run.len() as f64;
        time_s[run].iter().enumerate().map(move |(k, t)| (k as f64 - middle, rest((k, t)) - mean))
    };
    let (mut kr, mut kk) = (0.0, 0.0);
    for (k, rest) in runs(time_s, limit_s).flat_map(departures) {
        kr += k * rest;
        kk += k * k;
    }
    let correction_s = kr / kk;
    let (mut squares, mut largest) = (0.0, 0.0_f64);
    for (k, rest) in runs(time_s, limit_s).flat_map(departures) {
        let departure = rest - k * correction_s;
        squares += departure * departure;
        largest = largest.max(departure.abs());
    }
    let jitter_s = (squares / time_s.len() as f64).sqrt();
    Line { slope_s: guess_s + correction_s, jitter_s, largest_departure_s: largest }
}

/// The grid of the stamps. A stamp may miss its grid point by a hundredth of the unit: differences
/// of large stamps do.
fn grid(time_s: &[f64], steps: &[f64], unit_s: f64) -> Option<f64> {
    let first = *time_s.first()?;
    let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let power = (-9..=6).rev().map(|exponent| 10_f64.powi(exponent)).find(|power| {
        let unit = power * unit_s;
        // A grid coarser than the shortest step would repeat stamps.
        unit <= 1.001 * shortest && time_s.iter().all(|t| off_grid((t - first) / unit) < 0.01)
    })?;
    let unit = power * unit_s;
    if let Some(coarsest) = last_digit(time_s, unit_s).filter(|last| *last > unit && *last <= shortest) {
        return Some(coarsest);
    }
    let common = steps.iter().map(|step| (step / unit).round() as u64).fold(0, divisor);
    let shortest = (shortest / unit).round() as u64;
    // Where all steps are multiples of the shortest one the divisor is the sampling, not the clock.
    Some(if common < shortest { unit * common.max(1) as f64 } else { unit })
}

/// The last digit of the largest stamp, where all are printed to one number of significant digits:
/// seven of them give 0.04167 s and 1049.958 s.
fn last_digit(time_s: &[f64], unit_s: f64) -> Option<f64> {
    let exponent = |stamp: f64| stamp.abs().log10().floor() as i32;
    let digits =
        |stamp: f64| (1..=MAX_DIGITS).find(|digits| off_grid(stamp / 10_f64.powi(exponent(stamp) + 1 - digits)) < 0.01);
    let stamps = || time_s.iter().map(|t| t / unit_s).filter(|stamp| *stamp != 0.0);
    let most = stamps().map(digits).try_fold(0, |most, digits| Some(digits?.max(most)))?;
    let largest = stamps().map(exponent).max()?;
    Some(10_f64.powi(largest + 1 - most) * unit_s)
}

fn off_grid(position: f64) -> f64 {
    // Beyond 2^43 the fraction of a double is no better than a thousandth.
    if position.abs() > 8e12 { 1.0 } else { (position - position.round()).abs() }
}

fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn auto(time_s: &[f64]) -> Sampling {
        judge(time_s, Some(1.0), SamplingChoice::Auto)
    }

    /// Rounding to q leaves errors of standard deviation q/√12, so the slope over n points has
    /// (q/√12) √12 n^-3/2 = 5e-12 s at most for n = 16 000: ten of these are 5e-11 s.
    #[test]
    fn rounded_stamps_of_a_24_hz_logger_give_its_period_to_many_digits() {
        let time_s: Vec<f64> = (0..16_000).map(|k| (f64::from(k) / 24.0 * 1e5).round() / 1e5).collect();
        let got = auto(&time_s);
        assert_eq!(got.kind, SamplingKind::Uniform);
        assert!((got.period_s - 1.0 / 24.0).abs() < 5e-11, "got {}, want {}", got.period_s, 1.0 / 24.0);
        assert!(got.largest_departure_s < 6e-6, "got {}, want half a unit, 5e-6", got.largest_departure_s);
        assert!((got.stamp_resolution_s.unwrap() - 1e-5).abs() < 1e-12);
    }

    /// Seven significant digits leave milliseconds after 1000 s, which are more than a hundredth of the period. The slope has
    /// less than their (q/√12) √12 n^-3/2 = 2.5e-10 s: ten of these are 2.5e-9 s.
    #[test]
    fn stamps_of_seven_significant_digits_are_rounded_even_sampling() {
        let rounded = |t: f64| format!("{t:.6e}").parse::<f64>().expect("a number that was just printed");
        let time_s: Vec<f64> = (0..25_200).map(|k| rounded(f64::from(k) / 24.0)).collect();
        let got = auto(&time_s);
        assert_eq!(got.kind, SamplingKind::Rounded);
        assert!((got.period_s - 1.0 / 24.0).abs() < 2.5e-9, "got {}, want {}", got.period_s, 1.0 / 24.0);
        assert!((got.stamp_resolution_s.unwrap() - 1e-3).abs() < 1e-12);
    }

    /// 3.86 s with stamps cut to whole seconds: steps of 3 and 4 s. The slope's error is below the
    /// unit over the length.
    #[test]
    fn steps_of_three_and_four_seconds_are_rounded_even_sampling() {
        let time_s: Vec<f64> = (0..2000).map(|k| (f64::from(k) * 3.86).floor()).collect();
        let got = auto(&time_s);
        assert_eq!((got.kind, got.stamp_resolution_s), (SamplingKind::Rounded, Some(1.0)));
        assert!((got.period_s - 3.86).abs() < 1.0 / 2000.0, "got {}", got.period_s);
        assert!(got.largest_departure_s <= 1.0, "got {}", got.largest_departure_s);
    }

    #[test]
    fn a_clock_that_changes_its_rate_is_irregular_not_rounded() {
        let mut time_s = vec![0.0];
        for k in 0..2000 {
            time_s.push(time_s[k] + if k < 1000 { 3.0 } else { 4.0 });
        }
        assert_eq!(auto(&time_s).kind, SamplingKind::Irregular);
    }

    #[test]
    fn steps_of_five_ten_and_twenty_seconds_are_irregular() {
        let mut time_s = vec![0.0];
        for k in 0..300 {
            time_s.push(time_s[k] + [5.0, 10.0, 20.0, 10.0][k % 4]);
        }
        let got = auto(&time_s);
        assert_eq!((got.kind, got.period_s), (SamplingKind::Irregular, 10.0));
    }

    /// A period that is itself a unit of the clock: rows are missing, one at a time, and stamps are
    /// as exact as before.
    #[test]
    fn single_missing_rows_are_gaps_whatever_the_period() {
        for (period_s, places) in [(0.01, 2), (0.02, 2), (0.005, 3), (1.0, 0)] {
            let round = |t: f64| format!("{t:.places$}").parse::<f64>().unwrap();
            let missing = [100, 190, 313];
            for count in 1..=3 {
                let left = (0..500).filter(|k| !missing[..count].contains(k));
                let time_s: Vec<f64> = left.map(|k| round(f64::from(k) * period_s)).collect();
                let got = auto(&time_s);
                assert_eq!(got.kind, SamplingKind::Uniform, "{period_s} s, {count} missing");
                assert!((got.period_s - period_s).abs() < 1e-12 * period_s, "got {}, want {period_s}", got.period_s);
                assert_eq!(runs(&time_s, got.gap_s()).count(), count + 1, "{period_s} s");
            }
        }
    }

    /// 1.04 s in whole seconds: every 25th step is 2 s, which is a beat and no gap.
    #[test]
    fn a_beat_of_longer_steps_is_rounding() {
        let time_s: Vec<f64> = (0..2000).map(|k| (f64::from(k) * 1.04).floor()).collect();
        let got = auto(&time_s);
        assert_eq!(got.kind, SamplingKind::Rounded);
        assert!((got.period_s - 1.04).abs() < 1.0 / 2000.0, "got {}", got.period_s);
    }

    #[test]
    fn skipped_samples_do_not_bend_the_line() {
        let time_s: Vec<f64> = (0..500).filter(|k| !(100..110).contains(k)).map(|k| f64::from(k) * 0.002).collect();
        let got = auto(&time_s);
        assert_eq!(got.kind, SamplingKind::Uniform);
        assert!((got.period_s - 0.002).abs() < 1e-14, "got {}", got.period_s);
        assert_eq!(runs(&time_s, got.gap_s()).collect::<Vec<_>>(), [0..100, 100..490]);
    }

    /// A stamp of up to 2000 s is a double to 2.3e-13 s, and so is its difference from the line:
    /// four of these.
    #[test]
    fn a_million_exact_stamps_depart_by_rounding_alone() {
        let time_s: Vec<f64> = (0..1_000_000).map(|k| f64::from(k) / 500.0).collect();
        let got = auto(&time_s);
        assert!(got.largest_departure_s < 1e-12, "got {:e}", got.largest_departure_s);
        assert!((got.period_s - 0.002).abs() < 1e-17, "got {:e}", got.period_s - 0.002);
    }

    #[test]
    fn the_caller_may_choose() {
        let time_s: Vec<f64> = (0..100).map(|k| f64::from(k) + 0.2 * f64::from(k % 3)).collect();
        assert_eq!(judge(&time_s, Some(1.0), SamplingChoice::Auto).kind, SamplingKind::Irregular);
        assert_eq!(judge(&time_s, Some(1.0), SamplingChoice::Uniform).kind, SamplingKind::Uniform);
        let even: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(judge(&even, Some(1.0), SamplingChoice::AsStamped).kind, SamplingKind::Irregular);
    }

    /// Minutes printed to two decimals lie on a grid of 0.6 s, which no power of ten of a second
    /// is.
    #[test]
    fn the_grid_is_one_of_the_printed_unit() {
        let time_s: Vec<f64> = (0..300).map(|k| 60.0 * (f64::from(k) * 1.7 / 60.0 * 100.0).round() / 100.0).collect();
        let got = judge(&time_s, Some(60.0), SamplingChoice::Auto);
        assert!((got.stamp_resolution_s.unwrap() - 0.6).abs() < 1e-9, "got {:?}", got.stamp_resolution_s);
        assert_eq!(got.kind, SamplingKind::Rounded);
    }
}
