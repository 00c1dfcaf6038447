//! Pictures of the residual before and after.

use statrs::distribution::{ChiSquared, ContinuousCDF};
use twinlag::diagnosis::{ModelFit, ResidualPart};
use twinlag_report::{Axis, Chart, Colour, Figure, Series};

const NOISE: &str = "95 % of white noise";
pub(crate) const WIDTH_PX: f64 = 900.0;
/// A step longer than this multiple of the usual one is a gap.
const GAP_STEPS: f64 = 10.0;

/// A model with its name in pictures.
pub(crate) struct PlottedModel<'a> {
    pub(crate) name: &'static str,
    pub(crate) fit: &'a ModelFit,
    pub(crate) colour: Colour,
}

/// A chart of the series that are there; `None` without any.
pub(crate) fn chart(
    title: impl Into<String>,
    [x, y]: [Axis; 2],
    series: impl IntoIterator<Item = Option<Series>>,
) -> Option<Chart> {
    let mut series = series.into_iter().flatten().peekable();
    series.peek()?;
    Some(series.fold(Chart::new(title, x, y), Chart::series))
}

/// A trace, if it has a point that can be drawn. It has gaps where the record has.
pub(crate) fn trace(name: impl Into<String>, x: &[f64], y: &[f64], colour: Colour) -> Option<Series> {
    let drawn = x.iter().zip(y).any(|(x, y)| x.is_finite() && y.is_finite());
    let mut steps: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let longest =
        if steps.is_empty() { 0.0 } else { GAP_STEPS * *steps.select_nth_unstable_by(middle, f64::total_cmp).1 };
    let (mut at, mut values) = (Vec::with_capacity(x.len()), Vec::with_capacity(x.len()));
    for (k, (x_k, y_k)) in x.iter().zip(y).enumerate() {
        if k > 0 && x_k - x[k - 1] > longest {
            at.push(*x_k);
            values.push(f64::NAN);
        }
        at.push(*x_k);
        values.push(*y_k);
    }
    drawn.then(|| Series::trace(name, at, values).colour(colour))
}

/// The residual of each model along the record, and its root mean square in parts of the record.
pub(crate) fn time_figure(models: &[PlottedModel<'_>]) -> Option<Figure> {
    let largest: Vec<f64> = models
        .iter()
        .map(|m| {
            m.fit.trace.residual.value.iter().filter(|r| r.is_finite()).fold(0.0, |most: f64, r| most.max(r.abs()))
        })
        .collect();
    // One scale for both, unless the smaller would then be a line.
    let widest = largest.iter().copied().fold(0.0, f64::max);
    let common = largest.iter().all(|l| 4.0 * l > widest);
    let mut figure = Figure::new("").columns(1).panel_size(WIDTH_PX, 230.0);
    let mut parts = Vec::new();
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    let mut fewest = usize::MAX;
    let mut any = false;
    for (PlottedModel { name, fit, colour, .. }, largest) in models.iter().zip(&largest) {
        let trace = &fit.trace;
        let limit = 1.08 * if common { widest } else { *largest };
        let axis = Axis::linear("residual");
        let axis = if limit > 0.0 { axis.range(-limit, limit) } else { axis };
        let lines = [self::trace("", &trace.residual.time_s, &trace.residual.value, *colour)];
        if let Some(chart) = chart(*name, [Axis::linear("time (s)"), axis], lines) {
            figure = figure.panel(chart);
            any = true;
        }
        let size = trace.parts.first().map_or(1, |part| part.count);
        // A short last part would be outside the range of the others.
        let parts_shown: Vec<&ResidualPart> = trace.parts.iter().filter(|part| part.count == size).collect();
        let (mut x, mut y): (Vec<f64>, Vec<f64>) =
            parts_shown.iter().map(|part| (part.ends_s[0], part.mean_square.sqrt())).unzip();
        if let (Some(first), Some(last)) = (parts_shown.first(), parts_shown.last()) {
            ends = [ends[0].min(first.ends_s[0]), ends[1].max(last.ends_s[1])];
            x.push(last.ends_s[1]);
            y.push(last.mean_square.sqrt());
        }
        if y.iter().any(|v| v.is_finite() && *v > 0.0) {
            fewest = fewest.min(size);
            parts.push(Some(Series::steps(*name, x, y).colour(*colour)));
        }
    }
    if !any {
        return None;
    }
    if ends[0] < ends[1]
        && let Some([low, high]) = white_noise(fewest as f64)
    {
        let band = Series::trace(NOISE, ends, [1.0, 1.0]).band([low.sqrt(); 2], [high.sqrt(); 2]).colour(Colour::Grey);
        parts.insert(0, Some(band));
    }
    let axes = [Axis::linear("time (s)"), Axis::logarithmic("root mean square")];
    if let Some(chart) = chart("In hundredths of the record", axes, parts) {
        figure = figure.panel(chart);
    }
    Some(figure)
}

/// Power of the residual of each model against frequency.
pub(crate) fn frequency_figure(models: &[PlottedModel<'_>]) -> Option<Figure> {
    let shown = |band: &&[f64; 3]| band.iter().all(|v| v.is_finite() && *v > 0.0);
    let mut series = Vec::new();
    let bands: Vec<&[f64; 3]> = models.last()?.fit.trace.bands.iter().filter(shown).collect();
    let (mut x, mut low, mut high) = (Vec::new(), Vec::new(), Vec::new());
    for band in bands {
        if let Some(range) = white_noise(band[2]) {
            x.push(band[0]);
            low.push(range[0]);
            high.push(range[1]);
        }
    }
    if !x.is_empty() {
        let ones = vec![1.0; x.len()];
        series.push(Some(Series::trace(NOISE, x, ones).band(low, high).colour(Colour::Grey)));
    }
    for PlottedModel { name, fit, colour, .. } in models {
        let (x, y): (Vec<f64>, Vec<f64>) = fit.trace.bands.iter().filter(shown).map(|b| (b[0], b[1])).unzip();
        series.push((!x.is_empty()).then(|| Series::line(*name, x, y).colour(*colour)));
    }
    let axes = [Axis::logarithmic("frequency (Hz)"), Axis::logarithmic("power (that of the noise is 1)")];
    Some(Figure::new("").panel_size(WIDTH_PX, 360.0).panel(chart("Power of the residual", axes, series)?))
}

/// The range that holds the mean square of so many values of white noise of unit variance in 95 %
/// of all cases.
pub(crate) fn white_noise(dof: f64) -> Option<[f64; 2]> {
    let chi_square = ChiSquared::new(dof).ok()?;
    Some([0.025, 0.975].map(|p| chi_square.inverse_cdf(p) / dof))
}

/// Values of a trace from one instant to another.
pub(crate) fn pairs<'a>(
    time_s: &'a [f64],
    values: &'a [f64],
    from: f64,
    to: f64,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    time_s.iter().copied().zip(values.iter().copied()).filter(move |(t, _)| (from..=to).contains(t))
}
