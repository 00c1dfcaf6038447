//! Traces that a reader may enlarge: their values, thinned to what a page may hold, and the script that draws them.
//!
//! A trace of more points than [`MAX_POINTS`] is the lowest and the highest value in each of many equal parts of its axis, in their order,
//! so that no extreme is lost; the page says how long they are. From there the script makes a pyramid, each level of which keeps the extremes of the
//! one below it.

use base64ct::{Base64, Encoding};
use serde_json::{Value, json};

use crate::chart::{Chart, Series, Shape};
use crate::escape::is_unprintable;
use crate::palette::Colour;
use crate::styles::Styles;

/// uPlot 1.6.32 by Leon Sorokin, under the MIT licence of `uplot/LICENSE`.
const UPLOT: &str = include_str!("uplot/uPlot.iife.min.js");
pub(crate) const UPLOT_STYLE: &str = include_str!("uplot/uPlot.min.css");
const SCRIPT: &str = include_str!("live.js");

/// Points of a trace in a page: eight traces of them take a megabyte and a half.
const MAX_POINTS: usize = 32_768;
/// Part of a step by which instants may differ from an even grid that takes their place.
const EVEN_STEPS: f64 = 1e-3;
/// Height of a plot, px.
const HEIGHT_PX: f64 = 260.0;

/// The script of a page with such traces.
pub(crate) fn script() -> String {
    // A parser of XML takes the script for text, and one of HTML these marks for comments.
    format!("/*<![CDATA[*/\n{UPLOT}\n{SCRIPT}/*]]>*/")
}

/// The values of all traces of a page, each once.
#[derive(Debug, Default)]
pub(crate) struct Live {
    arrays: Vec<Value>,
    plots: Vec<Value>,
}

impl Live {
    pub(crate) fn is_empty(&self) -> bool {
        self.plots.is_empty()
    }

    /// Adds the charts of a figure that have traces, if any.
    pub(crate) fn add(&mut self, figure: usize, charts: &[&Chart], styles: &Styles) {
        let panels: Vec<Value> = charts.iter().filter_map(|chart| self.panel(chart, styles)).collect();
        if !panels.is_empty() {
            self.plots.push(json!({"figure": figure, "panels": panels}));
        }
    }

    /// All of it as JSON that may stand in a page.
    pub(crate) fn to_json(&self) -> String {
        let text = json!({"arrays": self.arrays, "plots": self.plots}).to_string();
        let text: String = text.chars().map(|c| if is_unprintable(c) { '\u{fffd}' } else { c }).collect();
        text.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
    }

    fn panel(&mut self, chart: &Chart, styles: &Styles) -> Option<Value> {
        // A grey band is behind the traces, and the same all along.
        let is_behind = |s: &&Series| s.band.is_some() && s.colour == Some(Colour::Grey);
        let drawn = chart.series.iter().filter(|s| matches!(s.shape, Shape::Trace | Shape::Points) && !is_behind(s));
        // The same instants for all, so that they are there once.
        let bins = Bins::of(drawn.clone())?;
        let mut series = Vec::new();
        let (mut bands, mut bars) = (Vec::new(), Vec::new());
        for one in drawn {
            for (ends, out) in [(&one.band, &mut bands), (&one.interval, &mut bars)] {
                let Some((low, high)) = ends else { continue };
                out.push(json!({"edges": [series.len() + 2, series.len() + 1], "colour": name(styles.of(&one.name, one.colour).0)}));
                series.extend([low, high].map(|edge| self.series(one, edge, styles, &bins)));
                series.iter_mut().rev().take(2).for_each(|edge| {
                    edge["edge"] = true.into();
                    edge["name"] = "".into();
                });
            }
            series.push(self.series(one, &one.y, styles, &bins));
        }
        let band = chart.series.iter().find(is_behind).and_then(|s| s.band.as_ref());
        let band = band.and_then(|(low, high)| Some([*low.first()?, *high.first()?]));
        let title = if chart.title.is_empty() { "Plot" } else { &chart.title };
        Some(json!({
            "title": title, "x": chart.x.label(), "y": chart.y.label(), "range": chart.y.given_range(),
            "band": band, "height": HEIGHT_PX, "bin": bins.is_needed.then_some(bins.width), "series": series, "bands": bands,
            "bars": bars,
        }))
    }

    fn series(&mut self, series: &Series, y: &[f64], styles: &Styles, bins: &Bins) -> Value {
        let (x, y) = bins.thinned(&series.x, y);
        let (x, y) = (self.instants(&x), self.values(&y));
        let colour = styles.of(&series.name, series.colour).0;
        json!({
            "name": series.name, "colour": name(colour), "dashed": series.dashed,
            "points": series.shape == Shape::Points, "x": x, "y": y,
        })
    }

    fn put(&mut self, array: Value) -> usize {
        self.arrays.iter().position(|known| *known == array).unwrap_or_else(|| {
            self.arrays.push(array);
            self.arrays.len() - 1
        })
    }

    fn values(&mut self, values: &[f64]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
        self.put(json!({"values": Base64::encode_string(&bytes)}))
    }

