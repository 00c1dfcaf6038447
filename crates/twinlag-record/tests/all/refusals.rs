//! What cannot be read in one way only is refused, with place and remedy.

use crate::common::{FILE, assert_says, plain, record, record_with, refusal, refusal_with, rows};
use twinlag_record::{
    Channels, ColumnRef, MAX_LINE_BYTES, Record, RecordError, SamplingChoice, Selection, Table, Unit,
};

#[expect(clippy::unnecessary_wraps, reason = "as the fields of a selection are")]
fn pick(text: &str) -> Option<ColumnRef> {
    Some(text.parse().unwrap())
}

#[test]
fn decimal_commas_between_commas_are_refused() {
    let text = rows("time_s,T1,T2", |k, _, _, _| format!("{k},0,20,{k},21,5"));
    assert_says(&refusal(&text), &["line 2", "6 comma-separated", "3 column names", "semicolons"]);
    let text = rows("time_s,T1,T2", |k, _, _, _| format!("{k},20,{k},21,5"));
    assert_says(&refusal(&text), &["line 2", "5 comma-separated"]);
    let headless = text.split_once('\n').unwrap().1.replace('\n', ",1\n");
    assert_says(&refusal(&headless), &["line 1", "no header"]);
}

#[test]
fn thousands_and_mixed_decimals_are_refused() {
    let text = rows("time_s;T1;T2", |k, _, _, _| format!("{k};1,23{k};1,31{k}"));
    assert_says(&refusal(&text), &["line 2", "'1,230'", "thousands", "decimal points"]);
    let text = rows("time_s;T1;T2", |k, _, _, _| format!("{k}.5;20,{k};21,{k}"));
    assert_says(&refusal(&text), &["'20,0'", "'0.5'", "line 2", "decimal points"]);
}

#[test]
fn text_in_a_number_column_is_refused_with_line_column_and_cell() {
    let text = plain().replace("1.5,20.75", "1.5,abc");
    assert_says(&refusal(&text), &["line 5", "column 2 'T1'", "'abc'", "empty it"]);
    // Also in the first row, which must not be taken for a header or preamble, with or without a header above.
    let text = plain().replace("\n0,20,20", "\n0,abc,20");
    assert_says(&refusal(&text), &["line 2", "'abc'"]);
    assert_says(&refusal(text.split_once('\n').unwrap().1), &["line 1", "'abc'"]);
    assert_says(&refusal(&format!("# {text}")), &["line 2", "'abc'"]);
}

#[test]
fn a_text_column_cannot_be_a_temperature() {
    let text = rows("time_s,T1,T2,status", |_, t, a, b| format!("{t},{a},{b},OK"));
    let selection = Selection { t2: pick("status"), ..Selection::default() };
    assert_says(&refusal_with(text.as_bytes(), &selection), &["4 'status'", "'OK'", "by name or number"]);
}

#[test]
fn a_line_with_a_wrong_number_of_cells_is_refused() {
    let text = plain().replace("1.5,20.75,20.375", "1.5,20.75");
    assert_says(&refusal(&text), &["line 5", "expected 3", "found 2", "remove"]);
    let text = plain().replace("1.5,20.75,20.375", "1.5,20.75,20.375,7");
    assert_says(&refusal(&text), &["line 5", "expected 3", "found 4"]);
    let text = plain().replace("\n0,20,20\n", "\n0,20\n");
    assert_says(&refusal(&text), &["line 2", "expected 3", "found 2"]);
    assert_says(&refusal(&plain().replace("1.5,20.75", "1.5,\"20.75")), &["line 5", "quotation mark"]);
    assert_says(
        &refusal(&rows("time_s,T1", |_, t, a, b| format!("{t},{a},{b}"))),
        &["line 2", "expected 2", "found 3"],
    );
}

#[test]
fn an_ambiguous_date_is_refused() {
    let text = rows("time,T1,T2", |k, _, a, b| format!("{:02}/{:02}/2026 10:00:00,{a},{b}", k + 1, k + 2));
    assert_says(&refusal(&text), &["line 2", "1 'time'", "'01/02/2026 10:00:00'", "YYYY-MM-DD"]);
}

