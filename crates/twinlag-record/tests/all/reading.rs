//! What loggers write is read, and what was made of it is said. The oracle is the numbers that the text was made from.

use crate::common::{assert_is_the_rig, assert_says, notes, plain, record, record_with, refusal, rows};
use twinlag_record::{Channels, ColumnRef, Kind, Note, Record, SamplingChoice, SamplingKind, Selection, Table};

fn comma(value: f64) -> String {
    format!("{value:.3}").replace('.', ",")
}

#[test]
fn every_delimiter_is_found() {
    for (d, header) in [(",", "time_s,T1,T2"), (";", "time_s;T1;T2"), ("\t", "time_s\tT1\tT2"), ("|", "time_s|T1|T2")] {
        assert_is_the_rig(&record(&rows(header, |_, t, a, b| format!("{t}{d}{a}{d}{b}"))), 0.0);
    }
    assert_is_the_rig(&record(&rows("  time_s   T1  T2", |_, t, a, b| format!("  {t}   {a}\t{b}"))), 0.0);
    assert_is_the_rig(&record(&rows("time (s)  T1 (degC)  T2 (degC)", |_, t, a, b| format!("{t} {a}  {b}"))), 0.0);
}

#[test]
fn decimal_commas_are_read_where_they_cannot_be_delimiters() {
    for d in [";", "\t", " "] {
        let header = format!("time_s{d}T1{d}T2");
        let got = record(&rows(&header, |_, t, a, b| format!("{}{d}{}{d}{}", comma(t), comma(a), comma(b))));
        assert_is_the_rig(&got, 0.0);
        assert!(notes(&got).contains("decimal comma"), "{}", notes(&got));
    }
    let quoted = rows("time_s,T1,T2", |_, t, a, b| format!("\"{}\",\"{}\",\"{}\"", comma(t), comma(a), comma(b)));
    assert_is_the_rig(&record(&quoted), 0.0);
}

#[test]
fn a_file_without_header_is_read_by_the_place_of_its_columns() {
    let text = plain();
    let body = text.split_once('\n').unwrap().1;
    let got = record(body);
    assert_is_the_rig(&got, 0.0);
    assert_eq!(got.channels, ["T1", "T2"]);
    assert!(notes(&got).contains("without column names"), "{}", notes(&got));
}

#[test]
fn preamble_unit_row_and_comments_are_not_taken_for_rows() {
    let preamble = "sep=;\nLogger: Xy 3000\nSerial;12;34\nRange;0;100\n\n# a comment; with; cells\n";
    let header = format!("{preamble}Zeit;T1;T2\n[s];[°C];[°C]\n// another");
    let got = record(&rows(&header, |_, t, a, b| format!("{};{};{}", comma(t), comma(a), comma(b))));
    assert_is_the_rig(&got, 0.0);
    assert!(notes(&got).contains("column names on line 7"), "{}", notes(&got));
}

#[test]
fn campbell_headers_are_read() {
    let header = "\"TOA5\",\"rig\",\"CR1000\"\n\"TIMESTAMP\",\"RECORD\",\"T1_Avg\",\"T2_Avg\"\n\
                  \"TS\",\"RN\",\"Deg C\",\"Deg C\"\n\"\",\"\",\"Avg\",\"Avg\"";
    let row = |k, t, a, b| format!("\"2026-01-31 10:00:{t:04.1}\",{k},{a},{b}");
    let got = record(&rows(header, row));
    assert_is_the_rig(&got, 0.0);
    assert_eq!(got.channels, ["T1_Avg", "T2_Avg"]);
}

/// Failed: of a row of units with a word such as `Volts` the names were made.
#[test]
fn campbell_headers_may_have_any_units() {
    let header = "\"TOA5\",\"CR1000X\",\"CR1000X\",\"2233\",\"CR1000X.Std.05\"\n\
                  \"TIMESTAMP\",\"RECORD\",\"TC_fine\",\"TC_coarse\",\"Batt_V\"\n\
                  \"TS\",\"RN\",\"Deg C\",\"Deg C\",\"Volts\"\n\"\",\"\",\"Smp\",\"Smp\",\"Smp\"";
    let got = record(&rows(header, |k, t, a, b| format!("\"2026-01-31 10:00:{t:04.1}\",{k},{a},{b},12.6")));
    assert_is_the_rig(&got, 0.0);
    assert_eq!(got.channels, ["TC_fine", "TC_coarse"]);
    assert!(!notes(&got).contains("names no unit"), "{}", notes(&got));
}

