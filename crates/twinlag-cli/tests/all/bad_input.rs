//! What the program does with files, rigs and arguments that are wrong, hard or hopeless: the exit code, a message with
//! place, finding and remedy, and never a panic, a made-up number or two kinds of output on one stream.

use std::fmt::Write as _;

use crate::common::{Bench, Gas, Trace, csv, estimates, interval, number, recovers};

const GOOD_S: [f64; 2] = Trace::GOOD.tau_s;
const UNKNOWN: [&str; 2] = ["not-identifiable", "at-bound"];

/// A bench with a good record as `run.csv`.
fn good(test: &str) -> Bench {
    Bench::with(test, "run.csv", Trace::GOOD.csv())
}

/// A bench with `run.csv`, made of a good record's lines.
fn spoiled(test: &str, spoil: impl FnOnce(&mut Vec<String>)) -> Bench {
    let mut lines = Trace::GOOD.lines();
    spoil(&mut lines);
    Bench::with(test, "run.csv", lines.join("\n") + "\n")
}

/// Replaces the cell in line `line` and column `column`, both from 1.
fn set(lines: &mut [String], line: usize, column: usize, cell: &str) {
    let mut cells: Vec<&str> = lines[line - 1].split(',').collect();
    cells[column - 1] = cell;
    lines[line - 1] = cells.join(",");
}

fn set_all(lines: &mut [String], column: usize, cell: &str) {
    (2..=lines.len()).for_each(|line| set(lines, line, column, cell));
}

const FILE: [&str; 2] = ["characterise", "run.csv"];

// Files that are no table.

#[test]
fn an_empty_file_is_refused() {
    Bench::with("empty", "run.csv", "").refuses(3, &FILE, &["run.csv", "empty", "expected a header and rows"]);
}

#[test]
fn a_file_of_blank_lines_is_refused() {
    Bench::with("blank", "run.csv", "\n\n\r\n  \n").refuses(3, &FILE, &["run.csv", "expected"]);
}

#[test]
fn a_header_without_rows_is_refused() {
    Bench::with("header", "run.csv", "time_s,T1,T2\n").refuses(3, &FILE, &["run.csv", "no row of numbers", "logger"]);
}

#[test]
fn a_missing_file_is_refused() {
    Bench::new("missing").refuses(3, &FILE, &["run.csv", "cannot be read", "check the path"]);
}

#[test]
fn a_directory_is_refused() {
    Bench::new("directory").refuses(3, &["characterise", "."], &["directory", "expected a file", "name one file"]);
}

#[test]
fn a_binary_file_is_refused() {
    let bytes: Vec<u8> = (0..5000).map(|i| (i * 7 % 256) as u8).collect();
    Bench::with("binary", "run.csv", bytes).refuses(3, &FILE, &["run.csv", "not text", "offset 0", "export"]);
}

/// No zero byte gives it away: it is seen that there are no numbers.
#[test]
fn a_binary_file_without_zero_bytes_is_refused() {
    let bytes: Vec<u8> = (0..5000).map(|i| 128 + (i * 7 % 128) as u8).collect();
    Bench::with("binary_no_zero", "run.csv", bytes).refuses(3, &FILE, &["run.csv", "expected"]);
}

#[test]
fn utf_16_without_its_mark_is_refused_and_with_it_read() {
    let text = Trace::GOOD.csv();
    let bytes: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let bench = Bench::with("utf_16", "run.csv", &bytes);
    bench.refuses(3, &FILE, &["run.csv", "zero byte", "UTF-16", "byte-order mark"]);
    bench.write("marked.csv", [&[0xFF, 0xFE], &bytes[..]].concat());
    recovers(&bench.characterise("marked.csv", &[]).status(&["ok"]), GOOD_S);
}

#[test]
fn standard_input_without_a_table_is_refused_by_that_name() {
    let answer = Bench::new("empty_input").run_with_input(&["characterise", "-", "--json"], b"");
    assert_eq!((answer.code, answer.stdout.as_str()), (3, ""), "{answer:#?}");
    answer.says(&["standard input", "empty"]);
}

/// Failed: it was said to be no text.
#[test]
fn a_binary_file_is_read_from_standard_input() {
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/../twinlag-files/tests/fixtures/plain.mf4");
    let bytes = std::fs::read(fixture).expect("a committed fixture");
    let bench = Bench::with("binary_input", "plain.mf4", &bytes);
    let [file, input] =
        [bench.run(&["characterise", "plain.mf4"]), bench.run_with_input(&["characterise", "-"], &bytes)];
    assert_eq!((file.code, file.stderr), (input.code, input.stderr.replace("standard input", "plain.mf4")));
}

// Columns.

#[test]
fn one_column_is_refused() {
    let bench = spoiled("one_column", |lines| {
        for line in lines.iter_mut() {
            *line = line.split(',').nth(1).expect("three cells").to_owned();
        }
    });
    bench.refuses(3, &FILE, &["run.csv", "line 2:", "one column", "two temperatures", "side by side"]);
}

#[test]
fn a_channel_of_nothing_but_nan_is_refused() {
    let bench = spoiled("all_nan", |lines| set_all(lines, 3, "NaN"));
    let insist = ["characterise", "run.csv", "--t1", "T1", "--t2", "T2"];
    for arguments in [&FILE[..], &insist] {
        bench.refuses(3, arguments, &["run.csv", "column 3 'T2' has no value in any row", "is the sensor connected?"]);
    }
}

#[test]
fn equal_channels_are_refused() {
    let bench = spoiled("equal_channels", |lines| {
        for line in lines.iter_mut().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            *line = [cells[0], cells[1], cells[1]].join(",");
        }
    });
    bench.refuses(3, &FILE, &["run.csv", "2 'T1'", "3 'T2'", "the same in every sample", "choose two different"]);
}

#[test]
fn a_constant_channel_is_refused() {
    let bench = spoiled("constant", |lines| set_all(lines, 3, "20.5"));
    bench.refuses(3, &FILE, &["run.csv", "3 'T2'", "20.5 °C in every sample", "choose another column"]);
}

/// Failed: of readings of 1e-300 °C `diagnose` ended in a panic, and `characterise` asked for "at least one start".
#[test]
fn readings_too_small_to_square_are_refused() {
    let bench = spoiled("tiny", |lines| {
        for line in lines.iter_mut().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            *line = format!("{},{}e-300,{}e-300", cells[0], cells[1], cells[2]);
        }
    });
    for verb in ["characterise", "diagnose"] {
        bench.refuses(3, &[verb, "run.csv"], &["run.csv", "2 'T1'", "in every sample", "choose another column"]);
    }
}

#[test]
fn a_column_that_is_not_there_is_refused_with_those_that_are() {
    let bench = good("wrong_name");
    let want = ["run.csv", "no column 'fine'", "1 'time_s'", "2 'T1'", "3 'T2'", "choose by name or number"];
    bench.refuses(3, &["characterise", "run.csv", "--t1", "fine"], &want);
    bench.refuses(3, &["characterise", "run.csv", "--t2", "4"], &["no column '4'", "3 'T2'", "choose"]);
}