#[test]
fn clocks_of_two_parts_say_what_they_are() {
    let at = |k: u32| format!("{:02}:{:02}", k / 2, 30 * (k % 2));
    let text = |header: &str| rows(header, |k, _, a, b| format!("{},{a},{b}", at(k)));
    assert_says(
        &refusal(&text("time,T1,T2")),
        &["'00:00' may be hours and minutes or minutes and seconds", "h or min"],
    );
    for (header, period_s) in [("time (mm:ss),T1,T2", 30.0), ("time (hh:mm),T1,T2", 1800.0)] {
        assert!((record(&text(header)).time_s[1] - period_s).abs() < 1e-9, "{header}");
    }
    for (unit, period_s) in [("min", 30.0), ("h", 1800.0)] {
        let chosen = Selection { time_unit: Some(Unit::parse(unit)), ..Selection::default() };
        let got = record_with(text("time,T1,T2").as_bytes(), &chosen).expect("it is said");
        assert!((got.time_s[1] - period_s).abs() < 1e-9, "{unit}");
    }
    // Minutes that become hours, and minutes of days that are named.
    let long = |k: u32| if k < 6 { format!("59:{:02}", 30 + 5 * k) } else { format!("1:00:{:02}", 5 * (k - 6)) };
    let got = record(&rows("time,T1,T2", |k, _, a, b| format!("{},{a},{b}", long(k))));
    assert!((got.time_s[6] - 30.0).abs() < 1e-9, "{:?}", got.time_s);
    let dated = record(&rows("time,T1,T2", |k, _, a, b| format!("2026-01-31 {},{a},{b}", at(k))));
    assert!((dated.time_s[1] - 1800.0).abs() < 1e-9, "{:?}", dated.time_s);
    assert_says(&refusal(&text("time (hh:mm:ss),T1,T2")), &["may be hours and minutes or minutes and seconds"]);
    let whole = rows("time,T1,T2", |k, _, a, b| format!("10:00:{:02},{a},{b}", 5 * k));
    let chosen = Selection { time_unit: Some(Unit::parse("ms")), ..Selection::default() };
    let error = record_with(whole.as_bytes(), &chosen).expect_err("a clock has no unit");
    assert_says(&error.to_string(), &["'time' holds times of a clock, which need no unit"]);
}

/// Two columns that differ by a factor of 1000: nothing shows which of them is wrong.
#[test]
fn clocks_that_contradict_each_other_are_refused_unless_one_is_chosen() {
    let text = rows("time_s,elapsed_ms,T1,T2", |_, t, a, b| format!("{t},{t},{a},{b}"));
    assert_says(&refusal(&text), &["columns 1 'time_s' and 2 'elapsed_ms' contradict", "4.5 s", "0.0045 s", "choose"]);
    let chosen = Selection { time: Some(ColumnRef::Number(2)), ..Selection::default() };
    assert!((record_with(text.as_bytes(), &chosen).expect("it is said").time_s[1] - 5e-4).abs() < 1e-12);
    let stamps = rows("time_min,clock,T1,T2", |k, t, a, b| format!("{t},12:{:02}:{:02},{a},{b}", k / 2, 30 * (k % 2)));
    assert!((record(&stamps).time_s[1] - 30.0).abs() < 1e-9);
    assert_says(&refusal(&stamps.replace("time_min", "time_s")), &["contradict each other", "4.5 s", "270 s"]);
    // One that names no unit has the other's.
    let shown = record(&rows("time,elapsed_ms,T1,T2", |k, _, a, b| format!("{0},{0},{a},{b}", 5 * k)));
    assert!((shown.time_s[1] - 0.005).abs() < 1e-12, "{:?}", shown.time_s);
}

/// Ten rows in 27 ms, each second. Failed: a time constant of 0.3 s was 0.0089 s, `go`.
#[test]
fn times_of_arrival_in_bursts_are_refused() {
    let row = |k: u32| {
        let (a, b) = ((f64::from(k) * 0.3).sin(), (f64::from(k) * 0.3 - 0.5).sin());
        format!("12:{:02}:{:02}.{:03} -> {a:.3},{b:.3}\n", k / 600, k / 10 % 60, 3 * (k % 10))
    };
    // Some lines are lost, one of the first burst.
    let text = (0..400).filter(|k| ![3, 12, 207, 344].contains(k)).map(row).collect::<Vec<_>>().concat();
    assert_says(&refusal(&text), &["bursts of 10", "sample period, 0.1 s on average", "as they stand"]);
    let stamped = Selection { sampling: SamplingChoice::AsStamped, ..Selection::default() };
    assert_eq!(record_with(text.as_bytes(), &stamped).expect("it is said").segments.len(), 40);
}