#[test]
fn a_commented_header_is_a_header() {
    let got = record(&rows("# time_s,T1,T2", |_, t, a, b| format!("{t},{a},{b}")));
    assert_is_the_rig(&got, 0.0);
    assert!(notes(&got).contains("column names on line 1"), "{}", notes(&got));
}

#[test]
fn units_in_headers_are_converted_and_said() {
    let kelvin = rows("t_min,T1_K,T2 [K]", |_, t, a, b| format!("{},{},{}", t / 60.0, a + 273.15, b + 273.15));
    let got = record(&kelvin);
    // One rounding to and one from kelvin, half a unit in the last place of 300 each: 6e-14.
    assert_is_the_rig(&got, 1e-13);
    assert!(notes(&got).contains("is in K, converted to °C"), "{}", notes(&got));
    let fahrenheit =
        rows("time [ms],temp_F,temp2 (°F)", |_, t, a, b| format!("{},{},{}", t * 1e3, a * 1.8 + 32.0, b * 1.8 + 32.0));
    assert_is_the_rig(&record(&fahrenheit), 1e-13);
}

#[test]
fn every_encoding_and_line_end_is_read() {
    let text = rows("time [s];T1 [°C];T2 [°C]", |_, t, a, b| format!("{t};{a};{b}"));
    let utf16: Vec<u16> = text.encode_utf16().collect();
    let little = [vec![0xFF, 0xFE], utf16.iter().flat_map(|unit| unit.to_le_bytes()).collect()].concat();
    let big = [vec![0xFE, 0xFF], utf16.iter().flat_map(|unit| unit.to_be_bytes()).collect()].concat();
    let western: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    let marked = [b"\xEF\xBB\xBF", text.as_bytes()].concat();
    let crlf = text.replace('\n', "\r\n").into_bytes();
    let cr = text.replace('\n', "\r").into_bytes();
    for bytes in [text.clone().into_bytes(), marked, little, big, western, crlf, cr] {
        assert_is_the_rig(&record_with(&bytes, &Selection::default()).unwrap(), 0.0);
    }
}

#[test]
fn quotes_trailing_delimiters_and_blank_lines_do_no_harm() {
    let trailing = |_, t, a, b| format!("\"{t}\";\"{a}\";{b};");
    assert_is_the_rig(&record(&(rows("time_s;T1;T2;", trailing) + "\n \n\n")), 0.0);
    assert_is_the_rig(&record(&rows("time_s;T1;T2", trailing)), 0.0);
}

#[test]
fn a_header_that_comes_again_is_left_out_with_a_note() {
    let text = plain();
    let (header, body) = text.split_once('\n').unwrap();
    let rolled = text.replace("\n2.5,", &format!("\n{header}\n2.5,"));
    assert!(body.contains("\n2.5,"));
    let got = record(&rolled);
    assert_is_the_rig(&got, 0.0);
    assert!(notes(&got).contains("1 line left out, line 7"), "{}", notes(&got));
}

#[test]
fn a_cut_off_last_line_is_left_out_with_a_note() {
    let got = record(&(plain() + "5,22"));
    assert_is_the_rig(&got, 0.0);
    assert!(notes(&got).contains("last line 12 is cut off (2 of 3 cells)"), "{}", notes(&got));
}

#[test]
fn a_last_row_without_a_line_break_is_read_with_a_note() {
    for text in [plain(), plain().replace('\n', "\r\n"), plain().replace('\n', "\r")] {
        assert!(!notes(&record(&text)).contains("line break"), "{text:?}");
        let got = record(text.trim_end());
        assert_is_the_rig(&got, 0.0);
        let note = "does not end with a line break, so the last number, on line 11, may be cut off";
        assert!(notes(&got).contains(note), "{}", notes(&got));
    }
    // Behind a comment the row is whole, also behind one that repeats it; a cut line is left out and has its own note.
    let last = plain().lines().last().unwrap().to_owned();
    for text in [plain() + "# end", plain() + "#" + &last, plain() + "5,22"] {
        assert!(!notes(&record(&text)).contains("line break"), "{text:?}");
    }
}

