//! Tables for people: a few columns of the results, as Markdown.

use serde_json::Value;

use crate::error::ExperimentError;
use crate::picture::{has, text};
use crate::plan::SummarySpec;
use crate::table::{Row, Table};

impl SummarySpec {
    /// The table as Markdown.
    ///
    /// # Errors
    /// For a column that the results have not, or no rows.
    pub fn write(&self, table: &Table) -> Result<String, ExperimentError> {
        let rows: Vec<&Row> =
            table.rows.iter().filter(|row| self.only.iter().all(|(label, value)| has(row, label, value))).collect();
        let Some(first) = rows.first() else { return Err(ExperimentError::NoRows { name: self.file.clone() }) };
        let labels = self.rows.iter().map(|(label, _)| label);
        for column in labels.chain([&self.value]).chain(&self.error) {
            if !first.contains_key(column) {
                return Err(ExperimentError::NoColumn { name: self.file.clone(), column: column.clone() });
            }
        }
        let methods: Vec<&str> = table
            .plan
            .methods
            .iter()
            .map(|m| m.name.as_str())
            .filter(|name| self.methods.is_empty() || self.methods.iter().any(|m| m == name))
            .collect();
        let headings = self.rows.iter().map(|(_, heading)| heading.as_str()).chain(methods.iter().copied());
        let mut lines = vec![
            format!("| {} |", headings.collect::<Vec<_>>().join(" | ")),
            format!("|{}", "---|".repeat(self.rows.len() + methods.len())),
        ];
        let mut keys: Vec<Vec<&Value>> = Vec::new();
        for row in &rows {
            let key: Vec<&Value> = self.rows.iter().map(|(label, _)| &row[label]).collect();
            if !keys.contains(&key) {
                keys.push(key);
            }
        }
        for key in keys {
            let inside: Vec<&Row> = rows
                .iter()
                .copied()
                .filter(|row| self.rows.iter().zip(&key).all(|((label, _), value)| row[label] == **value))
                .collect();
            let mut cells: Vec<String> = key.iter().map(|value| text(value)).collect();
            for method in &methods {
                let of = |sensor: u64| inside.iter().find(|r| r["method"] == **method && r["sensor"] == sensor);
                let shown = if self.both_sensors {
                    format!("{} / {}", self.cell(of(1).copied()), self.cell(of(2).copied()))
                } else {
                    self.cell(inside.iter().find(|r| r["method"] == **method).copied())
                };
                cells.push(shown);
            }
            lines.push(format!("| {} |", cells.join(" | ")));
        }
        Ok(lines.join("\n") + "\n")
    }

    fn cell(&self, row: Option<&Row>) -> String {
        let number = |column: &str| row.and_then(|r| r.get(column)).and_then(Value::as_f64);
        let Some(value) = number(&self.value) else { return "–".into() };
        let digits = self.digits;
        match self.error.as_deref().and_then(number) {
            Some(error) => format!("{value:.digits$} ± {error:.digits$}"),
            None => format!("{value:.digits$}"),
        }
    }
}
