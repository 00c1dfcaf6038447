//! The data that a model was found in.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use twinlag_record::Record;

use crate::answers::RecordSummary;

/// How far beyond the range of its data a model is taken to hold, as a share of the range's width. A straight line through
/// readings that fill a range has, `d` half widths from the middle, the variance `1 + 3 d²` in units of that in the middle:
/// at this distance beyond an end (`d = 1.2`) its standard deviation is 15 % larger than at the end.
const BEYOND_SHARE: f64 = 0.1;
/// Share of the readings that may lie farther out: spikes, and the extremes of a longer record. In a normal gas the extremes of
/// 300 readings are 2.9 standard deviations from the mean, and 0.05 % are more than a tenth of the range beyond these.
const MAX_SHARE_BEYOND: f64 = 1e-3;
/// Periods that differ by less count as alike. What the gas does between samples costs a lag a share of `(T/τ)²/12` at most,
/// as if it went in straight lines: at this factor that differs four times.
const PERIOD_FACTOR: f64 = 2.0;
/// Periods in a lag or a delay from which on the gas between samples costs less than 1 % of it, `(1/3)²/12`.
const PERIODS_IN_LAG: f64 = 3.0;

/// The data that a model was found in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FoundIn {
    /// File or name.
    pub source: String,
    /// SHA-256 of the readings: all times, s, all of channel 1 and all of channel 2, °C, each a little-endian double; those that
    /// are missing are the quiet NaN `0x7ff8000000000000`.
    pub sha256: String,
    /// Rows.
    pub samples: usize,
    /// Time from sample to sample, s.
    pub sample_period_s: f64,
    /// Time from the first row to the last, s; of several records, the sum over these.
    pub length_s: f64,
    /// Smallest and largest temperature of each channel, °C.
    #[serde(rename = "temperatures_C")]
    pub temperatures_c: [[f64; 2]; 2],
}

impl FoundIn {
    pub(crate) fn of(record: &Record) -> Self {
        Self {
            source: record.source.clone(),
            sha256: sha256(record),
            samples: record.len(),
            sample_period_s: RecordSummary::of(record).sample_period_s,
            length_s: record.length_s(),
            temperatures_c: [range(&record.t1_c), range(&record.t2_c)],
        }
    }

    /// Whether `record` has these readings.
    pub(crate) fn is(&self, record: &Record) -> bool {
        self.samples == record.len() && self.sha256 == sha256(record)
    }

    /// In what `record` lies outside these data, as clauses for the reader.
    ///
    /// - `shortest`: name and size, s, of the shortest time among the numbers that are held
    pub(crate) fn outside(&self, record: &Record, shortest: Option<(&str, f64)>) -> Vec<String> {
        let mut out: Vec<String> = (0..2).filter_map(|i| self.hotter_or_colder(record, i)).collect();
        let here_s = RecordSummary::of(record).sample_period_s;
        let there_s = self.sample_period_s;
        let longest_s = here_s.max(there_s);
        if let Some((name, time_s)) = shortest
            && longest_s > PERIOD_FACTOR * here_s.min(there_s)
            && time_s < PERIODS_IN_LAG * longest_s
        {
            out.push(format!(
                "samples are {} s apart and were {} s apart in {}, which matters to the {name} of {} s",
                rounded(here_s),
                rounded(there_s),
                self.source,
                rounded(time_s)
            ));
        }
        out
    }

    fn hotter_or_colder(&self, record: &Record, i: usize) -> Option<String> {
        let readings = [&record.t1_c, &record.t2_c][i];
        let [low, high] = self.temperatures_c[i];
        let margin = BEYOND_SHARE * (high - low);
        let known = || readings.iter().filter(|c| c.is_finite());
        let beyond = known().filter(|c| **c < low - margin || **c > high + margin).count();
        (beyond as f64 > MAX_SHARE_BEYOND * known().count() as f64).then(|| {
            let [least, most] = range(readings);
            let name = &record.channels[i];
            format!("{name} is {least:.1} to {most:.1} °C and was {low:.1} to {high:.1} °C in {}", self.source)
        })
    }
}

fn range(readings: &[f64]) -> [f64; 2] {
    let known = readings.iter().filter(|c| c.is_finite());
    known.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], c| [low.min(*c), high.max(*c)])
}

