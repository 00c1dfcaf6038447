//! The book as its readers see it, and whether what it links to is there.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use mdbook_driver::MDBook;
use pulldown_cmark::{Event, Parser, Tag};

use crate::root;

/// Pages beside the book that link into it.
const BESIDE: [&str; 3] = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"];

/// Builds the book into `target/book` and follows every relative link of it and of the pages beside it.
///
/// # Errors
/// The first page with a link to a file that is not there, to one that is no page of the book, or to a heading that its page does not have.
pub(crate) fn run() -> Result<()> {
    let out = &root()?.join("target/book");
    let mut book = MDBook::load(root()?.join("docs"))?;
    out.clone_into(&mut book.config.build.build_dir);
    book.build()?;
    let source = book.source_dir();
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
        for event in Parser::new(&text) {
            let Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) = event else { continue };
            if !dest_url.contains("://") && !dest_url.starts_with("mailto:") {
                follow(&dest_url, page, &source, out).with_context(|| format!("{}: {dest_url}", page.display()))?;
                count += 1;
            }
        }
    }
    println!("== book: {}; {count} links in {} pages lead to something", out.display(), pages.len());
    Ok(())
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
