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
    let table = table([ramp("t_s", 0.0, 1.0), NamedColumn::numbers("T1", values), ramp("T2", 20.0, 0.5)]);
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
    let table = table([ramp("t_s", 0.0, 1.0), ramp("T", 20.0, 1.0), ramp("T", 20.0, 0.5)]);
    let name = Selection { t1: Some(ColumnRef::Name("T".to_owned())), ..Selection::default() };
    let error = Record::from_table(&table, &name).expect_err("two of them");
    assert!(matches!(&error, RecordError::AmbiguousName { numbers, .. } if *numbers == [2, 3]), "{error}");
    let number = |n| Some(ColumnRef::Number(n));
    let chosen = Selection { t1: number(3), t2: number(2), ..Selection::default() };
    assert_eq!(Record::from_table(&table, &chosen).expect("a record").t1_c[1], 20.5);
}

/// The channels as they are named, and what the second row reads, which shows the unit that was
/// taken: the cells are 20 and 21, then 293.15 and 294.15 where the header says kelvin.
#[test]
fn headers_as_people_write_them_are_two_sensors() {
    let pairs = [
        ["Thin", "Thick"],
        ["Thin wire (0.5 mm)", "Thick wire (1.2 mm)"],
        ["Fast (50 um)", "Slow (250 um)"],
        ["T1 (type K)", "T2 (type K)"],
        ["TC1 [K-type]", "TC2 [K-type]"],
        ["TC1 type K", "TC2 type K"],
        ["Temp 1 (deg C)", "Temp 2 (deg C)"],
        ["Gas T (C) fine", "Gas T (C) coarse"],
        ["T090C [ITS-90, deg C]", "T190C [ITS-90, deg C]"],
        ["T1 (0.5 mm) [°C]", "T2 (1.2 mm) [°C]"],
        ["front", "back"],
    ];
    for pair in pairs {
        let got = record([ramp("Time", 0.0, 0.5), ramp(pair[0], 20.0, 1.0), ramp(pair[1], 20.0, 0.5)]);
        let got = got.unwrap_or_else(|error| panic!("{pair:?}: {error}"));
        assert_eq!((got.t1_c[1], got.t2_c[1]), (21.0, 20.5), "{pair:?}: {:?}", got.channels);
        let got = record([
            ramp("Record", 1.0, 1.0),
            ramp("Time", 0.0, 0.5),
            ramp(pair[0], 20.0, 1.0),
            ramp(pair[1], 20.0, 0.5),
        ]);
        assert!(got.is_ok(), "with a row number, {pair:?}: {}", got.expect_err("an error"));
    }
    let kelvin =
        record([ramp("Time", 0.0, 0.5), ramp("T1 (0.5 mm) [K]", 293.15, 1.0), ramp("T2 [K] (fine)", 293.15, 0.5)]);
    // 293.15 - 273.15 is off by as much as doubles near 300 lie apart.
    assert!((kelvin.expect("a record").t1_c[1] - 21.0).abs() < 300.0 * f64::EPSILON);
}

/// Failed: the flags of oceanographic files, `temp_qc`, were proposed as sensors.
#[test]
fn quality_flags_are_no_sensors() {
    let columns = [
        ramp("time_s", 0.0, 0.5),
        ramp("temp_1", 20.0, 1.0),
        ramp("temp_1_qc", 1.0, 0.0),
        ramp("temp_2", 20.0, 0.5),
        ramp("temp_2_qc_flag", 1.0, 0.0),
    ];
    assert_eq!(record(columns).expect("a record").channels, ["temp_1", "temp_2"]);
}

/// Slopes differ, so that the channels do.
#[test]
fn kelvins_that_may_be_none_are_asked_about() {
    let notes = |first: (&str, f64), second: (&str, f64)| {
        let columns = [ramp("Time", 0.0, 0.5), ramp(first.0, first.1, 1.0), ramp(second.0, second.1, 0.5)];
        let notes = record(columns).expect("a record").notes;
        notes.iter().map(ToString::to_string).filter(|note| note.contains(": if ")).collect::<Vec<_>>()
    };
    let mixed = notes(("T1", 293.15), ("T2", 20.0));
    assert_eq!(mixed.len(), 1, "{mixed:?}");
    // The median of the differences is that of row 6: 273.15 + 0.5 × 6.
    assert!(mixed[0].starts_with("column 2 'T1' reads 276 K more than column 3 'T2', about 273.15 K"), "{mixed:?}");
    let types = notes(("T1 (K)", 20.0), ("T2 (K)", 20.0));
    assert!(
        types.len() == 2 && types[0].contains("column 2 'T1 (K)' is in K by its header and reads 26 K"),
        "{types:?}"
    );
    for pair in [("T1 [K]", "T2 [K]"), ("T1", "T2")] {
        assert!(notes((pair.0, 293.15), (pair.1, 293.15)).is_empty());
    }
    // Not in the same gas, and not the distance of the scales.
    assert!(notes(("T1", 420.0), ("T2", 120.0)).is_empty());
}

