//! Blocks of a page, and how each is written.

use std::fmt::{Arguments, Write};

use crate::escape::escaped;
use crate::inline::inlined;
use crate::live::Live;
use crate::table::Table;
use crate::{Figure, Panel};

/// A figure that is narrower than this, px, fits a phone as it is.
const SMALL_PX: f64 = 650.0;

/// What a reader may do with what is said: a colour, beside words that say it as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Tone {
    /// It may be used.
    Good,
    /// It may be used on a condition.
    Caution,
    /// It may not be used.
    Bad,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Caution => "caution",
            Self::Bad => "bad",
        }
    }
}

/// One of the few numbers that a reader came for.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyNumber {
    /// What it is.
    pub name: String,
    /// The number with its unit, or that it is not given.
    pub value: String,
    /// Its interval.
    pub interval: String,
    /// Whether it may be used, and the colour of that.
    pub grade: (Tone, String),
}

/// A picture with its caption, and what goes with it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plate {
    pub(crate) svg: String,
    pub(crate) caption: String,
    /// The figure that it is of, if it was drawn here.
    pub(crate) figure: Option<Figure>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Block {
    Heading(String),
    Subheading(String),
    Byline(String),
    Lead(String),
    Verdict { tone: Tone, grade: String, text: String },
    Keys(Vec<KeyNumber>),
    Paragraph(String),
    List(Vec<String>),
    Facts(Vec<(String, String)>),
    Table(Table),
    Plates(Vec<Plate>),
    Command(String),
    Note(String),
    Warning(String),
    Folded { summary: String, blocks: Vec<Block> },
}

/// A page as far as it is written.
#[derive(Debug, Default)]
pub(crate) struct Writer {
    out: String,
    figures: usize,
    /// The traces that may be enlarged, on a page with a script.
    live: Option<Live>,
}

impl Writer {
    /// An empty page.
    pub(crate) fn new(is_live: bool) -> Self {
        Self { live: is_live.then(Live::default), ..Self::default() }
    }

    pub(crate) fn block(&mut self, block: &Block) {
        let out = &mut self.out;
        match block {
            Block::Heading(text) => element(out, "h2", text),
            Block::Subheading(text) => element(out, "h3", text),
            Block::Paragraph(text) => element(out, "p", text),
            Block::Byline(text) => put(out, format_args!("<p class=\"by\">{}</p>\n", escaped(text))),
            Block::Lead(text) => put(out, format_args!("<p class=\"lead\">{}</p>\n", escaped(text))),
            Block::Verdict { tone, grade, text } => {
                let (class, grade, text) = (tone.class(), escaped(grade), escaped(text));
                put(out, format_args!("<p class=\"lead {class}\"><span class=\"tone\">{grade}</span> {text}</p>\n"));
            }
            Block::Keys(numbers) => keys(out, numbers),
            Block::Command(text) => put(out, format_args!("<pre><code>{}</code></pre>\n", escaped(text))),
            Block::Note(text) => aside(out, "note", "Note.", text),
            Block::Warning(text) => aside(out, "warning", "Warning.", text),
            Block::List(items) if !items.is_empty() => {
                out.push_str("<ul>\n");
                items.iter().for_each(|item| element(out, "li", item));
                out.push_str("</ul>\n");
            }
            Block::Facts(facts) if !facts.is_empty() => {
                wide(out, "Facts");
                out.push_str("<table class=\"facts\"><tbody>\n");
                for (key, value) in facts {
                    let (key, value) = (escaped(key), escaped(value));
                    put(out, format_args!("<tr><th scope=\"row\">{key}</th><td>{value}</td></tr>\n"));
                }
                out.push_str("</tbody></table></div>\n");
            }
            Block::List(_) | Block::Facts(_) => {}
            Block::Table(table) => table.write(out),
            Block::Plates(plates) => self.plates(plates),
            Block::Folded { summary, blocks } => {
                put(out, format_args!("<details>\n<summary>{}</summary>\n", escaped(summary)));
                blocks.iter().for_each(|block| self.block(block));
                self.out.push_str("</details>\n");
            }
        }
    }

