//! What a picture of the table shows, as the plan has it.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::ExperimentError;
use crate::plan::columns::check_names;
use crate::plan::method::Method;

/// A figure: one panel for each value of a label, one series for each method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PictureSpec {
    /// File name without its extension.
    pub file: String,
    /// Title of the figure.
    pub title: String,
    /// Column along x, with its label.
    pub x: Drawn,
    /// Column along y, with its label.
    pub y: Drawn,
    /// Column with the standard error of y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y_error: Option<String>,
    /// Columns with the ends of an interval of y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y_interval: Option<[String; 2]>,
    /// Labels whose values make the panels.
    pub panels: Vec<String>,
    /// Rows that are drawn: label and value.
    #[serde(default, rename = "where")]
    pub only: Vec<(String, Value)>,
    /// Methods drawn, all if left out.
    #[serde(default)]
    pub methods: Vec<String>,
    /// Horizontal lines with their labels.
    #[serde(default)]
    pub lines: Vec<(f64, String)>,
    /// Panels side by side.
    #[serde(default = "two")]
    pub columns: usize,
    /// Whether methods are drawn as groups of bars: a method called "a, b" is series a in category
    /// b, and `x` is not used.
    #[serde(default)]
    pub bars: bool,
    /// Width and height of a panel, pixels.
    #[serde(default = "panel_px")]
    pub panel_px: [f64; 2],
}

fn panel_px() -> [f64; 2] {
    [440.0, 330.0]
}

fn two() -> usize {
    2
}

/// A column and how its axis looks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drawn {
    /// Column of the table.
    pub column: String,
    /// Label of the axis, with the unit.
    pub label: String,
    /// Whether the axis is logarithmic.
    #[serde(default)]
    pub logarithmic: bool,
    /// Ends of the axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
}

impl PictureSpec {
    /// Whether a plan of these methods has all that this names.
    pub(crate) fn check(&self, methods: &[Method]) -> Result<(), ExperimentError> {
        let labels = self.panels.iter().chain(self.only.iter().map(|(label, _)| label));
        let drawn = [Some(&self.x.column), Some(&self.y.column), self.y_error.as_ref()];
        let columns = labels.chain(drawn.into_iter().flatten()).chain(self.y_interval.iter().flatten());
        check_names(methods, &self.file, columns, &self.methods)
    }
}
