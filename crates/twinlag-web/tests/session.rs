//! Answers of a session are those of the library, whatever the files are.

use std::io::Write;
use std::ops::ControlFlow;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::Value;
use twinlag::record::{Record, Selection, Table};
use twinlag::{DiagnoseOptions, diagnose};
use twinlag_web::{Session, SessionError};

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

/// A record of 400 rows: both sensors of the example, in one cycle of the gas.
fn short() -> Vec<u8> {
    let example = Session::example().expect("an example");
    example.lines().take(401).collect::<Vec<_>>().join("\n").into_bytes()
}

fn unwatched(_: &str, _: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn a_session_diagnoses_as_the_library_does() {
    let mut session = Session::default();
    let found = json(&session.add("run.csv", short(), "{}").expect("a table"));
    assert_eq!(found["record"]["samples"], 400);
    let answer = session.diagnose("{}", &unwatched).expect("an answer");
    let table = Table::from_reader(short().as_slice(), "run.csv").expect("a table");
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    let wanted = diagnose(&record, &DiagnoseOptions::default()).expect("an answer");
    assert_eq!(answer, serde_json::to_string(&wanted).expect("JSON"));
    let report = session.report("2026-01-01").expect("a report");
    assert!(report.contains("run.csv") && report.contains("2026-01-01"));
    assert_eq!(
        json(&session.model().expect("a model"))["schema"],
        json(&serde_json::to_string(&wanted.model()).expect("JSON"))["schema"]
    );
}

#[test]
fn what_gzip_has_compressed_is_the_same_record() {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(&short()).expect("in memory");
    let compressed = encoder.finish().expect("in memory");
    let samples = |bytes| json(&Session::default().add("run.csv.gz", bytes, "{}").expect("a table"))["record"].clone();
    assert_eq!(samples(compressed), samples(short()));
}

#[test]
fn what_comes_before_something_else_is_named() {
    let mut session = Session::default();
    let refused = |error: SessionError| error.to_string();
    assert_eq!(session.diagnose("{}", &unwatched).map_err(refused), Err("a record comes first".to_owned()));
    assert_eq!(session.report("").map_err(refused), Err("a diagnosis comes first".to_owned()));
    assert_eq!(session.gas_csv().map_err(refused), Err("a gas temperature comes first".to_owned()));
}

#[test]
fn a_file_without_a_record_is_inspected_and_not_added() {
    let mut session = Session::default();
    let found = json(&session.add("run.csv", b"time_s,a,b\n0,1,x\n1,2,y\n".to_vec(), "{}").expect("a table"));
    assert!(found["problem"].is_string() && found["record"].is_null(), "{found}");
    assert!(matches!(session.diagnose("{}", &unwatched), Err(SessionError::Order { .. })));
}
