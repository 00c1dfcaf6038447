//! That further lines are read as the first ones were, and that a bad one is named and harms no other.

use twinlag_record::{Place, RecordError, Row, RowReader, Selection, Table, Unit};

const START: &str = "\
Zeit [ms];T1 [°C];Sonde;T2 [K]
100;20,0;a;293,15
102;20,5;b;293,25
";

fn reader() -> RowReader {
    let table = Table::read(START.as_bytes(), "pipe").expect("a table");
    RowReader::after(&table, &Selection::default()).expect("columns that can be told")
}

#[test]
fn lines_are_read_as_the_first_ones_were() {
    let row = |line: &str| reader().read(line, 4).expect("a good line");
    let near = |got: Option<Row>, want: (f64, [Option<f64>; 2])| {
        let got = got.expect("a row");
        let same = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(a == b, |(a, b)| (a - b).abs() < 1e-9);
        assert!(same(got.time_s, Some(want.0)), "{got:?}, want {want:?}");
        assert!((0..2).all(|i| same(got.reading_c[i], want.1[i])), "{got:?}, want {want:?}");
    };
    near(row("104;21,0;c;293,65\r\n"), (0.004, [Some(21.0), Some(20.5)]));
    near(row("106;---;c;293,65;"), (0.006, [None, Some(20.5)]));
    assert_eq!(row("# a comment"), None);
    assert_eq!(row("\n"), None);
}

#[test]
fn bad_lines_are_named() {
    let mut reader = reader();
    let mut error = |line: &str| reader.read(line, 7).expect_err("a bad line");
    assert!(matches!(error("104;21,0"), RecordError::CellCount { line: 7, expected: 4, found: 2, .. }));
    assert!(matches!(error("104;warm;c;293,65"), RecordError::NotANumber { at: Place::Line(7), .. }));
    assert!(matches!(error("104;21,0;c;-5,0"), RecordError::OutOfRange { .. }));
    assert!(matches!(error("104;\"21,0;c;293,65"), RecordError::OpenQuote { line: 7, .. }));
}

/// Failed: an epoch in milliseconds without a unit was taken to be in seconds here, whatever the
/// record made of it.
#[test]
fn the_unit_of_time_is_that_of_the_first_lines() {
    let start = "time,T1,T2\n1769853600000,20,20\n1769853600010,20,20\n1769853600020,20,20\n";
    let table = Table::read(start.as_bytes(), "pipe").expect("a table");
    let mut reader = RowReader::after(&table, &Selection::default()).expect("clear columns");
    let row = reader.read("1769853600030,21,20\n", 5).expect("a good line").expect("a row");
    assert_eq!(row.time_s, Some(0.03));
    let seconds = Selection { time_unit: Some(Unit::parse("s")), ..Selection::default() };
    let row = RowReader::after(&table, &seconds).expect("clear columns").read("1769853600030,21,20\n", 5);
    assert_eq!(row.expect("a good line").expect("a row").time_s, Some(30.0));
}
