//! The results of an experiment as files.

use std::fs;
use std::path::Path;

use twinlag_study::replace_file;

use crate::error::ExperimentError;
use crate::plan::Plan;
use crate::table::Table;

/// Writes `results.csv`, the plan's pictures and summaries, and `results.json` into `folder`, which
/// is made if need be. Files of these names are replaced; `results.json` comes last and whole, so a folder that holds it holds everything.
///
/// # Errors
/// [`ExperimentError::Write`]; whatever keeps a picture from being drawn.
pub fn write(plan: &Plan, table: &Table, folder: &Path) -> Result<(), ExperimentError> {
    let put = |name: &str, text: String| {
        let path = folder.join(name);
        fs::write(&path, text).map_err(|e| ExperimentError::Write { path: path.clone(), reason: e.to_string() })
    };
    fs::create_dir_all(folder)
        .map_err(|e| ExperimentError::Write { path: folder.to_owned(), reason: e.to_string() })?;
    put("results.csv", table.to_csv()?)?;
    plan.summaries.iter().try_for_each(|summary| put(&format!("{}.md", summary.file), summary.write(table)?))?;
    plan.pictures.iter().try_for_each(|picture| put(&format!("{}.svg", picture.file), picture.draw(table)?))?;
    let path = folder.join("results.json");
    replace_file(&path, table.to_json()?.as_bytes()).map_err(|e| ExperimentError::Write { path, reason: e.to_string() })
}
