//! One record in the dialects of many loggers is one record: the same time constants, whatever stands between the digits.
//!
//! Every dialect below writes each number with all its digits: readings have four decimals in °C, which K keep, and °F have
//! one more; stamps are whole milliseconds. What is left are roundings of the double: of a sum with 273.15 or a division by
//! 1.8 (1e-15 of a reading, 1e-13 of its noise) and of the stamps' slope. They move the bottom of the cost by less than
//! where an optimiser stops, at steps of 1e-9 of a time constant (2e-10 is what was seen). [`TOLERANCE`] is a thousand times
//! that, and far below any standard error: whatever a dialect does to the numbers that matters is seen.

use std::fmt::Write as _;

use twinlag::record::{ColumnRef, Record, Selection, Table};
use twinlag::{Characterisation, Options, Status};

/// Relative, of the time constants.
const TOLERANCE: f64 = 1e-6;
/// Of the sensors, s; sampled every 2 ms.
const TAU_S: [f64; 2] = [0.0238, 0.1168];
const SAMPLES: u32 = 1500;

/// Milliseconds, and readings in ten thousandths of a degree Celsius: whole numbers, so that all dialects say the same.
type Row = (i64, i64, i64);

/// Gas constant over each 2 ms, random levels; noise of 0.3 K, uniform. The recursion is the exact answer of the sensors.
fn rows() -> Vec<Row> {
    let mut state = 7_u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let (mut gas, mut y) = (0.0, [0.0; 2]);
    (-700..i64::from(SAMPLES))
        .filter_map(|k| {
            gas = 0.94 * gas + 40.0 * uniform();
            // A uniform number has a standard deviation of 1/√12.
            let read = [0, 1].map(|i: usize| ((85.0 + y[i] + 0.3 * 12_f64.sqrt() * uniform()) * 1e4).round() as i64);
            for (y, tau_s) in y.iter_mut().zip(TAU_S) {
                let a = (-0.002 / tau_s).exp();
                *y = a * *y + (1.0 - a) * gas;
            }
            (k >= 0).then_some((2 * k, read[0], read[1]))
        })
        .collect()
}

/// `value · 10^−decimals` in full, with this decimal sign.
fn fixed(value: i64, decimals: u32, sign: char) -> String {
    let scale = 10_i64.pow(decimals);
    let minus = if value < 0 { "-" } else { "" };
    let (whole, part) = (value.abs() / scale, value.abs() % scale);
    format!("{minus}{whole}{sign}{part:0width$}", width = decimals as usize)
}

fn seconds(ms: i64) -> String {
    fixed(ms, 3, '.')
}

fn celsius(reading: i64) -> String {
    fixed(reading, 4, '.')
}

fn kelvin(reading: i64) -> String {
    fixed(reading + 2_731_500, 4, '.')
}

/// `1.8 ϑ + 32` with one more decimal: exact.
fn fahrenheit(reading: i64) -> String {
    fixed(18 * reading + 3_200_000, 5, '.')
}

/// Header and rows; `row` writes the line.
fn file(header: &str, mut row: impl FnMut(&Row) -> String) -> String {
    let mut text = header.to_owned();
    for r in &rows() {
        writeln!(text, "{}", row(r)).expect("a string takes everything");
    }
    text
}

fn plain() -> String {
    file("time_s,T1,T2\n", |&(ms, a, b)| format!("{},{},{}", seconds(ms), celsius(a), celsius(b)))
}

fn read(dialect: &str, bytes: &[u8], selection: &Selection) -> Record {
    let table = Table::read(bytes, dialect).unwrap_or_else(|e| panic!("{e}"));
    Record::from_table(&table, selection).unwrap_or_else(|e| panic!("{e}"))
}

fn characterise(record: &Record) -> Characterisation {
    twinlag::characterise(record, &Options::default()).unwrap_or_else(|e| panic!("{}: {e}", record.source))
}

fn plain_record() -> Record {
    read("plain", plain().as_bytes(), &Selection::default())
}

