//! Phrases that made English-speaking readers stumble, counted in everything that a user or a reader of the documentation
//! sees: README, CONTRIBUTING, CHANGELOG, the book, public and private doc comments, and string literals of the crates.
//! Code spans in backticks are left out, and so is every module of unit tests at the end of a file.

use std::fs;
use std::path::{Path, PathBuf};

/// Texts in which a phrase is right, as `(end of the path, part of the text)`.
const ALLOWED: &[(&str, &str)] = &[];

/// A piece of text that somebody reads, with its place.
struct Text {
    file: String,
    line: usize,
    text: String,
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A line of a Markdown file.
    Markdown,
    /// A whole doc comment, its lines joined.
    Doc,
    /// A string literal, as it is in memory, code spans included.
    Literal,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn files(folder: &Path, ending: &str, is_deep: bool, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder of the repository").map(|e| e.expect("an entry").path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            if is_deep {
                files(&path, ending, true, out);
            }
        } else if path.extension().is_some_and(|e| e == ending) {
            out.push(path);
        }
    }
}

/// Everything that is searched.
fn texts() -> Vec<Text> {
    let root = root();
    let mut out = Vec::new();
    let mut markdown: Vec<PathBuf> =
        ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root.join(name)).to_vec();
    files(&root.join("docs/src"), "md", false, &mut markdown);
    for path in markdown {
        let text = fs::read_to_string(&path).expect("UTF-8");
        let lines = text.lines().enumerate();
        out.extend(lines.map(|(k, line)| Text {
            file: name(&root, &path),
            line: k + 1,
            text: without_code(line),
            kind: Kind::Markdown,
        }));
    }
    let mut crates: Vec<PathBuf> = fs::read_dir(root.join("crates"))
        .expect("the crates")
        .map(|e| e.expect("a crate").path().join("src"))
        .collect();
    crates.sort();
    let mut sources = Vec::new();
    crates.iter().for_each(|folder| files(folder, "rs", true, &mut sources));
    for path in sources {
        let text = fs::read_to_string(&path).expect("UTF-8");
        let visible = text.split("#[cfg(test)]\nmod ").next().expect("at least one part");
        let file = name(&root, &path);
        doc_comments(visible, &file, &mut out);
        literals(visible, &file, &mut out);
    }
    out
}

fn name(root: &Path, path: &Path) -> String {
    path.strip_prefix(root).expect("it is below").display().to_string()
}

fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect::<Vec<_>>().join("`")
}

fn doc_comments(source: &str, file: &str, out: &mut Vec<Text>) {
    let mut block: Option<(usize, &str, String)> = None;
    for (k, line) in source.lines().chain([""]).enumerate() {
        let line = line.trim_start();
        let mark = ["///", "//!"].into_iter().find(|mark| line.starts_with(mark));
        match (&mut block, mark) {
            (Some((_, before, text)), Some(mark)) if *before == mark => {
                text.push(' ');
                text.push_str(line[3..].trim());
            }
            (_, mark) => {
                if let Some((line, _, text)) = block.take() {
                    out.push(Text { file: file.to_owned(), line, text: without_code(text.trim()), kind: Kind::Doc });
                }
                block = mark.map(|mark| (k + 1, mark, line[3..].trim().to_owned()));
            }
        }
    }
}

/// String literals of `source`, as they are in memory: a backslash at the end of a line takes the blanks after it away.
fn literals(source: &str, file: &str, out: &mut Vec<Text>) {
    let characters: Vec<char> = source.chars().collect();
    let at = |k: usize| characters.get(k).copied().unwrap_or('\0');
    let (mut k, mut line) = (0, 1);
    while k < characters.len() {
        match (at(k), at(k + 1)) {
            ('\n', _) => line += 1,
            ('/', '/') => {
                while k + 1 < characters.len() && at(k + 1) != '\n' {
                    k += 1;
                }
            }
            // A character, unless it is a lifetime.
            ('\'', '\\') => k += 3,
            ('\'', _) if at(k + 2) == '\'' => k += 2,
            ('r', '"' | '#') if !at(k.wrapping_sub(1)).is_alphanumeric() && at(k.wrapping_sub(1)) != '_' => {
                let hashes = (k + 1..characters.len()).take_while(|&i| at(i) == '#').count();
                if at(k + 1 + hashes) == '"' {
                    let from = k + 2 + hashes;
                    let closes = |i: &usize| at(*i) == '"' && (1..=hashes).all(|h| at(i + h) == '#');
                    let to = (from..characters.len()).find(closes).unwrap_or(characters.len());
                    let text: String = characters[from..to].iter().collect();
                    let lines = text.matches('\n').count();
                    out.push(Text { file: file.to_owned(), line, text, kind: Kind::Literal });
                    line += lines;
                    k = to + hashes;
                }
            }
            ('"', _) => {
                let (start, mut text) = (line, String::new());
                k += 1;
                while k < characters.len() && at(k) != '"' {
                    match at(k) {
                        '\\' if at(k + 1) == '\n' => {
                            while at(k + 1).is_whitespace() {
                                line += usize::from(at(k + 1) == '\n');
                                k += 1;
                            }
                        }
                        '\\' => {
                            text.push(if at(k + 1) == 'n' { '\n' } else { at(k + 1) });
                            k += 1;
                        }
                        c => {
                            line += usize::from(c == '\n');
                            text.push(c);
                        }
                    }
                    k += 1;
                }
                out.push(Text { file: file.to_owned(), line: start, text, kind: Kind::Literal });
            }
            _ => {}
        }
        k += 1;
    }
}

