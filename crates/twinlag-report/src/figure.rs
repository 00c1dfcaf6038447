//! Figures: panels in a grid, laid out so that axes align, and written as SVG.

use crate::ReportError;
use crate::axis::{Axis, Ruler, Spacing, TICK_SIZE, Tick};
use crate::canvas::{Anchor, Canvas, Frame, GRID, INK, Ink, Text, text_width};
use crate::chart::Chart;
use crate::chart_drawing::{Legend, draw_chart};
use crate::palette::{CYCLE, Colour};
use crate::surface::Surface;
use crate::surface_drawing::{bar_width, draw_surface};

/// Size of axis labels.
pub(crate) const LABEL_SIZE: u32 = 13;
const TITLE_SIZE: u32 = 14;
const FIGURE_TITLE_SIZE: u32 = 17;
/// Height of a line of tick labels.
const LINE_PX: f64 = 14.0;

/// A panel of a figure: a [`Chart`] or a [`Surface`].
#[derive(Clone, Debug, PartialEq)]
pub struct Panel(Kind);

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Chart(Chart),
    Surface(Surface),
}

impl From<Chart> for Panel {
    fn from(chart: Chart) -> Self {
        Self(Kind::Chart(chart))
    }
}

impl From<Surface> for Panel {
    fn from(surface: Surface) -> Self {
        Self(Kind::Surface(surface))
    }
}

/// Panels in a grid, row by row, under one title. Series of one name have one colour and one marker in all panels.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    title: String,
    columns: usize,
    panel_px: (f64, f64),
    panels: Vec<Panel>,
}