/// Time constants do not feel a shift of both channels, as by 273.15: the readings are compared too. 1e-9 K is far above
/// their rounding, 1e-6 s above that of the least exact stamps, which are those of the epoch.
fn same_numbers(got: &Record, want: &Record) {
    let columns = [(&got.time_s, &want.time_s, 1e-6), (&got.t1_c, &want.t1_c, 1e-9), (&got.t2_c, &want.t2_c, 1e-9)];
    for (got_column, want_column, tolerance) in columns {
        assert_eq!(got_column.len(), want_column.len(), "{}", got.source);
        for (row, (x, y)) in got_column.iter().zip(want_column).enumerate() {
            assert!((x - y).abs() < tolerance, "{}, row {row}: got {x}, want {y} ± {tolerance:e}", got.source);
        }
    }
}

fn time_constants_s(of: &Characterisation) -> [f64; 2] {
    [0, 1].map(|i| of.sensors[i].time_constant_s.expect("the record determines both"))
}

/// The plain file's answer is right, and this dialect's is the same.
fn same_as_plain_with(dialect: &str, bytes: &[u8], selection: &Selection) {
    let plain = plain_record();
    let want = characterise(&plain);
    assert_eq!(want.status, Status::Ok);
    let record = read(dialect, bytes, selection);
    same_numbers(&record, &plain);
    let got = characterise(&record);
    assert_eq!(got.status, Status::Ok, "{dialect}: {:?}", got.warnings);
    assert_eq!(
        (got.record.samples, got.record.missing, got.record.segments, got.record.sampling.kind),
        (SAMPLES as usize, 0, 1, want.record.sampling.kind),
        "{dialect}: {:?}",
        got.notes
    );
    for (got, want) in time_constants_s(&got).into_iter().zip(time_constants_s(&want)) {
        assert!((got / want - 1.0).abs() < TOLERANCE, "{dialect}: got {got:.12}, want {want:.12} ± {TOLERANCE:e}");
    }
    for i in 0..2 {
        let (got, want) = (got.sensors[i].noise_std_k, want.sensors[i].noise_std_k);
        assert!((got / want - 1.0).abs() < TOLERANCE, "{dialect}: noise {got:.12} K, want {want:.12} K");
    }
}

fn same_as_plain(dialect: &str, bytes: impl AsRef<[u8]>) {
    same_as_plain_with(dialect, bytes.as_ref(), &Selection::default());
}

/// The oracle is the recursion above: without this the dialects could all be wrong alike.
#[test]
fn the_plain_record_gives_the_sensors_time_constants() {
    let got = characterise(&plain_record());
    for (sensor, want) in got.sensors.iter().zip(TAU_S) {
        let (tau_s, error) =
            (sensor.time_constant_s.expect("determined"), sensor.standard_error_s.expect("determined"));
        // Four standard errors: by chance once in 16 000. And the record is one that tells something.
        assert!((tau_s - want).abs() < 4.0 * error && error < 0.05 * want, "got {tau_s} ± {error}, want {want}");
    }
}

#[test]
fn any_delimiter() {
    for (name, delimiter) in
        [("semicolon", ";"), ("tab", "\t"), ("pipe", "|"), ("blanks", "  "), ("comma, blank", ", ")]
    {
        same_as_plain(name, plain().replace(',', delimiter));
    }
}

#[test]
fn decimal_commas_between_semicolons_and_tabs() {
    for delimiter in [';', '\t'] {
        let text = plain().replace(',', &delimiter.to_string()).replace('.', ",");
        same_as_plain(&format!("decimal comma, {delimiter:?}"), text);
    }
}

#[test]
fn no_header() {
    let text = plain();
    let (_, body) = text.split_once('\n').expect("a header");
    same_as_plain("no header", body);
}

