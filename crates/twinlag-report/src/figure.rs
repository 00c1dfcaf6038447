//! Figures: panels in a grid, laid out so that axes align, and written as SVG.

use crate::ReportError;
use crate::axes::{TICK_LINE_PX, x_lines};
use crate::axis::{Spacing, TICK_SIZE};
use crate::canvas::{Anchor, Canvas, Frame, Text, text_width};
use crate::chart::Chart;
use crate::chart_drawing::{Legend, draw_chart};
use crate::styles::Styles;
use crate::surface::Surface;
use crate::surface_drawing::{bar_width, draw_surface};

const TITLE_SIZE: u32 = 14;
const FIGURE_TITLE_SIZE: u32 = 17;

/// A panel of a figure.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Panel {
    /// Series on common axes.
    Chart(Chart),
    /// A function of two parameters.
    Surface(Surface),
}

impl Panel {
    /// The names of its series, if it is a chart.
    fn series_names(&self) -> Option<Vec<&str>> {
        match self {
            Panel::Chart(chart) => Some(chart.series.iter().map(|s| s.name.as_str()).collect()),
            Panel::Surface(_) => None,
        }
    }
}

impl From<Chart> for Panel {
    fn from(chart: Chart) -> Self {
        Self::Chart(chart)
    }
}

impl From<Surface> for Panel {
    fn from(surface: Surface) -> Self {
        Self::Surface(surface)
    }
}

/// Panels in a grid, row by row, under one title. Series of one name have one colour and one marker
/// in all panels.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    title: String,
    columns: usize,
    panel_px: (f64, f64),
    panels: Vec<Panel>,
    is_live: bool,
}

impl Figure {
    /// A figure without panels; an empty title takes no room.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), columns: 0, panel_px: (440.0, 330.0), panels: Vec::new(), is_live: false }
    }

    /// Panels in a row. Without this, or with zero: up to three, as square as can be.
    #[must_use]
    pub fn columns(self, columns: usize) -> Self {
        Self { columns, ..self }
    }

    /// Width and height of a panel, labels included; 440 by 330 px unless set. Text has a fixed
    /// size in pixels.
    ///
    /// ```
    /// use twinlag_report::{Axis, Chart, Figure, Series};
    ///
    /// let line = Series::line("", [0.0, 1.0], [0.0, 1.0]);
    /// let chart = Chart::new("", Axis::linear("x"), Axis::linear("y")).series(line);
    /// let two = Figure::new("").panel_size(300.0, 200.0).panel(chart.clone()).panel(chart);
    /// let (beside, below) = (two.clone().columns(2).to_svg()?, two.columns(1).to_svg()?);
    /// assert!(beside.contains("width=\"600\"") && below.contains("width=\"300\""));
    /// # Ok::<(), twinlag_report::ReportError>(())
    /// ```
    #[must_use]
    pub fn panel_size(self, width_px: f64, height_px: f64) -> Self {
        Self { panel_px: (width_px, height_px), ..self }
    }

    /// Lets the reader of a page enlarge its traces, where the page may have a script.
    #[must_use]
    pub fn live(self) -> Self {
        Self { is_live: true, ..self }
    }

    /// Its width, px.
    pub(crate) fn width_px(&self) -> f64 {
        self.panel_px.0 * self.columns_shown() as f64
    }

    fn columns_shown(&self) -> usize {
        match self.columns {
            0 => (self.panels.len() as f64).sqrt().ceil().min(3.0) as usize,
            n => n.min(self.panels.len()),
        }
    }

    pub(crate) fn panels(&self) -> &[Panel] {
        &self.panels
    }

    /// The charts whose traces may be enlarged.
    pub(crate) fn live_charts(&self) -> Vec<&Chart> {
        let charts = self.panels.iter().filter_map(|panel| match panel {
            Panel::Chart(chart) => Some(chart),
            Panel::Surface(_) => None,
        });
        charts.filter(|_| self.is_live).collect()
    }

    /// Colours and markers by name.
    pub(crate) fn styles(&self) -> Styles {
        let names = self.panels.iter().filter_map(Panel::series_names);
        Styles::new(&names.collect::<Vec<_>>())
    }

    /// Adds a panel.
    #[must_use]
    pub fn panel(mut self, panel: impl Into<Panel>) -> Self {
        self.panels.push(panel.into());
        self
    }

    /// The figure as SVG. The same figure gives the same bytes.
    ///
    /// # Errors
    /// Any [`ReportError`]: no panels, panels without data, lengths that do not fit, invalid
    /// ranges.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        if self.panels.is_empty() {
            return Err(ReportError::NoPanels { figure: self.title.clone() });
        }
        let (width_px, height_px) = self.panel_px;
        if !(160.0..=1e4).contains(&width_px) || !(120.0..=1e4).contains(&height_px) {
            return Err(ReportError::PanelSize { width_px, height_px });
        }
        let styles = self.styles();
        let columns = self.columns_shown();
        let rows = self.panels.len().div_ceil(columns);
        let mut plans: Vec<Plan> =
            self.panels.iter().map(|p| Plan::new(p, self.panel_px, &styles)).collect::<Result<_, _>>()?;
        // Aligned axes may leave less room than a panel alone: a legend that then hides data moves
        // above them, which takes room from its row, and so on; at most once for each panel.
        for _ in 0..plans.len() {
            let crowded = (0..plans.len()).find_map(|k| match &self.panels[k] {
                Panel::Chart(chart) if !plans[k].legend_above => {
                    let frame = self.frame(&plans, columns, k);
                    let (legend, fits) = Legend::plan(chart, &styles, plans[k].limits, &frame);
                    (!fits).then(|| (k, legend.height_above(frame.width())))
                }
                _ => None,
            });
            let Some((k, height)) = crowded else { break };
            plans[k].legend_above = true;
            plans[k].margins.top += height;
        }
        let head = if self.title.is_empty() { 0.0 } else { 34.0 };
        let mut canvas = Canvas::new(columns as f64 * width_px, head + rows as f64 * height_px);
        if head > 0.0 {
            let centre = columns as f64 * width_px / 2.0;
            canvas.text((centre, 24.0), &self.title, Text::new(FIGURE_TITLE_SIZE, Anchor::Middle).bold());
        }
        for (k, (panel, plan)) in self.panels.iter().zip(&plans).enumerate() {
            let (row, column) = (k / columns, k % columns);
            let (left, top) = (column as f64 * width_px, head + row as f64 * height_px);
            let frame = self.frame(&plans, columns, k).moved(left, top);
            let letter = if self.panels.len() > 1 { format!("({}) ", letter(k)) } else { String::new() };
            let title = format!("{letter}{}", panel.title());
            if !title.is_empty() {
                canvas.text((frame.left, top + 18.0), title.trim_end(), Text::new(TITLE_SIZE, Anchor::Start).bold());
            }
            match panel {
                Panel::Chart(chart) => draw_chart(&mut canvas, chart, plan.limits, &frame, &styles, plan.legend_above),
                Panel::Surface(surface) => {
                    draw_surface(&mut canvas, surface, plan.limits, plan.value_limits, &frame, plan.margins.right);
                }
            }
        }
        Ok(canvas.into_svg())
    }

    /// The axes of a panel whose upper left corner is the origin; those of one column, and of one
    /// row, begin and end together.
    fn frame(&self, plans: &[Plan], columns: usize, k: usize) -> Frame {
        let widest = |of_column: bool, margin: fn(&Margins) -> f64| {
            plans
                .iter()
                .enumerate()
                .filter(|(i, _)| if of_column { i % columns == k % columns } else { i / columns == k / columns })
                .map(|(_, plan)| margin(&plan.margins))
                .fold(0.0, f64::max)
        };
        Frame {
            left: widest(true, |m| m.left).round(),
            right: (self.panel_px.0 - widest(true, |m| m.right)).round(),
            top: widest(false, |m| m.top).round(),
            bottom: (self.panel_px.1 - widest(false, |m| m.bottom)).round(),
        }
    }
}

