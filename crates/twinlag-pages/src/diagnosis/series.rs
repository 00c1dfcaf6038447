//! Readings, gas temperature and residual as pictures.

use std::ops::Range;

use twinlag::record::Record;
use twinlag_report::{Axis, Chart, Colour, Document, Figure, ReportError, Series};

use super::Page;
use crate::figures::{CHANNELS, GAS, REFERENCE, WIDTH_PX, chart, pairs, robust_axis, trace};
use crate::residual_figures::{frequency_figures, parts_figure, time_figures};
use crate::words::short;

/// Length of the part that is shown larger, in time constants of the slower sensor, and the fewest samples that it may have.
const ZOOM_TIME_CONSTANTS: f64 = 20.0;
const ZOOM_SAMPLES: usize = 60;
/// The part of the record that is shown larger where no time constant is known.
const ZOOM: f64 = 0.05;

impl Page<'_> {
    pub(super) fn traces(&self, document: Document) -> Result<Document, ReportError> {
        let record = self.record;
        let document = document.heading("Readings and gas temperature");
        let everything = 0..record.time_s.len();
        let zoom = busiest(record, self.zoom_samples());
        let whole = self.trace_chart("Whole record", everything.clone());
        let Some(whole) = whole else {
            return Ok(document.note("There are no readings to show."));
        };
        let mut figure = Figure::new("").columns(1).panel_size(WIDTH_PX, 300.0).panel(whole).live();
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
            caption.push_str(
                " Below, enlarged, some twenty time constants of the slower sensor, where the readings move most.",
            );
        }
        let document = document.drawing(figure, caption)?;
        self.prediction(document)
    }

    /// Samples of the part that is shown larger.
    fn zoom_samples(&self) -> usize {
        let sampling = self.answer.last.record.sample_period_s;
        let given = self.answer.last.sensors.iter().filter_map(|sensor| sensor.time_constant_s);
        let fitted = self.core().and_then(|core| core.last.extended.as_ref()).map(|model| &model.parameters()[..2]);
        let slowest_s = given.chain(fitted.into_iter().flatten().copied()).fold(0.0, f64::max);
        let samples = match (ZOOM_TIME_CONSTANTS * slowest_s / sampling) as usize {
            0 => (ZOOM * self.record.time_s.len() as f64) as usize,
            samples => samples,
        };
        samples.max(ZOOM_SAMPLES)
    }

    /// Readings, gas and reference of some samples; `None` if there is nothing to be drawn.
    fn trace_chart(&self, title: &str, samples: Range<usize>) -> Option<Chart> {
        let record = self.record;
        let time_s = &record.time_s[samples.clone()];
        let (from, to) = (*time_s.first()?, *time_s.last()?);
        let mut series = Vec::new();
        // Below the gas, which it may hide.
        if let Some(reference) = &record.reference_c {
            let reference = trace("reference", time_s, &reference[samples.clone()], REFERENCE);
            series.push(reference.map(Series::dashed));
        }
        if let Some(core) = self.core() {
            let gas = &core.last.trace.gas_c;
            let (gas_s, gas_c): (Vec<f64>, Vec<f64>) = pairs(&gas.time_s, &gas.value, from, to).unzip();
            series.push(trace("gas, inferred", &gas_s, &gas_c, GAS));
        }
        for (k, column) in [&record.t1_c, &record.t2_c].into_iter().enumerate() {
            series.push(trace(short(&self.channels()[k]), time_s, &column[samples.clone()], CHANNELS[k]));
        }
        let readings = [&record.t1_c, &record.t2_c].into_iter().flat_map(|c| c[samples.clone()].iter().copied());
        let (axis, outside) = robust_axis("temperature (°C)", readings);
        series.push(self.masked_points(samples));
        chart(format!("{title}{outside}"), [Axis::linear("time (s)"), axis], series)
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
        (!x.is_empty()).then(|| Series::points("left out", x, y).colour(Colour::Purple).dashed())
    }

    pub(super) fn residual(&self, document: Document) -> Result<Document, ReportError> {
        let document = document.heading("What is left over, before and after").paragraph(
            "The residual is the difference of the two inferred gas temperatures, in units of \
             the difference that the noise of both sensors makes, and without the memory that \
             the filters give it. If the model is right, it is white noise of unit variance.",
        );
        let models = self.models();
        let along = time_figures(&models);
        if along.is_empty() {
            return Ok(document.note("There is no residual to show."));
        }
        let when = |k: usize| match (self.changed, k) {
            (true, 0) => "Before",
            (true, _) => "After",
            (false, _) => "Two first-order lags",
        };
        let along = along.into_iter().enumerate().map(|(k, figure)| {
            (
                figure,
                format!(
                    "{}: the residual along the record; 95 % of it lies in the pale range if it is noise.",
                    when(k)
                ),
            )
        });
        let mut document = document.side_by_side(along)?;
        if self.changed {
            let power = frequency_figures(&models).into_iter().enumerate().map(|(k, figure)| {
                let text = "the power against frequency, with the range in which it should lie: one band in twenty lies outside by chance.";
                (figure, format!("{}: {text}", when(k)))
            });
            document = document.side_by_side(power)?;
        }
        if let Some(figure) = parts_figure(&models, "In hundredths of the record", WIDTH_PX) {
            document = document.drawing(
                figure,
                "Root mean square of the residual in hundredths of the record, with the range that holds 95 % of such parts if it is \
                 white noise of unit variance.",
            )?;
        }
        Ok(document)
    }
}

/// The samples to be shown larger: where the readings have most variance.
///
/// - `window`: how many
fn busiest(record: &Record, window: usize) -> Range<usize> {
    let n = record.time_s.len();
    let window = window.min(n);
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
    // Across a gap, or from one record to the next, readings jump without having moved.
    let gap_s = record.sampling.gap_s();
    let mut gaps = vec![0];
    gaps.extend(record.time_s.windows(2).scan(0, |count, pair| {
        *count += usize::from(pair[1] - pair[0] > gap_s);
        Some(*count)
    }));
    let is_whole = |start: &usize| window == 0 || gaps[*start] == gaps[start + window - 1];
    let busiest = |starts: &mut dyn Iterator<Item = usize>| starts.max_by(|a, b| variance(*a).total_cmp(&variance(*b)));
    let start = busiest(&mut (0..=n - window).filter(is_whole)).or_else(|| busiest(&mut (0..=n - window))).unwrap_or(0);
    start..start + window
}
