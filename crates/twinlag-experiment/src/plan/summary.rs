//! What a table for people shows, as the plan has it.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::ExperimentError;
use crate::plan::columns::check_names;
use crate::plan::method::Method;

/// Digits behind the decimal point that a table may show: numbers in results have seven significant
/// digits.
const MAX_DECIMALS: usize = 9;

/// A table with a row for each combination of labels and a column for each method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SummarySpec {
    /// File name without its extension.
    pub file: String,
    /// Column of the results that is shown.
    pub value: String,
    /// Column with its standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Labels whose combinations make the rows, with their headings.
    pub rows: Vec<(String, String)>,
    /// Rows of the results that are shown: label and value.
    #[serde(default, rename = "where")]
    pub only: Vec<(String, Value)>,
    /// Methods shown, all if left out.
    #[serde(default)]
    pub methods: Vec<String>,
    /// Digits behind the decimal point.
    pub digits: usize,
    /// Whether both sensors stand in one cell, `τ1 / τ2`.
    #[serde(default)]
    pub both_sensors: bool,
}

impl SummarySpec {
    /// Whether a plan of these methods has all that this names.
    pub(crate) fn check(&self, methods: &[Method]) -> Result<(), ExperimentError> {
        if self.digits > MAX_DECIMALS {
            return Err(ExperimentError::Plan(format!("{}: at most {MAX_DECIMALS} digits", self.file)));
        }
        let rows = self.rows.iter().map(|(label, _)| label).chain(self.only.iter().map(|(label, _)| label));
        check_names(methods, &self.file, rows.chain([&self.value]).chain(&self.error), &self.methods)
    }
}
