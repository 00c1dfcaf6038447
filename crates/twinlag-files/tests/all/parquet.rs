//! Parquet files of pyarrow and pandas.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, check, notes};
use twinlag_files::Choice;
use twinlag_record::{Record, Selection};

#[test]
fn nulls_are_missing_in_all_row_groups() {
    let table = check("nulls.parquet", &Choice::default());
    assert_eq!(table.columns()[2].missing(), 5);
    assert!(notes(&table).contains("read as a Parquet file, written by parquet-cpp-arrow"), "{}", notes(&table));
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!((record.time_s[39], record.missing), (0.0585, 5));
}

#[test]
fn the_index_of_a_data_frame_is_its_time() {
    let table = check("frame.parquet", &Choice::default());
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!(record.time_s[1], 0.0015);
}

#[test]
fn pages_of_the_second_version_are_read() {
    check("pages.parquet", &Choice::default());
}

#[test]
fn cut_off_files_are_refused() {
    for name in ["nulls.parquet", "frame.parquet", "pages.parquet"] {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_files_are_survived() {
    for name in ["nulls.parquet", "frame.parquet", "pages.parquet"] {
        assert_flips_are_survived(name, &Choice::default());
    }
}
