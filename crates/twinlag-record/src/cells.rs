//! From text to lines to cells. A cell that begins with a quotation mark ends with one; two inside
//! it stand for one. Quoted cells do not run over the end of a line: no logger does that, and a
//! stray mark would swallow the file.

use std::borrow::Cow;

use crate::sign::Delimiter;

/// Lines of a text with their numbers, from 1; ends are LF, CR LF or, if the text has no LF at all,
/// CR.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.split(line_end(text)).enumerate().map(|(index, line)| (index + 1, line.trim_end_matches('\r')))
}

/// The lines of a text from the last to the first, without numbers.
pub(crate) fn lines_from_end(text: &str) -> impl Iterator<Item = &str> {
    text.rsplit(line_end(text)).map(|line| line.trim_end_matches('\r'))
}

pub(crate) fn line_end(text: &str) -> char {
    if text.contains('\n') { '\n' } else { '\r' }
}

/// Whether a line is blank or a comment: `#`, `%` or `//` first.
pub(crate) fn is_idle(line: &str) -> bool {
    let line = line.trim_start();
    line.is_empty() || uncommented(line).is_some()
}

/// The text behind a comment mark.
pub(crate) fn uncommented(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.strip_prefix('#').or_else(|| line.strip_prefix('%')).or_else(|| line.strip_prefix("//"))
}

/// A quotation mark was opened and not closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OpenQuote;

/// Splits a line into trimmed cells. A delimiter at the end of the line gives one more, empty cell.
///
/// # Errors
/// [`OpenQuote`].
pub(crate) fn split<'a>(line: &'a str, delimiter: Delimiter, cells: &mut Vec<Cow<'a, str>>) -> Result<(), OpenQuote> {
    cells.clear();
    let blank = delimiter == Delimiter::Blank;
    let is_end = |byte: u8| if blank { byte == b' ' || byte == b'\t' } else { byte == delimiter.byte() };
    let bytes = line.as_bytes();
    // Blanks before a cell are not part of it; where the tab is the delimiter it is no such blank.
    let skip = |mut at: usize| {
        while at < bytes.len() && (bytes[at] == b' ' || (bytes[at] == b'\t' && delimiter != Delimiter::Tab)) {
            at += 1;
        }
        at
    };
    let mut at = 0;
    loop {
        at = skip(at);
        if blank && at == bytes.len() {
            return Ok(());
        }
        if at < bytes.len() && bytes[at] == b'"' {
            let mut cell = String::new();
            at += 1;
            loop {
                let close = at + bytes[at..].iter().position(|&byte| byte == b'"').ok_or(OpenQuote)?;
                cell.push_str(&line[at..close]);
                at = close + 1;
                if bytes.get(at) != Some(&b'"') {
                    break;
                }
                cell.push('"');
                at += 1;
            }
            let end = bytes[at..].iter().position(|&byte| is_end(byte)).map_or(bytes.len(), |end| at + end);
            cell.push_str(line[at..end].trim());
            cells.push(Cow::Owned(cell.trim().to_owned()));
            at = end;
        } else {
            let end = bytes[at..].iter().position(|&byte| is_end(byte)).map_or(bytes.len(), |end| at + end);
            cells.push(Cow::Borrowed(line[at..end].trim()));
            at = end;
        }
        if at >= bytes.len() {
            return Ok(());
        }
        at += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cells(line: &str, delimiter: Delimiter) -> Vec<String> {
        let mut cells = Vec::new();
        split(line, delimiter, &mut cells).expect("closed quotes");
        cells.iter().map(ToString::to_string).collect()
    }

    proptest! {
        /// Oracle: the csv crate writes and quotes, this module takes apart again. Blanks at the
        /// ends are trimmed here.
        #[test]
        fn what_the_csv_crate_writes_is_taken_apart(want in prop::collection::vec("[a-z\",; ]{0,6}", 2..6)) {
            for delimiter in [Delimiter::Comma, Delimiter::Semicolon] {
                let mut writer = csv::WriterBuilder::new().delimiter(delimiter.byte()).from_writer(Vec::new());
                writer.write_record(&want).unwrap();
                let line = String::from_utf8(writer.into_inner().unwrap()).unwrap();
                // The writer leaves blanks before a text without quotes; such cells are compared
                // trimmed.
                let trimmed: Vec<_> = want.iter().map(|cell| cell.trim().to_owned()).collect();
                prop_assert_eq!(cells(line.trim_end_matches('\n'), delimiter), trimmed);
            }
        }
    }

    #[test]
    fn blanks_and_tabs_in_any_number_separate_cells() {
        assert_eq!(cells("  0.0   20.1\t 21.2  ", Delimiter::Blank), ["0.0", "20.1", "21.2"]);
    }

    #[test]
    fn empty_cells_between_tabs_are_kept() {
        assert_eq!(cells("0\t\t21.2\t", Delimiter::Tab), ["0", "", "21.2", ""]);
    }

    #[test]
    fn an_open_quote_is_an_error() {
        assert_eq!(split("0,\"1,2", Delimiter::Comma, &mut Vec::new()), Err(OpenQuote));
    }

    #[test]
    fn lines_are_numbered_from_one_for_every_line_end() {
        for text in ["a\nb\n\nc", "a\r\nb\r\n\r\nc", "a\rb\r\rc"] {
            let got: Vec<_> = lines(text).collect();
            assert_eq!(got, [(1, "a"), (2, "b"), (3, ""), (4, "c")]);
            assert_eq!(lines_from_end(text).collect::<Vec<_>>(), ["c", "", "b", "a"]);
        }
    }
}
