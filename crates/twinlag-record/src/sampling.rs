//! How the stamps lie in time. An estimator needs the steps between samples; stamps are rounded,
//! jitter, and skip.
//!
//! Model: within a run without gaps `t[k] = t0 + k P + e[k]`; `P` by least squares over all runs,
//! each with its own `t0`. That averages rounding away: stamps of a 24 Hz logger rounded to 10 µs
//! give 1/24 s to many digits.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::selection::SamplingChoice;

/// Bursts that show that a record comes in them; chosen: as many gaps that leave rows of one number between them are no chance.
const MIN_BURSTS: usize = 10;
/// The most rows of a burst that may be those of a buffer; chosen.
const MAX_BURST_ROWS: usize = 64;
/// How many of the bursts have the same number of rows, at least; chosen: lines are lost.
const MIN_BURST_SHARE: f64 = 0.8;
/// How much of the time bursts take, at most; chosen.
const MAX_BURST_SHARE_OF_TIME: f64 = 0.5;

/// What the stamps are taken to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SamplingKind {
    /// Every step is the period, within a hundredth of it or the grid that stamps are printed on.
    Uniform,
    /// Stamps lie on a grid that is coarse beside the period, and steps differ by one unit of it,
    /// as 3 s and 4 s with stamps of 1 s, or every stamp is at most a unit from the rounded one and the unit is short beside
    /// the period: the samples are taken as evenly spaced.
    Rounded,
    /// Steps differ: each is used as stamped.
    Irregular,
}

/// How the stamps lie in time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
const MAX_DIGITS: i32 = 15;
/// Digits that single precision gives for any number.
const SINGLE_DIGITS: i32 = 7;
/// Departure, in periods, below which stamps count as even.
const EXACT_PERIODS: f64 = 0.01;
/// Part of its unit by which a stamp may differ from the instant that it was rounded from, and a hundredth more, as of grids;
/// with the unit either way by which a clock is off that is read just before or after its last digit changes.
const ROUNDED_UNITS: f64 = 0.51;
const OFF_BY_ONE_UNITS: f64 = 1.51;
/// Unit of a clock whose stamps may be off by one, in periods, at most: if the samples jitter and not the clock, what is made
/// of them is off by 0.9 units rms, a sixtieth of what a reading changes by from sample to sample. Chosen.
const MAX_OFF_BY_ONE_PERIODS: f64 = 0.02;

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

/// The clock that stamps were printed from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clock {
    /// Its unit.
    pub(crate) unit_s: f64,
    /// What the first stamp was, in that unit; 0 where stamps are dates.
    pub(crate) first: f64,
}

impl Clock {
    /// Seconds from 0.
    pub(crate) const SECONDS: Self = Self { unit_s: 1.0, first: 0.0 };

    /// The stamps as they were printed.
    fn printed(self, time_s: &[f64]) -> impl Iterator<Item = f64> + Clone {
        time_s.iter().map(move |t| self.first + t / self.unit_s)
    }
}