#[test]
fn words_for_missing_are_nan_and_counted_and_cut_the_record() {
    let words = ["", "NaN", "NA", "null", "---", "OL", "OPEN", "Over", "inf"];
    for word in words {
        let text = rows("time_s,T1,T2", |k, t, a, b| match k {
            4 => format!("{t},{word},{b}"),
            _ => format!("{t},{a},{b}"),
        });
        let got = record(&text);
        assert!(got.t1_c[4].is_nan() && !got.t2_c[4].is_nan(), "{word}");
        assert_eq!((got.missing, got.segments.clone()), (1, vec![0..4, 5..10]), "{word}");
        assert_eq!(Table::read(text.as_bytes(), "x").unwrap().columns()[1].missing(), 1);
        assert!(notes(&got).contains("1 row masked"), "{}", notes(&got));
    }
}

#[test]
fn a_text_column_harms_only_who_selects_it() {
    let text =
        rows("time_s,T1,T2,status", |k, t, a, b| format!("{t},{a},{b},{}", if k == 3 { "door open" } else { "OK" }));
    assert_is_the_rig(&record(&text), 0.0);
    assert_eq!(Table::read(text.as_bytes(), "x").unwrap().columns()[3].kind(), Kind::Text);
}

#[test]
fn every_way_to_write_the_time_gives_the_same_seconds() {
    type Way = fn(f64) -> String;
    let ways: [(&str, Way); 8] = [
        ("time", |t| format!("2026-01-31T10:00:{t:04.1}Z")),
        ("timestamp", |t| format!("2026-01-31 10:00:{t:04.1}")),
        ("Zeit", |t| format!("31.01.2026 10:00:{t:06.3}")),
        ("Date", |t| format!("01/31/2026 10:00:{t:04.1} AM")),
        ("Uhrzeit", |t| format!("10:00:{t:04.1}")),
        ("Date;Time", |t| format!("31.01.2026;10:00:{t:04.1}")),
        ("elapsed [us]", |t| format!("{}", t * 1e6)),
        ("time", |t| format!("{}", 1_700_000_000.0 + t)),
    ];
    for (header, way) in ways {
        let got = record(&rows(&format!("{header};T1;T2"), |_, t, a, b| format!("{};{a};{b}", way(t))));
        assert_is_the_rig(&got, 0.0);
    }
}

#[test]
fn time_of_day_goes_on_past_midnight() {
    let text = rows("time,T1,T2", |k, t, a, b| {
        let clock = if k < 4 { format!("23:59:{:04.1}", 58.0 + t) } else { format!("00:00:{:04.1}", t - 2.0) };
        format!("{clock},{a},{b}")
    });
    let got = record(&text);
    assert_is_the_rig(&got, 0.0);
    assert!(notes(&got).contains("midnight"), "{}", notes(&got));
}

#[test]
fn one_date_throughout_needs_no_order_of_day_and_month() {
    assert_is_the_rig(&record(&rows("time,T1,T2", |_, t, a, b| format!("03/04/2026 10:00:{t:04.1},{a},{b}"))), 0.0);
}

#[test]
fn a_period_stands_in_for_the_time_column() {
    let selection = Selection { period_s: Some(0.5), ..Selection::default() };
    for text in
        [rows("T1,T2", |_, _, a, b| format!("{a},{b}")), rows("sample,T1,T2", |k, _, a, b| format!("{k},{a},{b}"))]
    {
        let got = record_with(text.as_bytes(), &selection).unwrap();
        assert_is_the_rig(&got, 0.0);
        assert_eq!((got.sampling.period_s, got.sampling.stamp_resolution_s), (0.5, None));
    }
}

/// Ten rows half a second apart in the file: at that period nothing is said.
#[test]
fn a_period_that_contradicts_the_time_of_the_file_says_so() {
    let with = |period_s| {
        let selection = Selection { period_s: Some(period_s), ..Selection::default() };
        notes(&record_with(plain().as_bytes(), &selection).unwrap())
    };
    assert!(!with(0.5).contains("by column"), "{}", with(0.5));
    let said = with(0.25);
    assert!(
        said.contains("the rows take 2.25 s at the period of 0.25 s, which was taken, and 4.5 s by column"),
        "{said}"
    );
}

#[test]
fn columns_are_chosen_by_name_number_and_name_without_unit() {
    let text = rows("a [s],b [°C],3,c [°C]", |_, t, a, b| format!("{t},{a},{b},{}", a + b));
    for (time, t1, t2) in [("a [s]", "b [°C]", "3"), ("1", "2", "3"), ("A", "b", "3")] {
        let pick = |text: &str| Some(text.parse::<ColumnRef>().unwrap());
        let selection =
            Selection { time: pick(time), t1: pick(t1), t2: pick(t2), reference: pick("c"), ..Selection::default() };
        let got = record_with(text.as_bytes(), &selection).unwrap();
        assert_is_the_rig(&got, 0.0);
        assert_eq!(got.reference_c.as_ref().unwrap()[0], 40.0);
    }
}

