//! Answers of a session are those of the library, whatever the files are.

use std::io::Write;
use std::ops::ControlFlow;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::Value;
use twinlag::record::{Record, Selection, Table};
use twinlag::{CompensateOptions, DiagnoseOptions, compensate, diagnose};
use twinlag_web::{Session, SessionError};

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

/// The first rows of the example.
fn example(rows: usize) -> Vec<u8> {
    let example = Session::example().expect("an example");
    example.lines().take(rows + 1).collect::<Vec<_>>().join("\n").into_bytes()
}

/// Enough for a diagnosis.
fn short() -> Vec<u8> {
    example(400)
}

fn unwatched(_: &str, _: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn a_session_diagnoses_as_the_library_does() {
    // Enough for a gas temperature.
    const ROWS: usize = 2500;
    let mut session = Session::default();
    let found = json(&session.add("run.csv", example(ROWS), "{}", None, false).expect("a table"));
    assert_eq!(found["record"]["samples"], ROWS);
    let answer = session.diagnose("{}", &unwatched).expect("an answer");
    let table = Table::from_reader(example(ROWS).as_slice(), "run.csv").expect("a table");
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    let wanted = diagnose(&record, &DiagnoseOptions::default()).expect("an answer");
    assert_eq!(answer, serde_json::to_string(&wanted).expect("JSON"));
    let report = session.report("2026-01-01").expect("a report");
    assert!(report.contains("run.csv") && report.contains("2026-01-01"));
    let model = session.model().expect("a model");
    assert_eq!(model, serde_json::to_string_pretty(&wanted.model()).expect("JSON"));

    session.compensate(&model, &unwatched).expect("an answer");
    let csv = session.gas_csv(example(ROWS));
    let csv = csv.expect("in order").expect("a gas temperature");
    let options = CompensateOptions { model: Some(wanted.model()), ..CompensateOptions::default() };
    let gas = compensate(&record, &options).expect("an answer");
    let last = gas.gas_c.last().expect("a gas temperature");
    assert_eq!((csv.lines().next(), csv.lines().count()), (Some("time_s,gas_C,gas_std_K,grade"), ROWS + 1));
    assert_eq!(csv.lines().last().and_then(|row| row.split(',').nth(1)?.parse().ok()), Some(*last));
    assert!(session.gas_report("").expect("a report").contains("run.csv"));
    // A new diagnosis is of no gas temperature yet.
    session.diagnose("{}", &unwatched).expect("an answer");
    assert!(matches!(session.gas_report(""), Err(SessionError::Order { .. })));
}

#[test]
fn what_is_known_is_of_the_first_and_second_sensor() {
    let mut session = Session::default();
    session.add("run.csv", short(), "{}", None, false).expect("a table");
    let answer = json(&session.diagnose("{\"known\": [\"T1=0.0238s\"]}", &unwatched).expect("an answer"));
    let of_first = |key: &str| answer["final"]["sensors"][0][key].clone();
    assert_eq!((of_first("time_constant_s"), of_first("known")), (Value::from(0.0238), Value::from(true)));
}

#[test]
fn what_gzip_has_compressed_is_the_same_record() {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(&short()).expect("in memory");
    let compressed = encoder.finish().expect("in memory");
    let samples = |bytes| {
        json(&Session::default().add("run.csv.gz", bytes, "{}", None, false).expect("a table"))["record"].clone()
    };
    assert_eq!(samples(compressed), samples(short()));
}

#[test]
fn groups_are_listed_chosen_and_joined() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../twinlag-files/tests/fixtures/apart.mf4");
    let bytes = std::fs::read(path).expect("a fixture");
    let groups = json(&Session::groups("apart.mf4", bytes.clone()).expect("groups"));
    assert_eq!((&groups[0][0], &groups[1][0]), (&Value::from("ECU1"), &Value::from("ECU2")));
    assert!(groups[0][1].as_str().is_some_and(|about| about.contains("40 rows")), "{groups}");
    let add = |group: Option<&str>, join| {
        Session::default().add("apart.mf4", bytes.clone(), "{}", group.map(str::to_owned), join)
    };
    assert!(add(None, false).is_err_and(|error| error.to_string().contains("choose one by its name")));
    let rows = |found: Result<String, SessionError>| json(&found.expect("a table"))["rows"].clone();
    assert_eq!((rows(add(Some("ECU1"), false)), rows(add(None, true))), (Value::from(40), Value::from(18)));
    assert_eq!(Session::groups("run.csv", short()).expect("no group"), "[]");
}

#[test]
fn what_comes_before_something_else_is_named() {
    let mut session = Session::default();
    let refused = |error: SessionError| error.to_string();
    assert_eq!(session.diagnose("{}", &unwatched).map_err(refused), Err("expected a record before this".to_owned()));
    assert_eq!(session.report("").map_err(refused), Err("expected a diagnosis before this".to_owned()));
    let csv = session.gas_csv(short());
    assert_eq!(csv.map_err(refused), Err("expected a gas temperature before this".to_owned()));
}

/// A file with other rows than the record is refused.
#[test]
fn stamps_of_the_file_stand_beside_its_gas_temperature() {
    const ROWS: usize = 2500;
    let example = String::from_utf8(example(ROWS)).expect("text");
    let stamped = |(row, line): (usize, &str)| {
        let readings = &line[line.find(',').expect("three columns")..];
        let since_ms = 2 * row.saturating_sub(1);
        let clock = format!("2026-05-01 10:00:{:02}.{:03}", since_ms / 1000, since_ms % 1000);
        if row == 0 { format!("when{readings}") } else { format!("{clock}{readings}") }
    };
    let file = example.lines().enumerate().map(stamped).collect::<Vec<_>>().join("\n").into_bytes();
    let mut session = Session::default();
    session.add("run.csv", file.clone(), "{}", None, false).expect("a table");
    session.diagnose("{}", &unwatched).expect("an answer");
    let model = session.model().expect("a model");
    session.compensate(&model, &unwatched).expect("an answer");
    let csv = session.gas_csv(file.clone());
    let csv = csv.expect("in order").expect("a gas temperature");
    assert_eq!(csv.lines().next(), Some("time_s,gas_C,gas_std_K,grade,when"));
    assert!(csv.lines().nth(101).is_some_and(|row| row.ends_with(",2026-05-01 10:00:00.200")));
    let shorter = file[..file.len() / 2].to_vec();
    assert!(session.gas_csv(shorter).is_err_and(|e| e.to_string().contains("2500")));
}

#[test]
fn a_file_without_a_record_is_inspected_and_not_added() {
    let mut session = Session::default();
    let found =
        json(&session.add("run.csv", b"time_s,a,b\n0,1,x\n1,2,y\n".to_vec(), "{}", None, false).expect("a table"));
    assert!(found["problem"].is_string() && found["record"].is_null(), "{found}");
    assert!(matches!(session.diagnose("{}", &unwatched), Err(SessionError::Order { .. })));
}
