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
/// let log = "time (s),fine (°C),coarse (°C),rpm\n0.0,20.0,20.0,900\n0.1,21.0,20.5,900\n0.2,22.5,21.0,901\n0.3,23.0,21.5,900\n";
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
