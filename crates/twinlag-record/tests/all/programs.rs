//! Files of programs that are known by their headers. The forms are those of the programs' own manuals and of files in public
//! collections; the oracle is the numbers that the text was made from.

use std::io::Write as _;

use crate::common::{assert_is_the_rig, assert_says, notes, record, record_with, refusal, rows};
use flate2::Compression;
use flate2::write::GzEncoder;
use twinlag_record::{ColumnRef, Note, Program, Record, RecordError, RowReader, Selection, Table, Unit};

/// The body of a record of the rig: `row` is told time, T1 and T2.
fn body(row: impl Fn(f64, f64, f64) -> String) -> String {
    rows("", |_, t, a, b| row(t, a, b)).split_off(1)
}

fn comma(value: f64) -> String {
    format!("{value:.6}").replace('.', ",")
}

const SEA_BIRD: &str = "\
* Sea-Bird SBE 9 Data File:\r
* FileName = C:\\CTD\\CAST01.HEX\r
* NMEA Latitude = 28 14.23 N\r
** Ship: Pelican, cruise = 12\r
# nquan = 6\r
# nvalues = 10\r
# units = specified\r
# name 0 = prDM: Pressure, Digiquartz [db]\r
# name 1 = t090C: Temperature [ITS-90, deg C]\r
# name 2 = t190C: Temperature, 2 [ITS-90, deg C]\r
# name 3 = c0S/m: Conductivity [S/m]\r
# name 4 = timeS: Time, Elapsed [seconds]\r
# name 5 = flag:  0.000e+00\r
# span 0 =      1.000,     10.000\r
# interval = seconds: 0.5\r
# start_time = Jul 03 2012 10:30:00 [NMEA time, header]\r
# bad_flag = -9.990e-29\r
# datcnv_date = Jul 04 2012 09:23:56, 7.22\r
# file_type = ascii\r
*END*\r
";

fn sea_bird_rows() -> String {
    body(|t, a, b| format!("{:>11}{a:>11.4}{b:>11.4}{:>11}{t:>11.3}  0.000e+00\r", "1.000", "3.512345"))
}

#[test]
fn a_sea_bird_cast_is_read_by_its_header() {
    let got = record(&(SEA_BIRD.to_owned() + &sea_bird_rows()));
    assert_is_the_rig(&got, 0.0);
    assert_eq!(got.channels, ["t090C", "t190C"]);
    let said = notes(&got);
    assert!(said.contains("Sea-Bird") && said.contains("column names on line 8"), "{said}");
}

/// Failed: a temperature and the potential one that was computed from it were proposed as the two sensors.
#[test]
fn potential_temperatures_are_no_sensors() {
    let computed = "# name 3 = potemp090C: Potential Temperature [ITS-90, deg C]\r";
    let cast = SEA_BIRD.replace("# name 3 = c0S/m: Conductivity [S/m]\r", computed);
    assert_ne!(cast, SEA_BIRD);
    assert_eq!(record(&(cast + &sea_bird_rows())).channels, ["t090C", "t190C"]);
}

#[test]
fn a_cast_that_is_cut_off_is_refused() {
    let whole = SEA_BIRD.to_owned() + &sea_bird_rows();
    let rows = sea_bird_rows().lines().count();
    let read = |declared: usize| {
        let text = whole.replace("# nvalues = 10", &format!("# nvalues = {declared}"));
        Table::from_reader(text.as_bytes(), "cast.cnv").map(|table| table.rows())
    };
    assert_eq!(read(rows).expect("whole"), rows);
    let error = read(rows + 1).expect_err("a row is missing");
    let said = format!("cast.cnv: expected {} rows, as its header declares, and found {rows}", rows + 1);
    assert!(error.to_string().starts_with(&said), "{error}");
}

#[test]
fn the_bad_flag_is_missing_and_no_temperature() {
    let bad = sea_bird_rows().replacen("    21.0000", " -9.990e-29", 1);
    let got = record(&(SEA_BIRD.to_owned() + &bad));
    // T1 is 21 in row 4.
    assert_eq!((got.missing, got.t1_c[4].is_nan()), (1, true));
}

