//! Type stubs of the compiled part of the Python package, from what it says of itself.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use pyo3_introspection::{introspect_cdylib, module_stub_files};

use super::step;
use crate::report::target_dir;
use crate::root;

/// The stubs, in the folder of the package.
const STUBS: &str = "python/twinlag/_core.pyi";
/// The module that they are of.
const MODULE: &str = "_core";

/// Writes the stubs of the package in `folder` anew.
pub(super) fn write(folder: &Path) -> Result<()> {
    let path = folder.join(STUBS);
    fs::write(&path, generated()?).with_context(|| format!("{} cannot be written", path.display()))
}

/// Fails where those of the package in `folder` are not what the compiled part says of itself.
pub(super) fn check(folder: &Path) -> Result<()> {
    let path = folder.join(STUBS);
    let kept = fs::read_to_string(&path).with_context(|| format!("{} cannot be read", path.display()))?;
    ensure!(
        kept == generated()?,
        "{} is of other sources: `cargo xtask python --stubs` writes it anew",
        path.display()
    );
    Ok(())
}

fn generated() -> Result<String> {
    let build = ["build", "--package", "twinlag-python", "--features", "stubs"];
    step("the compiled part, with what it says of itself", Command::new("cargo").args(build).current_dir(root()?))?;
    let library = target_dir()?.join("debug").join(format!("{DLL_PREFIX}{MODULE}{DLL_SUFFIX}"));
    let module = introspect_cdylib(&library, MODULE)?;
    let (_, text) =
        module_stub_files(&module).into_iter().next().context("the compiled part says nothing of itself")?;
    Ok(text)
}