/// Failed: a logger of 1 Hz that loses a row a minute was said to send bursts of 59.
#[test]
fn a_lost_row_now_and_then_makes_no_burst() {
    let text = (0..1200)
        .filter(|k| k % 60 != 17)
        .map(f64::from)
        .map(|t| format!("{t},{:.3},{:.3}\n", (0.1 * t).sin(), (0.1 * t - 0.2).sin()))
        .collect::<Vec<_>>()
        .concat();
    assert!((record(&format!("time_s,T1,T2\n{text}")).sampling.period_s - 1.0).abs() < 1e-9);
}

/// Failed: one reading of a broken wire, and humidity was a sensor.
#[test]
fn a_broken_reading_does_not_make_two_other_columns_the_sensors() {
    let text = (0..40)
        .map(|k| {
            let t = f64::from(k) * 0.5;
            let first = if k == 7 { 32_767.0 } else { 20.0 + t.sin() };
            format!("{t},{first:.3},{:.3},{:.3}\n", 20.0 + (t - 0.3).sin(), 40.0 + (0.1 * t).cos())
        })
        .collect::<Vec<_>>()
        .concat();
    assert_says(&refusal(&text), &["3 columns without names may be sensors"]);
}

/// Failed: a panic, since the steps of such a column are no numbers.
#[test]
fn a_time_without_a_number_is_refused_at_its_line() {
    for text in ["time,T1,T2\n5,20,21\n,20.5,21\n5,21,21\n", "time,T1,T2\n5,20,21\nnan,20.5,21\n5,21,21\n"] {
        assert_says(&refusal(text), &["line 3", "the time is missing"]);
    }
    let restarted =
        rows("time_s,clock,T1,T2", |k, t, a, b| format!("{},12:00:{:04.1},{a},{b}", f64::from(k % 6) / 2.0, t));
    assert_says(&refusal(&restarted), &["line 8", "make two records"]);
}

/// Two sensors upstream and downstream, and a part of a second.
#[test]
fn a_unit_within_the_name_of_a_sensor_makes_it_no_time() {
    let channels = |header: &str| {
        let period = Selection { period_s: Some(0.1), ..Selection::default() };
        let text = rows(header, |_, _, a, b| format!("{},{}", a.sin(), b.cos()));
        record_with(text.as_bytes(), &period).expect("two columns").channels
    };
    assert_eq!(channels("first,second"), ["first", "second"]);
    assert_eq!(channels("us_temp,ds_temp"), ["us_temp", "ds_temp"]);
}

#[test]
fn steps_of_no_logger_are_refused() {
    for step in ["1e300", "1e-300"] {
        let text =
            rows("time [s],T1,T2", |k, _, a, b| format!("{},{a},{b}", step.replacen('1', &(k + 1).to_string(), 1)));
        assert_says(&refusal(&text), &[step, "no logger", "unit of time"]);
    }
}

#[test]
fn a_broken_stamp_is_refused() {
    let text = rows("time,T1,T2", |k, t, a, b| format!("10:00:{:04.1},{a},{b}", t + f64::from(k / 7) * 60.0));
    assert_says(&refusal(&text), &["line 9", "1 'time'", "10:00:63.5", "remove"]);
    let text =
        rows("time,T1,T2", |k, t, a, b| format!("2026-01-31T10:00:{t:04.1}{},{a},{b}", if k == 3 { "Z" } else { "" }));
    assert_says(&refusal(&text), &["line 5", "zone"]);
}

#[test]
fn no_time_column_needs_a_period() {
    let text = rows("T1,T2", |_, _, a, b| format!("{a},{b}"));
    assert_says(&refusal(&text), &["choose it", "the sample period", "1 'T1', 2 'T2'"]);
    assert_says(&refusal(&rows("sample,T1,T2", |k, _, a, b| format!("{k},{a},{b}"))), &["the sample period"]);
    let selection = Selection { period_s: Some(-1.0), ..Selection::default() };
    assert_says(&refusal_with(text.as_bytes(), &selection), &["positive", "-1"]);
    let selection = Selection { period_s: Some(1.0), time: pick("1"), ..Selection::default() };
    assert_says(&refusal_with(plain().as_bytes(), &selection), &["1 'time_s'", "give one"]);
}

