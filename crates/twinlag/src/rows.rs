//! The rows of a record as the model of a rig takes them.

use twinlag_diagnose::{KnownTimeConstant, Masked, Observations, Settings, Stretch};
use twinlag_record::{Grid, Record};

use twinlag_cross_relation::Parameter;

use crate::error::Error;
use crate::options::Options;

/// Samples of a stretch below which it is left out.
const MIN_STRETCH_SAMPLES: usize = 8;

/// Readings, and the row of the record that each is.
pub(crate) struct Rows {
    pub(crate) observations: Observations,
    /// The row of each sample through all stretches; `None` for one that is missing from the
    /// record.
    pub(crate) of_sample: Vec<Option<usize>>,
}

impl Rows {
    pub(crate) fn of(record: &Record) -> Result<Self, Error> {
        let grid = record.grid().without_short(MIN_STRETCH_SAMPLES);
        let of_sample = grid.rows().collect();
        Ok(Self { observations: on(grid)?, of_sample })
    }

    /// Puts lines of the file and stamps in the place of samples.
    pub(crate) fn place(&self, masked: &mut Masked, record: &Record) {
        for (sample, time_s) in masked.rows.iter_mut().zip(&mut masked.time_s) {
            // Only a reading that is there can be left out.
            if let Some(row) = self.of_sample[*sample] {
                (*sample, *time_s) = (record.place_of(row).number(), record.time_s[row]);
            }
        }
    }
}

/// The row of each sample, as [`Rows::of_sample`] has it.
pub(crate) fn row_of_sample(record: &Record) -> Vec<Option<usize>> {
    record.grid().without_short(MIN_STRETCH_SAMPLES).rows().collect()
}

/// The readings of a record.
pub(crate) fn observations(record: &Record) -> Result<Observations, Error> {
    on(record.grid().without_short(MIN_STRETCH_SAMPLES))
}

fn on(grid: Grid) -> Result<Observations, Error> {
    let stretches = grid.stretches.into_iter().map(|stretch| {
        let missing = stretch.missing();
        let out = Stretch::new(stretch.time_s, stretch.reading_c).with_missing([missing.clone(), missing]);
        match stretch.flow {
            Some(flow) => out.with_flow(flow),
            None => out,
        }
    });
    Ok(Observations::new(stretches.collect(), grid.period_s)?)
}

/// What the options say of noise and time constants beforehand, as settings of a diagnosis.
pub(crate) fn settings_of(options: &Options) -> Settings {
    let known = options.known.iter().filter_map(|k| {
        let sensor = match k.parameter {
            Parameter::Tau1 => 0,
            Parameter::Tau2 => 1,
            _ => return None,
        };
        Some(KnownTimeConstant { sensor, value_s: k.value, std_s: k.std })
    });
    Settings { noise_std_k: options.noise_std_k, known: known.collect(), ..Settings::default() }
}