/// A conductivity of a sensor in the air, and a pressure, that fill their columns.
#[test]
fn numbers_that_touch_are_parted_by_the_width_of_their_columns() {
    let touching = sea_bird_rows().replace("   3.512345", "-49.1234567").replacen("      1.000", "-123.000000", 1);
    let text = SEA_BIRD.to_owned() + &touching;
    assert!(text.contains("-49.1234567      ") && text.contains("20.0000-49.1234567"), "{text}");
    assert_is_the_rig(&record(&text), 0.0);
    let table = Table::read(text.as_bytes(), "cast.cnv").expect("text");
    assert_eq!(
        (table.numbers(0).expect("numbers")[..2].to_vec(), table.numbers(3).expect("numbers")[9]),
        (vec![-123.0, 1.0], -49.123_456_7)
    );
}

#[test]
fn a_cast_without_times_has_the_interval_of_its_header() {
    let scans = SEA_BIRD.replace("timeS: Time, Elapsed [seconds]", "scan: Scan Count");
    assert_is_the_rig(&record(&(scans + &sea_bird_rows())), 0.0);
    // Days have six decimals: 0.09 s.
    let days = SEA_BIRD.replace("timeS: Time, Elapsed [seconds]", "timeJ: Julian Days");
    let got = record(&(days + &sea_bird_rows()));
    assert_is_the_rig(&got, 0.0);
    assert!(notes(&got).contains("as its header says"), "{}", notes(&got));
    let by_pressure = SEA_BIRD
        .replace("timeS: Time, Elapsed [seconds]", "nbin: number of scans per bin")
        .replace("seconds: 0.5", "decibars: 1");
    assert_says(&refusal(&(by_pressure + &sea_bird_rows())), &["no column is recognisably the time", "period"]);
}

#[test]
fn a_cast_that_is_cut_off_or_in_binary_is_refused_with_its_line() {
    let headless = SEA_BIRD.replace("*END*\r\n", "");
    assert_says(&refusal(&headless), &["Sea-Bird", "'*END*'", "line 20"]);
    assert_says(&refusal(&SEA_BIRD.replace("= ascii", "= binary")), &["line 19", "ASCII output", "binary"]);
    let with_bytes = SEA_BIRD.replace("= ascii", "= binary") + "\0\0\u{1}";
    assert_says(&refusal(&with_bytes), &["line 19", "ASCII output", "binary"]);
    assert_says(&refusal(&SEA_BIRD.replace("# name", "# nome")), &["line 20", "the columns"]);
    assert_says(&refusal(&SEA_BIRD.replace("name 3", "name 7")), &["line 11", "in order", "name 7"]);
}

/// `separator` and `decimal` as the file header names them, the names and rows in that.
fn lab_view(
    x_columns: &str,
    separator: &str,
    sign: &str,
    names: &[&str],
    row: impl Fn(f64, f64, f64) -> String,
) -> String {
    let between = if separator == "Tab" { "\t" } else { "," };
    let line = |cells: &[&str]| cells.join(between) + "\r\n";
    let header = [
        line(&["LabVIEW Measurement", ""]),
        line(&["Writer_Version", "2"]),
        line(&["Reader_Version", "2"]),
        line(&["Separator", separator]),
        line(&["Decimal_Separator", sign]),
        line(&["Multi_Headings", "No"]),
        line(&["X_Columns", x_columns]),
        line(&["Time_Pref", "Relative"]),
        line(&["Date", "2026/01/31"]),
        line(&["Time", "12:00:00"]),
        "***End_of_Header***\r\n".into(),
        "\r\n".into(),
        line(&["Channels", "2"]),
        line(&["Samples", "10", "10"]),
        line(&["Date", "2026/01/31", "2026/01/31"]),
        line(&["Time", "12:00:00", "12:00:00"]),
        line(&["Y_Unit_Label", "deg C", "deg C"]),
        line(&["X_Dimension", "Time", "Time"]),
        line(&["X0", &format!("0{sign}0000000000000000E+0"), &format!("0{sign}0000000000000000E+0")]),
        line(&["Delta_X", &format!("0{sign}500000"), &format!("0{sign}500000")]),
        "***End_of_Header***\r\n".into(),
        line(names),
    ];
    header.concat() + &body(|t, a, b| row(t, a, b) + "\r")
}