fn sha256(record: &Record) -> String {
    let mut hash = Sha256::new();
    for value in [&record.time_s, &record.t1_c, &record.t2_c].into_iter().flatten() {
        let bits = if value.is_nan() { 0x7ff8_0000_0000_0000 } else { value.to_bits() };
        hash.update(bits.to_le_bytes());
    }
    base16ct::lower::encode_string(&hash.finalize())
}

/// `value` to four digits.
pub(crate) fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use twinlag_record::{Channels, SamplingChoice};

    use super::*;

    fn record(period_s: f64, t1_c: &[f64]) -> Record {
        let channels = Channels {
            source: "run.csv".into(),
            names: ["T1".into(), "T2".into()],
            time_s: (0..t1_c.len()).map(|k| k as f64 * period_s).collect(),
            t1_c: t1_c.to_vec(),
            t2_c: (0..t1_c.len()).map(|k| [20.0, 20.5, 21.0, 21.5, 20.5, 20.0, 20.25, 20.5][k % 8]).collect(),
            reference_c: None,
        };
        Record::from_channels(channels, SamplingChoice::Auto).expect("a sound record")
    }

    const T1_C: [f64; 16] =
        [20.0, 21.0, 22.5, f64::NAN, 19.0, 20.0, 20.5, 21.0, 20.0, 21.0, 22.5, 20.5, 19.0, 20.0, 20.5, 21.0];

    /// The hash is that which Python's `hashlib.sha256` gives of the same bytes, packed by `struct.pack('<d', value)`.
    #[test]
    fn the_data_of_a_model_are_summarised_as_read() {
        let record = record(0.5, &T1_C);
        let data = FoundIn::of(&record);
        assert_eq!(data.sha256, "134c95e971dbc9ea79be6d3ac63a0c26ec6665107c02f0931cdebf82fc027734");
        assert_eq!(data.temperatures_c, [[19.0, 22.5], [20.0, 21.5]]);
        assert_eq!((data.samples, data.sample_period_s, data.length_s), (16, 0.5, 7.5));
        assert!(data.is(&record));
    }

    /// A reading is enough for another record.
    #[test]
    fn one_reading_makes_another_record() {
        let mut t1_c = T1_C;
        t1_c[7] += 1e-9;
        assert!(!FoundIn::of(&record(0.5, &T1_C)).is(&record(0.5, &t1_c)));
    }

    /// The range is 3.5 K wide, so 0.35 K beyond its ends are still inside.
    #[test]
    fn a_record_is_outside_where_it_is_hotter_or_colder() {
        let data = FoundIn::of(&record(0.5, &T1_C));
        let ends_at = |hottest: f64| {
            let mut t1_c = T1_C;
            t1_c[2] = hottest;
            data.outside(&record(0.5, &t1_c), None)
        };
        assert_eq!(ends_at(22.84), Vec::<String>::new());
        assert_eq!(ends_at(22.86), ["T1 is 19.0 to 22.9 °C and was 19.0 to 22.5 °C in run.csv"]);
    }

    /// One reading in 2000 may be anywhere.
    #[test]
    fn a_spike_is_no_other_range() {
        let mut t1_c = T1_C.repeat(125);
        let data = FoundIn::of(&record(0.5, &t1_c));
        t1_c[1000] = 500.0;
        assert_eq!(data.outside(&record(0.5, &t1_c), None), Vec::<String>::new());
    }

    /// Lags of 1 s have two samples at one of the periods, 10 at the other; lags of 10 s have 20 and 100, which costs them 1/4800.
    #[test]
    fn a_period_matters_to_lags_that_it_hardly_resolves() {
        let data = FoundIn::of(&record(0.1, &T1_C));
        let here = record(0.5, &T1_C);
        let outside = data.outside(&here, Some(("delay", 1.0)));
        let said = "samples are 0.5 s apart and were 0.1 s apart in run.csv, which matters to the delay of 1 s";
        assert_eq!(outside, [said]);
        assert_eq!(data.outside(&here, Some(("delay", 10.0))), Vec::<String>::new());
        assert_eq!(FoundIn::of(&here).outside(&here, Some(("delay", 1.0))), Vec::<String>::new());
    }
}
