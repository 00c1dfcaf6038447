//! The rows of a record in stretches without a break, on an even grid where there is one.
//!
//! A record is cut at every row that lacks a temperature ([`Record::segments`]). For whoever can do
//! with a reading that is missing, but not with a break, that is one cut too many: here the sample
//! keeps its place on the grid and is marked as missing. Model: rows of one stretch lie at `t0 + k
//! P`, `k` a whole number; `P` is the period of the record, or, where rows are missing so often
//! that the stamps count as irregular, the one that all steps are multiples of. Between the rows
//! that are there, straight lines stand in for those that are not; they are no readings.

use std::sync::Arc;

use crate::record::Record;
use crate::sampling::SamplingKind;

/// Most samples in a row that may be missing within a stretch; a longer gap ends it.
pub(crate) const MAX_MISSING_SAMPLES: usize = 20;
/// How far, in steps, a stamp may be from the grid and lie on it. The steps of stamps that jitter
/// by less than a hundredth of a step, which counts as uniform sampling, differ by up to twice as
/// much.
const MAX_DEPARTURE_STEPS: f64 = 0.02;
/// Share of the grid's samples that must be there: of a grid that is empty for the most part, a
/// divisor of its step would do as well, and nothing says which is the sample period.
const MIN_SHARE_OF_GRID: f64 = 0.5;

/// A record in unbroken stretches, in order of time: [`Record::grid`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Grid {
    /// The step from sample to sample, s, in every stretch; `None` where the rows lie on no even
    /// grid.
    pub period_s: Option<f64>,
    /// The stretches; each begins and ends with a row that is there.
    pub stretches: Vec<Stretch>,
}

impl Grid {
    /// The row of the record that each sample of all stretches is, `None` for those that are
    /// missing.
    pub fn rows(&self) -> impl Iterator<Item = Option<usize>> + '_ {
        self.stretches.iter().flat_map(|stretch| stretch.rows.iter().copied())
    }

    /// Drops stretches with fewer samples than that, missing ones counted.
    #[must_use]
    pub fn without_short(mut self, min_samples: usize) -> Self {
        self.stretches.retain(|stretch| stretch.len() >= min_samples);
        self
    }
}

/// Samples without a break, on an even grid if [`Grid::period_s`] is there. All vectors are `[n]`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Stretch {
    /// The row of the record that a sample is; `None` if it is missing from the record.
    pub rows: Vec<Option<usize>>,
    /// Instants, s, rising: evenly spaced from the stamp of the first row on a grid, else as
    /// stamped.
    pub time_s: Vec<f64>,
    /// Readings of both channels, °C; on a straight line between its neighbours where a sample is
    /// missing. Shared with the record where it is all of that.
    pub reading_c: [Arc<Vec<f64>>; 2],
    /// The flow, in the unit of its column, if the record has one; on straight lines where a sample
    /// is missing.
    pub flow: Option<Vec<f64>>,
    /// The speed of sensors that move, m/s, if the record has it; on straight lines where a sample is missing.
    pub speed_m_s: Option<Vec<f64>>,
}

impl Stretch {
    /// Number of samples, missing ones counted.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no sample; a stretch of a [`Grid`] has at least one.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Which samples are missing: their values are not readings.
    pub fn missing(&self) -> Vec<bool> {
        self.rows.iter().map(Option::is_none).collect()
    }

    fn new(record: &Record, rows: Vec<Option<usize>>, period_s: Option<f64>) -> Self {
        let first_s = rows.first().copied().flatten().map_or(0.0, |row| record.time_s[row]);
        let time_s = match period_s {
            Some(period_s) => (0..rows.len()).map(|k| first_s + k as f64 * period_s).collect(),
            None => rows.iter().flatten().map(|&row| record.time_s[row]).collect(),
        };
        let is_all = rows.len() == record.len() && rows.iter().all(Option::is_some);
        let reading = |values: &Arc<Vec<f64>>| if is_all { values.clone() } else { Arc::new(bridged(&rows, values)) };
        let reading_c = [reading(&record.t1_c), reading(&record.t2_c)];
        let flow = record.flow.as_ref().map(|flow| bridged(&rows, flow));
        let speed_m_s = record.speed_m_s.as_ref().map(|speed_m_s| bridged(&rows, speed_m_s));
        Self { rows, time_s, reading_c, flow, speed_m_s }
    }
}