#[test]
fn kelvin_and_fahrenheit_in_the_header() {
    let kelvins = |header: &str| file(header, |&(ms, a, b)| format!("{},{},{}", seconds(ms), kelvin(a), kelvin(b)));
    for header in ["time_s,T1 [K],T2 [K]\n", "time (s),T1 (K),T2 (K)\n", "time_s,T1_K,T2_K\n", "time/s,T1/K,T2/K\n"] {
        same_as_plain(header, kelvins(header));
    }
    let fahrenheits =
        |header: &str| file(header, |&(ms, a, b)| format!("{},{},{}", seconds(ms), fahrenheit(a), fahrenheit(b)));
    for header in ["time [s],T1 [°F],T2 [°F]\n", "time [s],T1 (degF),T2 (degF)\n"] {
        same_as_plain(header, fahrenheits(header));
    }
    let mixed =
        file("time [s],T1 [K],T2 [°F]\n", |&(ms, a, b)| format!("{},{},{}", seconds(ms), kelvin(a), fahrenheit(b)));
    same_as_plain("a unit for each channel", mixed);
}

#[test]
fn a_row_of_units_below_the_names() {
    let text = file("time;T1;T2\ns;K;K\n", |&(ms, a, b)| format!("{};{};{}", seconds(ms), kelvin(a), kelvin(b)));
    same_as_plain("unit row", text);
}

#[test]
fn comments_preamble_and_blank_lines() {
    same_as_plain("comments", format!("# logger 7\n# started by hand\n{}", plain()));
    same_as_plain("preamble", format!("Logger;7\nStarted: 2026-01-31\n\n{}", plain()));
    same_as_plain("comments between rows", plain().replacen("\n0.100,", "\n# stirred here\n\n0.100,", 1));
}

#[test]
fn marks_encodings_and_line_ends() {
    let text = plain().replacen("T1,T2", "T1 [°C],T2 [°C]", 1);
    let wide: Vec<u16> = text.encode_utf16().collect();
    let little = wide.iter().flat_map(|unit| unit.to_le_bytes());
    let big = wide.iter().flat_map(|unit| unit.to_be_bytes());
    let windows: Vec<u8> = text.chars().map(|c| if c == '°' { 0xB0 } else { c as u8 }).collect();
    same_as_plain("UTF-8", &text);
    same_as_plain("UTF-8 with a mark", format!("\u{FEFF}{text}"));
    same_as_plain("UTF-16, little end first", [0xFF, 0xFE].into_iter().chain(little).collect::<Vec<u8>>());
    same_as_plain("UTF-16, big end first", [0xFE, 0xFF].into_iter().chain(big).collect::<Vec<u8>>());
    same_as_plain("Windows-1252", windows);
    same_as_plain("CR LF", text.replace('\n', "\r\n"));
    same_as_plain("CR alone", text.replace('\n', "\r"));
    same_as_plain("no line end at the end", text.trim_end());
}

#[test]
fn time_in_milliseconds_microseconds_and_minutes() {
    same_as_plain("ms", file("time [ms],T1,T2\n", |&(ms, a, b)| format!("{ms},{},{}", celsius(a), celsius(b))));
    same_as_plain("us", file("t_us,T1,T2\n", |&(ms, a, b)| format!("{},{},{}", 1000 * ms, celsius(a), celsius(b))));
    // 2 ms are 1/30000 of a minute: twelve decimals leave 5e-13 min, 1.5e-8 of a step, which its mean over 1499 steps takes
    // to below 1e-11.
    let minutes = |ms: i64| format!("{:.12}", ms as f64 / 60_000.0);
    same_as_plain(
        "min",
        file("time [min],T1,T2\n", |&(ms, a, b)| format!("{},{},{}", minutes(ms), celsius(a), celsius(b))),
    );
}

/// A clock that starts somewhere, as the digits of its stamps.
fn clock(ms: i64) -> String {
    let ms = ms + ((13 * 60 + 59) * 60 + 58) * 1000;
    format!("{:02}:{:02}:{}", ms / 3_600_000, ms / 60_000 % 60, fixed_two(ms % 60_000))
}

/// Seconds of a minute with two digits before the point.
fn fixed_two(ms: i64) -> String {
    format!("{:02}.{:03}", ms / 1000, ms % 1000)
}

