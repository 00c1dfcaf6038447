//! Arrays of NumPy.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, check, notes};
use twinlag_files::Choice;
use twinlag_record::{Record, Selection};

#[test]
fn fields_are_channels_and_stamps_are_instants() {
    let table = check("fields.npy", &Choice::default());
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!((record.time_s[39], record.missing), (0.0585, 1));
}

#[test]
fn a_matrix_has_columns_without_names() {
    let table = check("matrix.npy", &Choice::default());
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!(record.time_s[39], 19.5);
}

#[test]
fn a_rate_gives_the_time_of_named_arrays() {
    let table = check("named.npz", &Choice::default());
    assert!(
        notes(&table).contains("read as a NumPy archive (npz), group '40 samples', the only one"),
        "{}",
        notes(&table)
    );
}

#[test]
fn cut_off_files_are_refused() {
    for name in ["fields.npy", "matrix.npy", "named.npz"] {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_files_are_survived() {
    for name in ["fields.npy", "matrix.npy", "named.npz"] {
        assert_flips_are_survived(name, &Choice::default());
    }
}
