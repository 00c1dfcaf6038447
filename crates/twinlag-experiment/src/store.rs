//! The results of an experiment as files.

use std::fs;
use std::path::Path;

use crate::error::ExperimentError;
use crate::plan::Plan;
use crate::table::Table;

/// Writes `results.json`, `results.csv` and the plan's pictures and summaries into `folder`, which
/// is made if need be. Files of these names are replaced.
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
    put("results.json", table.to_json()?)?;
    put("results.csv", table.to_csv()?)?;
    plan.summaries.iter().try_for_each(|summary| put(&format!("{}.md", summary.file), summary.write(table)?))?;
    plan.pictures.iter().try_for_each(|picture| put(&format!("{}.svg", picture.file), picture.draw(table)?))
}