#[test]
fn one_column_for_both_sensors_is_wrong_usage() {
    let arguments = ["characterise", "run.csv", "--t1", "T1", "--t2", "2"];
    good("same_column").refuses(2, &arguments, &["2 'T1'", "twice", "must be different columns"]);
}

#[test]
fn a_sensor_as_its_own_reference_is_wrong_usage() {
    let arguments = ["characterise", "run.csv", "--t1", "T1", "--reference", "2"];
    let want = ["2 'T1'", "twice", "must be different columns", "cannot be its own reference", "--t1", "--reference"];
    good("own_reference").refuses(2, &arguments, &want);
}

#[test]
fn a_unit_that_is_no_temperature_is_refused() {
    let bench = spoiled("millivolt", |lines| lines[0] = "time_s,T1 [mV],T2 [mV]".to_owned());
    let insist = ["characterise", "run.csv", "--t1", "2", "--t2", "3"];
    for arguments in [&FILE[..], &insist] {
        let want = ["run.csv", "2 'T1 [mV]'", "'mV'", "expected a temperature", "K or °F", "convert"];
        bench.refuses(3, arguments, &want);
    }
}

#[test]
fn a_unit_that_is_no_time_is_refused() {
    let bench = spoiled("fortnight", |lines| lines[0] = "time [fortnight],T1,T2".to_owned());
    bench.refuses(3, &FILE, &["run.csv", "1 'time [fortnight]'", "expected a time", "convert"]);
}

// Cells and lines.

#[test]
fn text_in_a_number_column_is_refused_with_file_line_column_cell_and_remedy() {
    let bench = spoiled("text", |lines| set(lines, 57, 2, "brown"));
    let want =
        ["run.csv", "line 57", "column 2 'T1'", "expected a number", "found 'brown'", "mend the cell or empty it"];
    bench.refuses(3, &FILE, &want);
}

#[test]
fn decimal_commas_between_commas_are_refused() {
    let bench = spoiled("decimal_comma", |lines| lines.iter_mut().for_each(|line| *line = line.replace('.', ",")));
    let want = ["run.csv", "line 2", "6 comma-separated", "3 column names", "decimal", "export with semicolons"];
    bench.refuses(3, &FILE, &want);
}

#[test]
fn a_line_with_more_or_fewer_cells_is_refused() {
    let bench = spoiled("ragged", |lines| lines[100].push_str(",7"));
    bench.refuses(3, &FILE, &["run.csv", "line 101", "expected 3 cells", "found 4", "mend or remove"]);
    let bench = spoiled("ragged_less", |lines| lines[100] = "0.198,80.0".to_owned());
    bench.refuses(3, &FILE, &["run.csv", "line 101", "expected 3 cells", "found 2", "mend or remove"]);
}

#[test]
fn a_cut_last_line_is_noted_and_the_rest_answered() {
    let bench = spoiled("cut", |lines| *lines.last_mut().expect("2001 lines") = "3.998,10".to_owned());
    let answer = bench.characterise("run.csv", &[]);
    answer.says(&["last line 2001 is cut off (2 of 3 cells)", "left out"]);
    let value = answer.status(&["ok"]);
    assert_eq!(value["record"]["samples"], 1999);
    recovers(&value, GOOD_S);
}

#[test]
fn a_last_line_without_a_line_break_is_noted_and_read() {
    let answer = Bench::with("no_break", "run.csv", Trace::GOOD.csv().trim_end()).characterise("run.csv", &[]);
    answer.says(&["does not end with a line break", "the last number, on line 2001, may be cut off"]);
    let value = answer.status(&["ok"]);
    assert_eq!(value["record"]["samples"], 2000);
    recovers(&value, GOOD_S);
}

/// The header comes again after a file roll, and a third time right behind it.
#[test]
fn headers_after_a_file_roll_are_noted_and_left_out() {
    let bench = spoiled("roll", |lines| {
        let header = lines[0].clone();
        lines.splice(500..500, [header.clone(), header]);
    });
    let answer = bench.characterise("run.csv", &[]);
    answer.says(&["header comes again", "2 lines left out", "line 501"]);
    let value = answer.status(&["ok"]);
    assert_eq!(value["record"]["samples"], 2000);
    recovers(&value, GOOD_S);
}

#[test]
fn cells_that_say_infinite_are_masked_with_a_note_and_not_filled() {
    let bench = spoiled("infinite", |lines| {
        set(lines, 301, 2, "inf");
        set(lines, 302, 3, "-Infinity");
        set(lines, 900, 3, "OL");
    });
    let answer = bench.characterise("run.csv", &[]);
    answer.says(&["3 rows masked", "T1 in 1, T2 in 2", "none was filled"]);
    let value = answer.status(&["ok"]);
    assert_eq!(value["record"]["missing"], 3);
    recovers(&value, GOOD_S);
}

#[test]
fn temperatures_that_cannot_be_are_refused_with_place_and_value() {
    for (name, cell, shown) in [
        ("sentinel", "9999", "9999 °C"),
        ("overflow", "1e37", ": 1e37 °C"),
        ("beyond_double", "1e999", "'1e999' °C"),
        ("below_zero", "-273.2", "-273.2 °C"),
    ] {
        let bench = spoiled(name, |lines| set(lines, 57, 3, cell));
        let want = ["run.csv", "line 57", "column 3 'T2'", shown, "absolute zero", "5000 °C", "empty the cells"];
        bench.refuses(3, &FILE, &want);
    }
}

/// 300 K is possible, 300 °F is possible, 300 below zero in °C is not: the unit counts.
#[test]
fn the_range_is_that_of_the_unit() {
    let bench = spoiled("kelvin", |lines| {
        lines[0] = "time_s,T1 [K],T2 [K]".to_owned();
        set(lines, 57, 2, "-1");
    });
    bench.refuses(3, &FILE, &["line 57", "2 'T1 [K]'", "-1 K", "absolute zero"]);
}

// Time.

#[test]
fn time_that_runs_backwards_is_refused() {
    let bench = spoiled("reversed", |lines| lines[1..].reverse());
    // The numbers may be shown with their trailing zeros or without.
    let want = ["run.csv", "line 3", "time must increase", "'3.996", "follows '3.998", "sort the rows"];
    bench.refuses(3, &FILE, &want);
}

#[test]
fn a_repeated_time_is_refused() {
    let bench = spoiled("repeated", |lines| lines[40] = lines[39].clone());
    bench.refuses(3, &FILE, &["run.csv", "line 41", "time must increase", "follows '0.076", "remove repeated ones"]);
}

#[test]
fn a_missing_time_is_refused() {
    let bench = spoiled("no_stamp", |lines| set(lines, 41, 1, ""));
    bench.refuses(3, &FILE, &["run.csv", "line 41", "1 'time_s'", "time is missing", "mend or remove the row"]);
}

