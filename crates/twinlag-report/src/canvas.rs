//! A sheet on which the others draw lines, areas and text in pixels, `y` downwards, and the writer
//! of its SVG: two elements, `path` and `text`, are all that the figures are made of.

use std::fmt::Write;

use crate::escape::escaped;

/// `DejaVu Sans` first: the widths of [`text_width`] are its widths, and it is wider than the
/// others.
const FONT: &str = "DejaVu Sans, Verdana, Liberation Sans, Arial, sans-serif";

pub(crate) const INK: &str = "#222222";
pub(crate) const GRID: &str = "#e4e4e4";

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// A rectangle in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

impl Frame {
    pub(crate) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(crate) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub(crate) fn moved(&self, right: f64, down: f64) -> Self {
        Self { left: self.left + right, top: self.top + down, right: self.right + right, bottom: self.bottom + down }
    }

    /// Whether a point is inside, or within half a pixel of it.
    pub(crate) fn holds(&self, (x, y): (f64, f64)) -> bool {
        x >= self.left - 0.5 && x <= self.right + 0.5 && y >= self.top - 0.5 && y <= self.bottom + 0.5
    }

    pub(crate) fn encloses(&self, other: &Self) -> bool {
        self.left <= other.left && self.top <= other.top && self.right >= other.right && self.bottom >= other.bottom
    }

    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }

    /// The part of a stroke inside the frame (Liang and Barsky), if any.
    pub(crate) fn clip(&self, a: (f64, f64), b: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (p, q) in [(-dx, a.0 - self.left), (dx, self.right - a.0), (-dy, a.1 - self.top), (dy, self.bottom - a.1)] {
            if p == 0.0 {
                if q < 0.0 {
                    return None;
                }
            } else if p < 0.0 {
                from = from.max(q / p);
            } else {
                to = to.min(q / p);
            }
        }
        (from <= to).then_some(((a.0 + from * dx, a.1 + from * dy), (a.0 + to * dx, a.1 + to * dy)))
    }

    /// A line cut to the frame: where it leaves, a new piece begins.
    pub(crate) fn clip_line(&self, line: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
        let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
        for pair in line.windows(2) {
            let Some((a, b)) = self.clip(pair[0], pair[1]) else { continue };
            match pieces.last_mut() {
                Some(piece) if piece.last() == Some(&a) => piece.push(b),
                _ => pieces.push(vec![a, b]),
            }
        }
        pieces
    }

    /// An area cut to the frame (Sutherland and Hodgman).
    pub(crate) fn clip_area(&self, area: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let mut area = area.to_vec();
        for side in 0..4 {
            let depth = |(x, y): (f64, f64)| match side {
                0 => x - self.left,
                1 => self.right - x,
                2 => y - self.top,
                _ => self.bottom - y,
            };
            let mut cut = Vec::with_capacity(area.len() + 2);
            for (i, &b) in area.iter().enumerate() {
                let a = area[(i + area.len() - 1) % area.len()];
                let (inside_a, inside_b) = (depth(a), depth(b));
                if (inside_a < 0.0) != (inside_b < 0.0) {
                    let t = inside_a / (inside_a - inside_b);
                    cut.push((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)));
                }
                if inside_b >= 0.0 {
                    cut.push(b);
                }
            }
            area = cut;
        }
        area
    }
}

/// The outline of many strokes, as one SVG path: one element with short numbers, which is what
/// keeps the files small.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outline(String);

impl Outline {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn point(&mut self, command: char, (x, y): (f64, f64)) {
        // Tenths of a pixel; `+ 0.0` turns −0 into 0.
        let tenths = |v: f64| (v * 10.0).round() / 10.0 + 0.0;
        // A String takes whatever is written to it.
        let _ = write!(self.0, "{command}{} {}", tenths(x), tenths(y));
    }

    pub(crate) fn line(&mut self, points: &[(f64, f64)]) -> &mut Self {
        for (i, &point) in points.iter().enumerate() {
            self.point(if i == 0 { 'M' } else { 'L' }, point);
        }
        self
    }

    pub(crate) fn area(&mut self, points: &[(f64, f64)]) -> &mut Self {
        if !points.is_empty() {
            self.line(points).0.push('Z');
        }
        self
    }

    /// A box on whole pixels: neighbours share their edge exactly, so that no hairline shows
    /// between them.
    pub(crate) fn cell(&mut self, frame: &Frame) {
        let (left, top) = (frame.left.round(), frame.top.round());
        let (width, height) = (frame.right.round() - left, frame.bottom.round() - top);
        let _ = write!(self.0, "M{left} {top}h{width}v{height}h{}z", -width);
    }

    /// A full circle.
    pub(crate) fn ring(&mut self, (x, y): (f64, f64), radius: f64) {
        self.point('M', (x - radius, y));
        let _ =
            write!(self.0, "a{radius} {radius} 0 1 0 {} 0a{radius} {radius} 0 1 0 {} 0z", 2.0 * radius, -2.0 * radius);
    }
}

/// How an outline is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ink<'a> {
    pub(crate) stroke: Option<&'a str>,
    pub(crate) width: f64,
    pub(crate) fill: Option<&'a str>,
    pub(crate) fill_opacity: Option<f64>,
    pub(crate) dash: Option<&'a str>,
}

impl<'a> Ink<'a> {
    pub(crate) fn stroke(colour: &'a str, width: f64) -> Self {
        Self { stroke: Some(colour), width, fill: None, fill_opacity: None, dash: None }
    }

