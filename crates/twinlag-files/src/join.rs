//! Channels of several groups on the stamps of one: linear between neighbouring samples, exact
//! where stamps coincide. Nothing is extrapolated, and nothing is made up where a sample is invalid
//! or a recording paused.

use twinlag_record::NamedColumn;

use crate::contents::Group;
use crate::series::{Loaded, Series, Values};

/// Steps of the other time base between which is interpolated, in median steps of its own: a longer
/// one is a pause. The same as of gaps in an irregular record.
const MAX_MEDIAN_STEPS: f64 = 5.0;

/// Ratio of two sample periods up to which both are of one rate: chosen, between equal rates and twice as fast.
const MAX_PERIOD_RATIO_OF_ONE_RATE: f64 = 1.5;

/// A time base in seconds from an instant, if the file states one.
#[derive(Debug)]
pub(crate) struct Base {
    /// Missing is NaN.
    time_s: Vec<f64>,
    start_ns: Option<i64>,
}

impl Base {
    /// The time base of a group: the channel that the format declares, else the one that is called
    /// a time.
    ///
    /// # Errors
    /// Why it has none.
    pub(crate) fn of(group: &Group, loaded: &Loaded) -> Result<Self, String> {
        let time = loaded.time.or_else(|| loaded.series.iter().position(is_time_base));
        let Some(series) = time.map(|time| &loaded.series[time]) else {
            return Err("no channel of it is a time".to_owned());
        };
        match &series.values {
            Values::Numbers(values) => {
                let column = NamedColumn::numbers(series.name.as_str(), []).with_unit(series.unit.as_str());
                // Formats with groups state their units; a time without one is in seconds.
                let unit_s = column.time_unit_s().unwrap_or(1.0);
                let time_s = values.iter().map(|value| value * unit_s).collect();
                Ok(Self { time_s, start_ns: group.start_ns })
            }
            Values::Instants(instants) => {
                let start_ns = instants.iter().flatten().next().copied();
                let since = |ns: i64| (i128::from(ns) - i128::from(start_ns.unwrap_or(ns))) as f64 / 1e9;
                Ok(Self { time_s: instants.iter().map(|at| at.map_or(f64::NAN, since)).collect(), start_ns })
            }
            Values::Texts(_) => Err(format!("its time '{}' is text", series.name)),
        }
    }

    /// Values of another base at the stamps of this one; missing is NaN.
    ///
    /// # Errors
    /// Why the two cannot be related.
    pub(crate) fn take(&self, other: &Self, values: &[f64]) -> Result<Vec<f64>, String> {
        let shift_s = match (self.start_ns, other.start_ns) {
            (Some(mine), Some(its)) => (i128::from(its) - i128::from(mine)) as f64 / 1e9,
            (None, None) => 0.0,
            _ => return Err("only one of the two time bases states from which instant it counts".to_owned()),
        };
        // A sample without a stamp is nowhere; what lies on either side of it are neighbours.
        let samples: Vec<(f64, f64)> = other
            .time_s
            .iter()
            .map(|time_s| time_s + shift_s)
            .zip(values.iter().copied())
            .filter(|s| !s.0.is_nan())
            .collect();
        if let Some(pair) = samples.windows(2).find(|pair| pair[1].0 <= pair[0].0) {
            return Err(format!("its stamps do not rise, at {} s", pair[1].0));
        }
        let longest_s = MAX_MEDIAN_STEPS * median(samples.windows(2).map(|pair| pair[1].0 - pair[0].0));
        let mut next = 0;
        let mut last_s = f64::NEG_INFINITY;
        let at = |(start_s, start): (f64, f64), (end_s, end): (f64, f64), time_s: f64| {
            if end_s - start_s > longest_s {
                return f64::NAN;
            }
            start + (end - start) * ((time_s - start_s) / (end_s - start_s))
        };
        let taken = self.time_s.iter().map(|&time_s| {
            if time_s < last_s {
                next = 0;
            }
            last_s = time_s;
            while samples.get(next).is_some_and(|sample| sample.0 < time_s) {
                next += 1;
            }
            match (next.checked_sub(1).map(|before| samples[before]), samples.get(next)) {
                (_, Some(&(stamp_s, value))) if stamp_s == time_s => value,
                (Some(before), Some(&after)) if !time_s.is_nan() => at(before, after, time_s),
                _ => f64::NAN,
            }
        });
        Ok(taken.collect())
    }

