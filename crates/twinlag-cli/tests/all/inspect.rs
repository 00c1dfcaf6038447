//! What `twinlag inspect` shows of a file, and that a profile repeats it for other files.

use crate::common::{Bench, Trace};

/// Where the files of other programs' libraries lie.
const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../twinlag-files/tests/fixtures/");

/// A record whose columns have names that tell nothing, the first of which may be taken for the second's time.
fn unclear(test: &str) -> Bench {
    let lines = Trace::GOOD.lines();
    let rest = lines[1..].join("\n");
    Bench::with(test, "run.csv", format!("when [ms],probe a,probe b,probe c\n{}\n", with_a_third(&rest)))
}

/// The rows with times in ms, and the second temperature twice.
fn with_a_third(rows: &str) -> String {
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let time_ms = cells[0].parse::<f64>().expect("a time") * 1e3;
        format!("{time_ms},{},{},{}", cells[1], cells[2], cells[2])
    };
    rows.lines().map(row).collect::<Vec<_>>().join("\n")
}

#[test]
fn columns_are_listed_with_what_they_are_taken_for() {
    let bench = Bench::with("listed", "run.csv", Trace::GOOD.csv());
    let answer = bench.run(&["inspect", "run.csv", "--json"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    let value = answer.json();
    assert_eq!(value["schema"], "twinlag.inspection/1");
    let taken: Vec<_> = value["columns"].as_array().expect("a list").iter().map(|c| c["taken_as"].clone()).collect();
    assert_eq!(taken[..3], ["time", "T1", "T2"]);
    assert_eq!(value["record"]["stretches"], 1);
    assert!(value["problem"].is_null());
    let text = bench.run(&["inspect", "run.csv"]);
    assert!(text.stdout.contains('▁') && text.stdout.contains("taken as"), "{text:#?}");
}

#[test]
fn what_cannot_be_read_is_shown_with_the_reason() {
    let bench = unclear("unclear");
    let answer = bench.run(&["inspect", "run.csv", "--json", "--save-profile", "p.toml"]);
    assert_eq!(answer.code, 3, "{answer:#?}");
    let value = answer.json();
    assert!(value["selection"].is_null() && value["record"].is_null());
    let problem = value["problem"].as_str().expect("a reason");
    assert!(problem.contains("--t1"), "{problem}");
    assert_eq!(value["columns"][3]["name"], "probe c");
    assert!(!bench.has("p.toml"));
    answer.says(&["--save-profile is left out"]);
}

#[test]
fn a_profile_reads_other_files_in_the_same_way() {
    let bench = unclear("profile");
    let saved = bench.run(&["inspect", "run.csv", "--t1", "2", "--t2", "probe b", "--save-profile", "p.toml"]);
    assert_eq!(saved.code, 0, "{saved:#?}");
    let chosen = bench.characterise("run.csv", &["--t1", "probe a", "--t2", "probe b"]);
    let by_profile = bench.characterise("run.csv", &["--profile", "p.toml"]);
    assert_eq!(by_profile.json()["sensors"], chosen.json()["sensors"]);
    // An option goes before the profile.
    let exchanged = bench.characterise("run.csv", &["--profile", "p.toml", "--t1", "probe b", "--t2", "probe a"]);
    assert_eq!(exchanged.json()["sensors"][0]["channel"], "probe b");
    bench.refuses(
        2,
        &["inspect", "run.csv", "--t1", "2", "--t2", "3", "--save-profile", "p.toml"],
        &["p.toml", "--force"],
    );
    bench.write("q.toml", "t3 = 'x'\n");
    bench.refuses(3, &["characterise", "run.csv", "--profile", "q.toml"], &["q.toml", "t3", "--save-profile"]);
    bench.refuses(3, &["characterise", "run.csv", "--profile", "none.toml"], &["none.toml", "cannot be read"]);
}

#[test]
fn groups_of_a_binary_file_are_chosen_by_name() {
    let bench = Bench::with("groups", "run.mf4", std::fs::read(format!("{FIXTURES}groups.mf4")).expect("a fixture"));
    let answer = bench.run(&["inspect", "run.mf4", "--json"]);
    assert!(answer.json()["notes"].to_string().contains("MDF"), "{answer:#?}");
    bench.write("apart.mf4", std::fs::read(format!("{FIXTURES}apart.mf4")).expect("a fixture"));
    bench.refuses(3, &["inspect", "apart.mf4"], &["apart.mf4", "--group NAME"]);
    let joined = bench.run(&["inspect", "apart.mf4", "--join", "--json", "--save-profile", "p.toml"]);
    assert!(joined.json()["notes"].to_string().contains("interpolated"), "{joined:#?}");
    if joined.code == 0 {
        assert!(String::from_utf8(bench.read("p.toml")).expect("text").contains("join = true"));
    }
}

#[test]
fn readings_are_drawn() {
    let bench = Bench::with("drawn", "run.csv", Trace::GOOD.csv());
    let answer = bench.run(&["inspect", "run.csv", "--picture", "run.svg"]);
    assert_eq!(answer.code, 0, "{answer:#?}");
    assert!(bench.read("run.svg").starts_with(b"<svg"));
}