#[test]
fn dates_and_times_of_day() {
    let stamped = |header: &str, stamp: &dyn Fn(i64) -> String| {
        file(header, |&(ms, a, b)| format!("{},{},{}", stamp(ms), celsius(a), celsius(b)))
    };
    same_as_plain("ISO", stamped("timestamp,T1,T2\n", &|ms| format!("2026-01-31T{}", clock(ms))));
    same_as_plain("ISO, zone", stamped("timestamp,T1,T2\n", &|ms| format!("2026-01-31T{}+01:00", clock(ms))));
    same_as_plain("ISO, UTC, quoted", stamped("timestamp,T1,T2\n", &|ms| format!("\"2026-01-31 {}Z\"", clock(ms))));
    same_as_plain("day first, points", stamped("Datum,T1,T2\n", &|ms| format!("31.01.2026 {}", clock(ms))));
    same_as_plain("month first, strokes", stamped("date,T1,T2\n", &|ms| format!("01/31/2026 {}", clock(ms))));
    same_as_plain("time of day", stamped("time,T1,T2\n", &|ms| clock(ms)));
    same_as_plain("date and time apart", stamped("Date,Time,T1,T2\n", &|ms| format!("2026-01-31,{}", clock(ms))));
    let decimal_comma = stamped("Datum;Uhrzeit;T1;T2\n", &|ms| format!("31.01.2026;{}", clock(ms).replace('.', ",")));
    let decimal_comma = decimal_comma.lines().enumerate().fold(String::new(), |text, (i, line)| {
        let mut cells = line.split([';', ',']);
        if i == 0 {
            return format!("{line}\n");
        }
        let mut next = || cells.next().expect("enough cells");
        let (date, time, part) = (next(), next(), next());
        let [a, b] = [next().replace('.', ","), next().replace('.', ",")];
        format!("{text}{date};{time},{part};{a};{b}\n")
    });
    same_as_plain("German, date and time apart", decimal_comma);
}

/// Stamps of a date look alike but for their last digits: 1.7e9 s in a double leave 2e-7 s, a ten thousandth of a step, which
/// its mean over 1499 steps takes to 1e-8 and less.
#[test]
fn seconds_of_the_epoch() {
    let text = file("epoch,T1,T2\n", |&(ms, a, b)| {
        format!("{},{},{}", seconds(1_769_864_398_000 + ms), celsius(a), celsius(b))
    });
    same_as_plain("epoch", text);
}

#[test]
fn quotes_trailing_delimiters_further_columns_and_exponents() {
    let quoted = file("\"time_s\",\"T1\",\"T2\"\n", |&(ms, a, b)| {
        format!("\"{}\",\"{}\",\"{}\"", seconds(ms), celsius(a), celsius(b))
    });
    same_as_plain("quotes", quoted);
    same_as_plain("a delimiter at the end of each line", plain().replace('\n', ",\n"));
    let further = file("sample,time_s,valve,T1,T2,remark\n", |&(ms, a, b)| {
        format!("{},{},open,{},{},none", ms / 2, seconds(ms), celsius(a), celsius(b))
    });
    same_as_plain("further columns", further);
    let exponents = file("time_s,T1,T2\n", |&(ms, a, b)| format!("{ms}e-3,{a}E-4,+{b}e-04"));
    same_as_plain("exponents", exponents);
    same_as_plain("the header again", plain().replacen("\n1.000,", "\ntime_s,T1,T2\n1.000,", 1));
}

#[test]
fn columns_in_any_order_by_name_or_number_and_a_period_for_the_time() {
    let text = file("T2,remark,time_s,T1\n", |&(ms, a, b)| format!("{},x,{},{}", celsius(b), seconds(ms), celsius(a)));
    same_as_plain("any order", &text);
    let column = |text: &str| Some(text.parse::<ColumnRef>().expect("never fails"));
    for [time, t1, t2] in [["time_s", "T1", "T2"], ["3", "4", "1"]] {
        let selection = Selection { time: column(time), t1: column(t1), t2: column(t2), ..Selection::default() };
        same_as_plain_with(&format!("chosen: {time}, {t1}, {t2}"), text.as_bytes(), &selection);
    }
    let selection = Selection { period_s: Some(0.002), ..Selection::default() };
    same_as_plain_with(
        "period",
        file("T1,T2\n", |&(_, a, b)| format!("{},{}", celsius(a), celsius(b))).as_bytes(),
        &selection,
    );
}