/// Half a second is lost. The stretches on either side are used, each with its own start.
#[test]
fn a_gap_is_noted_and_not_filled() {
    let mut rows = Trace::GOOD.rows();
    rows.iter_mut().skip(900).for_each(|row| row[0] += 0.5);
    let answer = Bench::with("gap", "run.csv", csv(&rows)).characterise("run.csv", &[]);
    answer.says(&["gap of 0.502", "line 902", "cut there, not filled"]);
    let value = answer.status(&["ok"]);
    assert_eq!((&value["record"]["segments"], &value["record"]["samples"]), (&2.into(), &2000.into()));
    recovers(&value, GOOD_S);
}

/// Steps between half and one and a half of the period, the gas constant over each: exact as stamped.
#[test]
fn irregular_steps_are_noted_and_used_as_stamped() {
    let text = Trace { jitter: 0.5, ..Trace::GOOD }.csv();
    let bench = Bench::with("irregular", "run.csv", text);
    let answer = bench.characterise("run.csv", &[]);
    answer.says(&["irregular", "as stamped", "nothing was resampled"]);
    let value = answer.status(&["ok"]);
    assert_eq!(value["record"]["sampling"]["kind"], "irregular");
    recovers(&value, GOOD_S);
    let text = bench.run(&["characterise", "run.csv", "--quiet"]).stdout;
    assert!(text.contains("run.csv: 2000 samples, ") && text.contains(" s apart on average\n"), "{text}");
}

#[test]
fn a_date_that_can_be_read_in_two_ways_is_refused() {
    let mut text = "date,T1,T2\n".to_owned();
    for (i, row) in Trace::GOOD.rows().iter().take(27).enumerate() {
        writeln!(text, "{:02}/{:02}/{},{:.3},{:.3}", 3 + i % 9, 4 + i % 9, 2024 + i / 9, row[1], row[2])
            .expect("a string takes it");
    }
    let want = ["run.csv", "line 2", "1 'date'", "'03/04/2024'", "day/month or month/day", "YYYY-MM-DD"];
    Bench::with("date", "run.csv", text).refuses(3, &FILE, &want);
}

#[test]
fn no_time_column_is_refused_and_a_period_mends_it() {
    let bench = spoiled("no_time", |lines| {
        for line in lines.iter_mut() {
            *line = line.split_once(',').expect("three cells").1.to_owned();
        }
    });
    bench.refuses(3, &FILE, &["run.csv", "no column is recognisably the time", "--time", "--period"]);
    recovers(&bench.characterise("run.csv", &["--period", "0.002"]).status(&["ok"]), GOOD_S);
}

#[test]
fn a_period_that_is_none_is_wrong_usage() {
    let bench = good("bad_period");
    for (argument, shown) in [("--period=0", "got 0 s"), ("--period=-1", "got -1 s"), ("--period=nan", "got nan s")] {
        bench.refuses(
            2,
            &["characterise", "run.csv", argument],
            &["period", "must be positive, from a nanosecond to a year", shown],
        );
    }
    bench.refuses(2, &["characterise", "run.csv", "--period", "soon"], &["soon", "--period"]);
}

#[test]
fn a_period_and_a_time_column_together_are_wrong_usage() {
    let arguments = ["characterise", "run.csv", "--time", "time_s", "--period", "0.002"];
    good("time_and_period").refuses(2, &arguments, &["1 'time_s'", "0.002 s", "give one of them"]);
}

// Arguments.

#[test]
fn noise_must_be_two_positive_numbers() {
    let bench = good("noise");
    for bad in ["-0.3,0.3", "0.3,-0.3", "0,0.3", "0.3", "0.3,0.3,0.3", "nan,0.3", "inf,0.3", "a,b", ""] {
        let argument = format!("--noise={bad}");
        let want = ["--noise", "expected two positive numbers S1,S2 in K", bad];
        bench.refuses(2, &["characterise", "run.csv", &argument], &want);
    }
}

#[test]
fn an_unknown_estimator_is_wrong_usage_and_the_known_ones_are_listed() {
    let want = ["--estimator", "\"magic\"", "whitened", "cross-relation", "bias-compensated", "normalised"];
    good("estimator").refuses(2, &["characterise", "run.csv", "--estimator", "magic"], &want);
}

#[test]
fn an_unknown_optimiser_is_wrong_usage_and_the_known_ones_are_listed() {
    let want = ["optimiser", "\"magic\"", "levenberg-marquardt", "nelder-mead", "l-bfgs"];
    good("optimiser").refuses(2, &["characterise", "run.csv", "--optimiser", "magic"], &want);
}

#[test]
fn nonsense_known_beforehand_is_wrong_usage() {
    let bench = good("known");
    let time = "expected a time in s, ms, us or min";
    let deviation = "expected a positive standard deviation";
    for (bad, expected) in [
        ("nonsense", "expected a name, =, and a value"),
        ("T1.time_constant_s", "expected a name, =, and a value"),
        ("T1.time_constant_s=", time),
        ("T1.time_constant_s=fast", time),
        ("T1.time_constant_s=0,02", "decimal point, no comma"),
        ("T1=20mm", time),
        ("T1.time_constant_s=-0.02", "expected a positive time constant"),
        ("T1=0s", "expected a positive time constant"),
        ("T1.time_constant_s=nan", time),
        ("T1.time_constant_s=0.02+-0", deviation),
        ("T1=20ms+-0%", deviation),
        ("T1.time_constant_s=0.02+-many", "expected a standard deviation, in per cent or as a time"),
        ("T3.time_constant_s=0.02", "T1, T2, gain, offset, T1.second, T2.second, or in full T1.time_constant_s"),
        ("gain=1K", "expected a number without a unit"),
        ("offset=1s", "expected a temperature difference in K"),
        ("offset=0+-5%", "expected a standard deviation in K"),
    ] {
        let want = ["--known", expected, "write NAME=VALUE, or NAME=VALUE+-SD, for example T1=0.5s+-20%", bad];
        bench.refuses(2, &["characterise", "run.csv", "--known", bad], &want);
    }
}

#[test]
fn nonsense_to_be_freed_is_wrong_usage() {
    let bench = good("free");
    for bad in ["slope", "gain,slope", "gain;offset"] {
        let want = ["--free", "expected gain, offset or gain,offset", bad.rsplit(',').next().expect("one at least")];
        bench.refuses(2, &["characterise", "run.csv", "--free", bad], &want);
    }
}

#[test]
fn discarding_more_than_there_is_is_refused() {
    let bench = good("discard");
    let arguments = ["characterise", "run.csv", "--estimator", "cross-relation", "--discard", "2000"];
    bench.refuses(
        3,
        &arguments,
        &["first 2000 samples", "longest unbroken stretch has 2000", "discard fewer", "--discard"],
    );
    bench.refuses(2, &["characterise", "run.csv", "--discard=-1"], &["--discard", "-1"]);
}

