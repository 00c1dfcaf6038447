//! The verbs, with their options as JSON.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use twinlag::compensation::Form;
use twinlag::diagnosis::Identifier;
use twinlag::optimise::Optimiser;
use twinlag::record::{Channels, Record as Inner, SamplingChoice};
use twinlag::signal::Rig;
use twinlag::{CompensateOptions, DiagnoseOptions, Model, Options, TrackOptions};

use crate::answer::{Answer, Said};
use crate::error::{of_options, of_record, of_verb};
use crate::record::Record;
use crate::watched::watched;

/// What the package passes: the options of a characterisation, and what is asked beside them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    options: Options,
    #[serde(default)]
    without: Vec<Identifier>,
    #[serde(default)]
    model: Option<Model>,
    #[serde(default)]
    form: Form,
    /// The channel, 0 or 1, that is taken to be right.
    #[serde(default)]
    trusted: usize,
    #[serde(default)]
    window_s: Option<f64>,
}

/// Reads what the package passes. An optimiser that is named alone has its usual numbers.
pub(crate) fn parsed<T: DeserializeOwned>(json: &str) -> PyResult<T> {
    let mut asked: Value = serde_json::from_str(json).map_err(|error| PyValueError::new_err(error.to_string()))?;
    if let Some(optimiser) = asked.pointer_mut("/options/optimiser")
        && let Some(name) = optimiser.as_str()
    {
        let named = Optimiser::by_name(name).map_err(|error| PyValueError::new_err(error.to_string()))?;
        *optimiser = serde_json::to_value(named).map_err(|error| PyValueError::new_err(error.to_string()))?;
    }
    serde_path_to_error::deserialize(asked).map_err(|error| of_options(&error))
}

/// The records, shared: what is asked of them outlives the call.
fn shared(records: &[PyRef<'_, Record>]) -> Vec<Arc<Inner>> {
    records.iter().map(|record| Arc::clone(&record.inner)).collect()
}

/// Copies for verbs that take several records in a row. Their readings are shared, not copied.
pub(crate) fn in_a_row(records: &[Arc<Inner>]) -> Vec<Inner> {
    records.iter().map(|record| record.as_ref().clone()).collect()
}

/// Estimates both time constants of a record, or of several of one rig.
#[pyfunction]
#[pyo3(signature = (records, asked, progress = None))]
pub(crate) fn characterise(
    py: Python<'_>,
    records: Vec<PyRef<'_, Record>>,
    asked: &str,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let Asked { options, model, .. } = parsed(asked)?;
    let records = shared(&records);
    let answer = watched(py, progress.as_ref(), |watch| match (&records[..], &model) {
        ([one], Some(model)) => twinlag::characterise_with(one, model, &options),
        ([one], None) => twinlag::characterise_watched(one, &options, watch),
        (several, _) => twinlag::characterise_records_watched(&in_a_row(several), &options, watch),
    })?;
    Ok(Answer { said: Said::Characterisation(Box::new(answer)), records })
}

/// Finds the effects that two first-order lags lack, in a record or in several of one rig.
#[pyfunction]
#[pyo3(signature = (records, asked, progress = None))]
pub(crate) fn diagnose(
    py: Python<'_>,
    records: Vec<PyRef<'_, Record>>,
    asked: &str,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let Asked { options: characterise, without, .. } = parsed(asked)?;
    let options = DiagnoseOptions { characterise, without, ..DiagnoseOptions::default() };
    let records = shared(&records);
    let answer = watched(py, progress.as_ref(), |watch| match &records[..] {
        [one] => twinlag::diagnose_watched(one, &options, watch),
        several => twinlag::diagnose_records_watched(&in_a_row(several), &options, watch),
    })?;
    Ok(Answer { said: Said::Diagnosis(Box::new(answer)), records })
}

/// Reconstructs the gas temperature.
#[pyfunction]
#[pyo3(signature = (record, asked, progress = None))]
pub(crate) fn compensate(
    py: Python<'_>,
    record: PyRef<'_, Record>,
    asked: &str,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let Asked { options: characterise, without, model, form, trusted, .. } = parsed(asked)?;
    let diagnose = DiagnoseOptions { characterise, without, ..DiagnoseOptions::default() };
    let options = CompensateOptions { diagnose, model, form, trusted };
    let record = Arc::clone(&record.inner);
    let answer = watched(py, progress.as_ref(), |watch| twinlag::compensate_watched(&record, &options, watch))?;
    Ok(Answer { said: Said::Compensation(Box::new(answer)), records: vec![record] })
}

/// Estimates both time constants along a record.
#[pyfunction]
#[pyo3(signature = (record, asked, progress = None))]
pub(crate) fn track(
    py: Python<'_>,
    record: PyRef<'_, Record>,
    asked: &str,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let Asked { options: characterise, model, window_s, .. } = parsed(asked)?;
    let options = TrackOptions { characterise, model, window_s };
    let record = Arc::clone(&record.inner);
    let answer = watched(py, progress.as_ref(), |watch| twinlag::track_watched(&record, &options, watch))?;
    Ok(Answer { said: Said::Track(Box::new(answer)), records: vec![record] })
}

/// Fails where a text is no model that this version reads.
#[pyfunction]
pub(crate) fn check_model(text: &str) -> PyResult<()> {
    let Model { schema, .. } = parsed(text)?;
    let is_read = schema == Model::SCHEMA;
    is_read
        .then_some(())
        .ok_or_else(|| PyValueError::new_err(format!("expected schema {}, got {schema}", Model::SCHEMA)))
}

/// Simulates a rig, given as TOML or, with `is_json`, as JSON.
#[pyfunction]
pub(crate) fn simulate(py: Python<'_>, rig: &str, is_json: bool, source: String) -> PyResult<Record> {
    let rig: Rig = if is_json {
        parsed(rig)?
    } else {
        toml::from_str(rig).map_err(|error| PyValueError::new_err(error.to_string()))?
    };
    let simulated = py.detach(|| rig.simulate()).map_err(|error| of_verb(&error.into()))?;
    let channels = Channels {
        source,
        names: simulated.channels,
        time_s: simulated.time_s,
        t1_c: simulated.t1_c,
        t2_c: simulated.t2_c,
        reference_c: Some(simulated.gas_c),
    };
    let record = Inner::from_channels(channels, SamplingChoice::Auto).map_err(|error| of_record(&error))?;
    Ok(Record { inner: Arc::new(record) })
}
