//! The rows of a record as the model of a rig takes them.

use twinlag_diagnose::{Instants, KnownTimeConstant, Masked, Observations, Settings, Stretch};
use twinlag_model::FlowKind;
use twinlag_record::{Grid, Record};

use crate::error::Error;
use crate::options::Options;
use crate::verbs::sensor_of;

/// Samples of a stretch below which it is left out.
const MIN_STRETCH_SAMPLES: usize = 8;

/// The row of a record that each sample through all stretches is, in runs of neighbours.
#[derive(Clone, Debug, Default)]
pub(crate) struct RowOfSample {
    /// First sample and first row of each run, and how long it is; in order.
    runs: Vec<[usize; 3]>,
}

impl RowOfSample {
    pub(crate) fn of(record: &Record) -> Self {
        Self::in_runs(record.grid().without_short(MIN_STRETCH_SAMPLES).rows())
    }

    /// - `rows`: that of each sample, `None` for one that is missing from the record
    fn in_runs(rows: impl Iterator<Item = Option<usize>>) -> Self {
        let mut runs: Vec<[usize; 3]> = Vec::new();
        for (sample, row) in rows.enumerate().filter_map(|(sample, row)| Some((sample, row?))) {
            match runs.last_mut() {
                Some([first, first_row, count]) if [*first + *count, *first_row + *count] == [sample, row] => {
                    *count += 1;
                }
                _ => runs.push([sample, row, 1]),
            }
        }
        Self { runs }
    }

    /// Those of several records, one after the other as [`Record::joined`] has them.
    pub(crate) fn joined(records: &[Record], rows: &[Rows]) -> Self {
        let (mut samples, mut rows_before, mut runs) = (0, 0, Vec::new());
        for (record, rows) in records.iter().zip(rows) {
            let moved = |[first, row, count]: &[usize; 3]| [first + samples, row + rows_before, *count];
            runs.extend(rows.of_sample.runs.iter().map(moved));
            samples += rows.observations.samples();
            rows_before += record.len();
        }
        Self { runs }
    }

    /// The row of a sample; `None` of one that is missing from the record.
    pub(crate) fn get(&self, sample: usize) -> Option<usize> {
        let run = self.runs.partition_point(|[first, ..]| *first <= sample).checked_sub(1)?;
        let [first, row, count] = self.runs[run];
        (sample < first + count).then(|| row + (sample - first))
    }
}

/// The row of a record that each sample of an answer's series is, such as of [`Compensation::time_s`](crate::Compensation::time_s);
/// `None` of a sample that is missing in the record.
pub fn rows_of_samples(record: &Record) -> Vec<Option<usize>> {
    record.grid().without_short(MIN_STRETCH_SAMPLES).rows().collect()
}

/// Readings, and the row of the record that each is.
pub(crate) struct Rows {
    pub(crate) observations: Observations,
    pub(crate) of_sample: RowOfSample,
}

impl Rows {
    pub(crate) fn of(record: &Record) -> Result<Self, Error> {
        let grid = record.grid().without_short(MIN_STRETCH_SAMPLES);
        let of_sample = RowOfSample::in_runs(grid.rows());
        Ok(Self { observations: on(grid)?, of_sample })
    }

    /// Puts lines of the file and stamps in the place of samples.
    pub(crate) fn place(&self, masked: &mut Masked, record: &Record) {
        for (sample, time_s) in masked.rows.iter_mut().zip(&mut masked.time_s) {
            // Only a reading that is there can be left out.
            if let Some(row) = self.of_sample.get(*sample) {
                (*sample, *time_s) = (record.place_of(row).number(), record.time_s[row]);
            }
        }
    }
}

/// The readings of a record.
pub(crate) fn observations(record: &Record) -> Result<Observations, Error> {
    on(record.grid().without_short(MIN_STRETCH_SAMPLES))
}

fn on(grid: Grid) -> Result<Observations, Error> {
    let period_s = grid.period_s;
    let stretches = grid.stretches.into_iter().map(|stretch| {
        let missing = stretch.missing();
        let time_s = match (period_s, stretch.time_s.first()) {
            (Some(period_s), Some(first_s)) => Instants::even(*first_s, period_s, stretch.time_s.len()),
            _ => Instants::from(stretch.time_s),
        };
        let out = Stretch::sharing(time_s, stretch.reading_c).with_missing([missing.clone(), missing]);
        match (stretch.flow, stretch.speed_m_s) {
            (Some(flow), _) => out.with_flow(flow),
            (None, Some(speed_m_s)) => out.with_motion(speed_m_s),
            (None, None) => out,
        }
    });
    Ok(Observations::new(stretches.collect(), period_s)?)
}

/// Checks that a flow that was measured changes, along a record or from record to record.
///
/// - `observations`: of all `records`
pub(crate) fn check_flow(observations: &Observations, records: &[Record]) -> Result<(), Error> {
    match observations.flow() {
        Some(flow) if flow.kind() == FlowKind::Flow && !flow.changes() => {
            let files = records.iter().map(|record| record.source.clone()).collect();
            let first = |record: &Record| Some(record.flow.as_ref()?[record.segments.first()?.start]);
            let value = records.first().and_then(first).unwrap_or_else(|| flow.reference());
            Err(Error::SteadyFlow { files, value })
        }
        _ => Ok(()),
    }
}

/// What the options say of noise and time constants beforehand, as settings of a diagnosis.
pub(crate) fn settings_of(options: &Options) -> Settings {
    let known = options.known.iter().filter_map(|known| {
        Some(KnownTimeConstant { sensor: sensor_of(known)?, value_s: known.value, std_s: known.std })
    });
    Settings { noise_std_k: options.noise_std_k, known: known.collect(), ..Settings::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples before, between and behind rows, and rows that are left out between two stretches.
    #[test]
    fn each_sample_has_its_row() {
        let rows = [None, Some(2), Some(3), None, None, Some(4), Some(9), Some(10), None];
        let of_sample = RowOfSample::in_runs(rows.into_iter());
        let got: Vec<Option<usize>> = (0..rows.len()).map(|sample| of_sample.get(sample)).collect();
        assert_eq!(got, rows);
        assert_eq!(of_sample.runs.len(), 3);
        assert_eq!(RowOfSample::default().get(0), None);
    }
}