/// The text without code spans, which documentation and Markdown have lost already.
fn prose(text: &Text) -> String {
    if text.kind == Kind::Literal { without_code(&text.text) } else { text.text.clone() }
}

/// Whether `text` has one of `words` as a whole word, in either case.
fn has_word(text: &str, words: &[&str]) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
    text.split(|c: char| !is_part(c)).any(|word| words.contains(&word.to_lowercase().as_str()))
}

/// Whether two blanks or more stand between two words, as a line that was broken without a backslash leaves them.
fn has_run_of_blanks(text: &str) -> bool {
    let characters: Vec<char> = text.chars().collect();
    !text.contains('\n')
        && characters.windows(4).any(|w| {
            (w[0].is_alphabetic() || ",.;:".contains(w[0]))
                && w[1] == ' '
                && w[2] == ' '
                && (w[3] == ' ' || w[3].is_alphabetic())
        })
}

/// Places where `is_wrong`, apart from those that are [`ALLOWED`].
fn found(is_wrong: impl Fn(&Text) -> bool) -> Vec<String> {
    let is_allowed = |t: &Text| ALLOWED.iter().any(|(file, part)| t.file.ends_with(file) && t.text.contains(part));
    let all = texts();
    assert!(all.len() > 5000, "only {} texts were read: has the repository moved?", all.len());
    let wrong = all.iter().filter(|t| is_wrong(t) && !is_allowed(t));
    wrong.map(|t| format!("{}:{}: {}", t.file, t.line, t.text.chars().take(120).collect::<String>())).collect()
}

fn assert_none(what: &str, places: &[String]) {
    assert!(places.is_empty(), "{what} in {} places:\n{}", places.len(), places.join("\n"));
}

#[test]
fn readings_determine_and_distinguish_and_do_not_tell() {
    let places = found(|t| has_word(&prose(t), &["tell", "tells", "told", "telling"]));
    assert_none("\"tell\" (say determine, distinguish, estimate, show)", &places);
}

#[test]
fn nothing_is_none() {
    let places = found(|t| {
        let text = format!(" {} ", t.text.to_lowercase());
        let is_word_at = |at: usize, end: usize| {
            !text[..at].ends_with(char::is_alphanumeric)
                && !text[end..].starts_with(|c: char| c.is_alphanumeric() || c == '`')
        };
        ["is none", "are none", "be it none"].iter().any(|phrase| {
            text.match_indices(phrase)
                .any(|(at, phrase)| is_word_at(at, at + phrase.len()) && !text[..at].ends_with("there "))
        })
    });
    assert_none("\"is none\" (say what it is not)", &places);
}

/// In a hover or on docs.rs a comment is read without the one before it.
#[test]
fn each_doc_comment_stands_alone() {
    let places = found(|t| t.kind == Kind::Doc && (t.text.starts_with("The same") || t.text == "Which."));
    assert_none("a doc comment that needs the one before it", &places);
}

#[test]
fn literals_have_no_runs_of_blanks() {
    let places = found(|t| t.kind == Kind::Literal && has_run_of_blanks(&t.text));
    assert_none("a run of blanks in a string", &places);
}

/// A library does not know the command line: its errors carry settings, and the program adds its options for them.
#[test]
fn no_library_names_an_option_of_the_program() {
    let names_one = |text: &str| {
        text.match_indices("--").any(|(at, _)| {
            let before = text[..at].chars().next_back();
            let after = text[at + 2..].chars().next();
            !before.is_some_and(|c| c.is_alphanumeric() || c == '-') && after.is_some_and(|c| c.is_ascii_lowercase())
        })
    };
    assert!(names_one("leave out --estimator") && !names_one("a -- b") && !names_one("---"));
    // What `twinlag-cluster` writes are command lines, those of engines.
    let programs = ["crates/twinlag-cli/", "crates/twinlag-cluster/"];
    let is_library = |t: &Text| t.kind == Kind::Literal && !programs.iter().any(|folder| t.file.starts_with(folder));
    // Style sheets have custom properties of the same form.
    let places = found(|t| is_library(t) && names_one(&t.text) && !t.text.contains("var(--"));
    assert_none("an option of the program in a library", &places);
}

/// The search finds what it is meant to find: strings over several lines, doc comments, whole words only.
#[test]
fn the_search_reads_literals_and_doc_comments() {
    let source =
        "/// One\n/// comment.\nfn f<'a>() { g('\"', \"two \\\n    words\", r#\"a \"b\"\"#); } // \"no\"\n//! Other.\n";
    let mut out = Vec::new();
    doc_comments(source, "x.rs", &mut out);
    literals(source, "x.rs", &mut out);
    let got: Vec<(usize, &str)> = out.iter().map(|t| (t.line, t.text.as_str())).collect();
    assert_eq!(got, [(1, "One comment."), (5, "Other."), (3, "two words"), (4, "a \"b\"")]);
    assert!(has_word("No record tells.", &["tells"]) && !has_word("intelligent Told_it", &["told"]));
    assert!(has_run_of_blanks("the  end") && !has_run_of_blanks("  {a}  the end"));
}