#[test]
fn what_needs_the_whitened_estimator_says_so() {
    let arguments = ["characterise", "run.csv", "--estimator", "normalised", "--known", "T1.time_constant_s=1+-0.1"];
    good("whitened_only").refuses(2, &arguments, &["--known", "whitened", "normalised", "--estimator"]);
}

#[test]
fn nonsense_for_a_second_lag_is_wrong_usage() {
    let bench = good("second_order");
    for bad in ["T3", "T1,T3", "1", "T1;T2"] {
        let want = ["--second-order", "expected T1, T2 or T1,T2", bad.rsplit(',').next().expect("one at least")];
        bench.refuses(2, &["characterise", "run.csv", "--second-order", bad], &want);
    }
    let known = ["--known", "T1.second_time_constant_s=0.01"];
    let both = [&FILE[..], &["--second-order", "T1"], &known].concat();
    bench.refuses(2, &both, &["--known", "T1.second_time_constant_s=0.01", "--second-order", "+-SD"]);
    let larger = [&FILE[..], &known, &["--known", "T1.time_constant_s=0.005"]].concat();
    bench.refuses(2, &larger, &["--known", "smaller one", "0.005", "0.01"]);
}

#[test]
fn nonsense_about_the_noise_is_wrong_usage() {
    let bench = good("noise_options");
    for bad in ["0", "-1", "nan", "inf", "two"] {
        bench.refuses(2, &["characterise", "run.csv", &format!("--noise-ratio={bad}")], &["--noise-ratio", bad]);
    }
    bench.refuses(
        2,
        &["characterise", "run.csv", "--noise-colour", "pink"],
        &["--noise-colour", "autoregressive", "pink"],
    );
    for bad in ["", "1", "2..1", "1..1", "a..b", "0..inf", "0-1"] {
        let want = ["--quiet-segment", "expected FROM..TO in seconds", bad];
        bench.refuses(2, &["characterise", "run.csv", &format!("--quiet-segment={bad}")], &want);
    }
    let want = ["quiet segment 5..6", "--quiet-segment", "ends at 3.998 s", "10 samples"];
    bench.refuses(2, &["characterise", "run.csv", "--quiet-segment", "5..6"], &want);
    bench.refuses(
        2,
        &["characterise", "run.csv", "--quiet-segment", "1..1.01"],
        &["quiet segment 1..1.01", "--quiet-segment", "10 samples"],
    );
    for (further, word) in [
        (["--noise-ratio", "1", "--noise", "1,1"], "--noise-ratio"),
        (["--noise-ratio", "1", "--quiet-segment", "0..1"], "--noise-ratio"),
        (["--noise-colour", "autoregressive", "--noise", "1,1"], "--noise-colour"),
        (["--noise-colour", "autoregressive", "--noise-ratio", "1"], "--noise-colour"),
    ] {
        bench.refuses(2, &[&FILE[..], &further].concat(), &[word, "expected"]);
    }
}

#[test]
fn nonsense_about_intervals_is_wrong_usage() {
    let bench = good("interval_options");
    let bootstrap = ["--intervals", "bootstrap"];
    bench.refuses(
        2,
        &[&FILE[..], &["--intervals", "magic"]].concat(),
        &["--intervals", "magic", "bootstrap", "profile"],
    );
    bench.refuses(2, &[&FILE[..], &["--replicates", "99"]].concat(), &["--replicates", "add --intervals bootstrap"]);
    bench.refuses(2, &[&FILE[..], &["--seed", "9"]].concat(), &["--seed", "add --intervals bootstrap"]);
    bench.refuses(
        2,
        &[&FILE[..], &bootstrap, &["--replicates", "9"]].concat(),
        &["--replicates", "at least 39", "\"9\""],
    );
    bench.refuses(
        2,
        &[&FILE[..], &bootstrap, &["--free", "gain"]].concat(),
        &["--intervals", "--free", "auto or profile"],
    );
    let known = ["--known", "T2.gain=1"];
    bench.refuses(2, &[&FILE[..], &bootstrap, &known].concat(), &["--intervals", "--known", "auto or profile"]);
    let profile = ["--intervals", "profile", "--estimator", "hybrid"];
    bench.refuses(2, &[&FILE[..], &profile].concat(), &["--intervals", "profile", "whitened", "hybrid"]);
}

#[test]
fn what_has_no_part_in_a_closed_form_is_wrong_usage() {
    let bench = good("closed_form");
    for (option, value) in [("--free", "gain"), ("--second-order", "T1"), ("--known", "T1.time_constant_s=0.02")] {
        for estimator in ["difference-equation-ls", "difference-equation-tls", "difference-equation-gtls"] {
            let arguments = ["characterise", "run.csv", "--estimator", estimator, option, value];
            bench.refuses(2, &arguments, &[option, estimator, "closed form", "leave it out"]);
        }
    }
}

#[test]
fn what_needs_even_sampling_says_so() {
    let bench = Bench::with("uneven", "run.csv", Trace { jitter: 0.3, ..Trace::GOOD }.csv());
    bench.refuses(3, &[&FILE[..], &["--estimator", "difference-equation-gtls"]].concat(), &["even"]);
    for further in
        [&["--intervals", "bootstrap"][..], &["--second-order", "T1,T2"], &["--noise-colour", "autoregressive"]]
    {
        bench.refuses(2, &[&FILE[..], further].concat(), &[further[0], "evenly spaced", "--sampling"]);
    }
}

#[test]
fn no_command_no_file_and_unknown_options_are_wrong_usage() {
    let bench = good("usage");
    for (arguments, word) in [
        (&[][..], "Usage"),
        (&["characterise"][..], "<FILE>"),
        (&["charakterise", "run.csv"][..], "characterise"),
        (&["characterise", "run.csv", "--gain"][..], "--gain"),
        (&["simulate", "rig.toml"][..], "--out"),
    ] {
        bench.refuses(2, arguments, &[word]);
    }
}

// Records that are sound, and what they cannot tell.

#[test]
fn three_samples_are_refused() {
    let bench = spoiled("three", |lines| lines.truncate(4));
    bench.refuses(3, &FILE, &["run.csv", "3 usable samples of 3 rows", "at least 8", "record for longer"]);
}

/// Eight samples pass the reader. They are 16 ms of a sensor of 117 ms: whatever is said, it is not `ok` with a slow sensor.
#[test]
fn the_fewest_samples_that_are_read_give_no_confident_answer() {
    let bench = spoiled("eight", |lines| lines.truncate(9));
    let answer = bench.characterise("run.csv", &[]);
    if answer.code == 3 {
        assert_eq!(answer.stdout, "", "{answer:#?}");
        answer.says(&["samples", "8"]);
    } else {
        answer.status(&["not-identifiable", "at-bound", "model-rejected"]);
    }
}

