//! Pictures of the residual before and after: along the record, against frequency, its autocorrelation and its quantiles.

use statrs::distribution::{Beta, ContinuousCDF, Normal};
use twinlag::cross_relation::Z_975;
use twinlag::diagnosis::ResidualPart;
use twinlag_report::{Axis, Chart, Colour, Figure, Series};

use crate::figures::{HALF_PX, PlottedModel, WIDTH_PX, chart, trace, white_noise, without_outliers};

const NOISE: &str = "95 % of white noise";
/// Width of the picture on the first screen, px: it fits a phone.
const REASON_PX: f64 = 640.0;

/// The picture that shows why the models differ most plainly: power against frequency, or energy along the record where the energy of
/// the whole has changed by more than that of any band, as with an offset.
pub(crate) fn reason_figure(models: &[PlottedModel<'_>]) -> Option<Figure> {
    if let [before, after] = models {
        let bands = before
            .fit
            .trace
            .bands
            .iter()
            .filter(|band| shown(band))
            .zip(after.fit.trace.bands.iter().filter(|band| shown(band)));
        let most = bands.map(|(before, after)| before[1] / after[1]).fold(1.0, f64::max);
        if before.fit.chi2_per_dof / after.fit.chi2_per_dof > most {
            return parts_figure(models, "What is left over, along the record", REASON_PX);
        }
    }
    frequency_figure(models, "What is left over, against frequency")
}

/// The residual of each model along the record, with the band that holds 95 % of it if it is noise: one figure for each, on one
/// scale.
pub(crate) fn time_figures(models: &[PlottedModel<'_>]) -> Vec<Figure> {
    // One scale for both, unless the smaller would then be a line.
    let largest: Vec<f64> = models.iter().map(|model| largest(&model.fit.trace.residual.value)).collect();
    let widest = largest.iter().copied().fold(0.0, f64::max);
    let common = largest.iter().all(|l| 4.0 * l > widest);
    let width_px = if models.len() > 1 { HALF_PX } else { WIDTH_PX };
    let figure_of = |(model, largest): (&PlottedModel<'_>, &f64)| {
        let residual = &model.fit.trace.residual;
        let limit = 1.08 * if common { widest } else { *largest };
        let axis = Axis::linear("residual");
        let axis = if limit > 0.0 { axis.range(-limit, limit) } else { axis };
        let outside = residual.value.iter().filter(|r| r.abs() > limit).count();
        let said = match outside {
            0 => String::new(),
            1 => " (1 value lies outside)".to_owned(),
            count => format!(" ({count} values lie outside)"),
        };
        let ends = residual.time_s.first().zip(residual.time_s.last()).map(|(a, b)| [*a, *b]);
        let band = ends
            .map(|ends| Series::trace("", ends, [0.0; 2]).band([-Z_975; 2], [Z_975; 2]).colour(Colour::Grey).dashed());
        let line = trace("", &residual.time_s, &residual.value, model.colour)?;
        let chart = chart(format!("{}{said}", model.title()), [Axis::linear("time (s)"), axis], [band, Some(line)])?;
        Some(Figure::new("").columns(1).panel_size(width_px, 260.0).panel(chart.without_legend()).live())
    };
    models.iter().zip(&largest).filter_map(figure_of).collect()
}

/// The largest value, but for outliers.
fn largest(values: &[f64]) -> f64 {
    match without_outliers(values.iter().copied()) {
        Some(([low, high], _)) => high.max(-low),
        None => values.iter().filter(|r| r.is_finite()).fold(0.0, |most: f64, r| most.max(r.abs())),
    }
}

/// The root mean square of the residual of each model in parts of the record.
pub(crate) fn parts_figure(models: &[PlottedModel<'_>], title: &str, width_px: f64) -> Option<Figure> {
    let mut parts = Vec::new();
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    let mut fewest = usize::MAX;
    for PlottedModel { name, fit, colour, .. } in models {
        let trace = &fit.trace;
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
    if parts.is_empty() {
        return None;
    }
    if ends[0] < ends[1]
        && let Some([low, high]) = white_noise(fewest as f64)
    {
        let band = Series::trace(NOISE, ends, [1.0, 1.0]).band([low.sqrt(); 2], [high.sqrt(); 2]).colour(Colour::Grey);
        parts.insert(0, Some(band));
    }
    let axes = [Axis::linear("time (s)"), Axis::logarithmic("root mean square")];
    Some(Figure::new("").panel_size(width_px, 250.0).panel(chart(title, axes, parts)?))
}

/// Power of the residual of each model against frequency.
///
/// - `title`: what it shows
pub(crate) fn frequency_figure(models: &[PlottedModel<'_>], title: &str) -> Option<Figure> {
    let series = frequency_series(models);
    let axes = [Axis::logarithmic("frequency (Hz)"), Axis::logarithmic("power (that of the noise is 1)")];
    Some(Figure::new("").panel_size(REASON_PX, 320.0).panel(chart(title, axes, series)?))
}

/// Power of the residual against frequency, before and after side by side on the same axes.
pub(crate) fn frequency_figures(models: &[PlottedModel<'_>]) -> Vec<Figure> {
    let power = || models.iter().flat_map(|m| &m.fit.trace.bands).filter(|band| shown(band));
    let ends = |of: fn(&[f64; 3]) -> f64| {
        power().map(of).fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], v| [low.min(v), high.max(v)])
    };
    let bands = power().filter_map(|b| white_noise(b[2]));
    let [lowest, highest] = bands.fold(ends(|b| b[1]), |[low, high], [a, b]| [low.min(a), high.max(b)]);
    let [first, last] = ends(|b| b[0]);
    let figure_of = |model: &PlottedModel<'_>| {
        let axes = [
            Axis::logarithmic("frequency (Hz)").range(first / 1.2, last * 1.2),
            Axis::logarithmic("power (noise is 1)").range(lowest / 1.4, highest * 1.4),
        ];
        let chart = chart(model.title(), axes, frequency_series(std::slice::from_ref(model)))?;
        Some(Figure::new("").panel_size(HALF_PX, 300.0).panel(chart.without_legend()))
    };
    models.iter().filter_map(figure_of).collect()
}

fn shown(band: &[f64; 3]) -> bool {
    band.iter().all(|v| v.is_finite() && *v > 0.0)
}

fn frequency_series(models: &[PlottedModel<'_>]) -> Vec<Option<Series>> {
    let mut series = Vec::new();
    let bands = models.last().map(|model| &model.fit.trace.bands[..]).unwrap_or_default();
    let (mut x, mut low, mut high) = (Vec::new(), Vec::new(), Vec::new());
    for band in bands.iter().filter(|band| shown(band)) {
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
        let (x, y): (Vec<f64>, Vec<f64>) =
            fit.trace.bands.iter().filter(|band| shown(band)).map(|b| (b[0], b[1])).unzip();
        series.push((!x.is_empty()).then(|| Series::line(*name, x, y).colour(*colour)));
    }
    series
}

/// Autocorrelation of the residual of each model, with the band that holds 95 % of it if it is white.
pub(crate) fn autocorrelation_figures(models: &[PlottedModel<'_>]) -> Vec<Figure> {
    let figure_of = |model: &PlottedModel<'_>| {
        let trace = &model.fit.trace;
        let values = trace.autocorrelation.get(1..).filter(|values| !values.is_empty())?;
        let lags: Vec<f64> = (1..=values.len()).map(|lag| lag as f64).collect();
        let ends = [0.0, values.len() as f64 + 1.0];
        let half = Z_975 / (trace.count as f64).sqrt();
        let band = Series::trace(NOISE, ends, [0.0; 2]).band([-half; 2], [half; 2]).colour(Colour::Grey);
        let low = values.iter().map(|v| v.min(0.0)).collect::<Vec<f64>>();
        let high = values.iter().map(|v| v.max(0.0)).collect::<Vec<f64>>();
        let points = Series::points("", lags, values).interval(low, high).colour(model.colour);
        let most = values.iter().fold(2.5 * half, |most: f64, v| most.max(1.1 * v.abs()));
        let axes = [Axis::linear("lag (samples)"), Axis::linear("autocorrelation").range(-most, most)];
        let chart = chart(model.title(), axes, [Some(band), Some(points)])?;
        Some(Figure::new("").panel_size(HALF_PX, 280.0).panel(chart.without_legend()))
    };
    models.iter().filter_map(figure_of).collect()
}

/// Quantiles of the residual of each model against those of the normal distribution, with the band that holds each order statistic
/// of as many normal values in 95 % of all cases.
pub(crate) fn quantile_figures(models: &[PlottedModel<'_>]) -> Vec<Figure> {
    models
        .iter()
        .filter_map(|model| Some(Figure::new("").panel_size(HALF_PX, 320.0).panel(quantile_chart(model)?)))
        .collect()
}

fn quantile_chart(model: &PlottedModel<'_>) -> Option<Chart> {
    let trace = &model.fit.trace;
    let normal = Normal::new(0.0, 1.0).ok()?;
    let n = trace.count as f64;
    let (mut x, mut y, mut low, mut high) = (vec![], vec![], vec![], vec![]);
    for (rank, value) in &trace.order_statistics {
        let rank = *rank as f64;
        let of_rank = Beta::new(rank, n + 1.0 - rank).ok()?;
        x.push(normal.inverse_cdf((rank - 0.5) / n));
        y.push(*value);
        low.push(normal.inverse_cdf(of_rank.inverse_cdf(0.025)));
        high.push(normal.inverse_cdf(of_rank.inverse_cdf(0.975)));
    }
    if x.is_empty() {
        return None;
    }
    let band =
        Series::trace("95 % of normal noise", x.clone(), x.clone()).band(low, high).colour(Colour::Grey).dashed();
    let points = Series::trace("", x, y).colour(model.colour);
    let axes = [Axis::linear("quantile of the normal distribution"), Axis::linear("residual")];
    let chart = chart(model.title(), axes, [Some(band), Some(points)])?;
    Some(chart.without_legend())
}