    /// The median sample period of another base over that of this one, to a hundredth, where that is more than
    /// [`MAX_PERIOD_RATIO_OF_ONE_RATE`].
    pub(crate) fn faster_than(&self, other: &Self) -> Option<f64> {
        let [mine_s, its_s] = [self, other].map(|base| median(base.time_s.windows(2).map(|pair| pair[1] - pair[0])));
        let ratio = its_s / mine_s;
        (ratio.is_finite() && ratio > MAX_PERIOD_RATIO_OF_ONE_RATE).then_some((100.0 * ratio).round() / 100.0)
    }

    /// Whether the file states the instant from which it counts.
    pub(crate) fn has_start(&self) -> bool {
        self.start_ns.is_some()
    }
}

fn is_time_base(series: &Series) -> bool {
    match &series.values {
        Values::Instants(_) => true,
        Values::Numbers(_) => crate::series::is_time(&series.name, &series.unit),
        Values::Texts(_) => false,
    }
}

/// The value in the middle of those that are known, 0 of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base(time_s: &[f64], start_ns: Option<i64>) -> Base {
        Base { time_s: time_s.to_vec(), start_ns }
    }

    /// All numbers are sums of powers of two, so every result is exact.
    #[test]
    fn values_are_linear_between_neighbours_and_missing_beyond_the_ends() {
        let mine = base(&[-0.5, 0.0, 0.25, 1.0, 1.5, 2.0, 2.25], None);
        let its = base(&[0.0, 1.0, 2.0], None);
        let got = mine.take(&its, &[10.0, 20.0, 16.0]).expect("same clock");
        assert!(got[0].is_nan() && got[6].is_nan());
        assert_eq!(got[1..6], [10.0, 12.5, 20.0, 18.0, 16.0]);
    }

    #[test]
    fn nothing_is_made_up_beside_an_invalid_sample() {
        let mine = base(&[0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0], None);
        let got = mine.take(&base(&[0.0, 1.0, 2.0, 3.0], None), &[1.0, f64::NAN, 3.0, 5.0]).expect("same clock");
        assert_eq!((got[0], got[4], got[5], got[6]), (1.0, 3.0, 4.0, 5.0));
        assert!(got[1].is_nan() && got[2].is_nan() && got[3].is_nan());
    }

    #[test]
    fn nothing_is_made_up_in_a_pause() {
        let its = base(&[0.0, 1.0, 2.0, 3.0, 9.0], None);
        let got = base(&[2.5, 4.0, 9.0], None).take(&its, &[0.0, 1.0, 2.0, 3.0, 9.0]).expect("same clock");
        assert_eq!((got[0], got[2]), (2.5, 9.0));
        assert!(got[1].is_nan());
    }

    #[test]
    fn clocks_that_start_apart_are_shifted() {
        let mine = base(&[0.0, 1.0], Some(1_000_000_000));
        let its = base(&[0.0, 1.0, 2.0], Some(500_000_000));
        assert_eq!(mine.take(&its, &[0.0, 8.0, 16.0]).expect("both have a start"), [4.0, 12.0]);
        let error = mine.take(&base(&[0.0, 1.0], None), &[0.0, 8.0]).expect_err("where does it begin?");
        assert!(error.contains("from which instant"), "{error}");
        let error = mine.take(&base(&[0.0, 1.0, 1.0], Some(0)), &[0.0; 3]).expect_err("a stamp twice");
        assert!(error.contains("do not rise, at 0 s"), "{error}");
    }
}
