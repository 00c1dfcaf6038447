//! How a surface is drawn: shades, contour lines, marks, colour bar.

use crate::axes::{LABEL_SIZE, draw_axes, rulers};
use crate::axis::{Axis, Ruler, Spacing, TICK_SIZE};
use crate::canvas::{Anchor, Canvas, Frame, INK, Ink, Outline, Text, heat, text_width};
use crate::contour::contour;
use crate::palette::Colour;
use crate::surface::Surface;

/// So many shades: few enough to keep the file small, enough that the steps hardly show between
/// contour lines.
const SHADES: usize = 24;
const GAP_PX: f64 = 12.0;
const BAR_PX: f64 = 14.0;

/// Room for the colour bar, its ticks and label, right of the axes.
pub(crate) fn bar_width(value: &Axis, limits: (f64, f64), height: f64) -> f64 {
    GAP_PX + BAR_PX + 9.0 + widest(value, limits, height) + if value.label().is_empty() { 8.0 } else { 26.0 }
}

fn widest(value: &Axis, limits: (f64, f64), height: f64) -> f64 {
    let ticks = value.ticks(limits, Spacing::Down(height));
    ticks.iter().map(|t| text_width(&t.label, TICK_SIZE)).fold(0.0, f64::max)
}

pub(crate) fn draw_surface(
    canvas: &mut Canvas,
    surface: &Surface,
    limits: [(f64, f64); 2],
    value_limits: (f64, f64),
    frame: &Frame,
    right_margin: f64,
) {
    let axes = [&surface.x, &surface.y];
    let [rx, ry] = rulers(axes, limits, frame);
    // Everything about the values in the terms of the colour axis: 0 at the lower end of the bar, 1
    // at the upper.
    let colour_axis = Ruler::new(&surface.value, value_limits, 0.0, 1.0);
    let shade: Vec<f64> = surface.z.iter().map(|z| colour_axis.px(*z)).collect();
    let xs: Vec<f64> = surface.xs.iter().map(|x| rx.px(*x)).collect();
    let ys: Vec<f64> = surface.ys.iter().map(|y| ry.px(*y)).collect();
    draw_shades(canvas, &shade, &xs, &ys, frame);

    let ticks = surface.value.ticks(value_limits, Spacing::Down(frame.height()));
    let levels: Vec<f64> = match &surface.levels {
        Some(levels) => levels.iter().map(|l| colour_axis.px(*l)).filter(|t| t.is_finite()).collect(),
        None => ticks.iter().filter(|t| !t.label.is_empty()).map(|t| colour_axis.px(t.value)).collect(),
    };
    for &level in &levels {
        let mut outline = Outline::default();
        for line in contour(&shade, xs.len(), level) {
            let line: Vec<(f64, f64)> = line.iter().map(|(i, j)| (between(&xs, *i), between(&ys, *j))).collect();
            for piece in frame.clip_line(&line) {
                outline.line(&piece);
            }
        }
        canvas.draw(&outline, Ink::stroke(line_colour(level), 0.9));
    }
    draw_axes(canvas, axes, limits, frame);
    draw_bar(canvas, surface, value_limits, &levels, frame, right_margin);
    draw_marks(canvas, surface, &rx, &ry, frame);
}

/// Dark on pale shades, white on dark ones.
fn line_colour(t: f64) -> &'static str {
    if t > 0.7 { "#ffffff" } else { "#444444" }
}

/// Between grid points, linear in pixels.
fn between(grid: &[f64], index: f64) -> f64 {
    let below = (index.floor() as usize).min(grid.len() - 2);
    grid[below] + (index - below as f64) * (grid[below + 1] - grid[below])
}

/// One path for each shade, of all cells at least that dark: each is painted over the paler ones,
/// so no gap shows.
fn draw_shades(canvas: &mut Canvas, shade: &[f64], xs: &[f64], ys: &[f64], frame: &Frame) {
    // Cells reach half way to their neighbours; the outermost end at the outermost grid points.
    let edges = |grid: &[f64]| -> Vec<f64> {
        let inner = grid.windows(2).map(|pair| f64::midpoint(pair[0], pair[1]));
        grid[..1].iter().copied().chain(inner).chain(grid[grid.len() - 1..].iter().copied()).collect()
    };
    let (x_edges, y_edges) = (edges(xs), edges(ys));
    let step = |t: f64| (t.is_finite()).then(|| ((t * SHADES as f64) as usize).min(SHADES - 1));
    for k in 0..SHADES {
        let mut outline = Outline::default();
        for j in 0..ys.len() {
            let row = &shade[j * xs.len()..(j + 1) * xs.len()];
            let dark = |i: usize| i < row.len() && step(row[i]).is_some_and(|s| s >= k);
            let mut i = 0;
            while i < row.len() {
                let start = i;
                while dark(i) {
                    i += 1;
                }
                if i > start {
                    let cell = Frame {
                        left: x_edges[start].max(frame.left),
                        right: x_edges[i].min(frame.right),
                        top: y_edges[j + 1].max(frame.top),
                        bottom: y_edges[j].min(frame.bottom),
                    };
                    if cell.width() > 0.0 && cell.height() > 0.0 {
                        outline.cell(&cell);
                    }
                } else {
                    i += 1;
                }
            }
        }
        canvas.draw(&outline, Ink::fill(&heat((k as f64 + 0.5) / SHADES as f64)));
    }
}