impl Record {
    /// The rows in stretches without a break: where they lie on an even grid, up to 20 missing
    /// samples in a row are part of a stretch, marked as such.
    ///
    /// A grid there is where the sampling is [`Uniform`](SamplingKind::Uniform) or
    /// [`Rounded`](SamplingKind::Rounded), and also where it is irregular only because rows are
    /// missing: every step a multiple of the shortest one, within a fiftieth, and more than half of
    /// the samples there. Without a grid each of [`Record::segments`] is a stretch.
    ///
    /// ```
    /// use twinlag_record::{Record, Selection, Table};
    ///
    /// let text = "\
    /// time [s],T1 [°C],T2 [°C]
    /// 0,20.0,20.0
    /// 1,21.0,20.5
    /// 2,22.0,21.0
    /// 3,---,21.5
    /// 4,24.0,22.0
    /// 5,25.0,22.5
    /// 6,26.0,23.0
    /// 7,27.0,23.5
    /// 8,28.0,24.0
    /// ";
    /// let record = Record::from_table(&Table::read(text.as_bytes(), "demo.csv")?, &Selection::default())?;
    /// assert_eq!(record.segments, [0..3, 4..9]); // a break for whoever needs every reading
    ///
    /// let grid = record.grid();
    /// assert_eq!(grid.period_s, Some(1.0));
    /// let [stretch] = &grid.stretches[..] else { panic!("one stretch") };
    /// assert_eq!(stretch.rows[2..5], [Some(2), None, Some(4)]);
    /// assert!(stretch.missing()[3]);
    /// assert_eq!(stretch.reading_c[0][3], 23.0); // on the line from 22 °C to 24 °C
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    pub fn grid(&self) -> Grid {
        let period_s = period_s(self);
        let stretches = stretches(self, period_s);
        Grid { period_s, stretches: stretches.into_iter().map(|rows| Stretch::new(self, rows, period_s)).collect() }
    }
}

/// The period, where rows lie on an even grid, with or without some missing.
fn period_s(record: &Record) -> Option<f64> {
    if record.sampling.kind != SamplingKind::Irregular {
        return Some(record.sampling.period_s);
    }
    let steps = || record.segments.iter().flat_map(|s| record.time_s[s.clone()].windows(2).map(|t| t[1] - t[0]));
    let shortest_s = steps().reduce(f64::min)?;
    let is_on_grid = |step: f64| {
        let ratio = step / shortest_s;
        (ratio - ratio.round()).abs() <= MAX_DEPARTURE_STEPS
    };
    let rows = steps().count() as f64;
    let samples: f64 = steps().map(|step| (step / shortest_s).round()).sum();
    // The mean step: the shortest one is short of it by whatever the stamps jitter.
    (steps().all(is_on_grid) && rows > MIN_SHARE_OF_GRID * samples).then(|| steps().sum::<f64>() / samples)
}

/// The rows of each stretch, `None` in the places of missing ones.
fn stretches(record: &Record, period_s: Option<f64>) -> Vec<Vec<Option<usize>>> {
    let Some(period_s) = period_s else {
        return record.segments.iter().map(|segment| segment.clone().map(Some).collect()).collect();
    };
    // Neighbours of one segment are neighbours on the grid of an even record, whatever the jitter
    // of their stamps.
    let is_even = record.sampling.kind != SamplingKind::Irregular;
    let mut out: Vec<Vec<Option<usize>>> = Vec::new();
    for segment in &record.segments {
        for row in segment.clone() {
            let before = out.last().and_then(|stretch| stretch.last().copied().flatten());
            let steps = match before {
                Some(_) if is_even && row > segment.start => 1,
                Some(before) => ((record.time_s[row] - record.time_s[before]) / period_s).round().max(1.0) as usize,
                None => usize::MAX,
            };
            match out.last_mut() {
                Some(stretch) if steps <= MAX_MISSING_SAMPLES + 1 => {
                    stretch.extend(std::iter::repeat_n(None, steps - 1));
                    stretch.push(Some(row));
                }
                _ => out.push(vec![Some(row)]),
            }
        }
    }
    out
}

