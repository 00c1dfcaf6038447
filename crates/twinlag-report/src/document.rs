//! Documents: one self-contained HTML page. Text, tables and pictures are added as blocks, in their
//! order.

use std::fmt::Write;

use crate::escape::escaped;

/// A page of text, tables and pictures, as one file that can be mailed, printed and kept.
///
/// The page has no script, no link and no other file: its style is in it, its pictures are inline
/// SVG. It follows the reader's choice of light or dark, fits a phone, and prints in black on
/// white. All text is escaped, whatever it holds, and the same document gives the same bytes. It is
/// well-formed XML as well, so that any parser can check it.
///
/// ```
/// use twinlag_report::{Axis, Chart, Document, Figure, Series, Table};
///
/// let chart = Chart::new("", Axis::linear("time (s)"), Axis::linear("reading (°C)"))
///     .series(Series::trace("", [0.0, 1.0, 2.0], [20.0, 21.0, 20.5]));
/// let page = Document::new("Run 7")
///     .lead("Both sensors work.")
///     .heading("Readings")
///     .figure(Figure::new("").panel(chart).to_svg()?, "The first three samples.")
///     .table(Table::new(["sensor", "noise (K)"]).row(["T<1>", "0.10"]).row(["T2", "0.12"]))
///     .to_html();
/// assert!(page.starts_with("<!DOCTYPE html>") && page.contains("T&lt;1&gt;"));
/// # Ok::<(), twinlag_report::ReportError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    title: String,
    blocks: Vec<Block>,
}

#[derive(Clone, Debug, PartialEq)]
enum Block {
    Heading(String),
    Subheading(String),
    Lead(String),
    Paragraph(String),
    List(Vec<String>),
    Facts(Vec<(String, String)>),
    Table(Table),
    Figure { svg: String, caption: String },
    Command(String),
    Note(String),
    Warning(String),
}

/// A table with a row of headers. Its first column names the rows.
///
/// ```
/// use twinlag_report::{Document, Table};
///
/// let table = Table::new(["sensor", "τ (ms)"]).row(["bare", "23.8"]).caption("Time constants");
/// assert!(!table.is_empty());
/// let page = Document::new("Run 7").table(table).to_html();
/// assert!(page.contains("<tr><th scope=\"row\">bare</th><td>23.8</td></tr>"));
/// assert!(page.contains("<caption>Time constants</caption>"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
    caption: String,
}

fn strings<S: Into<String>>(items: impl IntoIterator<Item = S>) -> Vec<String> {
    items.into_iter().map(Into::into).collect()
}

impl Table {
    /// A table without rows.
    pub fn new<S: Into<String>>(header: impl IntoIterator<Item = S>) -> Self {
        Self { header: strings(header), rows: Vec::new(), caption: String::new() }
    }

    /// Adds a row. A short row ends in empty cells; a long one widens the table.
    #[must_use]
    pub fn row<S: Into<String>>(mut self, cells: impl IntoIterator<Item = S>) -> Self {
        self.rows.push(strings(cells));
        self
    }

