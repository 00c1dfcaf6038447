//! The table of an experiment: a row for each cell, method and sensor.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use twinlag_study::{Results, Tally, Values};

use crate::error::ExperimentError;
use crate::plan::{Cell, LABELS, Plan};
use crate::trial::Experiment;

/// Significant digits of the numbers in tables.
const DIGITS: i32 = 7;

/// A row: columns in a fixed order, numbers with seven digits, `null` where there is none.
pub type Row = Map<String, Value>;

/// The statistics of an experiment. Same plan, same bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// `twinlag.experiment/1`.
    pub schema: String,
    /// The plan, as far as it decides the numbers.
    pub plan: Plan,
    /// Version of the program.
    pub version: String,
    /// A row for each cell, method and sensor.
    pub rows: Vec<Row>,
}

impl Table {
    /// The table of `results`, which must be those of `plan`.
    ///
    /// # Errors
    /// For an impossible rig.
    pub fn new(plan: &Plan, results: &Results) -> Result<Self, ExperimentError> {
        Self::of(&Experiment::new(plan)?, results)
    }

    /// The table of `results`, which must be those of `experiment`.
    ///
    /// # Errors
    /// For an impossible rig.
    pub fn of(experiment: &Experiment<'_>, results: &Results) -> Result<Self, ExperimentError> {
        let plan = experiment.source();
        let mut rows = Vec::new();
        for (index, (cell, tally)) in plan.cells().iter().zip(results.cells()).enumerate() {
            let bound = experiment.bound(index)?;
            for method in &plan.methods {
                for sensor in 0..2 {
                    let mut row = labels(plan, cell);
                    row.insert("method".into(), json!(method.name));
                    row.insert("sensor".into(), json!(sensor + 1));
                    statistics(&mut row, &method.name, sensor, tally, bound.map(|b| b[sensor]));
                    rows.push(row);
                }
            }
        }
        let version = env!("CARGO_PKG_VERSION").into();
        Ok(Self { schema: "twinlag.experiment/1".into(), plan: plan.decisive(), version, rows })
    }

    /// One line for each row, so that differences between two versions show.
    ///
    /// # Errors
    /// None in practice: a table is plain data.
    pub fn to_json(&self) -> Result<String, ExperimentError> {
        let failed = |e: serde_json::Error| ExperimentError::Table(e.to_string());
        let plan = serde_json::to_string(&self.plan).map_err(failed)?;
        let rows = self.rows.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>().map_err(failed)?;
        Ok(format!(
            "{{\"schema\":{},\"version\":{},\n\"plan\":{plan},\n\"rows\":[\n{}\n]}}\n",
            json!(self.schema),
            json!(self.version),
            rows.join(",\n")
        ))
    }

    /// The rows as comma-separated values with a header.
    ///
    /// # Errors
    /// None in practice: a table is plain data.
    pub fn to_csv(&self) -> Result<String, ExperimentError> {
        let failed = |e: &dyn std::fmt::Display| ExperimentError::Table(e.to_string());
        let mut out = csv::Writer::from_writer(Vec::new());
        if let Some(first) = self.rows.first() {
            out.write_record(first.keys()).map_err(|e| failed(&e))?;
        }
        for row in &self.rows {
            let text = |v: &Value| match v {
                Value::Null => String::new(),
                Value::String(s) => s.clone(),
                other => other.to_string(),
            };
            out.write_record(row.values().map(text)).map_err(|e| failed(&e))?;
        }
        let bytes = out.into_inner().map_err(|e| failed(&e))?;
        String::from_utf8(bytes).map_err(|e| failed(&e))
    }

    /// Where this table and `other` first differ, in words; `None` if they agree to the byte.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// use twinlag_experiment::{Experiment, Plan, Table};
    /// use twinlag_study::{Options, run};
    /// # let plan = |seed: u64| Plan::from_toml(&format!(r#"
    /// #     name = "repeat"
    /// #     title = "Three trials"
    /// #     seed = {seed}
    /// #     trials = 3
    /// #     samples = [300]
    /// #     noise_percent = [2]
    /// #     gases = [{{ name = "tone", gas = {{ kind = "sine", amplitude_k = 9.0, frequency_hz = 6.0 }} }}]
    /// #     methods = [{{ name = "gtls", estimator = "difference-equation-gtls" }}]
    /// # "#));
    ///
    /// // `plan` makes a plan of three trials from a seed.
    /// let table = |seed| -> Result<Table, twinlag_experiment::ExperimentError> {
    ///     let plan = plan(seed)?;
    ///     let part = run(&Experiment::new(&plan)?, &Options::default(), |_| ControlFlow::Continue(()))?;
    ///     Table::new(&plan, &part.into_results()?)
    /// };
    /// assert_eq!(table(1)?.first_difference(&table(1)?), None); // to the last digit
    /// assert_eq!(table(1)?.first_difference(&table(2)?).as_deref(), Some("the plans differ"));
    /// # Ok::<(), twinlag_experiment::ExperimentError>(())
    /// ```
    pub fn first_difference(&self, other: &Self) -> Option<String> {
        if self.plan.decisive() != other.plan.decisive() {
            return Some("the plans differ".into());
        }
        for (ours, theirs) in self.rows.iter().zip(&other.rows) {
            for (column, value) in ours {
                let expected = theirs.get(column);
                if expected != Some(value) {
                    let label: Vec<String> = ours.iter().take(LABELS.len()).map(|(k, v)| format!("{k} {v}")).collect();
                    let expected = expected.unwrap_or(&Value::Null);
                    return Some(format!(
                        "{column} is {value}, the stored table has {expected}, at {}",
                        label.join(", ")
                    ));
                }
            }
        }
        (self.rows.len() != other.rows.len())
            .then(|| format!("there are {} rows, the stored table has {}", self.rows.len(), other.rows.len()))
    }
}