#[test]
fn time_must_increase() {
    for (stamp, text) in [("1", plain().replace("\n1.5,", "\n1,")), ("0.5", plain().replace("\n1.5,", "\n0.5,"))] {
        assert_says(&refusal(&text), &["line 5", &format!("'{stamp}' follows '1'"), "sort", "remove"]);
    }
    assert_says(&refusal(&plain().replace("\n1.5,", "\nNaN,")), &["line 5", "1 'time_s'", "missing"]);
    let text = rows("time,T1,T2", |k, _, a, b| format!("10:00:{:02},{a},{b}", k / 2));
    assert_says(&refusal(&text), &["line 3", "'10:00:00' follows '10:00:00'", "the sample period"]);
}

#[test]
fn which_columns_are_the_sensors_must_be_clear() {
    for header in ["time_s,a_C,b_C,c_C", "time_s,chamber_C,dut_C,ref_C"] {
        let text = rows(header, |_, t, a, b| format!("{t},{a},{b},{}", a + b));
        assert_says(
            &refusal(&text),
            &["which columns are the two sensors is not clear", "choose both", "1 'time_s'", "_C'"],
        );
    }
    let text = rows("time_s,T1,x", |_, t, a, b| format!("{t},{a},{b}"));
    assert_says(&refusal(&text), &["only column 2 'T1' has", "for example 2 and 3", "3 'x'"]);
    let with = |t1, t2| Selection { t1: pick(t1), t2: pick(t2), ..Selection::default() };
    assert_says(&refusal_with(plain().as_bytes(), &with("T9", "T2")), &["'T9'", "2 'T1'", "by name or number"]);
    assert_says(&refusal_with(plain().as_bytes(), &with("7", "T2")), &["'7'"]);
    assert_says(&refusal_with(plain().as_bytes(), &with("T2", "3")), &["3 'T2'", "twice"]);
    let text = rows("time_s,T,T", |_, t, a, b| format!("{t},{a},{b}"));
    assert_says(&refusal_with(text.as_bytes(), &with("T", "3")), &["[2, 3]", "by number"]);
}

/// Two columns beside the time are the sensors unless something says that one is none.
#[test]
fn two_columns_that_may_be_something_else_are_not_taken_for_sensors() {
    for (header, says) in [
        ("Time,Thin,Thick,Battery", "not clear: no column has"),
        ("Time,Thin,Pressure", "not clear: no column has"),
        ("Time,Thin,Ambient", "not clear: no column has"),
        ("Time,Thin [V],Thick", "not clear: no column has"),
        ("Time,Thin [V],Thick [V]", "column 2 'Thin [V]' is in 'V'"),
    ] {
        let four = header.matches(',').count() == 3;
        let text = rows(header, |_, t, a, b| format!("{t},{a},{b}{}", if four { ",12" } else { "" }));
        assert_says(&refusal(&text), &[says]);
    }
    let text = rows("Time,Thin,Thick", |_, t, a, _| format!("{t},{a},"));
    assert_says(&refusal(&text), &["column 3 'Thick' has no value"]);
}

/// Failed: "expected exactly two columns, found 2".
#[test]
fn several_candidates_are_listed_with_numbers_and_an_example() {
    let text = rows("Time,TC1,TC2,TC3,TC4", |_, t, a, b| format!("{t},{a},{b},{a},{b}"));
    let want = [
        "4 columns have the name or the unit of a temperature (2 'TC1', 3 'TC2', 4 'TC3', 5 'TC4')",
        "for example 2 and 3",
    ];
    assert_says(&refusal(&text), &want);
    let text = rows("time_s,chamber_C,dut_C,x", |_, t, a, b| format!("{t},{a},{b},{a}"));
    let want = ["2 columns have", "and 2 'chamber_C' may be that of the surroundings", "for example 3 and 4"];
    assert_says(&refusal(&text), &want);
    let text = rows("Time,TC1,TC2,TC3", |_, t, a, b| format!("{t},{a},{b},{a}"));
    let one = Selection { t1: pick("TC2"), ..Selection::default() };
    let want = ["beside column 3 'TC2', 2 columns have", "(2 'TC1', 4 'TC3')", "for example 2;"];
    assert_says(&refusal_with(text.as_bytes(), &one), &want);
}