#[test]
fn a_lab_view_measurement_is_read_by_its_headers() {
    let names = ["X_Value", "Fine", "Coarse", "Comment"];
    let tabs = lab_view("One", "Tab", ",", &names, |t, a, b| [comma(t), comma(a), comma(b)].join("\t"));
    let commas = lab_view("One", "Comma", ".", &names, |t, a, b| format!("{t:.6},{a:.6},{b:.6},"));
    let multi = ["X_Value", "Fine", "X_Value", "Coarse", "Comment"];
    let multi = lab_view("Multi", "Tab", ".", &multi, |t, a, b| format!("{t}\t{a}\t{t}\t{b}\t"));
    let none = lab_view("No", "Tab", ".", &names, |_, a, b| format!("\t{a}\t{b}"));
    for text in [&tabs, &commas, &multi, &none] {
        let got = record(text);
        assert_is_the_rig(&got, 0.0);
        assert_eq!(got.channels, ["Fine", "Coarse"]);
        assert!(notes(&got).contains("LabVIEW"), "{}", notes(&got));
    }
    assert!(notes(&record(&none)).contains("0.5 s per row as its header says"));
}

#[test]
fn comments_behind_rows_are_left_out() {
    let names = ["X_Value", "Fine", "Coarse", "Comment"];
    let text = lab_view("One", "Tab", ".", &names, |t, a, b| {
        format!("{t}\t{a}\t{b}\t{}", if t == 2.0 { "burner on" } else { "" })
    });
    assert_is_the_rig(&record(&text), 0.0);
}

#[test]
fn what_is_not_one_measurement_at_one_time_is_refused() {
    let names = ["X_Value", "Fine", "Coarse", "Comment"];
    let text = lab_view("One", "Tab", ".", &names, |t, a, b| format!("{t}\t{a}\t{b}"));
    let twice = text.clone() + text.split_once("***End_of_Header***\r\n\r\n").expect("two headers").1;
    assert_says(&refusal(&twice), &["line 33", "another measurement", "one header only"]);
    let apart = text.replace("Delta_X\t0.500000\t0.500000", "Delta_X\t0.500000\t0.100000");
    assert_says(&refusal(&apart), &["same X0 and Delta_X", "resample"]);
    let cut = text.split_once("Delta_X").expect("it has one").0;
    assert_says(&refusal(cut), &["LabVIEW", "the end of the file"]);
}

#[test]
fn a_serial_log_is_read_with_the_time_of_arrival() {
    let at = |t: f64| format!("12:00:{:02}.{:03}", t.floor(), (t.fract() * 1e3).round());
    let plain = body(|t, a, b| format!("{} -> {a},{b}", at(t)));
    let named = body(|t, a, b| format!("{} -> T1:{a},T2:{b}", at(t)));
    let boot = "11:59:59.100 -> ets Jul 29 2019, boot\n11:59:59.900 -> T1,T2\n".to_owned() + &plain;
    let dated = body(|t, a, b| format!("[2026-01-31 {}] {a} {b}", at(t)));
    for text in [&plain, &named, &boot, &dated] {
        let got = record(text);
        assert_is_the_rig(&got, 1e-12);
        assert_eq!(got.channels, ["T1", "T2"]);
    }
}

/// A line arrives some milliseconds after it was sent, now more and now fewer. Failed: three columns could be sensors.
#[test]
fn a_sketch_that_sends_its_own_milliseconds_has_its_own_time() {
    let arrival = |t: f64| format!("12:00:{:06.3}", t + 0.003 * (1.0 + (9.0 * t).sin()));
    let milliseconds = |t: f64| format!("{:.0}", 41_230.0 + 1e3 * t);
    let text = body(|t, a, b| format!("{} -> {},{a},{b}", arrival(t), milliseconds(t)));
    let got = record(&text);
    assert_is_the_rig(&got, 1e-12);
    assert!(got.notes.iter().any(|note| matches!(note, Note::TimeByClock { unit: "ms", .. })), "{:?}", got.notes);
    // So have one that sends seconds, and one whose counter of 32 bits begins anew.
    for own in
        [|t: f64| format!("{:.3}", 41.23 + t), |t: f64| ((4_294_966_296.0 + 1e3 * t) % 4_294_967_296.0).to_string()]
    {
        let got = record(&body(|t, a, b| format!("{} -> {},{a},{b}", arrival(t), own(t))));
        assert_is_the_rig(&got, 1e-12);
    }
    // A row number is neither a clock, though a fast logger writes 1000 rows a second, nor a sensor.
    let got = record(&body(|t, a, b| format!("{} -> {},{a},{b}", arrival(t / 500.0), 17.0 + 2.0 * t)));
    assert_eq!(got.channels, ["T1", "T2"]);
    assert!(!got.notes.iter().any(|note| matches!(note, Note::TimeByClock { .. })), "{:?}", got.notes);
    let three = body(|t, a, b| format!("{} -> {a},{b},{}", arrival(t), 20.0 + a.sin()));
    assert_says(&refusal(&three), &["3 columns without names may be sensors (1, 2, 3)"]);
    // A log that begins within a line lacks the milliseconds of this one: the times of arrival are there.
    let (first, rest) = text.split_once('\n').expect("several rows");
    let got = record(&format!("{}\n{rest}", &first[..first.rfind(',').expect("three cells")]));
    assert!(got.t1_c[0].is_nan() && got.notes.contains(&Note::CutRows { lines: 1, first_line: 1 }), "{:?}", got.notes);
    assert!((got.time_s[1] - 0.5).abs() < 0.006, "{:?}", got.time_s);
}