#[test]
fn a_flow_is_read_as_it_stands_and_is_never_a_sensor() {
    let text =
        rows("time_s,a [°C],b [°C],t_density [°C]", |row, t, a, b| format!("{t},{a},{b},{}", 1.0 + f64::from(row)));
    let flow = Some("t_density".parse::<ColumnRef>().unwrap());
    let got = record_with(text.as_bytes(), &Selection { flow, ..Selection::default() }).unwrap();
    assert_is_the_rig(&got, 0.0);
    assert_eq!(got.flow.as_ref().unwrap()[..3], [1.0, 2.0, 3.0]);
}

/// What may be a velocity is said, unless a flow or a position is chosen.
#[test]
fn a_velocity_that_is_not_used_is_said() {
    let of = |name: &str, selection: &Selection| {
        let text = rows(&format!("time_s,T1,T2,{name}"), |row, t, a, b| format!("{t},{a},{b},{}", 1 + row));
        let record = record_with(text.as_bytes(), selection).expect("a record");
        notes(&record).contains(&format!("column 4 '{name}' is not used"))
    };
    for (name, is_said) in [
        ("U_m_s", true),
        ("velocity_m_s", true),
        ("wind speed", true),
        ("U [m/s]", true),
        ("fan speed [rpm]", false),
        ("pressure [Pa]", false),
        ("T3_C", false),
        ("flow_temp", false),
        ("wind_direction", false),
        ("force [kN]", false),
    ] {
        assert_eq!(of(name, &Selection::default()), is_said, "{name}");
        assert!(!of(name, &Selection { flow: name.parse().ok(), ..Selection::default() }), "{name}");
    }
}

#[test]
fn t1_and_t2_go_before_other_temperatures_and_a_reference_is_never_one() {
    let text = rows("time_s,Tref,T2_b_C,depth_m,T1_a_C,ambient_C", |_, t, a, b| format!("{t},9,{b},1,{a},8"));
    let got = record(&text);
    assert_is_the_rig(&got, 0.0);
    assert!(notes(&got).contains("T1 guessed to be column 5 'T1_a_C'"), "{}", notes(&got));
    assert_is_the_rig(
        &record(&rows("time_s,setpoint_C,Tref,fine_C,coarse_C", |_, t, a, b| format!("{t},9,8,{a},{b}"))),
        0.0,
    );
    // A name of temperatures as well.
    assert_is_the_rig(&record(&rows("time_s,Theta_1 [°C],Theta_2 [°C]", |_, t, a, b| format!("{t},{a},{b}"))), 0.0);
    assert_is_the_rig(
        &record(&rows("time_s,Dew Point [°C],fine_C,coarse_C", |_, t, a, b| format!("{t},7,{a},{b}"))),
        0.0,
    );
}

/// Failed: the index of a data frame was taken for seconds, also where the time stood beside it.
#[test]
fn a_column_that_counts_rows_is_no_time_without_a_name() {
    for name in ["", "Unnamed: 0", "n", "Messpunkt"] {
        for first in [0, 1] {
            let counted = rows(&format!("{name},T1,T2"), |k, _, a, b| format!("{},{a},{b}", k + first));
            assert_says(&refusal(&counted), &["no column is recognisably the time"]);
            let beside = rows(&format!("{name},Zeitpunkt,T1,T2"), |k, t, a, b| format!("{},{t},{a},{b}", k + first));
            assert_is_the_rig(&record(&beside), 0.0);
        }
    }
    let named = rows("time_s,T1,T2", |k, _, a, b| format!("{k},{a},{b}"));
    assert_eq!(record(&named).time_s[3], 3.0);
}

/// Rows a day apart, whichever of day and month comes first.
#[test]
fn dates_are_read_in_the_order_in_which_rows_follow_each_other() {
    let month_first = record(&rows("time,T1,T2", |k, _, a, b| format!("03/{:02}/2026 10:00:00,{a},{b}", k + 1)));
    let day_first = record(&rows("time,T1,T2", |k, _, a, b| format!("{:02}/03/2026 10:00:00,{a},{b}", k + 1)));
    for (got, first) in [(month_first, "month"), (day_first, "day")] {
        assert!((got.time_s[1] - 86_400.0).abs() < 1e-6);
        assert!(notes(&got).contains(&format!("have the {first} first")), "{}", notes(&got));
    }
}

