//! How a chart is drawn: data to pixels, a place for the legend and for the labels of reference
//! lines.

use crate::axes::{draw_axes, draw_grid, rulers};
use crate::axis::Ruler;
use crate::canvas::{Anchor, Canvas, Frame, INK, Ink, Outline, Text, text_width};
use crate::chart::{Chart, Series, Shape};
use crate::decimate::decimate;
use crate::styles::Styles;

const LEGEND_SIZE: u32 = 12;
const ROW_PX: f64 = 17.0;
const SAMPLE_PX: f64 = 26.0;
const DASH: &str = "6 3.5";
const LINE_PX: f64 = 1.7;
const REFERENCE: &str = "#555555";
const REFERENCE_DASH: &str = "3 3";
type Point = (f64, f64);

/// A series in pixels; what is outside the frame is cut off.
struct Drawn {
    lines: Vec<Vec<Point>>,
    markers: Vec<Point>,
    /// Stems, then caps, of the error bars.
    errors: Vec<[Point; 2]>,
    caps: Vec<[Point; 2]>,
    bars: Vec<Frame>,
    bands: Vec<Vec<Point>>,
}

/// Runs of points without a gap.
fn runs(points: impl Iterator<Item = Point>) -> Vec<Vec<Point>> {
    let mut runs = vec![Vec::new()];
    for point in points {
        if point.0.is_finite() && point.1.is_finite() {
            if let Some(run) = runs.last_mut() {
                run.push(point);
            }
        } else if runs.last().is_some_and(|run| !run.is_empty()) {
            runs.push(Vec::new());
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

impl Drawn {
    fn new(chart: &Chart, index: usize, [rx, ry]: &[Ruler; 2], frame: &Frame) -> Self {
        let series = &chart.series[index];
        let bars = chart.series.iter().filter(|s| s.shape == Shape::Bars).count();
        let rank =
            chart.series[..index].iter().filter(|s| (s.shape == Shape::Bars) == (series.shape == Shape::Bars)).count();
        let among = if series.shape == Shape::Bars { bars } else { chart.series.len() - bars };
        // Bars take four fifths of their category's place together.
        let bar_px = 0.8 * (rx.px(1.0) - rx.px(0.0)) / bars.max(1) as f64;
        let step = if series.shape == Shape::Bars { bar_px } else { chart.dodge_px };
        let shift = (rank as f64 - (among as f64 - 1.0) / 2.0) * step;
        let xs: Vec<f64> = series.x.iter().map(|x| rx.px(*x) + shift).collect();
        let ys: Vec<f64> = series.y.iter().map(|y| ry.px(*y)).collect();
        let mut drawn =
            Self { lines: vec![], markers: vec![], errors: vec![], caps: vec![], bars: vec![], bands: vec![] };
        let points = || xs.iter().copied().zip(ys.iter().copied());
        let lines = match series.shape {
            Shape::Line => runs(points()),
            Shape::Trace => runs(decimate(&xs, &ys, frame.width() as usize).into_iter().map(|i| (xs[i], ys[i]))),
            Shape::Steps => runs(points())
                .into_iter()
                .map(|run| {
                    let corners = run.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
                    corners.chain(run.last().copied()).collect()
                })
                .collect(),
            Shape::Points | Shape::Bars => vec![],
        };
        drawn.lines = lines.iter().flat_map(|line| frame.clip_line(line)).collect();
        if matches!(series.shape, Shape::Line | Shape::Points) {
            drawn.markers = points().filter(|p| frame.holds(*p)).collect();
        }
        if series.shape == Shape::Bars {
            let base = ry.base_px();
            drawn.bars = points()
                .filter(|p| p.0.is_finite() && p.1.is_finite())
                .map(|(x, y)| Frame {
                    left: (x - 0.46 * bar_px).max(frame.left),
                    right: (x + 0.46 * bar_px).min(frame.right),
                    top: y.min(base).max(frame.top),
                    bottom: y.max(base).min(frame.bottom),
                })
                .filter(|bar| bar.left < bar.right && bar.top <= bar.bottom)
                .collect();
        }
        if let Some((low, high)) = &series.interval {
            for (i, (low, high)) in low.iter().zip(high).enumerate() {
                // A lower end at or below zero on a logarithmic axis reaches to the edge.
                let bottom = if low.is_finite() && ry.px(*low).is_nan() { frame.bottom } else { ry.px(*low) };
                let (x, top) = (xs[i], ry.px(*high));
                if ![x, bottom, top, ys[i]].into_iter().all(f64::is_finite) {
                    continue;
                }
                let Some((a, b)) = frame.clip((x, bottom), (x, top)) else { continue };
                drawn.errors.push([a, b]);
                for (end, cut) in [(bottom, a.1), (top, b.1)] {
                    // No cap where the bar is cut off: it goes on.
                    if (end - cut).abs() < 0.5 {
                        drawn.caps.push([(x - 3.5, cut), (x + 3.5, cut)]);
                    }
                }
            }
        }
        if let Some((low, high)) = &series.band {
            let keep: Vec<usize> = if series.shape == Shape::Trace {
                let edge = |values: &[f64]| {
                    let px: Vec<f64> = values.iter().map(|v| ry.px(*v)).collect();
                    decimate(&xs, &px, frame.width() as usize)
                };
                let mut keep = edge(low);
                keep.extend(edge(high));
                keep.sort_unstable();
                keep.dedup();
                keep
            } else {
                (0..xs.len()).collect()
            };
            // Both edges must be there: a gap in one is a gap in both.
            let both = |i: usize| (ry.px(low[i]) - ry.px(high[i])).is_finite() && xs[i].is_finite();
            for run in keep.split(|&i| !both(i)) {
                let upper = run.iter().map(|&i| (xs[i], ry.px(high[i])));
                let lower = run.iter().rev().map(|&i| (xs[i], ry.px(low[i])));
                let area = frame.clip_area(&upper.chain(lower).collect::<Vec<_>>());
                if area.len() > 2 {
                    drawn.bands.push(area);
                }
            }
        }
        drawn
    }

    /// Points that text should not hide, every few pixels.
    fn obstacles(&self) -> Vec<Point> {
        let along = |a: Point, b: Point| {
            let steps = ((b.0 - a.0).hypot(b.1 - a.1) / 4.0).ceil().max(1.0);
            (0..=steps as usize).map(move |k| {
                let t = k as f64 / steps;
                (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
            })
        };
        let mut points: Vec<Point> =
            self.lines.iter().flat_map(|l| l.windows(2)).flat_map(|p| along(p[0], p[1])).collect();
        points.extend(self.errors.iter().chain(&self.caps).flat_map(|[a, b]| along(*a, *b)));
        for &(x, y) in &self.markers {
            points.extend([(x - 4.0, y), (x + 4.0, y), (x, y - 4.0), (x, y + 4.0)]);
        }
        for bar in &self.bars {
            points.extend(
                along((bar.left, bar.top), (bar.left, bar.bottom))
                    .chain(along((bar.right, bar.top), (bar.right, bar.bottom)))
                    .chain(along((bar.left, bar.top), (bar.right, bar.top))),
            );
        }
        points
    }
}

fn hidden(place: &Frame, obstacles: &[Point]) -> usize {
    let grown =
        Frame { left: place.left - 3.0, top: place.top - 3.0, right: place.right + 3.0, bottom: place.bottom + 3.0 };
    obstacles.iter().filter(|p| grown.holds(**p)).count()
}

/// The entries of a legend: one for each name.
pub(crate) struct Legend {
    entries: Vec<Entry>,
}

struct Entry {
    name: String,
    colour: &'static str,
    marker: usize,
    shape: Shape,
    dashed: bool,
    reference: bool,
}

impl Legend {
    /// - `unplaced`: labels of reference lines for which there is no place along the line
    fn new(chart: &Chart, styles: &Styles, unplaced: &[&str]) -> Self {
        let mut entries: Vec<Entry> = Vec::new();
        if chart.legend && (chart.series.len() > 1 || !unplaced.is_empty()) {
            for series in chart.series.iter().filter(|s| !s.name.is_empty()) {
                if entries.iter().all(|e| e.name != series.name) {
                    entries.push(Entry::new(series, styles));
                }
            }
            entries.extend(unplaced.iter().map(|label| Entry::reference(label)));
        }
        Self { entries }
    }

    /// The legend of a chart, and whether there is a place inside where it hides nothing.
    pub(crate) fn plan(chart: &Chart, styles: &Styles, limits: [(f64, f64); 2], frame: &Frame) -> (Self, bool) {
        let rulers = rulers([&chart.x, &chart.y], limits, frame);
        let mut obstacles: Vec<Point> =
            (0..chart.series.len()).flat_map(|i| Drawn::new(chart, i, &rulers, frame).obstacles()).collect();
        let labels = place_labels(chart, &rulers, frame, &mut obstacles);
        let legend = Self::new(chart, styles, &unplaced(&labels));
        let fits = legend.entries.is_empty() || legend.place(frame, &obstacles).is_some_and(|(_, _, hides)| hides == 0);
        (legend, fits)
    }

    fn entry_width(&self) -> f64 {
        let text = self.entries.iter().map(|e| text_width(&e.name, LEGEND_SIZE)).fold(0.0, f64::max);
        SAMPLE_PX + 6.0 + text
    }

    /// Width and height of the legend with a given number of columns.
    fn size(&self, columns: usize) -> (f64, f64) {
        let gaps = 14.0 * (columns as f64 - 1.0) + 14.0;
        (self.entry_width() * columns as f64 + gaps, ROW_PX * self.entries.len().div_ceil(columns) as f64 + 7.0)
    }

    /// Number of columns above a chart of that width.
    fn columns_above(&self, width: f64) -> usize {
        (1..=self.entries.len()).rev().find(|n| self.size(*n).0 <= width).unwrap_or(1)
    }

    pub(crate) fn height_above(&self, width: f64) -> f64 {
        self.size(self.columns_above(width)).1
    }

    /// The place inside that hides least, corners first, with its number of columns and what it
    /// hides.
    fn place(&self, frame: &Frame, obstacles: &[Point]) -> Option<(Frame, usize, usize)> {
        let mut best: Option<(Frame, usize, usize)> = None;
        for columns in 1..=self.entries.len().min(3) {
            let (width, height) = self.size(columns);
            let (free_x, free_y) = (frame.width() - width - 12.0, frame.height() - height - 12.0);
            // It must not fill the chart.
            if free_x < 0.0 || free_y < 0.45 * height {
                continue;
            }
            let corners =
                [(1.0, 0.0), (0.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.0), (0.5, 1.0), (1.0, 0.5), (0.0, 0.5)];
            let between = (0..=8).flat_map(|i| (0..=8).map(move |j| (f64::from(i) / 8.0, f64::from(j) / 8.0)));
            for (x, y) in corners.into_iter().chain(between) {
                let (left, top) = (frame.left + 6.0 + x * free_x, frame.top + 6.0 + y * free_y);
                let place = Frame { left, top, right: left + width, bottom: top + height };
                let hides = hidden(&place, obstacles);
                if best.as_ref().is_none_or(|(_, _, least)| hides < *least) {
                    best = Some((place, columns, hides));
                }
            }
        }
        best
    }

    fn draw(&self, canvas: &mut Canvas, place: &Frame, columns: usize) {
        let rows = self.entries.len().div_ceil(columns);
        for (k, entry) in self.entries.iter().enumerate() {
            let x = place.left + 7.0 + (k / rows) as f64 * (self.entry_width() + 14.0);
            let y = place.top + 3.5 + ROW_PX * ((k % rows) as f64 + 0.5);
            entry.draw(canvas, (x, y.round()));
        }
    }
}

impl Entry {
    fn new(series: &Series, styles: &Styles) -> Self {
        let (colour, marker) = styles.of(&series.name, series.colour);
        let (name, colour) = (series.name.clone(), colour.hex());
        Self { name, colour, marker, shape: series.shape, dashed: series.dashed, reference: false }
    }

    fn reference(label: &str) -> Self {
        Self {
            name: label.to_owned(),
            colour: REFERENCE,
            marker: 0,
            shape: Shape::Trace,
            dashed: true,
            reference: true,
        }
    }

    fn draw(&self, canvas: &mut Canvas, (x, y): Point) {
        let middle = (x + SAMPLE_PX / 2.0, y);
        match self.shape {
            Shape::Bars => {
                let swatch = Frame { left: x + 6.0, top: y - 5.0, right: x + SAMPLE_PX - 6.0, bottom: y + 5.0 };
                canvas.frame(&swatch, Ink::fill(self.colour));
            }
            Shape::Points => {}
            Shape::Line | Shape::Trace | Shape::Steps => {
                let (width, dash) = if self.reference { (1.1, REFERENCE_DASH) } else { (LINE_PX, DASH) };
                let ink = Ink::stroke(self.colour, width).dash(self.dashed.then_some(dash));
                canvas.line(&[(x, y), (x + SAMPLE_PX, y)], ink);
            }
        }
        if matches!(self.shape, Shape::Line | Shape::Points) {
            draw_markers(canvas, &[middle], self.marker, self.colour, self.dashed);
        }
        canvas.text((x + SAMPLE_PX + 6.0, y + 4.0), &self.name, Text::new(LEGEND_SIZE, Anchor::Start));
    }
}

/// Markers of one series in one path; hollow ones are white inside.
fn draw_markers(canvas: &mut Canvas, points: &[Point], marker: usize, colour: &str, hollow: bool) {
    let mut outline = Outline::default();
    for &(x, y) in points {
        let corners: &[Point] = match marker % 6 {
            1 => &[(-3.1, -3.1), (3.1, -3.1), (3.1, 3.1), (-3.1, 3.1)],
            2 => &[(0.0, -4.2), (4.0, 3.0), (-4.0, 3.0)],
            3 => &[(0.0, -4.4), (4.0, 0.0), (0.0, 4.4), (-4.0, 0.0)],
            4 => &[(0.0, 4.2), (4.0, -3.0), (-4.0, -3.0)],
            5 => &[(0.0, -4.2), (4.0, -1.3), (2.5, 3.4), (-2.5, 3.4), (-4.0, -1.3)],
            _ => &[],
        };
        if corners.is_empty() {
            outline.ring((x, y), 3.4);
        } else {
            let corners: Vec<Point> = corners.iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
            outline.area(&corners);
        }
    }
    let ink = if hollow {
        Ink { fill: Some("#ffffff"), ..Ink::stroke(colour, 1.4) }
    } else {
        // A thin white rim keeps markers apart that touch.
        Ink { fill: Some(colour), ..Ink::stroke("#ffffff", 0.6) }
    };
    canvas.draw(&outline, ink);
}

/// A reference line in pixels, with the place of its label, if there is one that hides nothing.
struct Placed<'a> {
    label: &'a str,
    stroke: [Point; 2],
    place: Option<Frame>,
}

fn unplaced<'a>(placed: &[Placed<'a>]) -> Vec<&'a str> {
    placed.iter().filter(|p| p.place.is_none() && !p.label.is_empty()).map(|p| p.label).collect()
}

