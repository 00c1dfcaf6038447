//! `twinlag inspect FILE`: what is in a file, and how it would be read.

use twinlag::{InspectedRecord, Inspection};

use crate::arguments::Inspect;
use crate::columns::columns;
use crate::console::Console;
use crate::failure::Failure;
use crate::output;
use crate::print::{self, digits};
use crate::profile::Profile;
use crate::read::table_watched;
use crate::sparkline::sparkline;

pub(crate) fn run(command: &Inspect, console: Console) -> Result<u8, Failure> {
    let named = [("--save-profile", &command.save_profile), ("--picture", &command.picture)];
    let outputs: Vec<_> =
        named.iter().filter_map(|(option, path)| path.as_deref().map(|path| (*option, path))).collect();
    output::check(&command.file, &outputs, command.force)?;
    let profile = command.columns.profile()?;
    let said = &profile.selection;
    let table = table_watched(&command.file, &profile.choice(), console)?;
    let course = |index| sparkline(table.numbers(index).unwrap_or_default());
    let courses: Vec<String> = (0..table.columns().len()).map(course).collect();
    let (mut answer, record) = twinlag::inspect(table, said);
    // With the options that say it otherwise.
    let (record, problem) = match record {
        Ok(record) => {
            answer.notes = print::notes_in_words(&record).collect();
            (Some(record), None)
        }
        Err(error) => (None, Some(Failure::from(error))),
    };
    answer.problem = problem.as_ref().map(ToString::to_string);
    if console.json {
        print::json(&answer)?;
    } else {
        let text = in_words(&answer, courses);
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

fn in_words(answer: &Inspection, courses: Vec<String>) -> String {
    let mut rows =
        vec![["", "name", "unit", "missing", "min", "max", "taken as", "course"].map(str::to_owned).to_vec()];
    for (column, course) in answer.columns.iter().zip(courses) {
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
            course,
        ]);
    }
    let mut lines =
        vec![format!("{}: {} rows, {} columns", answer.file, answer.rows, answer.columns.len()), String::new()];
    lines.extend(columns(&rows, |column| ![0, 3, 4, 5].contains(&column)));
    lines.push(String::new());
    lines.extend(answer.notes.iter().map(|note| format!("note: {note}")));
    if let Some(InspectedRecord { samples, length_s, sampling, missing, stretches, .. }) = &answer.record {
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