    /// Instants on an even grid are three numbers.
    fn instants(&mut self, x: &[f64]) -> usize {
        let step = match x {
            [first, .., last] => (last - first) / (x.len() - 1) as f64,
            _ => 0.0,
        };
        let first = x.first().copied().unwrap_or(0.0);
        let is_even = x.iter().enumerate().all(|(k, x)| (first + k as f64 * step - x).abs() <= EVEN_STEPS * step);
        if is_even {
            return self.put(json!({"first": first, "step": step, "count": x.len()}));
        }
        let bytes: Vec<u8> = x.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.put(json!({"exact": Base64::encode_string(&bytes)}))
    }
}

/// Equal parts of an axis, of which a long trace keeps the lowest and the highest value each.
#[derive(Debug)]
struct Bins {
    from: f64,
    width: f64,
    /// Whether any trace is that long.
    is_needed: bool,
}

impl Bins {
    /// As many as a page may hold of a trace; `None` without one.
    fn of<'a>(series: impl Iterator<Item = &'a Series>) -> Option<Self> {
        let (mut from, mut to, mut most) = (f64::INFINITY, f64::NEG_INFINITY, 0);
        for one in series {
            let finite = one.x.iter().copied().filter(|x| x.is_finite());
            (from, to) = finite.fold((from, to), |(low, high), x| (low.min(x), high.max(x)));
            most = most.max(one.x.len());
        }
        let width = (to - from) / (MAX_POINTS / 2) as f64;
        (most > 0 && from <= to).then_some(Self { from, width, is_needed: most > MAX_POINTS })
    }

    fn of_value(&self, x: f64) -> usize {
        (((x - self.from) / self.width) as usize).min(MAX_POINTS / 2 - 1)
    }

    /// A trace as it is or, if it is long, the lowest and the highest value of each bin, in their order, at the beginning and in the
    /// middle of the bin; a missing value ends it.
    fn thinned(&self, x: &[f64], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
        if x.len() <= MAX_POINTS {
            return (x.to_vec(), y.to_vec());
        }
        let (mut xs, mut ys) = (Vec::new(), Vec::new());
        let mut start = 0;
        while start < x.len().min(y.len()) {
            let bin = self.of_value(x[start]);
            let count = x[start..].iter().take_while(|x| self.of_value(**x) == bin).count().max(1);
            let part = start..(start + count).min(y.len());
            start += count;
            let by_value = |a: &usize, b: &usize| y[*a].total_cmp(&y[*b]);
            let finite = || part.clone().filter(|k| y[*k].is_finite());
            let begin = self.from + bin as f64 * self.width;
            if let (Some(low), Some(high)) = (finite().min_by(by_value), finite().max_by(by_value)) {
                xs.extend([begin, begin + 0.5 * self.width]);
                ys.extend([y[low.min(high)], y[low.max(high)]]);
            }
            if part.clone().any(|k| !y[k].is_finite()) {
                xs.push(begin + 0.75 * self.width);
                ys.push(f64::NAN);
            }
        }
        (xs, ys)
    }
}

/// The name of a colour in the style of the page.
fn name(colour: Colour) -> &'static str {
    match colour {
        Colour::Blue => "blue",
        Colour::Vermilion => "vermilion",
        Colour::Green => "green",
        Colour::Purple => "purple",
        Colour::Orange => "orange",
        Colour::Sky => "sky",
        Colour::Black => "black",
        Colour::Grey => "grey",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: the extremes of each bin by brute force.
    #[test]
    fn thinning_keeps_the_extremes_of_each_bin_and_the_gaps() {
        let n = 3 * MAX_POINTS + 5;
        let x: Vec<f64> = (0..n).map(|k| 0.5 * k as f64).collect();
        let mut y: Vec<f64> = x.iter().map(|x| (x * 2.399).sin() * (1.0 + 0.001 * x)).collect();
        y[500] = f64::NAN;
        let bins = Bins::of([Series::trace("", x.clone(), y.clone())].iter()).expect("a trace");
        let (xs, ys) = bins.thinned(&x, &y);
        assert!(bins.is_needed && xs.is_sorted() && xs.len() == ys.len() && xs.len() <= MAX_POINTS + 1, "{}", xs.len());
        let ranges = |x: &[f64], y: &[f64]| {
            let mut of_bins = vec![[f64::INFINITY, f64::NEG_INFINITY]; MAX_POINTS / 2];
            for (x, y) in x.iter().zip(y).filter(|(_, y)| y.is_finite()) {
                let [low, high] = &mut of_bins[bins.of_value(*x)];
                (*low, *high) = (low.min(*y), high.max(*y));
            }
            of_bins
        };
        // Half a bin later, or rounding may count the beginning of a bin to the one before.
        let within: Vec<f64> = xs.iter().map(|x| x + 0.1 * bins.width).collect();
        assert_eq!(ranges(&within, &ys), ranges(&x, &y));
        assert_eq!(ys.iter().filter(|y| y.is_nan()).count(), 1);
        assert_eq!(bins.thinned(&x[..90], &y[..90]), (x[..90].to_vec(), y[..90].to_vec()));
    }

    #[test]
    fn instants_that_are_even_are_three_numbers_and_arrays_are_there_once() {
        let mut live = Live::default();
        let even: Vec<f64> = (0..500).map(|k| 0.1 * f64::from(k)).collect();
        let uneven: Vec<f64> = (0..500).map(|k| f64::from(k).sqrt()).collect();
        assert_eq!([live.instants(&even), live.instants(&uneven), live.instants(&even)], [0, 1, 0]);
        assert_eq!(live.arrays[0]["count"], 500);
        assert_eq!([live.values(&even), live.values(&even)], [2, 2]);
    }
}
