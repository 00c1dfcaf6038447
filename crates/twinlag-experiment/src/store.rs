//! The results of an experiment as files.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use crate::error::ExperimentError;
use crate::plan::Plan;
use crate::table::Table;

/// Writes `results.csv`, the plan's pictures and summaries, and `results.json` into `folder`, which
/// is made if need be. Files of these names are replaced; `results.json` comes last and whole, so that where it is, all is.
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
    let text = table.to_json()?;
    let write = || {
        let new = |path: &Path| fs::File::options().write(true).create_new(true).open(path);
        let mut file = tempfile::Builder::new().prefix("results.json.tmp-").make_in(folder, new)?;
        file.write_all(text.as_bytes())?;
        file.as_file().sync_all()?;
        file.persist(&path)?;
        Ok(())
    };
    write().map_err(|e: std::io::Error| ExperimentError::Write { path: path.clone(), reason: e.to_string() })
}