/// The strokes of the reference lines and places for their labels; both become obstacles.
fn place_labels<'a>(
    chart: &'a Chart,
    [rx, ry]: &[Ruler; 2],
    frame: &Frame,
    obstacles: &mut Vec<Point>,
) -> Vec<Placed<'a>> {
    let mut placed: Vec<Placed<'a>> = Vec::new();
    for reference in &chart.references {
        let px = if reference.horizontal { ry.px(reference.value) } else { rx.px(reference.value) };
        let stroke = if reference.horizontal {
            [(frame.left, px), (frame.right, px)]
        } else {
            [(px, frame.top), (px, frame.bottom)]
        };
        if !px.is_finite() || !frame.holds(stroke[0]) {
            continue;
        }
        let (width, height) = (text_width(&reference.label, LEGEND_SIZE), 13.0);
        let at = |left: f64, top: f64| Frame { left, top, right: left + width, bottom: top + height };
        let (right, bottom) = (frame.right - 6.0 - width, frame.bottom - 6.0 - height);
        let mut places = Vec::new();
        for k in 0..=16 {
            let t = f64::from(k) / 16.0;
            if reference.horizontal {
                let left = right + t * (frame.left + 6.0 - right);
                places.extend([at(left, px - 3.0 - height), at(left, px + 3.0)]);
            } else {
                let top = frame.top + 6.0 + t * (bottom - frame.top - 6.0);
                places.extend([at(px + 5.0, top), at(px - 5.0 - width, top)]);
            }
        }
        let clear = |place: &Frame| {
            let others = placed.iter().filter_map(|p| p.place.as_ref()).any(|other| other.overlaps(place));
            frame.encloses(place) && !others && hidden(place, obstacles) == 0
        };
        let place = places.into_iter().find(|place| !reference.label.is_empty() && clear(place));
        placed.push(Placed { label: &reference.label, stroke, place });
    }
    for Placed { stroke: [a, b], place, .. } in &placed {
        obstacles.extend((0..=60).map(|k| {
            let t = f64::from(k) / 60.0;
            (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
        }));
        if let Some(place) = place {
            let across = |k: i32| place.left + place.width() * f64::from(k) / 12.0;
            obstacles.extend((0..=12).flat_map(|k| [(across(k), place.top), (across(k), place.bottom)]));
        }
    }
    placed
}

