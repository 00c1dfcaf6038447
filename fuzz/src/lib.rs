//! What arbitrary bytes must not do to twinlag: end it, keep it busy, fill the memory, or make it give a number that is none.
//!
//! Each function here is a target: it takes bytes as a fuzzer makes them, and fails where a promise is broken. `tests/corpus.rs` puts
//! to it what is in `corpus/`, and files that the tree has for other tests, in every run of the tests. To search for more takes a nightly
//! toolchain and `cargo install cargo-fuzz`; a format is searched from files of its own:
//!
//! ```sh
//! cargo +nightly fuzz run --features libfuzzer text -- -max_len=4096 -timeout=10 -rss_limit_mb=2048
//! cargo +nightly fuzz run --features libfuzzer binary ../crates/twinlag-files/tests/fixtures
//! ```
//!
//! ```
//! twinlag_fuzz::text(b"time,T1,T2\n0,20,20\n0.1,NaN,21\n");
//! ```

#![expect(clippy::missing_panics_doc, reason = "a target panics where a promise is broken")]

use twinlag::record::{Channels, Record, SamplingChoice, Selection, Table};
use twinlag::signal::Rig;
use twinlag::{
    Characterisation, CompensateOptions, DiagnoseOptions, Model, Options, Status, characterise_with, inspect,
};
use twinlag_experiment::Plan;
use twinlag_files::{Choice, are_binary, contents_of_bytes, read_bytes};

/// Rows that a verb is given, at most.
const MAX_ROWS: usize = 200;
/// Integration steps of a rig that is simulated, at most: what a rig may ask for is a question of patience.
const MAX_STEPS: f64 = 1e5;
/// Samples of the records of a plan, at most: reading it simulates its gases.
const MAX_PLANNED_SAMPLES: i64 = 20_000;
/// Whole numbers are readings in hundredths of a kelvin.
const READING_STEP_K: f64 = 0.01;
const PERIOD_S: f64 = 0.01;

/// A table of any dialect of text, and the record that is guessed in it.
pub fn text(bytes: &[u8]) {
    if let Ok(table) = Table::from_reader(bytes, "fuzz.csv") {
        read(table);
    }
}

/// A file of any binary format, by its first bytes: what is in it, and the record that is guessed.
pub fn binary(bytes: &[u8]) {
    if !are_binary(bytes) {
        return;
    }
    let Ok(contents) = contents_of_bytes(bytes.to_vec(), "fuzz") else { return };
    let groups = contents.groups.into_iter().map(|group| Some(group.name));
    for group in groups.take(3).chain([None]) {
        if let Ok(table) = read_bytes(bytes.to_vec(), &Choice { group, ..Choice::default() }, "fuzz") {
            read(table);
        }
    }
}

/// The description of a rig, as TOML, and a record of it.
pub fn rig(bytes: &[u8]) {
    let Some(rig) = str::from_utf8(bytes).ok().and_then(|text| toml::from_str::<Rig>(text).ok()) else { return };
    if rig.steps() > MAX_STEPS {
        return;
    }
    if let Ok(simulated) = rig.simulate() {
        let all = [&simulated.time_s, &simulated.gas_c].into_iter().flatten();
        all.for_each(|value| assert!(value.is_finite(), "a simulation gives {value}"));
    }
}

/// The plan of a study, as TOML.
pub fn plan(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let is_long = text.parse::<toml::Table>().is_ok_and(|table| asks_for_much(&toml::Value::Table(table)));
    if !is_long {
        let _ = Plan::from_toml(text);
    }
}

/// Whether a plan asks for long records anywhere.
fn asks_for_much(value: &toml::Value) -> bool {
    let exceeds = |value: &toml::Value| match value {
        toml::Value::Array(all) => all.iter().any(|one| one.as_integer().is_some_and(|n| n > MAX_PLANNED_SAMPLES)),
        one => one.as_integer().is_some_and(|n| n > MAX_PLANNED_SAMPLES),
    };
    match value {
        toml::Value::Table(table) => {
            table.iter().any(|(key, value)| (key == "samples" && exceeds(value)) || asks_for_much(value))
        }
        toml::Value::Array(all) => all.iter().any(asks_for_much),
        _ => false,
    }
}

/// A profile: what is said of the columns of a file, as TOML and as JSON.
pub fn selection(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let by_toml = toml::from_str::<Selection>(text).ok();
    let by_json = serde_json::from_str::<Selection>(text).ok();
    for selection in [by_toml, by_json].into_iter().flatten() {
        let table =
            Table::from_reader(&b"time;a;b\n0;20;21\n0,1;20,5;21\n0,2;21;21\n"[..], "fuzz.csv").expect("a table");
        let _ = inspect(table, &selection);
    }
}