#[test]
fn a_period_that_no_logger_has_is_refused() {
    let text = rows("T1,T2", |_, _, a, b| format!("{a},{b}"));
    for (period_s, shown) in
        [(1e-300, "1e-300"), (0.0, "0"), (f64::NAN, "NaN"), (4e7, "40000000"), (f64::INFINITY, "inf")]
    {
        let selection = Selection { period_s: Some(period_s), ..Selection::default() };
        let want = ["from a nanosecond to a year", &format!("got {shown} s"), "in seconds"];
        assert_says(&refusal_with(text.as_bytes(), &selection), &want);
    }
}

#[test]
fn what_is_no_temperature_or_time_by_its_unit_is_refused() {
    let text = rows("time_s,T1 [mV],T2", |_, t, a, b| format!("{t},{a},{b}"));
    let selection = Selection { t1: pick("T1"), t2: pick("T2"), ..Selection::default() };
    assert_says(&refusal_with(text.as_bytes(), &selection), &["2 'T1 [mV]'", "'mV'", "°C", "convert"]);
    // Left to be guessed, the same is said of the first column that is a sensor by its name.
    let text = rows("time_s,depth [m],T1 [mV],T2 [mV]", |_, t, a, b| format!("{t},1,{a},{b}"));
    let chosen = Selection { t1: pick("3"), ..Selection::default() };
    for selection in [&Selection::default(), &chosen] {
        assert_says(&refusal_with(text.as_bytes(), selection), &["column 3 'T1 [mV]' is in 'mV', expected a temp"]);
    }
    let text = rows("time_s,fast [V],slow [V]", |_, t, a, b| format!("{t},{a},{b}"));
    assert_says(&refusal(&text), &["column 2 'fast [V]' is in 'V', expected a temperature"]);
    // Columns without unit may be the sensors: the depth is not to blame.
    let text = rows("time_s,depth [m],fast,slow", |_, t, a, b| format!("{t},1,{a},{b}"));
    assert_says(&refusal(&text), &["not clear: no column has", "for example 3 and 4", "3 'fast'"]);
    let text = rows("x [m],T1,T2", |_, t, a, b| format!("{t},{a},{b}"));
    let selection = Selection { time: pick("x"), ..Selection::default() };
    assert_says(&refusal_with(text.as_bytes(), &selection), &["1 'x [m]'", "'m'", "time [s]"]);
}

#[test]
fn impossible_temperatures_are_refused() {
    for value in ["9999", "-9999", "1e37", "-273.2"] {
        let text = plain().replace("1.5,20.75", &format!("1.5,{value}"));
        assert_says(&refusal(&text), &["line 5", "2 'T1'", &format!(": {value} °C is not"), "open", "unit"]);
    }
    let text = rows("time_s,T1_K,T2_K", |_, t, a, b| format!("{t},{},{}", a + 253.0, b - 25.0));
    assert_says(&refusal(&text), &["line 2", "3 'T2_K'", "-5 K", "absolute zero"]);
}

/// A double ends at 1.8e308: as a number such a cell is infinite, which nobody wrote.
#[test]
fn a_cell_beyond_a_double_is_quoted_as_it_stands() {
    for cell in ["1e999", "-2.50E+0400"] {
        let text = plain().replace("1.5,20.75", &format!("1.5,{cell}"));
        let want = format!("line 5, column 2 'T1': '{cell}' °C is not between");
        assert_says(&refusal(&text), &[&want]);
    }
}

#[test]
fn a_channel_without_any_value_is_refused_by_name_whether_guessed_or_chosen() {
    let chosen = Selection { t1: pick("T1"), t2: pick("T2"), ..Selection::default() };
    let half = Selection { t2: pick("T2"), ..Selection::default() };
    for word in ["NaN", "", "OL"] {
        let text = rows("time_s,T1,T2", |_, t, a, _| format!("{t},{a},{word}"));
        for selection in [&Selection::default(), &chosen, &half] {
            let want = ["column 3 'T2' has no value in any row", "is the sensor connected?"];
            assert_says(&refusal_with(text.as_bytes(), selection), &want);
        }
    }
    // Beside a column that may be a sensor, without a header, in both channels, and in a vector.
    let text = rows("time_s,T1,T2,room_C", |_, t, a, b| format!("{t},{a},NaN,{b}"));
    assert_says(&refusal(&text), &["3 'T2' has no value"]);
    let text = rows("time_s,T1,T2", |_, t, a, _| format!("{t},{a},NaN"));
    assert_says(&refusal(text.split_once('\n').unwrap().1), &["column 3 has no value"]);
    assert_says(&refusal(&rows("time_s,T1,T2", |_, t, _, _| format!("{t},NaN,NaN"))), &["2 'T1' has no value"]);
    let channels = Channels {
        source: FILE.to_owned(),
        names: ["hot", "cold"].map(str::to_owned),
        time_s: (0..10).map(f64::from).collect(),
        t1_c: (0..10).map(f64::from).collect(),
        t2_c: vec![f64::NAN; 10],
        reference_c: None,
    };
    let error = Record::from_channels(channels, SamplingChoice::Auto).expect_err("refused").to_string();
    assert_says(&error, &["column cold has no value"]);
}

