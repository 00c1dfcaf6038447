//! The data behind a figure, as a table that any program reads.

use std::fmt::Write;

use crate::chart::{Chart, Series, Shape};
use crate::decimate::decimate;
use crate::figure::{Figure, Panel};
use crate::surface::Surface;

/// Columns for which a trace is thinned, as in the picture: one for every third pixel.
const COLUMNS: usize = 300;
const HEADER: &str = "panel,series,x,y,low,high\n";

/// A cell of text: quoted where it has to be, and nothing that a spreadsheet would compute.
fn cell(text: &str) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let text = if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text };
    if text.contains([',', '"', '\'']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

/// A number to seven digits, those of a picture; an empty cell for one that is not finite.
fn number(value: Option<f64>) -> String {
    let Some(value) = value.filter(|value| value.is_finite()) else { return String::new() };
    let digits = value.abs().log10().floor();
    if value != 0.0 && !(-5.0..9.0).contains(&digits) {
        return format!("{value:.6e}");
    }
    // An instant of a long record needs its thousandths.
    let text = format!("{value:.*}", (6 - digits.max(-3.0) as i32).clamp(3, 9) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

impl Figure {
    /// The data that the figure shows, as CSV: panel, series, x, y, and the ends of intervals or bands. Long traces are thinned as in
    /// the picture, with every extreme.
    ///
    /// ```
    /// use twinlag_report::{Axis, Chart, Figure, Series};
    ///
    /// let chart = Chart::new("Noise", Axis::linear("time (s)"), Axis::linear("reading (°C)"))
    ///     .series(Series::points("T1", [0.0, 0.5], [20.0, 20.25]).errors([0.1, 0.1]));
    /// let table = Figure::new("").panel(chart).to_csv();
    /// assert_eq!(table.lines().nth(2), Some("Noise,T1,0.5,20.25,20.15,20.35"));
    /// ```
    pub fn to_csv(&self) -> String {
        let mut out = HEADER.to_owned();
        for panel in self.panels() {
            match panel {
                Panel::Chart(chart) => write_chart(&mut out, chart),
                Panel::Surface(surface) => write_surface(&mut out, surface),
            }
        }
        out
    }
}

fn write_chart(out: &mut String, chart: &Chart) {
    for series in &chart.series {
        for k in shown(series) {
            let ends = series.interval.as_ref().or(series.band.as_ref());
            let [low, high] =
                [ends.and_then(|e| e.0.get(k)), ends.and_then(|e| e.1.get(k))].map(|end| number(end.copied()));
            let [x, y] = [&series.x, &series.y].map(|values| number(values.get(k).copied()));
            // A String takes whatever is written to it.
            let _ = writeln!(out, "{},{},{x},{y},{low},{high}", cell(&chart.title), cell(&series.name));
        }
    }
}

/// The points of a series that are drawn.
fn shown(series: &Series) -> Vec<usize> {
    match series.shape {
        Shape::Trace if series.x.len() > 4 * COLUMNS => decimate(&series.x, &series.y, COLUMNS),
        _ => (0..series.x.len()).collect(),
    }
}

fn write_surface(out: &mut String, surface: &Surface) {
    for (j, y) in surface.ys.iter().enumerate() {
        for (i, x) in surface.xs.iter().enumerate() {
            let value = surface.z.get(j * surface.xs.len() + i).copied();
            let [x, y, value] = [Some(*x), Some(*y), value].map(number);
            let _ = writeln!(out, "{},value {value},{x},{y},,", cell(&surface.title));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{cell, number};

    #[test]
    fn cells_are_text_to_a_spreadsheet() {
        for (text, want) in
            [("T1", "T1"), ("a, b", "\"a, b\""), ("a\"b", "\"a\"\"b\""), ("=1+1", "\"'=1+1\""), ("a\nb", "a b")]
        {
            assert_eq!(cell(text), want);
        }
        for (value, want) in
            [(0.0, "0"), (1_234_567.125, "1234567.125"), (2.5e-9, "2.500000e-9"), (f64::NAN, ""), (-0.125, "-0.125")]
        {
            assert_eq!(number(Some(value)), want);
        }
    }
}
