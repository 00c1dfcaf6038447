//! Charts: lines, points, steps and bars over common axes. A [`Series`] is data with a name; the
//! [`Chart`] puts them on axes; colours and markers are handed out by the figure, by name.

use crate::ReportError;
use crate::axis::Axis;
use crate::palette::Colour;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Line,
    Trace,
    Points,
    Steps,
    Bars,
}

/// Named data to be drawn: values `y` at places `x`, in the units of the chart's axes.
///
/// Values that are not finite, and on a logarithmic axis those not positive, are left out; lines
/// have a gap there.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub(crate) name: String,
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
    pub(crate) shape: Shape,
    pub(crate) interval: Option<(Vec<f64>, Vec<f64>)>,
    pub(crate) band: Option<(Vec<f64>, Vec<f64>)>,
    pub(crate) dashed: bool,
    pub(crate) colour: Option<Colour>,
}

impl Series {
    fn new(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>, shape: Shape) -> Self {
        Self { name: name.into(), x, y, shape, interval: None, band: None, dashed: false, colour: None }
    }

    /// A line with a marker at each point, for some ten points. With an empty name the series is
    /// not in the legend.
    pub fn line(name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Self::new(name, x.into(), y.into(), Shape::Line)
    }

    /// A line without markers, of any number of points: it is thinned with
    /// [`decimate`](crate::decimate()).
    pub fn trace(name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Self::new(name, x.into(), y.into(), Shape::Trace)
    }

    /// Markers without a line.
    pub fn points(name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Self::new(name, x.into(), y.into(), Shape::Points)
    }

    /// A staircase: each value holds until the next.
    pub fn steps(name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Self::new(name, x.into(), y.into(), Shape::Steps)
    }

    /// Bars, one for each category of [`Axis::categories`], in its order. Several such series stand
    /// side by side.
    ///
    /// ```
    /// use twinlag_report::{Axis, Chart, Figure, Series};
    ///
    /// let methods = Axis::categories("", ["plain", "compensated", "whitened"]);
    /// let chart = Chart::new("Bias", methods, Axis::linear("bias of τ₁ (%)"))
    ///     .series(Series::bars("5 % noise", [-3.1, 0.4, 0.1]))
    ///     .series(Series::bars("10 % noise", [-9.8, 0.9, 0.2]));
    /// let svg = Figure::new("").panel(chart).to_svg()?;
    /// assert!(svg.contains("compensated") && svg.contains("10 % noise"));
    /// # Ok::<(), twinlag_report::ReportError>(())
    /// ```
    pub fn bars(name: impl Into<String>, y: impl Into<Vec<f64>>) -> Self {
        let y = y.into();
        Self::new(name, (0..y.len()).map(|i| i as f64).collect(), y, Shape::Bars)
    }

    /// Error bars from `y − error` to `y + error`, `[n]`.
    ///
    /// ```
    /// use twinlag_report::{Axis, Chart, Figure, ReportError, Series};
    ///
    /// let bias = Series::points("bias", [1.0, 2.0, 3.0], [0.1, 0.3, 0.2]);
    /// let chart = |series| Chart::new("", Axis::linear("noise (%)"), Axis::linear("bias (%)")).series(series);
    /// assert!(Figure::new("").panel(chart(bias.clone().errors([0.05, 0.1, 0.05]))).to_svg().is_ok());
    /// // Two errors for three points are a mistake, which the figure reports.
    /// let wrong = Figure::new("").panel(chart(bias.errors([0.05, 0.1]))).to_svg();
    /// assert!(matches!(wrong, Err(ReportError::LengthMismatch { expected: 3, got: 2, .. })));
    /// ```
    #[must_use]
    pub fn errors(self, error: impl Into<Vec<f64>>) -> Self {
        let error = error.into();
        // A length that does not fit must stay so, to be reported.
        let end = |sign: f64| -> Vec<f64> {
            error.iter().enumerate().map(|(i, e)| self.y.get(i).map_or(f64::NAN, |y| y + sign * e)).collect()
        };
        let interval = Some((end(-1.0), end(1.0)));
        Self { interval, ..self }
    }

    /// Error bars from `low` to `high`: values on the axis, `[n]` each, not distances from `y`.
    #[must_use]
    pub fn interval(self, low: impl Into<Vec<f64>>, high: impl Into<Vec<f64>>) -> Self {
        Self { interval: Some((low.into(), high.into())), ..self }
    }

    /// A pale band from `low` to `high`, `[n]` each.
    #[must_use]
    pub fn band(self, low: impl Into<Vec<f64>>, high: impl Into<Vec<f64>>) -> Self {
        Self { band: Some((low.into(), high.into())), ..self }
    }

