//! What a fuzzer is begun with, and what it has found, put to its target once more.

use std::fs;
use std::path::{Path, PathBuf};

/// Files that the tree has for other tests, of binary formats and as tables, and plans of its experiments.
const FIXTURES: &str = "../crates/twinlag-files/tests/fixtures";
const EXPERIMENTS: &str = "../docs/src/experiments";

/// Puts each file of a folder, or of its folders, to a target.
fn replay(folder: &str, target: fn(&[u8])) {
    let paths = files(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder));
    assert!(!paths.is_empty(), "{folder}: no files");
    for path in paths {
        eprintln!("{}", path.display());
        target(&fs::read(&path).expect("readable"));
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let inside = |path: PathBuf| if path.is_dir() { files(&path) } else { vec![path] };
    entries.flat_map(|entry| inside(entry.expect("readable").path())).collect()
}

#[test]
fn text() {
    replay("corpus/text", twinlag_fuzz::text);
    replay(FIXTURES, twinlag_fuzz::text);
}

#[test]
fn binary() {
    replay("corpus/binary", twinlag_fuzz::binary);
    replay(FIXTURES, twinlag_fuzz::binary);
}

#[test]
fn rig() {
    replay("corpus/rig", twinlag_fuzz::rig);
}

#[test]
fn plan() {
    replay(EXPERIMENTS, twinlag_fuzz::plan);
}

#[test]
fn selection() {
    replay("corpus/selection", twinlag_fuzz::selection);
}

#[test]
fn model() {
    replay("corpus/model", twinlag_fuzz::model);
}

#[test]
fn readings() {
    let verbs = [twinlag_fuzz::characterise, twinlag_fuzz::diagnose, twinlag_fuzz::compensate];
    verbs.into_iter().for_each(|verb| replay("corpus/readings", verb));
}
