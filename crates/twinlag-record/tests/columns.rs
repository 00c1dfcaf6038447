//! Columns from memory are understood as the same columns in a file are.

use twinlag_record::{ColumnRef, Kind, NamedColumn, Place, Record, RecordError, SamplingKind, Selection, Table, Unit};

const ROWS: usize = 12;

fn ramp(name: &str, start: f64, slope: f64) -> NamedColumn {
    NamedColumn::numbers(name, (0..ROWS).map(|k| start + slope * k as f64).collect::<Vec<_>>())
}

fn table<const N: usize>(columns: [NamedColumn; N]) -> Table {
    Table::from_columns("memory", columns).expect("a table")
}

fn record<const N: usize>(columns: [NamedColumn; N]) -> Result<Record, RecordError> {
    Record::from_table(&table(columns), &Selection::default())
}

/// Quarters and halves are doubles and print as what they are, so that both ways give the same
/// bits.
#[test]
fn columns_from_memory_make_the_record_that_their_text_makes() {
    let line = |k: usize| {
        let k = k as f64;
        format!("{},{},{}\n", 250.0 * k, 293.5 + 0.25 * k, 68.0 + 0.5 * k)
    };
    let text = "time,T1,T2 [°F]\nms,K,°F\n".to_owned() + &(0..ROWS).map(line).collect::<String>();
    let from_text =
        Record::from_table(&Table::read(text.as_bytes(), "memory").expect("a table"), &Selection::default())
            .expect("a record");
    let from_memory = record([
        ramp("time", 0.0, 250.0).with_unit("ms"),
        ramp("T1", 293.5, 0.25).with_unit("K"),
        ramp("T2 [°F]", 68.0, 0.5),
    ])
    .expect("a record");
    assert_eq!(from_memory.channels, from_text.channels);
    assert_eq!(from_memory.time_s, from_text.time_s);
    assert_eq!(from_memory.t1_c, from_text.t1_c);
    assert_eq!(from_memory.t2_c, from_text.t2_c);
    assert_eq!(from_memory.sampling, from_text.sampling);
    // The text has one note more: what kind of text it is.
    assert_eq!(from_memory.notes, from_text.notes[1..]);
}

#[test]
fn nan_and_infinity_are_missing() {
    let mut values: Vec<f64> = (0..ROWS).map(|k| 20.0 + k as f64).collect();
    (values[5], values[6]) = (f64::NAN, f64::INFINITY);
    let table = table([ramp("t", 0.0, 1.0), NamedColumn::numbers("T1", values), ramp("T2", 20.0, 0.5)]);
    assert_eq!(table.columns()[1].missing(), 2);
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!(record.missing, 2);
    assert_eq!(record.segments, [0..5, 7..12]);
}

/// 2026-01-31T10:00:00Z is 20 484 days and 10 hours after 1970-01-01; the quarter seconds are whole
/// nanoseconds.
#[test]
fn instants_are_time_to_the_nanosecond() {
    const START_NS: i64 = (20_484 * 24 + 10) * 3_600_000_000_000;
    let instants = |step_ns: i64| (0..ROWS as i64).map(|k| Some(START_NS + k * step_ns)).collect::<Vec<_>>();
    let columns =
        |step_ns| [NamedColumn::instants_ns("when", instants(step_ns)), ramp("T1", 20.0, 1.0), ramp("T2", 20.0, 0.5)];
    assert_eq!(table(columns(1)).columns()[0].kind(), Kind::Stamp);
    let record = record(columns(250_000_001)).expect("a record");
    assert_eq!(record.sampling.kind, SamplingKind::Uniform);
    for (k, t) in record.time_s.iter().enumerate() {
        assert_eq!(*t, (250_000_001 * k) as f64 / 1e9, "sample {k}");
    }
}

#[test]
fn a_missing_instant_is_refused_with_its_sample() {
    let mut instants: Vec<_> = (0..ROWS as i64).map(|k| Some(k * 1_000_000_000)).collect();
    instants[3] = None;
    let columns = [NamedColumn::instants_ns("time", instants), ramp("T1", 20.0, 1.0), ramp("T2", 20.0, 0.5)];
    let error = record(columns).expect_err("no time in one row");
    assert!(matches!(&error, RecordError::MissingTime { at: Place::Sample(4), .. }), "{error}");
    assert!(error.to_string().contains("sample 4"), "{error}");
}

#[test]
fn texts_are_read_as_cells_are() {
    let stamps: Vec<_> = (0..ROWS).map(|k| format!("10:00:{k:02}")).collect();
    let mut cells: Vec<_> = (0..ROWS).map(|k| format!(" {}.5 ", 20 + k)).collect();
    cells[11] = "OPEN".to_owned();
    let columns =
        |cells| [NamedColumn::texts("time", stamps.clone()), NamedColumn::texts("T1", cells), ramp("T2", 20.0, 0.5)];
    let record_of = record(columns(cells.clone())).expect("a record");
    assert_eq!((record_of.t1_c[2], record_of.missing), (22.5, 1));
    cells[7] = "warm".to_owned();
    let error = record(columns(cells)).expect_err("a word among numbers");
    assert!(matches!(&error, RecordError::NotANumber { at: Place::Sample(8), .. }), "{error}");
}

#[test]
fn a_unit_of_its_own_goes_before_one_in_the_name() {
    let unit = |column: NamedColumn| table([column]).columns()[0].unit().clone();
    assert_eq!(unit(ramp("T1 [°C]", 0.0, 1.0)), Unit::Celsius);
    assert_eq!(unit(ramp("T1 [°C]", 0.0, 1.0).with_unit("")), Unit::Celsius);
    assert_eq!(unit(ramp("T1 [°C]", 0.0, 1.0).with_unit("K")), Unit::Kelvin);
    assert_eq!(unit(ramp("U", 0.0, 1.0).with_unit("mV")), Unit::Other("mV".to_owned()));
}

#[test]
fn columns_of_different_lengths_are_refused() {
    let short = NamedColumn::numbers("T2", vec![20.0; ROWS - 1]);
    let error = Table::from_columns("memory", [ramp("t", 0.0, 1.0), ramp("T1", 20.0, 1.0), short]).expect_err("uneven");
    let text = error.to_string();
    assert!(matches!(error, RecordError::LengthMismatch { found: 11, expected: 12, .. }), "{text}");
    assert!(text.contains("column 3 'T2' has 11 samples") && text.contains("column 1 't'"), "{text}");
}

#[test]
fn no_column_and_no_row_are_refused() {
    for columns in [vec![], vec![NamedColumn::numbers("T1", [])]] {
        let error = Table::from_columns("memory", columns).expect_err("nothing there");
        assert!(matches!(&error, RecordError::Empty { .. }), "{error}");
    }
}

#[test]
fn two_columns_of_one_name_are_chosen_by_number_alone() {
    let table = table([ramp("t", 0.0, 1.0), ramp("T", 20.0, 1.0), ramp("T", 20.0, 0.5)]);
    let name = Selection { t1: Some(ColumnRef::Name("T".to_owned())), ..Selection::default() };
    let error = Record::from_table(&table, &name).expect_err("two of them");
    assert!(matches!(&error, RecordError::AmbiguousName { numbers, .. } if *numbers == [2, 3]), "{error}");
    let number = |n| Some(ColumnRef::Number(n));
    let chosen = Selection { t1: number(3), t2: number(2), ..Selection::default() };
    assert_eq!(Record::from_table(&table, &chosen).expect("a record").t1_c[1], 20.5);
}