/// Inputs of a logger that are not connected harm nobody who does not select them.
#[test]
fn empty_columns_beside_two_sensors_do_no_harm() {
    let text = rows("time_s,ch1,ch2,ch3,ch4", |_, t, a, b| format!("{t},NaN,{a},{b},NaN"));
    let got = record(&text);
    assert_eq!((got.channels, got.t1_c[4]), (["ch2", "ch3"].map(str::to_owned), 21.0));
}

#[test]
fn a_reference_that_is_also_a_sensor_or_the_time_is_refused() {
    let with = |t1, reference| Selection { t1, reference: pick(reference), ..Selection::default() };
    let text = rows("time_s,T1,T2,Tref", |_, t, a, b| format!("{t},{a},{b},{a}"));
    for selection in [with(pick("T1"), "2"), with(None, "T1")] {
        let want = ["2 'T1'", "twice", "cannot be its own reference"];
        assert_says(&refusal_with(text.as_bytes(), &selection), &want);
    }
    let time = Selection { time: pick("1"), ..with(None, "time_s") };
    assert_says(&refusal_with(text.as_bytes(), &time), &["1 'time_s'", "twice"]);
    assert!(record_with(text.as_bytes(), &with(None, "Tref")).is_ok());
    // A guess keeps off the reference: what it lacks then is a sensor.
    let text = rows("time_s,T1,trusted_C", |_, t, a, b| format!("{t},{a},{b}"));
    assert_says(&refusal_with(text.as_bytes(), &with(None, "trusted_C")), &["not clear: only column 2 'T1' has"]);
}

#[test]
fn a_flow_that_is_not_positive_is_refused() {
    let with = |cell: &str| {
        let text = rows("time_s,T1,T2,velocity", |row, t, a, b| {
            format!("{t},{a},{b},{}", if row == 2 { cell.to_owned() } else { format!("{}", 1 + row % 3) })
        });
        refusal_with(text.as_bytes(), &Selection { flow: pick("velocity"), ..Selection::default() })
    };
    for (cell, found) in [("0", "found 0"), ("-2", "found -2")] {
        assert_says(&with(cell), &["line 4", "4 'velocity'", "positive", found, "use no flow"]);
    }
}

#[test]
fn channels_that_tell_nothing_are_refused() {
    assert_says(&refusal(&rows("time_s,T1,T2", |_, t, a, _| format!("{t},{a},{a}"))), &["2 'T1'", "3 'T2'", "same"]);
    assert_says(
        &refusal(&rows("time_s,T1,T2", |_, t, a, _| format!("{t},{a},21.5"))),
        &["3 'T2'", "21.5 °C", "Choose"],
    );
}

#[test]
fn fewer_than_eight_usable_samples_are_refused() {
    let text: String = plain().lines().take(8).map(|line| line.to_owned() + "\n").collect();
    assert_says(&refusal(&text), &["7 usable", "of 7 rows", "at least 8"]);
    let text =
        rows("time_s,T1,T2", |k, t, a, b| if k % 4 == 0 { format!("{t},OL,{b}") } else { format!("{t},{a},{b}") });
    assert_says(&refusal(&text), &["7 usable", "of 10 rows", "3 with a missing"]);
}

#[test]
fn files_without_a_table_are_refused() {
    for (bytes, says) in [
        (&b""[..], "empty"),
        (b"\n\n", "empty"),
        (b"# only\n", "empty"),
        (b"time_s,T1,T2\n", "no row of numbers in its 1 line,"),
        (b"time_s,T1,T2\n[s],[K],[K]\n", "no row of numbers in its 2 lines,"),
        (b"\x89HDF\r\n\x1a\n\0\0\0", "not text"),
    ] {
        assert_says(&refusal_with(bytes, &Selection::default()), &[says]);
    }
}

