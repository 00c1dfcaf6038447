//! Answers: as JSON, as arrays, as pages.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use twinlag::record::Record as Inner;
use twinlag::{Characterisation, Compensation, Diagnosis, Track, joined, rows_of_samples};
use twinlag_pages::{Making, diagnosis_report, gas_report, track_report};

use crate::column::Column;
use crate::error::of_verb;
use crate::verbs::in_a_row;

/// What a verb has said, with the records that it was asked about.
#[pyclass(frozen, module = "twinlag._core")]
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) said: Said,
    pub(crate) records: Vec<Arc<Inner>>,
}

/// What was said, by its verb.
#[derive(Debug)]
pub(crate) enum Said {
    Characterisation(Box<Characterisation>),
    Diagnosis(Box<Diagnosis>),
    Compensation(Box<Compensation>),
    Track(Box<Track>),
}

/// Numbers or texts in a row.
#[derive(IntoPyObject)]
pub(crate) enum Series<'a> {
    Numbers(Column<'a>),
    Texts(Vec<String>),
}

impl Answer {
    /// The record, or all of them joined.
    fn record(&self) -> PyResult<Arc<Inner>> {
        match &self.records[..] {
            [one] => Ok(Arc::clone(one)),
            several => Ok(Arc::new(joined(&in_a_row(several)).map_err(|error| of_verb(&error))?)),
        }
    }
}

#[pymethods]
impl Answer {
    /// The answer in the form of the program's `--json`.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        let text = py.detach(|| match &self.said {
            Said::Characterisation(answer) => serde_json::to_string(answer),
            Said::Diagnosis(answer) => serde_json::to_string(answer),
            Said::Compensation(answer) => serde_json::to_string(answer),
            Said::Track(answer) => serde_json::to_string(answer),
        });
        text.map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// The series of the answer, each with the name of the column that the program writes; none where it has none.
    fn series(&self) -> Vec<(String, Series<'_>)> {
        let numbers = |name: &str, values| (name.to_owned(), Series::Numbers(Column(values)));
        match &self.said {
            Said::Characterisation(_) | Said::Diagnosis(_) => Vec::new(),
            Said::Compensation(answer) => vec![
                numbers("time_s", &answer.time_s),
                numbers("gas_C", &answer.gas_c),
                numbers("gas_std_K", &answer.gas_std_k),
            ],
            Said::Track(answer) => {
                let mut series = vec![numbers("time_s", &answer.time_s)];
                for (sensor, number) in answer.sensors.iter().zip(1..) {
                    series.push(numbers(&format!("tau{number}_s"), &sensor.tau_s));
                    series.push(numbers(&format!("tau{number}_low_s"), &sensor.low_s));
                    series.push(numbers(&format!("tau{number}_high_s"), &sensor.high_s));
                }
                series.push(("grade".into(), Series::Texts(answer.grades.iter().map(ToString::to_string).collect())));
                series
            }
        }
    }

    /// For each row of the record the index of its sample in the series, from 0; `None` where it has none. Fails for a series that has other
    /// instants than the record.
    fn samples_of_rows(&self) -> PyResult<Vec<Option<usize>>> {
        let count = match &self.said {
            Said::Characterisation(_) | Said::Diagnosis(_) => 0,
            Said::Compensation(answer) => answer.time_s.len(),
            Said::Track(answer) => answer.time_s.len(),
        };
        let record = self.record()?;
        let mut samples = vec![None; record.len()];
        if count == 0 {
            return Ok(samples);
        }
        let rows = rows_of_samples(&record);
        if rows.len() != count {
            let what = "index: the series is one of windows, not of the rows of the record; leave the index out";
            return Err(PyValueError::new_err(what));
        }
        // The sample and the row after the last pair that is known.
        let mut next = (0, 0);
        for (sample, row) in rows.into_iter().enumerate().filter_map(|(sample, row)| Some((sample, row?))) {
            // A gap of missing readings alone has as many samples as rows. Where rows are absent as well, which sample a row is would take
            // its stamp: its rows stay `None`.
            if sample - next.0 == row - next.1 {
                (next.1..row).zip(next.0..).for_each(|(row, sample)| samples[row] = Some(sample));
            }
            samples[row] = Some(sample);
            next = (sample + 1, row + 1);
        }
        Ok(samples)
    }

    /// The model that the answer rests on, as JSON; `None` where there is none.
    fn model(&self) -> PyResult<Option<String>> {
        let model = match &self.said {
            Said::Diagnosis(answer) => Some(answer.model()),
            Said::Compensation(answer) => self.records.first().and_then(|record| answer.model(record)),
            Said::Characterisation(_) | Said::Track(_) => None,
        };
        let text = model.map(|model| serde_json::to_string_pretty(&model)).transpose();
        text.map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// The page of the answer, one HTML file, or its first screen; `None` of a characterisation, which has none.
    fn page(
        &self,
        py: Python<'_>,
        made_at: String,
        is_static: bool,
        is_first_screen: bool,
    ) -> PyResult<Option<String>> {
        let record = self.record()?;
        let making = Making { made_at, is_static, is_first_screen, ..Making::default() };
        let page = py.detach(|| match &self.said {
            Said::Characterisation(_) => Ok(None),
            Said::Diagnosis(answer) => diagnosis_report(&record, answer, &making).map(Some),
            Said::Compensation(answer) => gas_report(&record, answer, &making).map(Some),
            Said::Track(answer) => track_report(&record, answer, &making).map(Some),
        });
        page.map_err(|error| PyValueError::new_err(error.to_string()))
    }
}