/// a, b, …, z, aa, ab, …
fn letter(k: usize) -> String {
    let last = char::from(b'a' + (k % 26) as u8);
    if k < 26 { last.to_string() } else { format!("{}{last}", letter(k / 26 - 1)) }
}

impl Panel {
    fn title(&self) -> &str {
        match self {
            Self::Chart(chart) => &chart.title,
            Self::Surface(surface) => &surface.title,
        }
    }
}

/// Room around the axes of a panel, in pixels.
#[derive(Clone, Copy, Debug)]
struct Margins {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

/// What is settled about a panel before it is drawn.
struct Plan {
    limits: [(f64, f64); 2],
    value_limits: (f64, f64),
    margins: Margins,
    legend_above: bool,
}

impl Plan {
    fn new(kind: &Panel, (width, height): (f64, f64), styles: &Styles) -> Result<Self, ReportError> {
        let (limits, value_limits, [x, y]) = match kind {
            Panel::Chart(chart) => (chart.limits()?, (0.0, 1.0), [&chart.x, &chart.y]),
            Panel::Surface(surface) => {
                let [x, y, value] = surface.limits()?;
                ([x, y], value, [&surface.x, &surface.y])
            }
        };
        // How many ticks there are depends on the room, which depends on the ticks: room for the
        // widest of some guesses.
        let heights = [height - 60.0, height - 80.0, height - 110.0];
        let widest = heights
            .iter()
            .flat_map(|h| y.ticks(limits[1], Spacing::Down(*h)))
            .map(|t| text_width(&t.label, TICK_SIZE))
            .fold(0.0, f64::max);
        let left = 14.0 + widest + if y.label().is_empty() { 0.0 } else { 22.0 };
        let right = match kind {
            Panel::Chart(_) => 18.0,
            Panel::Surface(surface) => {
                heights.iter().map(|h| bar_width(&surface.value, value_limits, *h)).fold(0.0, f64::max)
            }
        };
        let x_ticks = x.ticks(limits[0], Spacing::Across(width - left - right));
        let lines = x_ticks.iter().map(|t| x_lines(x, t, limits[0], width - left - right).len()).max().unwrap_or(1);
        let bottom = 14.0 + TICK_LINE_PX * lines as f64 + if x.label().is_empty() { 0.0 } else { 22.0 };
        let mut margins = Margins { left, right, top: 28.0, bottom };
        let mut legend_above = false;
        if let Panel::Chart(chart) = kind {
            let frame = Frame { left, top: margins.top, right: width - right, bottom: height - bottom };
            let (legend, fits) = Legend::plan(chart, styles, limits, &frame);
            if !fits {
                legend_above = true;
                margins.top += legend.height_above(frame.width());
            }
        }
        Ok(Self { limits, value_limits, margins, legend_above })
    }
}