fn timed(name: &str, first: f64, step: f64) -> Result<Record, RecordError> {
    record([ramp(name, first, step), ramp("T1", 20.0, 1.0), ramp("T2", 20.0, 0.5)])
}

fn note_of(record: &Record, word: &str) -> String {
    record.notes.iter().map(ToString::to_string).find(|note| note.contains(word)).unwrap_or_default()
}

/// A quarter of a second in each way to count. The stamps are off by as much as doubles of their size
/// are, which the tolerances are: 256 ns, and two units of serial days.
#[test]
fn time_that_is_not_in_seconds_is_converted_and_said() {
    let day_s = 86_400.0;
    for (name, first, unit_s, tolerance_s, says) in [
        ("time", 1_769_853_600e3, 1e-3, 0.0, "milliseconds since 1970, 0.25 s from row to row"),
        ("time", 1_769_853_600e6, 1e-6, 0.0, "microseconds since 1970"),
        ("timestamp", 1_769_853_600e9, 1e-9, 2.56e-7, "nanoseconds since 1970"),
        ("time", 46_053.416_67, day_s, 2.0 * 6.3e-7, "serial days of a spreadsheet, 0.25 s from row to row"),
        ("time", 740_012.416_67, day_s, 2.0 * 1.1e-5, "serial days of MATLAB"),
        ("time", 2_461_071.916_67, day_s, 2.0 * 4.1e-5, "Julian days"),
    ] {
        let got = timed(name, first, 0.25 / unit_s).unwrap_or_else(|error| panic!("{says}: {error}"));
        for (k, t) in got.time_s.iter().enumerate() {
            assert!((t - 0.25 * k as f64).abs() <= tolerance_s, "{says}, row {k}: {t}, tolerance {tolerance_s:e}");
        }
        assert_eq!(got.sampling.kind, SamplingKind::Uniform);
        let note = note_of(&got, "size and the step");
        assert!(note.contains(says) && note.contains("choose its unit, or write it in the header"), "{note}");
    }
}

/// A unit in the header decides, and the caller's decides before that.
/// Failed: stamps every 40 ms were taken for as many seconds.
#[test]
fn a_time_column_may_be_named_as_its_unit() {
    let got = timed("ms", 0.0, 40.0).expect("a record");
    assert!(got.time_s.iter().enumerate().all(|(k, t)| (t - 0.04 * k as f64).abs() < 1e-12), "{:?}", got.time_s);
    let got = timed("ms [s]", 0.0, 40.0).expect("a record");
    assert_eq!(got.time_s[1], 40.0);
    // Failed: it was found in the first place alone.
    for (name, step_s) in [("s", 40.0), ("sec", 40.0), ("ms", 40e-3), ("us", 40e-6), ("µs", 40e-6), ("ns", 40e-9)] {
        let got = record([ramp("T1", 20.0, 1.0), ramp(name, 0.0, 40.0), ramp("T2", 20.0, 0.5)]).expect("a record");
        assert!((got.time_s[1] - step_s).abs() <= 2.0 * f64::EPSILON * step_s, "{name}: {}", got.time_s[1]);
        assert_eq!(got.channels, ["T1", "T2"]);
    }
    // A part of a date begins anew, and a longer unit may be another quantity: a height, a minimum.
    let part = NamedColumn::numbers("ms", (0..ROWS).map(|k| (k * 400 % 1000) as f64).collect::<Vec<_>>());
    for no_time in [part, ramp("h", 0.0, 40.0), ramp("min", 0.0, 40.0)] {
        assert!(record([ramp("T1", 20.0, 1.0), no_time, ramp("T2", 20.0, 0.5)]).is_err());
    }
}