/// Nine readings: enough for a record, too few for an answer. Failed: the message did not say in which file.
#[test]
fn a_record_too_short_for_an_answer_is_named() {
    let bench = Bench::with("nine", "run.csv", Trace { samples: 9, ..Trace::GOOD }.csv());
    for command in
        [&["characterise", "run.csv"][..], &["diagnose", "run.csv"], &["track", "run.csv", "--out", "out.csv"]]
    {
        bench.refuses(3, command, &["run.csv: ", "got 9"]);
    }
    // Failed: with a model the file was not named.
    bench.write("good.csv", Trace::GOOD.csv());
    assert_eq!(bench.run(&["diagnose", "good.csv", "--save", "model.json"]).code, 0);
    bench.refuses(3, &["characterise", "run.csv", "--model", "model.json"], &["run.csv: ", "got 9"]);
}

/// The likelihood does not know which channel comes first, so the numbers are the same but for the order in which sums
/// are taken and where the optimiser stops (steps below 1e-9 of a parameter); 1e-6 is far above both.
#[test]
fn swapped_sensors_exchange_their_time_constants() {
    let rows = Trace::GOOD.rows();
    let bench = Bench::with("swapped", "run.csv", csv(&rows));
    bench.write("swapped.csv", csv(&rows.iter().map(|&[t, fast, slow]| [t, slow, fast]).collect::<Vec<_>>()));
    let [straight, swapped] = ["run.csv", "swapped.csv"].map(|file| bench.characterise(file, &[]).status(&["ok"]));
    recovers(&swapped, [GOOD_S[1], GOOD_S[0]]);
    let (straight_s, swapped_s) = (estimates(&straight), estimates(&swapped));
    for (a, b) in [(straight_s[0], swapped_s[1]), (straight_s[1], swapped_s[0])] {
        assert!((a.0 / b.0 - 1.0).abs() < 1e-6 && (a.1 / b.1 - 1.0).abs() < 1e-4, "{a:?} and {b:?}");
    }
    assert!(number(&swapped["time_constant_difference_s"]["value"]) < 0.0);
}

/// Two sensors of one time constant read the same but for noise, whatever that time constant is. Over twelve records the
/// 95 % interval of the difference, where there is one, may miss zero once or twice: four times is less than 1 in 400.
#[test]
fn equal_time_constants_are_not_determined_and_their_difference_is_about_zero() {
    let bench = Bench::new("equal_tau");
    let mut missed = 0;
    for seed in 0..12 {
        bench.write("run.csv", Trace { tau_s: [0.05, 0.05], seed, ..Trace::GOOD }.csv());
        let value = bench.characterise("run.csv", &[]).status(&UNKNOWN);
        // Failed: the difference was `go`, with a warning that nothing is determined.
        let (difference, grade) =
            (&value["time_constant_difference_s"]["value"], &value["time_constant_difference_s"]["grade"]);
        let is_said = value["warnings"].to_string().contains("nothing about the time constants is determined");
        assert!(!is_said || (difference.is_null() && grade == "no-go"), "{value:#}");
        let difference = &value["time_constant_difference_s"]["interval_95_s"];
        if !difference.is_null() {
            let [low, high] = interval(difference);
            missed += usize::from(low > 0.0 || high < 0.0);
        }
    }
    assert!(missed < 4, "{missed} of 12 intervals of the difference exclude zero, which is the truth");
}

/// Failed: windows of which none is determined were counted as an answer, a table of empty cells was written, and a report
/// of them could not be drawn (exit code 3).
#[test]
fn windows_that_determine_nothing_are_no_track() {
    let bench = Bench::with("equal_windows", "run.csv", Trace { tau_s: [0.05, 0.05], ..Trace::GOOD }.csv());
    let answer =
        bench.run(&["track", "run.csv", "--window", "2.5", "--out", "out.csv", "--report", "out.html", "--json"]);
    assert_eq!(answer.code, 4, "{answer:#?}");
    assert_eq!(answer.json()["status"], "not-identifiable");
    assert!(!bench.has("out.csv") && bench.has("out.html"));
}

/// One sine gives two numbers, the ratio of the amplitudes and the phase between them: enough for two time constants. Failed: with a
/// last period that is not whole nothing said that these two numbers satisfy the tone whatever two lags lack.
#[test]
fn a_single_tone_is_enough_for_two_time_constants_with_unit_gain() {
    let bench = Bench::with("tone", "run.csv", Trace { gas: Gas::Sine, ..Trace::GOOD }.csv());
    let value = bench.characterise("run.csv", &[]).status(&["ok"]);
    recovers(&value, GOOD_S);
    assert!(value["warnings"].to_string().contains("single tone"), "{value:#}");
    assert!((0..2).all(|i| value["sensors"][i]["grade"] == "conditional"), "{value:#}");
    let track = bench.run(&["track", "run.csv", "--out", "tau.csv", "--json"]);
    assert!(track.code == 4 && track.json()["grade"] == "no-go" && !bench.has("tau.csv"), "{track:#?}");
}

/// The first time constant is given twice as long as it is. Failed: held exactly nothing was said, and the second was given under the
/// condition that it is so.
#[test]
fn a_given_value_that_the_record_contradicts_is_said() {
    let bench = Bench::with("contradicted", "run.csv", Trace::GOOD.csv());
    for spread in ["", "+-5%"] {
        let answer =
            bench.run(&["characterise", "run.csv", "--json", "--known", &format!("T1={}s{spread}", 2.0 * GOOD_S[0])]);
        let value = answer.json();
        assert_eq!(answer.code, 4, "{value:#}");
        assert!(value["warnings"].to_string().contains("the record contradicts T1 = "), "{value:#}");
        assert!(value["sensors"][1]["time_constant_s"].is_null(), "{value:#}");
        assert!(value["sensors"][1]["because"].to_string().contains("the record contradicts T1 = "), "{value:#}");
    }
    let right = bench.characterise("run.csv", &["--known", &format!("T1={}s+-5%", GOOD_S[0])]).status(&["ok"]);
    assert!(!right["warnings"].to_string().contains("contradicts"), "{right:#}");
}

/// Failed: noise levels that are the gas's own left one bin of the spectrum above them, and `diagnose` refused the record as
/// a single tone.
#[test]
fn a_gas_that_is_rough_between_samples_is_no_single_tone() {
    let sensor = |name: &str, tau_s: f64| {
        format!("[[sensors]]\nchannel = \"{name}\"\ntime_constant_s = {tau_s}\nnoise = {{ std_k = 0.3 }}\n")
    };
    let gas = "seed = 1\n[record]\nsamples = 1500\nsample_period_s = 0.1\n[gas]\nkind = \"turbulence\"\nmean_c = 80.0\n\
               std_k = 30.0\ncorner_hz = 1.0\ncutoff_hz = 20.0\n";
    let bench = Bench::simulated("rough", &[gas, &sensor("T1", 0.005), &sensor("T2", 0.2)].concat());
    for command in ["characterise", "diagnose"] {
        let answer = bench.run(&[command, "run.csv", "--json"]);
        assert!(!answer.stdout.contains("single tone"), "{answer:#?}");
    }
}

