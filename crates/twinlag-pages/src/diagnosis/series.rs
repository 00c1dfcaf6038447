//! Readings, gas temperature and residual as pictures.

use std::ops::Range;

use twinlag::record::Record;
use twinlag_report::{Axis, Chart, Colour, Document, Figure, ReportError, Series};

use super::Page;
use crate::figures::{WIDTH_PX, chart, frequency_figure, pairs, time_figure, trace};
use crate::words::short;

/// The part of the record that is shown larger, and the fewest samples that it may have.
const ZOOM: f64 = 0.05;
const ZOOM_SAMPLES: usize = 60;

impl Page<'_> {
    pub(super) fn traces(&self, document: Document) -> Result<Document, ReportError> {
        let record = self.record;
        let document = document.heading("Readings and gas temperature");
        let everything = 0..record.time_s.len();
        let zoom = busiest(record);
        let whole = self.trace_chart("Whole record", everything.clone());
        let Some(whole) = whole else {
            return Ok(document.note("There are no readings to show."));
        };
        let mut figure = Figure::new("").columns(1).panel_size(WIDTH_PX, 320.0).panel(whole);
        let mut caption = format!(
            "Readings of {} and {}, and the gas temperature inferred from both{}.",
            self.channels()[0],
            self.channels()[1],
            if record.reference_c.is_some() { "; the reference was not used" } else { "" }
        );
        if zoom.len() < everything.len()
            && let Some(chart) = self.trace_chart("Where the readings move most", zoom)
        {
            figure = figure.panel(chart.without_legend());
            caption.push_str(" Below, enlarged, the part of the record where the readings move most.");
        }
        Ok(document.figure(figure.to_svg()?, caption))
    }

    /// Readings, gas and reference of some samples; `None` if there is nothing to be drawn.
    fn trace_chart(&self, title: &str, samples: Range<usize>) -> Option<Chart> {
        let record = self.record;
        let time_s = &record.time_s[samples.clone()];
        let (from, to) = (*time_s.first()?, *time_s.last()?);
        let mut series = Vec::new();
        if let Some(core) = self.core() {
            let gas = &core.last.trace.gas_c;
            let (gas_s, gas_c): (Vec<f64>, Vec<f64>) = pairs(&gas.time_s, &gas.value, from, to).unzip();
            series.push(trace("gas, inferred", &gas_s, &gas_c, Colour::Green));
        }
        if let Some(reference) = &record.reference_c {
            let reference = trace("reference", time_s, &reference[samples.clone()], Colour::Black);
            series.push(reference.map(Series::dashed));
        }
        for (k, column) in [&record.t1_c, &record.t2_c].into_iter().enumerate() {
            let colour = [Colour::Blue, Colour::Vermilion][k];
            series.push(trace(short(&self.channels()[k]), time_s, &column[samples.clone()], colour));
        }
        series.push(self.masked_points(samples));
        chart(title, [Axis::linear("time (s)"), Axis::linear("temperature (°C)")], series)
    }

    /// Readings among `samples` that are left out of the fit, as points.
    fn masked_points(&self, samples: Range<usize>) -> Option<Series> {
        let record = self.record;
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for found in &self.answer.effects {
            let channel = self.channels().iter().position(|name| Some(name) == found.channel.as_ref());
            let Some(column) = channel.map(|k| [&record.t1_c, &record.t2_c][k]) else { continue };
            for [from_s, to_s] in found.masked.iter().map(|run| run.time_s) {
                let from = record.time_s.partition_point(|t| *t < from_s).max(samples.start);
                let to = record.time_s.partition_point(|t| *t <= to_s).min(samples.end);
                for row in (from..to).filter(|row| column[*row].is_finite()) {
                    x.push(record.time_s[row]);
                    y.push(column[row]);
                }
            }
        }
        (!x.is_empty()).then(|| Series::points("left out", x, y).colour(Colour::Purple))
    }

    pub(super) fn residual(&self, document: Document) -> Result<Document, ReportError> {
        let document = document.heading("What is left over, before and after").paragraph(
            "The residual is the difference of the two inferred gas temperatures, in units of \
             the difference that the noise of both sensors makes, and without the memory that \
             the filters give it. If the model is right, it is white noise of unit variance.",
        );
        let models = self.models();
        let Some(figure) = time_figure(&models) else {
            return Ok(document.note("There is no residual to show."));
        };
        let mut document = document.figure(
            figure.to_svg()?,
            "The residual along the record, and its root mean square in hundredths of it, with the range that holds 95 % of \
             such parts if it is white noise of unit variance.",
        );
        if let Some(figure) = frequency_figure(&models) {
            document = document.figure(
                figure.to_svg()?,
                "Power of the residual against frequency, in units of that of the noise. The pale range holds 95 % of the \
                 bands if the residual is white noise of unit variance: one in twenty lies outside by chance.",
            );
        }
        Ok(document)
    }
}

/// The samples to be shown larger: where the readings have most variance.
fn busiest(record: &Record) -> Range<usize> {
    let n = record.time_s.len();
    let window = ((ZOOM * n as f64) as usize).max(ZOOM_SAMPLES).min(n);
    // Sums up to each sample, of both channels: count, value, square.
    let sums = [&record.t1_c, &record.t2_c].map(|readings| {
        let finite = || readings.iter().copied().filter(|y| y.is_finite());
        // Less their mean, or squares of 300 °C would swamp variances of 0.1 K².
        let mean = finite().sum::<f64>() / finite().count().max(1) as f64;
        let mut sums = vec![[0.0; 3]];
        let mut sum = [0.0; 3];
        for y in readings.iter().map(|y| y - mean) {
            if y.is_finite() {
                sum = [sum[0] + 1.0, sum[1] + y, sum[2] + y * y];
            }
            sums.push(sum);
        }
        sums
    });
    let variance = |start: usize| -> f64 {
        sums.iter()
            .map(|sums| {
                let [count, sum, squares] = [0, 1, 2].map(|k| sums[start + window][k] - sums[start][k]);
                let count = count.max(1.0);
                squares / count - (sum / count).powi(2)
            })
            .sum()
    };
    let start = (0..=n - window).max_by(|a, b| variance(*a).total_cmp(&variance(*b))).unwrap_or(0);
    start..start + window
}
