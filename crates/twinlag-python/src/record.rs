//! Records: of arrays, or of files.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use twinlag::record::{NamedColumn, Record as Inner, SamplingKind, Selection, Table};
use twinlag_files::Choice;

use crate::column::Column;
use crate::error::{RecordError, of_file, of_record};
use crate::verbs::parsed;

/// Two temperatures over time, checked.
#[pyclass(frozen, module = "twinlag._core")]
#[derive(Debug)]
pub(crate) struct Record {
    pub(crate) inner: Arc<Inner>,
}

/// An array of numbers, or of nanoseconds since 1970-01-01 of which the least integer is a missing one, or texts.
#[derive(FromPyObject)]
enum Values<'py> {
    Numbers(PyReadonlyArray1<'py, f64>),
    Instants(PyReadonlyArray1<'py, i64>),
    Texts(Vec<String>),
}

fn column((name, unit, values): (String, String, Values<'_>)) -> PyResult<NamedColumn> {
    let contiguous = |error: numpy::AsSliceError| PyTypeError::new_err(format!("'{name}': {error}"));
    let column = match values {
        Values::Numbers(values) => NamedColumn::numbers(name.clone(), values.as_slice().map_err(contiguous)?.to_vec()),
        Values::Instants(values) => {
            let instants = values.as_slice().map_err(contiguous)?.iter();
            let instants = instants.map(|ns| Some(*ns).filter(|ns| *ns != i64::MIN)).collect::<Vec<_>>();
            NamedColumn::instants_ns(name.clone(), instants)
        }
        Values::Texts(values) => NamedColumn::texts(name.clone(), values),
    };
    Ok(column.with_unit(unit))
}

#[pymethods]
impl Record {
    /// A record of columns: name, unit and array of each.
    #[staticmethod]
    fn from_columns(
        py: Python<'_>,
        source: String,
        columns: Vec<(String, String, Values<'_>)>,
        selection: &str,
    ) -> PyResult<Self> {
        let selection: Selection = parsed(selection)?;
        let columns = columns.into_iter().map(column).collect::<PyResult<Vec<_>>>()?;
        let made = py.detach(|| Inner::from_owned(Table::from_columns(source, columns)?, &selection));
        Ok(Self { inner: Arc::new(made.map_err(|error| of_record(&error))?) })
    }

    /// A record of a file. One of text has no groups: that one is asked for is refused.
    #[staticmethod]
    #[pyo3(signature = (path, selection, group = None, join = false))]
    fn read(py: Python<'_>, path: PathBuf, selection: &str, group: Option<String>, join: bool) -> PyResult<Self> {
        let selection: Selection = parsed(selection)?;
        let is_of_groups = group.is_some() || join;
        let choice = Choice { group, join, ..Choice::of(&selection) };
        let table = py.detach(|| {
            if twinlag_files::is_binary(&path) {
                twinlag_files::read(&path, &choice).map_err(|error| of_file(&error))
            } else if is_of_groups {
                let what = "expected no group and no join: it is text, which has one group alone";
                Err(RecordError::new_err((format!("{}: {what}", path.display()),)))
            } else {
                Table::from_path(&path).map_err(|error| of_record(&error))
            }
        })?;
        let made = py.detach(|| Inner::from_owned(table, &selection));
        Ok(Self { inner: Arc::new(made.map_err(|error| of_record(&error))?) })
    }

    /// What it is called in messages.
    #[getter]
    fn source(&self) -> &str {
        &self.inner.source
    }

    /// Names of the two sensors.
    #[getter]
    fn channels(&self) -> (&str, &str) {
        let [first, second] = &self.inner.channels;
        (first, second)
    }

    /// How it was read.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.inner.notes.iter().map(ToString::to_string).collect()
    }

    /// Rows in which a temperature is missing.
    #[getter]
    fn missing(&self) -> usize {
        self.inner.missing
    }

    /// Time between samples, s: of uneven ones the median.
    #[getter]
    fn sample_period_s(&self) -> f64 {
        self.inner.sampling.period_s
    }

    /// Whether samples are taken to be where their stamps are, uneven ones.
    #[getter]
    fn is_irregular(&self) -> bool {
        self.inner.sampling.kind == SamplingKind::Irregular
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    /// Instants, s from the first.
    #[getter]
    fn time_s(&self) -> Column<'_> {
        Column(&self.inner.time_s)
    }

    /// Readings of the first sensor, °C; NaN where one is missing.
    #[getter]
    fn t1_c(&self) -> Column<'_> {
        Column(&self.inner.t1_c)
    }

    /// Readings of the second sensor, °C; NaN where one is missing.
    #[getter]
    fn t2_c(&self) -> Column<'_> {
        Column(&self.inner.t2_c)
    }

    /// The reference, °C, if there is one.
    #[getter]
    fn reference_c(&self) -> Option<Column<'_>> {
        self.inner.reference_c.as_deref().map(Column)
    }

    /// The flow in the unit of its column, if there is one.
    #[getter]
    fn flow(&self) -> Option<Column<'_>> {
        self.inner.flow.as_deref().map(Column)
    }

    /// The speed of sensors that move, m/s, if their position is known.
    #[getter]
    fn speed_m_s(&self) -> Option<Column<'_>> {
        self.inner.speed_m_s.as_deref().map(Column)
    }
}
