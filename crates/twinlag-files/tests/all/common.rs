//! Fixtures that other libraries wrote, and what is in them by their own word.

use std::fs;
use std::path::PathBuf;

use twinlag_files::{Choice, FileError, read_bytes};
use twinlag_record::{NamedColumn, Table};

/// The path of a fixture.
pub(crate) fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// The bytes of a fixture.
pub(crate) fn bytes(name: &str) -> Vec<u8> {
    fs::read(path(name)).expect("a committed fixture")
}

/// What is in a fixture, of the table that was written beside it.
pub(crate) fn expected(name: &str) -> Table {
    let text = fs::read_to_string(path(&format!("{name}.csv"))).expect("a committed fixture");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let (names, units, kinds) =
        (lines.next().expect("names"), lines.next().expect("units"), lines.next().expect("kinds"));
    let rows: Vec<Vec<&str>> = lines.collect();
    let columns = (0..names.len()).map(|column| {
        let cells = rows.iter().map(|row| row[column]);
        match kinds[column] {
            "number" => {
                let number = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().expect("a number") };
                NamedColumn::numbers(names[column], cells.map(number).collect::<Vec<_>>()).with_unit(units[column])
            }
            "instant" => {
                NamedColumn::instants_ns(names[column], cells.map(|cell| cell.parse().ok()).collect::<Vec<_>>())
            }
            _ => {
                NamedColumn::texts(names[column], cells.map(str::to_owned).collect::<Vec<_>>()).with_unit(units[column])
            }
        }
    });
    Table::from_columns(name, columns).expect("a table")
}

/// Names, units, kinds and every bit of the values are the same.
///
/// The debug form of a column has all of these; doubles are printed with as many digits as give
/// them again.
pub(crate) fn assert_same(got: &Table, want: &Table, what: &str) {
    assert_eq!((got.columns().len(), got.rows()), (want.columns().len(), want.rows()), "{what}");
    for (got, want) in got.columns().iter().zip(want.columns()) {
        assert_eq!(format!("{got:?}"), format!("{want:?}"), "{what}");
    }
}

/// Names, units and kinds are the same, and numbers within a tolerance.
pub(crate) fn assert_near(got: &Table, want: &Table, tolerance: f64) {
    assert_eq!((got.columns().len(), got.rows()), (want.columns().len(), want.rows()));
    for (index, (column, wanted)) in got.columns().iter().zip(want.columns()).enumerate() {
        assert_eq!((column.name(), column.unit()), (wanted.name(), wanted.unit()));
        let (numbers, want) = (got.numbers(index).expect("numbers"), want.numbers(index).expect("numbers"));
        for (row, (number, want)) in numbers.iter().zip(want).enumerate() {
            assert!((number - want).abs() <= tolerance, "{}, row {row}: {number} and {want}", column.name());
        }
    }
}

/// Reads a fixture and compares it with what is in it.
pub(crate) fn check(name: &str, choice: &Choice) -> Table {
    let of_file = twinlag_files::read(path(name), choice).unwrap_or_else(|error| panic!("{error}"));
    assert_same(&of_file, &expected(name), name);
    let of_bytes = read_bytes(bytes(name), choice, name).unwrap_or_else(|error| panic!("{error}"));
    assert_same(&of_bytes, &expected(name), name);
    of_file
}

/// The notes of a table, one on each line.
pub(crate) fn notes(table: &Table) -> String {
    table.notes().iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// A fixture that is cut off anywhere is refused, or read with the same numbers.
pub(crate) fn assert_cuts_are_refused(name: &str, choice: &Choice) {
    let whole = bytes(name);
    let want = expected(name);
    let step = (whole.len() / 97).max(1);
    let lengths = (0..whole.len()).step_by(step).chain(whole.len().saturating_sub(20)..whole.len());
    for length in lengths {
        match read_bytes(whole[..length].to_vec(), choice, name) {
            Ok(table) => assert_same(&table, &want, &format!("{name} cut off at {length} of {}", whole.len())),
            Err(error) => assert_names_file(&error, name),
        }
    }
}

/// An error says which file it is about.
pub(crate) fn assert_names_file(error: &FileError, name: &str) {
    let text = error.to_string();
    assert!(text.starts_with(name) && text.len() > name.len() + 20, "{text}");
}

/// A fixture with flipped bits is read or refused; nothing else happens.
pub(crate) fn assert_flips_are_survived(name: &str, choice: &Choice) {
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRunner};
    let whole = bytes(name);
    let mut runner = TestRunner::new(Config { cases: 200, failure_persistence: None, ..Config::default() });
    let flips = prop::collection::vec((0..whole.len(), 1_u8..), 1..4);
    let outcome = runner.run(&flips, |flips| {
        let mut damaged = whole.clone();
        flips.iter().for_each(|&(at, mask)| damaged[at] ^= mask);
        if let Err(error) = read_bytes(damaged, choice, name) {
            prop_assert!(error.to_string().starts_with(name), "{error}");
        }
        Ok(())
    });
    outcome.unwrap_or_else(|error| panic!("{name}: {error}"));
}
