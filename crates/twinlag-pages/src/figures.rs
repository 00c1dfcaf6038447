//! What pictures of answers share: colours that a reader meets again in every report, traces with their gaps, and axes that one
//! outlier does not flatten.

use statrs::distribution::{ChiSquared, ContinuousCDF};
use twinlag::diagnosis::ModelFit;
use twinlag_report::{Axis, Chart, Colour, Series};

use crate::words::capital;

pub(crate) const WIDTH_PX: f64 = 900.0;
/// Width of a picture that has another beside it, px.
pub(crate) const HALF_PX: f64 = 470.0;
/// A channel keeps its colour in every report; so do the gas, the reference and the models.
pub(crate) const CHANNELS: [Colour; 2] = [Colour::Blue, Colour::Vermilion];
pub(crate) const GAS: Colour = Colour::Green;
pub(crate) const REFERENCE: Colour = Colour::Black;
pub(crate) const BEFORE: Colour = Colour::Orange;
pub(crate) const AFTER: Colour = Colour::Purple;
/// Values at either end that an axis need not reach: so many at least, and this share of all.
const OUTLIERS: usize = 3;
const OUTLIER_SHARE: f64 = 2e-3;
/// An axis leaves them out where it would be so many times as long with them.
const FLATTENED: f64 = 3.0;
/// A step longer than this multiple of the usual one is a gap.
const GAP_STEPS: f64 = 10.0;

/// A model with its name in pictures.
pub(crate) struct PlottedModel<'a> {
    pub(crate) name: &'static str,
    pub(crate) fit: &'a ModelFit,
    pub(crate) colour: Colour,
}

impl PlottedModel<'_> {
    /// The name as a title.
    pub(crate) fn title(&self) -> String {
        capital(self.name)
    }
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
            // Between the two: a place that has a value as well is none.
            at.push(0.5 * (x[k - 1] + x_k));
            values.push(f64::NAN);
        }
        at.push(*x_k);
        values.push(*y_k);
    }
    drawn.then(|| Series::trace(name, at, values).colour(colour))
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

/// A range for an axis, and how many values lie outside: all but a few outliers where these would flatten the rest. `None` where
/// the axis may as well show everything.
pub(crate) fn without_outliers(values: impl Iterator<Item = f64>) -> Option<([f64; 2], usize)> {
    let mut sorted: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    let left_out = OUTLIERS.max((OUTLIER_SHARE * n as f64) as usize);
    if n < 20 * OUTLIERS {
        return None;
    }
    let (low, high) = (sorted[left_out], sorted[n - 1 - left_out]);
    if high <= low || sorted[n - 1] - sorted[0] < FLATTENED * (high - low) {
        return None;
    }
    let pad = 0.15 * (high - low);
    let range = [low - pad, high + pad];
    let outside = sorted.iter().filter(|v| **v < range[0] || **v > range[1]).count();
    Some((range, outside))
}

/// An axis that outliers do not flatten, and what is to be said of them beside a title.
pub(crate) fn robust_axis(label: &str, values: impl Iterator<Item = f64>) -> (Axis, String) {
    match without_outliers(values) {
        Some(([low, high], outside)) => {
            let values = if outside == 1 { "value lies" } else { "values lie" };
            (Axis::linear(label).range(low, high), format!(" ({outside} {values} outside)"))
        }
        None => (Axis::linear(label), String::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::without_outliers;

    /// One spike does not set the scale; a step that lasts does.
    #[test]
    fn an_axis_leaves_out_spikes_and_keeps_steps() {
        let mut values: Vec<f64> = (0..1000).map(|k| f64::from(k).sin()).collect();
        assert_eq!(without_outliers(values.iter().copied()), None);
        values[500] = 1e4;
        let ([low, high], outside) = without_outliers(values.iter().copied()).expect("a spike");
        assert!(outside == 1 && low < -1.0 && high > 1.0 && high < 2.0, "{low} to {high}, {outside}");
        values[400..440].fill(1e4);
        assert_eq!(without_outliers(values.iter().copied()), None);
    }
}
