//! The columns of a table, which are the same for all plans.

use crate::error::ExperimentError;
use crate::plan::method::Method;

/// Columns that say which row it is, in order.
pub(crate) const LABELS: [&str; 11] = [
    "gas",
    "samples",
    "sample_period_s",
    "tau1_s",
    "tau2_s",
    "noise_of",
    "noise_ratio",
    "noise_ar1",
    "noise_percent",
    "method",
    "sensor",
];

/// Columns of statistics, in order, right of [`LABELS`].
pub(crate) const COLUMNS: [&str; 29] = [
    "trials",
    "usable",
    "on_bound",
    "reached",
    "reached_low",
    "reached_high",
    "bias_percent",
    "bias_error_percent",
    "median_percent",
    "low_5_percent",
    "high_95_percent",
    "relative_rmse_percent",
    "relative_rmse_error_percent",
    "ln_bias_percent",
    "ln_bias_error_percent",
    "ln_std_percent",
    "ln_std_error_percent",
    "ln_rmse_percent",
    "ln_rmse_error_percent",
    "bound_percent",
    "rmse_over_bound",
    "rmse_over_bound_error",
    "coverage",
    "coverage_low",
    "coverage_high",
    "interval_width_percent",
    "level_bias_percent",
    "level_std_percent",
    "evaluations",
];

fn is_column(name: &str) -> bool {
    LABELS.contains(&name) || COLUMNS.contains(&name)
}

/// Refuses names of a plan that mean nothing: `file` that is no plain file name, `columns` that no
/// table has, methods `named` that are not among `methods`.
pub(crate) fn check_names<'n>(
    methods: &[Method],
    file: &str,
    columns: impl IntoIterator<Item = &'n String>,
    named: &[String],
) -> Result<(), ExperimentError> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if file.is_empty() || !file.chars().all(is_plain) {
        return Err(ExperimentError::Plan(format!("\"{file}\" is no file name: letters, digits, - and _")));
    }
    if let Some(column) = columns.into_iter().find(|c| !is_column(c)) {
        return Err(ExperimentError::NoColumn { name: file.into(), column: column.clone() });
    }
    match named.iter().find(|m| methods.iter().all(|own| own.name != **m)) {
        Some(method) => Err(ExperimentError::Plan(format!("{file}: there is no method called \"{method}\""))),
        None => Ok(()),
    }
}
