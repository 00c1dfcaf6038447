//! The column beside the temperatures that time constants may go with: a flow, or the position of sensors that move.
//!
//! A logger often reads it less often than the temperatures, or misses a reading. Between two readings of it that are near, the
//! straight line between them stands in; a row further away from any has no flow and is not used.

use std::ops::Range;

use crate::note::Note;
use crate::record::{MIN_SAMPLES, Record, whole_parts};
use crate::{Place, RecordError, motion, sampling};

/// Most rows between two readings of a flow for which the straight line between these stands in: as many as missing samples of a
/// temperature may be bridged.
const MAX_BRIDGED_ROWS: usize = crate::grid::MAX_MISSING_SAMPLES;

impl Record {
    /// This record with a flow velocity or density, in any unit, one value for each row: positive, NaN where missing.
    ///
    /// Where up to 20 rows in succession lack it, the straight line between the values before and after stands in; other rows
    /// without a value are in no segment. A [`Note`] counts both.
    ///
    /// # Errors
    /// [`RecordError::LengthMismatch`], [`RecordError::BadFlow`], [`RecordError::FewFlows`];
    /// [`RecordError::FlowAndPosition`] of a record that has a flow or a position already.
    pub fn with_flow(self, flow: Vec<f64>) -> Result<Self, RecordError> {
        self.flowing(flow, "flow", |row| Place::Sample(row + 1))
    }

    /// This record of sensors that move, with their position in each row, m; NaN or infinite where missing.
    ///
    /// The speed is the slope of the positions that are there; where some are missing, it stands in as a flow does in
    /// [`with_flow`](Self::with_flow).
    ///
    /// # Errors
    /// [`RecordError::LengthMismatch`], [`RecordError::FewFlows`], [`RecordError::ConstantPosition`];
    /// [`RecordError::FlowAndPosition`] of a record that has a flow or a position already.
    pub fn with_position(self, position_m: &[f64]) -> Result<Self, RecordError> {
        self.moving(position_m, "position")
    }

    pub(crate) fn flowing(
        mut self,
        mut flow: Vec<f64>,
        column: &str,
        at: impl Fn(usize) -> Place,
    ) -> Result<Self, RecordError> {
        self.check_is_first(column, flow.len())?;
        let mut used = self.segments.iter().cloned().flatten();
        let is_bad = |value: f64| value.is_infinite() || value <= 0.0;
        if let Some(row) = used.find(|&row| is_bad(flow[row])) {
            let (file, column) = (self.source, column.to_owned());
            return Err(RecordError::BadFlow { file, at: at(row), column, value: flow[row] });
        }
        // A row without a temperature may hold anything: no line ends there.
        flow.iter_mut().filter(|value| is_bad(**value)).for_each(|value| *value = f64::NAN);
        self.bridge(&mut flow, column)?;
        self.flow = Some(flow);
        Ok(self)
    }

    pub(crate) fn moving(mut self, position_m: &[f64], column: &str) -> Result<Self, RecordError> {
        self.check_is_first(column, position_m.len())?;
        let near = |run| near_parts(run, |row| position_m[row].is_finite());
        let runs: Vec<Range<usize>> = self.runs().into_iter().flat_map(near).collect();
        let mut speed_m_s = motion::speed(&self.time_s, position_m, &runs);
        self.bridge(&mut speed_m_s, column)?;
        let rows = self.segments.iter().cloned().flatten();
        let mut values = rows.map(|row| position_m[row]).filter(|value| value.is_finite());
        if values.next().is_none_or(|first| values.all(|value| value == first)) {
            return Err(RecordError::ConstantPosition { file: self.source, column: column.to_owned() });
        }
        self.speed_m_s = Some(speed_m_s);
        Ok(self)
    }

    /// Checks that there is no flow and no position yet, and a value for each row.
    fn check_is_first(&self, column: &str, found: usize) -> Result<(), RecordError> {
        let (file, expected) = (self.source.clone(), self.len());
        if self.flow.is_some() || self.speed_m_s.is_some() {
            return Err(RecordError::FlowAndPosition { file });
        }
        if found != expected {
            let (name, like) = (column.to_owned(), "time_s".to_owned());
            return Err(RecordError::LengthMismatch { file, name, found, like, expected });
        }
        Ok(())
    }

    /// Rows between the gaps in time.
    fn runs(&self) -> Vec<Range<usize>> {
        sampling::runs(&self.time_s, self.sampling.gap_s()).collect()
    }

    /// Puts straight lines where values are missing, and takes rows that still have none out of the segments.
    fn bridge(&mut self, values: &mut [f64], column: &str) -> Result<(), RecordError> {
        let rows = || self.segments.iter().cloned().flatten();
        let missing = rows().filter(|&row| values[row].is_nan()).count();
        if missing == 0 {
            return Ok(());
        }
        self.runs().into_iter().for_each(|run| bridge(&self.time_s[run.clone()], &mut values[run]));
        let unused = rows().filter(|&row| values[row].is_nan()).count();
        self.notes.push(Note::FlowMissing { column: column.to_owned(), bridged: missing - unused, unused });
        self.segments = whole_parts(&self.segments, |row| !values[row].is_nan(), &mut self.notes);
        let usable = self.segments.iter().map(Range::len).sum();
        if usable < MIN_SAMPLES {
            let (file, column) = (self.source.clone(), column.to_owned());
            return Err(RecordError::FewFlows { file, column, usable, least: MIN_SAMPLES });
        }
        Ok(())
    }
}

