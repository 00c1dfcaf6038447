//! Several records one after the other, for pictures and summaries of all of them.

use std::sync::Arc;

use crate::record::Record;

impl Record {
    /// The rows of several records of the same sensors, one record after the other. Names and the spacing of the stamps are those
    /// of the first; a reference, a flow or a speed is there where all have one.
    ///
    /// - `records`: with how much later each is to be, s; one is later than the one before it
    ///
    /// ```
    /// use twinlag_record::{Channels, Record, SamplingChoice};
    ///
    /// let record = |source: &str| {
    ///     let time_s: Vec<f64> = (0..20).map(|k| 0.25 * f64::from(k)).collect();
    ///     let reading = |late_s: f64| time_s.iter().map(|t| 20.0 + (t - late_s).sin()).collect::<Vec<f64>>();
    ///     let (mut t1_c, t2_c) = (reading(0.0), reading(0.4));
    ///     t1_c[8] = f64::NAN; // a reading that is missing
    ///     let (source, names) = (source.into(), ["bare".into(), "sheathed".into()]);
    ///     Record::from_channels(Channels { source, names, time_s, t1_c, t2_c, reference_c: None }, SamplingChoice::Auto)
    /// };
    /// let (one, two) = (record("monday.csv")?, record("tuesday.csv")?);
    /// let both = Record::joined(&[(&one, 0.0), (&two, 10.0)]).expect("two records");
    /// assert_eq!((both.len(), both.source.as_str()), (40, "monday.csv, tuesday.csv"));
    /// assert_eq!((both.time_s[20], both.segments.len()), (10.0, 4));
    /// assert_eq!((both.length_s(), both.observed_s()), (9.5, 8.5));
    /// assert!(Record::joined(&[]).is_none());
    /// # Ok::<(), twinlag_record::RecordError>(())
    /// ```
    pub fn joined(records: &[(&Self, f64)]) -> Option<Self> {
        let ((first, later_s), others) = records.split_first()?;
        let mut out = (*first).clone().without_lines();
        out.notes.clear();
        out.time_s.iter_mut().for_each(|t| *t += later_s);
        for (record, later_s) in others {
            let rows = out.len();
            out.source = format!("{}, {}", out.source, record.source);
            out.time_s.extend(record.time_s.iter().map(|t| t + later_s));
            Arc::make_mut(&mut out.t1_c).extend_from_slice(&record.t1_c);
            Arc::make_mut(&mut out.t2_c).extend_from_slice(&record.t2_c);
            out.reference_c = both(out.reference_c, record.reference_c.as_deref());
            out.flow = both(out.flow, record.flow.as_deref());
            out.speed_m_s = both(out.speed_m_s, record.speed_m_s.as_deref());
            out.missing += record.missing;
            out.starts.extend(record.starts.iter().map(|start| start + rows));
            out.segments.extend(record.segments.iter().map(|rows_of| rows_of.start + rows..rows_of.end + rows));
        }
        Some(out)
    }
}

fn both(one: Option<Vec<f64>>, other: Option<&[f64]>) -> Option<Vec<f64>> {
    let mut out = one?;
    out.extend_from_slice(other?);
    Some(out)
}