/// Values of rows, with straight lines over those that are missing; the first one is there.
fn bridged(rows: &[Option<usize>], values: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; rows.len()];
    let mut before: Option<(usize, f64)> = None;
    for (k, row) in rows.iter().enumerate() {
        let Some(row) = row else { continue };
        let (from, first) = before.unwrap_or((k, values[*row]));
        for (j, value) in out[from..=k].iter_mut().enumerate() {
            let share = if k > from { j as f64 / (k - from) as f64 } else { 1.0 };
            *value = first + share * (values[*row] - first);
        }
        before = Some((k, values[*row]));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, SamplingChoice};

    /// A record whose first channel is 20 °C and 0.5 K more each second, and the second half of
    /// that.
    fn ramp(time_s: Vec<f64>, is_missing: impl Fn(usize) -> bool) -> Record {
        let t1_c = |(k, t): (usize, &f64)| if is_missing(k) { f64::NAN } else { 20.0 + 0.5 * t };
        let channels = Channels {
            source: "ramp".to_owned(),
            names: ["T1", "T2"].map(str::to_owned),
            t1_c: time_s.iter().enumerate().map(t1_c).collect(),
            t2_c: time_s.iter().map(|t| 20.0 + 0.25 * t).collect(),
            time_s,
            reference_c: None,
        };
        Record::from_channels(channels, SamplingChoice::Auto).expect("a valid record")
    }

    fn seconds(count: usize) -> Vec<f64> {
        (0..count).map(|k| k as f64).collect()
    }

    /// The channels are straight lines, so that the bridge over a missing reading hits what would
    /// have been read, up to rounding of temperatures about 40 °C.
    #[test]
    fn a_short_gap_of_readings_is_bridged_by_a_straight_line() {
        let record = ramp(seconds(60), |k| (20..40).contains(&k));
        let grid = record.grid();
        assert_eq!(grid.stretches.len(), 1);
        let stretch = &grid.stretches[0];
        assert_eq!((stretch.len(), stretch.missing().iter().filter(|m| **m).count()), (60, 20));
        for (k, (t, value)) in stretch.time_s.iter().zip(stretch.reading_c[0].iter()).enumerate() {
            assert!((value - (20.0 + 0.5 * t)).abs() < 1e-13 * 50.0, "sample {k}: {value}");
        }
    }

    /// 20 missing samples are bridged (above), 21 end the stretch.
    #[test]
    fn a_long_gap_ends_a_stretch() {
        let grid = ramp(seconds(60), |k| (20..41).contains(&k)).grid();
        let rows: Vec<_> = grid.stretches.iter().map(|s| (s.rows[0], s.len())).collect();
        assert_eq!(rows, [(Some(0), 20), (Some(41), 19)]);
        assert_eq!(grid.without_short(20).stretches.len(), 1);
    }

    /// Rows that are not in the file at all, as of a logger that skips: two of five samples are
    /// away, which is irregular as stamped, and an even grid all the same.
    #[test]
    fn rows_left_out_of_the_file_keep_their_place_on_the_grid() {
        let is_there = |k: &usize| ![1, 2].contains(&(k % 5));
        let record = ramp((0..100).filter(is_there).map(|k| k as f64).collect(), |_| false);
        assert_eq!(record.sampling.kind, SamplingKind::Irregular);
        let grid = record.grid();
        assert_eq!(grid.period_s, Some(1.0));
        assert_eq!(grid.stretches[0].rows[..6], [Some(0), None, None, Some(1), Some(2), Some(3)]);
        assert_eq!(grid.stretches[0].time_s, seconds(100));
        assert_eq!(grid.rows().flatten().collect::<Vec<_>>(), (0..60).collect::<Vec<_>>());
    }

    /// Failed: the shortest of jittering steps was the period, short by the jitter, here 0.8 %. The
    /// mean of the steps is off by the jitter of the first and last stamp alone, over 89 steps.
    #[test]
    fn the_period_of_jittering_stamps_is_not_their_shortest_step() {
        let jitter_s = |k: usize| if k.is_multiple_of(2) { 0.004 } else { -0.004 };
        let stamps = (0..90).filter(|k| k % 3 != 1).map(|k| k as f64 + jitter_s(k));
        let record = ramp(stamps.collect(), |_| false);
        assert_eq!(record.sampling.kind, SamplingKind::Irregular);
        let period_s = record.grid().period_s.expect("a grid");
        assert!((period_s - 1.0).abs() <= 0.008 / 89.0 + 1e-15, "{period_s}");
    }

    /// Steps of 1, 1.3 and 2 s have no common period.
    #[test]
    fn without_a_grid_the_segments_are_the_stretches() {
        let steps = [1.0, 1.3, 2.0];
        let stamps: Vec<f64> = (0..60)
            .scan(0.0, |t, k| {
                *t += steps[k % 3];
                Some(*t)
            })
            .collect();
        let record = ramp(stamps, |k| k == 30);
        let grid = record.grid();
        assert_eq!(grid.period_s, None);
        let rows: Vec<Vec<usize>> = grid.stretches.iter().map(|s| s.rows.iter().flatten().copied().collect()).collect();
        assert_eq!(rows, record.segments.iter().map(|s| s.clone().collect()).collect::<Vec<Vec<_>>>());
        assert_eq!(grid.stretches[1].time_s, record.time_s[31..]);
    }

    /// One row in four but for the second one: the steps are 1, 3, 4, 4, 4 … s.
    #[test]
    fn a_grid_that_is_empty_for_the_most_part_is_no_grid() {
        let stamps = (0..120).filter(|k| k % 4 == 0 || *k == 1).map(f64::from).collect();
        assert_eq!(ramp(stamps, |_| false).grid().period_s, None);
    }

    #[test]
    fn a_flow_is_bridged_too() {
        let record = ramp(seconds(40), |k| k == 10);
        let flow = (0..40).map(|k| if k == 10 { f64::NAN } else { 1.0 + f64::from(k) }).collect();
        let grid = record.with_flow(flow).expect("a positive flow").grid();
        assert_eq!(grid.stretches[0].flow.as_ref().map(|flow| flow[10]), Some(11.0));
    }
}