#[test]
fn one_column_is_refused_at_its_first_value() {
    for (text, line) in [
        ("T1\n1\n2\n3\n", "line 2:"),
        ("# rig 3\n\nLogger\nT1\n\"20.5\"\n\"20.6\"\n", "line 5:"),
        ("time\n10:00:00\n10:00:01\n", "line 2:"),
        ("20.5\n20.6\n", "line 1:"),
        ("\nneither\nnor\n", "line 2:"),
    ] {
        assert_says(&refusal(text), &[line, "one column"]);
    }
}

#[test]
fn counts_of_one_are_singular_in_refusals() {
    let one: String = plain().lines().take(2).map(|line| line.to_owned() + "\n").collect();
    assert_says(&refusal(&one), &[": 1 usable sample of 1 row (0 with"]);
    assert_says(
        &refusal(&plain().lines().take(3).collect::<Vec<_>>().join("\n")),
        &[": 2 usable samples of 2 rows (0"],
    );
}

#[test]
fn files_that_cannot_be_opened_are_refused() {
    let missing = Table::from_path("no/such/file.csv").unwrap_err().to_string();
    assert!(missing.contains("no/such/file.csv") && missing.contains("check the path"), "{missing}");
    let directory = Table::from_path(env!("CARGO_MANIFEST_DIR")).unwrap_err().to_string();
    assert!(directory.contains("directory"), "{directory}");
}

#[test]
fn vectors_are_checked_like_files() {
    let good = || Channels {
        source: FILE.to_owned(),
        names: ["hot", "cold"].map(str::to_owned),
        time_s: (0..10).map(f64::from).collect(),
        t1_c: (0..10).map(f64::from).collect(),
        t2_c: (0..10).map(|k| f64::from(k) / 2.0).collect(),
        reference_c: None,
    };
    let refused = |channels| Record::from_channels(channels, SamplingChoice::Auto).expect_err("refused").to_string();
    assert!(Record::from_channels(good(), SamplingChoice::Auto).is_ok());
    let mut bad = good();
    bad.t2_c.pop();
    assert_says(&refused(bad), &["cold", "9 samples", "expected 10"]);
    let mut bad = good();
    bad.time_s[4] = 3.0;
    assert_says(&refused(bad), &["sample 5", "'3 s' follows '3 s'"]);
    let mut bad = good();
    bad.t1_c[2] = f64::INFINITY;
    assert_says(&refused(bad), &["sample 3", "hot"]);
    let mut bad = good();
    bad.time_s[2] = f64::NAN;
    assert_says(&refused(bad), &["sample 3", "missing"]);
}

/// Failed: names of a spreadsheet that go over two lines were taken for none, and a time in milliseconds for one in seconds.
#[test]
fn names_over_several_lines_are_refused() {
    let text = "time [ms],\"T1\n[°C]\",\"T2\n[°C]\"\n0,20,20\n20,21,20.5\n40,23,21\n60,24,22\n80,25,23\n100,24,23\n120,23,23\n140,22,22\n";
    let error = Table::read(text.as_bytes(), "sheet.csv").expect_err("which names?");
    assert_eq!(error.line(), Some(("sheet.csv", 1)), "{error}");
    assert!(error.to_string().contains("put each name of a column on one line"), "{error}");
}

/// A line that fills the memory, wherever it stands, and columns that nobody can choose from.
#[test]
fn what_is_beyond_any_logger_is_refused() {
    let long = "1".repeat(MAX_LINE_BYTES + 1);
    for text in [
        plain() + &long,
        format!("# {long}\n{}", plain()),
        plain() + &long.repeat(5) + "\n",
        plain().repeat(200_000) + &long.repeat(2),
    ] {
        let error = Table::from_reader(text.as_bytes(), FILE).expect_err("a line of a megabyte");
        assert!(matches!(error, RecordError::LongLine { .. }), "{error}");
        assert_says(&error.to_string(), &["line"]);
    }
    let wide = |cell: &str| vec![cell; 10_001].join(",") + "\n";
    assert_says(&refusal(&(wide("T") + &wide("20.5").repeat(9))), &["10001 columns", "at most 10000"]);
}