/// A model that is said to have been found, as JSON, with a record.
pub fn model(bytes: &[u8]) {
    let Ok(model) = serde_json::from_slice::<Model>(bytes) else { return };
    let wave = |delay: f64| (0..100).map(|k| 300.0 + 9.0 * (f64::from(k) * 0.7 - delay).sin().signum()).collect();
    if let Ok(answer) = characterise_with(&record_of(wave(0.0), wave(0.4)), &model, &Options::default()) {
        check(&answer);
    }
}

/// Readings, put to `characterise`.
pub fn characterise(bytes: &[u8]) {
    if let Some(Ok(answer)) = readings(bytes).map(|record| twinlag::characterise(&record, &Options::default())) {
        check(&answer);
    }
}

/// Readings, put to `diagnose`.
pub fn diagnose(bytes: &[u8]) {
    if let Some(Ok(answer)) = readings(bytes).map(|record| twinlag::diagnose(&record, &DiagnoseOptions::default())) {
        check(&answer.last);
    }
}

/// Readings, put to `compensate`.
pub fn compensate(bytes: &[u8]) {
    let answer = readings(bytes).map(|record| twinlag::compensate(&record, &CompensateOptions::default()));
    if let Some(Ok(answer)) = answer {
        check(&answer.last);
        if answer.status == Status::Ok {
            answer.gas_std_k.iter().for_each(|std_k| assert!(*std_k >= 0.0, "a standard deviation of {std_k} K"));
        }
    }
}

/// Reads the record of a table by guess, and holds it to what it promises.
fn read(table: Table) {
    let (inspection, record) = inspect(table, &Selection::default());
    serde_json::to_string(&inspection).expect("an inspection is JSON");
    let Ok(record) = record else { return };
    let is_in_order = record.time_s.windows(2).all(|pair| pair[0] < pair[1]);
    assert!(is_in_order, "time goes back: {:?}", record.time_s);
    let lengths = [record.t1_c.len(), record.t2_c.len()];
    assert_eq!(lengths, [record.time_s.len(); 2], "channels are as long as the time");
    let readings = record.t1_c.iter().chain(record.t2_c.iter());
    readings.for_each(|c| assert!(!c.is_infinite(), "a reading of {c}"));
}

/// The first byte says what the others are: whole numbers or doubles, evenly spaced or not.
fn readings(bytes: &[u8]) -> Option<Record> {
    let (kind, rest) = bytes.split_first()?;
    let whole = |two: &[u8]| READING_STEP_K * f64::from(i16::from_le_bytes([two[0], two[1]]));
    let double = |eight: &[u8]| f64::from_le_bytes(std::array::from_fn(|k| eight[k]));
    let values: Vec<f64> = match kind & 1 {
        0 => rest.chunks_exact(2).map(whole).collect(),
        _ => rest.chunks_exact(8).map(double).collect(),
    };
    let rows = values.len().min(2 * MAX_ROWS) / 2;
    let of = |sensor: usize| values.iter().skip(sensor).step_by(2).take(rows).copied().collect();
    let mut now_s = 0.0;
    let step = |row: usize| {
        now_s += PERIOD_S * if kind & 2 == 0 { 1.0 } else { 1.0 + f64::from(rest[row % rest.len()]) };
        now_s
    };
    let time_s = (0..rows).map(step).collect();
    Record::from_channels(channels(time_s, of(0), of(1)), SamplingChoice::Auto).ok()
}

fn record_of(t1_c: Vec<f64>, t2_c: Vec<f64>) -> Record {
    let time_s = (0..t1_c.len()).map(|k| PERIOD_S * k as f64).collect();
    Record::from_channels(channels(time_s, t1_c, t2_c), SamplingChoice::Auto).expect("a sound record")
}

fn channels(time_s: Vec<f64>, t1_c: Vec<f64>, t2_c: Vec<f64>) -> Channels {
    Channels { source: "fuzz".into(), names: ["T1", "T2"].map(String::from), time_s, t1_c, t2_c, reference_c: None }
}

/// A number that is given is one, and its interval holds it.
fn check(answer: &Characterisation) {
    for sensor in &answer.sensors {
        let (Some(tau_s), interval) = (sensor.time_constant_s, sensor.interval_95_s) else { continue };
        assert!(tau_s > 0.0 && tau_s.is_finite(), "a time constant of {tau_s} s");
        if let Some([low_s, high_s]) = interval {
            assert!(low_s <= tau_s && tau_s <= high_s, "{tau_s} s is outside [{low_s}, {high_s}]");
        }
    }
    serde_json::to_string(answer).expect("an answer is JSON");
}
