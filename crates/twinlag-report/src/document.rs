//! Documents: one self-contained HTML page. Text, tables and pictures are added as blocks, in their
//! order.

use base64ct::{Base64, Encoding};
use sha2::{Digest, Sha256};

use crate::block::{Block, KeyNumber, Plate, Tone, Writer, put};
use crate::escape::escaped;
use crate::live;
use crate::table::{Table, strings};
use crate::{Figure, ReportError};

const STYLE: &str = include_str!("page.css");

/// A page of text, tables and pictures, as one file that can be mailed, printed and kept.
///
/// The page has no other file: its style is in it, its pictures are inline SVG, and the data of each that was drawn here go with
/// it. It follows the reader's choice of light or dark, fits a phone, and prints in black on white. All text is escaped, whatever
/// it holds, and the same document gives the same bytes. It is well-formed XML as well, so that any parser can check it.
///
/// [`Document::to_html`] has no script. [`Document::to_live_html`] has one, with which traces can be enlarged; a content security
/// policy names it by its hash, so that a browser runs nothing else, whatever a file may have brought into the page.
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
        self.with(Block::Plates(vec![Plate { svg: svg.into(), caption: caption.into(), figure: None }]))
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

    /// Adds a line below the title: of which file the page is, and when it was made.
    #[must_use]
    pub fn byline(self, text: impl Into<String>) -> Self {
        self.with(Block::Byline(text.into()))
    }

    /// Adds the sentence for readers who read only one, in the colour of what it is worth.
    ///
    /// - `grade`: what it is worth, in words
    #[must_use]
    pub fn verdict(self, tone: Tone, grade: impl Into<String>, text: impl Into<String>) -> Self {
        self.with(Block::Verdict { tone, grade: grade.into(), text: text.into() })
    }

    /// Adds the few numbers that readers came for, side by side.
    #[must_use]
    pub fn key_numbers(self, numbers: impl IntoIterator<Item = KeyNumber>) -> Self {
        self.with(Block::Keys(numbers.into_iter().collect()))
    }

    /// Draws a figure, and adds it with its caption and its data; those of [`Figure::live`] may be enlarged where the page has a
    /// script.
    ///
    /// # Errors
    /// Those of [`Figure::to_svg`].
    pub fn drawing(self, figure: Figure, caption: impl Into<String>) -> Result<Self, ReportError> {
        self.side_by_side([(figure, caption.into())])
    }

    /// Draws figures that are to be compared: side by side, or below each other on a narrow screen.
    ///
    /// ```
    /// use twinlag_report::{Axis, Chart, Document, Figure, Series};
    ///
    /// let of = |y| Chart::new("", Axis::linear("x"), Axis::linear("y")).series(Series::trace("", [0.0, 1.0], [0.0, y]));
    /// let [one, two] = [1.0, 2.0].map(|y| (Figure::new("").panel(of(y)), format!("To {y}.")));
    /// let page = Document::new("Run 7").side_by_side([one, two])?.to_html();
    /// assert!(page.contains("Figure 2.") && page.contains("figure-2.csv") && !page.contains("<script"));
    /// # Ok::<(), twinlag_report::ReportError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Figure::to_svg`].
    pub fn side_by_side<C: Into<String>>(
        self,
        figures: impl IntoIterator<Item = (Figure, C)>,
    ) -> Result<Self, ReportError> {
        let plate = |(figure, caption): (Figure, C)| {
            Ok(Plate { svg: figure.to_svg()?, caption: caption.into(), figure: Some(figure) })
        };
        let plates: Vec<Plate> = figures.into_iter().map(plate).collect::<Result<_, ReportError>>()?;
        Ok(self.with(Block::Plates(plates)))
    }

    /// Adds all blocks of another document, folded up under its title: what few readers need.
    #[must_use]
    pub fn folded(self, other: Self) -> Self {
        self.with(Block::Folded { summary: other.title, blocks: other.blocks })
    }

    /// Whether there is nothing but the title.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// The page without a script, for print and mail.
    pub fn to_html(&self) -> String {
        self.page(false)
    }

    /// The page with a script, with which traces can be enlarged. Without scripts it is that of [`Document::to_html`].
    pub fn to_live_html(&self) -> String {
        self.page(true)
    }

    fn page(&self, is_live: bool) -> String {
        let mut writer = Writer::new(is_live);
        self.blocks.iter().for_each(|block| writer.block(block));
        let (body, live) = writer.into_parts();
        let title = escaped(&self.title);
        let script = live.as_ref().map(|_| live::script());
        let style = if script.is_some() { format!("\n{STYLE}{}\n", live::UPLOT_STYLE) } else { format!("\n{STYLE}") };
        let mut policy =
            format!("default-src 'none'; base-uri 'none'; form-action 'none'; style-src '{}'", policy_hash(&style));
        if let Some(script) = &script {
            put(&mut policy, format_args!("; script-src '{}'", policy_hash(script)));
        }
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en-GB\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta \
             http-equiv=\"Content-Security-Policy\" content=\"{policy}\"/>\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n<style>{style}</style>\n</head>\n\
             <body>\n<main>\n<h1>{title}</h1>\n{body}</main>\n"
        );
        if let (Some(live), Some(script)) = (live, script) {
            put(
                &mut out,
                format_args!("<script type=\"application/json\" id=\"live-data\">{}</script>\n", live.to_json()),
            );
            put(&mut out, format_args!("<script>{script}</script>\n"));
        }
        out.push_str("</body>\n</html>\n");
        out
    }
}