/// ... and not for gain and offset besides. One of them alone is told by the mean, where the sensors are at rest.
#[test]
fn a_single_tone_is_not_enough_for_gain_and_offset_besides() {
    let bench = Bench::new("tone_free");
    for seed in 0..4 {
        bench.write("run.csv", Trace { gas: Gas::Sine, seed, ..Trace::GOOD }.csv());
        let value = bench.characterise("run.csv", &["--free", "gain,offset"]).status(&UNKNOWN);
        assert!(value["free"]["gain"].is_null() && value["free"]["offset_K"].is_null(), "{value:#}");
        for list in ["gain", "offset"] {
            recovers(&bench.characterise("run.csv", &["--free", list]).status(&["ok"]), GOOD_S);
        }
    }
}

/// Whether a 95 % interval misses, as far as one is stated.
fn misses(stated: &serde_json::Value, truth: f64) -> bool {
    !stated.is_null() && !(interval(stated)[0]..=interval(stated)[1]).contains(&truth)
}

/// Where an interval is stated, it holds. Of twenty records one may miss by chance; five do once in 400 times.
#[test]
fn intervals_of_a_single_tone_with_free_gain_hold() {
    let bench = Bench::new("tone_intervals");
    let missed = (0..20).filter(|&seed| {
        bench.write("run.csv", Trace { gas: Gas::Sine, seed, ..Trace::GOOD }.csv());
        let value = bench.characterise("run.csv", &["--free", "gain,offset"]).status(&UNKNOWN);
        (0..2).any(|i| misses(&value["sensors"][i]["interval_95_s"], GOOD_S[i]))
            || misses(&value["time_constant_difference_s"]["interval_95_s"], GOOD_S[1] - GOOD_S[0])
    });
    let missed = missed.count();
    assert!(missed < 5, "{missed} of 20 records have a 95 % interval without the truth");
}

/// Nothing happens but noise, the same or not in both channels: nothing is determined, so nothing is stated.
#[test]
fn white_noise_without_a_signal_determines_no_time_constant() {
    let bench = Bench::new("white");
    for seed in 0..6 {
        for noise_k in [[1.0, 1.0], [1.0, 3.0]] {
            bench.write("run.csv", Trace { gas: Gas::Still, noise_k, seed, ..Trace::GOOD }.csv());
            for further in [&[][..], &["--noise", "1,3"][..], &["--free", "gain,offset"][..]] {
                let value = bench.characterise("run.csv", further).json();
                // Noise levels that are false are seen in the residual; the status may then say so.
                assert_ne!(value["status"], "ok", "{further:?}: {value:#}");
                for sensor in value["sensors"].as_array().expect("two") {
                    if !sensor["interval_95_s"].is_null() {
                        let [low, high] = interval(&sensor["interval_95_s"]);
                        assert!(high / low > 5.0, "[{low}, {high}] of nothing but noise, {further:?}: {value:#}");
                    }
                }
            }
        }
    }
}

/// Fast sensor a twentieth of a sample period: nothing of it is seen; the other is two periods.
#[test]
fn a_sensor_far_faster_than_the_sampling_is_not_determined() {
    let bench = Bench::new("coarse");
    for seed in 0..6 {
        let trace = Trace { samples: 600, period_s: 0.1, tau_s: [0.005, 0.2], seed, ..Trace::GOOD };
        bench.write("run.csv", trace.csv());
        let value = bench.characterise("run.csv", &[]).status(&UNKNOWN);
        assert!(value["sensors"][0]["time_constant_s"].is_null(), "{value:#}");
        // Failed: a fit on a bound is no estimate, but its difference was given as one.
        let is_on_bound = !value["fit"]["end"]["on-bound"].is_null();
        assert!(!is_on_bound || value["time_constant_difference_s"]["value"].is_null(), "{value:#}");
    }
}

/// Failed: `characterise` and `diagnose` gave no difference of a fit on a bound, but the same fit of a given model did.
#[test]
fn a_difference_on_a_bound_is_given_by_no_command() {
    let rig = crate::common::RIG.replacen("time_constant_s = 0.12", "time_constant_s = 0.0006", 1);
    let bench = Bench::simulated("bound", &rig.replacen("offset_k = 2.0", "offset_k = 0.0", 1));
    let diagnosis = bench.run(&["diagnose", "run.csv", "--json", "--save", "model.json"]).json();
    let with_model = bench.run(&["characterise", "run.csv", "--json", "--model", "model.json"]).json();
    for fit in [&bench.characterise("run.csv", &[]).json(), &diagnosis["final"], &with_model] {
        assert!(!fit["fit"]["end"]["on-bound"].is_null(), "{fit:#}");
        assert!(fit["time_constant_difference_s"]["value"].is_null(), "{fit:#}");
        assert!(fit["not_identifiable"].to_string().contains("T1.time_constant_s"), "{fit:#}");
    }
}

/// Of twenty records one may miss by chance; five do once in 400 times. 195 ms is the truth.
#[test]
fn intervals_with_a_sensor_far_faster_than_the_sampling_hold() {
    let bench = Bench::new("coarse_intervals");
    let missed = (0..20).filter(|&seed| {
        let trace = Trace { samples: 600, period_s: 0.1, tau_s: [0.005, 0.2], seed, ..Trace::GOOD };
        bench.write("run.csv", trace.csv());
        misses(&bench.characterise("run.csv", &[]).json()["time_constant_difference_s"]["interval_95_s"], 0.195)
    });
    let missed = missed.count();
    assert!(missed < 5, "{missed} of 20 intervals of the difference miss it");
}

#[test]
fn both_sensors_far_faster_than_the_sampling_are_not_determined() {
    let trace = Trace { samples: 600, period_s: 0.1, tau_s: [0.005, 0.004], ..Trace::GOOD };
    Bench::with("coarse_both", "run.csv", trace.csv()).characterise("run.csv", &[]).status(&UNKNOWN);
}

/// Failed: the columns of time constants held nothing but dashes.
#[test]
fn the_table_of_records_has_noise_alone_where_no_time_constant_is_given() {
    let trace = Trace { samples: 600, period_s: 0.1, tau_s: [0.005, 0.004], ..Trace::GOOD };
    let bench = Bench::with("coarse_records", "one.csv", trace.csv());
    bench.write("two.csv", Trace { seed: trace.seed + 1, ..trace }.csv());
    let text = bench.run(&["characterise", "one.csv", "two.csv", "--quiet"]).stdout;
    let table =
        text.split_once("the noise of each record:\n").unwrap_or_else(|| panic!("no table of noise:\n{text}")).1;
    let mut rows = table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    assert_eq!(rows.next().expect("a header"), ["record", "noise", "of", "T1", "of", "T2"], "{text}");
    for file in ["one.csv", "two.csv"] {
        let row = rows.next().expect("a row for each record");
        // Its name, and two numbers with their unit.
        assert!(row[0] == file && row.len() == 5 && row[2] == "K" && row[4] == "K", "{text}");
    }
}

