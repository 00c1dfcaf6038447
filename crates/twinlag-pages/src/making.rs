//! How a page was made: what stands below its title and at its end.

use std::path::Path;

use twinlag_report::{Document, Table};

use crate::words::listed;

/// What a page says of its own making. Without it, equal answers give equal pages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Making {
    /// The command that makes the page again.
    pub command: String,
    /// When the page was made, for a reader: the date, and the time of day with its zone.
    pub made_at: String,
    /// The names of the files with the SHA-256 of each, in hexadecimal digits.
    pub files: Vec<(String, String)>,
    /// Whether the page is for print and mail: without a script, so that traces cannot be enlarged.
    pub is_static: bool,
    /// Whether the page ends after its first screen: the verdict, the numbers that readers come for and the picture that shows why.
    pub is_first_screen: bool,
}

impl Making {
    /// The page itself.
    pub(crate) fn page(&self, document: &Document) -> String {
        if self.is_static { document.to_html() } else { document.to_live_html() }
    }

    /// What the page is of, in one line.
    ///
    /// - `facts`: what is known of the record
    pub(crate) fn byline(&self, facts: &[String]) -> String {
        let made_at = Some(&self.made_at).filter(|at| !at.is_empty()).map(|at| format!("made {at}"));
        facts.iter().cloned().chain(made_at).collect::<Vec<_>>().join(" · ")
    }

    /// The files and the command.
    pub(crate) fn reproduction(&self, document: Document, program: &str, version: &str) -> Document {
        let mut document = document.heading("How to reproduce this");
        if !self.command.is_empty() {
            document = document.command(self.command.clone());
        }
        let made_at = if self.made_at.is_empty() { String::new() } else { format!(", {}", self.made_at) };
        document = document.paragraph(format!("Made by {program} {version}{made_at}."));
        if self.files.is_empty() {
            return document;
        }
        let table = Table::new(["file", "SHA-256"]);
        document.table(self.files.iter().fold(table, |table, (name, hash)| table.row([file_name(name), hash])))
    }
}

/// How the file was read: what few readers need, folded up at the end of a page.
pub(crate) fn notes(document: Document, notes: &[String]) -> Document {
    if notes.is_empty() {
        return document;
    }
    let count = if notes.len() == 1 { "1 note".to_owned() } else { format!("{} notes", notes.len()) };
    let inner = Document::new(format!("How the file was read ({count})"));
    document.folded(notes.iter().fold(inner, |inner, note| inner.note(note.clone())))
}

/// The name of a file without the folders that it lies in, which are the user's own business; of several, joined by commas, each.
pub(crate) fn file_name(source: &str) -> &str {
    Path::new(source).file_name().and_then(std::ffi::OsStr::to_str).unwrap_or(source)
}

/// The names of the files that a record was read from.
pub(crate) fn file_names(source: &str, records: &[twinlag::RecordAnswer]) -> String {
    match records {
        [] => file_name(source).to_owned(),
        [first, .., last] if records.len() > 4 => {
            format!("{} records, {} to {}", records.len(), file_name(&first.source), file_name(&last.source))
        }
        records => listed(&records.iter().map(|record| file_name(&record.source).to_owned()).collect::<Vec<_>>()),
    }
}

#[cfg(test)]
mod tests {
    use super::file_name;

    #[test]
    fn no_folder_of_the_user_is_in_a_name() {
        for (source, want) in [("/home/someone/data/run.csv", "run.csv"), ("run.csv", "run.csv"), ("-", "-"), ("", "")]
        {
            assert_eq!(file_name(source), want);
        }
    }
}