/// Failed: whole seconds of a program of which several rows have the same, beside the time that the logger counts itself.
#[test]
fn stamps_that_repeat_leave_the_time_to_the_column_with_a_unit() {
    let text = rows("stamp,elapsed_s,T1,T2", |_, t, a, b| format!("2026-01-31 12:00:{:02.0},{t},{a},{b}", t.floor()));
    assert_is_the_rig(&record(&text), 0.0);
}

/// Clocks that differ as they may: a coarse one, one that counts something else, one that was moved, and a lag that grows.
#[test]
fn a_clock_that_differs_otherwise_than_by_a_unit_refuses_nothing() {
    let beside = |header: &str, cell: &dyn Fn(f64) -> String| {
        let text = (0..200)
            .map(|k| f64::from(k) * 0.5)
            .map(|t| format!("{t},{},{:.3},{:.3}\n", cell(t), 20.0 + (0.3 * t).sin(), 20.0 + (0.3 * t - 0.2).sin()))
            .collect::<Vec<_>>()
            .concat();
        record(&format!("{header},T1,T2\n{text}"))
    };
    for (header, cell) in [
        (
            "time_s,saved",
            &(|t: f64| format!("2026-01-31 10:{:02.0}", 30.0 + (t / 60.0).floor())) as &dyn Fn(f64) -> String,
        ),
        ("time_s,runtime_min", &|t| (t / 60.0).floor().to_string()),
        ("time_s,on_time_h", &|t| ((t / 360.0).floor() / 10.0).to_string()),
        ("time_s,exposure_ms", &|t| (5.0 + t / 40.0).to_string()),
        ("time_s,exposure_ms", &|t| (5.0 + t).to_string()),
        ("time_s,heater_on_s", &|t| (t / 3.0).to_string()),
        ("time_s,date", &|_| "2026-01-31".to_owned()),
        ("time_s,remaining_time_s", &|t| (99.5 - t).to_string()),
        ("elapsed_s,clock", &|t| {
            format!("{:02}:{:02}:{:04.1}", if t < 50.0 { 2 } else { 3 }, (t / 60.0) as u32, t % 60.0)
        }),
        ("time_s,elapsed_ms", &|t| if t > 99.0 { "1e999".to_owned() } else { (1e3 * t).to_string() }),
    ] {
        let got = beside(header, cell);
        assert!((got.time_s[1] - 0.5).abs() < 1e-12, "{header}: {:?}", got.time_s[1]);
    }
}

/// Failed: the depth of a cast at 1 m/s was the time, before its stamps.
#[test]
fn another_quantity_is_no_clock() {
    for name in ["depth", "position", "angle", "wind"] {
        let text =
            rows(&format!("stamp,{name},T1,T2"), |_, t, a, b| format!("2026-01-31 12:00:{t:04.1},{},{a},{b}", t + 3.0));
        assert_is_the_rig(&record(&text), 1e-9);
    }
}

/// A time of day with its half of the day or its zone has hours and minutes.
#[test]
fn half_days_and_zones_show_hours() {
    for end in [" AM", "Z", "+01:00"] {
        let got = record(&rows("time,T1,T2", |k, _, a, b| format!("9:{k:02}{end},{a},{b}")));
        assert!((got.time_s[1] - 60.0).abs() < 1e-9, "{end}");
    }
}

/// `millis()` of a board that has run for 49.7 days.
#[test]
fn a_counter_of_a_board_is_counted_on_where_it_begins_anew() {
    let wrapped = rows("millis,T1,T2", |k, _, a, b| {
        format!("{},{a},{b}", (4_294_967_296_u64 - 1700 + 500 * u64::from(k)) % 4_294_967_296)
    });
    let got = record(&wrapped);
    assert_is_the_rig(&got, 1e-12);
    assert!(notes(&got).contains("a counter of 32 bits, which begins anew 1 time"), "{}", notes(&got));
}

#[test]
fn a_gap_cuts_the_record_and_is_said_with_place_and_length() {
    let text = rows("time_s,T1,T2", |k, t, a, b| format!("{},{a},{b}", if k < 6 { t } else { t + 7.0 }));
    // Nine steps with one gap are more than one in twenty: the steps count as stamped, and 7.5 s is 15 of them.
    let got = record(&text);
    assert_eq!(got.segments, [0..6, 6..10]);
    assert!(notes(&got).contains("gap of 7.500000 s before line 8, from 2.5"), "{}", notes(&got));
}