/// 3 K between the thermometers at rest, which two lags cannot explain: rejected, with the remedy that works.
#[test]
fn thermometers_that_disagree_at_rest_are_rejected_and_the_remedy_named_works() {
    let rows: Vec<_> = Trace::GOOD.rows().iter().map(|&[t, t1, t2]| [t, t1, 1.04 * t2 - 3.0]).collect();
    let bench = Bench::with("disagree", "run.csv", csv(&rows));
    let value = bench.characterise("run.csv", &[]).status(&["model-rejected", "not-identifiable"]);
    assert_eq!(value["advice"][0], "free", "{value:#}");
    let value = bench.characterise("run.csv", &["--free", "gain,offset"]).status(&["ok"]);
    recovers(&value, GOOD_S);
    for (name, want) in [("gain", 1.04), ("offset_K", -3.0)] {
        let (got, error) = (number(&value["free"][name]["value"]), number(&value["free"][name]["standard_error"]));
        // Four standard errors: by chance once in 16 000.
        assert!((got - want).abs() < 4.0 * error, "{name}: got {got} ± {error}, want {want}");
    }
}

#[test]
fn two_values_for_one_parameter_are_wrong_usage() {
    let known = ["--known", "T1.time_constant_s=0.0238", "--known", "T1.time_constant_s=0.5"];
    good("known_twice").refuses(2, &[&FILE[..], &known].concat(), &["T1.time_constant_s"]);
}

#[test]
fn a_gain_that_is_both_free_and_known_is_wrong_usage() {
    let arguments = ["characterise", "run.csv", "--free", "gain", "--known", "T2.gain=1.0"];
    good("free_and_known").refuses(2, &arguments, &["gain"]);
}

#[test]
fn negative_noise_without_the_equals_sign_says_what_is_expected() {
    good("noise_hyphen").refuses(
        2,
        &["characterise", "run.csv", "--noise", "-1,1"],
        &["expected two positive numbers"],
    );
}

// Rigs.

const RIG: &str = r#"seed = 1
[record]
samples = 500
sample_period_s = 0.002
[gas]
kind = "engine"
mean_c = 450.0
amplitude_k = 60.0
frequency_hz = 20.0
[[sensors]]
channel = "T1"
time_constant_s = 0.0238
noise = { std_k = 0.5 }
[[sensors]]
channel = "T2"
time_constant_s = 0.1168
noise = { std_k = 0.25 }
"#;

/// Asserts that the rig with `from` replaced by `to` is refused with these words, and no file is left behind.
fn refuses_rig(test: &str, from: &str, to: &str, words: &[&str]) {
    assert!(RIG.contains(from), "{from} is not in the rig");
    let bench = Bench::with(test, "rig.toml", RIG.replacen(from, to, 1));
    bench.refuses(3, &["simulate", "rig.toml", "--out", "out.csv"], &[&["rig.toml"], words].concat());
    assert!(!bench.has("out.csv"), "a refused rig leaves a file behind");
}

#[test]
fn a_rig_with_an_unknown_field_is_refused_with_the_known_ones() {
    refuses_rig("rig_field", "seed = 1", "seed = 1\ncolour = 3", &["line 2", "`colour`", "expected", "`seed`"]);
    refuses_rig("rig_gas_field", "amplitude_k", "amplitude", &["`amplitude`", "expected", "`amplitude_k`"]);
    refuses_rig("rig_sensor_field", "time_constant_s", "tau", &["`tau`", "expected", "`time_constant_s`"]);
}

#[test]
fn a_rig_with_a_negative_or_zero_time_constant_is_refused() {
    let want = ["sensors[0].time_constant_s must be finite and positive", "got -0.0238"];
    refuses_rig("rig_negative", "0.0238", "-0.0238", &want);
    refuses_rig("rig_zero", "0.1168", "0.0", &["sensors[1].time_constant_s must be finite and positive", "got 0"]);
}

#[test]
fn a_rig_with_a_missing_sensor_is_refused() {
    let second = &RIG[RIG.rfind("[[sensors]]").expect("two sensors")..];
    refuses_rig("rig_one_sensor", second, "", &["exactly two [[sensors]]", "got 1"]);
    refuses_rig("rig_three_sensors", second, &format!("{second}{second}"), &["exactly two [[sensors]]", "got 3"]);
}

#[test]
fn a_rig_with_a_number_that_is_none_is_refused() {
    refuses_rig("rig_nan", "450.0", "nan", &["gas.mean_c must be finite", "NaN"]);
    refuses_rig("rig_inf", "450.0", "inf", &["gas.mean_c must be finite", "inf"]);
    let want = ["sensors[1].noise.std_k must be finite and not negative", "NaN"];
    refuses_rig("rig_nan_noise", "0.25", "nan", &want);
    refuses_rig("rig_text", "500", "\"many\"", &["line 3", "\"many\""]);
}

#[test]
fn a_rig_that_is_no_toml_lacks_a_table_or_names_an_unknown_gas_is_refused() {
    refuses_rig("rig_syntax", "[gas]", "[gas", &["line 5", "expected"]);
    refuses_rig("rig_kind", "\"engine\"", "\"motor\"", &["`motor`", "expected", "`engine`", "`turbulence`"]);
    refuses_rig("rig_record", "samples = 500", "", &["line 2", "samples"]);
    refuses_rig("rig_same_name", "\"T2\"", "\"T1\"", &["channel", "must differ", "T1"]);
    refuses_rig("rig_huge", "500", "5000000000", &["steps are more than", "lower record.samples"]);
    refuses_rig("rig_one_sample", "500", "1", &["record.samples must be at least 2", "got 1"]);
    refuses_rig("rig_fast", "20.0", "20000.0", &["gas.frequency_hz", "raise record.oversampling"]);
}

#[test]
fn a_rig_that_is_not_there_or_not_text_is_refused() {
    let bench = Bench::with("rig_binary", "rig.toml", [0xFF, 0x00, 0xFE]);
    bench.refuses(3, &["simulate", "rig.toml", "--out", "out.csv"], &["rig.toml", "cannot be read", "UTF-8"]);
    bench.refuses(3, &["simulate", "nothing.toml", "--out", "out.csv"], &["nothing.toml", "cannot be read"]);
}

#[test]
fn an_existing_file_is_not_overwritten_unless_forced() {
    let bench = Bench::with("exists", "rig.toml", RIG);
    bench.write("out.csv", "precious");
    let arguments = ["simulate", "rig.toml", "--out", "out.csv"];
    bench.refuses(2, &arguments, &["out.csv exists", "choose another name", "--force"]);
    assert_eq!(bench.read("out.csv"), b"precious");
    let answer = bench.run(&[&arguments[..], &["--force"]].concat());
    assert_eq!((answer.code, answer.stdout.as_str()), (0, ""), "{answer:#?}");
    assert!(bench.read("out.csv").starts_with(b"time_s,T1,T2,Tref\n"));
    let onto_itself = ["simulate", "rig.toml", "--out", "./rig.toml", "--force"];
    bench.refuses(2, &onto_itself, &["./rig.toml", "is the rig itself", "another name"]);
    assert_eq!(bench.read("rig.toml"), RIG.as_bytes());
}