    pub(crate) fn fill(colour: &'a str) -> Self {
        Self { stroke: None, width: 0.0, fill: Some(colour), fill_opacity: None, dash: None }
    }

    pub(crate) fn opacity(self, opacity: f64) -> Self {
        Self { fill_opacity: Some(opacity), ..self }
    }

    pub(crate) fn dash(self, dash: Option<&'a str>) -> Self {
        Self { dash, ..self }
    }
}

pub(crate) struct Canvas {
    width: f64,
    height: f64,
    elements: String,
}

impl Canvas {
    pub(crate) fn new(width: f64, height: f64) -> Self {
        Self { width, height, elements: String::new() }
    }

    fn put(&mut self, text: std::fmt::Arguments<'_>) {
        // A String takes whatever is written to it.
        let _ = self.elements.write_fmt(text);
    }

    pub(crate) fn draw(&mut self, outline: &Outline, ink: Ink<'_>) {
        if outline.is_empty() {
            return;
        }
        let (stroke, width) = (ink.stroke.unwrap_or("none"), Short(ink.width));
        self.put(format_args!(r#"<path d="{}" stroke="{stroke}" stroke-width="{width}""#, outline.0));
        self.put(format_args!(r#" fill="{}""#, ink.fill.unwrap_or("none")));
        if let Some(opacity) = ink.fill_opacity {
            self.put(format_args!(r#" fill-opacity="{}""#, Short(opacity)));
        }
        if let Some(dash) = ink.dash {
            self.put(format_args!(r#" stroke-dasharray="{dash}""#));
        }
        self.put(format_args!(" />"));
    }

    pub(crate) fn line(&mut self, points: &[(f64, f64)], ink: Ink<'_>) {
        self.draw(Outline::default().line(points), ink);
    }

    pub(crate) fn frame(&mut self, frame: &Frame, ink: Ink<'_>) {
        let corners = [
            (frame.left, frame.top),
            (frame.right, frame.top),
            (frame.right, frame.bottom),
            (frame.left, frame.bottom),
        ];
        self.draw(Outline::default().area(&corners), ink);
    }

    pub(crate) fn text(&mut self, (x, y): (f64, f64), content: &str, style: Text) {
        // Half pixels: shorter numbers, and steadier glyphs.
        let [x, y] = [x, y].map(|v| Short((v * 2.0).round() / 2.0));
        let anchor = match style.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        self.put(format_args!(r#"<text x="{x}" y="{y}" font-size="{}" text-anchor="{anchor}""#, style.size));
        if style.bold {
            self.put(format_args!(r#" font-weight="bold""#));
        }
        if style.upwards {
            self.put(format_args!(r#" transform="rotate(-90,{x},{y})""#));
        }
        self.put(format_args!(">{}</text>", escaped(&content.replace(char::is_whitespace, " "))));
    }

    pub(crate) fn into_svg(self) -> String {
        let (width, height) = (Short(self.width), Short(self.height));
        format!(
            "<svg viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             font-family=\"{FONT}\" fill=\"{INK}\"><rect width=\"100%\" height=\"100%\" fill=\"white\" />{}</svg>",
            self.elements
        )
    }
}

/// A number as it stands in the file: to hundredths, and no more digits than it takes.
#[derive(Clone, Copy)]
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // `+ 0.0` turns −0 into 0.
        write!(f, "{}", (self.0 * 100.0).round() / 100.0 + 0.0)
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Text {
    pub(crate) size: u32,
    pub(crate) anchor: Anchor,
    pub(crate) bold: bool,
    pub(crate) upwards: bool,
}

impl Text {
    pub(crate) fn new(size: u32, anchor: Anchor) -> Self {
        Self { size, anchor, bold: false, upwards: false }
    }

    pub(crate) fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub(crate) fn upwards(self) -> Self {
        Self { upwards: true, ..self }
    }
}

/// The colour of a heat map at `t` in [0, 1]: pale yellow to dark violet, viridis from its end,
/// lightened by a quarter so that lines and marks stand out.
pub(crate) fn heat(t: f64) -> String {
    let colour = colorous::VIRIDIS.eval_continuous((1.0 - t).clamp(0.0, 1.0));
    let [r, g, b] = colour.as_array().map(|c| c + (255 - c) / 4);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Width of a text in pixels: the advance widths of `DejaVu Sans`, by classes of characters, to
/// about 5 %.
pub(crate) fn text_width(text: &str, size: u32) -> f64 {
    let ems: f64 = text
        .chars()
        .map(|c| match c {
            'i' | 'j' | 'l' | '\'' | '|' => 0.28,
            ' ' | '.' | ',' | ':' | ';' | 'I' | '/' => 0.33,
            'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '-' | '!' => 0.40,
            '⁰' | '¹' | '²' | '³' | '⁴' | '⁵' | '⁶' | '⁷' | '⁸' | '⁹' | '⁻' | '₀' | '₁' | '₂' | '₃' => {
                0.42
            }
            'm' | '%' | 'M' | 'W' | '@' | '—' => 0.98,
            'w' | '−' | '×' | '±' | '=' | '<' | '>' | '+' | '~' | '≈' | '≤' | '≥' => 0.84,
            'A'..='Z' => 0.71,
            _ => 0.63,
        })
        .sum();
    ems * f64::from(size)
}
