//! Gas temperature and time constants, reading by reading.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::Deserialize;
use twinlag::record::Record as RecordInner;
use twinlag::{Live as Inner, LiveOptions, LiveState, Model, Options};
use twinlag_study::{with_hash, without_hash};

use crate::answer::{Answer, Said};
use crate::error::of_verb;
use crate::record::Record;
use crate::verbs::parsed;

/// What is asked of a live track.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    options: Options,
    #[serde(default)]
    model: Option<Model>,
    #[serde(default)]
    change_per_root_s: Option<f64>,
}

/// Name and number of the layout of a state: a line with the SHA-256 of the next one, which is [`LiveState`].
const STATE_SCHEMA: &str = "twinlag.live-state-file/1";

/// `error` as Python's `ValueError`.
fn refused(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Both ends of a band, where there is one.
type Band = Option<(f64, f64)>;

/// Tracks both sensors after a start.
#[pyclass(frozen, module = "twinlag._core")]
#[derive(Debug)]
pub(crate) struct Live {
    inner: Mutex<Inner>,
    start: Py<Answer>,
}

impl Live {
    /// - `records`: the start, where it is at hand
    fn of(py: Python<'_>, live: Inner, records: Vec<Arc<RecordInner>>) -> PyResult<Self> {
        let said = Said::Characterisation(Box::new(live.start.clone()));
        let start = Py::new(py, Answer { said, records })?;
        Ok(Self { inner: Mutex::new(live), start })
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Live {
    #[new]
    fn new(py: Python<'_>, record: PyRef<'_, Record>, asked: &str) -> PyResult<Self> {
        let Asked { options: characterise, model, change_per_root_s } = parsed(asked)?;
        let options = LiveOptions { characterise, model, change_per_root_s };
        let record = record.inner.clone();
        let live = py.detach(|| Inner::start(&record, &options)).map_err(|error| of_verb(&error))?;
        Self::of(py, live, vec![record])
    }

    /// Goes on from a state.
    #[staticmethod]
    fn resumed(py: Python<'_>, state: &str) -> PyResult<Self> {
        let text = without_hash(STATE_SCHEMA, state.as_bytes()).map_err(refused)?;
        let state: LiveState = serde_json::from_slice(text).map_err(refused)?;
        let live = Inner::resume(state).map_err(refused)?;
        Self::of(py, live, Vec::new())
    }

    /// What is known now, as text.
    fn state(&self) -> PyResult<String> {
        let text = serde_json::to_string(&self.inner().state()).map_err(refused)?;
        Ok(with_hash(STATE_SCHEMA, &(text + "\n")))
    }

    /// The characterisation of the start.
    #[getter]
    fn start(&self, py: Python<'_>) -> Py<Answer> {
        self.start.clone_ref(py)
    }

    /// What is known once a row is read: time, gas temperature and its standard deviation, then time constant and band of each
    /// sensor, whether they may have left the range that is tracked, what the bands were multiplied by, and whether there was a long pause; `None` of a row that is
    /// left out.
    #[pyo3(signature = (t1_c, t2_c, time_s = None))]
    #[expect(clippy::type_complexity, reason = "a row, which the package gives its names")]
    fn push(
        &self,
        t1_c: Option<f64>,
        t2_c: Option<f64>,
        time_s: Option<f64>,
    ) -> Option<(f64, f64, f64, (Option<f64>, Option<f64>), (Band, Band), bool, f64, bool)> {
        let now = self.inner().push(time_s, [t1_c, t2_c])?;
        let [first, second] = now.tau_s;
        let [band, other] = now.tau_95_s.map(|band| band.map(|[low, high]| (low, high)));
        Some((
            now.time_s,
            now.gas_c,
            now.gas_std_k,
            (first, second),
            (band, other),
            now.is_beyond,
            now.widened_by,
            now.is_resumed,
        ))
    }
}
