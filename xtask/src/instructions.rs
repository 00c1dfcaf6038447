//! The program on this processor and on an older one, by an emulator: transforms choose their instructions by what the processor has, and
//! round differently.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::Value;

use crate::report::target_dir;
use crate::{fleet, root};

/// The emulator of single programs.
pub(crate) const EMULATOR: &str = "qemu-x86_64";
/// Records that are compared, and rows of each; chosen, for some minutes in the emulator.
const FILES: usize = 6;
const ROWS: usize = 2000;
/// The largest difference that is let pass, in standard errors of a time constant or standard deviations of a gas temperature: a thousandth, where
/// a fit itself ends.
const MAX_DIFFERENCE: f64 = 1e-3;

#[derive(Args)]
pub(crate) struct Instructions {
    /// The processor to be compared with, by its name in the emulator: Nehalem has SSE 4.2, and no AVX.
    #[arg(long, default_value = "Nehalem")]
    cpu: String,
    /// The program to run; by default that of the last build in release.
    #[arg(long)]
    program: Option<PathBuf>,
}

impl Default for Instructions {
    fn default() -> Self {
        Self { cpu: "Nehalem".into(), program: None }
    }
}

pub(crate) fn run(instructions: &Instructions) -> Result<()> {
    let folder = root()?.join("target/instructions");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    let program = instructions.program.clone().map_or_else(|| Ok(target_dir()?.join("release/twinlag")), anyhow::Ok)?;
    let program = program.canonicalize().with_context(|| format!("{}: build it first", program.display()))?;
    fleet::make(&folder, FILES, ROWS)?;
    let mut largest: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
    for file in 0..FILES {
        let record = folder.join(format!("rig-0000/run-{file:02}.csv"));
        for verb in ["characterise", "diagnose", "compensate"] {
            let here = answer(Command::new(&program), verb, &record)?;
            let mut emulated = Command::new(EMULATOR);
            emulated.args(["-cpu", &instructions.cpu]).arg(&program);
            let there = answer(emulated, verb, &record)?;
            ensure!(
                here.len() == there.len(),
                "{verb} {}: {} and {} numbers",
                record.display(),
                here.len(),
                there.len()
            );
            let apart = here.iter().zip(&there).map(|((a, error), (b, _))| (a - b).abs() / error).fold(0.0, f64::max);
            let (numbers, most) = largest.entry(verb).or_default();
            *numbers += here.len();
            *most = most.max(apart);
        }
    }
    for (verb, (numbers, most)) in largest {
        println!("== {verb}: {numbers} numbers of {FILES} records, apart by {most:.1e} standard errors at most");
        ensure!(numbers > 0 && most < MAX_DIFFERENCE, "{verb}: none, or more than {MAX_DIFFERENCE} standard errors");
    }
    Ok(())
}

/// The numbers of an answer, each with its standard error: time constants, or gas temperatures.
fn answer(mut program: Command, verb: &str, record: &Path) -> Result<Vec<(f64, f64)>> {
    let gas = record.with_extension("gas.csv");
    program.arg(verb).arg(record).args(["--json", "--quiet"]).stderr(Stdio::null());
    if verb == "compensate" {
        program.arg("--out").arg(&gas).arg("--force");
    }
    let said = program.output().with_context(|| format!("{program:?}"))?;
    if verb == "compensate" {
        return series(&gas);
    }
    let json: Value = serde_json::from_slice(&said.stdout).with_context(|| format!("{program:?}"))?;
    let sensors = if verb == "diagnose" { &json["final"]["sensors"] } else { &json["sensors"] };
    let number = |sensor: &Value| Some((sensor["time_constant_s"].as_f64()?, sensor["standard_error_s"].as_f64()?));
    Ok(sensors.as_array().context("two sensors")?.iter().filter_map(number).collect())
}

/// Gas temperatures with their standard deviations; those that are not given are left out.
fn series(gas: &Path) -> Result<Vec<(f64, f64)>> {
    let mut out = Vec::new();
    for row in csv::Reader::from_path(gas)?.records() {
        let row = row?;
        if let (Ok(value), Ok(std)) = (row[1].parse(), row[2].parse()) {
            out.push((value, std));
        }
    }
    Ok(out)
}