/// What a content security policy says of a script or a style with this text, `sha256-` and its hash in base 64.
///
/// Source: W3C, Content Security Policy Level 3, section 2.3.1.
pub fn policy_hash(text: &str) -> String {
    format!("sha256-{}", Base64::encode_string(&Sha256::digest(text)))
}

#[cfg(test)]
mod tests {
    use crate::inline::{inlined, tag_end};
    use crate::{Axis, Chart, Figure, Series};
    use crate::{Document, KeyNumber, Table, Tone, policy_hash};

    const NASTY: &str = "T<1> & \"co's\" <script>alert(1)</script>\u{0}\u{202e}\r\n";

    fn figure(name: &str) -> String {
        drawn(name).to_svg().expect("drawable")
    }

    fn drawn(name: &str) -> Figure {
        let chart = Chart::new(name, Axis::linear("x"), Axis::logarithmic("y"))
            .series(Series::line("a", [0.0, 1.0], [1.0, 2.0]).band([0.5, 1.0], [2.0, 3.0]))
            .series(Series::trace(name, [0.0, 1.0], [1.0, 200.0]));
        Figure::new(name).panel(chart)
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
            .byline(text)
            .verdict(Tone::Caution, text, text)
            .key_numbers([KeyNumber {
                name: text.into(),
                value: text.into(),
                interval: text.into(),
                grade: (Tone::Bad, text.into()),
            }])
            .drawing(drawn(text).live(), text)
            .expect("drawable")
            .command(text)
            .folded(Document::new(text).note(text))
            .warning(text)
    }

    /// Names of the tags, checked to be closed, the last opened first.
    fn tags(page: &str) -> Vec<String> {
        let (mut open, mut seen): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
        let mut rest = page;
        while let Some(start) = rest.find('<') {
            assert!(!rest[..start].contains('>'), "a bare > in {:?}", &rest[..start]);
            let tag = &rest[start..start + tag_end(&rest[start..])];
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
            if let Some(kind) = ["<style", "<script"].into_iter().find(|kind| tag.starts_with(*kind)) {
                let end = rest.find(&kind.replace('<', "</")).expect("closed");
                assert!(kind == "<script" || !rest[..end].contains('<'));
                rest = &rest[end..];
            }
        }
        assert!(open.is_empty(), "left open: {open:?}");
        seen
    }

    #[test]
    fn whatever_the_text_the_page_has_the_same_tags() {
        let page = full(NASTY).to_live_html();
        // Inside a picture, the legend goes where its text has room.
        let around = |page: &str| -> Vec<String> {
            tags(page).into_iter().filter(|name| !["path", "text"].contains(&name.as_str())).collect()
        };
        assert_eq!(around(&page), around(&full("plain").to_live_html()));
        assert!(page.contains("T&lt;1&gt; &amp; &quot;co&#39;s&quot; &lt;script&gt;"));
        assert!(!page.contains(['\0', '\r', '\u{202e}']));
    }

    /// The page must be readable without a network, in twenty years.
    #[test]
    fn a_page_refers_to_nothing_outside_itself() {
        for text in [NASTY, "plain"] {
            let page = full(text).to_html();
            for outside in ["http:", "https:", "<script", "src=", "@import", "<link", "<iframe", "url("] {
                assert!(!page.contains(outside), "{outside}");
            }
            assert_eq!(page.matches("href=").count(), page.matches("href=\"data:text/csv").count());
        }
    }

    /// A browser runs the one script that the policy names, and none that a file brought along.
    #[test]
    fn a_live_page_has_the_scripts_of_its_policy_alone() {
        let page = full(NASTY).to_live_html();
        let scripts: Vec<&str> =
            page.split("<script").skip(1).map(|s| s.split("</script>").next().unwrap_or("")).collect();
        let [data, code] = scripts[..] else { panic!("{} scripts", scripts.len()) };
        let data = data.split_once('>').expect("a tag ends").1;
        assert!(!data.contains(['<', '&']) && serde_json::from_str::<serde_json::Value>(data).is_ok(), "{data}");
        let code = code.split_once('>').expect("a tag ends").1;
        assert!(page.contains(&format!("script-src '{}'\"", policy_hash(code))) && !code.contains("]]>*/ "));
        let style = page.split_once("<style>").expect("a style").1.split_once("</style>").expect("closed").0;
        assert!(page.contains(&format!("style-src '{}'", policy_hash(style))));
        assert!(!page.contains(" style=") && !page.contains(" onload="));
        // Of a page without traces nothing can be enlarged.
        assert!(!Document::new("").paragraph("text").to_live_html().contains("<script"));
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
        assert_eq!((count, ids.len()), (8, 8), "two clip paths, three captions and plates: {ids:?}");
        assert_eq!(inlined("no picture", 1), "");
    }
}