#[test]
fn a_stated_unit_of_time_decides() {
    for (name, want_s) in
        [("time [s]", 0.25), ("time_ms", 0.25e-3), ("millis", 0.25e-3), ("time [us]", 0.25e-6), ("time [h]", 900.0)]
    {
        // An instant in milliseconds, were nothing said.
        let got = timed(name, 1_769_853_600e3, 0.25).expect("a record");
        assert!((got.time_s[1] - want_s).abs() <= f64::EPSILON * want_s, "{name}: {}", got.time_s[1]);
        assert_eq!(note_of(&got, "size and the step"), "");
    }
    let minutes = Selection { time_unit: Some(Unit::parse("min")), ..Selection::default() };
    let columns = [ramp("time [ms]", 0.0, 0.25), ramp("T1", 20.0, 1.0), ramp("T2", 20.0, 0.5)];
    let got = Record::from_table(&table(columns.clone()), &minutes).expect("a record");
    assert_eq!(got.time_s[1], 15.0);
    assert!(note_of(&got, "as chosen").contains("'time [ms]' was taken to be in min"), "{:?}", got.notes);
    let kelvin = Selection { time_unit: Some(Unit::Kelvin), ..Selection::default() };
    let error = Record::from_table(&table(columns), &kelvin).expect_err("not a time");
    assert!(matches!(&error, RecordError::NotATimeUnit { unit, .. } if unit == "K"), "{error}");
}

/// What may be seconds or something else is refused, however likely seconds are.
#[test]
fn numbers_that_may_count_something_else_are_refused() {
    for (first, step) in [(0.0, 10.0), (0.0, 1.0), (45_296.5, 1.0 / 24.0), (0.0, 1e6), (1.8e12, 1e6), (0.0, 1.0 / 60.0)]
    {
        let error = timed("time", first, step).expect_err("no clock").to_string();
        for part in ["steps of", "do not show which it is", "choose the unit", "sample period"] {
            assert!(error.contains(part), "{first}, {step}: {error}");
        }
    }
    for (first, step) in [(0.0, 0.5), (0.0, 0.01), (45_296.5, 0.01), (1_769_853_600.0, 10.0)] {
        assert!((timed("time", first, step).expect("seconds").time_s[1] - step).abs() < 1e-6, "{first}, {step}");
    }
}

/// The unit stands somewhere in the name.
#[test]
fn a_unit_within_the_name_of_the_time_is_that_of_its_numbers() {
    for (name, want_s) in [
        ("elapsedMillis", 0.01),
        ("timeMs", 0.01),
        ("ZeitMS", 0.01),
        ("time.ms", 0.01),
        ("Time:ms", 0.01),
        ("milliseconds since boot", 0.01),
        ("Zeitstempel in Millisekunden", 0.01),
        ("Zeit mSek", 0.01),
        ("System.millis()", 0.01),
        ("Laufzeit (Millisekunden)", 0.01),
        ("Time [Millisec]", 0.01),
        ("elapsedMicros", 1e-5),
        ("Time min.", 600.0),
        ("elapsedHours", 36_000.0),
        ("Zeit Std.", 36_000.0),
        ("days since start", 864_000.0),
        ("Temps (s)", 10.0),
        ("Tiempo (min)", 600.0),
    ] {
        let got = timed(name, 0.0, 10.0).expect("a record");
        assert!((got.time_s[1] - want_s).abs() <= 1e-12 * want_s, "{name}: {}", got.time_s[1]);
    }
    for name in ["time of day", "second time", "us or ms elapsed"] {
        timed(name, 0.0, 10.0).expect_err("no unit, or two");
    }
}

/// 1 kHz in Julian days, which are to 4e-5 s: even to the last bit of the stamps.
#[test]
fn serial_days_of_a_fast_logger_are_even_to_their_last_bit() {
    let day_s = 86_400.0;
    let days: Vec<f64> = (0..3000).map(|k| 2_461_071.916_67 + 1e-3 * f64::from(k) / day_s).collect();
    let channel = |slope: f64| (0..3000).map(|k| 20.0 + slope * f64::from(k % 50)).collect::<Vec<_>>();
    let columns = [
        NamedColumn::numbers("time [d]", days),
        NamedColumn::numbers("T1", channel(1.0)),
        NamedColumn::numbers("T2", channel(0.5)),
    ];
    let got = record(columns).expect("a record");
    assert_eq!(got.sampling.kind, SamplingKind::Rounded, "{:?}", got.sampling);
    // Errors of up to a unit turn the slope by 3 q/n at most.
    assert!((got.sampling.period_s - 1e-3).abs() < 3.0 * 4.1e-5 / 3000.0, "{:?}", got.sampling);
}