#[test]
fn steps_are_the_period_if_even_and_as_stamped_if_not() {
    let even = record(&plain());
    assert_eq!(even.sampling.kind, SamplingKind::Uniform);
    assert_eq!(even.steps_s(&even.segments[0]), vec![0.5; 9]);
    let odd = record(&rows("time_s,T1,T2", |k, t, a, b| format!("{},{a},{b}", t + f64::from(k % 2) / 8.0)));
    assert_eq!(odd.sampling.kind, SamplingKind::Irregular);
    assert_eq!(odd.steps_s(&(0..4)), [0.625, 0.375, 0.625]);
    assert!(notes(&odd).contains("nothing was resampled"), "{}", notes(&odd));
}

#[test]
fn exactly_even_sampling_is_said_without_departures_and_with_few_digits() {
    let said = |period_s: f64| {
        let got = record(&rows("time_s,T1,T2", |k, _, a, b| format!("{:.6},{a},{b}", f64::from(k) * period_s)));
        notes(&got).lines().find(|note| note.starts_with("sampling")).expect("said").to_owned()
    };
    assert_eq!(said(0.002), "sampling uniform: period 0.002 s; nothing was resampled");
    assert_eq!(said(0.5), "sampling uniform: period 0.5 s; nothing was resampled");
    // Printed to the microsecond, 1/24 s departs by up to half of one: 1e-5 periods.
    let rounded = said(1.0 / 24.0);
    for want in ["period 0.04166", "stamps depart from even spacing by", "s rms", "stamp resolution 0.000001 s"] {
        assert!(rounded.contains(want), "no '{want}' in: {rounded}");
    }
    assert!(!rounded.contains("0.000e0"), "{rounded}");
}

#[test]
fn one_is_singular_and_two_are_plural_in_every_note() {
    let sentences = |n| {
        [
            Note::Masked { rows: n, t1: n, t2: 0 },
            Note::LoneRows { rows: n },
            Note::Midnight { times: n },
            Note::FurtherGaps { count: n, length_s: 7.5 },
            Note::RepeatedHeader { lines: n, first_line: 7 },
        ]
        .map(|note| note.to_string())
    };
    let one = [
        "1 row masked for a missing temperature (T1 in 1, T2 in 0); none was filled",
        "1 row stands alone between gaps or masked rows and is not used",
        "time of day passed midnight once and was continued",
        "1 further gap, of 7.500000 s",
        "the header comes again: 1 line left out, line 7",
    ];
    let two = [
        "2 rows masked for a missing temperature (T1 in 2, T2 in 0); none was filled",
        "2 rows stand alone between gaps or masked rows and are not used",
        "time of day passed midnight 2 times and was continued",
        "2 further gaps, together 7.500000 s",
        "the header comes again: 2 lines left out, the first is line 7",
    ];
    assert_eq!(sentences(1), one);
    assert_eq!(sentences(2), two);
}

#[test]
fn vectors_make_the_same_record_as_their_file() {
    let want = record(&plain());
    let channels = Channels {
        source: "vectors".to_owned(),
        names: ["T1", "T2"].map(str::to_owned),
        time_s: want.time_s.clone(),
        t1_c: want.t1_c.to_vec(),
        t2_c: want.t2_c.to_vec(),
        reference_c: None,
    };
    let got = Record::from_channels(channels, SamplingChoice::Auto).unwrap();
    assert_eq!((got.sampling, got.segments), (want.sampling, want.segments));
}

/// Failed: `min` below a name was always taken for a minimum, and time constants were 60 times too short where it means minutes.
#[test]
fn a_row_of_units_may_say_minutes() {
    for (units, period_s) in [("min,degF,degF", 6.0), ("Min,°C,°C", 6.0), ("min,,", 6.0), ("TS,Min,Min", 0.1)] {
        let rows = (0..50).map(|k| {
            let t = 0.1 * f64::from(k);
            format!("{t:.1},{:.3},{:.3}\n", 70.0 + t.sin(), 70.0 + (0.7 * t).cos())
        });
        let text = format!("Elapsed,Thin,Thick\n{units}\n{}", rows.collect::<String>());
        let table = Table::from_reader(text.as_bytes(), "run.csv").expect("a table");
        let record = Record::from_table(&table, &Selection::default()).expect("a record");
        assert!((record.sampling.period_s / period_s - 1.0).abs() < 1e-9, "{units}: {}", record.sampling.period_s);
    }
}