fn draw_bar(
    canvas: &mut Canvas,
    surface: &Surface,
    limits: (f64, f64),
    levels: &[f64],
    frame: &Frame,
    right_margin: f64,
) {
    let bar = Frame { left: frame.right + GAP_PX, right: frame.right + GAP_PX + BAR_PX, ..*frame };
    for k in 0..SHADES {
        let at = |k: usize| bar.bottom - bar.height() * k as f64 / SHADES as f64;
        let mut outline = Outline::default();
        outline.cell(&Frame { top: bar.top, bottom: at(k), ..bar });
        canvas.draw(&outline, Ink::fill(&heat((k as f64 + 0.5) / SHADES as f64)));
    }
    for &level in levels.iter().filter(|t| (0.0..=1.0).contains(*t)) {
        let y = bar.bottom - bar.height() * level;
        canvas.line(&[(bar.left, y), (bar.right, y)], Ink::stroke(line_colour(level), 0.9));
    }
    let ruler = Ruler::new(&surface.value, limits, bar.bottom, bar.top);
    let mut outline = Outline::default();
    for tick in surface.value.ticks(limits, Spacing::Down(frame.height())).iter().filter(|t| !t.label.is_empty()) {
        let y = ruler.px(tick.value).floor() + 0.5;
        outline.line(&[(bar.right, y), (bar.right + 4.0, y)]);
        canvas.text((bar.right + 7.0, y + 4.0), &tick.label, Text::new(TICK_SIZE, Anchor::Start));
    }
    canvas.draw(&outline, Ink::stroke(INK, 1.0));
    let edge = Frame { left: bar.left + 0.5, top: bar.top + 0.5, right: bar.right + 0.5, bottom: bar.bottom + 0.5 };
    canvas.frame(&edge, Ink::stroke(INK, 1.0));
    if !surface.value.label().is_empty() {
        let x = frame.right + right_margin - 10.0;
        let middle = f64::midpoint(bar.top, bar.bottom);
        canvas.text((x, middle), surface.value.label(), Text::new(LABEL_SIZE, Anchor::Middle).upwards());
    }
}

fn draw_marks(canvas: &mut Canvas, surface: &Surface, rx: &Ruler, ry: &Ruler, frame: &Frame) {
    let marks: Vec<(&crate::Mark, (f64, f64))> = surface
        .marks
        .iter()
        .map(|mark| (mark, (rx.px(mark.x), ry.px(mark.y))))
        .filter(|(_, at)| frame.holds(*at))
        .collect();
    let mut taken: Vec<Frame> = marks
        .iter()
        .map(|(_, (x, y))| Frame { left: x - 8.0, top: y - 8.0, right: x + 8.0, bottom: y + 8.0 })
        .collect();
    for (mark, (x, y)) in marks {
        let (x, y) = ((x * 2.0).round() / 2.0, (y * 2.0).round() / 2.0);
        if mark.cross {
            let mut outline = Outline::default();
            outline.line(&[(x - 5.0, y - 5.0), (x + 5.0, y + 5.0)]).line(&[(x - 5.0, y + 5.0), (x + 5.0, y - 5.0)]);
            canvas.draw(&outline, Ink::stroke("#ffffff", 4.5));
            canvas.draw(&outline, Ink::stroke("#000000", 2.0));
        } else {
            let mut outline = Outline::default();
            outline.ring((x, y), 5.0);
            canvas.draw(&outline, Ink { fill: Some(Colour::Vermilion.hex()), ..Ink::stroke("#ffffff", 1.5) });
        }
        if mark.label.is_empty() {
            continue;
        }
        let (width, height) = (text_width(&mark.label, TICK_SIZE) + 6.0, 17.0);
        let places =
            [(1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (0.0, 1.0)];
        let place = places
            .into_iter()
            .map(|(h, v): (f64, f64)| {
                let (centre_x, centre_y) = (x + h * (width / 2.0 + 9.0), y + v * (height / 2.0 + 8.0));
                let (left, top) = (centre_x - width / 2.0, centre_y - height / 2.0);
                Frame { left, top, right: left + width, bottom: top + height }
            })
            .min_by_key(|place| {
                let clear = taken.iter().filter(|other| other.overlaps(place)).count();
                clear + if frame.encloses(place) { 0 } else { 100 }
            });
        if let Some(place) = place {
            canvas.frame(&place, Ink::fill("#ffffff").opacity(0.8));
            canvas.text((place.left + 3.0, place.bottom - 4.5), &mark.label, Text::new(TICK_SIZE, Anchor::Start));
            taken.push(place);
        }
    }
}