pub(crate) fn draw_chart(
    canvas: &mut Canvas,
    chart: &Chart,
    limits: [(f64, f64); 2],
    frame: &Frame,
    styles: &Styles,
    legend_above: bool,
) {
    let axes = [&chart.x, &chart.y];
    draw_grid(canvas, axes, limits, frame);
    let rulers = rulers(axes, limits, frame);
    let drawn: Vec<Drawn> = (0..chart.series.len()).map(|i| Drawn::new(chart, i, &rulers, frame)).collect();
    let mut obstacles: Vec<Point> = drawn.iter().flat_map(Drawn::obstacles).collect();
    let labels = place_labels(chart, &rulers, frame, &mut obstacles);
    let entries: Vec<Entry> = chart.series.iter().map(|s| Entry::new(s, styles)).collect();
    for (drawn, entry) in drawn.iter().zip(&entries) {
        let mut outline = Outline::default();
        drawn.bands.iter().for_each(|band| {
            outline.area(band);
        });
        canvas.draw(&outline, Ink::fill(entry.colour).opacity(0.18));
        let mut outline = Outline::default();
        drawn.bars.iter().for_each(|bar| outline.cell(bar));
        canvas.draw(&outline, Ink::fill(entry.colour));
    }
    for placed in &labels {
        canvas.line(&placed.stroke, Ink::stroke(REFERENCE, 1.1).dash(Some(REFERENCE_DASH)));
    }
    for ((drawn, entry), series) in drawn.iter().zip(&entries).zip(&chart.series) {
        let mut errors = Outline::default();
        drawn.errors.iter().chain(&drawn.caps).for_each(|stroke| {
            errors.line(stroke);
        });
        // On a bar, an error bar of its own colour would be lost.
        let colour = if series.shape == Shape::Bars { INK } else { entry.colour };
        canvas.draw(&errors, Ink::stroke(colour, 1.2));
        let mut lines = Outline::default();
        drawn.lines.iter().for_each(|line| {
            lines.line(line);
        });
        let width = if series.shape == Shape::Trace { 1.2 } else { LINE_PX };
        canvas.draw(&lines, Ink::stroke(entry.colour, width).dash(entry.dashed.then_some(DASH)));
        draw_markers(canvas, &drawn.markers, entry.marker, entry.colour, entry.dashed);
    }
    for placed in &labels {
        if let Some(place) = &placed.place {
            canvas.text((place.left, place.bottom - 2.5), placed.label, Text::new(LEGEND_SIZE, Anchor::Start));
        }
    }
    draw_axes(canvas, axes, limits, frame);
    let legend = Legend::new(chart, styles, &unplaced(&labels));
    if legend.entries.is_empty() {
        return;
    }
    if legend_above {
        let columns = legend.columns_above(frame.width());
        let (width, height) = legend.size(columns);
        let (left, top) = (frame.left - 4.0, frame.top - height - 1.0);
        legend.draw(canvas, &Frame { left, top, right: left + width, bottom: top + height }, columns);
    } else if let Some((place, columns, _)) = legend.place(frame, &obstacles) {
        let ink = Ink { fill: Some("#ffffff"), ..Ink::stroke("#cccccc", 0.8) };
        canvas.frame(&place, ink.opacity(0.9));
        legend.draw(canvas, &place, columns);
    }
}
