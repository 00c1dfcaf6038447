//! A fleet of records of many rigs, some of them damaged: what `twinlag batch` is measured on.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use rayon::prelude::*;
use twinlag::signal::{Rig, Simulated};

/// One file in so many is damaged.
const DAMAGED_EVERY: usize = 10;
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
    ensure!(!fleet.dir.exists(), "{} exists: name another folder", fleet.dir.display());
    (0..fleet.files).into_par_iter().try_for_each(|number| {
        let folder = fleet.dir.join(format!("rig-{:04}", number / FILES_PER_RIG));
        fs::create_dir_all(&folder)?;
        let record = rig(number, fleet.samples)?.simulate()?;
        let text = text(&record);
        let is_damaged = number % DAMAGED_EVERY == DAMAGED_EVERY - 1;
        let text = if is_damaged { damaged(&text, number / DAMAGED_EVERY) } else { text };
        write(&folder.join(format!("run-{:02}.csv", number % FILES_PER_RIG)), &text)
    })
}

/// The rig of a file: ten files have one pair of time constants, and each its own gas and noise.
fn rig(number: usize, samples: usize) -> Result<Rig> {
    let turn = (number / FILES_PER_RIG) as f64;
    // Time constants of the rigs spread evenly over a factor of two, whatever their number.
    let spread = 2.0_f64.powf((turn * 0.618_033_988_749_895).fract());
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
        time_constant_s = {}
        noise = {{ std_k = 0.3 }}
        [[sensors]]
        time_constant_s = {}
        noise = {{ std_k = 0.3 }}
        "#,
        0.0238 * spread,
        0.1168 * spread,
    );
    toml::from_str(&text).context("the rig of the fleet")
}

/// As a logger writes it, with five digits.
fn text(record: &Simulated) -> String {
    let mut text = "time_s,T1,T2\n".to_owned();
    for ((time_s, t1_c), t2_c) in record.time_s.iter().zip(&record.t1_c).zip(&record.t2_c) {
        writeln!(text, "{time_s:.3},{t1_c:.3},{t2_c:.3}").expect("a string takes everything");
    }
    text
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
