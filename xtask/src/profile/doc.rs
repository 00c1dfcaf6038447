//! What the source says of a module or a function, in one sentence.

use std::fs;
use std::path::PathBuf;

use anyhow::Result;

use super::fold::IN;
use crate::root;

/// The first sentence of a module's documentation.
pub(super) fn of_module(module: &str) -> Result<String> {
    let text = source(module)?;
    Ok(sentence(text.lines().map_while(|line| line.strip_prefix("//!"))))
}

/// The first sentence of a function's documentation, or else of its module's.
pub(super) fn of_function(frame: &str) -> Result<String> {
    let (module, function) = frame.split_once(IN).unwrap_or((frame, ""));
    let text = source(module)?;
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let begins = |line: &&str| {
        let rest = line.split_once("fn ").map(|(_, rest)| rest).and_then(|rest| rest.strip_prefix(function));
        rest.is_some_and(|rest| rest.starts_with(['(', '<']))
    };
    let at = lines.iter().position(begins).unwrap_or(0);
    let first =
        lines[..at].iter().rposition(|line| !line.starts_with("///") && !line.starts_with("#[")).map_or(0, |i| i + 1);
    let said = sentence(lines[first..at].iter().filter_map(|line| line.strip_prefix("///")));
    Ok(if said.is_empty() { format!("in: {}", of_module(module)?) } else { said })
}

/// The text of the file that is a module.
fn source(module: &str) -> Result<String> {
    let mut path = module.split("::");
    let krate = path.next().unwrap_or_default();
    let source = root()?.join(if krate == "xtask" { "." } else { "crates" }).join(krate).join("src");
    let file = path.fold(source, |file, part| file.join(part));
    let files = [file.with_extension("rs"), file.join("mod.rs"), file.join("lib.rs")];
    let found: Option<PathBuf> = files.into_iter().find(|file| file.is_file());
    Ok(found.map(fs::read_to_string).transpose()?.unwrap_or_default())
}

/// The first sentence of a paragraph, for a cell of a table.
fn sentence<'a>(lines: impl Iterator<Item = &'a str>) -> String {
    let lines: Vec<&str> = lines.map(str::trim).take_while(|line| !line.is_empty()).collect();
    let paragraph = lines.join(" ");
    let end = [". ", ": ", "; "].into_iter().filter_map(|end| paragraph.find(end)).min().unwrap_or(paragraph.len());
    paragraph[..end].trim_end_matches('.').replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sentence_of_a_paragraph_is_said() {
        assert_eq!(sentence(["One. Two", "three"].into_iter()), "One");
        assert_eq!(sentence([" One", "two.", "", "Three"].into_iter()), "One two");
        assert!(!of_module("twinlag-model::cost").expect("a file").is_empty());
    }
}
