//! Says what is understood of a file: `cargo run -p twinlag-record --example inspect -- FILE [T1 T2 [TIME]]`.

use std::process::ExitCode;

use twinlag_record::{ColumnRef, Record, RecordError, Selection, Table};

fn main() -> ExitCode {
    let mut words = std::env::args().skip(1);
    let Some(path) = words.next() else {
        eprintln!("usage: inspect FILE [T1 T2 [TIME]]");
        return ExitCode::from(2);
    };
    let mut column = || words.next().and_then(|word| word.parse::<ColumnRef>().ok());
    let selection = Selection { t1: column(), t2: column(), time: column(), ..Selection::default() };
    match inspect(&path, &selection) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(3)
        }
    }
}

fn inspect(path: &str, selection: &Selection) -> Result<(), RecordError> {
    let table = Table::from_path(path)?;
    println!("{path}: rows {}", table.rows());
    for (index, column) in table.columns().iter().enumerate() {
        let (name, unit, kind, missing) = (column.name(), column.unit(), column.kind(), column.missing());
        println!("  column {} '{name}': {kind:?}, {unit}, {missing} missing", index + 1);
    }
    let record = Record::from_table(&table, selection)?;
    for note in &record.notes {
        println!("  {note}");
    }
    let [t1, t2] = &record.channels;
    println!("  {t1} and {t2}: rows {}, segments {}", record.len(), record.segments.len());
    Ok(())
}