/// Parts of a run without a hole that is too long for a straight line.
fn near_parts(run: Range<usize>, is_there: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    for row in run.filter(|row| is_there(*row)) {
        match parts.last_mut() {
            Some(part) if row - part.end <= MAX_BRIDGED_ROWS => part.end = row + 1,
            _ => parts.push(row..row + 1),
        }
    }
    parts
}

/// Puts straight lines over time in the place of values that are missing between two that are near.
fn bridge(time_s: &[f64], values: &mut [f64]) {
    let there: Vec<usize> = (0..values.len()).filter(|&row| !values[row].is_nan()).collect();
    for pair in there.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        if to - from > MAX_BRIDGED_ROWS + 1 {
            continue;
        }
        let slope = (values[to] - values[from]) / (time_s[to] - time_s[from]);
        for row in from + 1..to {
            values[row] = values[from] + slope * (time_s[row] - time_s[from]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, SamplingChoice};

    fn record(rows: u32) -> Record {
        let reading_c = |scale: f64| (0..rows).map(|k| 20.0 + (scale * f64::from(k)).sin()).collect();
        let channels = Channels {
            source: "rig".to_owned(),
            names: ["T1", "T2"].map(str::to_owned),
            time_s: (0..rows).map(f64::from).collect(),
            t1_c: reading_c(0.5),
            t2_c: reading_c(0.3),
            reference_c: None,
        };
        Record::from_channels(channels, SamplingChoice::Auto).expect("a valid record")
    }

    /// A flow of `2 + k/2`, whole multiples of a half, so that the lines hit it exactly.
    fn flow(rows: u32, is_missing: impl Fn(u32) -> bool) -> Vec<f64> {
        (0..rows).map(|k| if is_missing(k) { f64::NAN } else { 2.0 + 0.5 * f64::from(k) }).collect()
    }

    /// Failed: one empty cell refused the record. Up to 20 rows are bridged, the next test has 21.
    #[test]
    fn a_flow_that_is_read_less_often_is_bridged() {
        let record = record(64).with_flow(flow(64, |k| !k.is_multiple_of(21))).expect("a flow in each 21st row");
        assert_eq!(record.flow, Some(flow(64, |_| false)));
        assert_eq!(record.segments, std::slice::from_ref(&(0..64)));
    }

    /// Failed: a line began at the flow of a row that lacks a temperature, which nobody had looked at.
    #[test]
    fn no_line_ends_at_a_flow_that_is_none() {
        let mut record = record(61);
        record.segments = vec![0..10, 11..61];
        let mut flow = flow(61, |k| k == 11 || k == 12);
        flow[10] = 0.0;
        let record = record.with_flow(flow).expect("a flow in the rows that are used");
        let flow = record.flow.expect("a flow");
        assert!(record.segments.iter().cloned().flatten().all(|row| flow[row] == 2.0 + 0.5 * row as f64), "{flow:?}");
    }

    #[test]
    fn rows_far_from_a_reading_of_the_flow_are_not_used() {
        let is_missing = |k: u32| k < 3 || (20..41).contains(&k) || k == 50;
        let record = record(61).with_flow(flow(61, is_missing)).expect("a flow in most rows");
        assert_eq!(record.segments, [3..20, 41..61]);
        let note = record.notes.last().map(ToString::to_string);
        let expected =
            "column flow is missing in 25 rows: 1 taken from the straight line between readings, 24 not used";
        assert_eq!(note.as_deref(), Some(expected));
    }

    #[test]
    fn a_flow_of_few_rows_is_refused() {
        let error = record(61).with_flow(flow(61, |k| k > 6)).expect_err("seven rows");
        assert!(matches!(error, RecordError::FewFlows { usable: 7, .. }), "{error}");
        let error = record(61).with_position(&[f64::NAN; 61]).expect_err("no position");
        assert!(matches!(error, RecordError::FewFlows { usable: 0, .. }), "{error}");
    }

    #[test]
    fn a_flow_that_is_none_is_refused_with_its_row() {
        for value in [0.0, -1.0, f64::INFINITY] {
            let mut flow = flow(61, |_| false);
            flow[6] = value;
            let error = record(61).with_flow(flow).expect_err("no flow");
            assert!(error.to_string().starts_with("rig: sample 7, column flow: expected a positive flow"), "{error}");
        }
    }

    /// From 0.5 m/s to none, over a hole of 30 rows: nobody knows how the sensors moved there.
    #[test]
    fn no_speed_is_taken_across_a_long_hole() {
        let position: Vec<f64> = (0..90_u32)
            .map(|k| match k {
                0..30 => 0.5 * f64::from(k),
                30..60 => f64::NAN,
                _ => 100.0 + 1e-3 * f64::from(k),
            })
            .collect();
        let record = record(90).with_position(&position).expect("sensors that move");
        assert_eq!(record.segments, [0..30, 60..90]);
        let speed_m_s = record.speed_m_s.expect("a speed");
        // To the rounding of positions of 100 m in slopes over some seconds.
        let is_near = |row: usize| (speed_m_s[row] - if row < 30 { 0.5 } else { 1e-3 }).abs() < 1e-12;
        assert!((0..30).chain(60..90).all(is_near), "{speed_m_s:?}");
    }

    /// The position goes 0.5 m in each second.
    #[test]
    fn the_speed_is_bridged_where_a_position_is_missing() {
        let position = flow(61, |k| k == 30);
        let record = record(61).with_position(&position).expect("sensors that move");
        let speed_m_s = record.speed_m_s.expect("a speed");
        assert!(speed_m_s.iter().all(|speed| (speed - 0.5).abs() < 1e-12), "{speed_m_s:?}");
    }
}
