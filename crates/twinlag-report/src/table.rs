//! Tables of a page.

use crate::block::{element, put, wide};
use crate::escape::escaped;

/// A table of more columns keeps some width on a phone, and is moved sideways.
const MANY: usize = 4;

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

pub(crate) fn strings<S: Into<String>>(items: impl IntoIterator<Item = S>) -> Vec<String> {
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

    pub(crate) fn write(&self, out: &mut String) {
        let columns = self.rows.iter().map(Vec::len).chain([self.header.len()]).max().unwrap_or(0);
        if columns == 0 {
            return;
        }
        let cell = |cells: &[String], k: usize| cells.get(k).map_or(String::new(), |text| escaped(text));
        wide(out, if self.caption.is_empty() { "Table" } else { &self.caption });
        out.push_str(if columns > MANY { "<table class=\"many\">\n" } else { "<table>\n" });
        if !self.caption.is_empty() {
            element(out, "caption", &self.caption);
        }
        out.push_str("<thead><tr>");
        for k in 0..columns {
            match cell(&self.header, k) {
                // A header without a name is none.
                name if name.is_empty() => out.push_str("<td></td>"),
                name => put(out, format_args!("<th scope=\"col\">{name}</th>")),
            }
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