    /// A dashed line, with hollow markers.
    #[must_use]
    pub fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }

    /// A colour of its own, instead of the one that goes with the name.
    #[must_use]
    pub fn colour(self, colour: Colour) -> Self {
        Self { colour: Some(colour), ..self }
    }

    fn check(&self) -> Result<(), ReportError> {
        if self.x.is_empty() {
            return Err(ReportError::EmptySeries { series: self.name.clone() });
        }
        let (interval, band) = (self.interval.as_ref(), self.band.as_ref());
        let lengths = [
            ("y", Some(&self.y)),
            ("the lower ends of the error bars", interval.map(|i| &i.0)),
            ("the upper ends of the error bars", interval.map(|i| &i.1)),
            ("the lower edge of the band", band.map(|b| &b.0)),
            ("the upper edge of the band", band.map(|b| &b.1)),
        ];
        for (quantity, values) in lengths {
            if let Some(got) = values.map(Vec::len)
                && got != self.x.len()
            {
                let (series, expected) = (self.name.clone(), self.x.len());
                return Err(ReportError::LengthMismatch { series, quantity, expected, got });
            }
        }
        Ok(())
    }
}

/// A line across the whole chart at one value, such as `y = 0`; it widens the axis if need be.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    pub(crate) value: f64,
    pub(crate) horizontal: bool,
    pub(crate) label: String,
}

impl Reference {
    /// At a value of `y`.
    pub fn horizontal(y: f64) -> Self {
        Self { value: y, horizontal: true, label: String::new() }
    }

    /// At a value of `x`.
    pub fn vertical(x: f64) -> Self {
        Self { value: x, horizontal: false, label: String::new() }
    }

    /// A label: along the line where it hides no data, or in the legend if there is no such place.
    #[must_use]
    pub fn label(self, label: impl Into<String>) -> Self {
        Self { label: label.into(), ..self }
    }
}

/// Series on common axes.
///
/// The legend goes inside, where it hides nothing, or above the axes if there is no such place. A
/// chart of one series has none.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
    pub(crate) references: Vec<Reference>,
    pub(crate) dodge_px: f64,
    pub(crate) legend: bool,
}

impl Chart {
    /// A chart without series.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        let (series, references) = (Vec::new(), Vec::new());
        Self { title: title.into(), x, y, series, references, dodge_px: 0.0, legend: true }
    }

    /// Adds a series, drawn above the earlier ones.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a reference line.
    #[must_use]
    pub fn reference(mut self, reference: Reference) -> Self {
        self.references.push(reference);
        self
    }

    /// Moves the series sideways by `step_px` pixels from one to the next, so that error bars at
    /// one `x` stay apart.
    #[must_use]
    pub fn dodge(self, step_px: f64) -> Self {
        Self { dodge_px: step_px, ..self }
    }

    /// Leaves out the legend, for example because another panel has it.
    #[must_use]
    pub fn without_legend(self) -> Self {
        Self { legend: false, ..self }
    }

    /// The ranges of `x` and `y` to be drawn.
    pub(crate) fn limits(&self) -> Result<[(f64, f64); 2], ReportError> {
        if self.series.is_empty() {
            return Err(ReportError::NoSeries { chart: self.title.clone() });
        }
        self.series.iter().try_for_each(Series::check)?;
        let references =
            |horizontal: bool| self.references.iter().filter(move |r| r.horizontal == horizontal).map(|r| r.value);
        // Only points that can be drawn count: on logarithmic axes, an x whose y is zero is no
        // point.
        let shown = |s: &Series, i: usize| self.x.shows(s.x[i]) && self.y.shows(s.y[i]);
        let points =
            || self.series.iter().flat_map(move |s| (0..s.x.len()).filter(move |i| shown(s, *i)).map(move |i| (s, i)));
        let nothing = || ReportError::NothingToShow { chart: self.title.clone() };
        if points().next().is_none() {
            return Err(nothing());
        }
        let ends = |pair: &Option<(Vec<f64>, Vec<f64>)>, i: usize| {
            pair.as_ref().map_or([f64::NAN; 2], |(low, high)| [low[i], high[i]])
        };
        let bars = self.series.iter().any(|s| s.shape == Shape::Bars);
        let floor = (bars && !self.y.is_logarithmic()).then_some(0.0);
        let y = points()
            .flat_map(|(s, i)| {
                let ([a, b], [c, d]) = (ends(&s.interval, i), ends(&s.band, i));
                [s.y[i], a, b, c, d]
            })
            .chain(references(true))
            .chain(floor);
        let x = points().map(|(s, i)| s.x[i]).chain(references(false));
        let x = self.x.limits(x, 0.04, None)?.ok_or_else(nothing)?;
        let y = self.y.limits(y, 0.07, floor)?.ok_or_else(nothing)?;
        Ok([x, y])
    }
}
