//! What is in a table, before anything is asked of it.

use twinlag_record::{Record, RecordError, Selection, Table};

use crate::answers::{InspectedRecord, Inspection};

/// Says what is in a table, and makes the record of it that the other verbs would be asked about.
///
/// - `selection`: what is known of the columns; the rest is guessed, and said
///
/// ```
/// use twinlag::inspect;
/// use twinlag::record::{Selection, Table};
///
/// let row = |k: i32| format!("{:.1},{},{},900\n", 0.1 * f64::from(k), 20 + k % 4, 20 + k % 3);
/// let log = "time (s),fine (°C),coarse (°C),rpm\n".to_owned() + &(0..10).map(row).collect::<String>();
/// let (found, record) = inspect(Table::from_reader(log.as_bytes(), "run.csv")?, &Selection::default());
/// let taken: Vec<_> = found.columns.iter().map(|column| column.taken_as).collect();
/// assert_eq!(taken, [Some("time"), Some("T1"), Some("T2"), None]);
/// assert_eq!(record?.channels, ["fine", "coarse"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn inspect(table: Table, selection: &Selection) -> (Inspection, Result<Record, RecordError>) {
    let resolved = table.resolved(selection).ok();
    let mut inspection = Inspection::of(&table, resolved);
    // With what the caller knows: what is guessed is noted as such.
    let record = Record::from_owned(table, selection);
    match &record {
        Ok(record) => {
            inspection.record = Some(InspectedRecord::of(record));
            inspection.notes = record.notes.iter().map(ToString::to_string).collect();
        }
        Err(error) => inspection.problem = Some(error.to_string()),
    }
    (inspection, record)
}