    /// What was written, and the traces that may be enlarged, if there are any.
    pub(crate) fn into_parts(self) -> (String, Option<Live>) {
        (self.out, self.live.filter(|live| !live.is_empty()))
    }

    fn plates(&mut self, plates: &[Plate]) {
        let are_several = plates.len() > 1;
        if are_several {
            self.out.push_str("<div class=\"pair\">\n");
        }
        plates.iter().for_each(|plate| self.plate(plate));
        if are_several {
            self.out.push_str("</div>\n");
        }
    }

    fn plate(&mut self, Plate { svg, caption, figure }: &Plate) {
        self.figures += 1;
        let number = self.figures;
        let is_shaded = figure.as_ref().is_some_and(|f| f.panels().iter().any(|p| matches!(p, Panel::Surface(_))));
        let is_small = figure.as_ref().is_some_and(|f| f.width_px() < SMALL_PX);
        let classes = [(is_shaded, "is-shaded"), (is_small, "is-small")];
        let classes: Vec<&str> = classes.into_iter().filter_map(|(is, class)| is.then_some(class)).collect();
        let (picture, caption) = (inlined(svg, number), escaped(caption));
        let picture = match classes.join(" ") {
            classes if classes.is_empty() => picture,
            classes => picture.replacen("<svg", &format!("<svg class=\"{classes}\""), 1),
        };
        put(
            &mut self.out,
            format_args!(
                "<figure>\n<div class=\"plate\" id=\"plate-{number}\" tabindex=\"0\" role=\"region\" aria-label=\"Figure \
                 {number}\">{picture}</div>\n<figcaption id=\"figure-{number}\"><strong>Figure {number}.</strong> \
                 {caption}</figcaption>\n"
            ),
        );
        if let Some(figure) = figure {
            let data = percent_encoded(&figure.to_csv());
            put(
                &mut self.out,
                format_args!(
                    "<p class=\"data by\"><a download=\"figure-{number}.csv\" \
                     href=\"data:text/csv;charset=utf-8,{data}\">Data of figure {number} (CSV)</a></p>\n"
                ),
            );
            if let Some(live) = &mut self.live {
                live.add(number, &figure.live_charts(), &figure.styles());
            }
        }
        self.out.push_str("</figure>\n");
    }
}

fn keys(out: &mut String, numbers: &[KeyNumber]) {
    out.push_str("<dl class=\"keys\">\n");
    for KeyNumber { name, value, interval, grade: (tone, grade) } in numbers {
        let class = tone.class();
        let [name, value, interval, grade] = [name, value, interval, grade].map(|text| escaped(text));
        put(out, format_args!("<div class=\"{class}\"><dt>{name}</dt><dd class=\"value\">{value}</dd>"));
        if !interval.is_empty() {
            put(out, format_args!("<dd>{interval}</dd>"));
        }
        match grade.split_once(": ") {
            Some((grade, because)) => {
                put(out, format_args!("<dd class=\"tone\"><strong>{grade}:</strong> {because}</dd></div>\n"));
            }
            None => put(out, format_args!("<dd class=\"tone\"><strong>{grade}</strong></dd></div>\n")),
        }
    }
    out.push_str("</dl>\n");
}

/// Text as it may stand in an address.
fn percent_encoded(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + text.len() / 8);
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b",.-_".contains(&byte) {
            out.push(char::from(byte));
        } else {
            put(&mut out, format_args!("%{byte:02X}"));
        }
    }
    out
}

pub(crate) fn put(out: &mut String, text: Arguments<'_>) {
    // A String takes whatever is written to it.
    let _ = out.write_fmt(text);
}

pub(crate) fn element(out: &mut String, name: &str, text: &str) {
    put(out, format_args!("<{name}>{}</{name}>\n", escaped(text)));
}

/// The beginning of what may be wider than a phone: it can be moved with the keyboard as well.
pub(crate) fn wide(out: &mut String, label: &str) {
    put(out, format_args!("<div class=\"wide\" tabindex=\"0\" role=\"group\" aria-label=\"{}\">", escaped(label)));
}

fn aside(out: &mut String, class: &str, label: &str, text: &str) {
    put(out, format_args!("<p class=\"{class}\" role=\"note\"><strong>{label}</strong> {}</p>\n", escaped(text)));
}
