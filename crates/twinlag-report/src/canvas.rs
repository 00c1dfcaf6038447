//! The one module that knows kuva: a sheet on which the others draw lines, areas and text in
//! pixels, `y` downwards.
//!
//! We use the scene of kuva and its writer, not its charts. Those were tried first (0.6.0): a heat
//! map has cells equally wide in value only, which is not a grid of time constants in equal ratios,
//! and shows seams between them on a logarithmic axis; tick labels mix notations (`1e-2`, `0.020`);
//! a line has no markers.

use kuva::backend::svg::SvgBackend;
use kuva::plot::ColorMap;
use kuva::render::color::Color;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};
use std::fmt::Write;

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

pub(crate) struct Canvas(Scene);

impl Canvas {
    pub(crate) fn new(width: f64, height: f64) -> Self {
        let mut scene = Scene::new(width, height);
        scene.font_family = Some(FONT.to_owned());
        scene.text_color = Some(INK.to_owned());
        Self(scene)
    }

    pub(crate) fn draw(&mut self, outline: &Outline, ink: Ink<'_>) {
        if outline.is_empty() {
            return;
        }
        let colour = |c: Option<&str>| c.map_or(Color::None, Color::from);
        self.0.add(Primitive::Path(Box::new(PathData {
            d: outline.0.clone(),
            fill: ink.fill.map(Color::from),
            stroke: colour(ink.stroke),
            stroke_width: ink.width,
            opacity: ink.fill_opacity,
            stroke_dasharray: ink.dash.map(str::to_owned),
        })));
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
        self.0.add(Primitive::Text {
            // Half pixels: shorter numbers, and steadier glyphs.
            x: (x * 2.0).round() / 2.0,
            y: (y * 2.0).round() / 2.0,
            // kuva would read `$…$` as mathematics, and lets through what XML forbids.
            content: content.replace(char::is_whitespace, " ").replace(is_unprintable, "\u{fffd}").replace('$', "\\$"),
            size: style.size,
            anchor: match style.anchor {
                Anchor::Start => TextAnchor::Start,
                Anchor::Middle => TextAnchor::Middle,
                Anchor::End => TextAnchor::End,
            },
            rotate: style.upwards.then_some(-90.0),
            bold: style.bold,
            color: None,
        });
    }

    pub(crate) fn into_svg(self) -> String {
        let (width, height) = (self.0.width, self.0.height);
        let svg = SvgBackend::new().render_scene(&self.0);
        // kuva leaves out the view box; without it a page cannot scale the picture.
        svg.replacen("<svg ", &format!("<svg viewBox=\"0 0 {width} {height}\" "), 1)
    }
}

/// What no page may hold, and marks of direction, which would turn what follows them.
pub(crate) fn is_unprintable(c: char) -> bool {
    c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{fffe}' | '\u{ffff}')
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
    let (r, g, b) = ColorMap::Viridis.map_rgb(1.0 - t).unwrap_or((255, 255, 255));
    let light = |c: u8| c + (255 - c) / 4;
    format!("#{:02x}{:02x}{:02x}", light(r), light(g), light(b))
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
