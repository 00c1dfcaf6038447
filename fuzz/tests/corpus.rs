//! What a fuzzer was begun with and what it has found, put to its target once more.

use std::fs;
use std::path::Path;

/// Puts each file of a target's folder to it, in the order of their names.
fn replay(name: &str, target: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{}: no files", folder.display());
    for path in paths {
        eprintln!("{}", path.display());
        target(&fs::read(&path).expect("readable"));
    }
}

macro_rules! targets {
    ($($name:ident),* $(,)?) => {
        $(#[test]
        fn $name() {
            replay(stringify!($name), twinlag_fuzz::$name);
        })*

        /// A target without its program is never searched.
        #[test]
        fn each_target_has_its_program() {
            let manifest = include_str!("../Cargo.toml");
            for name in [$(stringify!($name)),*] {
                assert!(manifest.contains(&format!("path = \"targets/{name}.rs\"")), "{name}");
            }
        }
    };
}

targets!(
    text,
    spreadsheet,
    mdf,
    tdms,
    parquet,
    hdf5,
    netcdf,
    numpy,
    matlab,
    rig,
    plan,
    selection,
    model,
    characterise,
    diagnose,
    compensate,
);
