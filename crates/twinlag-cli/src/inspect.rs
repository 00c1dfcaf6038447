//! `twinlag inspect FILE`: what is in a file, and how it would be read.

use schemars::JsonSchema;
use serde::Serialize;
use twinlag::record::{ColumnRef, Kind, Record, Sampling, Selection, Table};

use crate::arguments::Inspect;
use crate::columns::columns;
use crate::console::Console;
use crate::failure::Failure;
use crate::output;
use crate::print::{self, digits};
use crate::profile::Profile;
use crate::read::table_watched;
use crate::sparkline::sparkline;

/// What `twinlag inspect` prints with --json.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Inspection {
    /// `twinlag.inspection/1`.
    schema: &'static str,
    /// The file.
    file: String,
    /// Rows of the table.
    rows: usize,
    /// Columns of the table, from the left.
    columns: Vec<ColumnAbout>,
    /// How the file would be read; `null` where it is not clear which columns are meant.
    selection: Option<Selection>,
    /// What the record would be; `null` where the file cannot be read as it is.
    record: Option<RecordAbout>,
    /// Why the file cannot be read as it is; `null` where it can.
    problem: Option<String>,
    /// What was taken for what, and what was left out.
    notes: Vec<String>,
}

/// What is in a column.
#[derive(Debug, Serialize, JsonSchema)]
struct ColumnAbout {
    /// Its number, from 1.
    number: usize,
    /// Its name, without the unit.
    name: String,
    /// Its unit; empty if none is stated.
    unit: String,
    /// `numbers`, `dates or times`, `text` or `empty`.
    kind: &'static str,
    /// Cells without a value.
    missing: usize,
    /// The smallest of its numbers; `null` where it has none.
    minimum: Option<f64>,
    /// The largest of its numbers; `null` where it has none.
    maximum: Option<f64>,
    /// `time`, `T1`, `T2`, `reference`, `flow` or `position`.
    taken_as: Option<&'static str>,
    #[serde(skip)]
    course: String,
}

/// What the record would be.
#[derive(Debug, Serialize, JsonSchema)]
struct RecordAbout {
    /// Number of samples.
    samples: usize,
    /// From the first to the last sample, s.
    length_s: f64,
    /// How the stamps lie in time.
    sampling: Sampling,
    /// Rows in which a reading is missing.
    missing: usize,
    /// Stretches without a gap.
    stretches: usize,
}

pub(crate) fn run(command: &Inspect, console: Console) -> Result<u8, Failure> {
    let named = [("--save-profile", &command.save_profile), ("--picture", &command.picture)];
    let outputs: Vec<_> =
        named.iter().filter_map(|(option, path)| path.as_deref().map(|path| (*option, path))).collect();
    output::check(&command.file, &outputs, command.force)?;
    let profile = command.columns.profile()?;
    let said = &profile.selection;
    let table = table_watched(&command.file, &profile.choice(), console)?;
    let (file, rows) = (table.source().to_owned(), table.rows());
    let selection = table.resolved(said).ok();
    let about = about_columns(&table, selection.as_ref());
    let table_notes: Vec<String> = table.notes().iter().map(ToString::to_string).collect();
    // With the options of the caller: what is guessed is noted as such.
    let record = Record::from_owned(table, said);
    let (record, problem) = match record {
        Ok(record) => (Some(record), None),
        Err(error) => (None, Some(Failure::from(error))),
    };
    let answer = Inspection {
        schema: "twinlag.inspection/1",
        file,
        rows,
        columns: about,
        selection,
        record: record.as_ref().map(about_record),
        problem: problem.as_ref().map(ToString::to_string),
        notes: record.as_ref().map_or(table_notes, |record| print::notes_in_words(record).collect()),
    };
    if console.json {
        print::json(&answer)?;
    } else {
        let text = in_words(&answer);
        print::on_stdout(&text)?;
    }
    let Some(record) = record else {
        if let Some((option, _)) = outputs.first() {
            console.note(|| format!("note: {option} is left out: the file cannot be read as it is"));
        }
        return problem.map_or(Ok(3), |problem| Ok(problem.exit_code()));
    };
    if let (Some(path), Some(selection)) = (&command.save_profile, &answer.selection) {
        let profile = Profile { selection: selection.clone(), ..profile };
        output::write(path, profile.text()?)?;
    }
    if let Some(path) = &command.picture {
        output::write(path, twinlag_pages::readings_picture(&record)?)?;
    }
    Ok(0)
}

fn about_columns(table: &Table, selection: Option<&Selection>) -> Vec<ColumnAbout> {
    let taken = |wanted: &Option<ColumnRef>| wanted.as_ref().and_then(|wanted| table.find(wanted).ok());
    let roles = selection.map_or([None; 6], |selection| {
        let Selection { time, t1, t2, reference, flow, position, .. } = selection;
        [time, t1, t2, reference, flow, position].map(taken)
    });
    let names = ["time", "T1", "T2", "reference", "flow", "position"];
    let about = |(index, column): (usize, &twinlag::record::Column)| {
        let values = table.numbers(index).unwrap_or_default();
        let known = || values.iter().copied().filter(|value| value.is_finite());
        ColumnAbout {
            number: index + 1,
            name: column.name().to_owned(),
            unit: column.unit().to_string(),
            kind: match column.kind() {
                Kind::Number => "numbers",
                Kind::Stamp => "dates or times",
                Kind::Empty => "empty",
                _ => "text",
            },
            missing: column.missing(),
            minimum: known().reduce(f64::min),
            maximum: known().reduce(f64::max),
            taken_as: roles.iter().position(|role| *role == Some(index)).map(|role| names[role]),
            course: sparkline(values),
        }
    };
    table.columns().iter().enumerate().map(about).collect()
}

fn about_record(record: &Record) -> RecordAbout {
    RecordAbout {
        samples: record.len(),
        length_s: record.time_s.last().copied().unwrap_or(0.0),
        sampling: record.sampling,
        missing: record.missing,
        stretches: record.segments.len(),
    }
}

fn in_words(answer: &Inspection) -> String {
    let mut rows =
        vec![["", "name", "unit", "missing", "min", "max", "taken as", "course"].map(str::to_owned).to_vec()];
    for column in &answer.columns {
        let number = |value: Option<f64>| value.map_or(String::new(), |value| digits(value, 5));
        let ends = match column.kind {
            "numbers" => [number(column.minimum), number(column.maximum)],
            kind => [kind.to_owned(), String::new()],
        };
        let [from, to] = ends;
        rows.push(vec![
            column.number.to_string(),
            column.name.clone(),
            column.unit.clone(),
            column.missing.to_string(),
            from,
            to,
            column.taken_as.unwrap_or_default().to_owned(),
            column.course.clone(),
        ]);
    }
    let mut lines =
        vec![format!("{}: {} rows, {} columns", answer.file, answer.rows, answer.columns.len()), String::new()];
    lines.extend(columns(&rows, |column| ![0, 3, 4, 5].contains(&column)));
    lines.push(String::new());
    lines.extend(answer.notes.iter().map(|note| format!("note: {note}")));
    if let Some(record) = &answer.record {
        let RecordAbout { samples, length_s, sampling, missing, stretches } = record;
        lines.push(format!(
            "{samples} samples, one every {} s, {} s in all; {missing} with a temperature missing, {stretches} unbroken {}",
            digits(sampling.period_s, 4),
            digits(*length_s, 4),
            if *stretches == 1 { "stretch" } else { "stretches" },
        ));
    }
    if let Some(problem) = &answer.problem {
        lines.push(format!("cannot be read as it is: {problem}"));
    }
    lines.join("\n") + "\n"
}
