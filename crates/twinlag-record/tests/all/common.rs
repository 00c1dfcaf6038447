//! What the tests share.

use twinlag_record::{Record, RecordError, Selection, Table};

pub(crate) const FILE: &str = "rig.csv";

pub(crate) fn record_with(bytes: &[u8], selection: &Selection) -> Result<Record, RecordError> {
    Record::from_table(&Table::read(bytes, FILE)?, selection)
}

pub(crate) fn record(text: &str) -> Record {
    record_with(text.as_bytes(), &Selection::default()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

pub(crate) fn refusal_with(bytes: &[u8], selection: &Selection) -> String {
    match record_with(bytes, selection) {
        Ok(record) => panic!("read, not refused: {:?}", record.notes),
        Err(error) => {
            let text = error.to_string();
            let is_option = |(at, _): (usize, &str)| text[at + 2..].starts_with(|c: char| c.is_ascii_alphabetic());
            assert!(!text.match_indices("--").any(is_option), "an option of a program in: {text}");
            text
        }
    }
}

pub(crate) fn refusal(text: &str) -> String {
    refusal_with(text.as_bytes(), &Selection::default())
}

/// The message names the file and each of these.
pub(crate) fn assert_says(message: &str, wanted: &[&str]) {
    assert!(message.contains(FILE), "no file name in: {message}");
    for want in wanted {
        assert!(message.contains(want), "'{want}' is not in: {message}");
    }
}

/// Header and ten rows: time `k · 0.5`, T1 `20 + k/4`, T2 `20 + k/8`, all exact in binary.
pub(crate) fn rows(header: &str, row: impl Fn(u32, f64, f64, f64) -> String) -> String {
    let rows = (0..10).map(|k| {
        let k64 = f64::from(k);
        row(k, k64 * 0.5, 20.0 + k64 / 4.0, 20.0 + k64 / 8.0) + "\n"
    });
    format!("{header}\n{}", rows.collect::<String>())
}

pub(crate) fn plain() -> String {
    rows("time_s,T1,T2", |_, t, a, b| format!("{t},{a},{b}"))
}

pub(crate) fn notes(record: &Record) -> String {
    record.notes.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// The record holds the numbers of [`rows`]; `tol` for converted ones.
pub(crate) fn assert_is_the_rig(record: &Record, tol: f64) {
    assert_eq!(record.len(), 10);
    for k in 0..10 {
        let x = k as f64;
        let want = [x * 0.5, 20.0 + x / 4.0, 20.0 + x / 8.0];
        let got = [record.time_s[k], record.t1_c[k], record.t2_c[k]];
        for (got, want) in got.into_iter().zip(want) {
            assert!((got - want).abs() <= tol, "row {k}: got {got}, want {want} ± {tol}");
        }
    }
}
