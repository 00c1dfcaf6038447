//! Workbooks of openpyxl, pandas with odfpy, and xlwt.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, check, notes};
use twinlag_files::Choice;
use twinlag_record::{Record, Selection};

#[test]
fn header_dates_and_missing_cells_are_found_below_a_preamble() {
    let table = check("preamble.xlsx", &Choice::default());
    let notes = notes(&table);
    assert!(notes.contains("read as an Excel workbook (xlsx)"), "{notes}");
    assert!(notes.contains("sample 1 is row 5 of sheet 'Messung 1'"), "{notes}");
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!((record.channels, record.missing), (["T1".to_owned(), "T2".to_owned()], 2));
    assert_eq!(record.time_s[39], 9.75);
}

#[test]
fn a_row_of_units_is_taken_and_words_for_missing_ones_are_understood() {
    let table = check("units.ods", &Choice::default());
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!((record.missing, record.time_s[1]), (1, 0.02));
}

#[test]
fn a_day_and_a_time_of_day_stay_two_columns_that_make_one_time() {
    let table = check("day.xls", &Choice::default());
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!(record.time_s[39], 39.0);
}

#[test]
fn of_two_sheets_the_one_with_two_temperatures_is_taken_and_said() {
    let notes = notes(&check("sheets.xlsx", &Choice::default()));
    assert!(notes.contains("group 'gas', the only one of 2 groups with two temperatures or more"), "{notes}");
}

#[test]
fn cut_off_workbooks_are_refused() {
    for name in ["preamble.xlsx", "units.ods", "day.xls"] {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_workbooks_are_survived() {
    for name in ["preamble.xlsx", "units.ods", "day.xls"] {
        assert_flips_are_survived(name, &Choice::default());
    }
}
