//! Pictures of a table, described in the plan.

use serde_json::Value;
use twinlag_report::{Axis, Chart, Figure, Reference, Series};

use crate::error::ExperimentError;
use crate::plan::{Drawn, PictureSpec};
use crate::table::{Row, Table};

impl Drawn {
    fn axis(&self) -> Axis {
        let axis = if self.logarithmic { Axis::logarithmic(&self.label) } else { Axis::linear(&self.label) };
        match self.range {
            Some([low, high]) => axis.range(low, high),
            None => axis,
        }
    }
}

/// Whether `row` has `value` under `label`; numbers as numbers.
pub(crate) fn has(row: &Row, label: &str, value: &Value) -> bool {
    row.get(label).is_some_and(|v| v == value || v.as_f64().is_some_and(|a| value.as_f64() == Some(a)))
}

/// A label's value: names as they are, whole numbers without a decimal point.
pub(crate) fn text(value: &Value) -> String {
    match (value.as_str(), value.as_f64()) {
        (Some(name), _) => name.to_owned(),
        (_, Some(number)) => number.to_string(),
        _ => value.to_string(),
    }
}

impl PictureSpec {
    /// The figure of `table`, as SVG.
    ///
    /// # Errors
    /// For a column that the table does not have, or if there is nothing to draw.
    pub fn draw(&self, table: &Table) -> Result<String, ExperimentError> {
        let rows: Vec<&Row> =
            table.rows.iter().filter(|row| self.only.iter().all(|(label, value)| has(row, label, value))).collect();
        let Some(first) = rows.first() else { return Err(ExperimentError::NoRows { name: self.file.clone() }) };
        let named = [Some(&self.x.column), Some(&self.y.column), self.y_error.as_ref()];
        let columns = named.into_iter().flatten().chain(self.y_interval.iter().flatten()).chain(&self.panels);
        for column in columns {
            let is_drawn = !(self.bars && *column == self.x.column);
            if is_drawn && !first.contains_key(column) {
                return Err(ExperimentError::NoColumn { name: self.file.clone(), column: column.clone() });
            }
        }
        let mut panels: Vec<Vec<Value>> = Vec::new();
        for row in &rows {
            let key: Vec<Value> = self.panels.iter().map(|label| row[label].clone()).collect();
            if !panels.contains(&key) {
                panels.push(key);
            }
        }
        let [width, height] = self.panel_px;
        let mut figure =
            Figure::new(&self.title).columns(self.columns.min(panels.len().max(1))).panel_size(width, height);
        for (number, key) in panels.iter().enumerate() {
            let inside: Vec<&Row> = rows
                .iter()
                .copied()
                .filter(|row| self.panels.iter().zip(key).all(|(label, value)| &row[label] == value))
                .collect();
            let title = self.panels.iter().zip(key).map(|(label, value)| panel_label(label, value));
            let chart = self.chart(&title.collect::<Vec<_>>().join(", "), &inside, table);
            // The same series have the same colours everywhere: one legend will do.
            figure = figure.panel(if number == 0 { chart } else { chart.without_legend() });
        }
        figure.to_svg().map_err(|source| ExperimentError::Picture { name: self.file.clone(), source })
    }

    fn methods<'t>(&'t self, table: &'t Table) -> Vec<&'t str> {
        let all = table.plan.methods.iter().map(|m| m.name.as_str());
        all.filter(|name| self.methods.is_empty() || self.methods.iter().any(|m| m == name)).collect()
    }

    fn chart(&self, title: &str, rows: &[&Row], table: &Table) -> Chart {
        let number = |row: &Row, column: &str| row.get(column).and_then(Value::as_f64).unwrap_or(f64::NAN);
        let methods = self.methods(table);
        let of = |method: &str| rows.iter().copied().filter(move |row| row["method"] == *method).collect::<Vec<_>>();
        let column = |rows: &[&Row], name: &str| rows.iter().map(|row| number(row, name)).collect::<Vec<f64>>();
        let mut chart;
        if self.bars {
            let split = |method: &'_ str| -> (String, String) {
                let (series, category) = method.split_once(", ").unwrap_or(("", method));
                (series.to_owned(), category.to_owned())
            };
            let (mut names, mut categories): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
            for (series, category) in methods.iter().map(|m| split(m)) {
                if !names.contains(&series) {
                    names.push(series);
                }
                if !categories.contains(&category) {
                    categories.push(category);
                }
            }
            chart = Chart::new(title, Axis::categories("", categories.clone()), self.y.axis());
            for name in names {
                let at = |column: &str| -> Vec<f64> {
                    let in_category = |category: &String| {
                        let method = methods.iter().find(|m| split(m) == (name.clone(), category.clone()));
                        method.and_then(|m| of(m).first().map(|row| number(row, column))).unwrap_or(f64::NAN)
                    };
                    categories.iter().map(in_category).collect()
                };
                let mut bars = Series::bars(&name, at(&self.y.column));
                if let Some([low, high]) = &self.y_interval {
                    bars = bars.interval(at(low), at(high));
                }
                if let Some(error) = &self.y_error {
                    bars = bars.errors(at(error));
                }
                chart = chart.series(bars);
            }
        } else {
            chart = Chart::new(title, self.x.axis(), self.y.axis()).dodge(2.5);
            for method in methods {
                let rows = of(method);
                let mut line = Series::line(method, column(&rows, &self.x.column), column(&rows, &self.y.column));
                if let Some(error) = &self.y_error {
                    line = line.errors(column(&rows, error));
                }
                if let Some([low, high]) = &self.y_interval {
                    line = line.interval(column(&rows, low), column(&rows, high));
                }
                chart = chart.series(line);
            }
        }
        for (at, label) in &self.lines {
            chart = chart.reference(Reference::horizontal(*at).label(label));
        }
        chart
    }
}

fn panel_label(label: &str, value: &Value) -> String {
    match label {
        "gas" => text(value),
        "samples" => format!("{} samples", text(value)),
        "sensor" => format!("sensor {}", text(value)),
        "noise_percent" => format!("noise {} %", text(value)),
        "noise_of" => format!("noise in % of the {}", text(value)),
        "noise_ratio" => format!("s₂/s₁ = {}", text(value)),
        "noise_ar1" => format!("noise φ = {}", text(value)),
        "sample_period_s" => format!("Ts = {} s", text(value)),
        "tau1_s" => format!("τ₁ = {} s", text(value)),
        "tau2_s" => format!("τ₂ = {} s", text(value)),
        _ => format!("{label} {}", text(value)),
    }
}