/// Judges stamps: at least two, strictly increasing.
///
/// - `time_s`: the stamps
/// - `clock`: what they were printed from, if they were
pub(crate) fn judge(time_s: &[f64], clock: Option<Clock>, choice: SamplingChoice) -> Sampling {
    let steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let median = median(&steps);
    let format = clock.map(|clock| (clock, Format::of(time_s, clock)));
    let coarsest = format.and_then(|(clock, format)| format.coarsest(time_s, clock));
    let grid = clock.and_then(|clock| grid(time_s, &steps, clock.unit_s, coarsest));
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
    let is_rounded = grid.is_some_and(|unit| high - low <= 1.01 * unit && is_steady(time_s, limit, period, unit))
        || (!(is_whole && is_uniform)
            && format.is_some_and(|(clock, format)| {
                is_even_but_for_digits(time_s, &format.units(time_s, clock), ROUNDED_UNITS, limit, period)
            }))
        || grid.filter(|unit| is_whole && !is_uniform && *unit <= MAX_OFF_BY_ONE_PERIODS * period).is_some_and(
            |unit| is_even_but_for_digits(time_s, &vec![unit; time_s.len()], OFF_BY_ONE_UNITS, limit, period),
        );
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

/// Whether every stamp is that of an even grid, rounded to the digits that it was printed with. A
/// format of few significant digits rounds later stamps more than earlier ones.
///
/// Each run of rows has a start of its own, and all have one period. Stamp `k` of a run allows the
/// starts `t[k] − k P ± q[k]/2`; the grid exists if there is a `P` at which each run has a start that all
/// its stamps allow. What lacks for that, the latest of the earliest starts less the earliest of the
/// latest ones, is convex in `P`: bisection by its slope finds a place where it is not positive, or
/// that there is none.
///
/// - `digits_s`: the unit of the last digit of each stamp, s
/// - `most_units`: by how many of these a stamp may be off
///
/// The chance that a clock that jitters passes: of `n` stamps in `r` runs that jitter evenly within
/// `±J`, each must lie in a window of `q`, which `n − r − 1` independent ones do with a probability of
/// `(q/2J)^(n − r − 1)`: for `J = q` and 100 rows in one run 3e-30. Jitter that is much smaller than the
/// last digit is not in the stamps, which are then as even as they can be.
fn is_even_but_for_digits(time_s: &[f64], digits_s: &[f64], most_units: f64, limit_s: f64, period_s: f64) -> bool {
    // A row that is missing must show: two periods less the rounding of both stamps are more than
    // the limit of 1.5 periods and one rounding.
    if digits_s.iter().any(|q| *q > 0.25 * period_s) {
        return false;
    }
    let runs: Vec<_> = runs(time_s, limit_s).collect();
    // What lacks, at the period and so much, and how it changes with that.
    let lack = |correction_s: f64| {
        let of_run = |run: &Range<usize>| {
            let (mut latest, mut earliest) = ((f64::NEG_INFINITY, 0.0), (f64::INFINITY, 0.0));
            for row in run.clone() {
                let k = (row - run.start) as f64;
                let start = (time_s[row] - time_s[run.start] - k * period_s) - k * correction_s;
                let half = most_units * digits_s[row];
                if start - half > latest.0 {
                    latest = (start - half, k);
                }
                if start + half < earliest.0 {
                    earliest = (start + half, k);
                }
            }
            (latest.0 - earliest.0, earliest.1 - latest.1)
        };
        runs.iter().map(of_run).fold((f64::NEG_INFINITY, 0.0), |most, now| if now.0 > most.0 { now } else { most })
    };
    let (mut low, mut high) = (-0.01 * period_s, 0.01 * period_s);
    // So many halvings leave less than the last bit of any period.
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        match lack(middle) {
            (lack, _) if lack <= 0.0 => return true,
            (_, slope) if slope > 0.0 => high = middle,
            (_, slope) if slope < 0.0 => low = middle,
            _ => return false,
        }
    }
    false
}

pub(crate) fn median(steps: &[f64]) -> f64 {
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

/// Rows that come in bursts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bursts {
    /// Rows of each.
    pub(crate) rows: usize,
    /// From the beginning of one to that of the next, divided by its rows.
    pub(crate) period_s: f64,
}

/// Whether a record comes in bursts: as of a logger that sends what it has kept, with the time of arrival. They are too short to be those of
/// a campaign that measures for a while and waits.
///
/// - `runs`: the stretches without a gap
pub(crate) fn bursts(time_s: &[f64], runs: &[Range<usize>]) -> Option<Bursts> {
    // The first and the last one may be cut.
    let whole = runs.get(1..runs.len().saturating_sub(1))?;
    let (first, last) = (whole.first()?, whole.last()?);
    let mut lengths: Vec<f64> = whole.iter().map(|run| run.len() as f64).collect();
    lengths.sort_by(f64::total_cmp);
    let rows = lengths[lengths.len() / 2] as usize;
    let share = whole.iter().filter(|run| run.len() == rows).count() as f64 / whole.len() as f64;
    // A logger that loses a row now and then measures for most of the time.
    let observed_s: f64 = whole.iter().map(|run| time_s[run.end - 1] - time_s[run.start]).sum();
    let is_brief = observed_s < MAX_BURST_SHARE_OF_TIME * (time_s[last.start] - time_s[first.start]);
    let is_burst =
        is_brief && whole.len() >= MIN_BURSTS && (2..=MAX_BURST_ROWS).contains(&rows) && share >= MIN_BURST_SHARE;
    let period_s = (time_s[last.start] - time_s[first.start]) / ((whole.len() - 1) * rows) as f64;
    is_burst.then_some(Bursts { rows, period_s })
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
///
/// - `coarsest`: the last digit of the largest stamp, where that differs from stamp to stamp
fn grid(time_s: &[f64], steps: &[f64], unit_s: f64, coarsest: Option<f64>) -> Option<f64> {
    let first = *time_s.first()?;
    let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let power = (-9..=6).rev().map(|exponent| 10_f64.powi(exponent)).find(|power| {
        let unit = power * unit_s;
        // A grid coarser than the shortest step would repeat stamps.
        unit <= 1.001 * shortest && time_s.iter().all(|t| off_grid((t - first) / unit) < 0.01)
    })?;
    let unit = power * unit_s;
    if let Some(coarsest) = coarsest.filter(|last| *last > unit && *last <= shortest) {
        return Some(coarsest);
    }
    // No divisor is less than one.
    let common = steps.iter().try_fold(0, |all, step| match divisor(all, (step / unit).round() as u64) {
        1 => Err(1),
        all => Ok(all),
    });
    let common = common.unwrap_or_else(|one| one);
    let shortest = (shortest / unit).round() as u64;
    // Where all steps are multiples of the shortest one the divisor is the sampling, not the clock.
    Some(if common < shortest { unit * common.max(1) as f64 } else { unit })
}

/// How stamps were printed: what the unit of their last digit is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    /// All to one number of significant digits: seven give 0.04166667 s and 1049.958 s.
    Digits(i32),
    /// As binary numbers of which one unit in the last place is this share.
    Binary(f64),
}

