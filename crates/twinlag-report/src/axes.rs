//! The axes of a panel: grid, box, ticks and labels.

use crate::axis::{Axis, Ruler, Spacing, TICK_SIZE, Tick};
use crate::canvas::{Anchor, Canvas, Frame, GRID, INK, Ink, Outline, Text, text_width};

/// Size of axis labels.
pub(crate) const LABEL_SIZE: u32 = 13;
/// Height of a line of tick labels.
pub(crate) const TICK_LINE_PX: f64 = 14.0;

/// The label of a tick below the axis; names of categories are broken at spaces to fit their
/// places.
pub(crate) fn x_lines(axis: &Axis, tick: &Tick, (low, high): (f64, f64), width: f64) -> Vec<String> {
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
    let mut outline = Outline::default();
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
    let mut outline = Outline::default();
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
            let y = frame.bottom + 18.0 + TICK_LINE_PX * k as f64;
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
        let y = frame.bottom + 24.0 + TICK_LINE_PX * lines as f64;
        canvas.text((f64::midpoint(frame.left, frame.right), y), axes[0].label(), label);
    }
    if !axes[1].label().is_empty() {
        let x = frame.left - 16.0 - widest;
        canvas.text((x, f64::midpoint(frame.top, frame.bottom)), axes[1].label(), label.upwards());
    }
}