impl Figure {
    /// A figure without panels; an empty title takes no room.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), columns: 0, panel_px: (440.0, 330.0), panels: Vec::new() }
    }

    /// Panels in a row. Without this, or with zero: up to three, as square as can be.
    #[must_use]
    pub fn columns(self, columns: usize) -> Self {
        Self { columns, ..self }
    }

    /// Width and height of a panel, labels included; 440 by 330 px unless set. Text has a fixed size in pixels.
    #[must_use]
    pub fn panel_size(self, width_px: f64, height_px: f64) -> Self {
        Self { panel_px: (width_px, height_px), ..self }
    }

    /// With one panel more.
    #[must_use]
    pub fn panel(mut self, panel: impl Into<Panel>) -> Self {
        self.panels.push(panel.into());
        self
    }

    /// The figure as SVG. The same figure gives the same bytes.
    ///
    /// # Errors
    /// Any [`ReportError`]: no panels, panels without data, lengths that do not fit, ranges that are none.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        if self.panels.is_empty() {
            return Err(ReportError::NoPanels { figure: self.title.clone() });
        }
        let (width_px, height_px) = self.panel_px;
        if !(160.0..=1e4).contains(&width_px) || !(120.0..=1e4).contains(&height_px) {
            return Err(ReportError::PanelSize { width_px, height_px });
        }
        let styles = Styles::new(&self.panels);
        let columns = match self.columns {
            0 => (self.panels.len() as f64).sqrt().ceil().min(3.0) as usize,
            n => n.min(self.panels.len()),
        };
        let rows = self.panels.len().div_ceil(columns);
        let mut plans: Vec<Plan> =
            self.panels.iter().map(|p| Plan::new(&p.0, self.panel_px, &styles)).collect::<Result<_, _>>()?;
        // Aligned axes may leave less room than a panel alone: a legend that then hides data moves above them, which takes
        // room from its row, and so on; at most once for each panel.
        for _ in 0..plans.len() {
            let crowded = (0..plans.len()).find_map(|k| match &self.panels[k].0 {
                Kind::Chart(chart) if !plans[k].legend_above => {
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
            let title = format!("{letter}{}", panel.0.title());
            if !title.is_empty() {
                canvas.text((frame.left, top + 18.0), title.trim_end(), Text::new(TITLE_SIZE, Anchor::Start).bold());
            }
            match &panel.0 {
                Kind::Chart(chart) => draw_chart(&mut canvas, chart, plan.limits, &frame, &styles, plan.legend_above),
                Kind::Surface(surface) => {
                    draw_surface(&mut canvas, surface, plan.limits, plan.value_limits, &frame, plan.margins.right);
                }
            }
        }
        Ok(canvas.into_svg())
    }

    /// The axes of a panel whose upper left corner is the origin; those of one column, and of one row, begin and end
    /// together.
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

impl Kind {
    fn title(&self) -> &str {
        match self {
            Self::Chart(chart) => &chart.title,
            Self::Surface(surface) => &surface.title,
        }
    }
}

/// Colour and marker of each name, by a number: the least that no series has with which the name shares a panel. So names
/// that never meet may share a colour, and a figure of many panels does not run out of them.
pub(crate) struct Styles(Vec<(String, usize)>);

impl Styles {
    fn new(panels: &[Panel]) -> Self {
        let charts: Vec<Vec<&str>> = panels
            .iter()
            .filter_map(|panel| match &panel.0 {
                Kind::Chart(chart) => Some(chart.series.iter().map(|s| s.name.as_str()).collect()),
                Kind::Surface(_) => None,
            })
            .collect();
        let mut given: Vec<(String, usize)> = Vec::new();
        for &name in charts.iter().flatten() {
            if given.iter().any(|(n, _)| n == name) {
                continue;
            }
            let meets = |other: &str| charts.iter().any(|c| c.contains(&name) && c.contains(&other));
            let taken: Vec<usize> = given.iter().filter(|(n, _)| meets(n)).map(|(_, k)| *k).collect();
            let free = (0..=taken.len()).find(|k| !taken.contains(k)).unwrap_or(taken.len());
            given.push((name.to_owned(), free));
        }
        Self(given)
    }

    pub(crate) fn of(&self, name: &str, own: Option<Colour>) -> (Colour, usize) {
        let index = self.0.iter().find(|(n, _)| n == name).map_or(0, |(_, k)| *k);
        (own.unwrap_or(CYCLE[index % CYCLE.len()]), index)
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
    fn new(kind: &Kind, (width, height): (f64, f64), styles: &Styles) -> Result<Self, ReportError> {
        let (limits, value_limits, [x, y]) = match kind {
            Kind::Chart(chart) => (chart.limits()?, (0.0, 1.0), [&chart.x, &chart.y]),
            Kind::Surface(surface) => {
                let [x, y, value] = surface.limits()?;
                ([x, y], value, [&surface.x, &surface.y])
            }
        };
        // How many ticks there are depends on the room, which depends on the ticks: room for the widest of some guesses.
        let heights = [height - 60.0, height - 80.0, height - 110.0];
        let widest = heights
            .iter()
            .flat_map(|h| y.ticks(limits[1], Spacing::Down(*h)))
            .map(|t| text_width(&t.label, TICK_SIZE))
            .fold(0.0, f64::max);
        let left = 14.0 + widest + if y.label().is_empty() { 0.0 } else { 22.0 };
        let right = match kind {
            Kind::Chart(_) => 18.0,
            Kind::Surface(surface) => {
                heights.iter().map(|h| bar_width(&surface.value, value_limits, *h)).fold(0.0, f64::max)
            }
        };
        let x_ticks = x.ticks(limits[0], Spacing::Across(width - left - right));
        let lines = x_ticks.iter().map(|t| x_lines(x, t, limits[0], width - left - right).len()).max().unwrap_or(1);
        let bottom = 14.0 + LINE_PX * lines as f64 + if x.label().is_empty() { 0.0 } else { 22.0 };
        let mut margins = Margins { left, right, top: 28.0, bottom };
        let mut legend_above = false;
        if let Kind::Chart(chart) = kind {
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

/// The label of a tick below the axis; names of categories are broken at spaces to fit their places.
fn x_lines(axis: &Axis, tick: &Tick, (low, high): (f64, f64), width: f64) -> Vec<String> {
    if !axis.has_categories() {
        return vec![tick.label.clone()];
    }
    let room = width / (high - low) - 6.0;
    let mut lines: Vec<String> = Vec::new();
    // A word too long for its place is broken after its hyphens.
    let words = tick.label.split_whitespace().flat_map(|word| {
        let broken = text_width(word, TICK_SIZE) > room;
        word.split_inclusive(move |c| broken && c == '-')
    });
    for word in words {
        match lines.last_mut() {
            Some(line) if !line.ends_with('-') && text_width(&format!("{line} {word}"), TICK_SIZE) <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The rulers of a frame.
pub(crate) fn rulers([x, y]: [&Axis; 2], limits: [(f64, f64); 2], frame: &Frame) -> [Ruler; 2] {
    [Ruler::new(x, limits[0], frame.left, frame.right), Ruler::new(y, limits[1], frame.bottom, frame.top)]
}

/// Grid lines, to be drawn before the data.
pub(crate) fn draw_grid(canvas: &mut Canvas, axes: [&Axis; 2], limits: [(f64, f64); 2], frame: &Frame) {
    let [rx, ry] = rulers(axes, limits, frame);
    let mut outline = crate::canvas::Outline::default();
    if !axes[0].has_categories() {
        for tick in axes[0].ticks(limits[0], Spacing::Across(frame.width())).iter().filter(|t| !t.label.is_empty()) {
            let x = crisp(rx.px(tick.value));
            outline.line(&[(x, frame.top), (x, frame.bottom)]);
        }
    }
    for tick in axes[1].ticks(limits[1], Spacing::Down(frame.height())).iter().filter(|t| !t.label.is_empty()) {
        let y = crisp(ry.px(tick.value));
        outline.line(&[(frame.left, y), (frame.right, y)]);
    }
    canvas.draw(&outline, Ink::stroke(GRID, 1.0));
}

/// The middle of a pixel, where a thin line is sharp.
fn crisp(px: f64) -> f64 {
    px.floor() + 0.5
}

/// The box, ticks and labels, to be drawn after the data.
pub(crate) fn draw_axes(canvas: &mut Canvas, axes: [&Axis; 2], limits: [(f64, f64); 2], frame: &Frame) {
    let [rx, ry] = rulers(axes, limits, frame);
    let mut outline = crate::canvas::Outline::default();
    let length = |tick: &Tick| if tick.label.is_empty() { 3.0 } else { 5.0 };
    let mut lines = 1;
    for tick in axes[0].ticks(limits[0], Spacing::Across(frame.width())) {
        let x = crisp(rx.px(tick.value));
        if !axes[0].has_categories() {
            outline.line(&[(x, frame.bottom), (x, frame.bottom + length(&tick))]);
        }
        let text = x_lines(axes[0], &tick, limits[0], frame.width());
        lines = lines.max(text.len());
        for (k, line) in text.iter().enumerate().filter(|(_, line)| !line.is_empty()) {
            let y = frame.bottom + 18.0 + LINE_PX * k as f64;
            canvas.text((x, y), line, Text::new(TICK_SIZE, Anchor::Middle));
        }
    }
    let mut widest = 0.0_f64;
    for tick in axes[1].ticks(limits[1], Spacing::Down(frame.height())) {
        let y = crisp(ry.px(tick.value));
        outline.line(&[(frame.left - length(&tick), y), (frame.left, y)]);
        if !tick.label.is_empty() {
            widest = widest.max(text_width(&tick.label, TICK_SIZE));
            canvas.text((frame.left - 8.0, y + 4.0), &tick.label, Text::new(TICK_SIZE, Anchor::End));
        }
    }
    canvas.draw(&outline, Ink::stroke(INK, 1.0));
    let edge =
        Frame { left: frame.left + 0.5, top: frame.top + 0.5, right: frame.right + 0.5, bottom: frame.bottom + 0.5 };
    canvas.frame(&edge, Ink::stroke(INK, 1.0));
    let label = Text::new(LABEL_SIZE, Anchor::Middle);
    if !axes[0].label().is_empty() {
        let y = frame.bottom + 24.0 + LINE_PX * lines as f64;
        canvas.text((f64::midpoint(frame.left, frame.right), y), axes[0].label(), label);
    }
    if !axes[1].label().is_empty() {
        let x = frame.left - 16.0 - widest;
        canvas.text((x, f64::midpoint(frame.top, frame.bottom)), axes[1].label(), label.upwards());
    }
}
