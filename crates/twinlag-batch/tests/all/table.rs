//! The table as text and as Parquet has the same cells; what a run leaves behind is refused where it is not of this batch.

use std::fs::File;
use std::ops::ControlFlow;
use std::path::Path;

use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;
use serde_json::json;
use twinlag::Options as Question;
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag_batch::{
    Answer, BatchError, Begin, Fleet, Journal, Outcome, Row, Unit, Verb, each, is_of_batch, run, write_csv,
    write_parquet,
};

/// Two first-order lags of a pseudo-random gas that is constant from sample to sample, with noise of a tenth of a kelvin.
fn record(seed: u64) -> Record {
    let mut state = seed;
    let mut uniform = || {
        // Knuth's generator of 64 bits, its upper half.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    };
    let (mut gas, mut one, mut two) = (300.0, 300.0, 300.0);
    let rows: Vec<[f64; 2]> = (0..1500)
        .map(|_| {
            gas += 0.05 * (300.0 - gas) + 20.0 * uniform();
            one += (gas - one) * (1.0 - (-0.01_f64 / 0.12).exp());
            two += (gas - two) * (1.0 - (-0.01_f64 / 0.45).exp());
            [one + 0.35 * uniform(), two + 0.35 * uniform()]
        })
        .collect();
    let channels = Channels {
        source: format!("seed {seed}"),
        names: ["fine, bare", "coarse"].map(str::to_owned),
        time_s: (0..rows.len()).map(|k| 0.01 * k as f64).collect(),
        t1_c: rows.iter().map(|row| row[0]).collect(),
        t2_c: rows.iter().map(|row| row[1]).collect(),
        reference_c: None,
    };
    Record::from_channels(channels, SamplingChoice::Auto).expect("a good record")
}

/// A record by its seed; one is empty, and one makes the program fail.
fn rows_of(unit: &Unit) -> Vec<Row> {
    let file = &unit.files()[0];
    match file.to_str() {
        Some("empty") => vec![Row::without_answer(unit, file, Outcome::Unusable, "empty: 0 \"rows\", expected some")],
        Some("broken") => panic!("on purpose"),
        name => {
            let seed = name.and_then(|name| name.parse().ok()).expect("a number");
            let question = Question::default().free("gain").expect("a name");
            let answer = twinlag::characterise(&record(seed), &question).expect("can be asked");
            Row::of(unit, Outcome::Answered, &Answer::Characterisation(&answer))
        }
    }
}

fn units() -> Vec<Unit> {
    each(["1", "2", "broken", "empty"].map(Into::into).to_vec())
}

#[test]
fn text_and_parquet_have_the_same_cells() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut journal = Journal::open(&folder.path().join("journal"), &json!({}), Begin::Create).expect("a new one");
    run(&units(), &mut journal, None, rows_of, |_| ControlFlow::Continue(())).expect("can be written");
    let mut text = Vec::new();
    write_csv(&units(), &mut journal, Verb::Characterise, &mut text).expect("memory");
    let path = folder.path().join("table.parquet");
    let file = File::create(&path).expect("a file");
    write_parquet(&units(), &mut journal, Verb::Characterise, file).expect("can be written");

    let mut table = csv::Reader::from_reader(&text[..]);
    let header = table.headers().expect("a header").clone();
    assert!(header.iter().any(|name| name == "calibration_gain"));
    let parquet = SerializedFileReader::new(File::open(&path).expect("a file")).expect("Parquet");
    let rows = parquet.get_row_iter(None).expect("rows").map(|row| row.expect("a row"));
    let mut seen = 0;
    for (row, line) in rows.zip(table.records().map(|line| line.expect("a line"))) {
        let names: Vec<&String> = row.get_column_iter().map(|(name, _)| name).collect();
        assert_eq!(names, header.iter().collect::<Vec<_>>());
        for ((name, field), cell) in row.get_column_iter().zip(&line) {
            let same = match field {
                Field::Null => cell.is_empty(),
                Field::Str(text) => text == cell,
                Field::Long(count) => cell.parse() == Ok(*count),
                Field::Double(number) => cell.parse() == Ok(*number),
                Field::Bool(truth) => cell.parse() == Ok(*truth),
                other => panic!("{name}: a cell of another type: {other}"),
            };
            assert!(same, "{name}: {field} is not {cell}");
        }
        seen += 1;
    }
    assert_eq!(seen, 4);

    let fleet = Fleet::of(&units(), &mut journal).expect("can be read");
    let counts = fleet.units;
    assert_eq!((counts.answered, counts.unusable, counts.failed, counts.undetermined), (2, 1, 1, 0));
    assert_eq!((fleet.members.len(), fleet.unusable_files, fleet.reasons.len()), (2, 1, 2));
    assert!(fleet.reasons.iter().any(|reason| reason.reason.contains("on purpose") && reason.first == "broken"));
}

/// The metadata of the larger table in Parquet are longer than 64 KiB, in which a table was looked for once.
#[test]
fn a_table_is_known_whatever_its_length() {
    let folder = tempfile::tempdir().expect("a folder");
    let [csv, parquet, other] = ["table.csv", "table.parquet", "other"].map(|name| folder.path().join(name));
    for (count, name) in [(1, "short"), (12_000, "long")] {
        let units = each((0..count).map(|number| format!("{number}").into()).collect());
        let mut journal = Journal::open(&folder.path().join(name), &json!({}), Begin::Create).expect("a new one");
        let empty = |unit: &Unit| vec![Row::without_answer(unit, &unit.files()[0], Outcome::Unusable, "is empty")];
        run(&units, &mut journal, None, empty, |_| ControlFlow::Continue(())).expect("can be written");
        let create = |path: &Path| File::create(path).expect("a file");
        write_csv(&units, &mut journal, Verb::Diagnose, create(&csv)).expect("can be written");
        write_parquet(&units, &mut journal, Verb::Diagnose, create(&parquet)).expect("can be written");
        assert!(is_of_batch(&csv) && is_of_batch(&parquet), "{name}");
    }
    for text in ["level,rig", "PAR1 twinlag_batch"] {
        std::fs::write(&other, text).expect("can be written");
        assert!(!is_of_batch(&other), "{text}");
    }
}

#[test]
fn a_journal_that_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal");
    let open = |path: &Path, asked: i32, begin| Journal::open(path, &json!({"verb": asked, "known": {"T1": 1}}), begin);
    let first = open(&path, 1, Begin::Create).expect("a new one");
    assert!(matches!(open(&path, 1, Begin::Resume), Err(BatchError::Busy { .. })));
    drop(first);
    assert!(matches!(open(&path, 1, Begin::Create), Err(BatchError::Exists { .. })));
    let other = open(&path, 2, Begin::Resume).expect_err("another question");
    assert!(matches!(&other, BatchError::OtherQuestion { what, .. } if what == "verb"), "{other}");
    open(&path, 1, Begin::Resume).expect("the same question");
    let whole = Journal::open(&path, &json!("another"), Begin::Resume).expect_err("another question");
    assert!(whole.to_string().contains("it differs in the whole question"), "{whole}");
    // What is no journal is not replaced, whatever is asked.
    let notes = folder.path().join("notes");
    std::fs::write(&notes, "my notes\n").expect("can be written");
    for begin in [Begin::Resume, Begin::Replace] {
        assert!(matches!(open(&notes, 1, begin), Err(BatchError::NoJournal { .. })));
    }
    assert_eq!(std::fs::read_to_string(&notes).expect("is there"), "my notes\n");
}