impl Format {
    /// The significant digits, if all stamps have at most [`MAX_DIGITS`]. Otherwise single precision, if all stamps were kept in it,
    /// or twice the unit of doubles, since what is added up is off by a unit: serial days are to no more than 1e-5 s.
    fn of(time_s: &[f64], clock: Clock) -> Self {
        let is_printed =
            |stamp: f64, unit: f64| off_grid(stamp / unit) < 0.01 + 2.0 * f64::EPSILON * stamp.abs() / unit;
        let unit = |stamp: f64, digits: i32| 10_f64.powi(exponent(stamp) + 1 - digits);
        let digits = |stamp: f64| (1..=MAX_DIGITS).find(|digits| is_printed(stamp, unit(stamp, *digits)));
        let stamps = || clock.printed(time_s).filter(|stamp| *stamp != 0.0);
        // Stamps with no more digits than one before are seen to be so at once: neighbours have the same power of ten.
        let (mut decade, mut last_digit) = (0.0..0.0, f64::NAN);
        let most = |most: i32, stamp: f64| {
            if decade.contains(&stamp.abs()) && is_printed(stamp, last_digit) {
                return Some(most);
            }
            let most = digits(stamp)?.max(most);
            decade = 10_f64.powi(exponent(stamp))..10_f64.powi(exponent(stamp) + 1);
            last_digit = unit(stamp, most);
            Some(most)
        };
        match stamps().try_fold(0, most) {
            // Seven digits print the same in single precision and in double: they may be all there are.
            Some(most) if most <= SINGLE_DIGITS => Self::Digits(most),
            _ if stamps().all(is_single) => Self::Binary(f64::from(f32::EPSILON)),
            Some(most) => Self::Digits(most),
            None => Self::Binary(2.0 * f64::EPSILON),
        }
    }

    /// The unit of the last digit of a stamp other than zero.
    fn unit(self, stamp: f64) -> f64 {
        match self {
            Self::Digits(most) => 10_f64.powi(exponent(stamp) + 1 - most),
            Self::Binary(epsilon) => epsilon * 2_f64.powf(stamp.abs().log2().floor()),
        }
    }

    /// The unit of the largest stamp, s, which no other one exceeds.
    fn coarsest(self, time_s: &[f64], clock: Clock) -> Option<f64> {
        let largest = clock.printed(time_s).fold(0.0, |largest: f64, stamp| largest.max(stamp.abs()));
        (largest > 0.0).then(|| clock.unit_s * self.unit(largest))
    }

    /// The unit of the last digit of each stamp, s. A stamp of zero is exact in any format: it is as good as the best of the others.
    fn units(self, time_s: &[f64], clock: Clock) -> Vec<f64> {
        let stamps = clock.printed(time_s);
        let best =
            stamps.clone().filter(|stamp| *stamp != 0.0).map(|stamp| self.unit(stamp)).fold(f64::INFINITY, f64::min);
        stamps.map(|stamp| clock.unit_s * if stamp == 0.0 { best } else { self.unit(stamp) }).collect()
    }
}

fn exponent(stamp: f64) -> i32 {
    stamp.abs().log10().floor() as i32
}

