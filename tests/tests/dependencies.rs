//! The book's chapter of dependencies names each library that a crate takes, and no other.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use toml::Table;

/// Where the tables of what crates take end, and that of tests and tasks begins.
const REST: &str = "\n## Tests and tasks\n";

/// Names of other libraries in the tables of dependencies of a manifest, by target as well.
fn taken(manifest: &Table) -> Vec<String> {
    let tables = |of: &Table| -> Vec<Table> {
        ["dependencies", "build-dependencies"].iter().filter_map(|name| of.get(*name)?.as_table().cloned()).collect()
    };
    let targets = manifest.get("target").and_then(|target| target.as_table()).into_iter().flat_map(Table::values);
    let by_target = targets.filter_map(|target| target.as_table()).flat_map(tables);
    let all = tables(manifest).into_iter().chain(by_target);
    all.flat_map(|table| table.into_iter().map(|(name, _)| name)).filter(|name| !name.starts_with("twinlag")).collect()
}

/// Names in the first column of the tables of a chapter.
fn rows(text: &str) -> BTreeSet<String> {
    let of_row = |line: &str| Some(line.strip_prefix("| `")?.split_once("` |")?.0.to_owned());
    text.lines().filter_map(of_row).collect()
}

#[test]
fn each_dependency_is_justified() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let crates = fs::read_dir(root.join("crates")).expect("a folder of the repository");
    let manifests = crates.map(|entry| entry.expect("an entry").path().join("Cargo.toml"));
    let taken: BTreeSet<String> = manifests
        .map(|path| fs::read_to_string(path).expect("a readable file").parse::<Table>().expect("TOML"))
        .flat_map(|manifest| taken(&manifest))
        .collect();
    let chapter = fs::read_to_string(root.join("docs/src/dependencies.md")).expect("a readable file");
    // Before the first heading stands a table of features.
    let (_, tables) = chapter.split_once("\n## ").expect("a heading for each subject");
    let (of_crates, _) = tables.split_once(REST).expect("tests and tasks have a table of their own");
    let named = rows(of_crates);
    let missing: Vec<&String> = taken.difference(&named).collect();
    assert!(missing.is_empty(), "no row in docs/src/dependencies.md: {missing:?}");
    let gone: Vec<&String> = named.difference(&taken).collect();
    assert!(gone.is_empty(), "taken by no crate: {gone:?}");
}
