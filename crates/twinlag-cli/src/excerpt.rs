//! A line of a file, to be shown below the message about it.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};

/// Characters of a line that are shown.
const SHOWN_CHARACTERS: usize = 100;
/// Bytes of a line that are read.
const MAX_LINE_BYTES: u64 = 4096;

/// A line of a file with its number; `None` where it cannot be read again, as from a pipe, or is no text.
///
/// - `line`: from 1
pub(crate) fn excerpt(file: &str, line: usize) -> Option<String> {
    let opened = File::open(file).ok()?;
    if !opened.metadata().ok()?.is_file() {
        return None;
    }
    let mut reader = BufReader::new(opened);
    for _ in 1..line {
        reader.skip_until(b'\n').ok()?;
    }
    let mut bytes = Vec::new();
    reader.take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes).ok()?;
    let text = String::from_utf8(bytes).ok()?.replace('\t', " ");
    let text = text.trim_end();
    if text.is_empty() || text.chars().any(char::is_control) {
        return None;
    }
    let shown: String = text.chars().take(SHOWN_CHARACTERS).collect();
    let rest = if shown.len() < text.len() { "…" } else { "" };
    Some(format!("  {line} | {shown}{rest}"))
}