/// Whether a stamp is one of single precision, as it is or in the fewest digits that give it again.
fn is_single(stamp: f64) -> bool {
    let single = stamp as f32;
    let is_near = |value: f64| (value - stamp).abs() <= 4.0 * f64::EPSILON * stamp.abs();
    is_near(f64::from(single)) || single.to_string().parse().is_ok_and(is_near)
}

fn off_grid(position: f64) -> f64 {
    /// 1.5 · 2⁵²: a double of this size has no fraction, so that adding and subtracting it rounds, without a call for each stamp.
    const NO_FRACTION: f64 = 6_755_399_441_055_744.0;
    // Beyond 2^43 the fraction of a double is no better than a thousandth.
    if position.abs() > 8e12 { 1.0 } else { (position - ((position + NO_FRACTION) - NO_FRACTION)).abs() }
}

fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn auto(time_s: &[f64]) -> Sampling {
        judge(time_s, Some(Clock::SECONDS), SamplingChoice::Auto)
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

    /// A clock with a unit of a hundredth of the period that is off by one either way leaves departures of 1.5 units, 1.5e-5 s,
    /// at most, and the slope of n points 0.87 units (of one either way and rounding) times √12 n^-3/2: ten of these are
    /// 1.1e-10 s. Off by three it jitters. Failed: steps differ by 2 %, and each was used as stamped.
    #[test]
    fn stamps_that_are_off_by_one_in_their_last_digit_are_even() {
        let stamps = |most: i32| -> Vec<f64> {
            let off = |k: i32| (k * 7919 % 104_729) % (2 * most + 1) - most;
            (0..20_000).map(|k| f64::from((f64::from(k) * 100.37).round() as i32 + off(k)) * 1e-5).collect()
        };
        let got = auto(&stamps(1));
        assert_eq!(got.kind, SamplingKind::Rounded);
        assert!((got.period_s - 1.0037e-3).abs() < 1.1e-10, "got {}, want 1.0037e-3", got.period_s);
        assert!(got.largest_departure_s < 1.5e-5, "{}", got.largest_departure_s);
        assert_eq!(auto(&stamps(3)).kind, SamplingKind::Irregular);
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

    /// The stamps as a program prints them with `%g`: so many significant digits.
    fn printed(stamp: f64, digits: usize) -> f64 {
        format!("{stamp:.0$e}", digits - 1).parse().expect("a number that was just printed")
    }

    /// Six digits leave 1e-4 s after 10 s, 1e-3 s after 100 s and 0.01 s after 1000 s, which is a quarter of the period.
    /// Failed: a clock that did not start at zero was irregular, and so was one with a period a little
    /// below a whole number of milliseconds. Errors of at most half a unit q turn a slope over n points
    /// by 1.5 q/n at most, if their signs are those of the lever.
    #[test]
    fn stamps_of_six_significant_digits_are_even_wherever_they_start() {
        for period_s in [1.0 / 24.0, 0.041_999, 0.1, 1.0 / 30.0, 0.25] {
            for from in [0, 1, 241, 5000] {
                for count in [2000, 14_566] {
                    let raw: Vec<f64> = (from..from + count).map(|k| printed(f64::from(k) * period_s, 6)).collect();
                    let first = raw[0];
                    let time_s: Vec<f64> = raw.iter().map(|t| t - first).collect();
                    let coarsest = 10_f64.powi(raw[raw.len() - 1].log10().floor() as i32 - 5);
                    if coarsest > 0.25 * period_s {
                        continue;
                    }
                    let got = judge(&time_s, Some(Clock { unit_s: 1.0, first }), SamplingChoice::Auto);
                    let what = format!("{period_s} s from row {from}, {count} rows: {got:?}");
                    assert_ne!(got.kind, SamplingKind::Irregular, "{what}");
                    let tolerance = 1.5 * coarsest / f64::from(count);
                    assert!((got.period_s - period_s).abs() < tolerance, "{what}, tolerance {tolerance:e}");
                    assert_eq!(runs(&time_s, got.gap_s()).count(), 1, "{what}");
                }
            }
        }
    }

    /// Whole seconds of an even 15 s but for one that is a second late: no even grid rounds to that.
    #[test]
    fn one_stamp_beside_its_grid_is_irregular() {
        let late = |k: u32| if k == 70 { 1.0 } else { 0.0 };
        let time_s: Vec<f64> = (0..152).map(|k| 15.0 * f64::from(k) + late(k)).collect();
        assert_eq!(auto(&time_s).kind, SamplingKind::Irregular);
    }

    #[test]
    fn gaps_between_stamps_of_few_digits_stay_gaps() {
        let is_there = |k: &u32| ![300, 4000, 4001, 9000].contains(k) && !(11_000..11_500).contains(k);
        let raw: Vec<f64> = (241..14_566).filter(is_there).map(|k| printed(f64::from(k) / 24.0, 6)).collect();
        let time_s: Vec<f64> = raw.iter().map(|t| t - raw[0]).collect();
        let got = judge(&time_s, Some(Clock { unit_s: 1.0, first: raw[0] }), SamplingChoice::Auto);
        assert_eq!(got.kind, SamplingKind::Rounded);
        assert_eq!(runs(&time_s, got.gap_s()).count(), 5);
        // Of the coarsest unit, 1e-3 s, over the shortest of five runs, 59 rows.
        assert!((got.period_s - 1.0 / 24.0).abs() < 10.0 * 1e-3 * 14_566_f64.powf(-1.5), "{got:?}");
    }

    /// Single precision keeps 2⁻¹⁰ s after 8192 s, 2 % of the period; both as it is and as it prints.
    #[test]
    fn stamps_of_single_precision_are_even() {
        let single = |k: u32| (f64::from(k) / 24.0) as f32;
        let shortest = |k: u32| single(k).to_string().parse().expect("a number that was just printed");
        for of in [&|k| f64::from(single(k)), &shortest as &dyn Fn(u32) -> f64] {
            let raw: Vec<f64> = (200_000..230_000).map(of).collect();
            let time_s: Vec<f64> = raw.iter().map(|t| t - raw[0]).collect();
            let got = judge(&time_s, Some(Clock { unit_s: 1.0, first: raw[0] }), SamplingChoice::Auto);
            assert_eq!(got.kind, SamplingKind::Rounded, "{got:?}");
            assert!((got.period_s - 1.0 / 24.0).abs() < 10.0 * 2_f64.powi(-10) * 30_000_f64.powf(-1.5), "{got:?}");
        }
    }

    /// Jitter of once, twice and five times the coarsest digit, 1e-3 s: the first of them passes with a chance of
    /// 0.5^9757. A single stamp that is off by 5 % of a period among fine ones shows as well.
    #[test]
    fn jitter_of_more_than_a_digit_is_irregular() {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for jitter_s in [0.001, 0.002, 0.005] {
            let raw: Vec<f64> =
                (241..10_000).map(|k| printed(f64::from(k) / 24.0 + jitter_s * (2.0 * uniform() - 1.0), 6)).collect();
            let time_s: Vec<f64> = raw.iter().map(|t| t - raw[0]).collect();
            let got = judge(&time_s, Some(Clock { unit_s: 1.0, first: raw[0] }), SamplingChoice::Auto);
            assert_eq!(got.kind, SamplingKind::Irregular, "{jitter_s}: {got:?}");
        }
        let off = |k: u32| if k == 700 { 0.002 } else { 0.0 };
        let raw: Vec<f64> = (241..10_000).map(|k| printed(f64::from(k) / 24.0 + off(k), 6)).collect();
        let time_s: Vec<f64> = raw.iter().map(|t| t - raw[0]).collect();
        let got = judge(&time_s, Some(Clock { unit_s: 1.0, first: raw[0] }), SamplingChoice::Auto);
        assert_eq!(got.kind, SamplingKind::Irregular, "{got:?}");
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
        assert_eq!(judge(&time_s, Some(Clock::SECONDS), SamplingChoice::Auto).kind, SamplingKind::Irregular);
        assert_eq!(judge(&time_s, Some(Clock::SECONDS), SamplingChoice::Uniform).kind, SamplingKind::Uniform);
        let even: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(judge(&even, Some(Clock::SECONDS), SamplingChoice::AsStamped).kind, SamplingKind::Irregular);
    }

    /// Minutes printed to two decimals lie on a grid of 0.6 s, which no power of ten of a second
    /// is.
    #[test]
    fn the_grid_is_one_of_the_printed_unit() {
        let time_s: Vec<f64> = (0..300).map(|k| 60.0 * (f64::from(k) * 1.7 / 60.0 * 100.0).round() / 100.0).collect();
        let got = judge(&time_s, Some(Clock { unit_s: 60.0, first: 0.0 }), SamplingChoice::Auto);
        assert!((got.stamp_resolution_s.unwrap() - 0.6).abs() < 1e-9, "got {:?}", got.stamp_resolution_s);
        assert_eq!(got.kind, SamplingKind::Rounded);
    }
}