#[test]
fn what_depends_on_a_stream_is_not_planned() {
    let stream = "[stream]\nmean_m_per_s = 2.0\ndepth = 0.3\nperiod_s = 0.5\n[[sensors]]\ndownstream_m = 0.01";
    let bench = Bench::with("plan_stream", "rig.toml", RIG.replacen("[[sensors]]", stream, 1));
    bench.refuses(3, &["plan", "rig.toml"], &["sensors[0]", "velocity of the stream", "Take downstream_m"]);
}

#[test]
fn a_place_that_cannot_be_written_is_an_error_of_its_own_kind() {
    let bench = Bench::with("no_place", "rig.toml", RIG);
    bench.refuses(
        1,
        &["simulate", "rig.toml", "--out", "no/such/place.csv"],
        &["no/such/place.csv", "cannot be written"],
    );
}

#[test]
fn a_record_and_json_cannot_both_go_to_standard_output() {
    let bench = Bench::with("both", "rig.toml", RIG);
    bench.run(&["simulate", "rig.toml", "--out", "-", "--json"]).says(&["--out -", "--json", "name a file"]);
}

/// A logger that drops a value now and then leaves short stretches; together they tell as much as one long one.
#[test]
fn scattered_missing_values_do_not_spoil_a_record() {
    let mut lines = Trace::GOOD.lines();
    for line in lines.iter_mut().skip(1).step_by(25) {
        let cells: Vec<&str> = line.split(',').collect();
        *line = format!("{},,{}", cells[0], cells[2]);
    }
    let bench = Bench::with("dropouts", "run.csv", lines.join("\n") + "\n");
    recovers(&bench.characterise("run.csv", &[]).status(&["ok"]), GOOD_S);
}

/// Noise stated ten times too large leaves a white residual of a hundredth of the energy: the statement is at fault.
#[test]
fn a_false_noise_level_is_told_from_a_false_model() {
    let value = good("false_noise").characterise("run.csv", &["--noise", "3,3"]).status(&["model-rejected"]);
    assert_eq!(value["residual"]["white"], true, "{value:#}");
    assert!(value["warnings"].to_string().contains("noise levels given"), "{value:#}");
}

/// What the whitened estimate cannot tell, the others only seem to tell.
#[test]
fn no_estimator_makes_an_answer_of_white_noise() {
    let bench = Bench::new("white_published");
    for seed in 0..4 {
        bench.write("run.csv", Trace { gas: Gas::Still, noise_k: [1.0, 1.0], seed, ..Trace::GOOD }.csv());
        for estimator in ["cross-relation", "bias-compensated", "normalised", "hybrid", "difference-equation-gtls"] {
            bench.characterise("run.csv", &["--estimator", estimator]).status(&UNKNOWN);
        }
    }
}

#[test]
fn columns_that_are_not_clear_are_asked_for_in_the_words_of_the_program() {
    let bench = spoiled("unclear", |lines| {
        lines[0] = "time_s,TC1,TC2,TC3,TC4".to_owned();
        for line in &mut lines[1..] {
            let cells: Vec<&str> = line.split(',').collect();
            *line = [cells[0], cells[1], cells[2], cells[1], cells[2]].join(",");
        }
    });
    bench.refuses(3, &FILE, &["4 columns", "2 'TC1', 3 'TC2', 4 'TC3', 5 'TC4'", "(for example --t1 2 --t2 3)"]);
    let one = [&FILE[..], &["--t1", "TC4"]].concat();
    bench.refuses(3, &one, &["beside column 5 'TC4'", "(for example --t2 2)"]);
}

#[test]
fn a_folder_that_is_not_there_is_named() {
    let report = ["diagnose", "run.csv", "--report", "nowhere/run.html"];
    let want = ["nowhere/run.html", "there is no folder nowhere", "create it", "--report"];
    good("no_folder").refuses(1, &report, &want);
}

#[test]
fn a_period_of_nearly_nothing_is_wrong_usage() {
    let period = ["characterise", "run.csv", "--period", "1e-300"];
    good("period_of_nothing").refuses(2, &period, &["from a nanosecond to a year, got 1e-300 s", "--period"]);
}

#[test]
fn the_program_says_its_own_name() {
    let answer = Bench::new("version").run(&["--version"]);
    assert!(answer.code == 0 && answer.stdout.starts_with("twinlag 0."), "{answer:#?}");
}

/// The good record with its times times a factor, in whole numbers, under a header without a unit.
fn with_times(test: &str, time: impl Fn(f64) -> String) -> Bench {
    spoiled(test, |lines| {
        lines[0] = lines[0].replacen("time_s", "time", 1);
        for line in 2..=lines.len() {
            let stamp: f64 = lines[line - 1].split(',').next().and_then(|cell| cell.parse().ok()).expect("a time");
            set(lines, line, 1, &time(stamp));
        }
    })
}

#[test]
fn time_in_milliseconds_since_1970_is_recognised_and_a_counter_is_refused() {
    let epoch = with_times("epoch_ms", |s| format!("{}", 1_769_853_600_000_i64 + (1000.0 * s).round() as i64));
    let answer = epoch.run(&FILE);
    answer.says(&["column 1 'time' names no unit", "milliseconds since 1970", "(option --time-unit s)"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    let counter = with_times("counter_ms", |s| format!("{}", (1000.0 * s).round()));
    let unit = "(options --time-unit, --period)";
    counter.refuses(3, &FILE, &["column 1 'time' names no unit of time", "do not show", "'time [ms]'", unit]);
    let chosen = counter.run(&[&FILE[..], &["--time-unit", "ms", "--json"]].concat());
    assert!(chosen.stderr.contains("taken to be in ms, as chosen"), "{chosen:#?}");
    recovers(&chosen.json(), GOOD_S);
    counter.refuses(
        2,
        &[&FILE[..], &["--time-unit", "K"]].concat(),
        &["--time-unit", "expected s, ms, us, ns, min, h or d"],
    );
    // 100 s in seconds, 0.1 s in milliseconds and 0.1 ms in microseconds.
    let slow = with_times("counter_slow", |s| format!("{}", (5e4 * s).round()));
    slow.refuses(3, &FILE, &["column 1 'time' names no unit of time", "steps of 100 do not show", "'time [ms]'", unit]);
    let unclear = with_times("unclear_time", |s| format!("{}", (5e8 * s).round()));
    unclear.refuses(3, &FILE, &["column 1 'time' names no unit of time", "steps of 1000000", unit]);
}