/// Failed: a column of stamps that is not used had lost the numbers it was asked for.
#[test]
fn stamps_that_are_missing_in_most_rows_show_no_unit() {
    let row = |k: u32, t: f64, a: f64, b: f64| {
        let stamp = if k.is_multiple_of(5) { format!("2026-01-31 12:00:{t:02.0}") } else { String::new() };
        format!("{:.0},{stamp},{a},{b}", 1000.0 + 20.0 * t)
    };
    assert_says(
        &refusal(&rows("time,gps,T1,T2", row)),
        &["'time' names no unit of time", "steps of 10 do not show which"],
    );
}

/// Whole seconds of a slow logger, which could be milliseconds of a fast one.
#[test]
fn stamps_show_that_a_counter_counts_seconds() {
    let at = |t: f64| format!("{:02}:{:02}:{:02}", (t / 3600.0) as u64, (t / 60.0) as u64 % 60, t as u64 % 60);
    let text = rows("elapsed,clock,T1,T2", |_, t, a, b| format!("{:.0},{},{a},{b}", 200.0 * t, at(200.0 * t)));
    let elapsed = Selection { time: Some(ColumnRef::Number(1)), ..Selection::default() };
    let got = record_with(text.as_bytes(), &elapsed).expect("stamps show the unit");
    assert!((got.sampling.period_s - 100.0).abs() < 1e-9, "{:?}", got.sampling);
    assert!(got.notes.iter().any(|note| matches!(note, Note::TimeByClock { unit: "s", .. })), "{:?}", got.notes);
    let bare = rows("time,T1,T2", |_, t, a, b| format!("{:.0},{a},{b}", 200.0 * t));
    assert_says(&refusal(&bare), &["column 1 'time'", "steps of 100 do not show which", "'time [ms]'"]);
}

/// Failed: no median of no steps.
#[test]
fn a_row_alone_is_too_short_and_no_clock() {
    assert_says(&refusal("time,T1,T2\n2026-01-31 12:00:00,20,21\n"), &["at least 8"]);
}

/// A sketch says that it has started, and of a sensor that did not answer.
#[test]
fn messages_of_a_serial_log_are_no_rows() {
    let rows = body(|t, a, b| format!("12:00:{t:06.3} -> {a:.2},{b:.2}"));
    let (first, rest) = rows.split_once('\n').expect("several rows");
    let (second, rest) = rest.split_once('\n').expect("several rows");
    let text = format!(
        "11:59:59.801 -> DS18B20 ready\n11:59:59.901 -> Locating devices...Found 2 devices.\n{first}\n12:00:00.700 -> sensor read error\n{second}\n12:00:01.300 -> wifi lost, retrying\n{rest}"
    );
    let [plain, noisy] = [rows.clone(), text].map(|text| record(&text));
    assert_eq!((&noisy.time_s, &noisy.t1_c, &noisy.t2_c), (&plain.time_s, &plain.t1_c, &plain.t2_c));
    let is_said = |record: &Record| record.notes.contains(&Note::Messages { lines: 2, first_line: 4 });
    assert!(is_said(&noisy) && !is_said(&plain), "{:?}", noisy.notes);
}

