//! A fleet of records of many rigs, some of them damaged: what `twinlag batch` is measured on.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use rayon::prelude::*;
use twinlag::record::{Decimals, write_csv};
use twinlag::signal::{Rig, Simulated};

/// One file in this many is damaged.
const DAMAGED_EVERY: usize = 10;
/// Fractional part of the golden ratio: its multiples spread evenly over [0, 1).
const GOLDEN_SHARE: f64 = 0.618_033_988_749_895;
/// Records of one rig.
const FILES_PER_RIG: usize = 10;

#[derive(Args)]
pub(crate) struct Fleet {
    /// The folder to make; it has a folder for each rig of ten records.
    dir: PathBuf,
    /// Files, of which one in ten is damaged.
    #[arg(long, default_value_t = 5000)]
    files: usize,
    /// Rows of each.
    #[arg(long, default_value_t = 20_000)]
    samples: usize,
}

pub(crate) fn run(fleet: &Fleet) -> Result<()> {
    make(&fleet.dir, fleet.files, fleet.samples)
}

/// Simulates a fleet into a folder that is made.
pub(crate) fn make(dir: &Path, files: usize, samples: usize) -> Result<()> {
    ensure!(!dir.exists(), "{} exists: name another folder", dir.display());
    (0..files).into_par_iter().try_for_each(|number| {
        let folder = dir.join(format!("rig-{:04}", number / FILES_PER_RIG));
        fs::create_dir_all(&folder)?;
        let record = rig(number, samples)?.simulate()?;
        let text = text(&record)?;
        let is_damaged = number % DAMAGED_EVERY == DAMAGED_EVERY - 1;
        let text = if is_damaged { damaged(&text, number / DAMAGED_EVERY) } else { text };
        write(&folder.join(format!("run-{:02}.csv", number % FILES_PER_RIG)), &text)
    })
}

/// The rig of a file: ten files have one pair of time constants, and each its own gas and noise.
fn rig(number: usize, samples: usize) -> Result<Rig> {
    let rig_number = (number / FILES_PER_RIG) as f64;
    // Time constants of the rigs spread evenly over a factor of two, whatever their number.
    let spread = 2.0_f64.powf((rig_number * GOLDEN_SHARE).fract());
    let text = format!(
        r#"
        seed = {number}
        [record]
        samples = {samples}
        sample_period_s = 0.002
        [gas]
        kind = "turbulence"
        mean_c = 50.0
        std_k = 15.0
        corner_hz = 3.0
        cutoff_hz = 60.0
        [[sensors]]
        channel = "T1"
        time_constant_s = {}
        noise = {{ std_k = 0.3 }}
        [[sensors]]
        channel = "T2"
        time_constant_s = {}
        noise = {{ std_k = 0.3 }}
        "#,
        0.0238 * spread,
        0.1168 * spread,
    );
    toml::from_str(&text).context("the rig of the fleet")
}

/// As a logger writes it, to three decimals.
fn text(record: &Simulated) -> Result<String> {
    let columns = [("time_s", &record.time_s[..]), ("T1", &record.t1_c), ("T2", &record.t2_c)];
    let mut bytes = Vec::new();
    write_csv(&mut bytes, &columns, Decimals::Fixed(3))?;
    Ok(String::from_utf8(bytes)?)
}

/// What is wrong with a damaged file: nothing in it, one column, text for numbers, time that runs back, three rows.
fn damaged(text: &str, kind: usize) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let first_cell = |line: &&str| line.split(',').next().unwrap_or("").to_owned();
    match kind % 5 {
        0 => String::new(),
        1 => lines.iter().map(first_cell).collect::<Vec<_>>().join("\n"),
        2 => text.replace(['1', '2', '3'], "x"),
        3 => [&lines[..1], &lines[1..].iter().rev().copied().collect::<Vec<_>>()].concat().join("\n"),
        _ => lines[..lines.len().min(4)].join("\n"),
    }
}

fn write(path: &Path, text: &str) -> Result<()> {
    fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}
