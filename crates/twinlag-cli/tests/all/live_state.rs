//! `twinlag track --live ROWS --state JSON`: a run goes on from where another one was, to the same bytes.

use crate::common::{Answer, Bench};
use crate::live::record;

/// A run of `file` that writes `out` and keeps its state in `state.json`.
fn kept(bench: &Bench, file: &str, out: &str) -> Answer {
    bench.run(&["track", file, "--live", "1500", "--state", "state.json", "--out", out])
}

/// The rows of one run, and the lines of the record with their breaks.
fn whole(bench: &Bench, text: &str) -> (Vec<u8>, Vec<String>) {
    let answer = bench.run(&["track", "run.csv", "--live", "1500", "--out", "whole.csv"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    (bench.read("whole.csv"), text.split_inclusive('\n').map(str::to_owned).collect())
}

/// Once a logger is within a row: that one is left for the next run.
#[test]
fn what_a_file_has_gained_is_added() {
    let (bench, text) = record("grown");
    let (want, lines) = whole(&bench, &text);
    for (count, cut) in [(1800, 0), (1801, 0), (3000, 7), (3000, 0), (lines.len(), 0)] {
        let text = lines[..count].concat();
        bench.write("growing.csv", &text[..text.len() - cut]);
        let answer = kept(&bench, "growing.csv", "gas.csv");
        assert_eq!(answer.code, 0, "{answer:#?}");
        let rows = bench.read("gas.csv");
        let whole_lines = if cut > 0 { count - 1 } else { count };
        assert!(want.starts_with(&rows) && rows.split_inclusive(|b| *b == b'\n').count() == whole_lines, "{count}");
    }
    assert!(bench.read("gas.csv") == want);
    let idle = kept(&bench, "growing.csv", "gas.csv");
    idle.says(&["resumed at 49.99 s, as state.json has it"]);
    assert!(bench.read("gas.csv") == want);
}

/// The logger begins with its header again, and on another day with another file.
#[test]
fn a_logger_that_is_started_again_is_followed() {
    let (bench, text) = record("again");
    let (want, lines) = whole(&bench, &text);
    let parts = [lines[..2000].concat(), lines[0].clone() + &lines[2000..].concat()];
    let piped = ["track", "-", "--live", "1500", "--state", "pipe.json", "--out", "piped.csv"];
    for (day, part) in parts.iter().enumerate() {
        let answer = bench.run_with_input(&piped, part.as_bytes());
        assert_eq!((answer.code, answer.stderr.contains(": line ")), (0, false), "{answer:#?}");
        let file = format!("{day}.csv");
        bench.write(&file, part);
        assert_eq!(kept(&bench, &file, "gas.csv").code, 0);
    }
    assert!(bench.read("piped.csv") == want && bench.read("gas.csv") == want);
}

/// What is no state, or no longer one, is refused, and the rows that are there stay.
#[test]
fn what_is_no_state_is_refused() {
    let (bench, text) = record("damaged");
    let (_, lines) = whole(&bench, &text);
    bench.write("part.csv", lines[..2000].concat());
    assert_eq!(kept(&bench, "part.csv", "gas.csv").code, 0);
    let (state, rows) = (bench.read("state.json"), bench.read("gas.csv"));
    let mut changed = state.clone();
    *changed.last_mut().expect("text") = b' ';
    for damaged in [&changed[..], &state[..state.len() / 2], b"", text.as_bytes()] {
        bench.write("state.json", damaged);
        let answer = kept(&bench, "run.csv", "gas.csv");
        assert_eq!(answer.code, 3, "{answer:#?}");
        answer.says(&["state.json: tracking cannot go on from this state", "remove it"]);
        assert!(bench.read("gas.csv") == rows && bench.read("state.json") == damaged);
    }
    bench.write("state.json", &state);
    // Another file is not written over, and one that has lost rows is not added to.
    for (out, state, why) in [("whole.csv", "state.json", "--force"), ("state.json", "state.json", "--state")] {
        let answer = bench.run(&["track", "run.csv", "--live", "1500", "--state", state, "--out", out]);
        assert_eq!(answer.code, 2, "{answer:#?}");
        answer.says(&[why]);
    }
    bench.refuses(2, &["track", "run.csv", "--state", "state.json", "--out", "other.csv"], &["--live"]);
    bench.write("gas.csv", &rows[..rows.len() / 2]);
    let answer = kept(&bench, "part.csv", "gas.csv");
    assert_eq!(answer.code, 1, "{answer:#?}");
    answer.says(&["gas.csv: expected", "name another file for --out"]);
}

/// A sensor that gives no readings is named, once for each time that it fails.
#[test]
fn a_sensor_that_fails_is_named() {
    let (bench, text) = record("silent");
    let silent = |k: usize, line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let fails = [1700..1850, 1950..1980, 2000..2150, 3500..3700].iter().any(|rows| rows.contains(&k));
        if fails { format!("{},{},,{}\n", cells[0], cells[1], cells[3]) } else { format!("{line}\n") }
    };
    let text: String = text.lines().enumerate().map(|(k, line)| silent(k, line)).collect();
    let answer = bench.run_with_input(&["track", "-", "--live", "1500", "--out", "-"], text.as_bytes());
    assert_eq!(answer.code, 0, "{answer:#?}");
    let said = answer.stderr.matches("T2 has given no reading for 100 rows").count();
    assert_eq!(said, 2, "{}", answer.stderr);
    answer.says(&["at 17.9800 s T2", "at 35.9800 s T2"]);
}
