//! A gas temperature held against a trusted one: the only place where that is done.

use serde::{Deserialize, Serialize};
use twinlag_compensate::{Form, Gas, learn_quickly, reconstruct};
use twinlag_cross_relation::Z_975;
use twinlag_diagnose::{BeforeAfter, Diagnosis as Core, ModelFit};
use twinlag_record::Record;

use crate::rows::RowOfSample;

/// How good the gas temperature is, measured against a trusted one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct AgainstReference {
    /// Root mean square error, K.
    #[serde(rename = "rmse_K")]
    pub rmse_k: f64,
    /// Root mean square error of the faster sensor's readings, K.
    #[serde(rename = "raw_rmse_K")]
    pub raw_rmse_k: f64,
    /// Share of the instants at which the reference lies within the 95 % band.
    pub inside_95: f64,
}

/// The trusted temperature of a record at the samples of a reconstruction.
pub(crate) struct Reference<'a> {
    record: &'a Record,
    reference_c: &'a [f64],
    row_of_sample: &'a RowOfSample,
}

impl<'a> Reference<'a> {
    /// - `row_of_sample`: the row of the record that each sample is
    pub(crate) fn of(record: &'a Record, row_of_sample: &'a RowOfSample) -> Option<Self> {
        Some(Self { record, reference_c: record.reference_c.as_deref()?, row_of_sample })
    }

    /// Root mean square errors of both models of a diagnosis on the blocks that judge, K: of the
    /// gas temperature that the smoother reconstructs with each.
    pub(crate) fn before_and_after(&self, core: &Core) -> Option<BeforeAfter<f64>> {
        let rmse = |fit: &ModelFit| {
            let gas = gas(fit)?;
            self.rmse(|k| gas.gas_c[k], fit.trace.judged.iter().cloned().flatten())
        };
        Some(BeforeAfter { before: rmse(&core.base)?, after: rmse(&core.last)? })
    }

    /// - `gas_c`, `std_k`: the gas temperature at every sample and its standard deviation
    /// - `faster`: the channel that lags less, 0 or 1
    pub(crate) fn against(&self, gas_c: &[f64], std_k: &[f64], faster: usize) -> Option<AgainstReference> {
        let raw_c = [&self.record.t1_c, &self.record.t2_c][faster];
        let is_read = |sample: &usize| self.row_of_sample.get(*sample).is_some_and(|row| raw_c[row].is_finite());
        let samples = || (0..gas_c.len()).filter(is_read);
        let rmse_k = self.rmse(|k| gas_c[k], samples())?;
        let raw_rmse_k = self.rmse(|k| self.row_of_sample.get(k).map_or(f64::NAN, |row| raw_c[row]), samples())?;
        let is_inside = self.errors(|k| gas_c[k], samples()).map(|(k, error)| error.abs() <= Z_975 * std_k[k]);
        let (inside, all) = is_inside.fold((0.0, 0.0_f64), |(inside, all), is| (inside + f64::from(is), all + 1.0));
        let inside_95 = inside / all;
        Some(AgainstReference { rmse_k, raw_rmse_k, inside_95 })
    }

    /// Samples with their errors, K, where sample and reference are there.
    fn errors(
        &self,
        value_c: impl Fn(usize) -> f64,
        samples: impl Iterator<Item = usize>,
    ) -> impl Iterator<Item = (usize, f64)> {
        let errors = samples.filter_map(move |k| Some((k, value_c(k) - self.reference_c[self.row_of_sample.get(k)?])));
        errors.filter(|(_, error)| error.is_finite())
    }

    fn rmse(&self, value_c: impl Fn(usize) -> f64, samples: impl Iterator<Item = usize>) -> Option<f64> {
        let (sum, count) =
            self.errors(value_c, samples).fold((0.0, 0.0_f64), |(sum, n), (_, error)| (sum + error * error, n + 1.0));
        (count > 0.0).then(|| (sum / count).sqrt())
    }
}

/// The gas temperature by the model of `fit`, without what its parameters add to the bands; `None`
/// where the model gives none.
fn gas(fit: &ModelFit) -> Option<Gas> {
    let extended = fit.extended.as_ref()?;
    let (readings, rig) = extended.rig(extended.parameters()).ok()?;
    let prior = learn_quickly(&readings, &rig).ok()?.prior;
    reconstruct(&readings, &rig, &prior, Form::Smoother).ok()
}
