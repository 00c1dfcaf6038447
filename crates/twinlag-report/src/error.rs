use thiserror::Error;

/// Why a figure could not be drawn.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ReportError {
    #[error("figure {figure:?} has no panels: add at least one chart or surface")]
    NoPanels { figure: String },
    #[error(
        "a panel must be at least 160 by 120 and at most 10000 px in either direction, got {width_px} by {height_px}"
    )]
    PanelSize { width_px: f64, height_px: f64 },
    #[error("chart {chart:?} has no series: add at least one")]
    NoSeries { chart: String },
    #[error("series {series:?} has no points")]
    EmptySeries { series: String },
    #[error("series {series:?} has {expected} points, but {got} values in {quantity}")]
    LengthMismatch { series: String, quantity: &'static str, expected: usize, got: usize },
    #[error(
        "chart {chart:?} has nothing to show: on its axes no point of any series is finite (and positive, if logarithmic)"
    )]
    NothingToShow { chart: String },
    #[error("surface {surface:?} has an empty grid: {columns} columns, {rows} rows; both must be at least 2")]
    EmptyGrid { surface: String, columns: usize, rows: usize },
    #[error("surface {surface:?} has {expected} grid points, but {got} values")]
    GridSize { surface: String, expected: usize, got: usize },
    #[error(
        "surface {surface:?}: coordinates along {axis} must be finite, increasing, and positive on a logarithmic axis"
    )]
    GridOrder { surface: String, axis: &'static str },
    #[error("surface {surface:?} has nothing to show: no value is finite (and positive, if logarithmic)")]
    BlankSurface { surface: String },
    #[error(
        "the range of axis {axis:?} must be finite and increasing, and positive on a logarithmic axis, got {low} to {high}"
    )]
    Range { axis: String, low: f64, high: f64 },
}