/// Bytes were lost on the line, and the log begins in the middle of one. Failed: the file was refused, as one with a decimal comma.
#[test]
fn what_is_left_of_a_line_of_a_serial_log_is_no_reading() {
    let rows = body(|t, a, b| format!("12:00:{t:06.3} -> {a:.2},{b:.2}"));
    let whole = record(&rows);
    let lines: Vec<&str> = rows.lines().collect();
    let cut = |index: usize| {
        let kept = &lines[index][..lines[index].find("-> ").expect("an arrow") + 5];
        let changed = lines.iter().enumerate().map(|(at, line)| if at == index { kept } else { line });
        changed.collect::<Vec<_>>().join("\n") + "\n"
    };
    for index in [0, 7] {
        let got = record(&cut(index));
        assert_eq!(got.time_s.len(), whole.time_s.len());
        assert!(got.t1_c[index].is_nan() && got.t2_c[index].is_nan(), "row {index}");
        assert_eq!(got.t1_c[index + 1], whole.t1_c[index + 1]);
        assert!(got.notes.contains(&Note::CutRows { lines: 1, first_line: index + 1 }), "{:?}", got.notes);
    }
}

#[test]
fn a_plotter_log_has_its_names_in_each_line() {
    let half = Selection { period_s: Some(0.5), ..Selection::default() };
    let named = body(|_, a, b| format!("T bare:{a},T sheathed:{b}"));
    let spaced = body(|_, a, b| format!("T bare: {a} C\tT sheathed: {b} C"));
    for text in [&named, &spaced] {
        let got = record_with(text.as_bytes(), &half).expect("names before numbers");
        assert_is_the_rig(&got, 0.0);
        assert_eq!(got.channels, ["T bare", "T sheathed"]);
        // A plotter has no time.
        assert_says(&refusal(text), &["no column is recognisably the time", "period"]);
    }
    let timed = body(|t, a, b| format!("ms:{},bare:{a},sheathed:{b}", t * 1e3));
    assert_is_the_rig(&record(&timed), 0.0);
    let table = Table::read(spaced.as_bytes(), "log").expect("text");
    assert_eq!(table.columns()[1].unit(), &Unit::Celsius);
}

#[test]
fn rows_that_arrive_later_are_unwrapped_as_well() {
    let start = body(|t, a, b| format!("ms:{},bare:{a},sheathed:{b}", t * 1e3));
    let table = Table::read(start.as_bytes(), "logger").expect("text");
    let mut rows = RowReader::after(&table, &Selection::default()).expect("clear columns");
    let row = rows.read("ms:5000,bare:22.5,sheathed:nan\n", 11).expect("a row").expect("no comment");
    assert_eq!((row.time_s, row.reading_c), (Some(5.0), [Some(22.5), None]));
    assert!(matches!(rows.read("sensor lost\n", 12), Err(RecordError::CellCount { line: 12, .. })));
}

#[test]
fn a_program_is_told_in_the_notes() {
    let table = Table::read((SEA_BIRD.to_owned() + &sea_bird_rows()).as_bytes(), "cast.cnv").expect("text");
    assert!(table.notes().iter().any(|note| note.to_string().contains(&Program::SeaBird.to_string())));
    let index = table.find(&ColumnRef::Name("t190C".into())).expect("by its short name");
    assert_eq!(table.columns()[index].unit(), &Unit::Celsius);
}

fn compressed(text: &str) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(text.as_bytes()).expect("memory");
    encoder.finish().expect("memory")
}

/// Whatever it is called; also of several parts, as loggers append them, and long ones.
#[test]
fn compressed_files_are_read_and_damaged_ones_refused() {
    let read = |bytes: &[u8]| Record::from_reader(bytes, crate::common::FILE, &Selection::default());
    let text = SEA_BIRD.to_owned() + &sea_bird_rows();
    let bytes = compressed(&text);
    let got = read(&bytes).expect("gzip");
    assert_is_the_rig(&got, 0.0);
    assert!(notes(&got).contains("gzip"), "{}", notes(&got));
    let (first, second) = text.split_at(text.len() / 2);
    assert_is_the_rig(&read(&[compressed(first), compressed(second)].concat()).expect("two parts"), 0.0);
    for end in [2, 9, bytes.len() / 2, bytes.len() - 1] {
        assert_says(&read(&bytes[..end]).expect_err("cut off").to_string(), &["gzip", "cut off"]);
    }
    let mut damaged = bytes.clone();
    let last = damaged.len() - 6;
    damaged[last] ^= 0x55;
    assert_says(&read(&damaged).expect_err("another checksum").to_string(), &["gzip", "damaged"]);
}