    /// Adds a line of text above the table.
    #[must_use]
    pub fn caption(self, caption: impl Into<String>) -> Self {
        Self { caption: caption.into(), ..self }
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    fn write(&self, out: &mut String) {
        let columns = self.rows.iter().map(Vec::len).chain([self.header.len()]).max().unwrap_or(0);
        if columns == 0 {
            return;
        }
        let cell = |cells: &[String], k: usize| cells.get(k).map_or(String::new(), |text| escaped(text));
        out.push_str("<div class=\"wide\"><table>\n");
        if !self.caption.is_empty() {
            element(out, "caption", &self.caption);
        }
        out.push_str("<thead><tr>");
        for k in 0..columns {
            put(out, format_args!("<th scope=\"col\">{}</th>", cell(&self.header, k)));
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            put(out, format_args!("<tr><th scope=\"row\">{}</th>", cell(row, 0)));
            for k in 1..columns {
                put(out, format_args!("<td>{}</td>", cell(row, k)));
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</tbody></table></div>\n");
    }
}

impl Document {
    /// A document with a title and nothing else.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), blocks: Vec::new() }
    }

    fn with(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }

    /// Adds the heading of a section.
    #[must_use]
    pub fn heading(self, text: impl Into<String>) -> Self {
        self.with(Block::Heading(text.into()))
    }

    /// Adds a heading within a section.
    #[must_use]
    pub fn subheading(self, text: impl Into<String>) -> Self {
        self.with(Block::Subheading(text.into()))
    }

    /// Adds a paragraph that stands out, for readers who read only one sentence.
    #[must_use]
    pub fn lead(self, text: impl Into<String>) -> Self {
        self.with(Block::Lead(text.into()))
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn paragraph(self, text: impl Into<String>) -> Self {
        self.with(Block::Paragraph(text.into()))
    }

    /// Adds a list of points; an empty one takes no room.
    #[must_use]
    pub fn list<S: Into<String>>(self, items: impl IntoIterator<Item = S>) -> Self {
        self.with(Block::List(strings(items)))
    }

    /// Adds a table of names and their meanings; an empty one takes no room.
    #[must_use]
    pub fn facts<K: Into<String>, V: Into<String>>(self, facts: impl IntoIterator<Item = (K, V)>) -> Self {
        self.with(Block::Facts(facts.into_iter().map(|(k, v)| (k.into(), v.into())).collect()))
    }

    /// Adds a table.
    #[must_use]
    pub fn table(self, table: Table) -> Self {
        self.with(Block::Table(table))
    }

    /// Adds a picture with its caption; pictures are numbered.
    ///
    /// - `svg`: what [`Figure::to_svg`](crate::Figure::to_svg) gives, or any SVG of one's own
    ///   making. It is the one thing that goes in as markup: whoever takes it from a stranger takes
    ///   what is in it. Its `id`s are made its own, so that two pictures with the same ones do not
    ///   disturb each other (references from within a `<style>` excepted).
    #[must_use]
    pub fn figure(self, svg: impl Into<String>, caption: impl Into<String>) -> Self {
        self.with(Block::Figure { svg: svg.into(), caption: caption.into() })
    }

    /// Adds text as it was typed: a command, a piece of a file.
    #[must_use]
    pub fn command(self, text: impl Into<String>) -> Self {
        self.with(Block::Command(text.into()))
    }

    /// Adds a remark.
    #[must_use]
    pub fn note(self, text: impl Into<String>) -> Self {
        self.with(Block::Note(text.into()))
    }

    /// Adds a remark that must not be missed.
    #[must_use]
    pub fn warning(self, text: impl Into<String>) -> Self {
        self.with(Block::Warning(text.into()))
    }

    /// The page.
    pub fn to_html(&self) -> String {
        let title = escaped(&self.title);
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en-GB\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n<style>\n{STYLE}</style>\n\
             </head>\n<body>\n<main>\n<h1>{title}</h1>\n"
        );
        let mut figures = 0;
        for block in &self.blocks {
            if let Block::Figure { .. } = block {
                figures += 1;
            }
            block.write(&mut out, figures);
        }
        out.push_str("</main>\n</body>\n</html>\n");
        out
    }
}

impl Block {
    /// - `figure`: number of the figure, if it is one
    fn write(&self, out: &mut String, figure: usize) {
        match self {
            Self::Heading(text) => element(out, "h2", text),
            Self::Subheading(text) => element(out, "h3", text),
            Self::Paragraph(text) => element(out, "p", text),
            Self::Lead(text) => put(out, format_args!("<p class=\"lead\">{}</p>\n", escaped(text))),
            Self::Command(text) => put(out, format_args!("<pre><code>{}</code></pre>\n", escaped(text))),
            Self::Note(text) => aside(out, "note", "Note.", text),
            Self::Warning(text) => aside(out, "warning", "Warning.", text),
            Self::List(items) if !items.is_empty() => {
                out.push_str("<ul>\n");
                items.iter().for_each(|item| element(out, "li", item));
                out.push_str("</ul>\n");
            }
            Self::Facts(facts) if !facts.is_empty() => {
                out.push_str("<div class=\"wide\"><table class=\"facts\"><tbody>\n");
                for (key, value) in facts {
                    let (key, value) = (escaped(key), escaped(value));
                    put(out, format_args!("<tr><th scope=\"row\">{key}</th><td>{value}</td></tr>\n"));
                }
                out.push_str("</tbody></table></div>\n");
            }
            Self::List(_) | Self::Facts(_) => {}
            Self::Table(table) => table.write(out),
            Self::Figure { svg, caption } => {
                let (picture, caption) = (inlined(svg, figure), escaped(caption));
                put(
                    out,
                    format_args!(
                        "<figure>\n<div class=\"plate\">{picture}</div>\n<figcaption id=\"figure-{figure}\">\
                         <strong>Figure {figure}.</strong> {caption}</figcaption>\n</figure>\n"
                    ),
                );
            }
        }
    }
}

fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    // A String takes whatever is written to it.
    let _ = out.write_fmt(text);
}

fn element(out: &mut String, name: &str, text: &str) {
    put(out, format_args!("<{name}>{}</{name}>\n", escaped(text)));
}

fn aside(out: &mut String, class: &str, label: &str, text: &str) {
    put(out, format_args!("<p class=\"{class}\" role=\"note\"><strong>{label}</strong> {}</p>\n", escaped(text)));
}

/// A picture as a part of the page: what comes before `<svg` left out, `id`s and references to them
/// its own, named by its caption. The name space is left out as well: within a page it is known.
fn inlined(svg: &str, figure: usize) -> String {
    let Some(start) = svg.find("<svg") else { return String::new() };
    let mut out = String::with_capacity(svg.len() + 200);
    let mut rest = svg[start..].trim_end();
    // Tag by tag, so that text that looks like an attribute stays as it is.
    while let Some(open) = rest.find('<') {
        let (text, tag) = rest.split_at(open);
        out.push_str(text);
        let end = tag_end(tag);
        let mut owned = tag[..end].to_owned();
        for (name_space, without) in
            [(" xmlns=\"http://www.w3.org/2000/svg\"", ""), (" xmlns:xlink=\"http://www.w3.org/1999/xlink\"", "")]
        {
            owned = owned.replace(name_space, without);
        }
        for reference in [" id=\"", " id='", "url(#", "url('#", "url(\"#", "href=\"#", "href='#"] {
            owned = owned.replace(reference, &format!("{reference}f{figure}-"));
        }
        out.push_str(&owned);
        rest = &tag[end..];
    }
    out.push_str(rest);
    out.replacen("<svg", &format!("<svg role=\"img\" aria-labelledby=\"figure-{figure}\""), 1)
}

/// Where a tag or a comment ends; a `>` between quotes does not end it.
fn tag_end(tag: &str) -> usize {
    if tag.starts_with("<!--") {
        return tag.find("-->").map_or(tag.len(), |k| k + 3);
    }
    let mut quote = None;
    for (k, c) in tag.char_indices() {
        match (quote, c) {
            (None, '>') => return k + 1,
            (None, '"' | '\'') => quote = Some(c),
            (Some(q), _) if q == c => quote = None,
            _ => {}
        }
    }
    tag.len()
}

const STYLE: &str = "\
:root { color-scheme: light dark; --ink: #1d1d1b; --paper: #ffffff; --pale: #f4f4f1; --rule: #d4d4ce; --quiet: #5c5c57;
  --accent: #0072b2; --alarm: #c24a00; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e7e7e3; --paper: #17181a; --pale: #222427; --rule: #45484c; --quiet: #a9aaa6; --accent: #56b4e9;
    --alarm: #e69f00; }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }
body { margin: 0; background: var(--paper); color: var(--ink); overflow-wrap: break-word;
  font: 1rem/1.55 system-ui, -apple-system, Segoe UI, Noto Sans, DejaVu Sans, Arial, sans-serif; }
main { max-width: 60rem; margin: 0 auto; padding: 1rem 1.2rem 4rem; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 1rem 0; overflow-wrap: anywhere; }
h2 { font-size: 1.25rem; line-height: 1.3; margin: 2.4rem 0 0.7rem; padding-top: 0.7rem; border-top: 1px solid var(--rule); }
h3 { font-size: 1.05rem; line-height: 1.3; margin: 1.5rem 0 0.4rem; }
p, ul, pre { margin: 0.7rem 0; }
p, li, figcaption { max-width: 48rem; }
li { margin: 0.25rem 0; }
.lead { font-size: 1.15rem; line-height: 1.45; padding: 0.7rem 1rem; background: var(--pale);
  border-left: 4px solid var(--accent); max-width: none; }
.note, .warning { padding: 0.45rem 0.9rem; border-left: 4px solid var(--rule); background: var(--pale); max-width: none; }
.warning { border-left-color: var(--alarm); }
.warning strong { color: var(--alarm); }
.wide { overflow-x: auto; margin: 0.9rem 0; }
table { border-collapse: collapse; font-size: 0.92rem; line-height: 1.4; font-variant-numeric: tabular-nums; }
caption { text-align: left; color: var(--quiet); padding: 0 0 0.3rem; }
th, td { text-align: left; vertical-align: top; padding: 0.3rem 0.9rem 0.3rem 0; border-bottom: 1px solid var(--rule); }
thead th { border-bottom: 2px solid var(--rule); vertical-align: bottom; }
th[scope=row] { font-weight: 500; }
.facts th { color: var(--quiet); font-weight: 400; min-width: 8rem; }
figure { margin: 1.2rem 0; }
.plate { background: #ffffff; border: 1px solid var(--rule); border-radius: 4px; padding: 0.4rem; overflow-x: auto; }
.plate svg { display: block; margin: 0 auto; min-width: 36rem; max-width: 100%; height: auto; }
figcaption { font-size: 0.92rem; color: var(--quiet); margin-top: 0.4rem; }
pre { background: var(--pale); border: 1px solid var(--rule); border-radius: 4px; padding: 0.7rem 0.9rem; overflow-x: auto;
  font: 0.88rem/1.45 ui-monospace, DejaVu Sans Mono, Menlo, Consolas, monospace; white-space: pre-wrap;
  overflow-wrap: anywhere; }
@media print {
  :root { color-scheme: light; --ink: #000000; --paper: #ffffff; --pale: #f4f4f1; --rule: #bbbbb5; --quiet: #444440;
    --accent: #0072b2; --alarm: #a03c00; }
  body { font-size: 10pt; }
  main { max-width: none; padding: 0; }
  .wide, .plate { overflow: visible; }
  .plate { border: none; padding: 0; }
  .plate svg { min-width: 0; }
  h2, h3 { break-after: avoid; }
  figure, tr, .lead, .note, .warning { break-inside: avoid; }
}
";

#[cfg(test)]
mod tests {
    use super::{Document, Table, inlined};
    use crate::{Axis, Chart, Figure, Series};

    const NASTY: &str = "T<1> & \"co's\" <script>alert(1)</script>\u{0}\u{202e}\r\n";

    fn figure(name: &str) -> String {
        let chart = Chart::new(name, Axis::linear("x"), Axis::logarithmic("y"))
            .series(Series::line("a", [0.0, 1.0], [1.0, 2.0]).band([0.5, 1.0], [2.0, 3.0]))
            .series(Series::trace(name, [0.0, 1.0], [1.0, 200.0]));
        Figure::new(name).panel(chart).to_svg().expect("drawable")
    }

    /// One of each block, with the same text everywhere.
    fn full(text: &str) -> Document {
        Document::new(text)
            .lead(text)
            .heading(text)
            .paragraph(text)
            .facts([(text, text)])
            .facts::<&str, &str>([])
            .subheading(text)
            .list([text, text])
            .list::<&str>([])
            .table(Table::new([text, "b"]).row([text]).row(["1", "2", text]).caption(text))
            .figure(figure(text), text)
            .figure(figure("plain"), text)
            .command(text)
            .note(text)
            .warning(text)
    }

    /// Names of the tags, checked to be closed, the last opened first.
    fn tags(page: &str) -> Vec<String> {
        let (mut open, mut seen): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
        let mut rest = page;
        while let Some(start) = rest.find('<') {
            assert!(!rest[..start].contains('>'), "a bare > in {:?}", &rest[..start]);
            let tag = &rest[start..start + super::tag_end(&rest[start..])];
            rest = &rest[start + tag.len()..];
            if tag.starts_with("<!") {
                continue;
            }
            let inner = tag.trim_start_matches('<').trim_end_matches('>');
            if let Some(name) = inner.strip_prefix('/') {
                assert_eq!(open.pop().as_deref(), Some(name), "closed in another order than opened");
            } else {
                let name = inner.split([' ', '/']).next().unwrap_or_default().to_owned();
                if !inner.ends_with('/') {
                    open.push(name.clone());
                }
                seen.push(name);
            }
            if tag.starts_with("<style") {
                let end = rest.find("</style").expect("closed");
                assert!(!rest[..end].contains('<'));
                rest = &rest[end..];
            }
        }
        assert!(open.is_empty(), "left open: {open:?}");
        seen
    }

    #[test]
    fn whatever_the_text_the_page_has_the_same_tags() {
        let page = full(NASTY).to_html();
        // Inside a picture, the legend goes where its text has room.
        let around = |page: &str| -> Vec<String> {
            tags(page).into_iter().filter(|name| !["path", "text"].contains(&name.as_str())).collect()
        };
        assert_eq!(around(&page), around(&full("plain").to_html()));
        assert!(page.contains("T&lt;1&gt; &amp; &quot;co&#39;s&quot; &lt;script&gt;"));
        assert!(!page.contains(['\0', '\r', '\u{202e}']));
    }

    /// The page must be readable without a network, in twenty years.
    #[test]
    fn a_page_refers_to_nothing_outside_itself() {
        for text in [NASTY, "plain"] {
            let page = full(text).to_html();
            for outside in ["http:", "https:", "<script", "src=", "@import", "<link", "<iframe", "url(", "href="] {
                assert!(!page.contains(outside), "{outside}");
            }
        }
    }

    #[test]
    fn the_same_document_gives_the_same_bytes() {
        assert_eq!(full(NASTY).to_html(), full(NASTY).to_html());
    }

    /// What is drawn here has no `id`; clip paths and gradients of others' SVG have them.
    #[test]
    fn ids_of_two_pictures_do_not_meet() {
        let svg = "<?xml version=\"1.0\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\"><defs>\
                   <clipPath id=\"c\"><path d=\"M0 0\"/></clipPath></defs><g clip-path=\"url(#c)\" data-x=\"a>b\"/>\
                   <use href=\"#c\"/><text>id=\"c\" url(#c)</text></svg>\n";
        assert_eq!(
            inlined(svg, 2),
            "<svg role=\"img\" aria-labelledby=\"figure-2\" viewBox=\"0 0 9 9\"><defs><clipPath id=\"f2-c\">\
             <path d=\"M0 0\"/></clipPath></defs><g clip-path=\"url(#f2-c)\" data-x=\"a>b\"/><use href=\"#f2-c\"/>\
             <text>id=\"c\" url(#c)</text></svg>"
        );
        let page = Document::new("").figure(svg, "a").figure(svg, "b").figure(figure("c"), "c").to_html();
        let mut ids: Vec<&str> =
            page.split('<').filter_map(|tag| tag.split(" id=\"").nth(1)?.split('"').next()).collect();
        let count = ids.len();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!((count, ids.len()), (5, 5), "two clip paths, three captions: {ids:?}");
        assert_eq!(inlined("no picture", 1), "");
    }
}