fn labels(plan: &Plan, cell: &Cell) -> Row {
    let mut row = Row::new();
    row.insert("gas".into(), json!(plan.gases[cell.gas].name));
    row.insert("samples".into(), json!(cell.samples));
    row.insert("sample_period_s".into(), json!(cell.sample_period_s));
    row.insert("tau1_s".into(), json!(cell.tau_s[0]));
    row.insert("tau2_s".into(), json!(cell.tau_s[1]));
    row.insert("noise_of".into(), json!(cell.noise_of.name()));
    row.insert("noise_ratio".into(), json!(cell.noise_ratio));
    row.insert("noise_ar1".into(), json!(cell.noise_ar1));
    row.insert("noise_percent".into(), json!(cell.noise_percent));
    row
}

/// Seven significant digits.
fn rounded(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let unit = 10.0_f64.powi(DIGITS - 1 - x.abs().log10().floor() as i32);
    (x * unit).round() / unit
}

fn number(x: Option<f64>) -> Value {
    x.filter(|v| v.is_finite()).map_or(Value::Null, |v| json!(rounded(v)))
}

fn statistics(row: &mut Row, method: &str, sensor: usize, tally: &Tally, bound: Option<f64>) {
    let own = |what: &str| format!("{method}/{what}-{}", sensor + 1);
    let values = |name: String| tally.values(&name);
    let mut put = |name: &str, value: Option<f64>| {
        row.insert(name.into(), number(value));
    };
    let rate = |name: String| tally.rate(&name).and_then(|r| Some((r.rate()?, r.wilson_interval()?)));

    let relative = values(own("relative-error"));
    let percent = |f: &dyn Fn(&Values) -> Option<f64>, of: Option<&Values>| of.and_then(f).map(|v| 100.0 * v);
    let logarithm = values(own("ln-error"));
    put("trials", Some(tally.trials() as f64));
    put("usable", tally.rate(&format!("{method}/usable")).and_then(twinlag_study::Rate::rate));
    put("on_bound", tally.rate(&format!("{method}/on-bound")).and_then(twinlag_study::Rate::rate));
    let reached = rate(format!("{method}/reached"));
    put("reached", reached.map(|r| r.0));
    put("reached_low", reached.map(|r| r.1[0]));
    put("reached_high", reached.map(|r| r.1[1]));
    put("bias_percent", percent(&|v| v.moments().mean(), relative));
    put("bias_error_percent", percent(&|v| v.moments().mean_error(), relative));
    put("median_percent", percent(&|v| v.quantile(0.5), relative));
    put("low_5_percent", percent(&|v| v.quantile(0.05), relative));
    put("high_95_percent", percent(&|v| v.quantile(0.95), relative));
    put("relative_rmse_percent", percent(&|v| v.moments().root_mean_square(), relative));
    put("relative_rmse_error_percent", percent(&|v| v.moments().root_mean_square_error(), relative));
    put("ln_bias_percent", percent(&|v| v.moments().mean(), logarithm));
    put("ln_bias_error_percent", percent(&|v| v.moments().mean_error(), logarithm));
    put("ln_std_percent", percent(&|v| v.moments().standard_deviation(), logarithm));
    put("ln_std_error_percent", percent(&|v| v.moments().standard_deviation_error(), logarithm));
    let rmse = logarithm.and_then(|v| v.moments().root_mean_square());
    let rmse_error = logarithm.and_then(|v| v.moments().root_mean_square_error());
    put("ln_rmse_percent", rmse.map(|v| 100.0 * v));
    put("ln_rmse_error_percent", rmse_error.map(|v| 100.0 * v));
    put("bound_percent", bound.map(|b| 100.0 * b));
    put("rmse_over_bound", rmse.zip(bound).map(|(r, b)| r / b));
    put("rmse_over_bound_error", rmse_error.zip(bound).map(|(r, b)| r / b));
    let covered = rate(own("covered"));
    put("coverage", covered.map(|c| c.0));
    put("coverage_low", covered.map(|c| c.1[0]));
    put("coverage_high", covered.map(|c| c.1[1]));
    put("interval_width_percent", percent(&|v| v.quantile(0.5), values(own("ln-width"))));
    put("level_bias_percent", percent(&|v| v.moments().mean(), values(own("level-error"))));
    put("level_std_percent", percent(&|v| v.moments().standard_deviation(), values(own("level-error"))));
    put("evaluations", tally.values(&format!("{method}/evaluations")).and_then(|v| v.moments().mean()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::COLUMNS;
    use crate::trial::quantities;

    /// A plan is checked against the list of columns before there is a table.
    #[test]
    fn a_row_has_the_columns_that_plans_may_name() {
        let text = r#"
            name = "columns"
            title = "no trial is run"
            seed = 1
            trials = 1
            noise_percent = [10]
            gases = [{ name = "sine", gas = { kind = "sine", mean_c = 50.0, amplitude_k = 10.0, frequency_hz = 10.0 } }]
            methods = [{ name = "whitened", estimator = "whitened" }]
        "#;
        let plan = Plan::from_toml(text).expect("a plan");
        let mut row = labels(&plan, &plan.cells()[0]);
        row.insert("method".into(), Value::Null);
        row.insert("sensor".into(), Value::Null);
        statistics(&mut row, "whitened", 0, &Tally::new(&quantities("whitened")), None);
        let columns: Vec<&str> = row.keys().map(String::as_str).collect();
        assert_eq!(columns, LABELS.into_iter().chain(COLUMNS).collect::<Vec<_>>());
    }
}
