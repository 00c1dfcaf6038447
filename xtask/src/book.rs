//! The book as its readers see it, and whether what it links to is there.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use mdbook_driver::MDBook;
use pulldown_cmark::{Event, Parser, Tag};

use crate::root;

/// The folder of the book's sources, as pages of the repository link to it.
const SOURCES: &str = "docs/src/";
/// The folder of the book in a release archive.
pub(crate) const IN_ARCHIVE: &str = "book/";
/// Pages beside the book that link into it.
const BESIDE: [&str; 3] = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"];

/// Builds the book into `target/book` and follows every relative link of it and of the pages beside it.
///
/// # Errors
/// The first page with a link to a file that is not there, to one that is no page of the book, or to a heading that its page does not have.
pub(crate) fn run() -> Result<()> {
    let out = &root()?.join("target/book");
    let source = build(out)?;
    let mut pages: Vec<PathBuf> =
        BESIDE.iter().map(|name| root().map(|root| root.join(name))).collect::<Result<_>>()?;
    for entry in fs::read_dir(&source)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "md") {
            pages.push(path);
        }
    }
    let mut count = 0;
    for page in &pages {
        let text = fs::read_to_string(page).with_context(|| format!("{}", page.display()))?;
        for link in links(&text) {
            follow(&link, page, &source, out).with_context(|| format!("{}: {link}", page.display()))?;
            count += 1;
        }
    }
    println!("== book: {}; {count} links in {} pages lead to something", out.display(), pages.len());
    Ok(())
}

/// Builds the book into a folder, and gives that of its sources.
pub(crate) fn build(out: &Path) -> Result<PathBuf> {
    if out.exists() {
        fs::remove_dir_all(out)?;
    }
    let mut book = MDBook::load(root()?.join("docs"))?;
    out.clone_into(&mut book.config.build.build_dir);
    book.build()?;
    Ok(book.source_dir())
}

/// A page of the repository as it stands in an archive, where its links lead to the built book.
pub(crate) fn in_archive(page: &str) -> String {
    let link_start = format!("]({SOURCES}");
    let mut parts = page.split(&link_start);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (link, rest) = part.split_once(')').unwrap_or((part, ""));
        // Of the file alone: a heading keeps its name.
        let _ = write!(out, "]({IN_ARCHIVE}{})", link.replacen(".md", ".html", 1));
        out.push_str(rest);
    }
    out
}

/// Where a page links to, as long as that is no other site: a path, with a heading or without.
pub(crate) fn links(page: &str) -> Vec<String> {
    let link = |event| match event {
        Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => Some(dest_url.into_string()),
        _ => None,
    };
    let is_here = |link: &String| !link.contains("://") && !link.starts_with("mailto:");
    Parser::new(page).filter_map(link).filter(is_here).collect()
}

/// Whether a link of a page leads to a file and, where that is a page of the book, to a heading of it.
fn follow(link: &str, page: &Path, source: &Path, out: &Path) -> Result<()> {
    let (file, heading) = link.split_once('#').map_or((link, None), |(file, heading)| (file, Some(heading)));
    let target =
        if file.is_empty() { page.to_owned() } else { page.parent().context("a page has a folder")?.join(file) };
    ensure!(target.exists(), "there is no such file");
    let Ok(name) = target.canonicalize()?.strip_prefix(source.canonicalize()?).map(|name| out.join(name)) else {
        return Ok(());
    };
    let built = if name.extension().is_some_and(|e| e == "md") { name.with_extension("html") } else { name };
    ensure!(built.exists(), "the book has no such page");
    let Some(heading) = heading else { return Ok(()) };
    let html = fs::read_to_string(&built).with_context(|| format!("{}", built.display()))?;
    ensure!(html.contains(&format!("id=\"{heading}\"")), "the page has no such heading");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{in_archive, links};

    #[test]
    fn links_of_a_page_lead_into_the_archive() {
        let page = "See [files](docs/src/files.md#a.md), [more](docs/src/a/b.md), [this](CHANGELOG.md) and ![it](docs/src/images/x.svg).";
        let want = "See [files](book/files.html#a.md), [more](book/a/b.html), [this](CHANGELOG.md) and ![it](book/images/x.svg).";
        assert_eq!(in_archive(page), want);
        assert_eq!(links(want), ["book/files.html#a.md", "book/a/b.html", "CHANGELOG.md", "book/images/x.svg"]);
    }
}
